#include "gltf_unpack.h"
#include "model/gltf_data.h"

#if defined(NEBEL_HAVE_MESHOPT)
#include <meshoptimizer.h>

static bool unpack_attributes(const nb_meshopt_view *view, const unsigned char *bytes, unsigned char *result)
{
    const size_t count = (size_t)view->count, stride = (size_t)view->stride;
    if (meshopt_decodeVertexBuffer(result, count, stride, bytes, (size_t)view->range.size) != 0) return false;
    if (view->filter == NB_MESHOPT_OCTAHEDRAL) meshopt_decodeFilterOct(result, count, stride);
    if (view->filter == NB_MESHOPT_QUATERNION) meshopt_decodeFilterQuat(result, count, stride);
    if (view->filter == NB_MESHOPT_EXPONENTIAL) meshopt_decodeFilterExp(result, count, stride);
    return true;
}

static bool unpack(const nb_meshopt_view *view, const unsigned char *bytes, unsigned char *result)
{
    const size_t count = (size_t)view->count, stride = (size_t)view->stride, size = (size_t)view->range.size;
    if (count == 0) return true;
    switch (view->mode) {
    case NB_MESHOPT_ATTRIBUTES:
        return unpack_attributes(view, bytes, result);
    case NB_MESHOPT_TRIANGLES:
        return meshopt_decodeIndexBuffer(result, count, stride, bytes, size) == 0;
    default:
        return meshopt_decodeIndexSequence(result, count, stride, bytes, size) == 0;
    }
}

nb_unpack nb_unpack_meshopt(void)
{
    return unpack;
}
#else
nb_unpack nb_unpack_meshopt(void)
{
    return NULL;
}
#endif
