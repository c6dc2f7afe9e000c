/* What was measured, beside its floor and its target. */
#ifndef NB_BENCH_FIGURES_H
#define NB_BENCH_FIGURES_H

#include <stddef.h>
#include <stdio.h>

typedef struct nb_figure {
    const char *group; /* texts of static storage */
    char name[80];
    const char *unit;
    double value;
    const char *floor_name;   /* NULL: the value stands for itself */
    double floor;             /* in the unit of the value, measured in the same run */
    double at_least, at_most; /* targets of value / floor; 0: none */
    double value_at_most;     /* target of the value itself; 0: none */
} nb_figure;

typedef struct nb_figures {
    nb_figure list[96];
    size_t count;
    const char *processor, *compiler; /* what they are measured with */
    int quick;                        /* the figures mean little: targets are not judged */
    FILE *table;                      /* every figure is printed when it is known; NULL: none */
} nb_figures;

/* Adds a figure and prints its line. */
void nb_figures_add(nb_figures *figures, const nb_figure *figure);

/* Writes the figures, and what they were measured with, as JSON. */
void nb_figures_write_json(const nb_figures *figures, FILE *file);

#endif
