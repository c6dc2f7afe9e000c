#define _POSIX_C_SOURCE 200809L
#define _DEFAULT_SOURCE

#include "progress_bar.h"

#include "messages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

/* Between two drawings, and before the first guess of the time left, in seconds. */
static const double drawing_pause = 0.1;
static const double guessing_pause = 0.5;

/* Between two lines of a log: twice as long each time. */
static const double first_line_pause = 2, longest_line_pause = 60;

enum { DEFAULT_COLUMNS = 80, WIDEST_BAR = 40, NARROWEST_BAR = 8 };

/* Seconds since some moment; never goes back. */
static double clock_seconds(void)
{
    struct timespec now;
    if (clock_gettime(CLOCK_MONOTONIC, &now) != 0) return 0;
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

nb_progress_bar nb_progress_bar_start(int quiet)
{
    const char *const terminal = getenv("TERM");
    const int able = terminal != NULL && terminal[0] != '\0' && strcmp(terminal, "dumb") != 0;
    const double now = clock_seconds();
    return (nb_progress_bar){
        .visible = !quiet && able && isatty(STDERR_FILENO), .started = now, .began = now, .drawn = -1};
}

void nb_progress_bar_begin(nb_progress_bar *meter)
{
    meter->began = clock_seconds();
}

void nb_progress_bar_write_span(double seconds, char *text, size_t size)
{
    if (seconds < 9.95) {
        (void)snprintf(text, size, "%.2g s", seconds < 0.01 ? 0.01 : seconds);
        return;
    }
    const long whole = seconds < 1e9 ? (long)(seconds + 0.5) : 1000000000;
    if (whole < 60) {
        (void)snprintf(text, size, "%ld s", whole);
    } else if (whole < 3600) {
        (void)snprintf(text, size, "%ld min %02ld s", whole / 60, whole % 60);
    } else {
        (void)snprintf(text, size, "%ld h %02ld min", whole / 3600, whole / 60 % 60);
    }
}

static int terminal_columns(void)
{
    struct winsize window;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &window) != 0 || window.ws_col == 0) return DEFAULT_COLUMNS;
    return window.ws_col;
}

/* "LABEL [#####.....]  45 %  12 s left", as much of it as the terminal is wide. */
static void draw(double done, const char *label, const char *left)
{
    char bar[WIDEST_BAR + 3] = "", line[256];
    const int columns = terminal_columns();
    const int rest = (int)strlen(label) + (int)strlen(left) + 16;
    int width = columns - rest;
    if (width > WIDEST_BAR) width = WIDEST_BAR;
    if (width >= NARROWEST_BAR) {
        const int full = (int)(done * width);
        bar[0] = '[';
        memset(bar + 1, '#', (size_t)full);
        memset(bar + 1 + full, '.', (size_t)(width - full));
        bar[width + 1] = ']';
    }
    const int size = snprintf(line, sizeof line, "%s%s%s %3d %%%s%s", label, label[0] != '\0' ? " " : "", bar,
                              (int)(100 * done), left[0] != '\0' ? "  " : "", left);
    if (size >= columns && columns < (int)sizeof line) line[columns > 0 ? columns - 1 : 0] = '\0';
    nb_report_status(line);
}

void nb_progress_bar_write_lines(nb_progress_bar *meter)
{
    if (meter->visible) return;
    meter->line_pause = first_line_pause;
    meter->drawn = meter->started;
}

/* Whether it is time to say something. */
static int is_due(const nb_progress_bar *meter, double now)
{
    if (meter->visible) return meter->drawn < 0 || now - meter->drawn >= drawing_pause;
    return meter->line_pause > 0 && now - meter->drawn >= meter->line_pause;
}

static void write_line(nb_progress_bar *meter, double done, const char *label, const char *left)
{
    nb_report_message("%s%s%d %%%s%s", label, label[0] != '\0' ? ", " : "", (int)(100 * done),
                      left[0] != '\0' ? ", " : "", left);
    meter->line_pause = fmin(2 * meter->line_pause, longest_line_pause);
}

void nb_progress_bar_show(nb_progress_bar *meter, double done, const char *label)
{
    if (!meter->visible && meter->line_pause == 0) return;
    const double now = clock_seconds();
    if (!is_due(meter, now)) return;
    meter->drawn = now;
    char span[32], left[48] = "";
    const double share = done > 1 ? 1 : done < 0 ? 0 : done;
    const double spent = now - meter->began;
    if (spent > guessing_pause && share > 0) {
        const double remaining = spent * (1 - share) / share;
        nb_progress_bar_write_span(ceil(remaining), span, sizeof span);
        (void)snprintf(left, sizeof left, "%s left", span);
    }
    if (meter->visible)
        draw(share, label, left);
    else
        write_line(meter, share, label, left);
}

void nb_progress_bar_say(const nb_progress_bar *meter, const char *words)
{
    if (meter->visible) nb_report_status(words);
}

double nb_progress_bar_end(nb_progress_bar *meter)
{
    if (meter->visible) nb_report_status("");
    return clock_seconds() - meter->started;
}
