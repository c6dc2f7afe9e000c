#include "sheet.h"

#include "base/vector.h"

#include <math.h>

/* Where a place of a ray is in its shadow's sheet: in texels, and how many times as far from the light as the sheet. */
static double look_up(const nb_sheet *sheet, const nb_sheet_lamp *lamp, const nb_shaft_rays *rays, uint32_t lane,
                      float t, double texel[2])
{
    double way[3], farness = 1;
    for (int c = 0; c < 3; c++) way[c] = (double)rays->start[c][lane] + (double)t * (double)rays->way[c][lane];
    if (lamp != NULL) farness = nb_vector_dot(lamp->normal, way) / lamp->distance;
    for (int c = 0; c < 3; c++) way[c] = way[c] / farness + (lamp != NULL ? lamp->place[c] : 0) - sheet->place[c];
    for (int i = 0; i < 2; i++) texel[i] = sheet->at[i] + nb_vector_dot(sheet->slope[i], way);
    return farness;
}

/* As nb_extend and nb_replace, of one lane. */
static int add(nb_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, float enter, float leave,
               nb_shaft_rays *rays)
{
    const float gap = nb_closeness * fabsf(fminf(leave, rays->leave[lane]));
    if (!(enter < leave)) return 1;
    if (enter <= rays->leave[lane] + gap && leave >= rays->enter[lane] - gap) {
        rays->enter[lane] = fminf(enter, rays->enter[lane]);
        rays->leave[lane] = fmaxf(leave, rays->leave[lane]);
        return 1;
    }
    if (!nb_shafts_keep(shafts, allocator, lane, rays)) return 0;
    rays->enter[lane] = enter;
    rays->leave[lane] = leave;
    return 1;
}

/* The place on the ray that is seen at s of the way over the sheet: of all ways to divide a line in perspective the one
 * in which cross ratios stay. */
static float place_at(double s, float enter, float leave, double near, double far)
{
    const double part = s * near / (s * near + (1 - s) * far);
    return s >= 1 ? leave : (float)((double)enter + part * ((double)leave - (double)enter));
}

static int cast_lane(const nb_sheet *sheet, const nb_sheet_lamp *lamp, nb_shafts *shafts,
                     const nebel_allocator *allocator, uint32_t lane, float enter, float leave, nb_shaft_rays *rays)
{
    double from[2], to[2], first, last;
    const double near = look_up(sheet, lamp, rays, lane, enter, from);
    const double far = look_up(sheet, lamp, rays, lane, leave, to);
    nb_mask_walk walk = nb_mask_begin(sheet->mask, from, to);
    while (nb_mask_next(&walk, &first, &last)) {
        const float begin = place_at(first, enter, leave, near, far), end = place_at(last, enter, leave, near, far);
        if (!add(shafts, allocator, lane, begin, end, rays)) return 0;
    }
    return 1;
}

int nb_sheet_cast(const nb_sheet *sheet, const nb_sheet_lamp *lamp, nb_shafts *shafts, const nebel_allocator *allocator,
                  const nb_stretch *found, nb_shaft_rays *rays)
{
    for (uint32_t i = 0; i < NB_PACKET; i++) {
        const float enter = found->enter[i], leave = found->leave[i];
        if (!(enter < leave) || (enter >= rays->enter[i] && leave <= rays->leave[i])) continue;
        if (!cast_lane(sheet, lamp, shafts, allocator, i, enter, leave, rays)) return 0;
    }
    return 1;
}
