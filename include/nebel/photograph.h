/* nebel/photograph.h: photographs and rendered pictures that exist, how far away everything in them is, and the cameras that
 * took them: all that nebel_fog_pixels wants to put fog into them.
 *
 *     const nebel_scene_desc host = {0};
 *     nebel_photograph photograph;
 *     nebel_depth_map map;
 *     nebel_intrinsics camera;
 *     nebel_read_photograph("street.png", &host, &photograph);
 *     nebel_read_intrinsics("street.json", &host, &camera);
 *     nebel_read_depth("street_disparity.png", &(nebel_depth_source){.format = "cityscapes", .camera = &camera}, &host, &map);
 *
 *     nebel_pixels pixels = {.width = map.width, .height = map.height, .depth = map.depth, .depth_type = map.type,
 *                            .type = photograph.type, .srgb = 1, .color = photograph.pixels, .out = photograph.pixels};
 *     nebel_aim_pixels(&pixels, &camera, NULL);
 *     nebel_fog_pixels(fog, NEBEL_ISA_DEFAULT, &pixels);
 *     nebel_write_photograph("street_foggy.png", &host, &photograph);
 *
 * Of nebel_scene_desc `allocator` and `log` are read. Messages begin with the file. All functions are thread safe. Link with
 * libnebel_scene and libnebel.
 */
#ifndef NEBEL_PHOTOGRAPH_H
#define NEBEL_PHOTOGRAPH_H

#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- pictures -------------------------------------------------------------------------------- */

/* A picture as it is stored. PNG is RGB8, RGBA8, RGB16 or RGBA16, JPEG RGB8, OpenEXR RGB_FLOAT or RGBA_FLOAT; grey has three
 * equal colours. */
typedef struct nebel_photograph {
    uint32_t width, height;
    nebel_pixel_type type;
    void *pixels; /* rows without gaps, the top one first */
} nebel_photograph;

/* Reads a PNG of 8 or 16 bits, a JPEG or an OpenEXR picture, told apart by their first bytes. Of OpenEXR R, G, B and A are
 * read, or Y alone. Free with nebel_free_photograph and the same allocator. On an error it is empty. Errors: ARGUMENT,
 * FILE, FORMAT, LIMIT, UNSUPPORTED (among them less than 8 bits, CMYK), MEMORY. */
nebel_result nebel_read_photograph(const char *path, const nebel_scene_desc *desc, nebel_photograph *photograph);
void nebel_free_photograph(const nebel_scene_desc *desc, nebel_photograph *photograph);

/* Writes it as the ending of the name says: whole numbers .png, in sRGB, with as many bits; floats .exr. Files are replaced as
 * by nebel_write_image. Errors: ARGUMENT, FILE, FORMAT (another ending, or one that does not fit the numbers), LIMIT,
 * MEMORY. */
nebel_result nebel_write_photograph(const char *path, const nebel_scene_desc *desc, const nebel_photograph *photograph);

/* Writes a PNG of 16 bits, grey and linear, of one number a pixel, 0 to 1; what is outside is clamped. Errors as above. */
nebel_result nebel_write_gray(const char *path, const nebel_scene_desc *desc, uint32_t width, uint32_t height,
                              const float *values);

/* What endless fog between the camera and the scene would look like, 0 to 1 as the picture stores it (floats: light of any
 * brightness), by the dark channel: the darkest colour in 15 x 15 pixels around each; of the thousandth of the pixels where
 * that is largest (and all that are equal to its least) the one of median brightness. Sources: He, Sun and Tang, "Single image
 * haze removal using dark channel prior" (2009), who take the brightest; Sakaridis, Dai and Van Gool, "Semantic foggy
 * scene understanding with synthetic data" (2018), who take the median. Of equal brightness the first from the top left counts.
 * Errors: ARGUMENT, MEMORY. */
nebel_result nebel_estimate_airlight(const nebel_scene_desc *desc, const nebel_photograph *photograph,
                                     double airlight[3]);

/* ---- cameras --------------------------------------------------------------------------------- */

/* A camera without distortion. Pixel (x, y), counted from 0 at the top left, has its centre at (x, y), as OpenCV has it: the
 * middle of a picture is ((width - 1) / 2, (height - 1) / 2). */
typedef struct nebel_intrinsics {
    double fx, fy;   /* focal lengths in pixels, > 0 */
    double cx, cy;   /* where the axis meets the picture, in pixels */
    double baseline; /* m, between the cameras of a stereo pair; 0: not known */
} nebel_intrinsics;

/* Reads them from a file, told apart by what is in it:
 *
 *     Cityscapes JSON          intrinsic.fx, fy, u0, v0 and extrinsic.baseline
 *     KITTI calib.txt          P2 (or P_rect_02), 3 x 4; the baseline from P3 (P_rect_03) where it is there
 *     OpenCV YAML              data of camera_matrix or K, 3 x 3
 *     numbers                  fx fy cx cy, or with the baseline behind, or a matrix of 3 x 3 or 4 x 4
 *
 * Errors: ARGUMENT, FILE, FORMAT, VALUE (no focal length, NaN), LIMIT, MEMORY. */
nebel_result nebel_read_intrinsics(const char *path, const nebel_scene_desc *desc, nebel_intrinsics *intrinsics);

/* Those of a camera that sees so many degrees from the left to the right edge, 0 < degrees < 180, through square pixels whose
 * middle the axis meets. */
nebel_intrinsics nebel_intrinsics_of_view(double degrees, uint32_t width, uint32_t height);

/* Sets eye, corner, step_x and step_y: as the camera stands, of which position, look_at and up are read. NULL: at the origin,
 * looking along -z, y up. Errors: ARGUMENT (NULL, focal lengths that are not positive, numbers that are not finite, a camera
 * without a direction). */
nebel_result nebel_aim_pixels(nebel_pixels *pixels, const nebel_intrinsics *intrinsics, const nebel_camera *camera);

/* ---- depth ----------------------------------------------------------------------------------- */

typedef enum nebel_depth_measure {
    NEBEL_MEASURE_OF_FORMAT = 0,
    NEBEL_MEASURE_PLANAR,  /* m along the camera's axis */
    NEBEL_MEASURE_RADIAL,  /* m along the pixel's ray */
    NEBEL_MEASURE_INVERSE, /* 1 over metres along the axis; 0 is infinitely far */
    NEBEL_MEASURE_DISPARITY /* pixels between the two pictures of a stereo pair: baseline fx / disparity metres along the axis */
} nebel_depth_measure;

/* How a data set stores depth. Numbers times `scale` plus `offset` are of the measure. */
typedef struct nebel_depth_format {
    const char *name;  /* "kitti" */
    const char *about; /* half a line */
    nebel_depth_measure measure;
    double scale, offset;
    int32_t invalid;  /* the number that says that nothing is known; -1: none */
    int32_t infinite; /* the number that stands for the sky; -1: none */
    int files;        /* which files: the sum of the next */
} nebel_depth_format;

enum {
    NEBEL_DEPTH_FILES_16_BIT = 1, /* PNG, grey, 16 bits; NPY of uint16 */
    NEBEL_DEPTH_FILES_24_BIT = 2, /* PNG, RGB of 8 bits: R + 256 G + 65536 B */
    NEBEL_DEPTH_FILES_FLOAT = 4,  /* EXR; NPY of float32 or float64; PFM */
    NEBEL_DEPTH_FILES_8_BIT = 8   /* PNG, grey, 8 bits */
};

/* The formats from 0 on; NULL behind the last. "metric" is the first: any file, metres times the caller's scale. */
const nebel_depth_format *nebel_depth_format_at(size_t i);

/* NULL: there is none of that name. */
const nebel_depth_format *nebel_find_depth_format(const char *name);

typedef struct nebel_depth_source {
    const char *format;             /* NULL: "metric" */
    nebel_depth_measure measure;    /* in place of the format's; not where that is DISPARITY */
    double scale;                   /* > 0, of "metric" alone, which needs it where numbers are whole; 0: 1 */
    const char *channel;            /* of EXR; NULL: Z, depth.Z or the only one */
    const nebel_intrinsics *camera; /* of DISPARITY: fx and baseline are read */
} nebel_depth_source;

/* One float a pixel, as nebel_pixels has it: INFINITY where nothing is, NaN where nothing is known. */
typedef struct nebel_depth_map {
    uint32_t width, height;
    nebel_depth type;
    float *depth;
    size_t unknown_count, infinite_count; /* NaN and INFINITY among them, as read */
} nebel_depth_map;

/* Reads depth from PNG, OpenEXR, NPY (two dimensions, C order, little endian) or PFM, told apart by their first bytes. Nothing is
 * known where the format says so; of floats where they are NaN or negative, or 0 unless they are inverse. Floats from 1e9 on are
 * infinite. Free with nebel_free_depth and the same allocator. On an error it is empty. Errors: ARGUMENT, FILE, FORMAT, VALUE
 * (nothing is known of any pixel), LIMIT, UNSUPPORTED, MEMORY. */
nebel_result nebel_read_depth(const char *path, const nebel_depth_source *source, const nebel_scene_desc *desc,
                              nebel_depth_map *map);
void nebel_free_depth(const nebel_scene_desc *desc, nebel_depth_map *map);

/* Gives pixels of which nothing is known the larger depth of the nearest known ones to the left and right in their row, or of
 * the only one; rows without any that of the nearest rows above and below in the same way. What is missing in stereo and under
 * lasers is mostly what something nearer hides. The development kit of KITTI stereo interpolates so. */
void nebel_fill_depth(nebel_depth_map *map);

#ifdef __cplusplus
}
#endif
#endif
