/* The window and its OpenGL, by GLFW. */
#ifndef NB_TOOLS_VIEWER_WINDOW_H
#define NB_TOOLS_VIEWER_WINDOW_H

#include <stdint.h>

typedef enum nb_window_event_kind {
    NB_WINDOW_KEY_DOWN, /* also where it repeats */
    NB_WINDOW_KEY_UP,
    NB_WINDOW_BUTTON_DOWN,
    NB_WINDOW_BUTTON_UP,
    NB_WINDOW_MOTION,
    NB_WINDOW_WHEEL
} nb_window_event_kind;

typedef struct nb_window_event {
    nb_window_event_kind kind;
    int code, modifiers; /* key or button, by GLFW's numbers */
    double x, y;         /* of the cursor, in the window's coordinates; of the wheel, notches */
} nb_window_event;

typedef struct nb_window {
    void *handle; /* GLFWwindow */
    int has_panel;
    uint32_t width, height;        /* of the framebuffer, pixels; 0 while minimised */
    int inner_width, inner_height; /* in the window's coordinates */
    double time;                   /* s */
    double elapsed;                /* s since the turn before */
    int was_resized;
    nb_window_event *events; /* that wait, as many as a slow turn brings; who takes them leaves event_count */
    int event_count, event_capacity;
    double cursor_x, cursor_y; /* after the events so far: where the cursor is by now says nothing about a press */
    int news;                  /* events since the turn began */
    int awake;                 /* turns that do not wait */
    char driver[256];          /* GL_RENDERER and GL_VERSION */
    int can_be_lost;           /* the driver would say so */
    int is_lost;               /* it has */
    double scale;              /* of what people read: 1 on a screen of 96 pixels per inch */
    double patience;           /* s: how long a turn waits at most where nothing happens; 0: a quarter */
} nb_window;

/* A window with a context of OpenGL 3.3 core, which is current. Returns an exit status; what went wrong was said. */
int nb_window_open(nb_window *window, const char *title, uint32_t width, uint32_t height);

/* Fine with zeros. */
void nb_window_close(nb_window *window);

/* Begins a turn: waits for something to happen, a quarter of a second at most, or not at all where `busy`. */
void nb_window_wait(nb_window *window, int busy);

/* In the middle of a turn: whether something has happened that somebody waits for. */
void nb_window_poll(nb_window *window);
int nb_window_has_news(const nb_window *window);

/* Now [s], on the clock of the turns. */
double nb_window_now(void);

void nb_window_show(nb_window *window);
int nb_window_is_ended(const nb_window *window);
void nb_window_end(nb_window *window);
void nb_window_stay(nb_window *window);

/* Whether the driver has lost the context: for good. */
int nb_window_is_lost(nb_window *window);

#endif
