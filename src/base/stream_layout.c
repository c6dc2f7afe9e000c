#include "stream_layout.h"

static const size_t position_size = 3 * sizeof(float);

static size_t size_of(nebel_vertex_format format)
{
    return format == NEBEL_VERTEX_RGBA_FLOAT ? 4 * sizeof(float) : sizeof(float);
}

size_t nb_layout_stride(const nebel_vertex_output *output)
{
    return output->stride != 0 ? output->stride : size_of(output->format);
}

static nb_memory_span span_of_positions(const nebel_vertices *v)
{
    return (nb_memory_span){(uintptr_t)v->positions, position_size,
                            v->position_stride != 0 ? v->position_stride : position_size};
}

/* Of a colour that keeps its red, green and blue the last byte alone. */
static nb_memory_span span_of_output(const nebel_vertex_output *output)
{
    const uintptr_t first = (uintptr_t)output->data;
    const size_t size = size_of(output->format), stride = nb_layout_stride(output);
    if (output->format == NEBEL_VERTEX_SPECULAR_ALPHA || output->format == NEBEL_VERTEX_ALPHA)
        return (nb_memory_span){first + size - 1, 1, stride};
    return (nb_memory_span){first, size, stride};
}

int nb_span_fits(const nb_memory_span *s, size_t n)
{
    return n - 1 <= (UINTPTR_MAX - s->size - s->first) / s->stride;
}

static uintptr_t end_of(const nb_memory_span *s, size_t n)
{
    return s->first + (n - 1) * s->stride + s->size;
}

int nb_spans_share_bytes(const nb_memory_span *a, const nb_memory_span *b, size_t n)
{
    if (a->first >= end_of(b, n) || b->first >= end_of(a, n)) return 0;
    if (a->stride != b->stride) return 1;
    const uintptr_t stride = a->stride;
    const uintptr_t place =
        b->first >= a->first ? (b->first - a->first) % stride : (stride - (a->first - b->first) % stride) % stride;
    return place < a->size || place + b->size > stride;
}

static const char *fault_of_output(const nebel_vertex_output *output, size_t n)
{
    if ((unsigned)output->format >= NEBEL_VERTEX_FORMAT_COUNT) return "an output's format is unknown";
    if (output->data == NULL) return "an output's data must not be NULL";
    if (nb_layout_stride(output) < size_of(output->format))
        return "an output's stride is shorter than its format: its elements overlap";
    const nb_memory_span s = span_of_output(output);
    return nb_span_fits(&s, n) ? NULL : "an output reaches beyond all memory";
}

static const char *fault_of_positions(const nebel_vertices *vertices, size_t n)
{
    const nb_memory_span s = span_of_positions(vertices);
    if (vertices->positions == NULL) return "positions must not be NULL";
    if (s.stride < position_size) return "position_stride must be 12 or more";
    return nb_span_fits(&s, n) ? NULL : "positions reach beyond all memory";
}

const char *nb_layout_fault(size_t n, const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                            size_t output_count)
{
    if (n == 0) return NULL;
    const char *fault = fault_of_positions(vertices, n);
    for (size_t i = 0; i < output_count && fault == NULL; i++) fault = fault_of_output(&outputs[i], n);
    if (fault != NULL) return fault;
    const nb_memory_span positions = span_of_positions(vertices);
    for (size_t i = 0; i < output_count; i++) {
        const nb_memory_span a = span_of_output(&outputs[i]);
        if (nb_spans_share_bytes(&a, &positions, n)) return "an output and the positions share bytes";
        for (size_t k = 0; k < i; k++) {
            const nb_memory_span b = span_of_output(&outputs[k]);
            if (nb_spans_share_bytes(&a, &b, n)) return "two outputs share bytes";
        }
    }
    return NULL;
}
