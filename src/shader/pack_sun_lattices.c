/* One lattice for each grid and each way to the sun through it, however many volumes share them whose extinctions are of one
 * size. Each of its texels has the eight nodes of a cell, so that shaders read one texel for each place they ask for; or it says
 * that these do not hold what lies between them, so that shaders walk. */
#include "pack_sun_lattices.h"

#include "pack_voxels.h"
#include "texel_layout.h"

#include "light/lighting.h"

#include <math.h>
#include <string.h>

/* Two columns a cell where they take no more than 128 MiB; more, for cells that are long in metres or wide in optical depth, where
 * that is 16 MiB. */
#define MOST_LATTICE_TEXELS ((size_t)1 << 23)
#define MOST_FINE_TEXELS ((size_t)1 << 20)
enum { MOST_LAYERS = 4 };

/* What part of the sunlight interpolation may be off by at one place: it is too large here and too small there, along a ray that
 * is a fifth. */
#define PLACE_TOLERANCE 0.005

/* The power of two above the largest extinction: flaws are found for it, so that a change of the extinction is seldom one of
 * the texels. */
static double extinction_of(const nebel_lighting *lighting, size_t medium)
{
    const double *extinction = lighting->snapshot->media[medium].body.extinction;
    const double most = fmax(extinction[0], fmax(extinction[1], extinction[2]));
    return most > 0 ? ldexp(1, ilogb(most) + 1) : 0;
}

static int is_same(const nebel_lighting *a, size_t i, const nebel_lighting *b, size_t k)
{
    double one[3], other[3];
    if (nb_grid_of_medium(a, i) == NULL || nb_grid_of_medium(b, k) == NULL) return 0;
    if (extinction_of(a, i) < extinction_of(b, k) || extinction_of(a, i) > extinction_of(b, k)) return 0;
    nb_way_in_cells(a, &a->snapshot->media[i].body, one);
    nb_way_in_cells(b, &b->snapshot->media[k].body, other);
    return memcmp(one, other, sizeof one) == 0 &&
           nb_grid_compare(nb_grid_of_medium(a, i), nb_grid_of_medium(b, k)) == 0;
}

/* The first medium that has this one's lattice. */
static size_t first_with_lattice(const nebel_lighting *lighting, size_t medium)
{
    size_t first = 0;
    while (!is_same(lighting, first, lighting, medium)) first++;
    return first;
}

/* The next medium, from `medium` on, with a lattice that none before it has; medium_count: there is none. */
static size_t next_lattice(const nebel_lighting *lighting, size_t medium)
{
    if (!lighting->scatters_sun) return lighting->snapshot->medium_count;
    while (medium < lighting->snapshot->medium_count &&
           (nb_grid_of_medium(lighting, medium) == NULL || first_with_lattice(lighting, medium) != medium))
        medium++;
    return medium;
}

static size_t count_lattices(const nebel_lighting *lighting)
{
    size_t count = 0;
    for (size_t i = next_lattice(lighting, 0); i < lighting->snapshot->medium_count; i = next_lattice(lighting, i + 1))
        count++;
    return count;
}

/* How many layers a cell wants, so that what interpolation is off by at worst, an eighth of what the densest cell takes, over
 * the square of the layers, is what a place may be off by. */
static double layers_wanted(const nebel_lighting *lighting, size_t medium, const double way[3])
{
    const double speed = fmax(fabs(way[0]), fmax(fabs(way[1]), fabs(way[2])));
    const double depth = extinction_of(lighting, medium) * nb_grid_peak(nb_grid_of_medium(lighting, medium)) / speed;
    double layers = 1;
    while (layers < MOST_LAYERS && depth > 8 * PLACE_TOLERANCE * layers * layers) layers *= 2;
    return layers;
}

static int is_within(const nebel_lighting *lighting, size_t medium, const double way[3], nb_sun_lattice_limit limit)
{
    nb_sun_lattice lattice = {0};
    nb_sun_lattice_lay(&lattice, nb_grid_of_medium(lighting, medium), way, limit);
    return lattice.per_cell >= limit.per_cell;
}

static nb_sun_lattice_limit limit_of(const nebel_lighting *lighting, size_t medium, size_t room)
{
    const size_t share = room / count_lattices(lighting);
    double way[3];
    nb_way_in_cells(lighting, &lighting->snapshot->media[medium].body, way);
    const int is_linear = nb_grid_is_linear(nb_grid_of_medium(lighting, medium));
    for (double layers = layers_wanted(lighting, medium, way); layers >= 1; layers /= 2) {
        const double most = is_linear ? 2 * layers : 2 * MOST_LAYERS;
        for (double columns = most; columns > 2 || columns >= most; columns /= 2) {
            const nb_sun_lattice_limit limit = {columns, share < MOST_FINE_TEXELS ? share : MOST_FINE_TEXELS, layers};
            if (is_within(lighting, medium, way, limit)) return limit;
        }
    }
    return (nb_sun_lattice_limit){2, share < MOST_LATTICE_TEXELS ? share : MOST_LATTICE_TEXELS, 1};
}

static size_t cells_of(const nb_sun_lattice *l, int axis)
{
    return (size_t)l->count[axis] - 1;
}

static size_t texels_of(const nebel_lighting *lighting, size_t medium, size_t room)
{
    nb_sun_lattice lattice = {0};
    double way[3];
    nb_way_in_cells(lighting, &lighting->snapshot->media[medium].body, way);
    nb_sun_lattice_lay(&lattice, nb_grid_of_medium(lighting, medium), way, limit_of(lighting, medium, room));
    return NB_SUN_LATTICE_TEXELS + cells_of(&lattice, 0) * cells_of(&lattice, 1) * cells_of(&lattice, 2);
}

size_t nb_count_sun_lattice_texels(const nebel_lighting *lighting, size_t room)
{
    size_t count = 0;
    for (size_t i = next_lattice(lighting, 0); i < lighting->snapshot->medium_count; i = next_lattice(lighting, i + 1))
        count += texels_of(lighting, i, room);
    return count;
}

void nb_place_sun_lattices(const nebel_lighting *lighting, size_t room, size_t first, nebel_texel_f32 *words)
{
    for (size_t i = 0; i < lighting->snapshot->medium_count && lighting->scatters_sun; i++) {
        if (nb_grid_of_medium(lighting, i) == NULL) continue;
        nebel_texel_f32 *word = &words[NB_HEADER_TEXELS + i * NB_MEDIUM_TEXELS + NB_MEDIUM_LEAF];
        const size_t before = first_with_lattice(lighting, i);
        word->v[1] =
            before < i ? words[NB_HEADER_TEXELS + before * NB_MEDIUM_TEXELS + NB_MEDIUM_LEAF].v[1] : (float)first;
        if (before == i) first += texels_of(lighting, i, room);
    }
}

int nb_same_sun_lattices(const nebel_lighting *a, const nebel_lighting *b)
{
    size_t i = next_lattice(a, 0), k = next_lattice(b, 0);
    while (i < a->snapshot->medium_count && k < b->snapshot->medium_count && is_same(a, i, b, k)) {
        i = next_lattice(a, i + 1);
        k = next_lattice(b, k + 1);
    }
    return i == a->snapshot->medium_count && k == b->snapshot->medium_count;
}

/* ---- texels ---------------------------------------------------------------------------------- */

static void pack_lattice_head(const nb_sun_lattice *l, nebel_texel_u32 *head)
{
    for (int i = 0; i < 3; i++) head[0].v[i] = (uint32_t)cells_of(l, i);
    head[0].v[3] = (uint32_t)l->axis;
    for (int s = 0; s < 2; s++) {
        head[1].v[s] = nb_texel_bits(l->lean[s]);
        head[1].v[2 + s] = nb_texel_bits(l->first[s]);
    }
    head[2] = (nebel_texel_u32){
        {nb_texel_bits(l->per_cell), nb_texel_bits(l->step), (uint32_t)l->ends_in_fog, nb_texel_bits(l->per_layer)}};
    head[3] = (nebel_texel_u32){
        {nb_texel_bits(l->end[0]), nb_texel_bits(l->end[1]), nb_texel_bits(l->end[2]), nb_texel_bits(l->up ? 1 : -1)}};
}

/* A cell that shaders walk through. No eight nodes are as far from the sun as can be. */
static const nebel_texel_u32 flaw = {{UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT32_MAX}};

static nebel_result mark_flaws(const nebel_lighting *lighting, size_t medium, const nb_sun_lattice *l,
                               nebel_texel_u32 *texel)
{
    const size_t count = cells_of(l, 0) * cells_of(l, 1) * cells_of(l, 2);
    const nb_lattice_demand demand = {extinction_of(lighting, medium), PLACE_TOLERANCE};
    if (demand.extinction * l->step * UINT16_MAX < demand.tolerance) return NEBEL_OK; /* dims nothing */
    uint8_t *const flawed = nb_allocate(&lighting->allocator, count, sizeof *flawed);
    const int is_known = flawed != NULL && nb_sun_lattice_find_flaws(l, &demand, flawed);
    for (size_t i = 0; is_known && i < count; i++)
        if (flawed[i]) texel[i] = flaw;
    nb_release(&lighting->allocator, flawed);
    return is_known ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

/* Returns the texel behind the last. */
static nebel_texel_u32 *pack_sun_lattice(const nb_sun_lattice *l, nebel_texel_u32 *texel)
{
    const size_t row = (size_t)l->count[0], layer = row * (size_t)l->count[1];
    pack_lattice_head(l, texel);
    texel += NB_SUN_LATTICE_TEXELS;
    for (size_t k = 0; k < cells_of(l, 2); k++)
        for (size_t j = 0; j < cells_of(l, 1); j++)
            for (size_t i = 0; i < cells_of(l, 0); i++, texel++)
                for (size_t n = 0; n < 4; n++) {
                    const uint16_t *node = &l->amount[(k + n / 2) * layer + (j + n % 2) * row + i];
                    texel->v[n] = node[0] | (uint32_t)node[1] << 16;
                }
    return texel;
}

nebel_result nb_pack_sun_lattices(const nebel_lighting *lighting, size_t room, nebel_texel_u32 *texels)
{
    for (size_t i = next_lattice(lighting, 0); i < lighting->snapshot->medium_count;
         i = next_lattice(lighting, i + 1)) {
        double way[3];
        nb_way_in_cells(lighting, &lighting->snapshot->media[i].body, way);
        nb_sun_lattice *lattice =
            nb_sun_lattice_make(nb_grid_of_medium(lighting, i), &lighting->allocator, way, limit_of(lighting, i, room));
        nebel_result result = lattice != NULL ? NEBEL_OK : NEBEL_ERROR_MEMORY;
        if (result == NEBEL_OK) {
            nebel_texel_u32 *const cells = texels + NB_SUN_LATTICE_TEXELS;
            texels = pack_sun_lattice(lattice, texels);
            result = mark_flaws(lighting, i, lattice, cells);
        }
        nb_sun_lattice_release(lattice);
        if (result != NEBEL_OK) return nb_fail(&lighting->log, result, "pack: out of memory for light in voxels");
    }
    return NEBEL_OK;
}
