#include "widgets.h"

#include <float.h>
#include <math.h>
#include <string.h>

namespace controls
{

float scale = 1;
FILE *places;

static char owners[128];

Owner::Owner(const char *what, size_t index) : length(strlen(owners))
{
    snprintf(owners + length, sizeof owners - length, "%s[%u].", what, unsigned(index));
    ImGui::PushID(what);
    ImGui::PushID(int(index));
}

Owner::~Owner()
{
    owners[length] = '\0';
    ImGui::PopID();
    ImGui::PopID();
}

void note_place(const char *name)
{
    if (places == nullptr || !ImGui::IsItemVisible()) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    const char *const unit = strstr(name, " [");
    fprintf(places, "%d %d %d %d %s%.*s\n", int(low.x), int(low.y), int(high.x - low.x), int(high.y - low.y), owners,
            unit != nullptr ? int(unit - name) : int(strlen(name)), name);
}

void explain(const char *text)
{
    if (!ImGui::IsItemHovered() || ImGui::IsItemActive()) return;
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(300 * scale);
    ImGui::TextUnformatted(text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

static bool finish(bool changed, const char *name, const char *help)
{
    note_place(name);
    explain(help);
    return changed;
}

bool slide(const char *name, double *value, double low, double high, const char *format, bool logarithmic,
           const char *help)
{
    const ImGuiSliderFlags flags = logarithmic ? ImGuiSliderFlags_Logarithmic : 0;
    return finish(ImGui::SliderScalar(name, ImGuiDataType_Double, value, &low, &high, format, flags), name, help);
}

bool slide_whole(const char *name, int *value, int low, int high, bool logarithmic, const char *help)
{
    const ImGuiSliderFlags flags = ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
    return finish(ImGui::SliderInt(name, value, low, high, "%d", flags), name, help);
}

static bool fits(const char *format, const double *values, int count, float width)
{
    char text[64];
    for (int i = 0; i < count; i++) {
        snprintf(text, sizeof text, format, values[i]);
        if (ImGui::CalcTextSize(text).x > width) return false;
    }
    return true;
}

// As many digits as the boxes of a group have room for; small numbers have exponents beside them.
static const char *shorten(const char *format, const double *values, int count)
{
    static const char *const shorter[] = {"%.4g", "%.3g", "%.2g", "%.1g"};
    const ImGuiStyle &style = ImGui::GetStyle();
    const float boxes = ImGui::CalcItemWidth() - style.ItemInnerSpacing.x * float(count - 1);
    if (strcmp(format, shorter[0]) != 0) return format;
    int digits = 0;
    while (digits < 3 && !fits(shorter[digits], values, count, boxes / float(count) - 2 * style.FramePadding.x))
        digits++;
    return digits > 0 ? shorter[digits] : format;
}

// Dear ImGui 1.86 forgets to take back the width of a group of one.
static bool drag_numbers(const char *name, double *values, int count, float step, const double *low, const double *high,
                         const char *format, ImGuiSliderFlags flags)
{
    return count == 1 ? ImGui::DragScalar(name, ImGuiDataType_Double, values, step, low, high, format, flags)
                      : ImGui::DragScalarN(name, ImGuiDataType_Double, values, count, step, low, high, format, flags);
}

bool drag(const char *name, double *values, int count, double least, double low, const char *format, const char *help)
{
    const double high = DBL_MAX;
    const bool has_low = low > -DBL_MAX;
    double largest = least;
    for (int i = 0; i < count; i++) largest = fmax(largest, fabs(values[i]));
    const char *const shown = shorten(format, values, count);
    const ImGuiSliderFlags flags =
        (has_low ? ImGuiSliderFlags_AlwaysClamp : 0) | (shown != format ? ImGuiSliderFlags_NoRoundToFormat : 0);
    const bool changed = drag_numbers(name, values, count, float(largest / 100), has_low ? &low : nullptr,
                                      has_low ? &high : nullptr, shown, flags);
    return finish(changed, name, help);
}

bool drag_place(const char *name, double place[3], double reach, const char *help)
{
    char label[48];
    snprintf(label, sizeof label, "%s [m]", name);
    return drag(label, place, 3, reach / 10, -DBL_MAX, "%.4g", help);
}

bool drag_length(const char *name, double *length, const char *help)
{
    return drag(name, length, 1, 0.01, 1e-6, "%.4g m", help);
}

bool pick(const char *name, double color[3], bool is_share, const char *help)
{
    float shown[3] = {float(color[0]), float(color[1]), float(color[2])};
    const ImGuiColorEditFlags flags = ImGuiColorEditFlags_Float | (is_share ? 0 : ImGuiColorEditFlags_HDR);
    const bool changed = ImGui::ColorEdit3(name, shown, flags);
    for (int c = 0; c < 3; c++) {
        if (shown[c] != float(color[c])) color[c] = fmax(0, floor(double(shown[c]) * 1e4 + 0.5) / 1e4);
    }
    return finish(changed, name, help);
}

bool press(const char *name, const char *help)
{
    return finish(ImGui::Button(name), name, help);
}

bool press_if(bool possible, const char *name, const char *help)
{
    if (possible) return press(name, help);
    ImGui::BeginDisabled();
    ImGui::Button(name);
    ImGui::EndDisabled();
    return false;
}

bool tick(const char *name, int *value, const char *help)
{
    bool is = *value != 0;
    const bool changed = ImGui::Checkbox(name, &is);
    *value = is;
    return finish(changed, name, help);
}

bool choose(const char *name, int *value, const char *const *names, int count, const char *help)
{
    const int before = *value;
    const bool is_open = ImGui::BeginCombo(name, names[before]);
    finish(false, name, help);
    if (!is_open) return false;
    for (int i = 0; i < count; i++) {
        char place[64];
        if (ImGui::Selectable(names[i], i == before)) *value = i;
        snprintf(place, sizeof place, "%s: %s", name, names[i]);
        note_place(place);
    }
    ImGui::EndCombo();
    return *value != before;
}

bool open_section(const char *name, bool open)
{
    const bool is_open = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    note_place(name);
    return is_open;
}

} // namespace controls
