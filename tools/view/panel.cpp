#include "panel.h"

#include <imgui.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>

#include <float.h>
#include <math.h>
#include <stdio.h>

namespace
{

/* Where windows of the panel are. */
struct area {
    ImVec2 low, high;
};

enum { WINDOW, HELP, AREAS };

area areas[AREAS];

void note_area(int which)
{
    const ImVec2 low = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    areas[which] = area{low, ImVec2(low.x + size.x, low.y + size.y)};
}

/* Where the controls are, for programs that press them. */
FILE *places;
char owner[64]; /* whose controls follow: their names begin with it */

void note_place(const char *name)
{
    if (places == nullptr) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    fprintf(places, "%d %d %d %d %s%s\n", int(low.x), int(low.y), int(high.x - low.x), int(high.y - low.y), owner,
            name);
}

/* ---- controls
 * --------------------------------------------------------------------------------------------------------
 */

bool slide(const char *name, double *value, double low, double high, const char *format, bool logarithmic)
{
    const ImGuiSliderFlags flags = logarithmic ? ImGuiSliderFlags_Logarithmic : 0;
    const bool changed = ImGui::SliderScalar(name, ImGuiDataType_Double, value, &low, &high, format, flags);
    note_place(name);
    return changed;
}

/* Numbers to be dragged: a hundredth of the largest for each pixel, or of `least` where they are smaller. */
bool drag(const char *name, double *values, int count, double least, double low, const char *format)
{
    const double high = DBL_MAX;
    double largest = least;
    for (int i = 0; i < count; i++) largest = fmax(largest, fabs(values[i]));
    const bool changed = ImGui::DragScalarN(name, ImGuiDataType_Double, values, count, float(largest / 100),
                                            low > -DBL_MAX ? &low : nullptr, low > -DBL_MAX ? &high : nullptr, format,
                                            low > -DBL_MAX ? ImGuiSliderFlags_AlwaysClamp : 0);
    note_place(name);
    return changed;
}

bool drag_place(const char *name, double place[3], double reach)
{
    return drag(name, place, 3, reach / 10, -DBL_MAX, "%.4g");
}

bool drag_length(const char *name, double *length)
{
    return drag(name, length, 1, 0.01, 1e-6, "%.4g m");
}

/* Linear light, shown as the screen would show it. Only what is changed is rounded. */
bool pick(const char *name, double color[3], bool is_share)
{
    float shown[3] = {float(color[0]), float(color[1]), float(color[2])};
    const ImGuiColorEditFlags flags = ImGuiColorEditFlags_Float | (is_share ? 0 : ImGuiColorEditFlags_HDR);
    const bool changed = ImGui::ColorEdit3(name, shown, flags);
    note_place(name);
    for (int c = 0; c < 3; c++) {
        if (shown[c] != float(color[c])) color[c] = fmax(0, floor(double(shown[c]) * 1e4 + 0.5) / 1e4);
    }
    return changed;
}

bool press(const char *name)
{
    const bool pressed = ImGui::Button(name);
    note_place(name);
    return pressed;
}

bool choose(const char *name, int *value, const char *const *names, int count)
{
    const bool changed = ImGui::Combo(name, value, names, count);
    note_place(name);
    return changed;
}

bool open_section(const char *name, bool open)
{
    const bool is_open = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    note_place(name);
    return is_open;
}

/* ---- shapes and densities
 * --------------------------------------------------------------------------------------------
 */

bool is_plain(const nebel_transform &t)
{
    return t.position[0] == 0 && t.position[1] == 0 && t.position[2] == 0 && t.rotation[0] == 0 && t.rotation[1] == 0 &&
           t.rotation[2] == 0 && t.scale[0] == t.scale[1] && t.scale[1] == t.scale[2] && fabs(t.scale[0]) <= 1;
}

bool draw_transform(nebel_transform *transform, double reach)
{
    if (!ImGui::TreeNodeEx("transform", is_plain(*transform) ? 0 : ImGuiTreeNodeFlags_DefaultOpen)) return false;
    bool changed = drag_place("position", transform->position, reach);
    changed |= drag("rotation", transform->rotation, 4, 1, -DBL_MAX, "%.4g");
    changed |= drag("scale", transform->scale, 3, 0.1, -DBL_MAX, "%.4g");
    ImGui::TreePop();
    return changed;
}

bool draw_shape(nebel_shape *shape, double reach)
{
    bool changed = false;
    switch (shape->type) {
    case NEBEL_SHAPE_HALF_SPACE:
        changed |= drag_place("point", shape->point, reach);
        changed |= drag("normal", shape->normal, 3, 1, -DBL_MAX, "%.4g");
        break;
    case NEBEL_SHAPE_BOX:
        changed |= drag_place("min", shape->min, reach);
        changed |= drag_place("max", shape->max, reach);
        break;
    case NEBEL_SHAPE_SPHERE:
        changed |= drag_place("center", shape->center, reach);
        changed |= drag_length("radius", &shape->radius);
        break;
    case NEBEL_SHAPE_ELLIPSOID:
        changed |= drag_place("center", shape->center, reach);
        changed |= drag("radii", shape->radii, 3, 0.01, 1e-6, "%.4g");
        break;
    case NEBEL_SHAPE_CYLINDER:
    case NEBEL_SHAPE_CAPSULE:
        changed |= drag_place("from", shape->from, reach);
        changed |= drag_place("to", shape->to, reach);
        changed |= drag_length("radius", &shape->radius);
        break;
    case NEBEL_SHAPE_CONE:
        changed |= drag_place("from", shape->from, reach);
        changed |= drag_place("to", shape->to, reach);
        changed |= drag("radius from", &shape->radius_from, 1, 0.01, 0, "%.4g m");
        changed |= drag("radius to", &shape->radius_to, 1, 0.01, 0, "%.4g m");
        break;
    default: // what is made of parts or planes moves as a whole
        break;
    }
    return draw_transform(&shape->transform, reach) || changed;
}

bool draw_height(nebel_density *density, double reach)
{
    static const char *const names[] = {"grows", "constant"};
    int below = density->below;
    bool changed = drag("base", &density->base, 1, reach / 10, -DBL_MAX, "%.4g m");
    changed |= slide("scale height", &density->scale_height, 0.01, 1e4, "%.4g m", true);
    changed |= choose("below", &below, names, 2);
    density->below = static_cast<nebel_below>(below);
    return changed;
}

bool draw_density(nebel_density *density, double reach)
{
    bool changed = false;
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        return draw_height(density, reach);
    case NEBEL_DENSITY_LINEAR:
        changed = drag_place("0 at", density->from, reach);
        return drag_place("1 at", density->to, reach) || changed;
    case NEBEL_DENSITY_RADIAL:
        changed = ImGui::SliderInt("power", &density->power, 1, 3, "%d", ImGuiSliderFlags_AlwaysClamp);
        note_place("power");
        return changed;
    case NEBEL_DENSITY_GAUSSIAN:
        changed = drag_place("middle", density->center, reach);
        return drag_length("sigma", &density->sigma) || changed;
    case NEBEL_DENSITY_SOFT_EDGE:
        return drag_length("edge", &density->distance);
    default:
        return false;
    }
}

/* ---- volumes
 * ---------------------------------------------------------------------------------------------------------
 */

double mean(const double rgb[3])
{
    return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

bool is_zero(const double rgb[3])
{
    return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0;
}

/* Visibility is that of the mean extinction; its slider keeps the colour. */
bool draw_amount(double extinction[3])
{
    const double farthest = 1e5, amount = mean(extinction);
    double visibility = amount > 0 ? nebel_extinction_from_visibility(1, 0) / amount : farthest;
    bool changed = false;
    if (slide("visibility", &visibility, 0.1, farthest, "%.4g m", true)) {
        const double wanted = nebel_extinction_from_visibility(visibility, 0);
        const double factor = amount > 0 ? wanted / amount : 0;
        for (int c = 0; c < 3; c++) extinction[c] = amount > 0 ? extinction[c] * factor : wanted;
        changed = true;
    }
    return drag("extinction", extinction, 3, 1e-4, 0, "%.4g") || changed;
}

bool draw_light(nebel_volume_desc *volume, bool has_sun)
{
    bool changed = false;
    if (is_zero(volume->albedo)) changed |= pick("source", volume->source, false);
    if (is_zero(volume->source) && (!has_sun || !is_zero(volume->albedo)))
        changed |= pick("albedo", volume->albedo, true);
    return pick("emission", volume->emission, false) || changed;
}

bool draw_distances(nebel_volume_desc *volume)
{
    bool changed = ImGui::DragInt("priority", &volume->priority, 0.05f);
    note_place("priority");
    changed |= drag("start", &volume->start, 1, 1, 0, "%.4g m");
    return drag("cutoff", &volume->cutoff, 1, 1, 0, volume->cutoff > 0 ? "%.4g m" : "none") || changed;
}

bool draw_volume_numbers(nebel_volume_desc *volume, double reach, bool has_sun)
{
    bool changed = false;
    if (volume->operation != NEBEL_OPERATION_EXCLUDE) {
        changed |= draw_amount(volume->extinction);
        changed |= draw_light(volume, has_sun);
        changed |= draw_density(&volume->density, reach);
    }
    changed |= draw_shape(&volume->shape, reach);
    return draw_distances(volume) || changed;
}

void draw_volume(nb_panel *panel, size_t index, double reach)
{
    static const char *const origins[] = {"", "moves by its keys: changes here are not saved",
                                          "settings of another program: changes here are not saved",
                                          "a node of a model: changes here are not saved"};
    const nebel_volume_origin origin = nebel_scene_volume_origin(panel->source, index);
    char title[160];
    const char *const name = panel->data->volume_names[index];
    snprintf(title, sizeof title, "%.100s%s###volume", name[0] != '\0' ? name : "(no name)",
             origin != NEBEL_VOLUME_WRITTEN ? " *" : "");
    ImGui::PushID(int(index));
    snprintf(owner, sizeof owner, "fog[%u].", unsigned(index));
    const bool is_open =
        ImGui::CollapsingHeader(title, panel->data->volume_count <= 2 ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    note_place("open");
    if (is_open) {
        if (origin != NEBEL_VOLUME_WRITTEN) ImGui::TextDisabled("%s", origins[origin]);
        const bool has_sun = panel->data->has_sun && !is_zero(panel->data->sun_irradiance);
        panel->fog_changed |= draw_volume_numbers(&panel->volumes[index], reach, has_sun);
    }
    owner[0] = '\0';
    ImGui::PopID();
}

void draw_fog(nb_panel *panel, double reach)
{
    const nebel_scene_data *const data = panel->data;
    for (size_t i = 0; i < data->volume_count; i++) draw_volume(panel, i, reach);
    for (size_t i = 0; i < data->nebula_count; i++) {
        ImGui::TextDisabled("nebula %s: %u particles, as the file says", data->nebula_names[i],
                            unsigned(data->nebulae[i].count));
    }
}

/* ---- light and camera
 * -----------------------------------------------------------------------------------------------
 */

const double degree = 3.14159265358979323846 / 180;

bool draw_sun(nebel_scene_data *data)
{
    double *const d = data->sun_direction;
    double height = asin(fmax(-1, fmin(1, d[1]))) / degree, turn = atan2(d[0], d[2]) / degree;
    bool changed = slide("sun turn", &turn, -180, 180, "%.1f deg", false);
    changed |= slide("sun height", &height, -89, 89, "%.1f deg", false);
    if (changed) {
        d[0] = cos(height * degree) * sin(turn * degree);
        d[1] = sin(height * degree);
        d[2] = cos(height * degree) * cos(turn * degree);
    }
    return pick("sun", data->sun_irradiance, false) || changed;
}

void draw_lights(nb_panel *panel)
{
    nebel_scene_data *const data = panel->data;
    if (!open_section("Light", false)) return;
    panel->light_changed |= pick("ambient", data->ambient, false);
    panel->light_changed |= pick("background", data->background, false);
    if (data->has_sun) panel->light_changed |= draw_sun(data);
}

void draw_camera(nb_panel *panel, double reach)
{
    nebel_camera *const camera = &panel->data->camera;
    if (!open_section("Camera", false)) return;
    bool changed = drag_place("eye", camera->position, reach);
    changed |= drag_place("look at", camera->look_at, reach);
    if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) {
        changed |= drag_length("view height", &camera->view_height);
    } else {
        changed |= slide("field of view", &camera->vertical_fov, 1, 150, "%.1f deg", false);
    }
    panel->camera_changed |= changed;
    if (!panel->camera_is_keyed) {
        bool saved = panel->saves_camera;
        ImGui::Checkbox("save the camera, too", &saved);
        note_place("save the camera, too");
        panel->saves_camera = saved;
    } else {
        ImGui::TextDisabled("moves: changes here are not saved");
    }
}

/* ---- what is shown
 * ---------------------------------------------------------------------------------------------------
 */

void draw_look(nb_panel *panel)
{
    static const char *const planes[] = {"colour", "transmittance", "in-scattering", "depth"};
    nb_look *const look = panel->look;
    int plane = look->plane;
    panel->look_changed |= choose("picture", &plane, planes, NB_LOOK_PLANES);
    look->plane = static_cast<nb_look_plane>(plane);
    slide("exposure", &look->exposure, -10, 10, "%.2f stops", false);
    panel->look_changed |= ImGui::SliderInt("samples", &look->samples, 1, 64, "%d", ImGuiSliderFlags_AlwaysClamp);
    note_place("samples");
    static const char *const compares[] = {"OpenGL", "CPU | OpenGL", "difference"};
    int compare = look->compare;
    panel->look_changed |= choose("drawn by", &compare, compares, NB_LOOK_COMPARES);
    look->compare = static_cast<nb_look_compare>(compare);
    if (compare == NB_LOOK_SPLIT) slide("split", &look->split, 0, 1, "%.2f", false);
    if (compare == NB_LOOK_DIFFERENCE) slide("times", &look->gain, 1, 255, "%.4g", true);
    if (look->plane == NB_LOOK_DEPTH) slide("grey at", &look->range, 0.1, 10000, "%.4g m", true);
    if (panel->moves) {
        panel->frame_changed =
            ImGui::DragScalar("frame", ImGuiDataType_Double, panel->frame, 0.5f, nullptr, nullptr, "%.1f");
        note_place("frame");
    }
}

void draw_state(const nb_panel *panel)
{
    ImGui::Text("%s%s", panel->scene, panel->is_changed ? " (changed)" : "");
    if (panel->file_is_newer)
        ImGui::TextWrapped("The file has changed, too. Save: it gets your numbers. Read again: they are lost.");
    ImGui::Text("%.1f ms, %s", panel->seconds * 1e3, panel->picture);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", panel->driver);
    if (panel->message[0] != '\0') ImGui::TextWrapped("%s", panel->message);
}

void draw_help(nb_panel *panel)
{
    static const char *const keys[][2] = {
        {"left drag", "orbit"},
        {"middle drag, Shift + left drag", "pan"},
        {"wheel", "nearer, further"},
        {"right drag", "look around"},
        {"W A S D, Q E", "fly, Shift: faster"},
        {"Home, H", "the camera of the file"},
        {"1 2 3 4", "colour, transmittance, in-scattering, depth"},
        {"[ ]", "exposure"},
        {"C", "OpenGL, split, difference"},
        {"F12, Shift + F12", "save the picture, the window"},
        {"Ctrl + S, F5", "save the scene, read it again"},
        {"Tab, F1", "controls, this list"},
        {"Ctrl + Q", "end"},
    };
    bool shown = true;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, size.y / 2), ImGuiCond_Appearing, ImVec2(0.5f, 0.5f));
    if (ImGui::Begin("Keys", &shown, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings) &&
        ImGui::BeginTable("keys", 2)) {
        for (const auto &key : keys) {
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(key[0]);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(key[1]);
        }
        ImGui::EndTable();
    }
    note_area(HELP);
    ImGui::End();
    panel->help_shown = shown;
}

/* How far away what is looked at is: what steps are measured by. */
double find_reach(const nebel_camera &camera)
{
    double sum = 0;
    for (int i = 0; i < 3; i++)
        sum += (camera.look_at[i] - camera.position[i]) * (camera.look_at[i] - camera.position[i]);
    return sqrt(sum);
}

void draw_window(nb_panel *panel)
{
    const ImGuiIO &io = ImGui::GetIO();
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(FLT_MAX, io.DisplaySize.y));
    ImGui::SetNextWindowBgAlpha(0.8f);
    ImGui::Begin("nebel", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoTitleBar |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(180);
    draw_state(panel);
    panel->wants_save = press("Save");
    ImGui::SameLine();
    panel->wants_reload = press("Read again");
    ImGui::SameLine();
    panel->wants_home = press("Home");
    ImGui::SameLine();
    panel->help_shown |= press("Keys");
    draw_look(panel);
    const double reach = find_reach(panel->data->camera);
    draw_fog(panel, reach);
    draw_lights(panel);
    draw_camera(panel, reach);
    ImGui::PopItemWidth();
    note_area(WINDOW);
    ImGui::End();
}

void clear_answers(nb_panel *panel)
{
    panel->fog_changed = panel->light_changed = panel->camera_changed = 0;
    panel->frame_changed = panel->look_changed = 0;
    panel->wants_save = panel->wants_reload = panel->wants_home = 0;
}

} // namespace

extern "C" int nb_panel_open(void *window)
{
    if (ImGui::CreateContext() == nullptr) return -1;
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    ImGui::StyleColorsDark();
    ImGui_ImplGlfw_InitForOpenGL(static_cast<GLFWwindow *>(window), true);
    ImGui_ImplOpenGL3_Init("#version 330 core");
    return 0;
}

extern "C" void nb_panel_close(void)
{
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

extern "C" void nb_panel_draw(nb_panel *panel, const char *controls)
{
    clear_answers(panel);
    places = controls != nullptr ? fopen(controls, "w") : nullptr;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    for (area &taken : areas) taken = area{ImVec2(0, 0), ImVec2(0, 0)};
    if (panel->shown) draw_window(panel);
    if (panel->help_shown) draw_help(panel);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    if (places != nullptr) fclose(places);
}

/* ImGui's own answer is that of the last turn: too late for a cursor that came and pressed since. */
extern "C" int nb_panel_has_place(double x, double y)
{
    if (ImGui::IsPopupOpen(nullptr, ImGuiPopupFlags_AnyPopup)) return 1;
    for (const area &taken : areas) {
        if (x >= double(taken.low.x) && y >= double(taken.low.y) && x < double(taken.high.x) &&
            y < double(taken.high.y)) {
            return 1;
        }
    }
    return 0;
}

extern "C" int nb_panel_has_keys(void)
{
    return ImGui::GetIO().WantTextInput;
}
