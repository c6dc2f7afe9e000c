#include "panel.h"

#include "../output_check.h"
#include "widgets.h"
#include "fog_panel.h"
#include "planet_panel.h"
#include "scene_panel.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

namespace
{

using namespace controls;

/* Where windows of the panel are. */
struct area {
    ImVec2 low, high;
};

enum { WINDOW, HELP, NOTICE, AREAS };

area areas[AREAS];

void note_area(int which)
{
    const ImVec2 low = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    areas[which] = area{low, ImVec2(low.x + size.x, low.y + size.y)};
}

// Among the places of the controls.
void note_window(const char *name)
{
    const ImVec2 low = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    if (places != nullptr) fprintf(places, "%d %d %d %d %s\n", int(low.x), int(low.y), int(size.x), int(size.y), name);
}

// The last line, with a number of its own for each list: who has read it has read them all, and can count drawings.
void end_places()
{
    static unsigned number;
    if (places == nullptr) return;
    fprintf(places, "0 0 0 0 (list %u)\n", ++number);
    fclose(places);
}

/* ---- what is shown
 * ---------------------------------------------------------------------------------------------------
 */

void draw_comparison(nb_panel *panel)
{
    static const char *const compares[] = {"OpenGL", "CPU | OpenGL", "difference", "CPU"};
    nb_display *const look = panel->look;
    int compare = look->compare;
    panel->look_changed |=
        choose("drawn by", &compare, compares, NB_LOOK_COMPARES,
               "The CPU's picture on the left of a line that can be dragged, the difference of both, or the CPU's "
               "alone.");
    look->compare = nb_display_compare(compare);
    if (compare == NB_LOOK_SPLIT) slide("split", &look->split, 0, 1, "%.2f", false, "Where the line is.");
    if (compare == NB_LOOK_DIFFERENCE)
        slide("times", &look->gain, 1, 255, "%.4g", true,
              "How much brighter the difference is shown: 255 makes one byte white.");
}

const char *describe_method(nebel_method method)
{
    switch (method) {
    case NEBEL_METHOD_EXACT:
        return "exact";
    case NEBEL_METHOD_CELLS:
        return "cells, at vertices";
    case NEBEL_METHOD_CELLS_PIXEL:
        return "cells, per pixel";
    case NEBEL_METHOD_VERTEX:
        return "at vertices";
    case NEBEL_METHOD_ADDITIVE:
        return "additive, at vertices";
    default:
        return nebel_method_name(method);
    }
}

// A method that needs what the scene has not is not offered.
bool is_offered(const nb_panel *panel, nebel_method method)
{
    switch (method) {
    case NEBEL_METHOD_CELLS:
    case NEBEL_METHOD_CELLS_PIXEL:
        return panel->now->cells != nullptr;
    case NEBEL_METHOD_LINEAR:
    case NEBEL_METHOD_EXP:
    case NEBEL_METHOD_EXP2:
        return panel->now->has_classic != 0;
    default:
        return method == NEBEL_METHOD_EXACT || method == NEBEL_METHOD_VERTEX || method == NEBEL_METHOD_ADDITIVE;
    }
}

void draw_method(nb_panel *panel)
{
    nebel_method methods[NEBEL_METHOD_COUNT];
    const char *names[NEBEL_METHOD_COUNT];
    int count = 0, chosen = 0;
    for (int i = 0; i < NEBEL_METHOD_COUNT; i++) {
        if (!is_offered(panel, nebel_method(i))) continue;
        if (panel->look->method == nebel_method(i)) chosen = count;
        names[count] = describe_method(nebel_method(i));
        methods[count++] = nebel_method(i);
    }
    panel->look_changed |= choose("method", &chosen, names, count,
                                  "How fog gets onto the picture: exactly, or as old engines did it, on surfaces "
                                  "alone. Cells and the factors linear, exp and exp2 are offered where the scene has "
                                  "such sections; see Classic fog below.");
    panel->look->method = methods[chosen];
    if (panel->note[0] == '\0') return;
    ImGui::TextDisabled("%s", panel->note);
    if (panel->reason[0] != '\0') explain(panel->reason);
}

void draw_technique(nb_panel *panel)
{
    static const char *const names[] = {"balls: fast", "five-tap discs", "fog: exact"};
    int particles = panel->look->particles;
    draw_method(panel);
    if (panel->now->nebula_count == 0 || panel->look->method != NEBEL_METHOD_EXACT) return;
    panel->look_changed |=
        choose("particles", &particles, names, NB_LOOK_PARTICLES,
               "Balls: each particle in closed form, from the farthest to the nearest. Five-tap: a disc that "
               "is drawn or not, by the classic comparison of depth at five places. Fog: among all "
               "other fog, as the CPU does; slow where there are many.");
    panel->look->particles = nb_display_particles(particles);
}

void draw_look(nb_panel *panel)
{
    static const char *const planes[] = {"colour", "transmittance", "in-scattering", "depth"};
    nb_display *const look = panel->look;
    int plane = look->plane;
    panel->look_changed |= choose("picture", &plane, planes, NB_LOOK_PLANES,
                                  "What is shown: picture = transmittance x surface + in-scattering.");
    look->plane = nb_display_plane(plane);
    slide("exposure", &look->exposure, -10, 10, "%.2f stops", false,
          "One more doubles the light. Of the window alone.");
    panel->look_changed |=
        slide_whole("samples", &look->samples, 1, 64, false, "Of each pixel, once everything rests.");
    draw_technique(panel);
    draw_comparison(panel);
    if (look->plane == NB_LOOK_DEPTH)
        slide("grey at", &look->range, 0.1, 10000, "%.4g m", true, "The distance that is shown in middle grey.");
}

/* ---- state and commands
 * --------------------------------------------------------------------------------------------
 */

void draw_seconds(const char *who, double seconds, unsigned samples)
{
    const bool is_long = seconds >= 1;
    ImGui::Text("%s: %.3g %s, %u sample%s", who, is_long ? seconds : seconds * 1e3, is_long ? "s" : "ms", samples,
                samples == 1 ? "" : "s");
}

void draw_state(nb_panel *panel)
{
    /* In one line, whatever its length: the controls below stay where they are. */
    const char *const folder_end = strrchr(panel->scene, '/');
    ImGui::Text("%s%s", panel->is_changed ? "* " : "", folder_end != nullptr ? folder_end + 1 : panel->scene);
    explain(panel->scene);
    if (panel->samples > 0) {
        draw_seconds("OpenGL", panel->seconds, panel->samples);
        explain(panel->driver);
    } else if (panel->cpu_seconds == 0) {
        ImGui::TextUnformatted("");
    }
    if (panel->cpu_seconds > 0) draw_seconds("CPU", panel->cpu_seconds, 1);
    ImGui::TextDisabled("%s", panel->picture);
}

void draw_commands(nb_panel *panel)
{
    panel->wants_save |=
        press("Save", "Ctrl + S: into the scene file. All that has not changed stays as it stands there.");
    ImGui::SameLine();
    panel->wants_reload |= press("Read again", "F5: the scene file. What was changed here is lost.");
    ImGui::SameLine();
    panel->wants_undo = press_if(panel->has_past, "Undo", "Ctrl + Z");
    ImGui::SameLine();
    panel->wants_redo = press_if(panel->has_future, "Redo", "Ctrl + Y");
    panel->wants_home = press("Home", "The camera of the file.");
    ImGui::SameLine();
    panel->wants_picture = press("Picture", "F12: the picture without controls, into the current folder.");
    ImGui::SameLine();
    panel->help_shown |= press("Keys and mouse", "F1");
    ImGui::TextDisabled("drag orbits, right drag looks, wheel nears");
}

/* ---- messages, which stand beside the controls or, where the window is narrow, below: nothing moves when they come and go
 * ---------------------------------
 */

const ImVec4 warning(1.0f, 0.65f, 0.4f, 1.0f);

void draw_message(nb_panel *panel)
{
    if (panel->message[0] == '\0') return;
    if (panel->is_fault) ImGui::PushStyleColor(ImGuiCol_Text, warning);
    ImGui::TextWrapped("%s", panel->message);
    if (panel->is_fault) ImGui::PopStyleColor();
    if (panel->is_fault) panel->has_read_message = press("OK", "Takes the message away.");
}

/* Nobody's changes are lost without being asked. */
void draw_question(nb_panel *panel)
{
    if (!panel->file_is_newer) return;
    ImGui::PushStyleColor(ImGuiCol_Text, warning);
    ImGui::TextWrapped("The file has changed on the disk, and so have numbers here.");
    ImGui::PopStyleColor();
    panel->wants_save |=
        press("Save mine into it", "What you have changed goes into the new file; all else there stays.");
    ImGui::SameLine();
    panel->wants_reload |= press("Read it, drop mine", "What you have changed is lost.");
}

void draw_notice(nb_panel *panel)
{
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float margin = 8 * scale, width = fminf(420 * scale, size.x - 2 * margin);
    if (panel->message[0] == '\0' && !panel->file_is_newer) return;
    ImGui::SetNextWindowPos(ImVec2(size.x - margin, size.y - margin), ImGuiCond_Always, ImVec2(1, 1));
    /* Half of a small window is the list's of keys. */
    ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, panel->help_shown ? size.y / 2 : size.y));
    ImGui::SetNextWindowBgAlpha(0.9f);
    ImGui::Begin("notice", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoTitleBar |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    draw_message(panel);
    draw_question(panel);
    note_area(NOTICE);
    note_window("(notice)");
    ImGui::End();
}

/* Where the list of keys ended last. */
float help_end;

// Above the notice, which it would cover: back there, too, where it was dragged or a notice came.
void place_help()
{
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const area &notice = areas[NOTICE];
    const float end = notice.low.y < notice.high.y ? notice.low.y : size.y;
    ImGui::SetNextWindowPos(ImVec2(size.x / 2, end / 2), help_end > end ? ImGuiCond_Always : ImGuiCond_Appearing,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(size.x, end));
}

void draw_wrapped(const char *words, float end)
{
    ImGui::PushTextWrapPos(end);
    ImGui::TextUnformatted(words);
    ImGui::PopTextWrapPos();
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
        {"C", "OpenGL, split, difference, CPU"},
        {"Space", "time goes on, stops"},
        {"comma, full stop", "a frame back, on"},
        {"F12, Shift + F12", "save the picture, the window"},
        {"Ctrl + S, F5", "save the scene, read it again"},
        {"Ctrl + Z, Ctrl + Y", "undo, redo"},
        {"Ctrl + click", "type a number into a control"},
        {"Tab, F1", "controls, this list"},
        {"Ctrl + Q", "end"},
    };
    bool shown = true;
    place_help();
    if (ImGui::Begin("Keys", &shown, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings)) {
        const float room = ImGui::GetIO().DisplaySize.x - 40 * scale;
        const float middle = fminf(230 * scale, 0.4f * room), end = fminf(middle + 310 * scale, room);
        for (const auto &key : keys) {
            draw_wrapped(key[0], middle - 10 * scale);
            ImGui::SameLine(middle);
            draw_wrapped(key[1], end);
        }
    }
    note_area(HELP);
    help_end = areas[HELP].high.y;
    note_window("(keys)");
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

/* Where the controls would leave less than a third of the window's width to the picture they wait behind a button, and come back where
 * there is room again. */
const float window_width = 330, narrow_width = 1.5f * window_width;
bool is_narrow, were_shown;

void fold_controls(nb_panel *panel)
{
    const bool was_narrow = is_narrow;
    is_narrow = ImGui::GetIO().DisplaySize.x < narrow_width * scale;
    if (is_narrow == was_narrow) return;
    if (is_narrow) were_shown = panel->shown;
    panel->shown = !is_narrow && (were_shown || panel->shown);
}

void draw_button(nb_panel *panel)
{
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::Begin("folded", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
    panel->shown |= press("Controls", "Tab brings them, and takes them away.");
    note_area(WINDOW);
    ImGui::End();
}

// After the notice: where that reaches over the controls they end above it.
void draw_window(nb_panel *panel)
{
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const area &notice = areas[NOTICE];
    const float width = fminf(window_width * scale, size.x);
    const bool is_below = notice.low.x < notice.high.x && notice.low.x < width;
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, is_below ? fmaxf(notice.low.y, 0) : size.y));
    ImGui::SetNextWindowBgAlpha(0.85f);
    ImGui::Begin("nebel", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoTitleBar |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(180 * scale);
    draw_state(panel);
    draw_commands(panel);
    ImGui::Separator();
    draw_look(panel);
    const double reach = find_reach(panel->data->camera);
    draw_time(panel);
    draw_fog(panel, reach);
    draw_nebulae(panel, reach);
    draw_cells(panel, reach);
    draw_models(panel, reach);
    draw_point_lights(panel, reach);
    draw_point_lights(panel);
    draw_planets(panel);
    draw_classic(panel, reach);
    draw_camera(panel, reach);
    ImGui::PopItemWidth();
    note_area(WINDOW);
    ImGui::End();
}

/* ---- keys that were down between two frames
 * ------------------------------------------------------------------------
 */

GLFWwindow *own_window;
int pressed[16], key_count, key_modifiers;

void hold_keys()
{
    ImGuiIO &io = ImGui::GetIO();
    for (int i = 0; i < key_count; i++) io.KeysDown[pressed[i]] = true;
    /* Letters of the same frame would be taken for commands. */
    if ((key_modifiers & GLFW_MOD_CONTROL) != 0 && io.InputQueueCharacters.empty()) io.KeyCtrl = true;
}

void release_keys()
{
    ImGuiIO &io = ImGui::GetIO();
    for (int i = 0; i < key_count; i++) io.KeysDown[pressed[i]] = glfwGetKey(own_window, pressed[i]) == GLFW_PRESS;
    if (key_modifiers != 0)
        io.KeyCtrl = glfwGetKey(own_window, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
                     glfwGetKey(own_window, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
    key_count = key_modifiers = 0;
}

void clear_answers(nb_panel *panel)
{
    panel->fog_changed = panel->camera_changed = panel->frame_changed = panel->look_changed = 0;
    panel->wants_save = panel->wants_reload = panel->wants_home = panel->wants_picture = 0;
    panel->wants_undo = panel->wants_redo = panel->has_read_message = panel->steps = 0;
}

} // namespace

extern "C" int nb_panel_open(void *window, double size)
{
    if (ImGui::CreateContext() == nullptr) return -1;
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    scale = float(size);
    ImFontConfig font;
    font.SizePixels = floorf(13 * scale);
    io.Fonts->AddFontDefault(&font);
    ImGui::StyleColorsDark();
    ImGui::GetStyle().ScaleAllSizes(scale);
    own_window = static_cast<GLFWwindow *>(window);
    ImGui_ImplGlfw_InitForOpenGL(own_window, true);
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
    places = controls != nullptr ? nb_target_open_list(controls) : nullptr;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    hold_keys();
    ImGui::NewFrame();
    if (places != nullptr && ImGui::GetIO().WantTextInput) fprintf(places, "0 0 0 0 (typing)\n");
    for (area &taken : areas) taken = area{ImVec2(0, 0), ImVec2(0, 0)};
    draw_notice(panel);
    fold_controls(panel);
    if (panel->shown)
        draw_window(panel);
    else if (is_narrow)
        draw_button(panel);
    if (panel->help_shown) draw_help(panel);
    release_keys();
    panel->is_held = ImGui::IsAnyItemActive();
    if (!panel->is_held) panel->held_noise.owner = 0;
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    end_places();
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

extern "C" void nb_panel_press_key(int key, int modifiers)
{
    key_modifiers |= modifiers;
    if (key < 0 || key >= IM_ARRAYSIZE(ImGui::GetIO().KeysDown) || key_count == IM_ARRAYSIZE(pressed)) return;
    pressed[key_count++] = key;
}

extern "C" void nb_panel_press_button(int modifiers)
{
    key_modifiers |= modifiers;
}

extern "C" int nb_panel_has_keys(void)
{
    return ImGui::GetIO().WantTextInput;
}
