#include "air.h"

#include <nebel/render.h>

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- the frame ------------------------------------------------------------------------------- */

nebel_result nb_air_set(nb_air *air, const nebel_scene_data *scene, const nebel_allocator *allocator,
                        const nebel_log *log, const double position[3], const double to_sun[3], int ends, int threads)
{
    const nebel_planet *planet = scene->planets;
    nebel_air_view_desc desc = {.atmosphere = planet->atmosphere,
                                .sun = {.direction = {0, 1, 0}},
                                .has_distances = ends,
                                .run = nebel_run_parts,
                                .run_user = &threads,
                                .allocator = *allocator,
                                .log = *log};
    const double *ground = planet->air.ground;
    const double over =
        hypot(hypot(position[0] - ground[0], position[2] - ground[2]), position[1] - ground[1] + planet->air.radius);
    air->planet = planet;
    air->ends = ends;
    air->reach = over + planet->air.radius + planet->air.thickness;
    memcpy(desc.position, position, sizeof desc.position);
    if (scene->has_sun) {
        memcpy(desc.sun.direction, scene->sun_direction, sizeof desc.sun.direction);
        memcpy(desc.sun.irradiance, scene->sun_irradiance, sizeof desc.sun.irradiance);
    }
    air->sun_radius = scene->has_sun ? 0.5 * planet->sun_diameter * (PI / 180) : 0;
    for (int c = 0; c < 3 && air->sun_radius > 0; c++)
        air->sun_light[c] = scene->sun_irradiance[c] / (PI * pow(sin(air->sun_radius), 2));
    const nebel_result result = nebel_create_air_view(&desc, &air->view);
    air->has_daylight = result == NEBEL_OK && scene->has_sun && scene->mesh_count > 0;
    air->owns_ambient = scene->environment.type == NEBEL_ENVIRONMENT_MAP && scene->environment_file == NULL;
    if (air->has_daylight) nb_daylight_set(&air->daylight, planet, to_sun);
    return result;
}

void nb_air_free(nb_air *air)
{
    nebel_destroy_air_view(air->view);
}

/* ---- the ground ------------------------------------------------------------------------------ */

/* Surfaces on the ground touch it: they are seen where they lie this little behind it, which is more than rounding. */
static float behind(float t)
{
    return 1e-5f * t + 1e-3f;
}

void nb_air_find_ground(const nb_air *air, double advance, const nb_rays *rays, const int *inside, nb_hits *hits,
                        nb_air_scratch *scratch)
{
    const double *const direction[3] = {rays->direction[0], rays->direction[1], rays->direction[2]};
    const nebel_ground_planes planes = {.distance = scratch->distance,
                                        .normal = {scratch->normal[0], scratch->normal[1], scratch->normal[2]},
                                        .sun = {scratch->sun[0], scratch->sun[1], scratch->sun[2]},
                                        .sky = {scratch->sky[0], scratch->sky[1], scratch->sky[2]}};
    nebel_find_ground(air->view, NB_BATCH, direction, &planes);
    for (int i = 0; i < NB_BATCH; i++) {
        const int is_hit = hits->surface[i] != NB_NONE;
        const float t = (float)(advance * (double)rays->length[i]) + hits->t[i];
        /* From on the ground or below it all surfaces are seen before it. */
        if (!inside[i] || (is_hit && (scratch->distance[i] == 0 || scratch->distance[i] + behind(t) >= t)))
            scratch->distance[i] = HUGE_VALF;
        else if (scratch->distance[i] < HUGE_VALF)
            hits->surface[i] = NB_NONE;
    }
}

int nb_air_sees_ground(const nb_air_scratch *scratch)
{
    int any = 0;
    for (int i = 0; i < NB_BATCH; i++) any |= scratch->distance[i] < HUGE_VALF;
    return any;
}

void nb_air_set_points(const nb_air *air, double advance, const double position[3], const float sun[3],
                       const nb_rays *rays, const nb_air_scratch *scratch, nb_hits *hits, nb_points *points)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const float distance = scratch->distance[i];
        if (!(distance < HUGE_VALF)) continue;
        float cosine = 0, largest = 0, place[3];
        for (int c = 0; c < 3; c++) {
            const double unit = rays->direction[c][i] / (double)rays->length[i];
            place[c] = nb_clamp_coordinate((float)(position[c] + (double)distance * unit));
            largest = fmaxf(largest, fabsf(place[c]));
            cosine += scratch->normal[c][i] * sun[c];
        }
        const float height = 0x1p-20f * (distance + largest);
        for (int c = 0; c < 3; c++) {
            points->normal[c][i] = points->side[c][i] = scratch->normal[c][i];
            points->reflectance[c][i] = (float)air->planet->air.ground_albedo[c];
            points->start[c][i] = nb_clamp_coordinate(place[c] + height * scratch->normal[c][i]);
        }
        points->cosine[i] = cosine;
        points->lit[i] = -(cosine > 0);
        points->away[i] = 0;
        hits->surface[i] = NB_GROUND;
        hits->t[i] = (float)((double)distance - advance * (double)rays->length[i]);
    }
}

void nb_air_set_daylight(const nb_air *air, const double origin[3], const nb_hits *hits, const nb_points *points,
                         nb_air_scratch *scratch)
{
    for (int i = 0; i < NB_BATCH; i++) {
        double place[3], sun[3] = {0, 0, 0}, sky[3] = {1, 1, 1};
        const int is_model = hits->surface[i] != NB_NONE && hits->surface[i] != NB_GROUND;
        for (int c = 0; c < 3; c++) place[c] = origin[c] + (double)points->start[c][i];
        if (is_model && air->has_daylight) nb_daylight_at(&air->daylight, place, sun, sky);
        for (int c = 0; c < 3; c++) {
            scratch->sun_left[c][i] = (float)sun[c];
            scratch->sky_there[c][i] = air->owns_ambient ? (float)sky[c] : 1;
        }
    }
}

void nb_air_dim_sun(const float *sunlight, const nb_hits *hits, const nb_air_scratch *scratch, float (*color)[NB_BATCH])
{
    for (int c = 0; c < 3; c++) {
        /* The ground's is irradiance already; color holds irradiance over pi. */
        const float ground = sunlight[c] > 0 ? 0.31830988618379067f / sunlight[c] : 0;
        for (int i = 0; i < NB_BATCH; i++)
            color[c][i] *= hits->surface[i] == NB_GROUND ? ground * scratch->sun[c][i] : scratch->sun_left[c][i];
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

static void add_sun(const nb_air *air, double cosine, double width, double light[3])
{
    const double sun = air->sun_radius, radius = fmax(sun, 0.5 * width);
    if (!(cosine > cos(fmin(PI, radius + width)))) return;
    const double angle = sqrt(2 * fmax(0, 1 - cosine));
    for (int c = 0; c < 3; c++)
        light[c] += air->sun_light[c] * disc_scale(sun, radius, width, c) * disc(radius, width, angle, c);
}

int nb_air_sees_sun(const nb_air *air, const nb_lighting *lighting, const nb_rays *rays)
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

void nb_air_background(const nb_air *air, const nb_lighting *lighting, const nb_rays *rays, int lane, double light[3])
{
    double unit[3], cosine = 0;
    for (int c = 0; c < 3; c++) {
        unit[c] = rays->direction[c][lane] / (double)rays->length[lane];
        cosine += unit[c] * lighting->sun_direction[c];
        light[c] = (double)lighting->background[c];
    }
    if (lighting->shows_ambient) nebel_environment_radiance(&lighting->environment, unit, light);
    if (air->sun_radius > 0 && lighting->has_sun) add_sun(air, cosine, air->pixel / (double)rays->length[lane], light);
}
