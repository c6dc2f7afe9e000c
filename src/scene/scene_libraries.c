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

#if defined(NEBEL_HAVE_WEBP)
#include <webp/encode.h>
#endif

/* Its version is in headers of C++; NEBEL_HAVE_OPENVDB is that text. */
#if defined(NEBEL_HAVE_OPENVDB)
#define OPENVDB "OpenVDB " NEBEL_HAVE_OPENVDB
#else
#define OPENVDB "no OpenVDB"
#endif

/* Libraries that tell their version at run time only are asked each time; each thread writes the same text for itself.
 */
static _Thread_local char text[280];

static void write_webp(char *version, size_t size)
{
#if defined(NEBEL_HAVE_WEBP)
    const int webp = WebPGetEncoderVersion();
    snprintf(version, size, "WebP %d.%d.%d", webp >> 16, webp >> 8 & 255, webp & 255);
#else
    snprintf(version, size, "no WebP");
#endif
}

const char *nebel_scene_libraries(void)
{
    char webp[24];
    const int yajl = yajl_version();
    int major = 0, minor = 0, patch = 0;
    const char *extra = NULL;
    exr_get_library_version(&major, &minor, &patch, &extra);
    write_webp(webp, sizeof webp);
    snprintf(text, sizeof text,
             "Assimp %u.%u.%u, libpng %s, libjpeg-turbo %d.%d.%d, OpenEXR %d.%d.%d, yajl %d.%d.%d, zlib %s, Blosc %s, "
             "%s, " OPENVDB,
             aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch(), png_get_libpng_ver(NULL),
             LIBJPEG_TURBO_VERSION_NUMBER / 1000000, LIBJPEG_TURBO_VERSION_NUMBER / 1000 % 1000,
             LIBJPEG_TURBO_VERSION_NUMBER % 1000, major, minor, patch, yajl / 10000, yajl / 100 % 100, yajl % 100,
             zlibVersion(), blosc_get_version_string(), webp);
    return text;
}
