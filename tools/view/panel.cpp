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

void note_place(const char *name)
{
    if (places == nullptr) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    fprintf(places, "%d %d %d %d %s\n", int(low.x), int(low.y), int(high.x - low.x), int(high.y - low.y), name);
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
    if (look->plane == NB_LOOK_DEPTH) slide("grey at", &look->range, 0.1, 10000, "%.4g m", true);
}

void draw_state(const nb_panel *panel)
{
    ImGui::TextUnformatted(panel->scene);
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
    panel->wants_home = press("Home");
    ImGui::SameLine();
    panel->help_shown |= press("Keys");
    draw_look(panel);
    ImGui::PopItemWidth();
    note_area(WINDOW);
    ImGui::End();
}

void clear_answers(nb_panel *panel)
{
    panel->fog_changed = panel->light_changed = panel->camera_changed = 0;
    panel->frame_changed = panel->look_changed = 0;
    panel->wants_save = panel->wants_reload = panel->wants_home = panel->wants_screenshot = 0;
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
