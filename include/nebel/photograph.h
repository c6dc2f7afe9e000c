/* nebel/photograph.h: photographs and rendered pictures that exist, how far away everything in them is, and the cameras that
 * took them: all that nebel_apply_fog_to_pixels wants to put fog into them.
 *
 *     const nebel_host host = {0};
 *     nebel_photograph photograph;
 *     nebel_depth_map map;
 *     nebel_intrinsics camera;
 *     nebel_read_photograph("street.png", &host, &photograph);
 *     nebel_read_intrinsics("street.json", &host, &camera);
 *     nebel_read_depth("street_disparity.png", &(nebel_depth_source){.format = "cityscapes", .camera = &camera}, &host, &map);
 *
 *     nebel_pixels pixels = {.width = map.width, .height = map.height, .depth = map.depth, .depth_type = map.type,
 *                            .type = photograph.type, .srgb = 1, .color = photograph.pixels, .output = photograph.pixels};
 *     nebel_aim_pixels(&pixels, &camera, NULL);
 *     nebel_apply_fog_to_pixels(snapshot, NEBEL_ISA_DEFAULT, &pixels);
 *     nebel_write_photograph("street_foggy.png", &host, &photograph, NULL);
 *
 * The host must not be NULL. Messages begin with the file. All functions are thread safe. Link with libnebel_scene and
 * libnebel.
 */
#ifndef NEBEL_PHOTOGRAPH_H
#define NEBEL_PHOTOGRAPH_H

#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- pictures -------------------------------------------------------------------------------- */

/* A picture as it is stored. PNG is RGB8, RGBA8, RGB16 or RGBA16, JPEG RGB8, OpenEXR RGB_FLOAT or RGBA_FLOAT; gray has
 * three equal colors. */
typedef struct nebel_photograph {
    uint32_t width, height;
    nebel_pixel_type type;
    void *pixels; /* rows without gaps, the top one first */
} nebel_photograph;

/* Reads a PNG of 8 or 16 bits, a JPEG or an OpenEXR picture; the first bytes of the file say which. The channels R, G,
 * B and A of OpenEXR are read, or Y alone. Free the photograph with nebel_free_photograph and the same allocator. After
 * an error the photograph is empty. Errors: ARGUMENT, FILE, FORMAT, LIMIT, UNSUPPORTED (among them fewer than 8 bits,
 * CMYK), MEMORY. */
NEBEL_API nebel_result nebel_read_photograph(const char *path, const nebel_host *host, nebel_photograph *photograph);
NEBEL_API void nebel_free_photograph(const nebel_host *host, nebel_photograph *photograph);

/* Writes whole numbers to a .png in sRGB with the bits of the photograph, floats to an .exr. The file is replaced as by
 * nebel_write_image. `record` is that of nebel_image_desc: what the picture was made from, for nebel_read_record; NULL:
 * none. Errors: ARGUMENT, FILE, FORMAT (another ending, or one that does not fit the numbers), LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_write_photograph(const char *path, const nebel_host *host,
                                              const nebel_photograph *photograph, const char *record);

/* Writes one number per pixel, 0 to 1, to a gray, linear PNG of 16 bits. Values outside are clamped. Errors: as above. */
NEBEL_API nebel_result nebel_write_gray(const char *path, const nebel_host *host, uint32_t width, uint32_t height,
                                        const float *values, const char *record);

/* Estimates the color of endless fog from the dark channel of a photograph: 0 to 1 as the photograph stores it, or
 * light if it stores floats. The dark channel of a pixel is the smallest number within 15 x 15 pixels around it. The
 * candidates are the thousandth of the pixels with the largest dark channel, and all pixels equal to the least of them.
 * The result is the candidate of median brightness (ITU-R BT.601), and among equals the first from the top left.
 * Sources: He, Sun and Tang, "Single image haze removal using dark channel prior" (2009), with the brightest candidate;
 * Sakaridis, Dai and Van Gool, "Semantic foggy scene understanding with synthetic data" (2018), with the median.
 * Errors: ARGUMENT, MEMORY. Any thread. O(pixels). */
NEBEL_API nebel_result nebel_estimate_airlight(const nebel_host *host, const nebel_photograph *photograph,
                                               double airlight[3]);

/* ---- cameras --------------------------------------------------------------------------------- */

/* A camera without distortion. Pixel (x, y), counted from 0 at the top left, has its center at (x, y), as OpenCV has
 * it: the middle of a picture is ((width - 1) / 2, (height - 1) / 2). */
typedef struct nebel_intrinsics {
    double fx, fy;   /* focal lengths in pixels, > 0 */
    double cx, cy;   /* where the axis meets the picture, in pixels */
    double baseline; /* m, between the cameras of a stereo pair; 0: not known */
} nebel_intrinsics;

/* Reads intrinsics from a file; the text says which kind it is:
 *
 *     Cityscapes JSON          intrinsic.fx, fy, u0, v0 and extrinsic.baseline
 *     KITTI calib.txt          P2 (or P_rect_02), 3 x 4; the baseline from P3 (P_rect_03) if the file has it
 *     OpenCV YAML              data of camera_matrix or K, 3 x 3
 *     numbers                  fx fy cx cy, then the baseline if it is known; or a matrix of 3 x 3 or 4 x 4
 *
 * Errors: ARGUMENT, FILE, FORMAT, VALUE (focal lengths that are not 1e-6 to 1e9, numbers that are not finite), LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_read_intrinsics(const char *path, const nebel_host *host, nebel_intrinsics *intrinsics);

/* Computes the intrinsics of a camera that sees `degrees`, 0 < degrees < 180, from the left edge of the picture to the
 * right one. Pixels are square, and the axis meets the middle of the picture. */
NEBEL_API nebel_intrinsics nebel_intrinsics_of_view(double degrees, uint32_t width, uint32_t height);

/* Sets eye, corner, step_x and step_y of `pixels`. Of `camera` position, look_at and up are read; NULL: a camera at the
 * origin that looks along -z, y up. Errors: ARGUMENT (NULL, focal lengths that are not positive, numbers that are not
 * finite, a camera without a direction). */
NEBEL_API nebel_result nebel_aim_pixels(nebel_pixels *pixels, const nebel_intrinsics *intrinsics,
                                        const nebel_camera *camera);

/* ---- depth ----------------------------------------------------------------------------------- */

typedef enum nebel_depth_measure {
    NEBEL_MEASURE_OF_FORMAT = 0,
    NEBEL_MEASURE_PLANAR,  /* m along the camera's axis */
    NEBEL_MEASURE_RADIAL,  /* m along the pixel's ray */
    NEBEL_MEASURE_INVERSE, /* 1 over meters along the axis; 0 is infinitely far */
    NEBEL_MEASURE_DISPARITY /* pixels between the two pictures of a stereo pair: baseline fx / disparity meters along the axis */
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
    NEBEL_DEPTH_FILES_16_BIT = 1, /* PNG, gray, 16 bits; NPY of uint16 */
    NEBEL_DEPTH_FILES_24_BIT = 2, /* PNG, RGB of 8 bits: R + 256 G + 65536 B */
    NEBEL_DEPTH_FILES_FLOAT = 4,  /* EXR; NPY of float32 or float64; PFM */
    NEBEL_DEPTH_FILES_8_BIT = 8   /* PNG, gray, 8 bits */
};

/* The formats from 0 on; NULL behind the last. "metric" is the first: any file, meters times the caller's scale. */
NEBEL_API const nebel_depth_format *nebel_depth_format_at(size_t i);

/* NULL: there is none of that name. */
NEBEL_API const nebel_depth_format *nebel_find_depth_format(const char *name);

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
    nebel_pixel_depth type;
    float *depth;
    size_t unknown_count, infinite_count; /* NaN and INFINITY among them, as read */
} nebel_depth_map;

/* Reads depth from PNG, OpenEXR, NPY (two dimensions, C order, little endian) or PFM; the first bytes of the file say
 * which. Unknown are the numbers that the format calls invalid; floats that are NaN or negative; and the float 0,
 * unless the measure is INVERSE. Floats from 1e9 m on are infinite. Free the map with nebel_free_depth and the same
 * allocator. After an error the map is empty. Errors: ARGUMENT, FILE, FORMAT, VALUE (all pixels are unknown; a baseline
 * is missing), LIMIT, UNSUPPORTED, MEMORY. */
NEBEL_API nebel_result nebel_read_depth(const char *path, const nebel_depth_source *source, const nebel_host *host,
                                        nebel_depth_map *map);
NEBEL_API void nebel_free_depth(const nebel_host *host, nebel_depth_map *map);

/* Replaces unknown depth by the larger of the nearest known depths to the left and to the right, or by the only one.
 * Rows without any known depth are filled from the rows above and below in the same way. Source: the development kit of
 * KITTI stereo fills disparity so, because most missing depth belongs to background that something nearer hides. */
NEBEL_API void nebel_fill_depth(nebel_depth_map *map);

#ifdef __cplusplus
}
#endif
#endif
