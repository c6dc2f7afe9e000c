// Volumes, nebulae and cells.
#include "fog_panel.h"

#include "widgets.h"
#include "keyframe_edit.h"
#include "owned_shape.h"

#include <float.h>
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
bool draw_visibility(double extinction[3], double contrast)
{
    const double farthest = 1e5, amount = mean(extinction);
    double visibility = amount > 0 ? nebel_extinction_from_visibility(1, contrast) / amount : farthest;
    if (!slide("visibility", &visibility, 0.1, farthest, amount > 0 ? "%.4g m" : "no fog", true,
               "How far one sees: there contrast has fallen to the number below. Keeps the colour of the extinction. "
               "Ctrl + click types a number in."))
        return false;
    const double wanted = nebel_extinction_from_visibility(visibility, contrast);
    for (int c = 0; c < 3; c++) extinction[c] = amount > 0 ? extinction[c] * (wanted / amount) : wanted;
    return true;
}

// The visibility stays. A volume with keys has one contrast at each, which the file keeps.
bool draw_contrast(double extinction[3], nebel_volume_track *entry)
{
    double contrast = entry->contrast;
    if (!slide("contrast", &contrast, 0.001, 0.9, "%.3g", true,
               "What is left of the contrast at the visibility: 0.05 by the meteorologists, 0.02 by Koschmieder."))
        return false;
    if (!(contrast > 0 && contrast < 1)) return false;
    for (int c = 0; c < 3; c++) extinction[c] *= log(contrast) / log(entry->contrast);
    entry->contrast = contrast;
    return true;
}

bool draw_amount(double extinction[3], nebel_volume_track *entry)
{
    bool changed = draw_visibility(extinction, entry->contrast);
    if (entry->key_count == 0) changed |= draw_contrast(extinction, entry);
    return drag("extinction [1/m]", extinction, 3, 1e-4, 0, "%.4g",
                "Of red, green and blue: after 1 / extinction metres 37 % of the light are left. 0: no fog.") ||
           changed;
}

bool draw_phase(nebel_phase *phase)
{
    static const char *const names[] = {"isotropic", "Henyey-Greenstein", "Rayleigh", "Cornette-Shanks",
                                        "Draine",    "droplets"};
    static const nebel_phase_type types[] = {NEBEL_PHASE_ISOTROPIC, NEBEL_PHASE_HENYEY_GREENSTEIN,
                                             NEBEL_PHASE_RAYLEIGH,  NEBEL_PHASE_CORNETTE_SHANKS,
                                             NEBEL_PHASE_DRAINE,    NEBEL_PHASE_DROPLETS};
    const int count = sizeof types / sizeof *types;
    int type = 0;
    while (type < count - 1 && types[type] != phase->type) type++;
    bool changed = choose(
        "phase", &type, names, count,
        "Into which direction sunlight is scattered. Under ambient light that is the same from everywhere all look the "
        "same.");
    phase->type = types[type];
    if (phase->type == NEBEL_PHASE_HENYEY_GREENSTEIN || phase->type == NEBEL_PHASE_CORNETTE_SHANKS ||
        phase->type == NEBEL_PHASE_DRAINE)
        changed |= slide("g", &phase->g, -0.99, 0.99, "%.3f", false, "Mean cosine: 1 goes straight on, -1 comes back.");
    if (phase->type == NEBEL_PHASE_DRAINE)
        changed |= slide("alpha", &phase->alpha, 0, 1000, "%.3g", true,
                         "0: Henyey-Greenstein, 1: Cornette-Shanks; much: light is sent on and back, not aside.");
    if (phase->type != NEBEL_PHASE_DROPLETS) return changed;
    if (!(phase->diameter > 0)) phase->diameter = 10;
    return slide("diameter", &phase->diameter, 0.1, NEBEL_MAX_DROPLET_DIAMETER, "%.3g um", true, "Of a droplet.") ||
           changed;
}

// A volume is lit in one way at all its keys.
bool draw_light(nebel_volume_desc *volume, const nebel_volume_track *entry)
{
    const bool is_lit = !is_zero(volume->albedo) || (entry->base != nullptr && !is_zero(entry->base->albedo));
    bool changed = false;
    if (!is_lit)
        changed |= pick("source", volume->source, false, "What thick fog looks like: the radiance of opaque fog.");
    if (is_lit || (is_zero(volume->source) && entry->key_count == 0)) {
        changed |=
            pick("albedo", volume->albedo, true,
                 "What share of the light it scatters: 0 is smoke, 1 is mist. Lit by the ambient light and the sun.");
        if (is_lit) changed |= draw_phase(&volume->phase);
    }
    return pick("emission [1/m]", volume->emission, false, "What it shines by itself, radiance per metre.") || changed;
}

// The unit of a file costs a few last digits.
bool is_of(const nebel_volume_desc *volume, const nebel_fog_preset *preset)
{
    for (int c = 0; c < 3; c++)
        if (!(fabs(volume->extinction[c] / preset->extinction[c] - 1) < 1e-12) ||
            volume->albedo[c] != preset->albedo[c])
            return false;
    return volume->phase.type == preset->phase.type && volume->phase.g == preset->phase.g &&
           volume->phase.alpha == preset->phase.alpha && volume->phase.diameter == preset->phase.diameter;
}

// Measured fog, by its name where the numbers are still its own.
bool draw_preset(nebel_volume_desc *volume)
{
    enum { MOST = 16 };
    size_t count;
    const nebel_fog_preset *presets = nebel_list_fog_presets(&count);
    const char *names[1 + MOST] = {"its own"};
    int chosen = 0;
    if (count > MOST) count = MOST;
    for (size_t i = 0; i < count; i++) {
        names[1 + i] = presets[i].name;
        if (is_of(volume, &presets[i])) chosen = int(i) + 1;
    }
    if (!choose("preset", &chosen, names, int(count) + 1,
                "Fog as it was measured: extinction, albedo and phase. Change them afterwards as you like."))
        return false;
    if (chosen == 0) return false;
    const nebel_fog_preset *preset = &presets[chosen - 1];
    for (int c = 0; c < 3; c++) {
        volume->extinction[c] = preset->extinction[c];
        volume->albedo[c] = preset->albedo[c];
        volume->source[c] = 0;
    }
    volume->phase = preset->phase;
    return true;
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
        (volume->density.type == NEBEL_DENSITY_GRID && shape != NEBEL_SHAPE_BOX) ||
        (volume->density.type == NEBEL_DENSITY_SOFT_EDGE && !has_edge))
        volume->density.type = NEBEL_DENSITY_CONSTANT;
}

bool draw_numbers(nb_panel *panel, nebel_volume_desc *volume, nebel_volume_track *entry, double reach)
{
    static const char *const operations[] = {"adds", "excludes", "replaces"};
    int operation = volume->operation;
    const nebel_shape_type type = volume->shape.type;
    bool changed = choose("operation", &operation, operations, NEBEL_OPERATION_COUNT,
                          "Adds: fog beside other fog. Excludes: no fog of the same or a lower priority is inside. "
                          "Replaces: this fog in the place of all of a lower priority.");
    volume->operation = nebel_operation(operation);
    if (volume->operation != NEBEL_OPERATION_EXCLUDE) {
        if (entry->key_count == 0) changed |= draw_preset(volume);
        changed |= draw_amount(volume->extinction, entry);
        changed |= draw_light(volume, entry);
        changed |= draw_density(panel, &volume->density, reach, true);
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
    if (changed) panel->is_out_of_memory |= nb_document_state_rename(panel->now, index, name) != 0;
    return changed;
}

// What one may do with the volume as a whole. Returns whether it has gone.
bool draw_commands(nb_panel *panel, size_t index, nebel_volume_origin origin)
{
    char name[160];
    if (press("Duplicate", "A new volume with the same numbers. It will stand at the end of the file's fog.")) {
        const nebel_volume_desc copy = panel->now->volumes[index];
        const nebel_volume_track entry = panel->now->entries[index];
        snprintf(name, sizeof name, "%.120s copy", panel->now->names[index]);
        panel->is_out_of_memory |= nb_document_state_add(panel->now, &copy, &entry, name) != 0;
        panel->fog_changed = 1;
    }
    if (origin != NEBEL_VOLUME_STATIC && origin != NEBEL_VOLUME_ANIMATED) return false;
    ImGui::SameLine();
    if (!press("Remove", "Takes the volume away. Ctrl + Z brings it back.")) return false;
    nb_document_state_remove(panel->now, index);
    panel->fog_changed = 1;
    return true;
}

/* ---- keys
 * ------------------------------------------------------------------------------------------------------------
 */

// Returns whether it goes.
bool draw_key(nb_panel *panel, size_t index, size_t key)
{
    const Owner owner("keys", key);
    const bool is_here = panel->now->entries[index].keys[key].frame == *panel->frame;
    double frame = panel->now->entries[index].keys[key].frame;
    ImGui::SetNextItemWidth(90 * scale);
    if (drag("##frame", &frame, 1, 25, -DBL_MAX, "frame %.4g", "When it is so. No further than to the next key.")) {
        nb_keys_move(panel->now, index, key, frame);
        panel->fog_changed = 1;
    }
    ImGui::SameLine();
    if (press_if(!is_here, is_here ? "here" : "Go", "To this frame: what is changed then changes this key.")) {
        *panel->frame = frame;
        panel->frame_changed = 1;
    }
    ImGui::SameLine();
    return press("x", "Takes this key away. The last one leaves the volume as it is there.");
}

void draw_keys(nb_panel *panel, size_t index)
{
    const nebel_volume_track &entry = panel->now->entries[index];
    const bool is_open =
        ImGui::TreeNodeEx("keys", entry.key_count > 0 ? ImGuiTreeNodeFlags_DefaultOpen : 0,
                          entry.key_count > 0 ? "keys: %u" : "keys: it stands still", unsigned(entry.key_count));
    note_place("keys");
    if (!is_open) return;
    size_t gone = entry.key_count;
    bool is_here = false;
    for (size_t i = 0; i < entry.key_count; i++) {
        is_here |= entry.keys[i].frame == *panel->frame;
        if (draw_key(panel, index, i)) gone = i;
    }
    if (gone < entry.key_count) {
        nb_keys_remove(panel->now, index, gone);
        panel->fog_changed = 1;
    } else if (!is_here && press("Add a key here", "At the present frame, see Time: the volume as it is then.")) {
        panel->is_out_of_memory |= nb_keys_set(panel->now, index, *panel->frame) != 0;
        panel->fog_changed = 1;
    }
    if (entry.key_count > 0 && !is_here) ImGui::TextDisabled("between keys: a change makes one here");
    ImGui::TreePop();
}

bool draw_open_volume(nb_panel *panel, size_t index, double reach)
{
    static const char *const origins[] = {"", "", "settings of another program: changes here are not saved",
                                          "a node of a model: changes here are not saved"};
    const nebel_volume_origin origin = panel->origins[index];
    const bool is_saved = origin == NEBEL_VOLUME_STATIC || origin == NEBEL_VOLUME_ANIMATED;
    if (is_saved)
        panel->fog_changed |= draw_name(panel, index);
    else
        ImGui::TextDisabled("%s", origins[origin]);
    panel->fog_changed |= draw_numbers(panel, &panel->now->volumes[index], &panel->now->entries[index], reach);
    if (is_saved) draw_keys(panel, index);
    return draw_commands(panel, index, origin);
}

bool draw_volume(nb_panel *panel, size_t index, double reach)
{
    const Owner owner("fog", index);
    char title[200];
    const char *const name = panel->now->names[index];
    static const char *const marks[] = {"", " (moves)", " *", " *"};
    snprintf(title, sizeof title, "%.100s%s###volume", name[0] != '\0' ? name : "(no name)",
             marks[panel->origins[index]]);
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
    const nebel_volume_track entry = nb_document_state_plain_entry();
    panel->is_out_of_memory |= nb_document_state_add(panel->now, &volume, &entry, "new") != 0;
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

bool draw_distribution(nb_panel *panel, nebel_nebula_desc *nebula, nebel_transform *place, double reach)
{
    int count = int(nebula->count), seed = int(nebula->seed);
    bool changed = false;
    if (nebula->points == nullptr) {
        changed |= slide_whole("particles", &count, 1, MOST_PARTICLES, true, "How many there are.");
        changed |= draw_density(panel, &nebula->density, reach, false);
        changed |= slide("dimming", &nebula->dimming, 0, 1, "%.2f", false,
                         "How much the density dims particles, in place of thinning them out.");
        changed |= draw_shape(panel, &nebula->shape, reach, true);
    } else {
        ImGui::TextDisabled("%u points of a model", unsigned(nebula->count));
        changed |= draw_transform(place, reach);
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
                        "How far eddies carry particles from where they were distributed.");
    return drag("eddies", &nebula->turbulence_scale, 1, reach / 10, 0,
                nebula->turbulence_scale > 0 ? "%.4g m" : "a quarter of the shape",
                "How large the largest eddies are. 0: a quarter of the extent.") ||
           changed;
}

// Factors of the emission.
bool draw_colors(nb_panel *panel, nebel_nebula_desc *nebula)
{
    bool changed = false;
    size_t wanted = nebula->color_count;
    for (size_t i = 0; i < nebula->color_count; i++) {
        const Owner owner("colors", i);
        changed |= pick(i == 0 ? "colours" : "##color", const_cast<double *>(nebula->colors[i]), false,
                        "Factors of the emission, which drift through the nebula from the first to the last.");
    }
    if (nebula->color_count < 64 && press("Add a colour", "Behind the last one.")) wanted++;
    if (nebula->color_count > 0) {
        ImGui::SameLine();
        if (press("Remove the last", "Without any colour all particles shine alike.")) wanted--;
    }
    if (wanted == nebula->color_count) return changed;
    panel->is_out_of_memory |= nb_document_state_set_colors(nebula, wanted) != 0;
    return true;
}

bool draw_nebula_numbers(nb_panel *panel, nebel_nebula_desc *nebula, nebel_transform *place, double reach)
{
    static const char *const profiles[] = {"soft", "gaussian", "uniform"};
    int profile = nebula->profile;
    bool changed = draw_distribution(panel, nebula, place, reach);
    changed |= choose("profile", &profile, profiles, NEBEL_PARTICLE_PROFILE_COUNT,
                      "How a particle thins from its middle to its surface.");
    nebula->profile = nebel_particle_profile(profile);
    changed |= drag("radius range [m]", nebula->radius_range, 2, 0.01, 1e-6, "%.4g",
                    "Radius of the smallest and the largest particle.");
    changed |= drag("absorption [1/m]", nebula->absorption, 3, 0.01, 0, "%.4g", "In the middle of a particle.");
    changed |=
        pick("emission [1/m]", nebula->emission, false, "What the middle of a particle shines, radiance per metre.");
    changed |= draw_colors(panel, nebula);
    return draw_turbulence(nebula, reach) || changed;
}

// Of fog in cells, as the method of that name has it.
bool draw_cells_section(nebel_cells_desc *desc)
{
    static const char *const models[] = {"linear", "exponential"};
    static const char *const spans[] = {"along the ray", "depth", "depth as printed"};
    int model = desc->model, span = desc->span, is_grouped = !desc->ungrouped;
    bool changed = choose("model", &model, models, NEBEL_CELL_MODEL_COUNT,
                          "Of the method cells alone: density times length, at most 1; or 1 - exp of that.");
    changed |= choose("span", &span, spans, NEBEL_SPAN_COUNT,
                      "Of the method cells alone: the length in fog is along the ray, or along the camera's axis; as "
                      "printed it is wrong off the middle of the picture.");
    changed |= tick("grouping", &is_grouped, "Cells that touch and have the same fog are one; otherwise a seam shows.");
    desc->model = nebel_cell_model(model);
    desc->span = nebel_cell_span(span);
    desc->ungrouped = !is_grouped;
    return changed;
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
        panel->fog_changed |= draw_nebula_numbers(panel, &panel->now->nebulae[i], &panel->now->nebula_places[i], reach);
        ImGui::Unindent(4 * scale);
    }
}

void draw_cells(nb_panel *panel, double reach)
{
    if (panel->now->cells == nullptr) return;
    ImGui::Text("Cells: %u", unsigned(panel->now->cells_desc.cell_count));
    const bool shows_method = ImGui::TreeNode("of the method cells");
    note_place("of the method cells");
    if (shows_method) {
        panel->fog_changed |= draw_cells_section(&panel->now->cells_desc);
        ImGui::TreePop();
    }
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
