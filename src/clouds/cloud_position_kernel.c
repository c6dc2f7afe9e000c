/* Where places are in a layer of clouds, compiled once per instruction set: NB_WIDTH at a time. In the planet's axes that takes
 * double precision; what comes of it is float. No place's numbers hang on another's, so that all instruction sets agree. */
#include "cloud_density.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "cloud_kernel_prelude.h"

#include <string.h>

/* Of numbers below 2^51, which adding and taking away again leaves whole. */
static inline nb_wide whole_below(nb_wide x)
{
    const nb_wide shift = NB_W(6755399441055744.0), nearest = (x + shift) - shift;
    return nearest - nb_wselect(nearest > x, NB_W(1.0), NB_W(0.0));
}

static inline void store_bits(void *to, nb_bits bits)
{
    memcpy(to, &bits, NB_WIDTH * sizeof(uint32_t));
}

/* ---- cells ----------------------------------------------------------------------------------- */

/* Faces of the cube and the places on them, -1 to 1. */
typedef struct nb_faces {
    nb_bits face;
    nb_wide at[2];
} nb_faces;

static inline nb_faces find_faces(nb_wide x, nb_wide y, nb_wide z)
{
    const nb_wide ax = nb_wabs(x), ay = nb_wabs(y), az = nb_wabs(z);
    const nb_wmask by_x = nb_wand(ax >= ay, ax >= az), by_y = nb_wand(ax < ay, ay >= az);
    const nb_wide over = nb_wselect(by_x, x, nb_wselect(by_y, y, z)), per = NB_W(1.0) / nb_wabs(over);
    const nb_wide axis = nb_wselect(by_x, NB_W(0.0), nb_wselect(by_y, NB_W(2.0), NB_W(4.0)));
    return (nb_faces){nb_wto_bits32(axis + nb_wselect(over < NB_W(0.0), NB_W(1.0), NB_W(0.0))),
                      {nb_wselect(by_x, y, x) * per, nb_wselect(nb_wor(by_x, by_y), z, y) * per}};
}

/* nb_cloud_grid_hash. */
static inline nb_bits hash_of(nb_bits key, nb_bits x, nb_bits y)
{
    nb_bits hash = key + (x >> 2) * 0x9e3779b1u + (y >> 2) * 0x85ebca77u;
    hash = (hash ^ hash >> 16) * 0x7feb352du;
    hash = (hash ^ hash >> 15) * 0x846ca68bu;
    hash = hash ^ hash >> 16;
    return hash << 4 | (y & 3u) << 2 | (x & 3u);
}

static inline void find_in_grid(const nb_faces *faces, nb_real level, double per_spacing, int number, int p,
                                nb_cloud_cells *cells)
{
    const nb_wide per = nb_wsplat(per_spacing) * nb_widen(nb_scale_pow2(NB_F(1.0), -level));
    const nb_wide x = faces->at[0] * per, y = faces->at[1] * per, left = whole_below(x), low = whole_below(y);
    const nb_bits at_x = nb_wto_bits32(left), at_y = nb_wto_bits32(low);
    const nb_bits grid = nb_wto_bits32(nb_widen(level)) * (uint32_t)NEBEL_MAX_CLOUD_LAYERS + (uint32_t)number;
    const nb_bits key = 0x80000000u | grid << 3 | faces->face;
    nb_store_lanes(cells->u + p, nb_narrow(x - left));
    nb_store_lanes(cells->v + p, nb_narrow(y - low));
    store_bits(cells->x + p, at_x);
    store_bits(cells->y + p, at_y);
    store_bits(cells->key + p, key);
    store_bits(cells->hash + p, hash_of(key, at_x, at_y));
}

/* nb_cloud_grid_level and nb_cloud_next_part. */
static inline void find_cells(const nb_cloud_layer *layer, int number, const nb_faces *faces, int p,
                              nb_cloud_density_query *looks)
{
    const nb_real widest = nb_splat((float)(1U << (NB_CLOUD_GRIDS - 2)));
    const nb_real numbers = nb_min(NB_F(2.0) * nb_load_lanes(looks->width + p) / nb_splat(layer->grid), widest);
    const nb_halvings halvings = nb_halve(numbers);
    const nb_real times = nb_select(halvings.whole < nb_splat(NB_CLOUD_FADING), NB_F(4.0), NB_F(1.0));
    const nb_real next = nb_max(NB_F(0.0), NB_F(1.0) - times * (NB_F(1.0) - halvings.part));
    nb_store_lanes(looks->next + p, next);
    find_in_grid(faces, halvings.whole, layer->grids[0].per_spacing, number, p, &looks->cells[0]);
    if (nb_any(next > NB_F(0.0)))
        find_in_grid(faces, halvings.whole + NB_F(1.0), layer->grids[0].per_spacing, number, p, &looks->cells[1]);
}

/* ---- Worley noise --------------------------------------------------------------------------------- */

/* Where places are in a period of each scale, as parts of it; of wisps, places are drawn together along the wind. */
static inline void find_parts(const nb_cloud_layer *layer, const nb_wide place[3], int p, nb_cloud_density_query *looks)
{
    nb_wide drawn[3] = {place[0], place[1], place[2]};
    if (layer->kind == NEBEL_CLOUD_CIRRUS) {
        const nb_wide x = nb_wsplat(-layer->axis[2]), z = nb_wsplat(layer->axis[0]);
        const nb_wide shift = (place[0] * x + place[2] * z) * nb_wsplat(1.0 / NB_WORLEY_STRETCH - 1);
        drawn[0] += shift * x;
        drawn[2] += shift * z;
    }
    for (int k = 0; k < NB_CLOUD_WORLEY_SCALES; k++)
        for (int c = 0; c < 3; c++) {
            const nb_wide at = drawn[(c + k) % 3] * nb_wsplat(layer->per_worley[k]) + nb_wsplat(layer->worley_shift[c]);
            nb_store_lanes(looks->parts[k][c] + p, nb_narrow(at - whole_below(at)));
        }
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* A pixel hides so much along a ray, in pixels; of sheets, which it meets aslant, as much more as it is long there, down to so
 * flat rays. Then as much comes through as through thin rays within the pixel (test_clouds). */
#define HIDDEN_PIXELS 0.55f
#define FLATTEST 0.3f

/* How fast a ray climbs, and what a width hides along it: no more than a ball of cloud is wide. */
static inline void find_climb(const nb_cloud_layer *layer, const nb_wide place[3], nb_wide radius, int p,
                              nb_cloud_density_query *looks)
{
    nb_wide along = NB_W(0.0);
    for (int c = 0; c < 3; c++) along += place[c] * nb_wload_lanes(looks->way[c] + p);
    const nb_real climb = nb_narrow(along / radius), width = nb_load_lanes(looks->width + p);
    const nb_real up = climb / nb_splat(layer->hidden_height),
                  aside = (NB_F(1.0) - climb * climb) / nb_splat(layer->hidden_width * layer->hidden_width);
    const nb_real whole = NB_F(1.0) / nb_sqrt(up * up + nb_max(NB_F(0.0), aside));
    nb_real part = nb_splat(HIDDEN_PIXELS);
    if (layer->kind != NEBEL_CLOUD_CUMULUS) part = part / nb_max(nb_abs(climb), nb_splat(FLATTEST));
    nb_store_lanes(looks->climb + p, climb);
    nb_store_lanes(looks->hidden + p, nb_min(part * width, whole));
}

/* ---- the face -------------------------------------------------------------------------------- */

/* Drops are found eight at a time at most, or twice as many as places. */
enum { TOGETHER = NB_WIDTH < 4 ? 2 * NB_WIDTH : 8 };

void NB_SUFFIXED(nb_cloud_find_places_)(const nb_cloud_layer *layer, int number, nb_cloud_density_query *looks)
{
    const nb_wide low = nb_wsplat(layer->low);
    const nb_real per = nb_splat(layer->per_thickness);
    const int end = (looks->count + TOGETHER - 1) & -TOGETHER;
    for (int p = 0; p < end; p += NB_WIDTH) {
        nb_wide place[3];
        for (int c = 0; c < 3; c++) place[c] = nb_wload_lanes(looks->place[c] + p);
        const nb_wide radius = nb_wsqrt(place[0] * place[0] + place[1] * place[1] + place[2] * place[2]);
        const nb_faces faces = find_faces(place[0], place[1], place[2]);
        nb_wstore_lanes(looks->radius + p, radius);
        nb_store_lanes(looks->height + p, nb_narrow(radius - low) * per);
        if (looks->are_of_rays) find_climb(layer, place, radius, p, looks);
        find_cells(layer, number, &faces, p, looks);
        find_parts(layer, place, p, looks);
    }
}
