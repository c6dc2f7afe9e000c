#include "path.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

enum { MOST_ENDS = 2 * NB_MOST_SHELLS + 3 + NB_PATH_CUTS };

typedef struct nb_ends {
    int count;
    double at[MOST_ENDS];
} nb_ends;

/* Keeps the ends in order. */
static void add_end(nb_ends *ends, double length, double s)
{
    if (!(s > 0 && s < length)) return;
    int i = ends->count++;
    for (; i > 0 && ends->at[i - 1] > s; i--) ends->at[i] = ends->at[i - 1];
    ends->at[i] = s;
}

static void find_ends(const nb_airs *airs, nb_track track, double length, int cut_count, const double cuts[],
                      nb_ends *ends)
{
    ends->count = 0;
    ends->at[ends->count++] = 0;
    add_end(ends, length, -track.rise);
    for (int i = 0; i < airs->shell_count; i++) {
        add_end(ends, length, nb_track_enter(track, airs->shells[i]));
        add_end(ends, length, nb_track_leave(track, airs->shells[i]));
    }
    for (int i = 0; i < cut_count; i++) add_end(ends, length, cuts[i]);
    ends->at[ends->count++] = length;
}

static void set_node(const nb_airs *airs, nb_track track, double s, double weight, nb_path *path, int i)
{
    path->s[i] = s;
    path->radius[i] = nb_track_ahead(track, s).radius;
    path->weight[i] = weight;
    for (int k = 0; k < airs->count; k++)
        path->density[k][i] = nb_air_density(&airs->airs[k], path->radius[i] - airs->radius);
}

static double extinction_at(const nb_airs *airs, const nb_path *path, int i, int c)
{
    double sum = 0;
    for (int k = 0; k < airs->count; k++) sum += path->density[k][i] * airs->airs[k].extinction[c];
    return sum;
}

/* Adds the nodes from a to b; `depth` is that of the ray up to a, and becomes that up to b. */
static void lay_piece(const nb_airs *airs, const nb_rule *rule, nb_track track, double a, double b, double depth[3],
                      nb_path *path)
{
    const double half = 0.5 * (b - a);
    const int first = path->count;
    for (int i = 0; i < rule->count; i++)
        set_node(airs, track, a + half * (1 + rule->nodes[i]), half * rule->weights[i], path, first + i);
    for (int c = 0; c < 3; c++) {
        double extinction[NB_RULE_MOST], whole = 0;
        for (int i = 0; i < rule->count; i++) extinction[i] = extinction_at(airs, path, first + i, c);
        for (int i = 0; i < rule->count; i++) {
            double before = 0;
            for (int j = 0; j < rule->count; j++) before += rule->before[i][j] * extinction[j];
            path->transmittance[c][first + i] = nb_exp(-(depth[c] + half * before));
            whole += rule->weights[i] * extinction[i];
        }
        depth[c] += half * whole;
    }
    path->count += rule->count;
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
static void lay_pieces(const nb_airs *airs, const nb_rule *rule, nb_track track, double a, double b, int *halvings,
                       double depth[3], nb_path *path)
{
    const int first = path->count;
    double behind[3] = {depth[0], depth[1], depth[2]};
    lay_piece(airs, rule, track, a, b, behind, path);
    if (*halvings > 0 && is_too_deep(depth, behind)) {
        --*halvings;
        path->count = first;
        lay_pieces(airs, rule, track, a, 0.5 * (a + b), halvings, depth, path);
        lay_pieces(airs, rule, track, 0.5 * (a + b), b, halvings, depth, path);
        return;
    }
    for (int c = 0; c < 3; c++) depth[c] = behind[c];
}

static void add_start(const nb_airs *airs, nb_track track, nb_path *path)
{
    int i = path->count;
    do {
        set_node(airs, track, 0, 1, path, i);
        for (int c = 0; c < 3; c++) path->transmittance[c][i] = 1;
    } while (++i % NB_PATH_LANES > 0);
}

void nb_path_lay(const nb_airs *airs, const nb_rule *rule, nb_track track, double length, int cut_count,
                 const double cuts[], nb_path *path)
{
    nb_ends ends;
    double depth[3] = {0, 0, 0};
    int halvings = NB_PATH_HALVINGS;
    path->count = 0;
    find_ends(airs, track, length, cut_count, cuts, &ends);
    for (int i = 1; i < ends.count && !is_dark(depth); i++)
        if (ends.at[i] > ends.at[i - 1])
            lay_pieces(airs, rule, track, ends.at[i - 1], ends.at[i], &halvings, depth, path);
    add_start(airs, track, path);
    for (int c = 0; c < 3; c++) path->left[c] = nb_exp(-depth[c]);
}
