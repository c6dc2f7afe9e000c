#include "figures.h"

#include <nebel/nebel.h>

#include <string.h>

static double ratio_of(const nb_figure *figure)
{
    return figure->value / figure->floor;
}

static int has_target(const nb_figure *figure)
{
    return figure->at_least > 0 || figure->at_most > 0 || figure->value_at_most > 0;
}

static int is_met(const nb_figure *figure)
{
    if (figure->value_at_most > 0) return figure->value <= figure->value_at_most;
    return figure->at_least > 0 ? ratio_of(figure) >= figure->at_least : ratio_of(figure) <= figure->at_most;
}

static void print_target(const nb_figure *figure, FILE *file)
{
    if (!has_target(figure)) return;
    if (figure->at_least > 0) (void)fprintf(file, "  at least %g x", figure->at_least);
    if (figure->at_most > 0) (void)fprintf(file, "  at most %g x", figure->at_most);
    if (figure->value_at_most > 0) (void)fprintf(file, "  at most %g %s", figure->value_at_most, figure->unit);
    (void)fprintf(file, ": %s", is_met(figure) ? "met" : "NOT MET");
}

static void print_line(const nb_figures *figures, const nb_figure *figure)
{
    FILE *const file = figures->table;
    const size_t before = figures->count - 1;
    if (before == 0 || strcmp(figures->list[before - 1].group, figure->group) != 0) {
        (void)fprintf(file, "\n%s\n", figure->group);
    }
    (void)fprintf(file, "  %-46s %9.4g %-13s", figure->name, figure->value, figure->unit);
    if (figure->floor_name != NULL) {
        (void)fprintf(file, " %6.3g x %s (%.4g)", ratio_of(figure), figure->floor_name, figure->floor);
    }
    print_target(figure, file);
    (void)fprintf(file, "\n");
    (void)fflush(file);
}

void nb_figures_add(nb_figures *figures, const nb_figure *figure)
{
    if (figures->count >= sizeof figures->list / sizeof *figures->list) return;
    nb_figure *const added = &figures->list[figures->count++];
    *added = *figure;
    if (figures->quick) added->at_least = added->at_most = added->value_at_most = 0;
    if (figures->table != NULL) print_line(figures, added);
}

static void write_text(const char *text, FILE *file)
{
    (void)fputc('"', file);
    for (const unsigned char *c = (const unsigned char *)text; *c != '\0'; c++) {
        if (*c == '"' || *c == '\\') {
            (void)fprintf(file, "\\%c", *c);
        } else if (*c >= ' ' && *c < 127) {
            (void)fputc(*c, file);
        }
    }
    (void)fputc('"', file);
}

static void write_figure(const nb_figure *figure, FILE *file)
{
    (void)fprintf(file, "    {\"group\": ");
    write_text(figure->group, file);
    (void)fprintf(file, ", \"name\": ");
    write_text(figure->name, file);
    (void)fprintf(file, ", \"unit\": ");
    write_text(figure->unit, file);
    (void)fprintf(file, ", \"value\": %.6g", figure->value);
    if (figure->floor_name != NULL) {
        (void)fprintf(file, ", \"floor\": {\"name\": ");
        write_text(figure->floor_name, file);
        (void)fprintf(file, ", \"value\": %.6g}, \"ratio\": %.6g", figure->floor, ratio_of(figure));
    }
    if (figure->at_least > 0) (void)fprintf(file, ", \"at_least\": %g", figure->at_least);
    if (figure->at_most > 0) (void)fprintf(file, ", \"at_most\": %g", figure->at_most);
    if (figure->value_at_most > 0) (void)fprintf(file, ", \"value_at_most\": %g", figure->value_at_most);
    if (has_target(figure)) (void)fprintf(file, ", \"met\": %s", is_met(figure) ? "true" : "false");
    (void)fprintf(file, "}");
}

void nb_figures_write_json(const nb_figures *figures, FILE *file)
{
    (void)fprintf(file, "{\n  \"nebel\": \"%s\",\n  \"processor\": ", nebel_version());
    write_text(figures->processor, file);
    (void)fprintf(file, ",\n  \"compiler\": ");
    write_text(figures->compiler, file);
    (void)fprintf(file, ",\n  \"quick\": %s,\n  \"figures\": [\n", figures->quick ? "true" : "false");
    for (size_t i = 0; i < figures->count; i++) {
        if (i > 0) (void)fprintf(file, ",\n");
        write_figure(&figures->list[i], file);
    }
    (void)fprintf(file, "\n  ]\n}\n");
}
