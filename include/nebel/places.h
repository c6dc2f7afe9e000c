/* Fog at single places, for renderers that leave it to chance: what it is there, which volume scatters, and bounds for
 * tracking along a ray. Whoever asks what fog does to a whole piece of a ray wants nebel_trace.
 */
#ifndef NEBEL_PLACES_H
#define NEBEL_PLACES_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A point in fog. */
typedef struct nebel_sample_point {
    double position[3]; /* m */
    /* m from where its ray starts, >= 0, for `start` and `cutoff` of volumes; < 0: these do not count. */
    double distance;
} nebel_sample_point;

/* What all fog together is at a place. Without `emission` a path of light ends or is scattered there. */
typedef struct nebel_medium_properties {
    double extinction[3]; /* 1/m */
    double scattering[3]; /* 1/m: what of it is scattered, albedo times extinction of volumes that have one */
    double emission[3];   /* radiance per metre: emission, and source times extinction of volumes that have one. The
                             sun and the ambient light are not in it: they are the renderer's to bring there */
} nebel_medium_properties;

/* What fog is at each of n places: shapes, profiles and priorities counted. Strides in bytes. places and matter must
 * not overlap. max_opacity does not count, which is no property of places. Cost for each place O(k + log N), k of N
 * volumes near it. Any thread. Errors: ARGUMENT (NULL, a position that is a NaN or farther than NEBEL_MAX_LENGTH). */
nebel_result nebel_sample_medium(const nebel_snapshot *snapshot, size_t n, const nebel_sample_point *places,
                                 size_t place_stride, nebel_medium_properties *matter, size_t matter_stride);

/* One of the volumes that scatter at a place. */
typedef struct nebel_scatterer {
    nebel_phase phase;
    double scattering[3]; /* 1/m: this volume's part */
    double probability;   /* of its choice, 0 to 1; 0: nothing scatters there, and the rest means nothing */
} nebel_scatterer;

/* Chooses a volume by a random number, 0 <= chance < 1, the more often the more it scatters of `channel` (0 red, 1 green,
 * 2 blue; -1: of all together), so that the mean over all chances of phase value * scattering / probability is what all
 * volumes scatter of that channel, or of each. Any thread. Errors: ARGUMENT, as nebel_sample_medium; a chance or a channel
 * out of range. */
nebel_result nebel_sample_scatterer(const nebel_snapshot *snapshot, const nebel_sample_point *place, int channel,
                                    double chance, nebel_scatterer *scatterer);

/* A piece of a ray on which fog is bounded. */
typedef struct nebel_majorant_segment {
    double end;           /* m along the ray: where the piece ends, behind where it begins; INFINITY is legal */
    double extinction[3]; /* 1/m: no place of the piece has more. 0 where there is no fog */
    double emission[3];   /* radiance per metre, with `source` as in nebel_medium_properties: the same */
} nebel_majorant_segment;

/* Cuts a ray, whose t_max is not read, into pieces for delta tracking (Woodcock et al. 1965): the piece that begins
 * `from` metres along it, >= 0. The next begins where this one ends. The bound is the extinction itself in volumes of
 * constant density between their ends; of round bodies it is that of a box around them; where density changes without
 * end (height, linear, gaussian) pieces are so short that it is within a few times of the densest place, or that half an
 * optical depth fits in. On an endless piece the fog either is bounded by 0 or goes on for ever, so that a path ends
 * there. Ends of volumes are found to some 1e-12 of the distances; over so short a piece a bound may count a volume
 * that is not there, never leave one out. Cost O(k + log N), k of N volumes on the rest of the ray. Any thread. Errors:
 * ARGUMENT, as nebel_trace; `from` that is a NaN or below 0. */
nebel_result nebel_next_majorant(const nebel_snapshot *snapshot, const nebel_ray *ray, int ignore_distances,
                                 double from, nebel_majorant_segment *bound);

/* 1 where every volume takes all channels alike, so that one path of light stands for all three; else 0. What volumes
 * scatter and emit may have colour. Any thread. */
int nebel_is_extinction_gray(const nebel_snapshot *snapshot);

#ifdef __cplusplus
}
#endif
#endif
