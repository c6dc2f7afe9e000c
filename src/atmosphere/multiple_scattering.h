/* Light that air has scattered, from everywhere, over height and the sun's height. */
#ifndef NB_ATMOSPHERE_MULTIPLE_SCATTERING_H
#define NB_ATMOSPHERE_MULTIPLE_SCATTERING_H

#include "radiance_moments.h"
#include "base/parallel.h"
#include "math/gauss_rule.h"

typedef struct nb_stray nb_stray;

typedef struct nb_scattering_table {
    int heights, suns;
    double first_sun, last_sun, sun_scale; /* what entries over the sun's height are spread over */
    int orders;                            /* of moments that are kept: NB_MOMENTS or NB_FEW_MOMENTS */
    nb_radiance_moments
        *fields;         /* [height][sun]: of sunlight that was scattered at least once, for a sun of irradiance 1: the
                         logarithm of the first moment, and the others as parts of it */
    double (*ground)[3]; /* [sun]: the logarithm of the same light's irradiance on the ground */
    double missing;      /* part of it that may not have been scattered often enough, or lie between entries */
} nb_scattering_table;

static inline size_t nb_scattering_table_entries(const nb_scattering_table *scatter)
{
    return (size_t)scatter->heights * (size_t)scatter->suns;
}

nb_radiance_moments nb_scattering_table_look_up(const nb_scattering_table *scatter, const nb_air_components *airs,
                                                double radius, double sun);
void nb_scattering_table_look_up_ground(const nb_scattering_table *scatter, double sun, double irradiance[3]);

/* Of moments that the table of a quality keeps. */
int nb_scatter_orders(const nb_air_components *airs, nebel_atmosphere_quality quality);

/* Makes the table, and what strays from it; `albedo` is the ground's; smooth: nb_air_components_smooth of the airs. Errors: MEMORY. */
nebel_result nb_scattering_table_make(const nebel_allocator *allocator, const nebel_parallel *parts,
                                      const nb_air_components *airs, const nb_air_components *smooth,
                                      nebel_atmosphere_quality quality, const double albedo[3],
                                      nb_scattering_table *scatter, nb_stray *stray);
void nb_scattering_table_free(const nebel_allocator *allocator, nb_scattering_table *scatter);

#endif
