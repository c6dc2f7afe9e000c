#include "cloud_air.h"

#include <math.h>
#include <string.h>

nebel_ray nb_cloud_air_ray(const nb_frame *frame, const nb_cloud_scratch *clouds, uint32_t lane)
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = frame->view.position[c];
        ray.direction[c] = clouds->rays.direction[c][lane];
    }
    return ray;
}

/* ---- asking ---------------------------------------------------------------------------------- */

/* What is asked of the air at once: ends along the rays of some lanes. */
typedef struct nb_cpu_planets_asked {
    uint32_t lane_count, lanes[NB_BATCH], first[NB_BATCH]; /* of a lane's ends */
    uint32_t count;
    double direction[3][NB_PLANETS_RAYS];
    float t[NB_PLANETS_RAYS], left[3][NB_PLANETS_RAYS], light[3][NB_PLANETS_RAYS];
} nb_cpu_planets_asked;

static int has_room(const nb_cpu_planets_asked *asked, uint32_t count)
{
    return asked->count + count <= NB_PLANETS_RAYS;
}

static void ask(const nb_cloud_scratch *clouds, uint32_t lane, uint32_t count, const float *t,
                nb_cpu_planets_asked *asked)
{
    asked->lanes[asked->lane_count] = lane;
    asked->first[asked->lane_count++] = asked->count;
    for (uint32_t k = 0; k < count; k++) {
        for (int c = 0; c < 3; c++) asked->direction[c][asked->count] = clouds->rays.direction[c][lane];
        asked->t[asked->count++] = t[k];
    }
}

static nebel_result trace_air(const nb_frame *frame, nb_cpu_planets_asked *asked)
{
    const double *const direction[3] = {asked->direction[0], asked->direction[1], asked->direction[2]};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int c = 0; c < 3; c++) {
        transfers.transmittance[c] = asked->left[c];
        transfers.in_scattering[c] = asked->light[c];
    }
    return nb_cpu_planets_trace(&frame->air, asked->count, direction, asked->t, &transfers);
}

/* ---- shade ----------------------------------------------------------------------------------- */

/* Shade is a mean over many pixels: between four of them, at the corners of a cell as high as a batch, it is linear where they are so much
 * alike. FAR: of the way to a piece's end; PART: of light. Cells share the columns of their corners. */
#define ALIKE_FAR 0.1f
#define ALIKE_PART 0.05f

/* The shade of those that were asked; begins anew. */
static nebel_result set_shade(const nb_frame *frame, const nebel_air_shadow *shades, nb_cloud_scratch *clouds,
                              nb_cpu_planets_asked *asked)
{
    if (asked->count == 0) return NEBEL_OK;
    const nebel_result result = trace_air(frame, asked);
    for (uint32_t i = 0; i < asked->lane_count && result == NEBEL_OK; i++) {
        const uint32_t lane = asked->lanes[i];
        float light[3][NB_SHADED_PIECES];
        for (int c = 0; c < 3; c++)
            memcpy(light[c], asked->light[c] + asked->first[i], (shades[lane].count + 1) * sizeof light[c][0]);
        clouds->shaded_count[lane] = nb_shadowed_air_set(&shades[lane], light, clouds->shaded[lane]);
    }
    asked->lane_count = asked->count = 0;
    return result;
}

/* Of lanes whose own it is. */
static nebel_result find_shade(const nb_frame *frame, const int is_own[NB_BATCH], nb_cloud_scratch *clouds)
{
    nebel_result result = NEBEL_OK;
    nebel_air_shadow shades[NB_BATCH];
    nb_cpu_planets_asked asked;
    asked.lane_count = asked.count = 0;
    for (uint32_t i = 0; i < NB_BATCH && result == NEBEL_OK; i++) {
        if (!is_own[i]) continue;
        const nebel_ray ray = nb_cloud_air_ray(frame, clouds, i);
        result = nebel_trace_cloud_shadow_on_air(clouds->workspace, 1, &ray, 0, &shades[i], 0);
        if (result != NEBEL_OK || shades[i].count == 0) continue;
        if (!has_room(&asked, shades[i].count + 1)) result = set_shade(frame, shades, clouds, &asked);
        ask(clouds, i, shades[i].count + 1, shades[i].t, &asked);
    }
    return result == NEBEL_OK ? set_shade(frame, shades, clouds, &asked) : result;
}

enum { CELL = 9, CELLS = (NB_REGION - 1) / CELL };
_Static_assert((int)CELL *(int)CELLS == (int)NB_REGION - 1, "the last cell ends where a batch does");

/* Lanes of a cell's corners, x first. */
static void set_cell_corners(uint32_t cell, uint32_t lanes[4])
{
    for (uint32_t i = 0; i < 4; i++) lanes[i] = nb_lane_at(CELL * (cell + (i & 1)), (i >> 1) * (NB_BLOCK - 1));
}

static int is_corner(uint32_t x, uint32_t y)
{
    return x % CELL == 0 && (y == 0 || y == NB_BLOCK - 1);
}

static int is_close(const nb_shadowed_segment *a, const nb_shadowed_segment *b)
{
    int is = fabsf(b->t - a->t) <= ALIKE_FAR * a->t;
    for (int c = 0; c < 3; c++) is &= fabsf(b->part[c] - a->part[c]) <= ALIKE_PART;
    return is;
}

static int are_alike(const nb_cloud_scratch *clouds, const uint32_t corners[4])
{
    const nb_shadowed_segment *first = clouds->shaded[corners[0]];
    const uint32_t count = clouds->shaded_count[corners[0]];
    for (int i = 1; i < 4; i++) {
        if (clouds->shaded_count[corners[i]] != count) return 0;
        for (uint32_t k = 0; k < count; k++)
            if (!is_close(&first[k], &clouds->shaded[corners[i]][k])) return 0;
    }
    return 1;
}

/* A piece between those at the corners. */
static nb_shadowed_segment between(const nb_shadowed_segment *const at[4], uint32_t k, const float weights[4])
{
    nb_shadowed_segment piece = {.t = 0};
    for (int i = 0; i < 4; i++) {
        piece.t += weights[i] * at[i][k].t;
        for (int c = 0; c < 3; c++) {
            piece.part[c] += weights[i] * at[i][k].part[c];
            piece.rest[c] += weights[i] * at[i][k].rest[c];
        }
    }
    return piece;
}

static void fill_pixel(const uint32_t corners[4], float u, float v, uint32_t lane, nb_cloud_scratch *clouds)
{
    const nb_shadowed_segment *at[4];
    const float weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    for (int i = 0; i < 4; i++) at[i] = clouds->shaded[corners[i]];
    clouds->shaded_count[lane] = clouds->shaded_count[corners[0]];
    for (uint32_t k = 0; k < clouds->shaded_count[lane]; k++) clouds->shaded[lane][k] = between(at, k, weights);
}

/* Where corners are alike; what is filled needs no shade of its own. */
static void fill_cell(uint32_t cell, int is_own[NB_BATCH], nb_cloud_scratch *clouds)
{
    uint32_t corners[4];
    set_cell_corners(cell, corners);
    if (!are_alike(clouds, corners)) return;
    for (uint32_t i = 0; i < NB_BLOCK * (CELL + 1); i++) {
        const uint32_t x = i % (CELL + 1), y = i / (CELL + 1), lane = nb_lane_at(CELL * cell + x, y);
        if (!is_own[lane]) continue;
        fill_pixel(corners, (float)x / CELL, (float)y / (NB_BLOCK - 1), lane, clouds);
        is_own[lane] = 0;
    }
}

static int is_in_picture(const nb_frame *frame, const nb_batch_place *place, uint32_t lane)
{
    return nb_lane_x(place->first + lane) < frame->width - place->left &&
           nb_lane_y(place->first + lane) < frame->height - place->top;
}

/* First the corners, then those whose corners are not alike. At the picture's edge each pixel has its own. */
nebel_result nb_cloud_air_shade(const nb_frame *frame, const nb_batch_place *place, nb_cloud_scratch *clouds)
{
    int is_first[NB_BATCH], is_later[NB_BATCH], is_whole[CELLS];
    for (uint32_t cell = 0; cell < CELLS; cell++)
        is_whole[cell] = is_in_picture(frame, place, nb_lane_at(CELL * (cell + 1), NB_BLOCK - 1));
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const uint32_t x = nb_lane_x(i), y = nb_lane_y(i), cell = x / CELL < CELLS ? x / CELL : CELLS - 1;
        clouds->shaded_count[i] = 0;
        is_first[i] = is_in_picture(frame, place, i) && (is_corner(x, y) || !is_whole[cell]);
        is_later[i] = is_whole[cell] && !is_corner(x, y);
    }
    const nebel_result result = find_shade(frame, is_first, clouds);
    for (uint32_t cell = 0; cell < CELLS && result == NEBEL_OK; cell++)
        if (is_whole[cell]) fill_cell(cell, is_later, clouds);
    return result == NEBEL_OK ? find_shade(frame, is_later, clouds) : result;
}

/* ---- up to nodes ----------------------------------------------------------------------------- */

/* What the air does up to the nodes of those that were asked; begins anew. */
static nebel_result set_cloud_air(const nb_frame *frame, nb_cloud_scratch *clouds, nb_cpu_planets_asked *asked)
{
    if (asked->count == 0) return NEBEL_OK;
    const nebel_result result = trace_air(frame, asked);
    for (uint32_t i = 0; i < asked->lane_count && result == NEBEL_OK; i++) {
        const uint32_t lane = asked->lanes[i], first = asked->first[i];
        const nebel_cloud_transfer *nodes = &clouds->nodes[lane];
        nb_aerial_nodes *air = &clouds->air[lane];
        for (int c = 0; c < 3; c++)
            for (uint32_t k = 0; k < nodes->count; k++) {
                air->left[c][k] = asked->left[c][first + k];
                air->light[c][k] = nb_shadowed_air_light(clouds->shaded[lane], clouds->shaded_count[lane], c,
                                                         nodes->t[k], asked->light[c][first + k]);
            }
    }
    asked->lane_count = asked->count = 0;
    return result;
}

nebel_result nb_cloud_air_find(const nb_frame *frame, const int is_asked[NB_BATCH], nb_cloud_scratch *clouds)
{
    nebel_result result = NEBEL_OK;
    nb_cpu_planets_asked asked;
    asked.lane_count = asked.count = 0;
    for (uint32_t i = 0; i < NB_BATCH && result == NEBEL_OK; i++) {
        const nebel_cloud_transfer *nodes = &clouds->nodes[i];
        if (!is_asked[i]) continue;
        if (!has_room(&asked, nodes->count)) result = set_cloud_air(frame, clouds, &asked);
        ask(clouds, i, nodes->count, nodes->t, &asked);
    }
    return result == NEBEL_OK ? set_cloud_air(frame, clouds, &asked) : result;
}
