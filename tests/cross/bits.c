/* Prints hashes of T and S through fog of every shape and profile, to be compared between systems. Nothing here is
 * computed by a mathematical library, whose last digits are its own. */
#include <nebel/nebel.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FOGS = 200, VOLUMES = 5, RAYS = 100 };

static uint64_t state = 1;

static double uniform(double low, double high)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) * 0x1p-53;
}

static void place(double v[3], double reach)
{
    for (int k = 0; k < 3; k++) v[k] = uniform(-reach, reach);
}

static uint64_t mix(uint64_t hash, const double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        hash = (hash ^ bits) * 0x9fb21c651e98df25u;
        hash ^= hash >> 29;
    }
    return hash;
}

/* The number decides shape and density. */
static nebel_volume_desc make_volume(int number)
{
    static const nebel_shape_type shapes[] = {NEBEL_SHAPE_BOX,       NEBEL_SHAPE_SPHERE,  NEBEL_SHAPE_ELLIPSOID,
                                              NEBEL_SHAPE_CYLINDER,  NEBEL_SHAPE_CAPSULE, NEBEL_SHAPE_CONE,
                                              NEBEL_SHAPE_HALF_SPACE};
    nebel_volume_desc v = {
        .shape = {.type = shapes[number % 7]},
        .density = {.type = (nebel_density_type)(number / 7 % NEBEL_DENSITY_GRID), .power = 1 + number % 3}};
    v.shape.radius = uniform(1, 3);
    v.density.scale_height = uniform(.5, 3);
    v.density.sigma = uniform(1, 2);
    v.density.edge_width = uniform(.2, 1);
    const int is_round = v.shape.type == NEBEL_SHAPE_SPHERE || v.shape.type == NEBEL_SHAPE_ELLIPSOID;
    if (v.density.type == NEBEL_DENSITY_RADIAL && !is_round) v.density.type = NEBEL_DENSITY_CONSTANT;
    place(v.shape.center, 3);
    place(v.shape.from, 3);
    place(v.shape.to, 3);
    place(v.shape.point, 3);
    place(v.shape.normal, 1);
    place(v.shape.transform.rotation, 1);
    place(v.density.from, 3);
    place(v.density.to, 3);
    for (int k = 0; k < 3; k++) {
        v.shape.min[k] = v.shape.center[k] - uniform(.5, 2);
        v.shape.max[k] = v.shape.center[k] + uniform(.5, 2);
        v.shape.radii[k] = uniform(1, 3);
        v.extinction[k] = uniform(0, 1);
        v.source[k] = uniform(0, 1);
    }
    v.shape.radius_from = uniform(0, 1);
    v.shape.radius_to = uniform(1, 2);
    return v;
}

static void require(nebel_result result)
{
    if (result == NEBEL_OK) return;
    printf("failed with %d\n", (int)result);
    exit(EXIT_FAILURE);
}

static uint64_t trace(const nebel_snapshot *snapshot, nebel_precision precision, uint64_t hash)
{
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.t_max = i % 5 ? uniform(1, 20) : HUGE_VAL};
        nebel_transfer transfer;
        place(ray.origin, 6);
        place(ray.direction, 1);
        require(nebel_trace(snapshot, &(nebel_trace_desc){.precision = precision}, 1, &ray, sizeof ray, &transfer,
                            sizeof transfer));
        hash = mix(mix(hash, transfer.transmittance, 3), transfer.in_scattering, 3);
    }
    return hash;
}

int main(void)
{
    uint64_t hashes[2] = {0};
    for (int number = 0; number < FOGS; number++) {
        nebel_fog *fog = NULL;
        nebel_snapshot *snapshot = NULL;
        require(nebel_create_fog(&(nebel_fog_desc){0}, &fog));
        for (int i = 0; i < VOLUMES; i++) {
            const nebel_volume_desc volume = make_volume(number + 11 * i);
            require(nebel_add_volume(fog, &volume, NULL));
        }
        require(nebel_commit_fog(fog, &snapshot));
        hashes[0] = trace(snapshot, NEBEL_PRECISION_DOUBLE, hashes[0]);
        hashes[1] = trace(snapshot, NEBEL_PRECISION_FLOAT, hashes[1]);
        nebel_release_snapshot(snapshot);
        nebel_destroy_fog(fog);
        if (number % 20 == 19)
            printf("fog %d: %016llx in double, %016llx in float\n", number, (unsigned long long)hashes[0],
                   (unsigned long long)hashes[1]);
    }
    return EXIT_SUCCESS;
}
