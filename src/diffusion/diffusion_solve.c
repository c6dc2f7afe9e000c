/* One channel's diffuse light on a lattice: finite volumes, solved by conjugate gradients.
 *
 * With fluence phi and flux F of light that was scattered, extinction s, what is turned of it w with mean cosine g, the
 * sun's irradiance E along d behind fog that takes s:
 *
 *     div F + (s - w) phi = w E        phi' / 3 + (s - g w) F = g w E d
 *
 * At an open end no diffuse light comes in, phi / 4 = F.n / 2 (Marshak). Of what ground of an albedo a receives, that
 * part comes back as phi / 4 - F.n / 2.
 *
 * Ambient light of mean radiance 1 and flux A that nothing dims fulfils none of that where fog absorbs, or where it is not
 * the same from everywhere. What it has too much does, and none of it comes in at an open end:
 *
 *     div F + (s - w) phi = 4 pi (s - w)        phi' / 3 + (s - g w) F = (s - g w) A
 *
 * so that white fog under a white sky lacks nothing, exactly.
 *
 * Own light has the sun's equations, with its fluence and flux on straight ways for E and E d.
 */
#include "diffusion.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* The squared residual that ends the iteration, relative to that at its beginning; a limit that no lattice needs. */
#define RESIDUAL 1e-14
enum { MOST_STEPS = 20000 };

/* A cell without fog is no vacuum but carries light, as far as diffusion can, about as freely as light travels, in terms
 * of the lattice's least extent; and light gets lost there on its way out, so that not all of it creeps around a body to
 * the dark side. D phi'' = k phi with 4 D k = 1 has the flux phi / 2 outwards at every place, as Marshak's condition and
 * so the lattice's ends have: right for a lone ball, but clouds light each other across gaps. Half of that k is between
 * both. Fog that is thinner than this part of the mean counts as none. */
#define CLEAR_WAY 0.06
#define CLEAR_DENSITY 0.1

/* That of half a cell of transport depth 4. */
#define MOST_RESISTANCE 6

typedef struct faces {
    double *conductance; /* between the cells at both sides, times the face's area; of ends: what leaves, by phi */
    double *drive;       /* flux along the axis where fluence is even; of ends: outwards, where it is 0 */
} faces;

typedef struct solver {
    const nb_diffusion_lattice *lattice;
    const nb_diffuse_source *source;
    double ground_albedo;
    int channel;
    size_t cell_count;
    double area[3];
    double *diffusivity, *ahead; /* of cells: 1 / (3 transport extinction); g w over it, of the sky all of it over it */
    double *lost;                /* of cells: what goes away where there is no fog, by phi [1/m] */
    double *diagonal, *phi, *residual, *way, *product;
    faces faces[3];
} solver;

/* ---- places of numbers ----------------------------------------------------------------------- */

typedef struct index3 {
    uint32_t at[3];
} index3;

static size_t index_in(const index3 *i, size_t nx, size_t ny)
{
    return i->at[0] + nx * (i->at[1] + ny * (size_t)i->at[2]);
}

static size_t cell_index(const nb_diffusion_lattice *l, const index3 *i)
{
    return index_in(i, l->size[0], l->size[1]);
}

/* The face at the low side of where a cell is, or would be. */
static size_t face_index(const nb_diffusion_lattice *l, int axis, const index3 *i)
{
    return index_in(i, l->size[0] + (axis == 0 ? 1u : 0u), l->size[1] + (axis == 1 ? 1u : 0u));
}

static size_t node_index(const nb_diffusion_lattice *l, const index3 *i)
{
    return index_in(i, l->size[0] + 1u, l->size[1] + 1u);
}

/* The next one of a box of so many; 0 after the last. */
static int step(index3 *i, const uint32_t size[3])
{
    for (int a = 0; a < 3; a++) {
        if (++i->at[a] < size[a]) return 1;
        i->at[a] = 0;
    }
    return 0;
}

static index3 shifted(const index3 *i, int axis, int by)
{
    index3 moved = *i;
    moved.at[axis] = (uint32_t)((int)moved.at[axis] + by);
    return moved;
}

/* ---- the equations --------------------------------------------------------------------------- */

/* Light of the source through a face, along the axis, per area. */
static double beam_through(const solver *s, int axis, const index3 *face)
{
    double sum = 0;
    if (nb_source_is_sky(s->source)) return s->source->sky.flux[axis];
    if (s->source->beams != NULL)
        return s->source->beams->through[axis][face_index(s->lattice, axis, face)] / s->area[axis];
    for (int k = 0; k < 4; k++) {
        index3 node = *face;
        node.at[(axis + 1) % 3] += (uint32_t)k & 1u;
        node.at[(axis + 2) % 3] += (uint32_t)k >> 1;
        sum += s->source->sun[node_index(s->lattice, &node)].scaled[s->channel];
    }
    return -s->source->to_sun[axis] * sum / 4;
}

/* Of half a cell, against flux along an axis: what fluence falls by per flux. Where a cell is very thick, light is in a
 * part of it that the lattice does not see, and the middle says nothing of what leaves. */
static double resistance(const solver *s, int axis, size_t cell)
{
    return fmin(s->lattice->spacing[axis] / (2 * s->diffusivity[cell]), MOST_RESISTANCE);
}

static void join_cells(solver *s, int axis, const index3 *face)
{
    const nb_diffusion_lattice *l = s->lattice;
    const index3 before = shifted(face, axis, -1);
    const size_t f = face_index(l, axis, face), low = cell_index(l, &before), high = cell_index(l, face);
    const double resist_low = resistance(s, axis, low), resist_high = resistance(s, axis, high);
    const double resist = resist_low + resist_high;
    const double driven = s->ahead[low] * resist_low + s->ahead[high] * resist_high;
    s->faces[axis].conductance[f] = s->area[axis] / resist;
    s->faces[axis].drive[f] = s->area[axis] * beam_through(s, axis, face) * driven / resist;
}

/* What goes up from the ground of what the source sends down, per area; of the sky what comes from below without ground, less
 * that. */
static double returned_by_ground(const solver *s, double beam)
{
    const nb_environment_moments *sky = &s->source->sky;
    return nb_source_is_sky(s->source) ? sky->below - s->ground_albedo * sky->above : s->ground_albedo * fmax(beam, 0);
}

/* At an end the flux outwards is part * phi - returned. */
static void end_cells(solver *s, int axis, int side, const index3 *face)
{
    const nb_diffusion_lattice *l = s->lattice;
    const nb_diffusion_lattice_end end = l->ends[axis][side];
    const index3 within = shifted(face, axis, -side);
    const size_t f = face_index(l, axis, face), cell = cell_index(l, &within);
    const double beam = (side ? 1 : -1) * beam_through(s, axis, face), drive = s->ahead[cell] * beam;
    const double open = 1 / resistance(s, axis, cell), a = s->ground_albedo;
    const double part = end == NB_END_GROUND ? (1 - a) / (2 * (1 + a)) : 0.5;
    const double returned = end == NB_END_GROUND ? 2 * returned_by_ground(s, beam) / (1 + a) : 0;
    const int level = end == NB_END_LEVEL;
    s->faces[axis].conductance[f] = level ? 0 : s->area[axis] * open * part / (part + open);
    s->faces[axis].drive[f] = s->area[axis] * (level ? drive : (part * drive - open * returned) / (part + open));
}

static void set_faces(solver *s)
{
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t n = s->lattice->size[axis];
        uint32_t size[3];
        memcpy(size, s->lattice->size, sizeof size);
        size[axis]++;
        index3 face = {{0, 0, 0}};
        do {
            if (face.at[axis] == 0)
                end_cells(s, axis, 0, &face);
            else if (face.at[axis] == n)
                end_cells(s, axis, 1, &face);
            else
                join_cells(s, axis, &face);
        } while (step(&face, size));
    }
}

/* What flows out through the six faces, of which `drive` is the part that phi has nothing to do with. */
static double outflow(const solver *s, const index3 *cell)
{
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        const index3 next = shifted(cell, axis, 1);
        const double low = s->faces[axis].drive[face_index(s->lattice, axis, cell)];
        const double high = s->faces[axis].drive[face_index(s->lattice, axis, &next)];
        sum += high + (cell->at[axis] == 0 ? low : -low);
    }
    return sum;
}

/* What fog takes from light on its straight way in a cell; from sunlight, by what goes in and out: exact however thick it is. */
static double taken_from_beam(const solver *s, const index3 *cell)
{
    double sum = 0;
    if (s->source->beams != NULL) return s->source->beams->taken[cell_index(s->lattice, cell)];
    for (int axis = 0; axis < 3; axis++) {
        const index3 next = shifted(cell, axis, 1);
        sum += s->area[axis] * (beam_through(s, axis, cell) - beam_through(s, axis, &next));
    }
    return fmax(sum, 0);
}

/* Extinction after scaling, in one channel. */
static double scaled_extinction(const nb_medium_transport *t, int channel)
{
    return fmax(t->extinction[channel] - (t->scattering[channel] - t->turned[channel]), 0);
}

static void set_cells(solver *s, const nb_medium_transport *cells)
{
    const nb_diffusion_lattice *l = s->lattice;
    const int c = s->channel;
    double mean = 0, least = HUGE_VAL;
    for (size_t i = 0; i < s->cell_count; i++)
        mean += (scaled_extinction(&cells[i], c) - cells[i].forward[c]) / (double)s->cell_count;
    for (int a = 0; a < 3; a++) least = fmin(least, l->ends[a][0] == NB_END_LEVEL ? HUGE_VAL : l->high[a] - l->low[a]);
    /* Level fog has no corners. */
    if (l->ends[0][0] == NB_END_LEVEL || l->ends[2][0] == NB_END_LEVEL) least = HUGE_VAL;
    for (size_t i = 0; i < s->cell_count; i++) {
        const double transport = scaled_extinction(&cells[i], c) - cells[i].forward[c];
        const double clear = mean > 0 ? fmax(1 - transport / (CLEAR_DENSITY * mean), 0) : 1;
        const double resisting = transport + clear / (3 * CLEAR_WAY * least);
        s->diffusivity[i] = 1 / (3 * fmax(resisting, 1e-12));
        s->ahead[i] = (nb_source_is_sky(s->source) ? transport : cells[i].forward[c]) / fmax(resisting, 1e-12);
        s->lost[i] = clear / (8 * CLEAR_WAY * least);
    }
}

/* The diagonal, and the right side in `residual`. */
static void set_balance(solver *s, const nb_medium_transport *cells)
{
    const nb_diffusion_lattice *l = s->lattice;
    const double volume = l->spacing[0] * l->spacing[1] * l->spacing[2];
    const int c = s->channel;
    index3 cell = {{0, 0, 0}};
    do {
        const size_t i = cell_index(l, &cell);
        const double extinction = scaled_extinction(&cells[i], c);
        const double turned = extinction > 0 ? cells[i].turned[c] / extinction : 0;
        const double absorption = fmax(cells[i].extinction[c] - cells[i].scattering[c], 0);
        const double begun =
            nb_source_is_sky(s->source) ? volume * absorption * (4 * PI) : turned * taken_from_beam(s, &cell);
        s->diagonal[i] = volume * (absorption + s->lost[i]);
        for (int axis = 0; axis < 3; axis++) {
            const index3 next = shifted(&cell, axis, 1);
            s->diagonal[i] += s->faces[axis].conductance[face_index(l, axis, &cell)] +
                              s->faces[axis].conductance[face_index(l, axis, &next)];
        }
        s->residual[i] = begun - outflow(s, &cell);
    } while (step(&cell, l->size));
}

/* ---- conjugate gradients, preconditioned by the diagonal ------------------------------------- */

static void subtract_neighbours(const solver *s, int axis, const double *x, double *out)
{
    const nb_diffusion_lattice *l = s->lattice;
    const size_t stride = axis == 0 ? 1 : axis == 1 ? l->size[0] : (size_t)l->size[0] * l->size[1];
    uint32_t size[3];
    memcpy(size, l->size, sizeof size);
    size[axis]--;
    if (size[axis] == 0) return;
    index3 cell = {{0, 0, 0}};
    do {
        const index3 next = shifted(&cell, axis, 1);
        const double k = s->faces[axis].conductance[face_index(l, axis, &next)];
        const size_t i = cell_index(l, &cell);
        out[i] -= k * x[i + stride];
        out[i + stride] -= k * x[i];
    } while (step(&cell, size));
}

static void multiply(const solver *s, const double *x, double *out)
{
    for (size_t i = 0; i < s->cell_count; i++) out[i] = s->diagonal[i] * x[i];
    for (int axis = 0; axis < 3; axis++) subtract_neighbours(s, axis, x, out);
}

/* The sum of a b, or of a a / b. */
static double dot(const solver *s, const double *a, const double *b)
{
    double sum = 0;
    for (size_t i = 0; i < s->cell_count; i++) sum += a[i] * b[i];
    return sum;
}

static double weigh(const solver *s)
{
    double sum = 0;
    for (size_t i = 0; i < s->cell_count; i++) sum += s->residual[i] * s->residual[i] / s->diagonal[i];
    return sum;
}

static void find_fluence(solver *s)
{
    const size_t n = s->cell_count;
    memset(s->phi, 0, n * sizeof *s->phi);
    for (size_t i = 0; i < n; i++) s->way[i] = s->residual[i] / s->diagonal[i];
    double weight = weigh(s);
    const double enough = RESIDUAL * weight;
    for (int k = 0; k < MOST_STEPS && weight > enough; k++) {
        multiply(s, s->way, s->product);
        const double far = weight / dot(s, s->way, s->product);
        for (size_t i = 0; i < n; i++) {
            s->phi[i] += far * s->way[i];
            s->residual[i] -= far * s->product[i];
        }
        const double left = weigh(s), again = left / weight;
        for (size_t i = 0; i < n; i++) s->way[i] = s->residual[i] / s->diagonal[i] + again * s->way[i];
        weight = left;
    }
}

/* ---- from cells to nodes --------------------------------------------------------------------- */

/* Per area, along the axis. */
static double flux_through(const solver *s, int axis, const index3 *face)
{
    const nb_diffusion_lattice *l = s->lattice;
    const size_t f = face_index(l, axis, face);
    const double k = s->faces[axis].conductance[f], drive = s->faces[axis].drive[f];
    const index3 before = shifted(face, axis, -1);
    if (face->at[axis] == 0) return -(drive + k * s->phi[cell_index(l, face)]) / s->area[axis];
    const double low = s->phi[cell_index(l, &before)];
    const double high = face->at[axis] < l->size[axis] ? s->phi[cell_index(l, face)] : 0;
    return (drive + k * (low - high)) / s->area[axis];
}

/* At an end of the lattice, from the half cell before it. */
static double fluence_at_end(const solver *s, int axis, int side, const index3 *face)
{
    const nb_diffusion_lattice *l = s->lattice;
    const index3 within = shifted(face, axis, -side);
    const size_t cell = cell_index(l, &within);
    const double sign = side ? 1 : -1;
    if (l->ends[axis][side] == NB_END_LEVEL) return s->phi[cell];
    const double gain = sign * (s->ahead[cell] * beam_through(s, axis, face) - flux_through(s, axis, face));
    return s->phi[cell] + gain * resistance(s, axis, cell);
}

/* The cells around a node, two along each axis, or the one at an end twice. */
static index3 cell_beside(const nb_diffusion_lattice *l, const index3 *node, int octant)
{
    index3 cell = *node;
    for (int a = 0; a < 3; a++) {
        const uint32_t up = (uint32_t)octant >> a & 1u;
        if (up == 0 && cell.at[a] > 0) cell.at[a]--;
        if (cell.at[a] == l->size[a]) cell.at[a]--;
    }
    return cell;
}

static int end_of(const nb_diffusion_lattice *l, const index3 *node, int axis)
{
    return node->at[axis] == 0 ? 0 : node->at[axis] == l->size[axis] ? 1 : -1;
}

static double fluence_at(const solver *s, const index3 *node)
{
    const nb_diffusion_lattice *l = s->lattice;
    double sum = 0;
    int count = 0;
    for (int octant = 0; octant < 8; octant++) {
        const index3 cell = cell_beside(l, node, octant);
        int ends = 0;
        for (int axis = 0; axis < 3; axis++) {
            const int side = end_of(l, node, axis);
            if (side < 0 || l->ends[axis][side] == NB_END_LEVEL) continue;
            const index3 face = shifted(&cell, axis, side);
            sum += fluence_at_end(s, axis, side, &face);
            ends++;
        }
        if (ends == 0) sum += s->phi[cell_index(l, &cell)];
        count += ends > 0 ? ends : 1;
    }
    return sum / count;
}

static double flux_at(const solver *s, int axis, const index3 *node)
{
    double sum = 0;
    for (int octant = 0; octant < 8; octant++) {
        index3 face = cell_beside(s->lattice, node, octant);
        face.at[axis] = node->at[axis];
        sum += flux_through(s, axis, &face);
    }
    return sum / 8;
}

static void set_leaving(const solver *s, nb_diffuse_light *light)
{
    const nb_diffusion_lattice *l = s->lattice;
    for (int axis = 0; axis < 3; axis++) {
        uint32_t size[3];
        memcpy(size, l->size, sizeof size);
        size[axis] = 1;
        for (uint32_t side = 0; side < 2; side++) {
            double sum = 0;
            index3 face = {{0, 0, 0}};
            do {
                index3 moved = face;
                moved.at[axis] = side * l->size[axis];
                sum += (side ? 1 : -1) * s->area[axis] * flux_through(s, axis, &moved);
            } while (step(&face, size));
            light->leaving[axis][side] = sum;
        }
    }
}

static double find_lost(const solver *s)
{
    const nb_diffusion_lattice *l = s->lattice;
    double sum = 0;
    for (size_t i = 0; i < s->cell_count; i++) sum += s->lost[i] * s->phi[i];
    return sum * l->spacing[0] * l->spacing[1] * l->spacing[2];
}

static void set_nodes(const solver *s, double *light)
{
    const nb_diffusion_lattice *l = s->lattice;
    const uint32_t size[3] = {l->size[0] + 1, l->size[1] + 1, l->size[2] + 1};
    index3 node = {{0, 0, 0}};
    do {
        double *out = &light[4 * node_index(l, &node)];
        const double fluence = fluence_at(s, &node);
        out[0] = nb_source_is_sky(s->source) ? fluence : fmax(fluence, 0); /* more light than the sky's is no fault */
        for (int axis = 0; axis < 3; axis++) out[1 + axis] = flux_at(s, axis, &node);
    } while (step(&node, size));
}

/* What goes up from the ground: Lambert's, of the flux there. */
static double find_ground(const nb_diffusion_lattice *l, const double *nodes)
{
    const size_t nx = l->size[0] + 1u, nz = l->size[2] + 1u;
    double sum = 0;
    if (l->ends[1][0] != NB_END_GROUND) return 0;
    for (size_t i = 0; i < nx * nz; i++) {
        const double *node = &nodes[4 * (i % nx + nx * (l->size[1] + 1u) * (i / nx))];
        sum += fmax(node[0] / 4 + node[2] / 2, 0) / PI;
    }
    return sum / (double)(nx * nz);
}

/* ---- all together ---------------------------------------------------------------------------- */

static int allocate(const nebel_allocator *allocator, solver *s)
{
    double **const of_cells[] = {&s->diffusivity, &s->ahead,    &s->lost, &s->diagonal,
                                 &s->phi,         &s->residual, &s->way,  &s->product};
    int all = 1;
    for (size_t i = 0; i < sizeof of_cells / sizeof *of_cells; i++) {
        *of_cells[i] = nb_allocate(allocator, s->cell_count, sizeof(double));
        all = all && *of_cells[i] != NULL;
    }
    for (int a = 0; a < 3; a++) {
        const size_t n = nb_diffusion_lattice_faces(s->lattice, a);
        s->faces[a] = (faces){nb_allocate(allocator, n, sizeof(double)), nb_allocate(allocator, n, sizeof(double))};
        all = all && s->faces[a].conductance != NULL && s->faces[a].drive != NULL;
    }
    return all;
}

static void release(const nebel_allocator *allocator, const solver *s)
{
    double *const of_cells[] = {s->diffusivity, s->ahead,    s->lost, s->diagonal,
                                s->phi,         s->residual, s->way,  s->product};
    for (size_t i = 0; i < sizeof of_cells / sizeof *of_cells; i++) nb_release(allocator, of_cells[i]);
    for (int a = 0; a < 3; a++) {
        nb_release(allocator, s->faces[a].conductance);
        nb_release(allocator, s->faces[a].drive);
    }
}

int nb_diffusion_solve(const nebel_allocator *allocator, const nb_diffusion_lattice *lattice,
                       const nb_medium_transport *cells, const nb_diffuse_source *source, double ground_albedo,
                       int channel, nb_diffuse_light *light)
{
    solver s = {.lattice = lattice,
                .source = source,
                .ground_albedo = ground_albedo,
                .channel = channel,
                .cell_count = nb_diffusion_lattice_cells(lattice)};
    for (int a = 0; a < 3; a++) s.area[a] = lattice->spacing[(a + 1) % 3] * lattice->spacing[(a + 2) % 3];
    const int all = allocate(allocator, &s);
    if (all) {
        set_cells(&s, cells);
        set_faces(&s);
        set_balance(&s, cells);
        find_fluence(&s);
        set_nodes(&s, light->nodes);
        set_leaving(&s, light);
        light->lost = find_lost(&s);
        light->ground = find_ground(lattice, light->nodes);
    }
    release(allocator, &s);
    return all;
}
