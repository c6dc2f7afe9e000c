// Volumes, nebulae and cells.
#include "fog_panel.h"

#include "controls.h"
#include "shape.h"

#include <limits.h>
#include <math.h>
#include <string.h>

namespace
{

using namespace controls;

double mean(const double rgb[3])
{
    return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

bool is_zero(const double rgb[3])
{
    return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0;
}

/* ---- one volume
 * ------------------------------------------------------------------------------------------------------
 */

// Visibility is that of the mean extinction; its slider keeps the colour.
bool draw_amount(double extinction[3])
{
    const double farthest = 1e5, amount = mean(extinction);
    double visibility = amount > 0 ? nebel_extinction_from_visibility(1, 0) / amount : farthest;
    bool changed = false;
    if (slide("visibility", &visibility, 0.1, farthest, amount > 0 ? "%.4g m" : "no fog", true,
              "How far one sees: there contrast has fallen to 5 %. Keeps the colour of the extinction. Ctrl + click "
              "types "
              "a number in.")) {
        const double wanted = nebel_extinction_from_visibility(visibility, 0);
        for (int c = 0; c < 3; c++) extinction[c] = amount > 0 ? extinction[c] * (wanted / amount) : wanted;
        changed = true;
    }
    return drag("extinction", extinction, 3, 1e-4, 0, "%.4g",
                "Of red, green and blue [1/m]: after 1 / extinction metres 37 % of the light are left. 0: no fog.") ||
           changed;
}

bool draw_light(nebel_volume_desc *volume, bool has_sun)
{
    bool changed = false;
    if (is_zero(volume->albedo))
        changed |= pick("source", volume->source, false, "What thick fog looks like: the radiance of opaque fog.");
    if (is_zero(volume->source) && (!has_sun || !is_zero(volume->albedo)))
        changed |= pick("albedo", volume->albedo, true,
                        "What share of the light it scatters: 0 is smoke, 1 is mist. Lit by the ambient light.");
    return pick("emission", volume->emission, false, "What it shines by itself, radiance per metre.") || changed;
}

bool draw_distances(nebel_volume_desc *volume)
{
    bool changed = ImGui::DragInt("priority", &volume->priority, 0.05f);
    note_place("priority");
    explain("Which volume wins where some exclude or replace others: the highest.");
    changed |= drag("start", &volume->start, 1, 1, 0, "%.4g m", "No fog of this volume nearer to the eye than this.");
    return drag("cutoff", &volume->cutoff, 1, 1, 0, volume->cutoff > 0 ? "%.4g m" : "none",
                "No fog of this volume farther from the eye than this; 0: no end. More than the start.") ||
           changed;
}

// A density that does not go with the shape would be refused.
void fit_density(nebel_volume_desc *volume)
{
    const nebel_shape_type shape = volume->shape.type;
    const bool is_round = shape == NEBEL_SHAPE_SPHERE || shape == NEBEL_SHAPE_ELLIPSOID;
    const bool has_edge = shape != NEBEL_SHAPE_WORLD && shape != NEBEL_SHAPE_UNION && shape != NEBEL_SHAPE_INTERSECTION;
    if ((volume->density.type == NEBEL_DENSITY_RADIAL && !is_round) ||
        (volume->density.type == NEBEL_DENSITY_SOFT_EDGE && !has_edge))
        volume->density.type = NEBEL_DENSITY_CONSTANT;
}

bool draw_numbers(nb_panel *panel, nebel_volume_desc *volume, double reach, bool has_sun)
{
    static const char *const operations[] = {"adds", "excludes", "replaces"};
    int operation = volume->operation;
    const nebel_shape_type type = volume->shape.type;
    bool changed = choose("operation", &operation, operations, NEBEL_OPERATION_COUNT,
                          "Adds: fog beside other fog. Excludes: no fog of the same or a lower priority is inside. "
                          "Replaces: this fog in the place of all of a lower priority.");
    volume->operation = nebel_operation(operation);
    if (volume->operation != NEBEL_OPERATION_EXCLUDE) {
        changed |= draw_amount(volume->extinction);
        changed |= draw_light(volume, has_sun);
        changed |= draw_density(&volume->density, panel->data->camera.look_at, reach);
    }
    changed |= draw_shape(panel, &volume->shape, reach, true);
    if (volume->shape.type != type) fit_density(volume);
    return draw_distances(volume) || changed;
}

bool draw_name(nb_panel *panel, size_t index)
{
    char name[128];
    snprintf(name, sizeof name, "%s", panel->now->names[index]);
    const bool changed = ImGui::InputText("name", name, sizeof name);
    note_place("name");
    explain("For people: it means nothing else.");
    if (changed) panel->is_out_of_memory |= nb_edition_rename(panel->now, index, name) != 0;
    return changed;
}

// What one may do with the volume as a whole. Returns whether it has gone.
bool draw_commands(nb_panel *panel, size_t index, nebel_volume_origin origin)
{
    char name[160];
    if (press("Duplicate", "A new volume with the same numbers. It will stand at the end of the file's fog.")) {
        const nebel_volume_desc copy = panel->now->volumes[index];
        snprintf(name, sizeof name, "%.120s copy", panel->now->names[index]);
        panel->is_out_of_memory |= nb_edition_add(panel->now, &copy, name) != 0;
        panel->fog_changed = 1;
    }
    if (origin != NEBEL_VOLUME_WRITTEN && origin != NEBEL_VOLUME_MOVING) return false;
    ImGui::SameLine();
    if (!press("Remove", "Takes the volume away. Ctrl + Z brings it back.")) return false;
    nb_edition_remove(panel->now, index);
    panel->fog_changed = 1;
    return true;
}

bool draw_open_volume(nb_panel *panel, size_t index, double reach)
{
    static const char *const origins[] = {"", "moves by its keys: changes here are not saved",
                                          "settings of another program: changes here are not saved",
                                          "a node of a model: changes here are not saved"};
    const nebel_volume_origin origin = panel->origins[index];
    if (origin != NEBEL_VOLUME_WRITTEN) ImGui::TextDisabled("%s", origins[origin]);
    const bool has_sun = panel->data->has_sun && !is_zero(panel->now->sun_irradiance);
    if (origin == NEBEL_VOLUME_WRITTEN) panel->fog_changed |= draw_name(panel, index);
    panel->fog_changed |= draw_numbers(panel, &panel->now->volumes[index], reach, has_sun);
    return draw_commands(panel, index, origin);
}

bool draw_volume(nb_panel *panel, size_t index, double reach)
{
    const Owner owner("fog", index);
    char title[200];
    const char *const name = panel->now->names[index];
    snprintf(title, sizeof title, "%.100s%s###volume", name[0] != '\0' ? name : "(no name)",
             panel->origins[index] != NEBEL_VOLUME_WRITTEN ? " *" : "");
    const bool is_open = ImGui::CollapsingHeader(title, panel->now->count <= 2 ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    note_place("open");
    if (!is_open) return false;
    ImGui::Indent(4 * scale);
    const bool is_gone = draw_open_volume(panel, index, reach);
    ImGui::Unindent(4 * scale);
    return is_gone;
}

/* ---- all volumes
 * -----------------------------------------------------------------------------------------------------
 */

// A grey box about where one looks, through which one sees half as far as it is away.
void add_volume(nb_panel *panel, double reach)
{
    const nebel_camera &camera = panel->data->camera;
    nebel_volume_desc volume;
    memset(&volume, 0, sizeof volume);
    volume.shape.transform.rotation[3] = 1;
    for (int i = 0; i < 3; i++) {
        volume.shape.transform.scale[i] = 1;
        volume.shape.min[i] = camera.look_at[i] - reach / 8;
        volume.shape.max[i] = camera.look_at[i] + reach / 8;
        volume.extinction[i] = nebel_extinction_from_visibility(reach / 2, 0);
        volume.source[i] = 0.5;
    }
    volume.shape.type = NEBEL_SHAPE_BOX;
    panel->is_out_of_memory |= nb_edition_add(panel->now, &volume, "new") != 0;
    panel->fog_changed = 1;
}

// Where there are so many that one loses sight.
enum { MANY = 12 };

bool is_wanted(const nb_panel *panel, const ImGuiTextFilter &filter, size_t index)
{
    return panel->now->count <= MANY || filter.PassFilter(panel->now->names[index]);
}

/* ---- nebulae
 * ---------------------------------------------------------------------------------------------------------
 */

enum { MOST_PARTICLES = 1000000 };

bool draw_strewing(nb_panel *panel, nebel_nebula_desc *nebula, double reach)
{
    int count = int(nebula->count), seed = int(nebula->seed);
    bool changed = false;
    if (nebula->points == nullptr) {
        changed |= slide_whole("particles", &count, 1, MOST_PARTICLES, true, "How many there are.");
        changed |= draw_density(&nebula->density, panel->data->camera.look_at, reach);
        changed |= draw_shape(panel, &nebula->shape, reach, true);
    } else {
        ImGui::TextDisabled("%u points of a model", unsigned(nebula->count));
    }
    changed |= ImGui::DragInt("seed", &seed, 0.1f, 0, INT_MAX, "%d", ImGuiSliderFlags_AlwaysClamp);
    note_place("seed");
    explain("Another number: the particles are in other places.");
    nebula->count = size_t(count);
    nebula->seed = uint64_t(seed);
    return changed;
}

bool draw_turbulence(nebel_nebula_desc *nebula, double reach)
{
    bool changed = drag("turbulence", &nebula->turbulence, 1, reach / 10, 0, "%.4g m",
                        "How far eddies carry particles from where they were strewn.");
    return drag("eddies", &nebula->turbulence_size, 1, reach / 10, 0,
                nebula->turbulence_size > 0 ? "%.4g m" : "a quarter of the shape",
                "How large the largest eddies are. 0: a quarter of the extent.") ||
           changed;
}

bool draw_nebula_numbers(nb_panel *panel, nebel_nebula_desc *nebula, double reach)
{
    static const char *const profiles[] = {"soft", "gaussian", "ball"};
    int profile = nebula->profile;
    bool changed = draw_strewing(panel, nebula, reach);
    changed |= choose("profile", &profile, profiles, NEBEL_PARTICLE_COUNT,
                      "How a particle thins from its middle to its surface.");
    nebula->profile = nebel_particle_profile(profile);
    changed |= drag("size", nebula->size, 2, 0.01, 1e-6, "%.4g m", "Radius of the smallest and the largest particle.");
    changed |= drag("absorption", nebula->absorption, 3, 0.01, 0, "%.4g", "In the middle of a particle [1/m].");
    changed |= pick("emission", nebula->emission, false, "What the middle of a particle shines, radiance per metre.");
    return draw_turbulence(nebula, reach) || changed;
}

} // namespace

void draw_fog(nb_panel *panel, double reach)
{
    static ImGuiTextFilter filter;
    const size_t count = panel->now->count; // without those that are added now
    ImGui::AlignTextToFramePadding();
    ImGui::Text("Fog: %u volume%s", unsigned(panel->now->count), panel->now->count == 1 ? "" : "s");
    ImGui::SameLine();
    if (press("Add a volume", "A box about where you look. What it is can be chosen then.")) add_volume(panel, reach);
    if (panel->now->count > MANY) filter.Draw("filter");
    for (size_t i = 0; i < count; i++)
        if (is_wanted(panel, filter, i) && draw_volume(panel, i, reach)) break; // the others have moved
}

void draw_nebulae(nb_panel *panel, double reach)
{
    for (size_t i = 0; i < panel->now->nebula_count; i++) {
        const Owner owner("nebula", i);
        const char *const name = panel->data->nebula_names[i];
        char title[160];
        snprintf(title, sizeof title, "%.100s (nebula)###nebula", name[0] != '\0' ? name : "(no name)");
        const bool is_open = ImGui::CollapsingHeader(title);
        note_place("open");
        if (!is_open) continue;
        ImGui::Indent(4 * scale);
        panel->fog_changed |= draw_nebula_numbers(panel, &panel->now->nebulae[i], reach);
        ImGui::Unindent(4 * scale);
    }
}

void draw_cells(nb_panel *panel, double reach)
{
    for (size_t i = 0; i < panel->now->cells_desc.cell_count; i++) {
        const Owner owner("cells", i);
        nebel_cell *const cell = &panel->now->cells[i];
        const char *const name = panel->cell_names[i];
        char title[160];
        snprintf(title, sizeof title, "%.100s (cell)###cell", name[0] != '\0' ? name : "(no name)");
        const bool is_open = ImGui::CollapsingHeader(title);
        note_place("open");
        if (!is_open) continue;
        ImGui::Indent(4 * scale);
        panel->fog_changed |= drag("density", &cell->density, 1, 0.01, 0, "%.4g / m", "How thick its fog is; 0: none.");
        panel->fog_changed |= pick("color", cell->color, false, "What thick fog in it looks like.");
        panel->fog_changed |= draw_shape(panel, &cell->shape, reach, false);
        ImGui::Unindent(4 * scale);
    }
}
