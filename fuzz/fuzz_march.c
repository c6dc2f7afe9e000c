/* Any bytes as volumes, lights and rays: light is finite, transmittance is within 0 and 1, the bound of the error is a number; it does not
 * matter which rays are traced together, by which instruction set nor, but for rounding, in which order volumes were added; float is within the
 * errors of double, and a ray in two pieces gives the light of the whole one. */
#include "march_input.h"

/* NULL where a description is refused. */
static nebel_lighting *make_fog(const march_input *in, int backwards)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    nebel_volume_id id;
    nebel_result result = NEBEL_OK;
    demand(nebel_create_fog(&(nebel_fog_desc){0}, &fog) == NEBEL_OK);
    for (size_t i = 0; i < in->count && result == NEBEL_OK; i++)
        result = nebel_add_volume(fog, &in->volumes[backwards ? in->count - 1 - i : i], &id);
    demand(result == NEBEL_OK || result == NEBEL_ERROR_VALUE);
    if (result == NEBEL_OK) {
        demand(nebel_commit_fog(fog, &snapshot) == NEBEL_OK);
        demand(nebel_create_lighting(snapshot, &in->lighting, &lighting) == NEBEL_OK);
        nebel_release_snapshot(snapshot);
    }
    nebel_destroy_fog(fog);
    return lighting;
}

static void check_light(const nebel_transfer *transfer)
{
    for (int c = 0; c < 3; c++) {
        demand(transfer->transmittance[c] >= 0 && transfer->transmittance[c] <= 1);
        demand(isfinite(transfer->in_scattering[c]) && transfer->in_scattering[c] >= 0);
    }
    demand(isfinite(transfer->error) && transfer->error >= 0);
}

static void trace(const nebel_lighting *fog, const nebel_trace_desc *desc, size_t n, const nebel_ray *rays,
                  nebel_transfer *transfers)
{
    nebel_trace_desc lit = *desc;
    lit.lighting = fog;
    demand(nebel_trace(nebel_get_lighting_snapshot(fog), &lit, n, rays, sizeof *rays, transfers, sizeof *transfers) ==
           NEBEL_OK);
    for (size_t i = 0; i < n; i++) check_light(&transfers[i]);
}

static void check_same(const nebel_transfer *a, const nebel_transfer *b)
{
    for (int c = 0; c < 3; c++)
        demand(a->transmittance[c] == b->transmittance[c] && a->in_scattering[c] == b->in_scattering[c]);
    demand(a->error == b->error);
}

/* Results are the same bits for every way of splitting the rays into calls, and for every instruction set. */
static void check_calls(const nebel_lighting *fog, const nebel_trace_desc *desc, const march_input *in,
                        const nebel_transfer *together)
{
    nebel_transfer others[MOST_RAYS];
    nebel_ray turned[MOST_RAYS];
    const size_t n = in->ray_count;
    for (size_t i = 0; i < n; i++) {
        trace(fog, desc, 1, &in->rays[i], &others[0]);
        check_same(&others[0], &together[i]);
        turned[n - 1 - i] = in->rays[i];
    }
    trace(fog, desc, n, turned, others);
    for (size_t i = 0; i < n; i++) check_same(&others[n - 1 - i], &together[i]);
    if (desc->precision != NEBEL_PRECISION_FLOAT) return;
    const nebel_trace_desc scalar = {.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR};
    trace(fog, &scalar, n, in->rays, others);
    for (size_t i = 0; i < n; i++) check_same(&others[i], &together[i]);
}

static void check_near(const nebel_transfer *a, const nebel_transfer *b)
{
    const double error = a->error + b->error;
    for (int c = 0; c < 3; c++) {
        const double light = fmax(a->in_scattering[c], b->in_scattering[c]);
        demand(fabs(a->transmittance[c] - b->transmittance[c]) <= error + 1e-9);
        demand(fabs(a->in_scattering[c] - b->in_scattering[c]) <= error + 1e-8 * fmax(1, light));
    }
}

/* Distances count from where a ray starts. */
static int has_distances(const march_input *in)
{
    for (size_t i = 0; i < in->count; i++)
        if (in->volumes[i].start > 0 || in->volumes[i].cutoff > 0) return 1;
    return 0;
}

/* The ray in two pieces, one after the other. */
static void check_pieces(const nebel_lighting *fog, const nebel_ray *ray, const nebel_transfer *whole)
{
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_DOUBLE};
    nebel_ray pieces[2] = {*ray, *ray};
    nebel_transfer transfers[2], joined = {.error = 0};
    const double *d = ray->direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), half = ray->t_max / 2;
    /* Rays along a face may take either side of it. */
    for (int i = 0; i < 3; i++)
        if (d[i] == 0) return;
    pieces[0].t_max = pieces[1].t_max = half;
    for (int i = 0; i < 3; i++) pieces[1].origin[i] += d[i] / length * half;
    trace(fog, &desc, 2, pieces, transfers);
    for (int c = 0; c < 3; c++) {
        joined.transmittance[c] = transfers[0].transmittance[c] * transfers[1].transmittance[c];
        joined.in_scattering[c] =
            transfers[0].in_scattering[c] + transfers[0].transmittance[c] * transfers[1].in_scattering[c];
        joined.error = fmax(joined.error, transfers[0].error * (1 + transfers[1].in_scattering[c]));
    }
    joined.error = 2 * (joined.error + transfers[1].error);
    check_near(&joined, whole);
}

static void check(const nebel_lighting *fog, const nebel_lighting *backwards, const march_input *in)
{
    const nebel_trace_desc narrow = {.precision = NEBEL_PRECISION_FLOAT}, wide = {.precision = NEBEL_PRECISION_DOUBLE};
    nebel_transfer floats[MOST_RAYS], doubles[MOST_RAYS], others[MOST_RAYS];
    trace(fog, &narrow, in->ray_count, in->rays, floats);
    check_calls(fog, &narrow, in, floats);
    trace(fog, &wide, in->ray_count, in->rays, doubles);
    check_calls(fog, &wide, in, doubles);
    trace(backwards, &wide, in->ray_count, in->rays, others);
    const int whole = has_distances(in);
    for (size_t i = 0; i < in->ray_count; i++) {
        check_near(&floats[i], &doubles[i]);
        check_near(&doubles[i], &others[i]);
        if (!whole) check_pieces(fog, &in->rays[i], &doubles[i]);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static march_input fog;
    input in = {data, size};
    take_all(&in, &fog);
    nebel_lighting *forwards = fog.ray_count > 0 ? make_fog(&fog, 0) : NULL;
    nebel_lighting *backwards = forwards != NULL ? make_fog(&fog, 1) : NULL;
    if (backwards != NULL) check(forwards, backwards, &fog);
    nebel_release_lighting(forwards);
    nebel_release_lighting(backwards);
    release_all(&fog);
    return 0;
}
