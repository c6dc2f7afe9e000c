#include "ray_quadrature.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

enum { MOST_ENDS = 2 * NB_MAX_SHELLS + 3 + NB_PATH_CUTS };

typedef struct nb_quadrature_ends {
    int count;
    double at[MOST_ENDS];
} nb_quadrature_ends;

/* Keeps the ends in order. */
static void add_end(nb_quadrature_ends *ends, double length, double s)
{
    if (!(s > 0 && s < length)) return;
    int i = ends->count++;
    for (; i > 0 && ends->at[i - 1] > s; i--) ends->at[i] = ends->at[i - 1];
    ends->at[i] = s;
}

static void find_ends(const nb_air_components *airs, nb_atmosphere_ray track, double length, int cut_count,
                      const double cuts[], nb_quadrature_ends *ends)
{
    ends->count = 0;
    ends->at[ends->count++] = 0;
    add_end(ends, length, -track.rise);
    for (int i = 0; i < airs->shell_count; i++) {
        add_end(ends, length, nb_atmosphere_ray_enter(track, airs->shells[i]));
        add_end(ends, length, nb_atmosphere_ray_leave(track, airs->shells[i]));
    }
    for (int i = 0; i < cut_count; i++) add_end(ends, length, cuts[i]);
    ends->at[ends->count++] = length;
}

static void set_node(const nb_air_components *airs, nb_atmosphere_ray track, double s, double weight,
                     nb_ray_nodes *path, int i)
{
    path->s[i] = s;
    path->radius[i] = nb_atmosphere_ray_ahead(track, s).radius;
    path->weight[i] = weight;
    for (int k = 0; k < airs->count; k++)
        path->density[k][i] = nb_air_density(&airs->airs[k], path->radius[i] - airs->radius);
}

/* What a path leads through, and the rule for its pieces. */
typedef struct nb_ray_medium {
    const nb_air_components *airs, *smooth;
    const nb_gauss_rule *rule;
} nb_ray_medium;

/* Optical depth from the start of a ray, of all air and of smooth air. */
typedef struct nb_depths {
    double all[3], smooth[3];
} nb_depths;

static double extinction_at(const nb_air_components *airs, const nb_ray_nodes *path, int i, int c)
{
    double sum = 0;
    for (int k = 0; k < airs->count; k++) sum += path->density[k][i] * airs->airs[k].extinction[c];
    return sum;
}

/* Sets the transmittance up to each node of a piece. `depth` is the optical depth up to the piece, and becomes that up to its end. */
static void lose_light(const nb_air_components *airs, const nb_gauss_rule *rule, double half, const nb_ray_nodes *path,
                       int c, double *depth, double left[])
{
    double extinction[NB_MAX_RULE], whole = 0;
    for (int i = 0; i < rule->count; i++) extinction[i] = extinction_at(airs, path, path->count + i, c);
    for (int i = 0; i < rule->count; i++) {
        double before = 0;
        for (int j = 0; j < rule->count; j++) before += rule->before[i][j] * extinction[j];
        left[path->count + i] = nb_exp(-(*depth + half * before));
        whole += rule->weights[i] * extinction[i];
    }
    *depth += half * whole;
}

/* Adds the nodes from a to b; `depth` is that of the ray up to a, and becomes that up to b. */
static void lay_piece(const nb_ray_medium *medium, nb_atmosphere_ray track, double a, double b, nb_depths *depth,
                      nb_ray_nodes *path)
{
    const nb_gauss_rule *rule = medium->rule;
    const double half = 0.5 * (b - a);
    for (int i = 0; i < rule->count; i++)
        set_node(medium->airs, track, a + half * (1 + rule->nodes[i]), half * rule->weights[i], path, path->count + i);
    for (int c = 0; c < 3; c++) {
        lose_light(medium->airs, rule, half, path, c, &depth->all[c], path->transmittance[c]);
        if (medium->smooth != NULL) lose_light(medium->smooth, rule, half, path, c, &depth->smooth[c], path->smooth[c]);
    }
    path->count += rule->count;
}

static void note_end(double s, const nb_depths *depth, nb_ray_nodes *path)
{
    const int i = path->ends++;
    path->end[i] = s;
    for (int c = 0; c < 3; c++) {
        path->end_left[c][i] = nb_exp(-depth->all[c]);
        path->end_smooth[c][i] = nb_exp(-depth->smooth[c]);
    }
}

/* A piece's nodes are too few where more than that is lost within it and something is seen of it, in optical depths. */
#define MOST_DEPTH 1.5
#define UNSEEN_DEPTH 9

/* Behind that nothing is seen of anything. */
#define DARK_DEPTH 16

static int is_too_deep(const double before[3], const double behind[3])
{
    for (int c = 0; c < 3; c++)
        if (before[c] < UNSEEN_DEPTH && behind[c] - before[c] > MOST_DEPTH) return 1;
    return 0;
}

static int is_dark(const double depth[3])
{
    return depth[0] > DARK_DEPTH && depth[1] > DARK_DEPTH && depth[2] > DARK_DEPTH;
}

/* Adds the nodes from a to b in pieces that are not too deep, as long as there are halvings left. */
static void lay_pieces(const nb_ray_medium *medium, nb_atmosphere_ray track, double a, double b, int *halvings,
                       nb_depths *depth, nb_ray_nodes *path)
{
    const int first = path->count;
    nb_depths behind = *depth;
    lay_piece(medium, track, a, b, &behind, path);
    if (*halvings > 0 && is_too_deep(depth->all, behind.all)) {
        --*halvings;
        path->count = first;
        lay_pieces(medium, track, a, 0.5 * (a + b), halvings, depth, path);
        lay_pieces(medium, track, 0.5 * (a + b), b, halvings, depth, path);
        return;
    }
    *depth = behind;
    if (medium->smooth != NULL) note_end(b, depth, path);
}

static void add_start(const nb_air_components *airs, nb_atmosphere_ray track, nb_ray_nodes *path)
{
    int i = path->count;
    do {
        set_node(airs, track, 0, 1, path, i);
        for (int c = 0; c < 3; c++) path->transmittance[c][i] = path->smooth[c][i] = 1;
    } while (++i % NB_PATH_LANES > 0);
}

void nb_ray_nodes_lay(const nb_air_components *airs, const nb_air_components *smooth, const nb_gauss_rule *rule,
                      nb_atmosphere_ray track, double length, int cut_count, const double cuts[], nb_ray_nodes *path)
{
    const nb_ray_medium medium = {airs, smooth, rule};
    nb_quadrature_ends ends;
    nb_depths depth = {.all = {0}};
    int halvings = NB_PATH_HALVINGS;
    path->count = path->ends = 0;
    find_ends(airs, track, length, cut_count, cuts, &ends);
    for (int i = 1; i < ends.count && !is_dark(smooth != NULL ? depth.smooth : depth.all); i++)
        if (ends.at[i] > ends.at[i - 1])
            lay_pieces(&medium, track, ends.at[i - 1], ends.at[i], &halvings, &depth, path);
    add_start(airs, track, path);
    for (int c = 0; c < 3; c++) path->left[c] = nb_exp(-depth.all[c]);
}
