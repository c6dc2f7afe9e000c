/* Where streams of vertices lie in memory, and whether they may lie there. */
#ifndef NB_CLASSIC_LAYOUT_H
#define NB_CLASSIC_LAYOUT_H

#include <nebel/classic.h>

/* The stride in bytes, its default put in. */
size_t nb_layout_stride(const nebel_vertex_output *output);

/* What is wrong with the streams of n vertices, or NULL: a pointer, a format, a stride, bytes that two of them share.
 */
const char *nb_layout_fault(size_t n, const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                            size_t output_count);

#endif
