/* What fog makes of the sun's light after it has scattered it once, and what it takes from ambient light: from a fog to the
 * numbers at a lattice's nodes. */
#include "diffusion.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI 3.14159265358979323846

/* Nodes whose sunlight is asked for at once. */
enum { BATCH = 256 };

/* ---- sunlight at the nodes ------------------------------------------------------------------- */

/* `lighting` of the fog, or NULL. */
static nebel_result trace_sun(const nb_diffusion *d, const nebel_snapshot *fog, const nebel_lighting *lighting,
                              size_t first, size_t count, float out[3][BATCH])
{
    const nb_diffusion_lattice *l = &d->lattice;
    float offset[3][BATCH];
    nebel_ray_planes rays = {.t_max = NULL};
    nebel_transfer_planes transfers = {.error = NULL};
    for (int a = 0; a < 3; a++) {
        rays.origin[a] = l->low[a] + (l->high[a] - l->low[a]) / 2;
        rays.direction[a] = d->to_sun[a];
        rays.offset[a] = offset[a];
        transfers.transmittance[a] = out[a];
    }
    for (size_t i = 0; i < count; i++) {
        double place[3];
        nb_diffusion_lattice_node(l, first + i, place);
        for (int a = 0; a < 3; a++) offset[a][i] = (float)(place[a] - rays.origin[a]);
    }
    const nebel_trace_desc desc = {.lighting = lighting, .ignore_distances = 1};
    return nebel_trace_planes(fog, &desc, count, &rays, &transfers);
}

static nebel_result light_nodes(const nb_diffusion *d, const nebel_lighting *lighting, nb_node_sun *sun)
{
    const size_t count = nb_diffusion_lattice_nodes(&d->lattice);
    for (size_t first = 0; first < count; first += BATCH) {
        const size_t n = count - first < BATCH ? count - first : BATCH;
        float scaled[3][BATCH], whole[3][BATCH];
        nebel_result result = trace_sun(d, d->scaled, NULL, first, n, scaled);
        if (result == NEBEL_OK && d->has_peaks) result = trace_sun(d, lighting->snapshot, lighting, first, n, whole);
        if (result != NEBEL_OK) return result;
        for (size_t i = 0; i < n; i++) {
            for (int c = 0; c < 3; c++) {
                sun[first + i].scaled[c] = (double)scaled[c][i];
                sun[first + i].whole[c] = d->has_peaks ? (double)whole[c][i] : (double)scaled[c][i];
            }
        }
    }
    return NEBEL_OK;
}

/* ---- sources at the nodes -------------------------------------------------------------------- */

static double share(double part, double whole)
{
    return whole > 0 ? part / whole : 0;
}

double nb_lobe_width(double turned, double n)
{
    const double g = turned > 0 ? turned / (1 - turned) : 0;
    return g > 0 && g < 1 ? nb_exp(n / 2 * nb_log(2 * g / (1 + g))) : 0;
}

/* How often light that went almost straight on did so is a Poisson number that is not 0. */
double nb_glow_width(double turned, double scaled, double whole)
{
    const double mean = whole > 0 ? fmin(nb_log(fmax(scaled / whole, 1)), 50) : 50;
    const double times = mean > 1e-6 ? mean / nb_one_minus_exp(mean) : 1;
    return nb_lobe_width(turned, times + 1);
}

/* Where there is no light the least that is told. */
static double log_of(double light)
{
    return nb_log(fmax(light, 1e-30));
}

/* `light`: fluence and flux. */
static void set_node(const nb_medium_transport *t, int c, const nb_node_sun *sun, const double light[4], float *out)
{
    const double scaled = t->extinction[c] - t->scattering[c] + t->turned[c];
    const double turned = share(t->turned[c], scaled), cosine = share(t->forward[c], t->turned[c]);
    const double ahead = share(t->scattering[c] - t->turned[c], t->extinction[c]);
    const double straight = fmax(sun->scaled[c] - sun->whole[c], 0);
    out[NB_NODE_DIFFUSE] = (float)(turned * light[0] / (4 * PI));
    for (int a = 0; a < 3; a++) out[NB_NODE_FLUX + a] = (float)(cosine * turned * light[1 + a] / (4 * PI));
    out[NB_NODE_TURNED] = (float)log_of(turned * sun->scaled[c]);
    out[NB_NODE_ONCE] = (float)log_of(share(t->turned[c], t->extinction[c]) * sun->whole[c]);
    out[NB_NODE_GLOW] = (float)(ahead * straight);
    out[NB_NODE_WIDTH] = (float)nb_glow_width(cosine, sun->scaled[c], sun->whole[c]);
}

/* `light`: fluence and flux of what the sky lacks. What goes straight on dims no light: of that, the sky's own light is what
 * comes instead of what extinction as it is takes away. Nodes without fog say nothing of the sky. */
static void set_sky_node(const nb_medium_transport *t, int c, const nb_environment_moments *sky, const double light[4],
                         float *out)
{
    const double scaled = t->extinction[c] - t->scattering[c] + t->turned[c];
    const double absorption = fmax(t->extinction[c] - t->scattering[c], 0);
    const double transport = fmax(scaled - t->forward[c], 0);
    const double turned = share(t->turned[c], scaled), forward = share(t->forward[c], scaled), linear = 3 / (4 * PI);
    out[NB_NODE_DIMMED] = (float)(turned * light[0] / (4 * PI) + share(absorption, scaled));
    out[NB_NODE_ABSORBED] = (float)share(absorption, t->extinction[c]);
    for (int a = 0; a < 3; a++) {
        const double even = linear * sky->flux[a];
        out[NB_NODE_DIMMED + 1 + a] = (float)(linear * forward * light[1 + a] + share(transport, scaled) * even);
        out[NB_NODE_ABSORBED + 1 + a] = (float)(share(transport, t->extinction[c]) * even);
    }
}

static void set_moments(double part, double cosine, const double light[4], float out[4])
{
    for (int k = 0; k < 4; k++) out[k] = (float)(part * (k == 0 ? 1 : cosine) / (4 * PI) * light[k]);
}

/* `light`: fluence and flux. */
static void set_own_node(const nb_medium_transport *t, int c, const nb_local_node *own, const double light[4],
                         float *out, float *straight)
{
    const double scaled = t->extinction[c] - t->scattering[c] + t->turned[c];
    const double turned = share(t->turned[c], scaled), cosine = share(t->forward[c], t->turned[c]);
    set_moments(turned, cosine, light, &out[NB_NODE_DIFFUSE]);
    set_moments(turned, cosine, own->scaled[c], &straight[NB_NODE_OWN_TURNED]);
    set_moments(share(t->turned[c], t->extinction[c]), cosine, own->whole[c], &straight[NB_NODE_OWN_ONCE]);
    set_moments(share(t->scattering[c] - t->turned[c], t->extinction[c]), 1, own->glow[c], &straight[NB_NODE_OWN_GLOW]);
}

/* Of what is turned, in all channels. */
static double mean_cosine(const nb_medium_transport *t)
{
    return share(t->forward[0] + t->forward[1] + t->forward[2], t->turned[0] + t->turned[1] + t->turned[2]);
}

static int has_colour(const nebel_snapshot *snapshot, const nebel_diffusion_desc *desc)
{
    const double *ground = desc->ground_albedo;
    if (desc->has_ground && (ground[0] != ground[1] || ground[1] != ground[2])) return 1;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const double *albedo = snapshot->media[i].body.albedo;
        if (albedo[0] != albedo[1] || albedo[1] != albedo[2]) return 1;
    }
    return !snapshot->is_gray;
}

static int find_has_colour(const nb_diffusion *d, const nebel_lighting *lighting)
{
    if (has_colour(lighting->snapshot, &lighting->diffusion_desc)) return 1;
    if (d->has_sky && nb_environment_has_colour(&lighting->environment)) return 1;
    return d->is_own && nb_find_own_light(lighting).has_colour;
}

static int has_peaks(const nebel_snapshot *snapshot)
{
    int has = 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) has |= snapshot->media[i].ahead > 0;
    return has;
}

/* Scratch of a solution. */
typedef struct nb_diffusion_builder {
    nb_medium_transport *cells;
    nb_node_sun *sun;
    nb_diffuse_light light[3], sky;
} nb_diffusion_builder;

static nebel_result fill_sun(nb_diffusion *d, const nebel_lighting *lighting, nb_diffusion_builder *made)
{
    const size_t nodes = nb_diffusion_lattice_nodes(&d->lattice);
    const nb_diffuse_source source = {.sun = made->sun, .to_sun = d->to_sun};
    const nebel_result result = light_nodes(d, lighting, made->sun);
    for (int c = 0; c < d->channel_count && result == NEBEL_OK; c++) {
        if (!nb_diffusion_solve(&lighting->allocator, &d->lattice, made->cells, &source,
                                lighting->diffusion_desc.ground_albedo[c], c, &made->light[c]))
            return NEBEL_ERROR_MEMORY;
        for (size_t i = 0; i < nodes; i++) {
            const nb_medium_transport t = nb_diffusion_lattice_around(&d->lattice, made->cells, i);
            float *node = &d->nodes[i * d->node_numbers];
            set_node(&t, c, &made->sun[i], &made->light[c].nodes[4 * i], node + c * NB_NODE_NUMBERS);
            node[NB_NODE_NUMBERS * d->channel_count] = (float)mean_cosine(&t);
        }
    }
    return result;
}

static nebel_result fill_sky(nb_diffusion *d, const nebel_lighting *lighting, nb_diffusion_builder *made)
{
    const size_t nodes = nb_diffusion_lattice_nodes(&d->lattice);
    nb_environment_moments moments[3];
    nb_environment_find_moments(&lighting->environment, d->skylight, moments);
    for (int c = 0; c < d->channel_count; c++) {
        const nb_diffuse_source source = {.sky = moments[c]};
        if (!nb_diffusion_solve(&lighting->allocator, &d->lattice, made->cells, &source,
                                lighting->diffusion_desc.ground_albedo[c], c, &made->sky))
            return NEBEL_ERROR_MEMORY;
        for (size_t i = 0; i < nodes; i++) {
            const nb_medium_transport t = nb_diffusion_lattice_around(&d->lattice, made->cells, i);
            float *node = &d->nodes[i * d->node_numbers + nb_diffusion_second_number(d, c)];
            set_sky_node(&t, c, &moments[c], &made->sky.nodes[4 * i], node);
        }
    }
    return NEBEL_OK;
}

/* Where nothing goes straight on the exact light has all of point lights' that was scattered once. */
static void forget_exact_light(const nb_diffusion *d)
{
    const size_t all = d->has_peaks ? 0 : nb_diffusion_lattice_nodes(&d->lattice) * (size_t)d->channel_count;
    for (size_t i = 0; i < all; i++) {
        const size_t node = i / (size_t)d->channel_count, channel = i % (size_t)d->channel_count;
        float *straight = &d->nodes[node * d->node_numbers + nb_diffusion_second_number(d, (int)channel)];
        for (int k = 0; k < 4; k++) {
            straight[NB_NODE_OWN_TURNED + k] -= straight[NB_NODE_OWN_ONCE + k];
            straight[NB_NODE_OWN_ONCE + k] = 0;
        }
    }
}

static nebel_result solve_own(nb_diffusion *d, const nebel_lighting *lighting, const nb_local_light *own,
                              const nb_light_beams *beams, nb_local_node *straight, nb_diffusion_builder *made)
{
    const size_t nodes = nb_diffusion_lattice_nodes(&d->lattice);
    const nb_diffuse_source source = {.beams = beams};
    for (int c = 0; c < d->channel_count; c++) {
        nb_cast_beams(&d->lattice, lighting, made->cells, c, own, beams);
        nb_light_nodes_by_cells(&d->lattice, made->cells, beams, c, straight);
        if (!nb_diffusion_solve(&lighting->allocator, &d->lattice, made->cells, &source,
                                lighting->diffusion_desc.ground_albedo[c], c, &made->light[c]))
            return NEBEL_ERROR_MEMORY;
        for (size_t i = 0; i < nodes; i++) {
            const nb_medium_transport t = nb_diffusion_lattice_around(&d->lattice, made->cells, i);
            float *node = &d->nodes[i * d->node_numbers];
            set_own_node(&t, c, &straight[i], &made->light[c].nodes[4 * i], node + c * NB_NODE_NUMBERS,
                         node + nb_diffusion_second_number(d, c));
            node[NB_NODE_NUMBERS * d->channel_count] = (float)mean_cosine(&t);
        }
    }
    return NEBEL_OK;
}

static nebel_result fill_own(nb_diffusion *d, const nebel_lighting *lighting, nb_diffusion_builder *made)
{
    const nebel_allocator *allocator = &lighting->allocator;
    const nb_local_light own = nb_find_own_light(lighting);
    nb_local_node *straight = nb_allocate_zero(allocator, nb_diffusion_lattice_nodes(&d->lattice), sizeof *straight);
    nb_light_beams beams;
    const int all = nb_beams_open(allocator, &d->lattice, &beams) && straight != NULL;
    nebel_result result = all ? NEBEL_OK : NEBEL_ERROR_MEMORY;
    memcpy(d->irradiance, own.unit, sizeof d->irradiance);
    if (all) result = nb_light_nodes_by_point_lights(d, lighting, made->cells, &own, straight);
    if (result == NEBEL_OK) result = solve_own(d, lighting, &own, &beams, straight, made);
    if (result == NEBEL_OK) result = nb_diffusion_balance(lighting, d, made->light);
    if (result == NEBEL_OK) forget_exact_light(d);
    nb_beams_close(allocator, &beams);
    nb_release(allocator, straight);
    return result;
}

static nebel_result fill(nb_diffusion *d, const nebel_lighting *lighting, nb_diffusion_builder *made)
{
    nebel_result result = NEBEL_OK;
    nb_diffusion_lattice_mean(&d->lattice, lighting->snapshot, made->cells);
    if (d->has_sun) result = fill_sun(d, lighting, made);
    if (result == NEBEL_OK && d->has_sky) result = fill_sky(d, lighting, made);
    if (result == NEBEL_OK && d->is_own) result = fill_own(d, lighting, made);
    if (result == NEBEL_OK && d->has_sun) result = nb_diffusion_balance(lighting, d, made->light);
    return result;
}

static nebel_result solve(nb_diffusion *d, const nebel_lighting *lighting)
{
    const nebel_allocator *allocator = &lighting->allocator;
    const size_t nodes = nb_diffusion_lattice_nodes(&d->lattice);
    nb_diffusion_builder made = {
        .cells = nb_allocate(allocator, nb_diffusion_lattice_cells(&d->lattice), sizeof *made.cells),
        .sun = nb_allocate(allocator, nodes, sizeof *made.sun)};
    double *light = nb_allocate(allocator, nodes, 4 * sizeof *light);
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (int c = 0; c < 3; c++) made.light[c].nodes = light;
    made.sky.nodes = light;
    d->nodes = nb_allocate_zero(allocator, nodes, d->node_numbers * sizeof *d->nodes);
    if (made.cells != NULL && made.sun != NULL && light != NULL && d->nodes != NULL) result = fill(d, lighting, &made);
    nb_release(allocator, made.cells);
    nb_release(allocator, made.sun);
    nb_release(allocator, light);
    return result;
}

nebel_result nb_diffusion_make(const nebel_lighting *lighting, nebel_snapshot *scaled, int is_own, nb_diffusion **made)
{
    nb_diffusion_lattice lattice;
    int lit;
    *made = NULL;
    nebel_result result = nb_diffusion_lattice_place(lighting, scaled, is_own, &lattice, &lit);
    if (result != NEBEL_OK || !lit) return result;
    nb_diffusion *d = nb_allocate_zero(&lighting->allocator, 1, sizeof *d);
    if (d == NULL) return NEBEL_ERROR_MEMORY;
    d->lattice = lattice;
    d->scaled = nebel_retain_snapshot(scaled);
    d->has_peaks = has_peaks(lighting->snapshot);
    d->has_sun = !is_own && lighting->scatters_sun;
    d->has_sky = !is_own && nb_environment_is_dimmed(lighting);
    d->is_own = is_own;
    d->channel_count = find_has_colour(d, lighting) ? 3 : 1;
    d->node_numbers = nb_diffusion_second_number(d, nb_diffusion_has_second(d) ? d->channel_count : 0);
    memcpy(d->to_sun, lighting->to_sun, sizeof d->to_sun);
    memcpy(d->irradiance, lighting->irradiance, sizeof d->irradiance); /* own light says otherwise */
    result = solve(d, lighting);
    if (result == NEBEL_OK)
        *made = d;
    else
        nb_diffusion_free(&lighting->allocator, d);
    return result;
}

void nb_diffusion_free(const nebel_allocator *allocator, nb_diffusion *diffusion)
{
    if (diffusion == NULL) return;
    nb_diffusion_free(allocator, diffusion->beside);
    nebel_release_snapshot(diffusion->scaled);
    nb_release(allocator, diffusion->nodes);
    nb_release(allocator, diffusion);
}
