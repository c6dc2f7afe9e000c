#include "truth_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void give_up(const char *what, const char *where)
{
    fprintf(stderr, "truth file: %s: %.40s\n", what, where);
    exit(EXIT_FAILURE);
}

/* ---- JSON: places in the text instead of a tree ---------------------------------------------- */

static const char *skip_space(const char *s)
{
    return s + strspn(s, " \t\r\n");
}

static const char *skip_string(const char *s)
{
    for (s++; *s != '"'; s++) {
        if (*s == '\\') s++;
        if (*s == 0) give_up("string without end", s);
    }
    return s + 1;
}

/* Behind the value at s. */
static const char *skip_value(const char *s)
{
    int depth = 0;
    do {
        s = skip_space(s);
        if (*s == 0) give_up("value without end", s);
        if (*s == '"') {
            s = skip_string(s);
            continue;
        }
        if (strchr("[{", *s)) depth++;
        if (strchr("]}", *s)) depth--;
        if (strchr("[{]},:", *s))
            s++;
        else
            s += strcspn(s, " \t\r\n[]{},:\"");
    } while (depth > 0);
    return s;
}

/* The value of a key of the object at s, or NULL. */
static const char *member(const char *s, const char *key)
{
    const size_t length = strlen(key);
    s = skip_space(s) + 1;
    for (;;) {
        s = skip_space(s);
        if (*s != '"') return NULL;
        const char *const name = s + 1, *const end = skip_string(s);
        s = skip_space(skip_space(end) + 1);
        if ((size_t)(end - 1 - name) == length && memcmp(name, key, length) == 0) return s;
        s = skip_space(skip_value(s));
        if (*s == ',') s++;
    }
}

static const char *need(const char *s, const char *key)
{
    const char *const value = member(s, key);
    if (value == NULL) give_up("missing key", key);
    return value;
}

/* Element i of the array at s, or NULL. */
static const char *element(const char *s, size_t i)
{
    s = skip_space(skip_space(s) + 1);
    for (; *s != ']'; i--) {
        if (i == 0) return s;
        s = skip_space(skip_value(s));
        if (*s == ',') s = skip_space(s + 1);
    }
    return NULL;
}

static size_t length_of(const char *s)
{
    size_t n = 0;
    for (s = skip_space(skip_space(s) + 1); *s != ']'; n++) {
        s = skip_space(skip_value(s));
        if (*s == ',') s = skip_space(s + 1);
    }
    return n;
}

static int is_text(const char *s, const char *text)
{
    return *s == '"' && strncmp(s + 1, text, strlen(text)) == 0 && s[1 + strlen(text)] == '"';
}

/* Which of the texts, in the order of an enumeration. */
static int choice(const char *s, const char *const *texts, int count)
{
    for (int i = 0; i < count; i++)
        if (is_text(s, texts[i])) return i;
    give_up("unknown word", s);
    return 0;
}

static double number(const char *s, const char *key)
{
    return strtod(need(s, key), NULL);
}

/* Up to n numbers; a scalar stands for all of them. */
static void numbers(const char *s, double *out, size_t n)
{
    for (size_t i = 0; i < n; i++) out[i] = strtod(*s == '[' ? element(s, i) : s, NULL);
}

static void vector(const char *s, const char *key, double out[3])
{
    numbers(need(s, key), out, 3);
}

static void vector_or(const char *s, const char *key, double out[3])
{
    const char *const value = member(s, key);
    if (value != NULL) numbers(value, out, 3);
}

/* ---- descriptions ---------------------------------------------------------------------------- */

static void read_transform(const char *s, nebel_transform *t)
{
    vector_or(s, "position", t->position);
    vector_or(s, "scale", t->scale);
    if (member(s, "rotation") != NULL) numbers(member(s, "rotation"), t->rotation, 4);
}

static void read_planes(const char *s, nebel_shape *shape)
{
    shape->plane_count = length_of(s);
    nebel_plane *const planes = calloc(shape->plane_count, sizeof *planes);
    for (size_t i = 0; i < shape->plane_count; i++) {
        double four[4];
        numbers(element(s, i), four, 4);
        memcpy(planes[i].normal, four, sizeof planes[i].normal);
        planes[i].distance = four[3];
    }
    shape->planes = planes;
}

static void read_shape(const char *s, nebel_shape *shape)
{
    static const char *const types[] = {"world",    "half_space", "box",  "sphere", "ellipsoid",
                                        "cylinder", "capsule",    "cone", "convex"};
    shape->type = (nebel_shape_type)choice(need(s, "type"), types, 9);
    vector_or(s, "min", shape->min);
    vector_or(s, "max", shape->max);
    vector_or(s, "center", shape->center);
    vector_or(s, "radii", shape->radii);
    vector_or(s, "from", shape->from);
    vector_or(s, "to", shape->to);
    vector_or(s, "point", shape->point);
    vector_or(s, "normal", shape->normal);
    if (member(s, "radius")) shape->radius = number(s, "radius");
    if (member(s, "radius_from")) shape->radius_from = number(s, "radius_from");
    if (member(s, "radius_to")) shape->radius_to = number(s, "radius_to");
    if (member(s, "planes")) read_planes(member(s, "planes"), shape);
    if (member(s, "transform")) read_transform(member(s, "transform"), &shape->transform);
}

static void read_density(const char *s, nebel_density *d)
{
    static const char *const types[] = {"constant", "height", "linear", "radial", "gaussian", "soft_edge"};
    d->type = (nebel_density_type)choice(need(s, "type"), types, 6);
    if (member(s, "below"))
        d->below = is_text(member(s, "below"), "constant") ? NEBEL_BELOW_CONSTANT : NEBEL_BELOW_GROW;
    if (member(s, "base")) d->base = number(s, "base");
    if (member(s, "scale_height")) d->scale_height = number(s, "scale_height");
    if (member(s, "power")) d->power = (int)number(s, "power");
    if (member(s, "sigma")) d->sigma = number(s, "sigma");
    if (member(s, "distance")) d->edge_width = number(s, "distance");
    vector_or(s, "from", d->from);
    vector_or(s, "to", d->to);
    vector_or(s, "center", d->center);
}

/* One of the three ways to state an amount. */
static void read_amount(const char *s, double extinction[3])
{
    double value[3];
    if (member(s, "extinction")) {
        vector(s, "extinction", extinction);
    } else if (member(s, "mean_free_path")) {
        vector(s, "mean_free_path", value);
        for (int c = 0; c < 3; c++) extinction[c] = 1 / value[c];
    } else {
        vector(s, "visibility", value);
        const double contrast = member(s, "contrast") ? number(s, "contrast") : .05;
        for (int c = 0; c < 3; c++) extinction[c] = -log(contrast) / value[c];
    }
}

static void read_volume(const char *s, nebel_volume_desc *v)
{
    read_shape(need(s, "shape"), &v->shape);
    if (member(s, "operation") && is_text(member(s, "operation"), "exclude")) {
        v->operation = NEBEL_OPERATION_EXCLUDE;
        return;
    }
    if (member(s, "density")) read_density(member(s, "density"), &v->density);
    read_amount(s, v->extinction);
    vector_or(s, "source", v->source);
    vector_or(s, "albedo", v->albedo);
    vector_or(s, "emission", v->emission);
}

static void read_ray(const char *ray, const char *expected, truth_ray *r)
{
    double in[7], out[7];
    numbers(ray, in, 7);
    numbers(expected, out, 7);
    memcpy(r->ray.origin, in, sizeof r->ray.origin);
    memcpy(r->ray.direction, in + 3, sizeof r->ray.direction);
    r->ray.t_max = in[6];
    memcpy(r->T, out, sizeof r->T);
    memcpy(r->S, out + 3, sizeof r->S);
    r->uncertainty = out[6];
}

static char *read_text(const char *folder, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *const file = fopen(path, "rb");
    if (file == NULL) give_up("cannot open", path);
    fseek(file, 0, SEEK_END);
    const long size = ftell(file);
    rewind(file);
    char *const text = calloc((size_t)size + 1, 1);
    if (text == NULL || fread(text, 1, (size_t)size, file) != (size_t)size) give_up("cannot read", path);
    fclose(file);
    return text;
}

truth_file truth_read(const char *folder, const char *name)
{
    truth_file file = {0};
    char *const text = read_text(folder, name);
    const char *const scene = need(text, "scene"), *const fog = need(scene, "fog");
    const char *const rays = need(text, "rays"), *const expected = need(text, "expected");
    vector_or(scene, "ambient", file.ambient);
    file.volume_count = length_of(fog);
    file.ray_count = length_of(rays);
    file.volumes = calloc(file.volume_count, sizeof *file.volumes);
    file.rays = calloc(file.ray_count, sizeof *file.rays);
    for (size_t i = 0; i < file.volume_count; i++) read_volume(element(fog, i), &file.volumes[i]);
    for (size_t i = 0; i < file.ray_count; i++) read_ray(element(rays, i), element(expected, i), &file.rays[i]);
    free(text);
    return file;
}

void truth_free(truth_file *file)
{
    for (size_t i = 0; i < file->volume_count; i++) free((void *)file->volumes[i].shape.planes);
    free(file->volumes);
    free(file->rays);
}
