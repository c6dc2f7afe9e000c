/* A bar on the terminal that says how far the work is and how long it will take. */
#ifndef NB_TOOLS_PROGRESS_BAR_H
#define NB_TOOLS_PROGRESS_BAR_H

#include <stddef.h>

typedef struct nb_progress_bar {
    int visible;
    double started, began, drawn; /* s */
    double line_pause;            /* s, until the next line; 0: none are written */
} nb_progress_bar;

/* Starts the clock. The bar is drawn only where standard error is a terminal that can go back to the beginning of a
 * line. */
nb_progress_bar nb_progress_bar_start(int quiet);

/* The work begins whose share is shown: what was prepared before says nothing of the time left. */
void nb_progress_bar_begin(nb_progress_bar *meter);

/* Where there is no bar: lines from time to time, for the logs of long jobs. */
void nb_progress_bar_write_lines(nb_progress_bar *meter);

/* `done` of all the work, 0 to 1; `label` may be "". Cheap to call often. */
void nb_progress_bar_show(nb_progress_bar *meter, double done, const char *label);

/* Words in its place until it is shown, for work whose end nobody knows. */
void nb_progress_bar_say(const nb_progress_bar *meter, const char *words);

/* Clears the bar. Returns the seconds since the start. */
double nb_progress_bar_end(nb_progress_bar *meter);

/* Writes a span of time for people: "0.31 s", "12 s", "3 min 05 s", "2 h 10 min". */
void nb_progress_bar_write_span(double seconds, char *text, size_t size);

#endif
