// Planets: their air, clouds and shells.
#include "planet_panel.h"

#include "widgets.h"

#include <float.h>
#include <math.h>

namespace
{

using namespace controls;

// Returns whether it is open; then close_entry is to follow.
bool open_entry(const char *title)
{
    char text[64];
    snprintf(text, sizeof text, "%.40s###entry", title);
    const bool is_open = ImGui::CollapsingHeader(text);
    note_place("open");
    if (is_open) ImGui::Indent(4 * scale);
    return is_open;
}

void close_entry()
{
    ImGui::Unindent(4 * scale);
}

/* ---- air
 * -------------------------------------------------------------------------------------------------------------
 */

const char *name_of(const nebel_atmosphere_component &air)
{
    if (air.profile == NEBEL_COMPONENT_TENT) return "layer, as of ozone";
    return air.phase.type == NEBEL_PHASE_RAYLEIGH ? "air" : "haze";
}

// Of the colour that is dimmed most; the others keep their share of it, as do scattering and absorption: less than this would lose them.
const double least_amount = 1e-15;

bool slide_amount(nebel_atmosphere_component *air)
{
    double before = 0;
    for (int c = 0; c < 3; c++) before = fmax(before, air->scattering[c] + air->absorption[c]);
    double per_kilometre = before * 1e3;
    if (!slide("density", &per_kilometre, 1e-4, 100, "%.4g / km", true,
               "What it takes of light at its densest, of the colour that it takes most of; the colour stays."))
        return false;
    const double amount = fmax(least_amount, fmin(NEBEL_MAX_COMPONENT_EXTINCTION / 2, per_kilometre * 1e-3));
    for (int c = 0; c < 3; c++) {
        air->scattering[c] = before > 0 ? air->scattering[c] * (amount / before) : amount;
        air->absorption[c] *= before > 0 ? amount / before : 1;
    }
    return true;
}

bool draw_air(nebel_atmosphere_component *air)
{
    const nebel_phase_type phase = air->phase.type;
    bool changed = slide_amount(air);
    if (air->profile == NEBEL_COMPONENT_EXPONENTIAL)
        changed |=
            drag_length("scale height", &air->scale_height, "Where it is 1 / e = 0.37 as dense as at the ground.");
    if (air->profile == NEBEL_COMPONENT_TENT) {
        changed |=
            drag("center height", &air->center_height, 1, 1, 0, "%.4g m", "Above the ground: where it is densest.");
        changed |= drag_length("half width", &air->half_width, "From its center to either end.");
    }
    if (phase == NEBEL_PHASE_HENYEY_GREENSTEIN || phase == NEBEL_PHASE_CORNETTE_SHANKS || phase == NEBEL_PHASE_DRAINE)
        changed |= slide("g", &air->phase.g, -0.95, 0.95, "%.3f", false,
                         "The mean cosine of the angle by which it turns light: more than 0 is forwards.");
    return changed;
}

bool draw_airs(nebel_planet *planet)
{
    bool changed = false;
    for (uint32_t i = 0; i < planet->atmosphere_desc.component_count; i++) {
        const Owner owner("components", i);
        if (!open_entry(name_of(planet->atmosphere_desc.components[i]))) continue;
        changed |= draw_air(&planet->atmosphere_desc.components[i]);
        close_entry();
    }
    return changed;
}

/* ---- clouds with volume
 * ----------------------------------------------------------------------------------------------
 */

// A number of a layer, shown as it is where the file has none.
typedef double nebel_cloud_layer::*Member;

bool slide_part(nebel_cloud_layer *layer, const nebel_cloud_layer &shown, Member member, const char *name,
                const char *help)
{
    double part = fmax(0, shown.*member);
    if (!slide(name, &part, 0, 1, "%.2f", false, help)) return false;
    layer->*member = part > 0 ? fmin(1, part) : NEBEL_ZERO;
    return true;
}

bool drag_height(nebel_cloud_layer *layer, const nebel_cloud_layer &shown, Member member, const char *name,
                 const char *help)
{
    double height = shown.*member;
    if (!drag_length(name, &height, help)) return false;
    layer->*member = height;
    return true;
}

// Of no coverage there would be no layer.
bool slide_coverage(double *coverage, double shown)
{
    double part = shown;
    if (!slide("coverage", &part, 0.01, 1, "%.2f", false, "The part of the planet that is under clouds.")) return false;
    *coverage = fmax(0.01, fmin(1, part));
    return true;
}

bool slide_extinction(nebel_cloud_layer *layer, const nebel_cloud_layer &shown)
{
    double extinction = shown.extinction;
    if (!slide("density", &extinction, 1e-4, 1, "%.4g / m", true, "Extinction in the middle of clouds.")) return false;
    layer->extinction = fmax(1e-12, fmin(NEBEL_MAX_COMPONENT_EXTINCTION, extinction));
    return true;
}

bool draw_layer(nebel_cloud_layer *layer, double thickness)
{
    nebel_cloud_layer shown = *layer;
    (void)nebel_resolve_cloud_layer(thickness, layer, nullptr, &shown);
    bool changed = slide_coverage(&layer->coverage, shown.coverage);
    changed |= drag_height(layer, shown, &nebel_cloud_layer::base, "base", "Above the ground.");
    changed |= drag_height(layer, shown, &nebel_cloud_layer::top, "top", "Above the ground; more than the base.");
    changed |= slide_extinction(layer, shown);
    changed |= drag_height(layer, shown, &nebel_cloud_layer::cell_size, "cell size",
                           "Of the largest cells: half of the distance from one to the next.");
    changed |= slide_part(layer, shown, &nebel_cloud_layer::erosion, "erosion",
                          "How deep small-scale noise cuts into clouds.");
    changed |= slide_part(layer, shown, &nebel_cloud_layer::patchiness, "patchiness",
                          "How much more clouds are here than there, over ten sizes and more.");
    return drag("wind [m]", layer->wind, 2, 1, -DBL_MAX, "%.4g", "From frame to frame, along x and z.") || changed;
}

bool draw_clouds(nebel_planet *planet)
{
    static const char *const kinds[] = {"cumulus", "stratus", "cirrus"};
    bool changed = false;
    for (uint32_t i = 0; i < planet->cloud_layer_count; i++) {
        const Owner owner("clouds", i);
        nebel_cloud_layer *const layer = &planet->cloud_layers[i];
        if (!open_entry(kinds[layer->type])) continue;
        changed |= draw_layer(layer, planet->atmosphere_desc.thickness);
        close_entry();
    }
    return changed;
}

bool draw_physical(nebel_planet *planet)
{
    bool changed = draw_airs(planet);
    changed |= draw_clouds(planet);
    changed |=
        pick("ground albedo", planet->atmosphere_desc.ground_albedo, true, "What the ground sends back of light.");
    if (slide("sun diameter", &planet->sun_angular_diameter, 0, 10, "%.3f deg", false,
              "As one sees it from there; 0: not.")) {
        planet->sun_angular_diameter = fmax(0, fmin(10, planet->sun_angular_diameter));
        changed = true;
    }
    return changed;
}

/* ---- layers, as tutorials draw them
 * ----------------------------------------------------------------------------------
 */

// What is generated has a share that is covered; 0 stands for a half.
bool slide_share(double *coverage, const char *name, const char *help)
{
    double part = *coverage > 0 ? *coverage : 0.5;
    if (!slide(name, &part, 0.01, 0.99, "%.2f", false, help)) return false;
    *coverage = fmax(0.01, fmin(0.99, part));
    return true;
}

bool drag_period(double *period)
{
    return drag("rotation period", period, 1, 10, -DBL_MAX, "%.4g frames",
                "Frames of a turn to the east; less than 0 to the west; 0: it stands still.");
}

// `made`: the shell with numbers in the place of zeros.
bool draw_shell(nebel_cloud_shell *shell, const nebel_cloud_shell &made)
{
    double height = shell->height > 0 ? shell->height : made.height, gain = shell->gain > 0 ? shell->gain : made.gain;
    bool changed = drag_period(&shell->rotation_period);
    if (drag_length("height", &height, "Above the ground.")) {
        shell->height = height;
        changed = true;
    }
    if (slide("gain", &gain, 0.01, 2, "%.2f", false, "How much its maps cover.")) {
        shell->gain = fmax(0.01, fmin(999, gain));
        changed = true;
    }
    if (shell->coverage_map.texels == nullptr)
        changed |= slide_share(&shell->coverage, "coverage", "Of clouds that are generated.");
    double *const color = shell->color;
    const bool is_white = color[0] == 0 && color[1] == 0 && color[2] == 0;
    for (int c = 0; c < 3 && is_white; c++) color[c] = made.color[c];
    if (pick("colour", color, true, "What the clouds send back of light.")) return true;
    for (int c = 0; c < 3 && is_white; c++) color[c] = 0;
    return changed;
}

bool draw_air_shell(nebel_atmosphere_shell *air, const nebel_atmosphere_shell &made)
{
    double brightness = air->is_disabled ? 0 : air->brightness > 0 ? air->brightness : 1;
    double height = air->height > 0 ? air->height : made.height;
    bool changed = drag_length("air height", &height, "Above the ground.");
    if (changed) air->height = height;
    if (!slide("air brightness", &brightness, 0, 4, "%.2f", false,
               "Of the air where it is brightest; 0: there is none."))
        return changed;
    air->brightness = fmax(0, fmin(1e6, brightness));
    air->is_disabled = air->brightness == 0;
    return true;
}

bool draw_layers(nebel_textured_planet_desc *layers, const nebel_textured_planet_desc &made)
{
    bool changed = drag_period(&layers->rotation_period);
    if (layers->color_map.texels == nullptr)
        changed |= slide_share(&layers->land_coverage, "land", "Of ground that is generated.");
    changed |= draw_air_shell(&layers->atmosphere, made.atmosphere);
    for (uint32_t i = 0; i < layers->cloud_shell_count; i++) {
        const Owner owner("clouds", i);
        if (!open_entry("shell of clouds")) continue;
        changed |= draw_shell(&layers->cloud_shells[i], made.cloud_shells[i]);
        close_entry();
    }
    return changed;
}

} // namespace

void draw_planets(nb_panel *panel)
{
    nb_document_state *const now = panel->now;
    if (now->planet_count == 0 || !open_section(now->planet_count > 1 ? "Planets" : "Planet", false)) return;
    for (size_t i = 0; i < now->planet_count; i++) {
        const Owner owner("planet", i);
        nebel_planet *const planet = &now->planets[i];
        const nebel_textured_planet *const layers = panel->data->planets[i].textured;
        if (now->planet_count > 1) ImGui::Text("Planet %u", unsigned(i));
        panel->fog_changed |= planet->model == NEBEL_PLANET_TEXTURED
                                  ? draw_layers(&planet->textured_desc, *nebel_get_textured_planet_desc(layers))
                                  : draw_physical(planet);
    }
}
