/* How data sets store depth. */
#include <nebel/photograph.h>

#include <string.h>

#define WHOLE (NEBEL_DEPTH_FILES_16_BIT | NEBEL_DEPTH_FILES_8_BIT)

/* Where the numbers come from:
 *
 *     cityscapes  README of cityscapesScripts: d = (p - 1) / 256, p = 0 is invalid
 *     kitti       readme of the KITTI depth benchmark: p / 256, 0 has no depth
 *     tum         "File formats" of the TUM RGB-D benchmark: 5000 is 1 m, 0 no data
 *     scannet     ScanNet, as Kinect and RealSense: millimeters, 0 no data
 *     vkitti      Virtual KITTI 1 and 2: centimeters, the sky at the largest number
 *     carla       CARLA, "Depth camera": (R + 256 G + 65536 B) / (2^24 - 1) of 1000 m
 *     hypersim    apple/ml-hypersim: meters along the ray, NaN where nothing is known */
static const nebel_depth_format formats[] = {
    {"metric", "meters times --depth-scale", NEBEL_MEASURE_PLANAR, 1, 0, 0, -1, WHOLE | NEBEL_DEPTH_FILES_FLOAT},
    {"cityscapes", "Cityscapes, disparity", NEBEL_MEASURE_DISPARITY, 1 / 256.0, -1 / 256.0, 0, 1,
     NEBEL_DEPTH_FILES_16_BIT},
    {"kitti", "KITTI depth, VOID", NEBEL_MEASURE_PLANAR, 1 / 256.0, 0, 0, -1, NEBEL_DEPTH_FILES_16_BIT},
    {"tum", "TUM RGB-D", NEBEL_MEASURE_PLANAR, 1 / 5000.0, 0, 0, -1, NEBEL_DEPTH_FILES_16_BIT},
    {"scannet", "ScanNet, Kinect, RealSense", NEBEL_MEASURE_PLANAR, 1 / 1000.0, 0, 0, -1, NEBEL_DEPTH_FILES_16_BIT},
    {"vkitti", "Virtual KITTI 1 and 2", NEBEL_MEASURE_PLANAR, 1 / 100.0, 0, 0, 65535, NEBEL_DEPTH_FILES_16_BIT},
    {"carla", "CARLA, SkyScenes", NEBEL_MEASURE_PLANAR, 1000 / 16777215.0, 0, -1, 16777215, NEBEL_DEPTH_FILES_24_BIT},
    {"hypersim", "Hypersim, HDF5 made NPY or EXR", NEBEL_MEASURE_RADIAL, 1, 0, -1, -1, NEBEL_DEPTH_FILES_FLOAT},
};

enum { FORMATS = sizeof formats / sizeof *formats };

const nebel_depth_format *nebel_depth_format_at(size_t i)
{
    return i < FORMATS ? &formats[i] : NULL;
}

const nebel_depth_format *nebel_find_depth_format(const char *name)
{
    for (size_t i = 0; i < FORMATS && name != NULL; i++)
        if (strcmp(formats[i].name, name) == 0) return &formats[i];
    return NULL;
}
