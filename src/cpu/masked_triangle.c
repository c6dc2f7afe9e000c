#include "masked_triangle.h"

#include <math.h>

/* Where stretches of rays are on the sheet that keeps the light from them. */
typedef struct nb_masked_triangle_lines {
    nb_alpha_mask_lines lines;
    double near[NB_PACKET], far[NB_PACKET]; /* their ends are so many times as far from the light as the sheet */
} nb_masked_triangle_lines;

/* Of one end of the stretches, its places in texels. */
NB_ALWAYS_INLINE void look_up(const nb_masked_occluder *sheet, const nb_masked_triangle_light *light,
                              const nb_shaft_rays *rays, const float *t, double (*texel)[NB_PACKET], double *farness)
{
    const nb_masked_occluder s = *sheet;
    const double none[3] = {0, 0, 0}, distance = light != NULL ? light->distance : 1;
    const double *place = light != NULL ? light->place : none, *normal = light != NULL ? light->normal : none;
    const int is_light = light != NULL;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        double way[3];
        for (int c = 0; c < 3; c++) way[c] = (double)rays->start[c][i] + (double)t[i] * (double)rays->way[c][i];
        const double ahead = normal[0] * way[0] + normal[1] * way[1] + normal[2] * way[2];
        farness[i] = is_light ? ahead / distance : 1;
        for (int c = 0; c < 3; c++) way[c] = way[c] / farness[i] + place[c] - s.place[c];
        for (int k = 0; k < 2; k++)
            texel[k][i] = s.at[k] + (s.slope[k][0] * way[0] + s.slope[k][1] * way[1] + s.slope[k][2] * way[2]);
    }
}

/* Stretches that are in a shadow that is known are not asked for. Returns whether any is. */
NB_CLONES static int look_up_ends(const nb_masked_occluder *sheet, const nb_masked_triangle_light *light,
                                  const nb_shaft_interval *found, const nb_shaft_rays *rays,
                                  nb_masked_triangle_lines *lines)
{
    int any = 0;
    for (int i = 0; i < NB_PACKET; i++) {
        const float enter = found->enter[i], leave = found->leave[i];
        const int is_known = (enter >= rays->enter[i]) & (leave <= rays->leave[i]);
        lines->lines.is_asked[i] = (enter < leave) & !is_known;
        any |= lines->lines.is_asked[i];
    }
    if (!any) return 0;
    look_up(sheet, light, rays, found->enter, lines->lines.from, lines->near);
    look_up(sheet, light, rays, found->leave, lines->lines.to, lines->far);
    return 1;
}

/* As nb_extend and nb_replace, of one lane. */
static int add_lane_interval(nb_sun_shafts *shafts, const nebel_allocator *allocator, uint32_t lane, float enter,
                             float leave, nb_shaft_rays *rays)
{
    const float gap = nb_closeness * fabsf(fminf(leave, rays->leave[lane]));
    if (!(enter < leave)) return 1;
    if (enter <= rays->leave[lane] + gap && leave >= rays->enter[lane] - gap) {
        rays->enter[lane] = fminf(enter, rays->enter[lane]);
        rays->leave[lane] = fmaxf(leave, rays->leave[lane]);
        return 1;
    }
    if (!nb_sun_shafts_keep(shafts, allocator, lane, rays)) return 0;
    rays->enter[lane] = enter;
    rays->leave[lane] = leave;
    return 1;
}

/* The place on the ray that is seen at s of the way over the sheet: of all ways to divide a line in perspective the one
 * in which cross ratios stay. */
static float place_on_ray(double s, float enter, float leave, double near, double far)
{
    const double part = s * near / (s * near + (1 - s) * far);
    return s >= 1 ? leave : (float)((double)enter + part * ((double)leave - (double)enter));
}

int nb_masked_triangle_cast(const nb_masked_occluder *sheet, const nb_masked_triangle_light *light,
                            nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shaft_interval *found,
                            nb_shaft_rays *rays)
{
    nb_masked_triangle_lines lines;
    nb_alpha_mask_walk walk;
    if (!look_up_ends(sheet, light, found, rays, &lines)) return 1;
    nb_alpha_mask_begin(&walk, sheet->mask, &lines.lines);
    do {
        for (uint32_t i = 0; i < walk.count; i++) {
            const nb_solid *solid = &walk.found[i];
            const uint32_t k = solid->line;
            const float enter = found->enter[k], leave = found->leave[k];
            const float begin = place_on_ray(solid->enter, enter, leave, lines.near[k], lines.far[k]);
            const float end = place_on_ray(solid->leave, enter, leave, lines.near[k], lines.far[k]);
            if (!add_lane_interval(shafts, allocator, k, begin, end, rays)) return 0;
        }
    } while (nb_alpha_mask_next(&walk));
    return 1;
}
