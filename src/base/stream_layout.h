/* Where streams of vertices lie in memory, and whether they may lie there. */
#ifndef NB_BASE_STREAM_LAYOUT_H
#define NB_BASE_STREAM_LAYOUT_H

#include <nebel/classic.h>

#include <stdint.h>

/* The bytes of n elements: `size` at `first`, and again every `stride`. */
typedef struct nb_memory_span {
    uintptr_t first;
    size_t size, stride;
} nb_memory_span;

/* Whether n > 0 elements end within the address space. */
int nb_span_fits(const nb_memory_span *s, size_t n);

/* Elements of equal strides keep their places within the stride. Of others only arrays apart are taken. */
int nb_spans_share_bytes(const nb_memory_span *a, const nb_memory_span *b, size_t n);

/* The stride in bytes, its default put in. */
size_t nb_layout_stride(const nebel_vertex_output *output);

/* What is wrong with the streams of n vertices, or NULL: a pointer, a format, a stride, bytes that two of them share.
 */
const char *nb_layout_fault(size_t n, const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                            size_t output_count);

#endif
