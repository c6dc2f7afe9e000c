#include "cpu_planets.h"

#include "cpu_irradiance.h"

#include <nebel/render.h>

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

_Static_assert((int)NB_BATCH <= (int)NB_PLANETS_RAYS, "a batch is traced at once");

/* ---- the frame ------------------------------------------------------------------------------- */

nebel_result nb_cpu_planets_set_irradiances(nb_air_frame *air, const nebel_planet *home, const nebel_log *log)
{
    for (int i = 0; i < air->count; i++) {
        nb_planet *world = &air->worlds[i];
        if (world->daylight != NULL) continue;
        world->daylight = nb_allocate(air->allocator, 1, sizeof *world->daylight);
        if (world->daylight == NULL)
            return nb_fail(log, NEBEL_ERROR_MEMORY, "frame: out of memory for daylight on planets");
        nb_irradiance_set(world->daylight, world->planet, home, air->to_sun);
    }
    return NEBEL_OK;
}

nebel_result nb_cpu_planets_set(nb_air_frame *air, const nebel_scene_data *scene, const nebel_allocator *allocator,
                                const nebel_log *log, const double position[3], const double to_sun[3], int ends,
                                int threads)
{
    nebel_sky_view_desc desc = {.sun = nb_surface_lighting_sun(scene),
                                .host = {*allocator, *log, {nebel_parallel_for_openmp, &threads}}};
    nebel_result result = NEBEL_OK;
    air->allocator = allocator;
    air->count = nb_planets_set(air->worlds, scene, position);
    air->sun_radius = nb_planets_disc(scene);
    nb_planets_disc_light(scene, air->sun_radius, air->sun_light);
    memcpy(air->to_sun, to_sun, sizeof air->to_sun);
    memcpy(air->position, position, sizeof air->position);
    memcpy(desc.position, position, sizeof desc.position);
    air->ends = desc.has_ray_ends = ends || air->count > 1; /* the ground of one planet ends the air of others */
    air->owns_ambient = nb_surface_lighting_owns_ambient(scene);
    air->reach = nb_planets_reach(air->worlds, air->count, position);
    for (int i = 0; i < air->count && result == NEBEL_OK; i++) {
        nb_planet *world = &air->worlds[i];
        desc.atmosphere = world->planet->atmosphere;
        result = nebel_create_sky_view(&desc, &world->view);
    }
    if (result == NEBEL_OK && scene->has_sun && scene->mesh_count > 0)
        result = nb_cpu_planets_set_irradiances(air, &scene->planets[0], log);
    return result;
}

void nb_cpu_planets_free(nb_air_frame *air)
{
    for (int i = 0; i < air->count; i++) {
        nebel_destroy_sky_view(air->worlds[i].view);
        nb_release(air->allocator, air->worlds[i].daylight);
    }
    nebel_release_lighting(air->daylit);
}

/* ---- along rays ------------------------------------------------------------------------------ */

nebel_result nb_cpu_planets_trace(const nb_air_frame *air, size_t n, const double *const direction[3],
                                  const float *t_max, const nebel_transfer_planes *transfers)
{
    return nb_planets_trace(air->worlds, air->count, n, direction, t_max, transfers);
}

static double uneclipsed(const nb_air_frame *air, int world, const double place[3])
{
    return nb_planets_uneclipsed(air->worlds, air->count, world, place, air->to_sun, air->sun_radius);
}

/* ---- the ground ------------------------------------------------------------------------------ */

/* Surfaces on the ground touch it: they are seen where they lie this little behind it, which is more than rounding. */
static float behind_ground(float t)
{
    return 1e-5f * t + 1e-3f;
}

static void find_ground_of(const nb_planet *world, const nb_ray_batch *rays, nb_ground_batch *ground)
{
    const double *const direction[3] = {rays->direction[0], rays->direction[1], rays->direction[2]};
    const nebel_ground_planes planes = {.distance = ground->distance,
                                        .normal = {ground->normal[0], ground->normal[1], ground->normal[2]},
                                        .sun = {ground->sun[0], ground->sun[1], ground->sun[2]},
                                        .sky = {ground->sky[0], ground->sky[1], ground->sky[2]}};
    nebel_trace_ground(world->view, NB_BATCH, direction, &planes);
}

static void keep_nearer(int world, const nb_ground_batch *next, nb_cpu_planets_scratch *scratch)
{
    nb_ground_batch *ground = &scratch->ground;
    for (int i = 0; i < NB_BATCH; i++) {
        if (!(next->distance[i] < ground->distance[i])) continue;
        scratch->world[i] = world;
        ground->distance[i] = next->distance[i];
        for (int c = 0; c < 3; c++) {
            ground->normal[c][i] = next->normal[c][i];
            ground->sun[c][i] = next->sun[c][i];
            ground->sky[c][i] = next->sky[c][i];
        }
    }
}

void nb_cpu_planets_find_ground(const nb_air_frame *air, double advance, const nb_ray_batch *rays, const int *inside,
                                nb_hits *hits, nb_cpu_planets_scratch *scratch)
{
    float *distance = scratch->ground.distance;
    find_ground_of(&air->worlds[0], rays, &scratch->ground);
    memset(scratch->world, 0, sizeof scratch->world);
    for (int k = 1; k < air->count; k++) {
        find_ground_of(&air->worlds[k], rays, &scratch->next);
        keep_nearer(k, &scratch->next, scratch);
    }
    for (int i = 0; i < NB_BATCH; i++) {
        const int is_hit = hits->surface[i] != NB_NONE;
        const float t = (float)(advance * (double)rays->length[i]) + hits->t[i];
        /* From on the ground or below it all surfaces are seen before it. */
        if (!inside[i] || (is_hit && (distance[i] == 0 || distance[i] + behind_ground(t) >= t)))
            distance[i] = HUGE_VALF;
        else if (distance[i] < HUGE_VALF)
            hits->surface[i] = NB_NONE;
    }
}

int nb_cpu_planets_sees_ground(const nb_cpu_planets_scratch *scratch)
{
    int any = 0;
    for (int i = 0; i < NB_BATCH; i++) any |= scratch->ground.distance[i] < HUGE_VALF;
    return any;
}

/* The ground is not lifted: no surface hides fog and point lights from it there. */
static void set_ground_starts(const double position[3], const nb_ray_batch *rays, const nb_surface_batch *points,
                              nb_cpu_planets_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const float distance = scratch->ground.distance[i];
        const double ahead = (double)distance / (double)rays->length[i];
        const int is_ground = distance < HUGE_VALF;
        for (int c = 0; c < 3; c++)
            scratch->start[c][i] =
                (float)(is_ground ? ahead * rays->direction[c][i] : (double)points->start[c][i] - position[c]);
    }
}

void nb_cpu_planets_set_points(const nb_air_frame *air, double advance, const double position[3],
                               const double origin[3], const float sun[3], const nb_ray_batch *rays,
                               nb_cpu_planets_scratch *scratch, nb_hits *hits, nb_surface_batch *points)
{
    nb_ground_batch *ground = &scratch->ground;
    for (int i = 0; i < NB_BATCH; i++) {
        const float distance = ground->distance[i];
        const int world = scratch->world[i];
        if (!(distance < HUGE_VALF)) continue;
        float cosine = 0, largest = 0, place[3];
        double in_scene[3];
        for (int c = 0; c < 3; c++) {
            const double unit = rays->direction[c][i] / (double)rays->length[i];
            in_scene[c] = origin[c] + position[c] + (double)distance * unit;
            place[c] = nb_clamp_coordinate((float)(position[c] + (double)distance * unit));
            largest = fmaxf(largest, fabsf(place[c]));
            cosine += ground->normal[c][i] * sun[c];
        }
        const float height = 0x1p-20f * (distance + largest), left = (float)uneclipsed(air, world, in_scene);
        for (int c = 0; c < 3; c++) {
            points->normal[c][i] = points->side[c][i] = ground->normal[c][i];
            points->reflectance[c][i] = (float)air->worlds[world].planet->atmosphere_desc.ground_albedo[c];
            points->start[c][i] = nb_clamp_coordinate(place[c] + height * ground->normal[c][i]);
            ground->sun[c][i] *= left;
        }
        points->cosine[i] = cosine;
        points->lit[i] = -(cosine > 0);
        points->away[i] = 0;
        hits->surface[i] = NB_GROUND;
        hits->t[i] = (float)((double)distance - advance * (double)rays->length[i]);
    }
    set_ground_starts(position, rays, points, scratch);
}

void nb_cpu_planets_light_at(const nb_air_frame *air, nb_irradiance_receiver of, const double place[3], double sun[3],
                             double sky[3])
{
    const int nearest = nb_planets_nearest(air->worlds, air->count, place);
    nb_irradiance_at(air->worlds[nearest].daylight, of, place, sun, sky);
    const double left = uneclipsed(air, nearest, place);
    for (int c = 0; c < 3; c++) sun[c] *= left;
}

nebel_irradiance nb_cpu_planets_ask(const nb_air_frame *air, const double place[3])
{
    return nb_planets_light(air->worlds, air->count, place, air->to_sun, air->sun_radius);
}

void nb_cpu_planets_set_irradiance(const nb_air_frame *air, const double origin[3], const nb_hits *hits,
                                   const nb_surface_batch *points, nb_cpu_planets_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) {
        double place[3], sun[3] = {0, 0, 0}, sky[3] = {1, 1, 1};
        const int is_model = hits->surface[i] != NB_NONE && hits->surface[i] != NB_GROUND;
        for (int c = 0; c < 3; c++) place[c] = origin[c] + (double)points->start[c][i];
        if (is_model && air->worlds[0].daylight != NULL)
            nb_cpu_planets_light_at(air, NB_IRRADIANCE_OF_SURFACES, place, sun, sky);
        for (int c = 0; c < 3; c++) {
            scratch->sun_left[c][i] = (float)sun[c];
            scratch->sky_there[c][i] = air->owns_ambient ? (float)sky[c] : 1;
        }
    }
}

void nb_cpu_planets_dim_sun(const float *sunlight, const nb_hits *hits, const nb_cpu_planets_scratch *scratch,
                            float (*color)[NB_BATCH])
{
    for (int c = 0; c < 3; c++) {
        /* The ground's is irradiance already; color holds irradiance over pi. */
        const float ground = sunlight[c] > 0 ? 0.31830988618379067f / sunlight[c] : 0;
        for (int i = 0; i < NB_BATCH; i++)
            color[c][i] *= hits->surface[i] == NB_GROUND ? ground * scratch->ground.sun[c][i] : scratch->sun_left[c][i];
    }
}

/* ---- the sun --------------------------------------------------------------------------------- */

/* The disc is darker towards its edge: mu^a, mu the cosine of the angle at which its surface is seen; a = -0.023 +
 * 0.292 / wavelength in um (Hestroffer and Magnan, Wavelength dependency of the Solar limb darkening, 1998) at 0.68, 0.55
 * and 0.44 um. Times (a + 2) / 2 the mean is 1. */
static double limb(double mu, int c)
{
    static const double powers[3] = {-0.023 + 0.292 / 0.68, -0.023 + 0.292 / 0.55, -0.023 + 0.292 / 0.44};
    return 0.5 * (powers[c] + 2) * pow(mu, powers[c]);
}

/* The disc with its edge spread over a pixel `width` wide, one of less widened to that: its light at an angle. */
static double disc(double radius, double width, double angle, int c)
{
    const double cover = fmin(1, fmax(0, (radius - angle) / width + 0.5)), part = angle / (radius + 0.5 * width);
    return cover * limb(sqrt(fmax(0, 1 - part * part)), c);
}

/* However wide it is, it has the light of the sun's own disc. */
static double disc_scale(double sun, double radius, double width, int c)
{
    enum { RINGS = 32 };
    const double step = (radius + 0.5 * width) / RINGS;
    double sum = 0;
    for (int i = 0; i < RINGS; i++) sum += 2 * (i + 0.5) * step * step * disc(radius, width, (i + 0.5) * step, c);
    return sun * sun / sum;
}

static void add_sun(const nb_air_frame *air, double cosine, double width, double light[3])
{
    const double sun = air->sun_radius, radius = fmax(sun, 0.5 * width), reach = radius + width;
    /* Most rays are that far off that cos x >= 1 - x^2 / 2 says so. */
    if (!(cosine > 1 - 0.5 * reach * reach && cosine > cos(fmin(PI, reach)))) return;
    const double angle = sqrt(2 * fmax(0, 1 - cosine));
    for (int c = 0; c < 3; c++)
        light[c] += air->sun_light[c] * disc_scale(sun, radius, width, c) * disc(radius, width, angle, c);
}

int nb_cpu_planets_sees_sun(const nb_air_frame *air, const nb_surface_lighting *lighting, const nb_ray_batch *rays)
{
    if (!(air->sun_radius > 0 && lighting->has_sun)) return 0;
    const double near = cos(fmin(PI, air->sun_radius + 2 * air->pixel));
    for (int i = 0; i < NB_BATCH; i++) {
        double along = 0;
        for (int c = 0; c < 3; c++) along += rays->direction[c][i] * lighting->sun_direction[c];
        if (!(along < near * (double)rays->length[i])) return 1;
    }
    return 0;
}

/* Near the edge of one planet, seen as a disc. */
static int passes_rim(const nb_planet *world, const double position[3], double pixel, const nb_ray_batch *rays)
{
    double to[3];
    for (int c = 0; c < 3; c++) to[c] = world->center[c] - position[c];
    const double far = nb_vector_length(to), half = asin(fmin(1, world->radius / far));
    const double within = cos(fmin(PI, half + 2 * pixel)), without = cos(fmax(0, half - 2 * pixel));
    for (int i = 0; i < NB_BATCH; i++) {
        double along = 0;
        for (int c = 0; c < 3; c++) along += rays->direction[c][i] * to[c];
        along /= far * (double)rays->length[i];
        if (along > within && !(along > without && half > 2 * pixel)) return 1;
    }
    return 0;
}

int nb_cpu_planets_sees_rim(const nb_air_frame *air, const nb_ray_batch *rays)
{
    for (int k = 0; k < air->count; k++)
        if (passes_rim(&air->worlds[k], air->position, air->pixel, rays)) return 1;
    return 0;
}

void nb_cpu_planets_background(const nb_air_frame *air, const nb_surface_lighting *lighting, const nb_ray_batch *rays,
                               int lane, double light[3])
{
    double unit[3], cosine = 0;
    for (int c = 0; c < 3; c++) {
        unit[c] = rays->direction[c][lane] / (double)rays->length[lane];
        cosine += unit[c] * lighting->sun_direction[c];
        light[c] = (double)lighting->background[c];
    }
    if (lighting->shows_ambient) nebel_evaluate_environment(&lighting->environment, unit, light);
    if (air->sun_radius > 0 && lighting->has_sun) add_sun(air, cosine, air->pixel / (double)rays->length[lane], light);
}
