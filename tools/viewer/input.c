#include "input.h"

#include "camera_control.h"
#include "panel.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <math.h>
#include <stddef.h>
#include <string.h>

/* A drag over the height of the window turns by half a circle; a notch of the wheel is a tenth nearer; flying crosses
 * half of the distance to the aim in a second, four times that with Shift. */
static const double turn_angle = 3.14159265358979323846, wheel_factor = 0.9, fly_speed = 0.5, hurry = 4;

/* How near to the line between the pictures the mouse takes hold of it, in heights of the window. */
static const double line_width = 0.01;

/* ---- keys
 * ------------------------------------------------------------------------------------------------------------
 */

static void press(nb_input *hands, nb_display *look, int key, int modifiers)
{
    const int with_control = (modifiers & GLFW_MOD_CONTROL) != 0, with_shift = (modifiers & GLFW_MOD_SHIFT) != 0;
    const nb_display before = *look;
    if (with_control) {
        hands->wants_save |= key == GLFW_KEY_S;
        hands->wants_end |= key == GLFW_KEY_Q;
        hands->wants_undo |= key == GLFW_KEY_Z && !with_shift;
        hands->wants_redo |= key == GLFW_KEY_Y || (key == GLFW_KEY_Z && with_shift);
        return;
    }
    hands->wants_home |= key == GLFW_KEY_HOME || key == GLFW_KEY_H;
    /* Two presses in one slow turn are none. */
    hands->wants_help ^= key == GLFW_KEY_F1;
    hands->wants_panel ^= key == GLFW_KEY_TAB;
    hands->wants_play ^= key == GLFW_KEY_SPACE;
    hands->steps = key == GLFW_KEY_COMMA ? -1 : key == GLFW_KEY_PERIOD ? 1 : hands->steps;
    hands->wants_reload |= key == GLFW_KEY_F5;
    hands->wants_picture |= key == GLFW_KEY_F12 && !with_shift;
    hands->wants_window_picture |= key == GLFW_KEY_F12 && with_shift;
    if (key >= GLFW_KEY_1 && key < GLFW_KEY_1 + NB_LOOK_PLANES) look->plane = (nb_display_plane)(key - GLFW_KEY_1);
    if (key == GLFW_KEY_C) look->compare = (nb_display_compare)((look->compare + 1) % NB_LOOK_COMPARES);
    if (key == GLFW_KEY_LEFT_BRACKET) look->exposure = fmax(-20, look->exposure - 0.5);
    if (key == GLFW_KEY_RIGHT_BRACKET) look->exposure = fmin(20, look->exposure + 0.5);
    hands->changed_look |= look->plane != before.plane || look->compare != before.compare;
}

static const int fly_keys[] = {GLFW_KEY_D, GLFW_KEY_A, GLFW_KEY_E, GLFW_KEY_Q, GLFW_KEY_W, GLFW_KEY_S};
enum { FLY_KEYS = sizeof fly_keys / sizeof *fly_keys };

static unsigned find_fly_key(int key)
{
    for (int i = 0; i < FLY_KEYS; i++) {
        if (fly_keys[i] == key) return 1u << i;
    }
    return 0;
}

/* `keys` went down in this turn, and may have come up again. */
static void fly(nb_input *hands, unsigned keys, const nb_window *window, nebel_camera *camera)
{
    const int in_a_hurry = glfwGetKey(window->handle, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
                           glfwGetKey(window->handle, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
    const double speed = nb_navigate_distance(camera) * fly_speed * (in_a_hurry ? hurry : 1);
    const unsigned all = keys | hands->keys_down;
    double way[3];
    if (all == 0) return;
    for (int i = 0; i < 3; i++) {
        const int sign = (int)(all >> 2 * i & 1) - (int)(all >> (2 * i + 1) & 1);
        way[i] = sign * speed * fmin(window->elapsed, 0.1);
    }
    nb_navigate_fly(camera, way);
    hands->moved_camera = 1;
}

/* ---- mouse
 * -----------------------------------------------------------------------------------------------------------
 */

static nb_drag_mode take_hold(const nb_input *hands, const nb_window_event *event, const nb_display *look,
                              double aspect)
{
    if (nb_panel_has_place(event->x, event->y)) return NB_HANDS_ELSEWHERE;
    if (event->code == GLFW_MOUSE_BUTTON_MIDDLE) return NB_HANDS_PAN;
    if (event->code == GLFW_MOUSE_BUTTON_RIGHT) return NB_HANDS_LOOK;
    if (event->code != GLFW_MOUSE_BUTTON_LEFT) return NB_HANDS_ELSEWHERE;
    if ((event->modifiers & GLFW_MOD_SHIFT) != 0) return NB_HANDS_PAN;
    const int at_line = look->compare == NB_LOOK_SPLIT && fabs(hands->x - look->split * aspect) < line_width;
    return at_line ? NB_HANDS_SPLIT : NB_HANDS_ORBIT;
}

static void drag(nb_input *hands, double dx, double dy, nebel_camera *camera, nb_display *look, double aspect)
{
    switch (hands->grip) {
    case NB_HANDS_ORBIT:
        nb_navigate_orbit(camera, dx * turn_angle, -dy * turn_angle);
        break;
    case NB_HANDS_PAN:
        nb_navigate_pan(camera, -dx, dy);
        break;
    case NB_HANDS_LOOK:
        nb_navigate_look(camera, dx * turn_angle / 2, -dy * turn_angle / 2);
        break;
    case NB_HANDS_SPLIT:
        look->split = fmin(1, fmax(0, hands->x / aspect));
        return;
    default:
        return;
    }
    hands->moved_camera = 1;
}

static void move_cursor(nb_input *hands, const nb_window *window, const nb_window_event *event, nebel_camera *camera,
                        nb_display *look)
{
    const double x = event->x / window->inner_height, y = event->y / window->inner_height;
    const double dx = x - hands->x, dy = y - hands->y;
    hands->x = x;
    hands->y = y;
    if (dx != 0 || dy != 0) drag(hands, dx, dy, camera, look, (double)window->inner_width / window->inner_height);
}

static void turn_wheel(nb_input *hands, const nb_window *window, double notches, nebel_camera *camera)
{
    if (nb_panel_has_place(hands->x * window->inner_height, hands->y * window->inner_height)) return;
    nb_navigate_dolly(camera, pow(wheel_factor, notches));
    hands->moved_camera = 1;
}

/* ---- events
 * ----------------------------------------------------------------------------------------------------------
 */

static void press_button(nb_input *hands, const nb_window *window, const nb_window_event *event, const nb_display *look)
{
    if (hands->grip != NB_HANDS_FREE) return;
    hands->grip = take_hold(hands, event, look, (double)window->inner_width / window->inner_height);
    hands->button = event->code;
}

static void take_event(nb_input *hands, const nb_window *window, const nb_window_event *event, nebel_camera *camera,
                       nb_display *look)
{
    switch (event->kind) {
    case NB_WINDOW_KEY_DOWN:
        nb_panel_press_key(event->code, event->modifiers);
        if (!nb_panel_has_keys()) press(hands, look, event->code, event->modifiers);
        if (!nb_panel_has_keys() && event->modifiers == (event->modifiers & GLFW_MOD_SHIFT))
            hands->keys_down |= find_fly_key(event->code);
        break;
    case NB_WINDOW_KEY_UP:
        hands->keys_down &= ~find_fly_key(event->code);
        break;
    case NB_WINDOW_BUTTON_DOWN:
        nb_panel_press_button(event->modifiers);
        move_cursor(hands, window, event, camera, look);
        press_button(hands, window, event, look);
        break;
    case NB_WINDOW_BUTTON_UP:
        move_cursor(hands, window, event, camera, look);
        if (event->code == hands->button) hands->grip = NB_HANDS_FREE;
        break;
    case NB_WINDOW_MOTION:
        move_cursor(hands, window, event, camera, look);
        break;
    case NB_WINDOW_WHEEL:
        turn_wheel(hands, window, event->y, camera);
        break;
    }
}

/* What comes behind a command waits until it is obeyed, so that each counts, in its order. */
static int has_command(const nb_input *hands)
{
    return hands->wants_undo || hands->wants_redo || hands->wants_save || hands->wants_reload || hands->steps != 0;
}

void nb_input_move(nb_input *hands, nb_window *window, nebel_camera *camera, nb_display *look)
{
    *hands = (nb_input){
        .x = hands->x, .y = hands->y, .grip = hands->grip, .button = hands->button, .keys_down = hands->keys_down};
    unsigned keys = 0;
    int taken = 0;
    while (taken < window->event_count && !has_command(hands)) {
        take_event(hands, window, &window->events[taken++], camera, look);
        keys |= hands->keys_down;
    }
    window->event_count -= taken;
    if (taken > 0)
        memmove(window->events, window->events + taken, (size_t)window->event_count * sizeof *window->events);
    fly(hands, keys, window, camera);
}

int nb_input_are_busy(const nb_input *hands)
{
    return hands->keys_down != 0;
}
