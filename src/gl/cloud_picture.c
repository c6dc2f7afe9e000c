/* What src/cpu/cpu_clouds.c does, for whole pictures. */
#include "cloud_picture.h"

#include "gl_cloud_shadow.h"
#include "gl_panorama.h"

#include "aerial/cloud_eclipse.h"
#include "aerial/cloud_compose.h"
#include "base/parallel.h"
#include "math/vector.h"

#include <string.h>

/* ---- parts ----------------------------------------------------------------------------------- */

typedef struct job {
    nb_gl_clouds *clouds;
    const nb_cloud_picture *picture, *middle; /* middle: of the middles of pixels, where picture is of a sample */
    void (*row)(const struct job *j, nb_cloud_part *part, uint32_t y);                  /* NULL: */
    void (*rows)(const struct job *j, nb_cloud_part *part, uint32_t top, uint32_t end); /* from the first row on */
    float *marks; /* where fog is to be known next, and along which ray */
    const float *places;
    float *over, *shade;
    const nb_cloud_shadow_extent *roof;
    uint32_t *words; /* of shade */
    uint32_t begin;  /* the first row of each part in this round */
} job;

/* Rows of each part between two times of asking whether to go on: of a picture of 1280x720 some tenths of a second. Parts and rounds
 * begin where blocks do. */
enum { ROUND = NB_CLOUD_PIXELS_ROWS };

/* Counted from the picture's first row. */
static uint32_t first_row(const job *j, size_t part)
{
    const uint64_t height = j->picture->view->height, rounds = (height + ROUND - 1) / ROUND;
    const uint64_t row = rounds * part / NB_CLOUD_PARTS * ROUND;
    return (uint32_t)(row < height ? row : height);
}

static nebel_result open_workspace(const nb_gl_clouds *clouds, nb_cloud_part *part)
{
    if (part->bundle == NULL) part->bundle = nb_allocate(&clouds->allocator, 1, sizeof *part->bundle);
    if (part->bundle == NULL) return NEBEL_ERROR_MEMORY;
    return part->workspace != NULL ? NEBEL_OK : nebel_create_cloud_workspace(clouds->view, &part->workspace);
}

static void do_part(void *data, size_t i)
{
    const job *const j = data;
    nb_cloud_part *const part = &j->clouds->parts[i];
    const uint32_t first = first_row(j, i) + j->begin, next = first_row(j, i + 1);
    const uint32_t end = first + ROUND < next ? first + ROUND : next;
    part->result = open_workspace(j->clouds, part);
    if (j->row == NULL && first < end && part->result == NEBEL_OK) j->rows(j, part, first, end);
    for (uint32_t y = first; j->row != NULL && y < end && part->result == NEBEL_OK; y++)
        j->row(j, part, j->picture->view->height - 1 - y);
}

static nebel_result do_round(job *j)
{
    nebel_result result = NEBEL_OK;
    nb_parallel_for(&j->clouds->parallel, NB_CLOUD_PARTS, do_part, j);
    for (size_t i = 0; i < NB_CLOUD_PARTS && result == NEBEL_OK; i++) result = j->clouds->parts[i].result;
    return result;
}

static nebel_result do_parts(job *j)
{
    const uint32_t rounds = (j->picture->view->height + ROUND - 1) / ROUND;
    const uint32_t rows = (rounds + NB_CLOUD_PARTS - 1) / NB_CLOUD_PARTS * ROUND;
    nebel_result result = NEBEL_OK;
    for (j->begin = 0; j->begin < rows && result == NEBEL_OK; j->begin += ROUND) {
        result = do_round(j);
        if (result == NEBEL_OK) result = j->picture->ask(j->picture->ask_user);
    }
    return result;
}

/* In double, as the CPU renderer has it: the walk through clouds may take other pieces where a digit is another. Returns its
 * length, which is 1 along the camera's axis, or in a panorama. */
static double direction_at(const nb_cloud_picture *picture, uint32_t x, uint32_t y, double direction[3])
{
    const nebel_view *const view = picture->view;
    const double *const clip = view->clip_from_eye, *const eye = view->eye_from_world;
    if (picture->panorama) {
        nb_panorama_look(view, x + picture->point.x, y + 1 - picture->point.y, direction);
        return 1;
    }
    const double right = ((2 * x + 1.) / view->width - 1 + clip[8]) / clip[0];
    const double up = ((2 * y + 1.) / view->height - 1 + clip[9]) / clip[5];
    for (int i = 0; i < 3; i++) direction[i] = right * eye[4 * i] + up * eye[4 * i + 1] - eye[4 * i + 2];
    return nb_vector_length(direction);
}

/* Returns how many radians wide it is. */
static double ray_at(const nb_cloud_picture *picture, uint32_t x, uint32_t y, nebel_ray *ray)
{
    const double length = direction_at(picture, x, y, ray->direction);
    memcpy(ray->origin, picture->eye, sizeof ray->origin);
    ray->t_max = HUGE_VAL;
    return picture->pixel / length;
}

/* To above the horizon, where samples may see the sky though the middle of their pixel meets the ground. Returns whether it was. */
static int lift(const nb_cloud_picture *picture, double spread, nebel_ray *ray)
{
    return picture->lifts &&
           nb_planets_lift(picture->worlds, picture->world_count, ray->origin, spread, ray->direction);
}

/* Along which nodes are found for all samples at once: among fog, which is not asked again, it is lifted. */
static double first_ray_at(const nb_cloud_picture *picture, uint32_t x, uint32_t y, nebel_ray *ray)
{
    const double spread = ray_at(picture, x, y, ray);
    if (picture->has_fog) (void)lift(picture, spread, ray);
    return spread;
}

/* ---- the view -------------------------------------------------------------------------------- */

static int is_same_lighting(const nebel_cloud_lighting_desc *a, const nebel_cloud_lighting_desc *b)
{
    return a->clouds == b->clouds && a->time == b->time && memcmp(&a->sun, &b->sun, sizeof a->sun) == 0;
}

static void forget(nb_gl_clouds *clouds)
{
    for (int i = 0; i < NB_CLOUD_PARTS; i++) {
        nebel_destroy_cloud_workspace(clouds->parts[i].workspace);
        clouds->parts[i].workspace = NULL;
    }
    nebel_destroy_cloud_lighting(clouds->view);
    clouds->view = NULL;
    clouds->of.clouds = NULL;
}

nebel_result nb_cloud_picture_set(nb_gl_clouds *clouds, const nebel_clouds *of, const nebel_sun *sun, double time,
                                  const nebel_log *log)
{
    const nebel_cloud_lighting_desc desc = {
        .clouds = of, .sun = *sun, .time = time, .host = {.allocator = clouds->allocator, .log = *log}};
    if (is_same_lighting(&clouds->of, &desc)) return NEBEL_OK;
    forget(clouds);
    const nebel_result result = nebel_create_cloud_lighting(&desc, &clouds->view);
    if (result == NEBEL_OK) clouds->of = desc;
    return result;
}

nebel_result nb_cloud_picture_workspace(nb_gl_clouds *clouds, nebel_cloud_workspace **workspace)
{
    const nebel_result result = open_workspace(clouds, &clouds->parts[0]);
    *workspace = clouds->parts[0].workspace;
    return result;
}

void nb_cloud_picture_release(nb_gl_clouds *clouds)
{
    forget(clouds);
    for (int i = 0; i < NB_CLOUD_PARTS; i++) {
        nb_release(&clouds->allocator, clouds->parts[i].bundle);
        nb_release(&clouds->allocator, clouds->parts[i].nodes);
        nb_release(&clouds->allocator, clouds->parts[i].before);
        nb_release(&clouds->allocator, clouds->parts[i].pieces);
    }
    nb_release(&clouds->allocator, clouds->pixels);
}

/* ---- rays ------------------------------------------------------------------------------------ */

static void set_nodes(const nebel_cloud_transfer *nodes, nb_cloud_pixel_node *list)
{
    for (uint32_t k = 0; k < nodes->count; k++) {
        list[k] = (nb_cloud_pixel_node){.t = nodes->t[k], .left = nodes->transmittance[k]};
        memcpy(list[k].light, nodes->in_scattering[k], sizeof list[k].light);
    }
}

static nebel_result keep_nodes(const job *j, nb_cloud_part *part, const nebel_cloud_transfer *nodes,
                               nb_cloud_pixel *pixel)
{
    void *list = part->nodes;
    if (!nb_grow(&j->clouds->allocator, &list, sizeof *part->nodes, part->count, &part->capacity,
                 part->count + nodes->count))
        return NEBEL_ERROR_MEMORY;
    part->nodes = list;
    pixel->first = (uint32_t)part->count;
    pixel->count = nodes->count;
    if (nodes->count > 0) set_nodes(nodes, part->nodes + part->count); /* the list of none may be NULL */
    part->count += nodes->count;
    return NEBEL_OK;
}

static int grow_pieces(const nebel_allocator *allocator, nb_cloud_part *part)
{
    void *pieces = part->pieces;
    const size_t count = part->piece_count;
    const int has =
        nb_grow(allocator, &pieces, sizeof *part->pieces, count, &part->piece_capacity, count + NB_SHADED_PIECES);
    part->pieces = pieces;
    return has;
}

static nebel_result shade_air(const job *j, nb_cloud_part *part, const nebel_ray *ray, nb_cloud_pixel *pixel)
{
    nebel_air_shadow shade;
    float left[3][NB_SHADED_PIECES], light[3][NB_SHADED_PIECES];
    double along[3][NB_SHADED_PIECES];
    const double *const direction[3] = {along[0], along[1], along[2]};
    nebel_transfer_planes transfers = {.error = NULL};
    pixel->first_piece = (uint32_t)part->piece_count;
    pixel->piece_count = 0;
    nebel_result result = nebel_trace_cloud_shadow_on_air(part->workspace, 1, ray, 0, &shade, 0);
    if (result != NEBEL_OK || shade.count == 0) return result;
    if (!grow_pieces(&j->clouds->allocator, part)) return NEBEL_ERROR_MEMORY;
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < NB_SHADED_PIECES; k++) along[c][k] = ray->direction[c];
        transfers.transmittance[c] = left[c];
        transfers.in_scattering[c] = light[c];
    }
    result =
        nb_planets_trace(j->picture->worlds, j->picture->world_count, shade.count + 1, direction, shade.t, &transfers);
    if (result != NEBEL_OK) return result;
    pixel->piece_count = nb_shadowed_air_set(&shade, light, part->pieces + part->piece_count);
    part->piece_count += pixel->piece_count;
    return NEBEL_OK;
}

static nebel_result trace_rays(const nb_cloud_picture *picture, nb_cloud_part *part, uint32_t count,
                               const nebel_ray *rays, const double *spreads, nebel_cloud_transfer *nodes)
{
    const nebel_result result =
        nebel_trace_clouds(part->workspace, count, rays, sizeof *rays, 0, spreads, nodes, sizeof *nodes);
    for (uint32_t i = 0; i < count && result == NEBEL_OK; i++)
        nb_cloud_eclipse(picture->worlds, picture->world_count, &rays[i], picture->to_sun, picture->disc, &nodes[i]);
    return result;
}

/* Some of its pixels. */
static nebel_result trace_pixels(const job *j, nb_cloud_part *part, const int is_asked[NB_CLOUD_SHARE])
{
    nb_cloud_bundle *const bundle = part->bundle;
    uint32_t count = 0;
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        if (!is_asked[i]) continue;
        bundle->asked[count] = bundle->rays[i];
        bundle->asked_spreads[count++] = bundle->spreads[i];
    }
    const nebel_result result =
        trace_rays(j->picture, part, count, bundle->asked, bundle->asked_spreads, bundle->found);
    count = 0;
    for (int i = 0; i < NB_CLOUD_SHARE && result == NEBEL_OK; i++)
        if (is_asked[i]) bundle->nodes[i] = bundle->found[count++];
    return result;
}

/* How far the ground is along a ray. */
static float ground_of(const job *j, const nebel_ray *ray)
{
    const double length = nb_vector_length(ray->direction);
    double unit[3];
    for (int c = 0; c < 3; c++) unit[c] = ray->direction[c] / length;
    return (float)nb_planets_cloudy_ground(j->picture->worlds, j->picture->world_count, ray->origin, unit);
}

/* The pixels of a block in some rows; end: its last row's next. */
static nebel_result trace_block(const job *j, nb_cloud_part *part, uint32_t left, uint32_t top, uint32_t end)
{
    const nebel_view *const view = j->picture->view;
    nb_cloud_bundle *const bundle = part->bundle;
    nb_cloud_pixel_block block;
    nebel_result result = NEBEL_OK;
    for (uint32_t i = 0; i < NB_CLOUD_SHARE; i++) {
        const uint32_t x = left + i % NB_CLOUD_PIXELS_COLUMNS, y = top + i / NB_CLOUD_PIXELS_COLUMNS;
        block.is_wanted[i] = x < view->width && y < end;
        block.is_open[i] = 1;
        block.nodes[i] = &bundle->nodes[i];
        if (!block.is_wanted[i]) continue;
        bundle->spreads[i] = first_ray_at(j->picture, x, view->height - 1 - y, &bundle->rays[i]);
        block.ground[i] = ground_of(j, &bundle->rays[i]);
    }
    nb_cloud_pixels_block_begin(&block);
    for (int level = 0; level < NB_CLOUD_PIXELS_LEVELS && result == NEBEL_OK; level++) {
        int is_asked[NB_CLOUD_SHARE];
        nb_cloud_pixels_block_ask(&block, level, is_asked);
        result = trace_pixels(j, part, is_asked);
    }
    return result;
}

static nebel_result keep_block(const job *j, nb_cloud_part *part, uint32_t left, uint32_t top, uint32_t end)
{
    const nebel_view *const view = j->picture->view;
    nebel_result result = NEBEL_OK;
    for (uint32_t i = 0; i < NB_CLOUD_SHARE && result == NEBEL_OK; i++) {
        const uint32_t x = left + i % NB_CLOUD_PIXELS_COLUMNS, y = top + i / NB_CLOUD_PIXELS_COLUMNS;
        if (x >= view->width || y >= end) continue;
        nb_cloud_pixel *const pixel = &j->clouds->pixels[(size_t)(view->height - 1 - y) * view->width + x];
        nebel_ray ray = part->bundle->rays[i];
        (void)lift(j->picture, part->bundle->spreads[i], &ray);
        result = shade_air(j, part, &ray, pixel);
        if (result == NEBEL_OK) result = keep_nodes(j, part, &part->bundle->nodes[i], pixel);
    }
    return result;
}

static void trace_rows(const job *j, nb_cloud_part *part, uint32_t top, uint32_t end)
{
    for (uint32_t left = 0; left < j->picture->view->width; left += NB_CLOUD_PIXELS_COLUMNS) {
        part->result = trace_block(j, part, left, top, end);
        if (part->result == NEBEL_OK) part->result = keep_block(j, part, left, top, end);
        if (part->result != NEBEL_OK) return;
    }
}

nebel_result nb_cloud_picture_trace(nb_gl_clouds *clouds, const nb_cloud_picture *picture)
{
    void *list = clouds->pixels;
    const size_t pixels = (size_t)picture->view->width * picture->view->height;
    if (!nb_grow(&clouds->allocator, &list, sizeof *clouds->pixels, 0, &clouds->pixel_capacity, pixels))
        return NEBEL_ERROR_MEMORY;
    clouds->pixels = list;
    for (int i = 0; i < NB_CLOUD_PARTS; i++) clouds->parts[i].count = clouds->parts[i].piece_count = 0;
    job j = {.clouds = clouds, .picture = picture, .rows = trace_rows};
    return do_parts(&j);
}

/* ---- their shade ----------------------------------------------------------------------------- */

static void write_shade_row(const job *j, nb_cloud_part *part, uint32_t y)
{
    const nb_cloud_picture *const picture = j->picture;
    const size_t width = picture->view->width;
    for (uint32_t x = 0; x < width && part->result == NEBEL_OK; x++) {
        const size_t i = y * width + x;
        const nb_cloud_pixel *const pixel = &j->clouds->pixels[i];
        nebel_ray ray;
        nb_fog_shadow fog;
        const double spread = ray_at(picture, x, y, &ray);
        (void)lift(picture, spread, &ray);
        if (j->roof != NULL) part->result = nb_fog_shadow_along(part->workspace, j->roof, ray, spread, &fog);
        if (part->result != NEBEL_OK) return;
        const uint32_t layers = nb_gl_cloud_shade_write(
            part->pieces + pixel->first_piece, pixel->piece_count, j->roof != NULL ? &fog : NULL,
            j->words + NB_CLOUD_SHADE_TEXELS * i, width * picture->view->height);
        if (layers > part->layers) part->layers = layers;
    }
}

nebel_result nb_cloud_picture_write_shade(nb_gl_clouds *clouds, const nb_cloud_picture *picture,
                                          const nb_cloud_shadow_extent *roof, uint32_t *words, uint32_t *layers)
{
    job j = {.clouds = clouds, .picture = picture, .row = write_shade_row, .roof = roof, .words = words};
    for (int i = 0; i < NB_CLOUD_PARTS; i++) clouds->parts[i].layers = 0;
    const nebel_result result = do_parts(&j);
    *layers = 0;
    for (int i = 0; i < NB_CLOUD_PARTS; i++)
        if (clouds->parts[i].layers > *layers) *layers = clouds->parts[i].layers;
    return result;
}

/* ---- among air and fog ----------------------------------------------------------------------- */

/* Of one colour: light of air up to a place, which loses some in the shade of clouds. */
static float shaded_at(const nb_cloud_part *part, const nb_cloud_pixel *pixel, int c, float t, float clear)
{
    return nb_shadowed_air_light(part->pieces + pixel->first_piece, pixel->piece_count, c, t, clear);
}

/* All that is known of a ray. */
typedef struct nb_cloud_mix {
    nebel_cloud_transfer nodes;
    nb_aerial_nodes air;
    nb_cloud_fog_nodes marks;
} nb_cloud_mix;

static nebel_result find_mix(const job *j, const nb_cloud_part *part, const nb_cloud_pixel_node *list,
                             const nb_cloud_pixel *pixel, const double direction[3], nb_cloud_mix *mix)
{
    nb_cloud_air_rays rays;
    mix->nodes = (nebel_cloud_transfer){.count = pixel->count};
    memset(&mix->marks, 0, sizeof mix->marks);
    for (uint32_t k = 0; k < pixel->count; k++) {
        mix->nodes.t[k] = list[k].t;
        mix->nodes.transmittance[k] = list[k].left;
        memcpy(mix->nodes.in_scattering[k], list[k].light, sizeof list[k].light);
    }
    nb_cloud_compose_ask(&mix->nodes, direction, &mix->air, &rays);
    const nebel_result result = nb_planets_trace(j->picture->worlds, j->picture->world_count, pixel->count,
                                                 rays.direction, mix->nodes.t, &rays.transfers);
    for (uint32_t k = 0; k < pixel->count && result == NEBEL_OK; k++) {
        if (list[k].is_marked) nb_cloud_mark(&mix->marks, k, list[k].haze_left, list[k].haze_light);
        for (int c = 0; c < 3; c++) mix->air.light[c][k] = shaded_at(part, pixel, c, list[k].t, mix->air.light[c][k]);
    }
    return result;
}

/* Nodes move over from those before, and one may come between them. */
static nebel_result choose_pixel(const job *j, nb_cloud_part *part, nb_cloud_pixel *pixel, const double direction[3])
{
    const nb_cloud_pixel_node *const before = part->before + pixel->first;
    nb_cloud_mix mix;
    float doubt;
    nebel_result result = find_mix(j, part, before, pixel, direction, &mix);
    if (result != NEBEL_OK) return result;
    const uint32_t count = pixel->count;
    pixel->next = nb_cloud_compose_next(&mix.nodes, &mix.marks, &mix.air, (float)NEBEL_DEFAULT_TOLERANCE, &doubt);
    result = keep_nodes(j, part, &mix.nodes, pixel);
    for (uint32_t k = 0; k < count && result == NEBEL_OK; k++) {
        const uint32_t at = pixel->count > count && (int)k >= pixel->next ? k + 1 : k;
        nb_cloud_pixel_node *const node = &part->nodes[pixel->first + at];
        node->is_marked = before[k].is_marked;
        memcpy(node->haze_left, before[k].haze_left, sizeof node->haze_left);
        memcpy(node->haze_light, before[k].haze_light, sizeof node->haze_light);
    }
    return result;
}

static void choose_row(const job *j, nb_cloud_part *part, uint32_t y)
{
    for (uint32_t x = 0; x < j->picture->view->width && part->result == NEBEL_OK; x++) {
        const size_t i = (size_t)y * j->picture->view->width + x;
        nb_cloud_pixel *const pixel = &j->clouds->pixels[i];
        float *const mark = j->marks + 4 * i;
        nebel_ray ray;
        const double inverse = first_ray_at(j->picture, x, y, &ray) / j->picture->pixel;
        pixel->next = -1;
        if (pixel->count > 0) part->result = choose_pixel(j, part, pixel, ray.direction);
        if (part->result != NEBEL_OK) return;
        mark[0] = pixel->next >= 0 ? part->nodes[pixel->first + (uint32_t)pixel->next].t : 0;
        for (int c = 0; c < 3; c++) mark[1 + c] = (float)(ray.direction[c] * inverse);
    }
}

nebel_result nb_cloud_picture_choose(nb_gl_clouds *clouds, const nb_cloud_picture *picture, float *places, int *any)
{
    const size_t pixels = (size_t)picture->view->width * picture->view->height;
    for (int i = 0; i < NB_CLOUD_PARTS; i++) {
        nb_cloud_part *const part = &clouds->parts[i];
        nb_cloud_pixel_node *const nodes = part->nodes;
        const size_t capacity = part->capacity;
        part->nodes = part->before;
        part->capacity = part->capacity_before;
        part->before = nodes;
        part->capacity_before = capacity;
        part->count = 0;
    }
    job j = {.clouds = clouds, .picture = picture, .row = choose_row, .marks = places};
    const nebel_result result = do_parts(&j);
    *any = 0;
    for (size_t i = 0; i < pixels && result == NEBEL_OK; i++) *any |= clouds->pixels[i].next >= 0;
    return result;
}

static nb_cloud_part *part_of(nb_gl_clouds *clouds, const nb_cloud_picture *picture, uint32_t y)
{
    const job j = {.picture = picture};
    size_t i = 0;
    while (picture->view->height - 1 - y >= first_row(&j, i + 1)) i++;
    return &clouds->parts[i];
}

void nb_cloud_picture_mark(nb_gl_clouds *clouds, const nb_cloud_picture *picture, const float *left, const float *light)
{
    for (uint32_t y = 0; y < picture->view->height; y++) {
        nb_cloud_part *const part = part_of(clouds, picture, y);
        for (uint32_t x = 0; x < picture->view->width; x++) {
            const size_t i = (size_t)y * picture->view->width + x;
            const nb_cloud_pixel *const pixel = &clouds->pixels[i];
            if (pixel->count == 0 || pixel->next < 0) continue;
            nb_cloud_pixel_node *const node = &part->nodes[pixel->first + (uint32_t)pixel->next];
            node->is_marked = 1;
            memcpy(node->haze_left, left + 4 * i, sizeof node->haze_left);
            memcpy(node->haze_light, light + 4 * i, sizeof node->haze_light);
        }
    }
}

/* Without fog where none is marked. */
static nebel_result mix_pixel(const job *j, const nb_cloud_part *part, const nb_cloud_pixel *pixel,
                              const double direction[3], nb_cloud_pixel_node *list)
{
    nb_cloud_mix mix;
    const nebel_result result = find_mix(j, part, list, pixel, direction, &mix);
    if (result != NEBEL_OK) return result;
    nb_aerial_nodes haze = mix.air;
    for (int c = 0; c < 3; c++) {
        float over[NEBEL_MAX_CLOUD_NODES];
        if (mix.marks.is_set[0]) nb_cloud_compose_add_fog(&mix.nodes, &mix.marks, c, &mix.air, &haze);
        nb_cloud_compose_sum(&mix.nodes, c, &haze, over);
        for (uint32_t k = 0; k < pixel->count; k++) list[k].light[c] = over[k];
    }
    return NEBEL_OK;
}

static void mix_row(const job *j, nb_cloud_part *part, uint32_t y)
{
    for (uint32_t x = 0; x < j->picture->view->width && part->result == NEBEL_OK; x++) {
        const nb_cloud_pixel *const pixel = &j->clouds->pixels[(size_t)y * j->picture->view->width + x];
        nebel_ray ray;
        (void)first_ray_at(j->picture, x, y, &ray);
        if (pixel->count > 0) part->result = mix_pixel(j, part, pixel, ray.direction, part->nodes + pixel->first);
    }
}

nebel_result nb_cloud_picture_mix(nb_gl_clouds *clouds, const nb_cloud_picture *picture)
{
    job j = {.clouds = clouds, .picture = picture, .row = mix_row};
    return do_parts(&j);
}

/* ---- ends ------------------------------------------------------------------------------------ */

/* A surface is on the ground where it is no higher than that part of its distance and of the planet's radius. */
#define NEAR_GROUND 1e-6

/* Before a surface within the clouds they are as between the nodes around it. */
static void blend_nodes(const nb_cloud_pixel_node *nodes, uint32_t count, float end, float over[4])
{
    static const float clear[4] = {0, 0, 0, 1};
    float t[NEBEL_MAX_CLOUD_NODES], part;
    memcpy(over, clear, sizeof clear);
    if (count == 0 || !(end > nodes[0].t)) return;
    for (uint32_t i = 0; i < count; i++) t[i] = nodes[i].t;
    const uint32_t k = nb_cloud_compose_find(count, t, end, &part);
    const nb_cloud_pixel_node *const a = &nodes[k], *const b = &nodes[part > 0 ? k + 1 : k];
    for (int c = 0; c < 3; c++) over[c] = (1 - part) * a->light[c] + part * b->light[c];
    over[3] = (1 - part) * a->left + part * b->left;
}

/* Where a ray ends, and how far clouds matter to it. */
typedef struct nb_cloud_end {
    float t;
    int is_on_ground, is_in_sky;
} nb_cloud_end;

/* t: 0: in the sky; it is known to some float digits. */
static nb_cloud_end end_at(const job *j, const double direction[3], float t)
{
    const double length = nb_vector_length(direction);
    double unit[3];
    if (!(t > 0)) return (nb_cloud_end){.t = HUGE_VALF, .is_in_sky = 1};
    for (int c = 0; c < 3; c++) unit[c] = direction[c] / length;
    for (int k = 0; k < j->picture->world_count; k++) {
        const nb_planet *const world = &j->picture->worlds[k];
        double from[3];
        for (int c = 0; c < 3; c++) from[c] = j->picture->eye[c] + (double)t * unit[c] - world->center[c];
        if (nb_vector_length(from) - world->radius < NEAR_GROUND * ((double)t + world->radius)) {
            const double end = nb_cloud_ground_end(world->center, j->picture->eye, unit, (double)t);
            return (nb_cloud_end){.t = (float)end, .is_on_ground = 1};
        }
    }
    return (nb_cloud_end){.t = t};
}

/* NULL for a pixel without nodes: the list of none may be NULL, to which nothing is added. */
static const nb_cloud_pixel_node *nodes_of(const nb_cloud_part *part, const nb_cloud_pixel *pixel)
{
    return pixel->count > 0 ? part->nodes + pixel->first : NULL;
}

/* Whether nodes up to the ground do for a ray that ends there: among fog they must. */
static int is_found(const job *j, const nb_cloud_part *part, const nb_cloud_pixel *pixel, float end)
{
    const nb_cloud_pixel_node *const nodes = nodes_of(part, pixel);
    if (pixel->count == 0 || j->picture->has_fog) return 1;
    return nb_cloud_is_found(pixel->count, nodes[0].t, nodes[pixel->count - 1].t, HUGE_VALF, end);
}

/* Along another ray, or up to another place. */
static nebel_result lay_anew(const job *j, nb_cloud_part *part, const nb_cloud_pixel *pixel, const nebel_ray *ray,
                             double spread, float over[4])
{
    nb_cloud_pixel anew = *pixel;
    nb_cloud_pixel_node list[NEBEL_MAX_CLOUD_NODES];
    nebel_cloud_transfer nodes;
    nebel_result result = trace_rays(j->picture, part, 1, ray, &spread, &nodes);
    if (result != NEBEL_OK) return result;
    anew.count = nodes.count;
    set_nodes(&nodes, list);
    if (nodes.count > 0) result = mix_pixel(j, part, &anew, ray->direction, list);
    blend_nodes(list, nodes.count, (float)ray->t_max, over);
    return result;
}

/* Along the middle of the pixel, or lifted from there for what is in the sky. Fog is not asked again: what is on the ground has none
 * among its clouds where the pixel's is that of the sky. */
static nebel_result lay_pixel(const job *j, nb_cloud_part *part, uint32_t x, uint32_t y, const nb_cloud_end *end,
                              float over[4])
{
    const nb_cloud_pixel *const pixel = &j->clouds->pixels[(size_t)y * j->picture->view->width + x];
    nebel_ray ray;
    const double spread = ray_at(j->middle, x, y, &ray);
    nebel_ray lifted = ray;
    const int has_other = lift(j->middle, spread, &lifted);
    ray.t_max = lifted.t_max = (double)end->t;
    if ((has_other && (j->picture->has_fog ? end->is_on_ground : end->is_in_sky)) || !is_found(j, part, pixel, end->t))
        return lay_anew(j, part, pixel, end->is_in_sky ? &lifted : &ray, spread, over);
    blend_nodes(nodes_of(part, pixel), pixel->count, end->t, over);
    return NEBEL_OK;
}

static nebel_result shade(const job *j, nb_cloud_part *part, const double direction[3], double t, float left[4])
{
    double place[1][3];
    const double length = nb_vector_length(direction), width = 4 * j->picture->pixel * t;
    for (int c = 0; c < 3; c++) place[0][c] = j->picture->eye[c] + t * direction[c] / length;
    const nebel_result result =
        nebel_compute_cloud_sun_transmittance(part->workspace, width, 1, (const double(*)[3])place, 0, &left[0]);
    left[1] = left[2] = left[0];
    return result == NEBEL_OK ? nebel_compute_cloud_sky_transmittance(part->workspace, width, 1,
                                                                      (const double(*)[3])place, 0, &left[3])
                              : result;
}

static void end_row(const job *j, nb_cloud_part *part, uint32_t y)
{
    for (uint32_t x = 0; x < j->picture->view->width && part->result == NEBEL_OK; x++) {
        const size_t i = (size_t)y * j->picture->view->width + x;
        const float t = j->places[4 * i];
        double direction[3];
        (void)direction_at(j->picture, x, y, direction);
        const nb_cloud_end end = end_at(j, direction, t);
        part->result = lay_pixel(j, part, x, y, &end, j->over + 4 * i);
        if (t > 0 && part->result == NEBEL_OK) part->result = shade(j, part, direction, (double)t, j->shade + 4 * i);
    }
}

nebel_result nb_cloud_picture_end(nb_gl_clouds *clouds, const nb_cloud_picture *picture, const nb_cloud_picture *middle,
                                  const float *places, float *over, float *shade_plane)
{
    job j = {.clouds = clouds,
             .picture = picture,
             .middle = middle,
             .row = end_row,
             .places = places,
             .over = over,
             .shade = shade_plane};
    return do_parts(&j);
}
