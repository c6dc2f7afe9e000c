/* What this build is linked with. */
#include <nebel/scene.h>

#include <assimp/version.h>
#include <stdio.h>
#include <blosc.h>
#include <jpeglib.h>
#include <openexr.h>
#include <png.h>
#include <yajl/yajl_version.h>
#include <zlib.h>

/* Libraries that tell their version at run time only are asked each time; each thread writes the same text for itself.
 */
static _Thread_local char text[200];

const char *nebel_scene_libraries(void)
{
    const int yajl = yajl_version();
    int major = 0, minor = 0, patch = 0;
    const char *extra = NULL;
    exr_get_library_version(&major, &minor, &patch, &extra);
    snprintf(text, sizeof text,
             "Assimp %u.%u.%u, libpng %s, libjpeg-turbo %d.%d.%d, OpenEXR %d.%d.%d, yajl %d.%d.%d, zlib %s, Blosc %s",
             aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch(), png_get_libpng_ver(NULL),
             LIBJPEG_TURBO_VERSION_NUMBER / 1000000, LIBJPEG_TURBO_VERSION_NUMBER / 1000 % 1000,
             LIBJPEG_TURBO_VERSION_NUMBER % 1000, major, minor, patch, yajl / 10000, yajl / 100 % 100, yajl % 100,
             zlibVersion(), blosc_get_version_string());
    return text;
}
