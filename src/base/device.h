/* What renderers have in common of classic hardware: colors as frame buffers store them, and depth as a device has it. */
#ifndef NB_DEVICE_H
#define NB_DEVICE_H

#include <nebel/nebel.h>

#include <math.h>

/* ---- colors ---------------------------------------------------------------------------------- */

/* They are stored, blended and shown in sRGB (IEC 61966-2-1), from 0 to 1. */
static inline double nb_device_store(double linear)
{
    if (!(linear > 0)) return 0;
    if (!(linear < 1)) return 1;
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

static inline double nb_device_restore(double stored)
{
    if (!(stored > 0)) return 0;
    if (!(stored < 1)) return 1;
    return stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4);
}

/* Of light that some amount of fog adds: as much fog of the stored color. */
static inline double nb_device_store_fog(double amount, double light)
{
    return amount > 0 ? amount * nb_device_store(light / amount) : nb_device_store(light);
}

/* ---- depth ----------------------------------------------------------------------------------- */

/* Of an orthographic projection [m]: where device depth is 0 and 1. */
typedef struct nb_device_planes {
    double near, far;
} nb_device_planes;

/* Both 0: those of a program that says nothing. Errors: VALUE. */
static inline nebel_result nb_device_planes_set(nb_device_planes *planes, double near, double far)
{
    *planes = near == 0 && far == 0 ? (nb_device_planes){0, 1000} : (nb_device_planes){near, far};
    return isfinite(near) && isfinite(far) && planes->near < planes->far ? NEBEL_OK : NEBEL_ERROR_VALUE;
}

/* What lies before the near plane or behind the far one is clipped by a device, and counts as on it here. */
static inline double nb_device_depth(const nb_device_planes *planes, double depth)
{
    return fmin(fmax((depth - planes->near) / (planes->far - planes->near), 0), 1);
}

#endif
