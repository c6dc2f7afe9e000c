/* The public queries: arguments checked, a kernel chosen. */
#include "trace_kernel.h"

#include "light/lighting.h"

#include "base/isa.h"
#include "base/isa_list.h"
#include "base/precision.h"
#include "base/stride.h"

#include <math.h>
#include <string.h>

#define TRACE_KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_trace_##suffix,
static nb_trace_fn *const trace_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(TRACE_KERNEL)};

int nebel_isa_available(nebel_isa isa)
{
    return nb_isa_select(isa) != NEBEL_ISA_COUNT;
}

const char *nebel_isa_name(nebel_isa isa)
{
    switch (isa) {
    case NEBEL_ISA_SCALAR:
        return "scalar";
    case NEBEL_ISA_SSE2:
        return "sse2";
    case NEBEL_ISA_AVX2:
        return "avx2";
    case NEBEL_ISA_AVX512:
        return "avx512";
    case NEBEL_ISA_NEON:
        return "neon";
    case NEBEL_ISA_DEFAULT:
        return "default";
    default:
        return "unknown";
    }
}

static const char *fault_of_ray(const nebel_ray *ray)
{
    int zero = 1;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(ray->origin[i]) <= NEBEL_MAX_LENGTH)) return "origin must be finite and at most 1e15 m away";
        if (!isfinite(ray->direction[i])) return "direction must be finite";
        zero = zero && ray->direction[i] == 0;
    }
    if (zero) return "direction must not be zero";
    return ray->t_max >= 0 ? NULL : "t_max must be 0 or more";
}

static int is_near(double x)
{
    return fabs(x) <= NEBEL_MAX_LENGTH;
}

/* The same in one expression without a branch, for the many rays that are right. */
static int is_valid(const nebel_ray *ray)
{
    const double *o = ray->origin, *d = ray->direction;
    const double steepest = fabs(d[0]) + fabs(d[1]) + fabs(d[2]);
    return is_near(o[0]) & is_near(o[1]) & is_near(o[2]) & (steepest > 0) & (steepest < HUGE_VAL) & (ray->t_max >= 0);
}

static nebel_result check_rays(const nebel_snapshot *snapshot, size_t n, const nebel_ray *rays, size_t stride,
                               size_t *failed)
{
    if (n > 0 && rays == NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "rays: must not be NULL");
    if (stride % _Alignof(nebel_ray) != 0)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "rays: stride %zu: must be a multiple of %zu", stride,
                       _Alignof(nebel_ray));
    for (size_t i = 0; i < n; i++) {
        const nebel_ray *ray = nb_stride_from(rays, stride, i);
        if (is_valid(ray)) continue;
        const char *fault = fault_of_ray(ray); /* NULL for a direction so long that only its sum overflows */
        if (fault == NULL) continue;
        if (failed != NULL) *failed = i;
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "ray %zu: %s", i, fault);
    }
    return NEBEL_OK;
}

static double element(const void *plane, size_t size, size_t stride, size_t i)
{
    const void *at = nb_stride_from(plane, stride, i);
    return size == sizeof(double) ? *(const double *)at : (double)*(const float *)at;
}

nebel_ray nb_trace_ray_in_planes(const nebel_ray_planes *planes, size_t i)
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = planes->origin[c];
        ray.direction[c] = planes->direction[c];
        if (planes->offset[c] != NULL)
            ray.origin[c] += element(planes->offset[c], sizeof(float), planes->offset_stride, i);
        if (planes->direction_float[c] != NULL)
            ray.direction[c] = element(planes->direction_float[c], sizeof(float), planes->direction_stride, i);
        if (planes->direction_double[c] != NULL)
            ray.direction[c] = element(planes->direction_double[c], sizeof(double), planes->direction_stride, i);
    }
    if (planes->t_max != NULL) ray.t_max = element(planes->t_max, sizeof(float), planes->t_max_stride, i);
    return ray;
}

size_t nb_trace_first_fault(const nebel_ray_planes *rays, size_t first, size_t count)
{
    for (size_t i = first; i < first + count; i++) {
        const nebel_ray ray = nb_trace_ray_in_planes(rays, i);
        if (ray.t_max != 0 && fault_of_ray(&ray) != NULL) return i;
    }
    return first + count;
}

static nebel_result explain(const nb_trace_job *job, nebel_result result, size_t *failed)
{
    if (result == NEBEL_OK) return result;
    if (failed != NULL) *failed = job->failed;
    if (result == NEBEL_ERROR_ARGUMENT) {
        const nebel_ray ray = nb_trace_ray_in_planes(job->ray_planes, job->failed);
        return nb_fail(&job->snapshot->log, result, "ray %zu: %s", job->failed, fault_of_ray(&ray));
    }
    if (result == NEBEL_ERROR_UNBOUNDED)
        return nb_fail(&job->snapshot->log, result,
                       "ray %zu: gathers infinite light; fog that emits without end must absorb, or t_max be finite",
                       job->failed);
    return nb_fail(&job->snapshot->log, result, "ray %zu: out of memory for the fog it meets", job->failed);
}

static const char *fault_of_pieces(const nebel_ray_visibility *pieces, size_t i)
{
    const uint32_t first = pieces->offsets[i], end = pieces->offsets[i + 1];
    if (first > end) return "`offsets` must not descend";
    if (first < end && pieces->boundaries == NULL) return "boundaries must not be NULL";
    float last = 0;
    for (uint32_t k = first; k < end; k++) {
        if (!(pieces->boundaries[k] >= last)) return "boundaries must be 0 or more and not descend";
        last = pieces->boundaries[k];
    }
    return NULL;
}

/* `what` names the light. */
static nebel_result check_pieces(const nebel_snapshot *snapshot, const nebel_ray_visibility *pieces, const char *what,
                                 size_t n, size_t *failed)
{
    if (pieces->offsets == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "%s: `first` must not be NULL", what);
    for (size_t i = 0; i < n; i++) {
        const char *fault = fault_of_pieces(pieces, i);
        if (fault == NULL) continue;
        if (failed != NULL) *failed = i;
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "%s: ray %zu: %s", what, i, fault);
    }
    return NEBEL_OK;
}

/* Where lights reach the rays of a call. */
static nebel_result check_shadows(const nebel_lighting *lighting, const nebel_trace_desc *desc, size_t n)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    nebel_result result = NEBEL_OK;
    if (desc->sun_visibility != NULL)
        result = check_pieces(snapshot, desc->sun_visibility, "sun_visibility", n, desc->failed_ray);
    for (size_t i = 0; i < lighting->light_count && desc->light_visibility != NULL && result == NEBEL_OK; i++)
        result = check_pieces(snapshot, &desc->light_visibility[i], "light_visibility", n, desc->failed_ray);
    return result;
}

/* What the error may be beyond the tolerance. */
#define FLOAT_ROUNDING 1e-4
#define DOUBLE_ROUNDING 1e-8

/* Asks `kernel` about a job that says where rays and transfers are, and what lights them. */
static nebel_result run_kernel(nb_trace_fn *kernel, nb_trace_job *job, double tolerance)
{
    const nebel_lighting *lighting = job->lighting;
    job->budget = tolerance * fmax(1, lighting->largest_radiance);
    job->promised = job->budget + (kernel == nb_trace_double ? DOUBLE_ROUNDING : FLOAT_ROUNDING);
    job->light_lattices = NULL;
    if (kernel != nb_trace_double && !job->transmittance_only && lighting->scatters_lights &&
        lighting->common_steps == NB_COMMON_STEPS_IN_FLOAT) {
        job->light_lattices = nb_light_lattices_of(lighting);
        if (job->light_lattices == NULL) return NEBEL_ERROR_MEMORY;
    }
    return kernel(job);
}

/* ---- groups of light ------------------------------------------------------------------------- */

static int wants_group(const nebel_transfer_planes *planes, int group)
{
    float *const *plane = planes->group[group].in_scattering;
    return plane[0] != NULL || plane[1] != NULL || plane[2] != NULL;
}

static int wants_groups(const nebel_transfer_planes *planes)
{
    int wants = 0;
    for (int i = 0; i < NEBEL_TRANSFER_GROUPS; i++) wants |= wants_group(planes, i);
    return wants;
}

/* What of the light that neither the sun nor lights give the media may give: of the environment, and of themselves. */
static nb_group_of_rest find_rest(const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    int by_environment = 0, by_itself = 0;
    for (size_t i = 0; i < snapshot->medium_count; i++)
        for (int c = 0; c < 3; c++) {
            by_environment |= snapshot->media[i].body.lit && lighting->media[i].radiance[c] > 0;
            by_itself |= snapshot->unlit.media[i].light[c] > 0;
        }
    return by_environment && by_itself ? NB_REST_IS_BOTH : by_itself ? NB_REST_IS_LOCAL : NB_REST_IS_ENVIRONMENT;
}

/* Light of fog itself, which is gathered with that of the environment, has a march of its own into the local group's planes. */
static nebel_result trace_own_light(nb_trace_fn *kernel, nb_trace_job *job, double tolerance)
{
    const nebel_transfer_planes *to = job->light_planes;
    nebel_transfer_planes own = {.in_scattering_stride = to->in_scattering_stride};
    memcpy(own.in_scattering, to->group[NEBEL_LIGHT_GROUP_LOCAL].in_scattering, sizeof own.in_scattering);
    nb_trace_job alone = {.snapshot = job->snapshot,
                          .lighting = &job->snapshot->unlit,
                          .ignore_distances = job->ignore_distances,
                          .max_opacity = 1,
                          .count = job->count,
                          .ray_planes = job->ray_planes,
                          .light_planes = &own};
    const nebel_result result = run_kernel(kernel, &alone, tolerance);
    job->failed = alone.failed;
    return result;
}

static nebel_result trace_groups(nb_trace_fn *kernel, nb_trace_job *job, double tolerance)
{
    const nebel_transfer_planes *asked = job->light_planes;
    nebel_transfer_planes to = *asked;
    float **local = to.group[NEBEL_LIGHT_GROUP_LOCAL].in_scattering;
    job->rest = find_rest(job->lighting);
    if (job->rest != NB_REST_IS_BOTH) return run_kernel(kernel, job, tolerance);
    const size_t plane = job->count * (to.in_scattering_stride / sizeof(float));
    float *unasked = nb_allocate(&job->snapshot->allocator, 3 * plane, sizeof *unasked);
    if (unasked == NULL) return NEBEL_ERROR_MEMORY;
    for (int c = 0; c < 3; c++)
        if (local[c] == NULL)
            local[c] = unasked + (size_t)c * plane; /* what is left for the environment is found by it */
    job->light_planes = &to;
    nebel_result result = trace_own_light(kernel, job, tolerance);
    if (result == NEBEL_OK) result = run_kernel(kernel, job, tolerance);
    job->light_planes = asked;
    nb_release(&job->snapshot->allocator, unasked);
    return result;
}

/* ---- jobs ------------------------------------------------------------------------------------ */

/* Asks `kernel`, NULL where there is none, about a job that says where rays and transfers are. */
static nebel_result run(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, size_t n, nb_trace_fn *kernel,
                        nb_trace_job *job)
{
    const double tolerance = desc->tolerance == 0 ? NEBEL_DEFAULT_TOLERANCE : desc->tolerance;
    const nebel_lighting *lighting = nb_lighting_of(snapshot, desc->lighting);
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!(tolerance > 0 && isfinite(tolerance)))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "tolerance: must be finite and more than 0");
    if (kernel == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_UNSUPPORTED, "instruction set %s: not available here",
                       nebel_isa_name(desc->isa));
    const nebel_result shadows = check_shadows(lighting, desc, n);
    if (shadows != NEBEL_OK) return shadows;
    if (desc->sun_visibility != NULL) {
        job->first_boundary = desc->sun_visibility->offsets;
        job->boundaries = desc->sun_visibility->boundaries;
    }
    job->light_visibility = desc->light_visibility;
    job->snapshot = snapshot;
    job->lighting = lighting;
    job->max_opacity = desc->ignore_max_opacity ? 1 : snapshot->max_opacity;
    job->count = n;
    const unsigned precision = nb_full_precision();
    const nebel_result result =
        job->wants_groups ? trace_groups(kernel, job, tolerance) : run_kernel(kernel, job, tolerance);
    const int is_diffuse = result == NEBEL_OK && lighting->add_diffusion != NULL && !job->transmittance_only;
    const nebel_result added = is_diffuse ? lighting->add_diffusion(lighting, job) : NEBEL_OK; /* which explains */
    nb_restore_precision(precision);
    return added == NEBEL_OK ? explain(job, result, desc->failed_ray) : added;
}

nebel_result nebel_trace(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, size_t n, const nebel_ray *rays,
                         size_t ray_stride, nebel_transfer *transfers, size_t transfer_stride)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_trace_desc plain = {0};
    if (desc == NULL) desc = &plain;
    if (n > 0 && transfers == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "trace: transfers must not be NULL");
    if (transfer_stride % _Alignof(nebel_transfer) != 0)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "transfers: stride %zu: must be a multiple of %zu",
                       transfer_stride, _Alignof(nebel_transfer));
    ray_stride = nb_stride_of(ray_stride, sizeof *rays);
    transfer_stride = nb_stride_of(transfer_stride, sizeof *transfers);
    const nebel_result valid = check_rays(snapshot, n, rays, ray_stride, desc->failed_ray);
    if (valid != NEBEL_OK) return valid;
    if (desc->precision != NEBEL_PRECISION_DOUBLE && desc->precision != NEBEL_PRECISION_FLOAT)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "precision: %d is unknown", (int)desc->precision);
    const int is_float = desc->precision == NEBEL_PRECISION_FLOAT;
    nb_trace_job job = {.transmittance_only = desc->transmittance_only,
                        .ignore_distances = desc->ignore_distances,
                        .wants_error = 1,
                        .rays = rays,
                        .ray_stride = ray_stride,
                        .transfers = transfers,
                        .transfer_stride = transfer_stride};
    return run(snapshot, desc, n, is_float ? trace_kernels[nb_isa_select(desc->isa)] : nb_trace_double, &job);
}

/* ---- planes ---------------------------------------------------------------------------------- */

/* Planes of three are given all or none. */
static int is_broken(const void *x, const void *y, const void *z)
{
    return (x != NULL) != (y != NULL) || (y != NULL) != (z != NULL);
}

static const char *fault_of_planes(const nebel_ray_planes *rays)
{
    const float *const *offset = rays->offset, *const *direction = rays->direction_float;
    const double *const *fine = rays->direction_double;
    if (is_broken(offset[0], offset[1], offset[2])) return "offset: all three planes or none";
    if (is_broken(direction[0], direction[1], direction[2])) return "direction_float: all three planes or none";
    if (is_broken(fine[0], fine[1], fine[2])) return "direction_double: all three planes or none";
    if (direction[0] != NULL && fine[0] != NULL) return "direction_float and direction_double: one of them";
    const int shared = direction[0] == NULL && fine[0] == NULL;
    const nebel_ray common = {.origin = {rays->origin[0], rays->origin[1], rays->origin[2]},
                              .direction = {shared ? rays->direction[0] : 1, rays->direction[1], rays->direction[2]}};
    return fault_of_ray(&common);
}

static const char *fault_of_strides(const nebel_ray_planes *rays, const nebel_transfer_planes *transfers)
{
    const size_t of_floats[] = {rays->offset_stride, rays->t_max_stride, transfers->transmittance_stride,
                                transfers->in_scattering_stride, transfers->error_stride};
    const size_t direction = rays->direction_double[0] != NULL ? sizeof(double) : sizeof(float);
    int fits = rays->direction_stride % direction == 0;
    for (size_t i = 0; i < sizeof of_floats / sizeof *of_floats; i++) fits = fits && of_floats[i] % sizeof(float) == 0;
    return fits ? NULL : "a stride must be a multiple of the size of its numbers";
}

nebel_result nebel_trace_planes(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, size_t n,
                                const nebel_ray_planes *rays, const nebel_transfer_planes *transfers)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (rays == NULL || transfers == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "planes: rays and transfers must not be NULL");
    const char *fault = fault_of_planes(rays);
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "planes: %s", fault);
    nebel_ray_planes from = *rays;
    nebel_transfer_planes to = *transfers;
    from.offset_stride = nb_stride_of(from.offset_stride, sizeof(float));
    from.direction_stride =
        nb_stride_of(from.direction_stride, from.direction_double[0] != NULL ? sizeof(double) : sizeof(float));
    from.t_max_stride = nb_stride_of(from.t_max_stride, sizeof(float));
    to.transmittance_stride = nb_stride_of(to.transmittance_stride, sizeof(float));
    to.in_scattering_stride = nb_stride_of(to.in_scattering_stride, sizeof(float));
    to.error_stride = nb_stride_of(to.error_stride, sizeof(float));
    fault = fault_of_strides(&from, &to);
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "planes: %s", fault);
    const int by_groups = wants_groups(&to);
    const int wants_light =
        by_groups || to.in_scattering[0] != NULL || to.in_scattering[1] != NULL || to.in_scattering[2] != NULL;
    const nebel_trace_desc plain = {0};
    const nebel_trace_desc *asked = desc != NULL ? desc : &plain;
    nb_trace_job job = {.transmittance_only = !wants_light,
                        .ignore_distances = asked->ignore_distances,
                        .wants_error = to.error != NULL,
                        .wants_groups = by_groups,
                        .ray_planes = &from,
                        .light_planes = &to};
    return run(snapshot, asked, n, trace_kernels[nb_isa_select(asked->isa)], &job);
}

/* ---- visibility ------------------------------------------------------------------------------ */

nebel_result nebel_invert_transmittance(const nebel_snapshot *snapshot, double transmittance, int channel, size_t n,
                                        const nebel_ray *rays, size_t ray_stride, double *distances)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (n > 0 && distances == NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "distances: must not be NULL");
    ray_stride = nb_stride_of(ray_stride, sizeof *rays);
    const nebel_result valid = check_rays(snapshot, n, rays, ray_stride, NULL);
    if (valid != NEBEL_OK) return valid;
    if (!(transmittance > 0 && transmittance < 1))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "transmittance: must be more than 0 and less than 1");
    if (channel < 0 || channel > 2) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "channel: must be 0, 1 or 2");
    if (transmittance < 1 - snapshot->max_opacity) {
        for (size_t i = 0; i < n; i++) distances[i] = HUGE_VAL;
        return NEBEL_OK;
    }
    nb_invert_job job = {snapshot, -log(transmittance), channel, n, rays, ray_stride, distances};
    const unsigned precision = nb_full_precision();
    const nebel_result result = nb_invert_double(&job);
    nb_restore_precision(precision);
    return result == NEBEL_OK ? result : nb_fail(&snapshot->log, result, "rays: out of memory for the fog they meet");
}
