/* Shapes that own their parts and planes, and can be changed. */
#ifndef NB_TOOLS_VIEWER_OWNED_SHAPE_H
#define NB_TOOLS_VIEWER_OWNED_SHAPE_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Functions that return int give -1 where memory is out, otherwise 0. */

/* Copies what the shape points to, to be freed by nb_shape_free. On failure that is less than all. */
int nb_shape_own(nebel_shape *shape);
void nb_shape_free(nebel_shape *shape);

/* Bit by bit, but for addresses. */
int nb_shape_is_same(const nebel_shape *a, const nebel_shape *b);

/* Bytes of what it points to. */
size_t nb_shape_size(const nebel_shape *shape);

/* For people: "half space". */
const char *nb_shape_title(nebel_shape_type type);

/* Another type, with numbers of its own where those that are there would not do: around a place, about `size` metres
 * large. A shape of parts or planes begins as a box; what it was is the first part. On failure nothing has changed. */
int nb_shape_change(nebel_shape *shape, nebel_shape_type type, const double place[3], double size);

/* A copy of the last one behind it, a plane turned round. On failure nothing has changed. */
int nb_shape_add_plane(nebel_shape *shape);
int nb_shape_add_part(nebel_shape *shape);

void nb_shape_remove_plane(nebel_shape *shape, size_t index);
void nb_shape_remove_part(nebel_shape *shape, size_t index);

#ifdef __cplusplus
}
#endif
#endif
