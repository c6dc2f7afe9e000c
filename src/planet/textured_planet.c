#include "base/base.h"
#include "base/stride.h"
#include "math/vector.h"
#include "planet_map.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/textured_planet.inc"

#define PI 3.14159265358979323846

typedef struct nb_shell {
    nb_planet_map map, detail; /* detail without levels: it is the map */
} nb_shell;

struct nebel_textured_planet {
    nebel_textured_planet_desc desc; /* completed; its maps are the first levels of those here, its log is none */
    double frame[3][3];              /* the planet's axes in the scene */
    nb_planet_map ground;
    nb_shell shells[NEBEL_MAX_CLOUD_SHELLS];
};

/* ---- descriptions ---------------------------------------------------------------------------- */

static int is_zero(const double *numbers, int count)
{
    for (int i = 0; i < count; i++)
        if (numbers[i] != 0) return 0;
    return 1;
}

static int all_within(const double *numbers, int count, double least, double most)
{
    for (int i = 0; i < count; i++)
        if (!(numbers[i] >= least && numbers[i] <= most)) return 0;
    return 1;
}

static void resolve_shell(double radius, uint32_t number, nebel_cloud_shell *shell)
{
    static const double white[3] = {1, 1, 1}, wrap[3] = {3, 7, 13};
    if (shell->height == 0) shell->height = radius * 0.01 * (number + 1);
    if (is_zero(shell->color, 3)) memcpy(shell->color, white, sizeof white);
    if (is_zero(shell->uv_tiling, 3)) memcpy(shell->uv_tiling, wrap, sizeof wrap);
    if (shell->gain == 0) shell->gain = 0.6;
    if (shell->seed == 0) shell->seed = number + 1;
}

static nebel_textured_planet_desc resolve(const nebel_textured_planet_desc *desc)
{
    static const double blue[3] = {0.25, 0.5, 1};
    nebel_textured_planet_desc whole = *desc;
    if (whole.radius == 0) whole.radius = 6.36e6;
    for (uint32_t i = 0; i < whole.cloud_shell_count && i < NEBEL_MAX_CLOUD_SHELLS; i++)
        resolve_shell(whole.radius, i, &whole.cloud_shells[i]);
    if (whole.atmosphere.height == 0) whole.atmosphere.height = whole.radius / 40;
    if (whole.atmosphere.brightness == 0) whole.atmosphere.brightness = 1;
    if (whole.atmosphere.ramp_count == 0) {
        whole.atmosphere.ramp_count = 3;
        memset(whole.atmosphere.ramp, 0, sizeof whole.atmosphere.ramp);
        memcpy(whole.atmosphere.ramp[1], blue, sizeof blue);
    }
    return whole;
}

/* What is said of: "clouds[2]: ", or "" where it is the planet. */
typedef struct nb_textured_subject {
    const nebel_log *log;
    char name[24];
} nb_textured_subject;

static nebel_result refuse(const nb_textured_subject *of, const char *what, const char *fault)
{
    return nb_fail(of->log, NEBEL_ERROR_VALUE, "planet: %s%s: %s", of->name, what, fault);
}

static nebel_result check_all(const nb_textured_subject *of, const char *what, const double *numbers, int count,
                              double least, double most)
{
    for (int i = 0; i < count; i++)
        if (!all_within(&numbers[i], 1, least, most))
            return nb_fail(of->log, NEBEL_ERROR_VALUE, "planet: %s%s: is %g; must be within %g and %g", of->name, what,
                           numbers[i], least, most);
    return NEBEL_OK;
}

static nebel_result check_one(const nb_textured_subject *of, const char *what, double number, double least, double most)
{
    return check_all(of, what, &number, 1, least, most);
}

static nebel_result check_height(const nb_textured_subject *of, const char *what, double height)
{
    if (height > 0 && height <= 1e12) return NEBEL_OK;
    return nb_fail(of->log, NEBEL_ERROR_VALUE, "planet: %s%s: is %g; must be more than 0, at most 1e12", of->name, what,
                   height);
}

static nebel_result check_map(const nb_textured_subject *of, const char *what, const nebel_planet_map *map,
                              int channels)
{
    const char *fault = nb_map_fault(map, channels);
    return fault == NULL ? NEBEL_OK : refuse(of, what, fault);
}

static nebel_result check_shell(const nb_textured_subject *of, const nebel_cloud_shell *shell)
{
    nebel_result result = check_map(of, "coverage_map", &shell->coverage_map, 1);
    if (result == NEBEL_OK) result = check_map(of, "detail_map", &shell->detail_map, 1);
    if (result == NEBEL_OK) result = check_height(of, "height", shell->height);
    if (result == NEBEL_OK) result = check_one(of, "rotation_period", shell->rotation_period, -1e12, 1e12);
    if (result == NEBEL_OK) result = check_all(of, "color", shell->color, 3, 0, 1);
    if (result == NEBEL_OK) result = check_all(of, "uv_tiling", shell->uv_tiling, 3, -1e3, 1e3);
    if (result == NEBEL_OK) result = check_one(of, "gain", shell->gain, 0, 1e3);
    return result == NEBEL_OK ? check_one(of, "coverage", shell->coverage, 0, 1) : result;
}

static nebel_result check_air(const nb_textured_subject *of, const nebel_atmosphere_shell *air)
{
    nebel_result result = check_height(of, "atmosphere.height", air->height);
    if (result == NEBEL_OK) result = check_one(of, "atmosphere.brightness", air->brightness, 0, 1e6);
    if (result == NEBEL_OK && air->ramp_count > NEBEL_MAX_RAMP_COLORS)
        result = refuse(of, "atmosphere.ramp_count", "must be at most 16");
    for (uint32_t i = 0; result == NEBEL_OK && i < air->ramp_count; i++)
        result = check_all(of, "atmosphere.ramp", air->ramp[i], 3, 0, 1e6);
    return result;
}

static nebel_result check_ball(const nb_textured_subject *of, const nebel_textured_planet_desc *desc)
{
    nebel_result result = check_all(of, "center", desc->center, 3, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH);
    if (result == NEBEL_OK) result = check_one(of, "radius", desc->radius, 1, 1e12);
    if (result == NEBEL_OK) result = check_all(of, "rotation", desc->rotation, 4, -1e6, 1e6);
    if (result == NEBEL_OK) result = check_one(of, "rotation_period", desc->rotation_period, -1e12, 1e12);
    if (result == NEBEL_OK) result = check_one(of, "land_coverage", desc->land_coverage, 0, 1);
    if (result == NEBEL_OK && desc->cloud_shell_count > NEBEL_MAX_CLOUD_SHELLS)
        result = refuse(of, "cloud_shell_count", "must be at most 8");
    return result == NEBEL_OK ? check_map(of, "color_map", &desc->color_map, 3) : result;
}

static nebel_result check(const nebel_textured_planet_desc *desc)
{
    nb_textured_subject of = {&desc->host.log, ""};
    nebel_result result = check_ball(&of, desc);
    if (result == NEBEL_OK && !desc->atmosphere.is_disabled) result = check_air(&of, &desc->atmosphere);
    for (uint32_t i = 0; result == NEBEL_OK && i < desc->cloud_shell_count; i++) {
        (void)snprintf(of.name, sizeof of.name, "clouds[%u]: ", (unsigned)i);
        result = check_shell(&of, &desc->cloud_shells[i]);
    }
    return result;
}

/* ---- making ---------------------------------------------------------------------------------- */

static nebel_result paint_map(const nebel_allocator *allocator, const nebel_planet_map_desc *desc, nb_planet_map *map)
{
    nebel_planet_map painted = {.width = 0};
    nebel_result result = nebel_get_planet_map_size(desc, &painted);
    if (result != NEBEL_OK) return result;
    float *texels = nb_allocate(allocator, painted.width * painted.height, (size_t)painted.channels * sizeof *texels);
    if (texels == NULL) return NEBEL_ERROR_MEMORY;
    result = nebel_generate_planet_map(desc, texels);
    painted.texels = texels;
    if (result == NEBEL_OK) result = nb_planet_map_make(allocator, &painted, map);
    nb_release(allocator, texels);
    return result;
}

static nebel_result make_map(const nebel_allocator *allocator, const nebel_planet_map *given,
                             const nebel_planet_map_desc *desc, nb_planet_map *map)
{
    return given->texels != NULL ? nb_planet_map_make(allocator, given, map) : paint_map(allocator, desc, map);
}

static nebel_result make_shell(const nebel_allocator *allocator, nebel_cloud_shell *desc, nb_shell *shell)
{
    const nebel_planet_map_desc clouds = {
        .type = NEBEL_PLANET_MAP_CLOUDS, .seed = desc->seed, .coverage = desc->coverage};
    const nebel_planet_map_desc detail = {
        .type = NEBEL_PLANET_MAP_DETAIL, .seed = desc->seed, .coverage = desc->coverage};
    const int is_one = desc->coverage_map.texels != NULL && desc->detail_map.texels == NULL;
    nebel_result result = make_map(allocator, &desc->coverage_map, &clouds, &shell->map);
    if (result == NEBEL_OK && !is_one) result = make_map(allocator, &desc->detail_map, &detail, &shell->detail);
    desc->coverage_map = nb_planet_map_level(&shell->map, 0);
    desc->detail_map = nb_planet_map_level(&shell->detail, 0);
    return result;
}

static nebel_result make_maps(nebel_textured_planet *layers)
{
    nebel_textured_planet_desc *const desc = &layers->desc;
    const nebel_planet_map_desc ground = {
        .type = NEBEL_PLANET_MAP_GROUND, .seed = desc->seed, .coverage = desc->land_coverage};
    nebel_result result = make_map(&desc->host.allocator, &desc->color_map, &ground, &layers->ground);
    desc->color_map = nb_planet_map_level(&layers->ground, 0);
    for (uint32_t i = 0; i < desc->cloud_shell_count && result == NEBEL_OK; i++)
        result = make_shell(&desc->host.allocator, &desc->cloud_shells[i], &layers->shells[i]);
    return result;
}

nebel_result nebel_create_textured_planet(const nebel_textured_planet_desc *desc, nebel_textured_planet **layers)
{
    if (layers != NULL) *layers = NULL;
    if (desc == NULL || layers == NULL || !nb_allocator_is_valid(&desc->host.allocator)) return NEBEL_ERROR_ARGUMENT;
    const nebel_textured_planet_desc whole = resolve(desc);
    nebel_result result = check(&whole);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&whole.host.allocator);
    nebel_textured_planet *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&whole.host.log, NEBEL_ERROR_MEMORY, "planet: out of memory");
    made->desc = whole;
    made->desc.host.allocator = allocator;
    made->desc.host.log = (nebel_log){.write = NULL};
    nb_quaternion_axes(whole.rotation, made->frame);
    result = make_maps(made);
    if (result == NEBEL_OK) {
        *layers = made;
        return NEBEL_OK;
    }
    nebel_destroy_textured_planet(made);
    return nb_fail(&whole.host.log, result, "planet: out of memory");
}

void nebel_destroy_textured_planet(nebel_textured_planet *layers)
{
    if (layers == NULL) return;
    const nebel_allocator allocator = layers->desc.host.allocator;
    nb_planet_map_free(&allocator, &layers->ground);
    for (uint32_t i = 0; i < NEBEL_MAX_CLOUD_SHELLS; i++) {
        nb_planet_map_free(&allocator, &layers->shells[i].map);
        nb_planet_map_free(&allocator, &layers->shells[i].detail);
    }
    nb_release(&allocator, layers);
}

/* ---- for those who draw it themselves -------------------------------------------------------- */

const nebel_textured_planet_desc *nebel_get_textured_planet_desc(const nebel_textured_planet *layers)
{
    return layers != NULL ? &layers->desc : NULL;
}

static const nb_planet_map *find_map(const nebel_textured_planet *layers, const float *texels)
{
    if (texels == layers->ground.levels[0]) return &layers->ground;
    for (uint32_t i = 0; i < layers->desc.cloud_shell_count; i++) {
        const nb_shell *const shell = &layers->shells[i];
        if (texels == shell->map.levels[0]) return &shell->map;
        if (texels == shell->detail.levels[0]) return &shell->detail;
    }
    return NULL;
}

nebel_result nebel_get_planet_map_mip(const nebel_textured_planet *layers, const nebel_planet_map *map, uint32_t level,
                                      nebel_planet_map *coarser)
{
    if (coarser != NULL) *coarser = (nebel_planet_map){0};
    if (layers == NULL || map == NULL || map->texels == NULL || coarser == NULL) return NEBEL_ERROR_ARGUMENT;
    const nb_planet_map *const found = find_map(layers, map->texels);
    if (found == NULL || level >= (uint32_t)found->level_count) return NEBEL_ERROR_ARGUMENT;
    *coarser = nb_planet_map_level(found, (int)level);
    return NEBEL_OK;
}

/* ---- what a ray meets ------------------------------------------------------------------------ */

/* A ray from a planet's middle, and its light. */
typedef struct nb_shell_ray {
    const nebel_textured_planet *layers;
    double from[3], to[3]; /* to: of length 1 */
    double far;            /* m, from the middle */
    double closest;        /* m along the ray, of the middle */
    double aside;          /* square of how far it is there */
    double t_max, time, spread;
    double sun[3], ambient[3], irradiance[3];
} nb_shell_ray;

/* The first side of a ball that is met; less than 0: none. From outside only what lies ahead is. */
static double meet(const nb_shell_ray *s, double radius)
{
    const double square = radius * radius - s->aside;
    if (!(square >= 0)) return -1;
    const double half = sqrt(square), near = s->closest - half;
    if (nb_height_above_sphere(s->far, radius) > 0) return s->closest > 0 ? fmax(0, near) : -1;
    return s->closest + half;
}

/* A place on a ball. */
typedef struct nb_shell_sample {
    double normal[3], sun, view; /* cosines; view from either side */
    double u, v, pole;           /* pole: the normal along the axis */
    double level;                /* of a map that is as wide as the ball is around */
} nb_shell_sample;

static double turn(double u, double day, double time)
{
    return day == 0 ? u : u - fmod(time / day, 1);
}

/* `days` are what the ball turns by: a shell of clouds turns with the ground, and against it. */
static nb_shell_sample spot_at(const nb_shell_ray *s, double radius, double t, const double days[2])
{
    nb_shell_sample spot;
    double place[3], local[3];
    for (int i = 0; i < 3; i++) place[i] = s->from[i] + t * s->to[i];
    const double length = nb_vector_length(place);
    for (int i = 0; i < 3; i++) spot.normal[i] = place[i] / length;
    for (int i = 0; i < 3; i++) local[i] = nb_vector_dot(s->layers->frame[i], spot.normal);
    spot.sun = nb_vector_dot(spot.normal, s->sun);
    spot.view = fabs(nb_vector_dot(spot.normal, s->to));
    spot.pole = fmin(fmax(local[1], -1), 1);
    const double u = atan2(-local[2], local[0]) / (2 * PI) + 0.5;
    spot.u = turn(turn(u, days[0], s->time), days[1], s->time);
    spot.v = acos(spot.pole) / PI;
    spot.level = nb_map_spread(s->spread * t, radius, spot.view);
    return spot;
}

static double read_map(const nb_planet_map *map, const nb_shell_sample *spot, double wrap, int repeats)
{
    double value = 0;
    const double texels = spot->level * fabs(wrap) * (double)map->width[0];
    nb_planet_map_read(map, wrap * spot->u, wrap * spot->v, texels > 1 ? log2(texels) : 0, repeats, &value);
    return value;
}

static double cover_at(const nb_shell *shell, const nebel_cloud_shell *desc, const nb_shell_sample *spot)
{
    const nb_planet_map *detail = shell->detail.level_count > 0 ? &shell->detail : &shell->map;
    double parts[3];
    for (int i = 0; i < 3; i++) parts[i] = read_map(detail, spot, desc->uv_tiling[i], 1);
    return nb_cloud_cover(read_map(&shell->map, spot, 1, 0), parts[0], parts[1], parts[2], spot->pole, desc->gain);
}

static void reflect(const nb_shell_ray *s, double sun, const double color[3], double cover, double radiance[3])
{
    for (int c = 0; c < 3; c++) radiance[c] = cover * color[c] * (s->irradiance[c] * fmax(sun, 0) / PI + s->ambient[c]);
}

static void insert(nebel_shell_hits *hits, const nebel_shell_hit *hit)
{
    uint32_t i = hits->count++;
    for (; i > 0 && hits->hits[i - 1].t > hit->t; i--) hits->hits[i] = hits->hits[i - 1];
    hits->hits[i] = *hit;
}

static void add_ground(const nb_shell_ray *s, double t, nebel_shell_hits *hits)
{
    const double days[2] = {s->layers->desc.rotation_period, 0};
    const nb_shell_sample spot = spot_at(s, s->layers->desc.radius, t, days);
    const nb_planet_map *map = &s->layers->ground;
    const double texels = spot.level * (double)map->width[0];
    nebel_shell_hit hit = {.t = t, .opacity = 1, .is_ground = 1};
    double color[3];
    nb_planet_map_read(map, spot.u, spot.v, texels > 1 ? log2(texels) : 0, 0, color);
    reflect(s, spot.sun, color, 1, hit.radiance);
    insert(hits, &hit);
}

static double radius_of(const nebel_textured_planet_desc *desc, uint32_t shell)
{
    return desc->radius + desc->cloud_shells[shell].height;
}

static void add_clouds(const nb_shell_ray *s, uint32_t number, double t, nebel_shell_hits *hits)
{
    const nebel_textured_planet_desc *const desc = &s->layers->desc;
    const nebel_cloud_shell *const shell = &desc->cloud_shells[number];
    const double days[2] = {desc->rotation_period, shell->rotation_period};
    const nb_shell_sample spot = spot_at(s, radius_of(desc, number), t, days);
    nebel_shell_hit hit = {.t = t, .opacity = cover_at(&s->layers->shells[number], shell, &spot)};
    reflect(s, spot.sun, shell->color, hit.opacity, hit.radiance);
    insert(hits, &hit);
}

static void add_air(const nb_shell_ray *s, double t, nebel_shell_hits *hits)
{
    static const double days[2] = {0, 0};
    const nebel_atmosphere_shell *air = &s->layers->desc.atmosphere;
    const nb_shell_sample spot = spot_at(s, s->layers->desc.radius + air->height, t, days);
    const nb_glow glow = nb_air_glow(spot.sun, spot.view);
    const double place = glow.place * (double)(air->ramp_count - 1);
    const uint32_t low = (uint32_t)place, high = low + 1 < air->ramp_count ? low + 1 : low;
    nebel_shell_hit hit = {.t = t, .opacity = 0};
    for (int c = 0; c < 3; c++) {
        const double color = air->ramp[low][c] + (place - low) * (air->ramp[high][c] - air->ramp[low][c]);
        hit.radiance[c] = air->brightness * glow.amount * color;
    }
    insert(hits, &hit);
}

static void look(const nb_shell_ray *s, nebel_shell_hits *hits)
{
    const nebel_textured_planet_desc *desc = &s->layers->desc;
    const double ground = meet(s, desc->radius), end = ground >= 0 ? fmin(ground, s->t_max) : s->t_max;
    hits->count = 0;
    for (uint32_t i = 0; i < desc->cloud_shell_count; i++) {
        const double t = meet(s, radius_of(desc, i));
        if (t >= 0 && t <= end) add_clouds(s, i, t, hits);
    }
    const double t = desc->atmosphere.is_disabled ? -1 : meet(s, desc->radius + desc->atmosphere.height);
    if (t >= 0 && t <= end) add_air(s, t, hits);
    if (ground >= 0 && ground <= s->t_max) add_ground(s, ground, hits);
}

/* ---- the face -------------------------------------------------------------------------------- */

static int set_view(const nebel_textured_planet *layers, const nebel_textured_planet_query *view, nb_shell_ray *s)
{
    *s = (nb_shell_ray){.layers = layers, .time = view->time, .spread = view->pixel_spread};
    if (!(fabs(view->time) <= 1e12 && view->pixel_spread >= 0 && view->pixel_spread <= 1e12)) return 0;
    if (!all_within(view->ambient, 3, 0, 1e9) || !all_within(view->sun.irradiance, 3, 0, 1e9)) return 0;
    memcpy(s->ambient, view->ambient, sizeof s->ambient);
    memcpy(s->irradiance, view->sun.irradiance, sizeof s->irradiance);
    memcpy(s->sun, view->sun.direction, sizeof s->sun);
    return is_zero(s->sun, 3) || nb_vector_make_unit(s->sun);
}

static int set_ray(const nebel_ray *ray, nb_shell_ray *s)
{
    if (!(ray->t_max >= 0)) return 0;
    for (int i = 0; i < 3; i++) {
        s->from[i] = ray->origin[i] - s->layers->desc.center[i];
        s->to[i] = ray->direction[i];
        if (!(fabs(s->from[i]) <= NEBEL_MAX_LENGTH)) return 0;
    }
    if (!nb_vector_make_unit(s->to)) return 0;
    double beside[3];
    s->far = nb_vector_length(s->from);
    s->closest = -nb_vector_dot(s->from, s->to);
    nb_vector_cross(s->from, s->to, beside);
    s->aside = nb_vector_dot(beside, beside);
    s->t_max = ray->t_max;
    return 1;
}

nebel_result nebel_trace_textured_planet(const nebel_textured_planet *layers, const nebel_textured_planet_query *view,
                                         size_t n, const nebel_ray *rays, size_t ray_stride, nebel_shell_hits *hits,
                                         size_t hit_stride)
{
    nb_shell_ray s;
    if (layers == NULL || view == NULL || (n > 0 && (rays == NULL || hits == NULL))) return NEBEL_ERROR_ARGUMENT;
    if (!set_view(layers, view, &s)) return NEBEL_ERROR_ARGUMENT;
    ray_stride = nb_stride_of(ray_stride, sizeof *rays);
    hit_stride = nb_stride_of(hit_stride, sizeof *hits);
    for (size_t i = 0; i < n; i++) {
        if (!set_ray(nb_stride_from(rays, ray_stride, i), &s)) return NEBEL_ERROR_ARGUMENT;
        look(&s, nb_stride_to(hits, hit_stride, i));
    }
    return NEBEL_OK;
}
