#include "planet_medium.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- directions ------------------------------------------------------------------------------ */

/* Phase functions that are larger straight ahead, 1/sr, count as peaked. */
#define PEAK 2

static void set_turns(nb_turns *turns, const nebel_phase *phase)
{
    turns->phase = *phase;
    turns->is_peaked = nebel_evaluate_phase(phase, 1) > PEAK;
    for (int i = 0; i <= NB_TURNS; i++) turns->cosines[i] = nebel_sample_phase(phase, (double)i / NB_TURNS);
    turns->cosines[0] = -1;
    turns->cosines[NB_TURNS] = 1;
}

/* Parts of light by steps in the angle, which are finer ahead: third powers of evenly spread numbers. */
static void set_drops(nb_turns *turns, const nebel_clouds *clouds, uint32_t layer, int color)
{
    enum { STEPS = 20000 };
    double sum = 0, whole = 0;
    int next = 1;
    turns->clouds = clouds;
    turns->layer = layer;
    turns->color = color;
    turns->is_peaked = nb_turns_value(turns, 1) > PEAK;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < STEPS; i++) {
            const double part = 1 - (i + 0.5) / STEPS, angle = PI * part * part * part, cosine = cos(angle);
            const double light = nb_turns_value(turns, cosine) * sin(angle) * part * part;
            if (pass == 0) whole += light;
            if (pass == 1)
                for (sum += light; next < NB_TURNS && sum >= whole * next / NB_TURNS; next++)
                    turns->cosines[next] = cosine;
        }
    while (next < NB_TURNS) turns->cosines[next++] = 1;
    turns->cosines[0] = -1;
    turns->cosines[NB_TURNS] = 1;
}

double nb_turns_value(const nb_turns *turns, double cosine)
{
    double values[3] = {0, 0, 0};
    if (turns->clouds == NULL) return nebel_evaluate_phase(&turns->phase, cosine);
    /* Cosines and layers are in order, so that it cannot fail. */
    (void)nebel_cloud_phase(turns->clouds, turns->layer, 1, &cosine, &values);
    return values[turns->color];
}

double nb_turns_draw(const nb_turns *turns, double chance)
{
    const double place = chance * NB_TURNS;
    const int i = place < NB_TURNS - 1 ? (int)place : NB_TURNS - 1;
    return fmin(1, turns->cosines[i] + (place - i) * (turns->cosines[i + 1] - turns->cosines[i]));
}

double nb_turns_density(const nb_turns *turns, double cosine)
{
    int low = 0, high = NB_TURNS;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        *(turns->cosines[middle] <= cosine ? &low : &high) = middle;
    }
    return 1 / (2 * PI * NB_TURNS * (turns->cosines[low + 1] - turns->cosines[low]));
}

/* ---- air ------------------------------------------------------------------------------------- */

/* docs/planet.md: e^(-height / scale height), or straight lines from a layer's middle. */
static double density_at(const nebel_atmosphere_component *air, double height)
{
    if (air->profile == NEBEL_COMPONENT_EXPONENTIAL) return exp(-height / air->scale_height);
    return fmax(0, 1 - fabs(height - air->center_height) / air->half_width);
}

/* Between two heights. */
static double most_density(const nebel_atmosphere_component *air, double low, double high)
{
    if (air->profile == NEBEL_COMPONENT_TENT) return density_at(air, fmin(fmax(air->center_height, low), high));
    return density_at(air, low);
}

/* ---- shells ---------------------------------------------------------------------------------- */

static void add_medium_shell(nb_shells *shells, double radius, double top)
{
    int i = shells->count;
    if (!(radius < top) || shells->count == NB_MEDIUM_SHELLS) return;
    for (int k = 0; k < i; k++)
        if (shells->radii[k] == radius) return;
    for (; i > 0 && shells->radii[i - 1] > radius; i--) shells->radii[i] = shells->radii[i - 1];
    shells->radii[i] = radius;
    shells->count++;
}

/* Exponentials fall to a third from one shell to the next; light layers are cut at their edges and within. */
static void cut_air(nb_shells *shells, const nebel_atmosphere_component *air, double ground, double top)
{
    for (int i = 0; i < NB_SHELLS_PER_AIR; i++) {
        const double height = air->profile == NEBEL_COMPONENT_EXPONENTIAL
                                  ? (i + 1) * air->scale_height
                                  : air->center_height + air->half_width * (2. * i / (NB_SHELLS_PER_AIR - 1) - 1);
        if (height > 0) add_medium_shell(shells, ground + height, top);
    }
}

static void cut_clouds(const nb_planet_medium *medium, nb_shells *shells, double top)
{
    for (uint32_t k = 0; k < medium->layer_count; k++) {
        add_medium_shell(shells, medium->world.radius + medium->layers[k].base, top);
        add_medium_shell(shells, medium->world.radius + medium->layers[k].top, top);
    }
}

/* What is below radii[i] and above the shell before. Below the ground all is as on it. */
static void bound_shell(const nb_planet_medium *medium, int with_air, nb_shells *shells, int i)
{
    const nebel_atmosphere_desc *desc = &medium->world.planet->atmosphere_desc;
    const double low = fmax(0, i > 0 ? shells->radii[i - 1] - desc->radius : 0);
    const double high = fmax(0, shells->radii[i] - desc->radius);
    for (uint32_t k = 0; k < desc->component_count && with_air; k++) {
        const double most = most_density(&desc->components[k], low, high);
        for (int c = 0; c < 3; c++)
            shells->air[i][c] += most * (desc->components[k].scattering[c] + desc->components[k].absorption[c]);
    }
    for (uint32_t k = 0; k < medium->layer_count; k++) {
        const double middle = 0.5 * (low + high);
        if (middle > medium->layers[k].base && middle < medium->layers[k].top)
            shells->clouds[i] = medium->layers[k].extinction;
    }
}

/* Bounds hold for what is computed, too. */
#define ROUNDING (1 + 1e-6)

static void end_shells(const nb_planet_medium *medium, double top, int with_air, nb_shells *shells)
{
    shells->radii[shells->count++] = top;
    for (int i = 0; i < shells->count; i++) {
        bound_shell(medium, with_air, shells, i);
        shells->clouds[i] *= ROUNDING;
        for (int c = 0; c < 3; c++) shells->air[i][c] *= ROUNDING;
    }
}

/* Descriptions may leave out what their kind has. They are in order, or the planet would have no clouds. */
static void set_clouds(nb_planet_medium *medium, const nebel_planet *planet)
{
    medium->layer_count = planet->clouds != NULL ? planet->cloud_layer_count : 0;
    for (uint32_t k = 0; k < medium->layer_count; k++) {
        (void)nebel_resolve_cloud_layer(planet->atmosphere_desc.thickness, &planet->cloud_layers[k], NULL,
                                        &medium->layers[k]);
        for (int c = 0; c < 3; c++) set_drops(&medium->drops[k][c], planet->clouds, k, c);
    }
}

void nb_planet_medium_set(nb_planet_medium *medium, const nebel_planet *planet, double time)
{
    const nebel_atmosphere_desc *desc = &planet->atmosphere_desc;
    const double top = desc->radius + desc->thickness;
    memset(medium, 0, sizeof *medium);
    medium->world = nb_planet_of(planet);
    medium->time = time;
    set_clouds(medium, planet);
    add_medium_shell(&medium->shells, desc->radius, top);
    for (uint32_t k = 0; k < desc->component_count; k++) {
        cut_air(&medium->shells, &desc->components[k], desc->radius, top);
        set_turns(&medium->airs[k], &desc->components[k].phase);
    }
    cut_clouds(medium, &medium->shells, top);
    cut_clouds(medium, &medium->sheets, top);
    end_shells(medium, top, 1, &medium->shells);
    end_shells(medium, top, 0, &medium->sheets);
}

int nb_planet_medium_is_grey(const nb_planet_medium *medium)
{
    for (uint32_t k = 0; k < medium->layer_count; k++)
        if (medium->layers[k].type != NEBEL_CLOUD_CIRRUS) return 0;
    return 1;
}

/* ---- places ---------------------------------------------------------------------------------- */

static void look_at_clouds(const nb_planet_medium *medium, const double place[3], double height,
                           nb_planet_matter *matter)
{
    const nebel_planet *planet = medium->world.planet;
    for (uint32_t k = 0; k < medium->layer_count; k++) {
        const nebel_cloud_layer *layer = &medium->layers[k];
        float extinction = 0;
        if (!(height > layer->base && height < layer->top)) continue;
        /* Places and the frame's time are in order, so that it cannot fail. */
        (void)nebel_compute_cloud_extinction(planet->clouds, medium->time, 0, 1, (const double(*)[3])place, 0,
                                             &extinction);
        matter->clouds = (double)extinction;
        matter->layer = (int)k;
    }
}

nb_planet_matter nb_planet_matter_at(const nb_planet_medium *medium, const double place[3], int with_air)
{
    const nebel_atmosphere_desc *desc = &medium->world.planet->atmosphere_desc;
    nb_planet_matter matter = {.medium = NULL};
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = place[c] - medium->world.center[c];
    const double height = fmax(0, nb_vector_length(from) - desc->radius);
    if (!(height < desc->thickness)) return matter;
    matter.medium = medium;
    for (uint32_t k = 0; k < desc->component_count && with_air; k++)
        matter.density[k] = density_at(&desc->components[k], height);
    look_at_clouds(medium, place, height, &matter);
    return matter;
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* Where the ray crosses a sphere on its way down or up; at its lowest place where it passes over the sphere. In the order of
 * the spheres also when rounded. */
static double crossing(const nb_planet_walk *walk, int sphere, int is_down)
{
    const double radius = walk->shells->radii[sphere], lowest = walk->lowest_radius;
    const double half = radius > lowest ? sqrt((radius - lowest) * (radius + lowest)) : 0;
    return is_down ? walk->lowest_t - half : walk->lowest_t + half;
}

/* How many of the spheres, counted from the smallest, lie below the ray's start: on its way down those that it enters later,
 * on its way up those that it has left. */
static int count_below(const nb_planet_walk *walk)
{
    int low = 0, high = walk->shells->count;
    while (low < high) {
        const int middle = (low + high) / 2;
        const double t = crossing(walk, middle, walk->is_down);
        if (walk->is_down ? t > 0 : t <= 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Of the sphere that the piece lies over, and of the one that is around it. */
static void set_piece(nb_planet_walk *walk)
{
    const nb_shells *shells = walk->shells;
    const int below = walk->below;
    walk->is_down = walk->is_down && below > 0 && shells->radii[below - 1] > walk->lowest_radius;
    walk->end = HUGE_VAL;
    walk->clouds = walk->air[0] = walk->air[1] = walk->air[2] = 0;
    if (walk->is_down)
        walk->end = crossing(walk, below - 1, 1);
    else if (below < shells->count)
        walk->end = crossing(walk, below, 0);
    if (below == shells->count) return;
    walk->clouds = shells->clouds[below];
    memcpy(walk->air, shells->air[below], sizeof walk->air);
}

void nb_planet_walk_start(const nb_planet_medium *medium, const nebel_ray *ray, int with_air, nb_planet_walk *walk)
{
    double to[3], aside[3];
    walk->shells = with_air ? &medium->shells : &medium->sheets;
    for (int c = 0; c < 3; c++) to[c] = medium->world.center[c] - ray->origin[c];
    walk->lowest_t = nb_vector_dot(to, ray->direction);
    for (int c = 0; c < 3; c++) aside[c] = to[c] - walk->lowest_t * ray->direction[c];
    walk->lowest_radius = nb_vector_length(aside);
    walk->is_down = walk->lowest_t > 0;
    walk->below = count_below(walk);
    set_piece(walk);
}

void nb_planet_walk_to(nb_planet_walk *walk, double t)
{
    while (walk->end <= t) {
        walk->below += walk->is_down ? -1 : 1;
        set_piece(walk);
    }
}
