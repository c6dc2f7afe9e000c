/* Light that fog scatters more than once, so that white fog is white and smoke is dark: a model, where all else is exact.
 *
 *     nebel_set_diffusion(fog, &(nebel_diffusion_desc){0});
 *     nebel_commit_fog(fog, &now);
 *
 * Queries of that snapshot then have it in their in-scattering. docs/multiple-scattering.md has the model and its errors.
 */
#ifndef NEBEL_DIFFUSION_H
#define NEBEL_DIFFUSION_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nebel_diffusion_desc {
    uint32_t max_cells;      /* of its lattice, at most: NEBEL_MIN_DIFFUSION_CELLS to NEBEL_MAX_DIFFUSION_CELLS; 0:
                       NEBEL_DEFAULT_DIFFUSION_CELLS. Thin fog takes less */
    int has_ground;          /* a level one without end: what is below is left out, and light comes back from it */
    double ground_height;    /* m, along y */
    double ground_albedo[3]; /* 0 to 1 */
} nebel_diffusion_desc;

#define NEBEL_MIN_DIFFUSION_CELLS 512
#define NEBEL_MAX_DIFFUSION_CELLS 16777216
#define NEBEL_DEFAULT_DIFFUSION_CELLS 65536

/* Makes snapshots from now on hold what becomes of the sun's light after fog has scattered it once, which queries then
 * add to in-scattering; NULL: no longer. What is scattered once stays as exact as it is. Ambient light, which without it
 * nothing dims, is dimmed by what fog and ground take from it. So lamps' light is scattered again, and what fog emits, which
 * without it nothing scatters. `error` says nothing of this model's own error. Surfaces and their shadows are not known to it.
 *
 * A commit then costs a march to the sun from each node of a lattice around all fog that is lit, and the
 * solution of one linear equation for each cell (for each channel, where fog or the sky has colour; once more where ambient
 * light is dimmed), in all about a second for 65536 cells; the snapshot keeps 36 bytes a node, or 100 where there is
 * colour, and 32 or 96 more where ambient light is dimmed. For lamps and what is emitted there is a second lattice, of 84 or 244
 * bytes a node, where each lamp costs what the sun costs. A query asks for the transmittance of each piece of its ray
 * from cell to cell. Same bits for every isa and any number of threads.
 *
 * nebel_commit_fog then refuses (UNSUPPORTED) fog with max_opacity, start or cutoff, and lit fog that goes on
 * endlessly along x or z but changes on the way. Errors: ARGUMENT, VALUE. */
nebel_result nebel_set_diffusion(nebel_fog *fog, const nebel_diffusion_desc *desc);

#ifdef __cplusplus
}
#endif
#endif
