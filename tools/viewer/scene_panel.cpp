// Time, models, light, classic fog and the camera.
#include "scene_panel.h"

#include "widgets.h"
#include "fog_panel.h"
#include "keyframe_edit.h"

#include <float.h>
#include <math.h>
#include <string.h>

namespace
{

using namespace controls;

const double degree = 3.14159265358979323846 / 180;

/* ---- light
 * -----------------------------------------------------------------------------------------------------------
 */

// In the middle of the sky, so that one sees what it does.
void add_sun(nb_document_state *now)
{
    now->has_sun = 1;
    for (int i = 0; i < 3; i++) {
        now->sun_direction[i] = i == 1 ? 0.8 : i == 0 ? 0.36 : 0.48;
        now->sun_irradiance[i] = 3;
    }
}

bool slide_direction(double d[3], const char *turn_name, const char *turn_help, const char *height_name,
                     const char *height_help)
{
    double height = asin(fmax(-1, fmin(1, d[1]))) / degree, turn = atan2(d[0], d[2]) / degree;
    bool changed = slide(turn_name, &turn, -180, 180, "%.1f deg", false, turn_help);
    changed |= slide(height_name, &height, -89, 89, "%.1f deg", false, height_help);
    if (!changed) return false;
    d[0] = cos(height * degree) * sin(turn * degree);
    d[1] = sin(height * degree);
    d[2] = cos(height * degree) * cos(turn * degree);
    return true;
}

bool draw_sun(nb_document_state *now, bool moves)
{
    if (moves) {
        ImGui::TextDisabled("the sun moves by keys of the file");
        return false;
    }
    bool changed = slide_direction(now->sun_direction, "sun turn", "Where it stands, seen from above: 0 is along z.",
                                   "sun height", "How high it stands above the horizon.");
    changed |= pick("sun", now->sun_irradiance, false,
                    "Irradiance on a surface that faces the sun, before any fog. It lights fog with an albedo, too.");
    if (!press("Remove the sun", "Takes it out of the scene. Ctrl + Z brings it back.")) return changed;
    now->has_sun = 0;
    return true;
}

bool draw_missing_sun(nb_document_state *now)
{
    if (!press("Add a sun", "Lights surfaces, and fog with an albedo, through all fog on its way.")) return false;
    add_sun(now);
    return true;
}

/* 0 and 1 are no limit. */
bool draw_opacity(nb_document_state *now)
{
    double opacity = now->max_opacity > 0 ? now->max_opacity : 1;
    if (!slide("most opacity", &opacity, 0.01, 1, opacity < 1 ? "%.2f" : "no limit", false,
               "All fog together hides no more than this. A look, not physics."))
        return false;
    now->max_opacity = opacity;
    return true;
}

bool draw_ambient(nb_document_state *now)
{
    nebel_environment *const sky = &now->environment;
    if (sky->type == NEBEL_ENVIRONMENT_GRADIENT) {
        bool changed = pick("zenith", sky->zenith, false, "Ambient radiance from straight above.");
        changed |= pick("horizon", sky->horizon, false, "Ambient radiance from level directions.");
        return pick("ground", sky->ground, false, "Ambient radiance from straight below.") || changed;
    }
    if (sky->type == NEBEL_ENVIRONMENT_MAP) {
        const bool turned = slide("rotation", &sky->rotation, -180, 180, "%.1f deg", false,
                                  "Turns the picture that ambient light comes from to the left, about the vertical.");
        return slide("intensity", &sky->intensity, 0.001, 1000, "%.3g", true, "Of what the picture sends.") || turned;
    }
    return pick("ambient", now->ambient, false, "Radiance from everywhere. Lights surfaces, and fog with an albedo.");
}

bool draw_background(nb_document_state *now)
{
    const bool switched = tick("ambient as background", &now->shows_ambient,
                               "Where no surface is one sees what ambient light comes from there.");
    if (now->shows_ambient) return switched;
    return pick("background", now->background, false, "Radiance where no surface is: the sky.") || switched;
}

/* ---- point lights
 * -----------------------------------------------------------------------------------------------------------
 */

// Of the brightest colour; the others keep their share of it.
bool slide_strength(double intensity[3])
{
    const double before = fmax(intensity[0], fmax(intensity[1], intensity[2]));
    double strength = before;
    if (!slide("strength", &strength, 1e-3, 1e6, "%.4g W/sr", true, "How bright it is; the colour stays."))
        return false;
    strength = fmax(0, fmin(1e9, strength));
    for (int c = 0; c < 3; c++) intensity[c] = before > 0 ? intensity[c] * (strength / before) : strength;
    return true;
}

// The light falls off between the two angles.
bool draw_cone(nebel_light *light)
{
    bool changed = slide_direction(light->direction, "turn", "Where it shines to, seen from above: 0 is along z.",
                                   "height", "How far above the horizon it shines to.");
    if (slide("outer angle", &light->outer_angle, 0.1, 180, "%.1f deg", false, "From the axis: no light beyond.")) {
        light->outer_angle = fmax(0.1, fmin(180, light->outer_angle));
        changed = true;
    }
    changed |=
        slide("inner angle", &light->inner_angle, 0, 180, "%.1f deg", false, "From the axis: full light within.");
    light->inner_angle = fmax(0, fmin(light->outer_angle, light->inner_angle));
    return changed;
}

bool draw_light(nebel_light *light, double reach)
{
    double radius = light->radius > 0 ? light->radius : 1e-3;
    bool changed = slide_strength(light->intensity);
    changed |=
        pick("intensity", light->intensity, false, "W/sr, as one sees it from far away; of a spot along its axis.");
    changed |= drag_place("position", light->position, reach, "Where it is.");
    if (slide("radius", &radius, 1e-3, 100, "%.4g m", true,
              "Of the ball that shines: nothing is brighter than its surface.")) {
        light->radius = fmax(1e-3, fmin(1e6, radius));
        changed = true;
    }
    return (light->type == NEBEL_LIGHT_SPOT && draw_cone(light)) || changed;
}

bool draw_light_header(nb_panel *panel, size_t index, double reach)
{
    const Owner owner("lights", index);
    const char *const name = panel->data->light_names[index];
    nebel_light *const light = &panel->now->lights[index];
    char title[160];
    snprintf(title, sizeof title, "%.100s%s%u###light", name, name[0] != '\0' ? ", light " : "light ", unsigned(index));
    const bool is_open = ImGui::CollapsingHeader(title);
    note_place("open");
    if (!is_open) return false;
    ImGui::Indent(4 * scale);
    const bool changed = draw_light(light, reach);
    ImGui::Unindent(4 * scale);
    return changed;
}

/* ---- models
 * ----------------------------------------------------------------------------------------------------------
 */

const char *name_of(const char *path)
{
    const char *const folder_end = strrchr(path, '/');
    return folder_end != nullptr ? folder_end + 1 : path;
}

// Scales of 0 would leave nothing.
bool draw_scale(nebel_scene_model *model)
{
    double scales[3] = {model->scale[0], model->scale[1], model->scale[2]};
    if (!drag("scale", scales, 3, 0.1, -DBL_MAX, "%.4g",
              "Stretches the model, before it is turned. Less than 0 mirrors."))
        return false;
    for (int i = 0; i < 3; i++)
        if (scales[i] != 0) model->scale[i] = scales[i];
    return true;
}

bool draw_model_place(nebel_scene_model *model, double reach)
{
    bool changed = drag_place("position", model->position, reach, "Where the model is.");
    if (!model->is_heightfield) {
        changed |= draw_rotation(model->rotation);
        return draw_scale(model) || changed;
    }
    changed |= drag("size [m]", model->size, 2, reach / 10, 1e-6, "%.4g", "How far it reaches along x and z.");
    return drag_length("height", &model->height, "Of white above black.") || changed;
}

bool draw_model(nebel_scene_model *model, double reach, bool *goes)
{
    if (model->has_fog) ImGui::TextDisabled("brings fog, which follows once it is saved");
    bool changed = draw_model_place(model, reach);
    changed |= tick("one colour", &model->has_color, "In the place of the model's own colours and textures.");
    if (model->has_color) changed |= pick("colour", model->color, true, "What share of the light it sends back.");
    *goes = press("Remove", "Takes the model out of the scene. Ctrl + Z brings it back.");
    return changed;
}

bool draw_model_header(nb_panel *panel, size_t index, double reach, bool *goes)
{
    nebel_scene_model *const model = &panel->now->models[index];
    const Owner owner("models", model->model_index);
    char title[160];
    snprintf(title, sizeof title, "%.100s###model", name_of(panel->models[model->model_index].path));
    const bool is_open = ImGui::CollapsingHeader(title);
    note_place("open");
    if (!is_open) return false;
    ImGui::Indent(4 * scale);
    const bool changed = draw_model(model, reach, goes);
    ImGui::Unindent(4 * scale);
    return changed;
}

/* ---- classic fog
 * -----------------------------------------------------------------------------------------------------
 */

bool draw_factor(nebel_factor_desc *factor, double reach)
{
    static const char *const coordinates[] = {"depth", "distance", "amount"}, *const stages[] = {"vertex", "pixel"};
    int coordinate = factor->coordinate, stage = factor->stage;
    bool changed = drag("start", &factor->start, 1, reach / 10, -DBL_MAX, "%.4g m", "Linear: where fog begins.");
    changed |= drag("end", &factor->end, 1, reach / 10, -DBL_MAX, "%.4g m", "Linear: where nothing but fog is seen.");
    changed |= slide("density", &factor->density, 1e-4, 10, "%.4g / m", true, "Exp and exp2: how thick the fog is.");
    changed |= pick("colour", factor->color, false, "Of opaque fog.");
    changed |= choose("coordinate", &coordinate, coordinates, 3,
                      "What counts as far: the depth along the camera's axis, which changes when the camera turns, the "
                      "distance to the camera, or the amount of the scene's fog at vertices, 0 to 100.");
    changed |= choose("stage", &stage, stages, 2, "Computed at each vertex and linear in between, or at each pixel.");
    factor->coordinate = nebel_factor_coordinate(coordinate);
    factor->stage = nebel_factor_stage(stage);
    return changed;
}

/* ---- camera
 * ----------------------------------------------------------------------------------------------------------
 */

// What is in the middle stays as large as it is.
void change_projection(nebel_camera *camera, nebel_projection projection, double reach)
{
    const double tangent = tan(camera->vertical_fov * degree / 2);
    if (projection == NEBEL_PROJECTION_ORTHOGRAPHIC) camera->view_height = 2 * reach * tangent;
    camera->projection = projection;
}

bool draw_projection(nebel_camera *camera, double reach)
{
    static const char *const names[] = {"perspective", "orthographic", "panorama"};
    int projection = camera->projection;
    bool changed =
        choose("projection", &projection, names, 3,
               "Perspective; orthographic, where things far away are as large as near ones; or a panorama of "
               "360 x 180 degrees.");
    if (changed) change_projection(camera, nebel_projection(projection), reach);
    if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC)
        return drag_length("view height", &camera->view_height, "What the height of the picture shows.") || changed;
    if (camera->projection == NEBEL_PROJECTION_PANORAMA) return changed;
    return slide("field of view", &camera->vertical_fov, 1, 150, "%.1f deg", false, "From bottom to top.") || changed;
}

} // namespace

void draw_time(nb_panel *panel)
{
    const bool moves = panel->frames[0] < panel->frames[1];
    const double low = fmin(moves ? panel->frames[0] : 0, *panel->frame);
    const double high = fmax(moves ? panel->frames[1] : 100, *panel->frame);
    if (!open_section("Time", moves)) return;
    panel->frame_changed |= slide("frame", panel->frame, low, high, "%.0f", false,
                                  "Of all that moves, as nebel render --frame has it. Ctrl + click types a number in.");
    if (press_if(moves, panel->plays ? "Stop" : "Play",
                 "Space: from the first key to the last, again and again; on and on where something has no end."))
        panel->plays = !panel->plays;
    ImGui::SameLine();
    panel->steps -= press_if(moves, "<", "Comma: a frame back.");
    ImGui::SameLine();
    panel->steps += press_if(moves, ">", "Full stop: a frame on.");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(70 * scale);
    slide_whole("per second", &panel->look->rate, 1, 60, false, "Frames: how fast time goes.");
    ImGui::SameLine();
    ImGui::TextDisabled("%.4g s", *panel->frame / panel->look->rate);
    explain("When the frame comes, at so many a second.");
}

void draw_models(nb_panel *panel, double reach)
{
    nb_document_state *const now = panel->now;
    size_t gone = now->model_count;
    if (now->model_count == 0) return;
    ImGui::Text("Models: %u", unsigned(now->model_count));
    for (size_t i = 0; i < now->model_count; i++) {
        bool goes = false;
        panel->fog_changed |= draw_model_header(panel, i, reach, &goes);
        if (goes) gone = i;
    }
    if (gone == now->model_count) return;
    memmove(now->models + gone, now->models + gone + 1, (now->model_count - gone - 1) * sizeof *now->models);
    now->model_count--;
    panel->fog_changed = 1;
}

void draw_point_lights(nb_panel *panel, double reach)
{
    const size_t count = panel->now->light_count;
    if (count == 0) return;
    ImGui::Text("Lights: %u", unsigned(count));
    for (size_t i = 0; i < count; i++) panel->fog_changed |= draw_light_header(panel, i, reach);
}

void draw_point_lights(nb_panel *panel)
{
    nb_document_state *const now = panel->now;
    if (!open_section("Light", false)) return;
    bool changed = draw_ambient(now);
    changed |= draw_background(now);
    changed |= draw_opacity(now);
    panel->fog_changed |=
        (now->has_sun ? draw_sun(now, panel->data->sun_key_count > 0) : draw_missing_sun(now)) || changed;
}

void draw_classic(nb_panel *panel, double reach)
{
    nb_document_state *const now = panel->now;
    if (!open_section("Classic fog", false)) return;
    const Owner owner("classic", 0);
    if (!now->has_classic) {
        if (!press("Add", "Numbers for the methods linear, exp and exp2, which fog surfaces in one colour.")) return;
        now->has_classic = 1;
        panel->fog_changed = 1;
        return;
    }
    panel->fog_changed |= draw_factor(&now->classic, reach);
    if (!press("Remove", "Takes the section out of the scene. Ctrl + Z brings it back.")) return;
    now->has_classic = 0;
    panel->fog_changed = 1;
}

// Returns whether it goes.
static bool draw_camera_key(nb_panel *panel, size_t key)
{
    const Owner owner("keys", key);
    double frame = panel->now->camera_keys[key].frame;
    const bool is_here = frame == *panel->frame;
    ImGui::SetNextItemWidth(90 * scale);
    if (drag("##frame", &frame, 1, 25, -DBL_MAX, "frame %.4g", "When it is there. No further than to the next key.")) {
        nb_keys_move_camera(panel->now, key, frame);
        panel->fog_changed = 1;
    }
    ImGui::SameLine();
    if (press_if(!is_here, is_here ? "here" : "Go", "To this frame.")) {
        *panel->frame = frame;
        panel->frame_changed = 1;
    }
    ImGui::SameLine();
    return press("x", "Takes this key away. Ctrl + Z brings it back.");
}

static void draw_camera_keys(nb_panel *panel)
{
    const Owner owner("camera", 0);
    nb_document_state *const now = panel->now;
    size_t gone = now->camera_key_count;
    bool is_here = false;
    for (size_t i = 0; i < now->camera_key_count; i++) {
        is_here |= now->camera_keys[i].frame == *panel->frame;
        if (draw_camera_key(panel, i)) gone = i;
    }
    if (gone < now->camera_key_count) {
        nb_keys_remove_camera(now, gone);
        panel->fog_changed = 1;
    } else if (press(is_here ? "Change the key here" : "Add a key here",
                     "At the present frame, see Time: the camera as it is now.")) {
        panel->is_out_of_memory |= nb_keys_set_camera(now, &panel->data->camera, *panel->frame) != 0;
        panel->fog_changed = 1;
    }
}

void draw_camera(nb_panel *panel, double reach)
{
    nebel_camera *const camera = &panel->data->camera;
    if (!open_section("Camera", false)) return;
    bool changed = draw_projection(camera, reach);
    changed |= drag_place("eye", camera->position, reach, "Where the camera is.");
    changed |= drag_place("look at", camera->look_at, reach, "What is in the middle, and what a drag orbits about.");
    changed |= drag("up", camera->up, 3, 1, -DBL_MAX, "%.3g", "Which way is up in the picture.");
    panel->camera_changed |= changed;
    if (panel->data->turntable_frames > 0) {
        ImGui::TextDisabled("turns: changes here are not saved");
        return;
    }
    if (panel->camera_is_keyed)
        ImGui::TextDisabled("moves: changes here go into keys by the button below");
    else
        tick("save the camera, too", &panel->saves_camera, "Save writes where the camera is now into the file.");
    draw_camera_keys(panel);
}
