/* Rays as text, one to a line: ox oy oz dx dy dz tmax. */
#ifndef NB_TOOLS_RAY_READER_H
#define NB_TOOLS_RAY_READER_H

#include <nebel/nebel.h>

#include <stddef.h>

/* The longest line, comment included, in bytes. */
#define NB_RAYS_LONGEST_LINE 65536

typedef struct nb_rays_entry {
    nebel_ray ray;
    size_t line; /* where it stands in the input, from 1 */
} nb_rays_entry;

/* A reader that is fed the input piece by piece. Starts as {0}. */
typedef struct nb_ray_list {
    nb_rays_entry *entries;
    size_t count, capacity;
    size_t line;   /* of the last line that was begun, from 1 */
    char *partial; /* the part of a line that the last piece ended with */
    size_t partial_size;
    char problem[192]; /* what is wrong with `line` and how to mend it, where a function returned 0 */
} nb_ray_list;

/* Reads the next piece. Numbers are separated by blanks or tabs; # begins a comment; empty lines are skipped; lines end
 * with \n or \r\n; a byte order mark at the very beginning is skipped. Every ray is checked: numbers finite (tmax may
 * be inf), a direction, tmax >= 0. Returns 0 on an error, after which the reader can only be freed. */
int nb_rays_feed(nb_ray_list *rays, const char *data, size_t size);

/* After the last piece: reads a line that has no end. Returns 0 on an error. */
int nb_rays_finish(nb_ray_list *rays);

void nb_rays_free(nb_ray_list *rays);

#endif
