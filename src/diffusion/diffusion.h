/* Light that fog scatters more than once: its mean over all directions, and which way it goes on the whole, as diffusion
 * has them, on a lattice. The model, with all its limits, is in docs/multiple-scattering.md.
 *
 * What phase functions send almost straight on is taken to go straight on (delta-Eddington: Joseph, Wiscombe and Weinman
 * 1976): it dims no light. For what is left radiance is taken to be linear in the cosine of the angle (P1), which makes
 * one elliptic equation of the fluence.
 */
#ifndef NB_DIFFUSION_DIFFUSION_H
#define NB_DIFFUSION_DIFFUSION_H

#include "fog/medium_sampling.h"
#include "light/lighting.h"
#include "trace/trace_kernel.h"

/* What is beyond the end of a lattice. */
typedef enum nb_diffusion_lattice_end {
    NB_END_OPEN,  /* nothing: no diffuse light comes from there */
    NB_END_LEVEL, /* fog as it is at the end, for ever */
    NB_END_GROUND
} nb_diffusion_lattice_end;

typedef struct nb_diffusion_lattice {
    uint32_t size[3];                   /* cells, >= 1 */
    double low[3], high[3], spacing[3]; /* m */
    nb_diffusion_lattice_end ends[3][2];
} nb_diffusion_lattice;

/* Of one channel at a node, per unit of the sun's irradiance. */
enum {
    NB_NODE_DIFFUSE, /* source radiance of diffuse light, that of extinction after scaling: mean over directions, */
    NB_NODE_FLUX,    /* and its first moments along x, y and z: three numbers */
    NB_NODE_TURNED = NB_NODE_FLUX + 3, /* logarithm of sunlight through scaled fog, times what is turned of it; no phase
                                          function. Between nodes it is linear, as optical depth is in even fog */
    NB_NODE_ONCE,  /* the same through the fog as it is, of its extinction: in NB_NODE_TURNED, and in the exact light */
    NB_NODE_GLOW,  /* sunlight that went almost straight on and does so again, of the fog's extinction */
    NB_NODE_WIDTH, /* g of the lobe that this makes */
    NB_NODE_NUMBERS
};

/* Of one channel at a node, per unit of the sky's mean radiance: what fog takes from the undimmed sky. Four numbers each:
 * mean over directions, and the part that is linear in the direction of the light. */
enum {
    NB_NODE_DIMMED, /* source radiance of the lack of light, that of extinction after scaling */
    NB_NODE_ABSORBED =
        NB_NODE_DIMMED + 4, /* what of the undimmed sky is not scattered again, of the fog's extinction */
    NB_NODE_SKY_NUMBERS = NB_NODE_ABSORBED + 4
};

/* The same of own light that went straight on, source radiance with its mean over directions and its flux: as NB_NODE_TURNED,
 * NB_NODE_ONCE and NB_NODE_GLOW. Without what is
 * the same in both of the former. */
enum {
    NB_NODE_OWN_TURNED,
    NB_NODE_OWN_ONCE = NB_NODE_OWN_TURNED + 4,
    NB_NODE_OWN_GLOW = NB_NODE_OWN_ONCE + 4,
    NB_NODE_OWN_NUMBERS = NB_NODE_OWN_GLOW + 4
};

typedef struct nb_diffusion {
    nb_diffusion_lattice lattice;
    int channel_count;    /* 1: all channels are alike */
    int has_peaks;        /* some fog scatters forwards, so that `scaled` is another fog */
    int has_sun, has_sky; /* whether the sun lights it; whether it dims the sky */
    int is_own;           /* it is of own light (nb_local_light), and neither of the sun nor of the sky */
    double to_sun[3];     /* of length 1 */
    double irradiance[3]; /* of the sun; the unit of own light */
    double skylight[3];   /* mean radiance of the sky */
    size_t
        node_numbers; /* of all channels, one more: g of what is turned; behind it the sky's or own light's of all channels */
    double gain[3][3][2]; /* of channels: of NB_NODE_DIFFUSE and NB_NODE_FLUX, in light that leaves along an axis
                                  to one side: see nb_diffusion_balance */
    float *nodes;         /* x fastest, then y; size + 1 along each axis */
    struct nb_diffusion
        *beside;            /* of the endless fog alone, for what is beside the lattice; NULL where that is no more */
    nebel_snapshot *scaled; /* takes from light what does not go straight on; scatters nothing */
} nb_diffusion;

/* The first of the sky's numbers of a channel at a node, or of own light's; where it has any. */
static inline size_t nb_diffusion_second_number(const nb_diffusion *diffusion, int channel)
{
    return (size_t)diffusion->channel_count * NB_NODE_NUMBERS + 1 +
           (size_t)channel * (diffusion->is_own ? NB_NODE_OWN_NUMBERS : NB_NODE_SKY_NUMBERS);
}

static inline int nb_diffusion_has_second(const nb_diffusion *diffusion)
{
    return diffusion->has_sky || diffusion->is_own;
}

/* How many faces lie across an axis, x fastest. */
static inline size_t nb_diffusion_lattice_faces(const nb_diffusion_lattice *lattice, int axis)
{
    size_t count = 1;
    for (int a = 0; a < 3; a++) count *= lattice->size[a] + (a == axis ? 1u : 0u);
    return count;
}

static inline size_t nb_diffusion_lattice_cells(const nb_diffusion_lattice *lattice)
{
    return (size_t)lattice->size[0] * lattice->size[1] * lattice->size[2];
}

static inline size_t nb_diffusion_lattice_nodes(const nb_diffusion_lattice *lattice)
{
    return ((size_t)lattice->size[0] + 1) * ((size_t)lattice->size[1] + 1) * ((size_t)lattice->size[2] + 1);
}

/* What the sun gives a node: through scaled fog, and through the fog as it is. Of each channel. */
typedef struct nb_node_sun {
    double scaled[3], whole[3];
} nb_node_sun;

/* Two moments of undimmed ambient light in one channel, per unit of its mean radiance. */
typedef struct nb_environment_moments {
    double flux[3];      /* the way that light goes */
    double above, below; /* irradiance of a level plane from above, and from below */
} nb_environment_moments;

/* Own light in one channel on its straight way. */
typedef struct nb_light_beams {
    double *through[3]; /* through scaled fog: power through each face, along the axis; */
    double *taken;      /* power that fog takes from it in each cell */
    double *scaled,
        *whole; /* what is emitted, through scaled fog and through the fog as it is: four for each cell, the means of
                               fluence and flux, times the cell's volume */
} nb_light_beams;

/* 0 when memory is out. To be closed in any case. */
int nb_beams_open(const nebel_allocator *allocator, const nb_diffusion_lattice *lattice, nb_light_beams *beams);

void nb_beams_close(const nebel_allocator *allocator, const nb_light_beams *beams);

/* What fog scatters: the sun's light, own light, or the sky's, of which that is solved for which it lacks. */
typedef struct nb_diffuse_source {
    const nb_node_sun *sun; /* of each node; NULL: not the sun */
    const double *to_sun;
    const nb_light_beams *beams; /* NULL: not own light */
    nb_environment_moments sky;
} nb_diffuse_source;

static inline int nb_source_is_sky(const nb_diffuse_source *source)
{
    return source->sun == NULL && source->beams == NULL;
}

/* Light that begins in the fog or beside it: point lights', and what fog emits. */
typedef struct nb_local_light {
    int has; /* whether any fog scatters any */
    int has_colour;
    double unit[3]; /* the colour of all where they have one, else 1 */
} nb_local_light;

nb_local_light nb_find_own_light(const nebel_lighting *lighting);

/* Of a point light's intensity or of what is emitted, per unit. */
double nb_local_amount(const nb_local_light *own, const double color[3], int channel);

/* Follows own light on straight ways to the lattice's ends, in one channel. */
void nb_cast_beams(const nb_diffusion_lattice *lattice, const nebel_lighting *lighting,
                   const nb_medium_transport *cells, int channel, const nb_local_light *own,
                   const nb_light_beams *beams);

/* What own light gives a node on straight ways in each channel, fluence and flux: through scaled fog; what the exact light has of it,
 * through the fog as it is; the difference, with as much flux as is left where it goes almost straight on again. */
typedef struct nb_local_node {
    double scaled[3][4], whole[3][4], glow[3][4];
} nb_local_node;

/* Fills the nodes, which are all 0, with point lights' light. */
nebel_result nb_light_nodes_by_point_lights(const nb_diffusion *diffusion, const nebel_lighting *lighting,
                                            const nb_medium_transport *cells, const nb_local_light *own,
                                            nb_local_node *nodes);

/* Adds what is emitted, as beams have it, in one channel. */
void nb_light_nodes_by_cells(const nb_diffusion_lattice *lattice, const nb_medium_transport *cells,
                             const nb_light_beams *beams, int channel, nb_local_node *nodes);

/* Where the scattered light of point lights and of what fog emits matters, in fog without an end [m]. 0: nowhere. */
int nb_find_reach(const nebel_lighting *lighting, const nebel_snapshot *scaled, double low[3], double high[3]);

int nb_medium_scatters(const nb_medium *medium);

/* Whether the medium scatters the sun's light or ambient light. */
int nb_medium_is_lit(const nb_medium *medium, const nb_medium_light *lit);

/* Whether any fog or the ground takes something from ambient light, so that it is darker than undimmed. */
int nb_environment_is_dimmed(const nebel_lighting *lighting);

/* Of each channel; all 0 where it is dark. */
void nb_environment_find_moments(const nebel_environment *sky, double mean[3], nb_environment_moments moments[3]);

/* Whether the moments are not the same in all channels. */
int nb_environment_has_colour(const nebel_environment *sky);

/* Where the lattice is, and its cells: of own light, or of the sun and the sky. *lit: 0 where there is nothing to be solved.
 * Errors: UNSUPPORTED. */
nebel_result nb_diffusion_lattice_place(const nebel_lighting *lighting, const nebel_snapshot *scaled, int is_own,
                                        nb_diffusion_lattice *lattice, int *lit);

/* Whether it holds bodies in fog that goes on beside it. */
int nb_diffusion_lattice_has_bodies(const nb_diffusion_lattice *lattice);

/* The place of a node. */
void nb_diffusion_lattice_node(const nb_diffusion_lattice *lattice, size_t node, double place[3]);

/* One of the eight cells around a node, or the nearest one where there is none. */
size_t nb_diffusion_lattice_cell_beside(const nb_diffusion_lattice *lattice, size_t node, int octant);

/* What the cells around a node hold together. */
nb_medium_transport nb_diffusion_lattice_around(const nb_diffusion_lattice *lattice, const nb_medium_transport *cells,
                                                size_t node);

/* g of what went almost straight on `n` times, where the rest has the mean cosine `turned`: the second moment of what is
 * taken to go straight on is that of this lobe for n = 1. */
double nb_lobe_width(double turned, double n);

/* Power through scaled fog, and through the fog as it is: g of the lobe of light that went almost straight on between, and
 * does so again, where the rest has the mean cosine `turned`. */
double nb_glow_width(double turned, double scaled, double whole);

/* Means over the cells. */
void nb_diffusion_lattice_mean(const nb_diffusion_lattice *lattice, const nebel_snapshot *snapshot,
                               nb_medium_transport *cells);

/* One channel's diffuse light, per unit of irradiance; the sky's lack of light, per unit of its mean radiance. */
typedef struct nb_diffuse_light {
    double *nodes;        /* fluence and flux, four numbers each */
    double leaving[3][2]; /* power through the lattice's ends [m^2] */
    double lost;          /* what leaves on its way there, through cells without fog: nobody knows by which end */
    double ground;        /* mean radiance of the ground */
} nb_diffuse_light;

/* Fills *light, whose nodes are the caller's. 0 when memory is out. */
int nb_diffusion_solve(const nebel_allocator *allocator, const nb_diffusion_lattice *lattice,
                       const nb_medium_transport *cells, const nb_diffuse_source *source, double ground_albedo,
                       int channel, nb_diffuse_light *light);

/* Sets the gains of a diffusion that is ready but for them. The radiance at an end of the lattice, which comes from what
 * is scattered towards it all along a ray, carries less out than diffusion says: that knows the energy better than where
 * near the end the light is. The gains make both alike. */
nebel_result nb_diffusion_balance(const nebel_lighting *lighting, nb_diffusion *diffusion,
                                  const nb_diffuse_light light[3]);

typedef struct nb_diffusion_gathered {
    double light[3], diffuse[3]; /* all, and what of it is diffuse */
    double dimmed[3];            /* what undimmed ambient light has too much, per unit of the sky's mean radiance */
} nb_diffusion_gathered;

/* Light per unit of irradiance that rays gather from the sun's light scattered in scaled fog; of what fog is there is no
 * less, where `is_rest` is 1: what exact light of one scattering lacks. Rays of t_max 0 gather none. */
nebel_result nb_diffusion_gather(const nebel_lighting *lighting, const nb_diffusion *diffusion, int is_rest,
                                 size_t count, const nebel_ray *rays, nb_diffusion_gathered *gathered);

/* How many rays are gathered at once, at most. */
enum { NB_DIFFUSION_RAYS = 64 };

/* Of the sun and the sky, or of own light. *made: NULL where that lights no fog that scatters. The lighting is complete but
 * for this. */
nebel_result nb_diffusion_make(const nebel_lighting *lighting, nebel_snapshot *scaled, int is_own, nb_diffusion **made);

void nb_diffusion_free(const nebel_allocator *allocator, nb_diffusion *diffusion);

/* Adds to the in-scattering of a job that is done. */
nebel_result nb_diffusion_add(const nebel_lighting *lighting, const nb_trace_job *job);

#endif
