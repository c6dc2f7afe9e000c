// Controls of the panel for one number, or a few that belong together. C++: behind panel.h only.
#ifndef NB_TOOLS_VIEWER_WIDGETS_H
#define NB_TOOLS_VIEWER_WIDGETS_H

#include <imgui.h>

#include <stdio.h>

namespace controls
{

// How large everything is: 1 on a screen of 96 pixels per inch.
extern float scale;

// Where the controls are, for programs that press them: a line for each. NULL: nobody asks.
extern FILE *places;

// Whose controls follow: their names in the list begin with it. Takes it back at its end.
class Owner
{
  public:
    Owner(const char *what, size_t index);
    ~Owner();
    Owner(const Owner &) = delete;
    Owner &operator=(const Owner &) = delete;

  private:
    size_t length;
};

// Puts the control that was drawn last into the list, without the unit in its name, and a text beside the mouse that
// rests on it.
void note_place(const char *name);
void explain(const char *text);

// All that follow return whether something has changed. `help` is what the number is, with its unit.
bool slide(const char *name, double *value, double low, double high, const char *format, bool logarithmic,
           const char *help);
bool slide_whole(const char *name, int *value, int low, int high, bool logarithmic, const char *help);

// Numbers to be dragged: a hundredth of the largest for each pixel, or of `least` where they are smaller. `low` is the
// least that there may be; -DBL_MAX: any.
bool drag(const char *name, double *values, int count, double least, double low, const char *format, const char *help);
bool drag_place(const char *name, double place[3], double reach, const char *help);
bool drag_length(const char *name, double *length, const char *help);

// Linear light, shown as the screen would show it. Only what is changed is rounded.
bool pick(const char *name, double color[3], bool is_share, const char *help);

bool press(const char *name, const char *help);
bool press_if(bool possible, const char *name, const char *help);
bool tick(const char *name, int *value, const char *help);
bool choose(const char *name, int *value, const char *const *names, int count, const char *help);
bool open_section(const char *name, bool open);

} // namespace controls

#endif
