#include "cloud_nodes.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

enum { MOST = NEBEL_MAX_CLOUD_NODES };

/* Between two nodes transmittance falls by no more than about that. */
#define MOST_FALL 0.12

/* Gaps between clouds are long from this part of the way to their end on. */
#define LONG_GAP 0.1

static nb_cloud_node node_here(const nb_cloud_node_builder *tally, double t)
{
    nb_cloud_node node = {.t = t, .left = tally->left, .left_apart = tally->left_apart, .stretches = tally->asked};
    memcpy(node.light, tally->light, sizeof node.light);
    memcpy(node.ahead, tally->ahead, sizeof node.ahead);
    return node;
}

/* There is one. */
static const nb_cloud_node *last_of(const nb_cloud_node_builder *tally)
{
    return &tally->nodes[tally->count - 1];
}

static void write_node(nb_cloud_node_builder *tally, const nb_cloud_node *node)
{
    tally->nodes[tally->count++] = *node;
}

/* The end of a gap that no node lies behind. */
static int has_gap(const nb_cloud_node_builder *tally)
{
    return tally->count > 0 && tally->gap_end.t > last_of(tally)->t;
}

/* What light must have fallen for a node to be worth its place: the more there are the more. */
static double least_fall(const nb_cloud_node_builder *tally)
{
    return MOST_FALL * tally->count / MOST;
}

/* Before it the end of the gap that clouds lie behind, if they have taken something. The last place may stay free until the end. */
static void add_node(nb_cloud_node_builder *tally, double t)
{
    const nb_cloud_node here = node_here(tally, t);
    if (has_gap(tally) && tally->gap_end.left_apart - here.left_apart > least_fall(tally) && tally->count + 2 < MOST)
        write_node(tally, &tally->gap_end);
    if (tally->count + 1 < MOST) write_node(tally, &here);
}

/* A long gap is full of air, and clouds leave as much of its light at both ends: a node between two clouds would have the mean of both. */
void nb_cloud_nodes_enter(nb_cloud_node_builder *tally, double t)
{
    if (tally->count == 0) {
        add_node(tally, t);
        return;
    }
    if (!(t - tally->end > LONG_GAP * t)) return;
    if (last_of(tally)->left_apart - tally->left_apart > least_fall(tally)) add_node(tally, tally->end);
    tally->gap_end = node_here(tally, t);
}

void nb_cloud_nodes_pass(nb_cloud_node_builder *tally, double t, double depth, double apart)
{
    tally->end = t;
    tally->depth += depth;
    tally->apart += apart;
    tally->left = nb_exp(-tally->depth);
    tally->left_apart = nb_exp(-tally->apart);
}

/* Where the clouds' transmittance has fallen, or the ray is far from the last node. */
void nb_cloud_nodes_leave(nb_cloud_node_builder *tally, double t)
{
    const double fallen = last_of(tally)->left - tally->left;
    if (fallen > MOST_FALL || (fallen > 0.02 && t > 1.5 * last_of(tally)->t)) add_node(tally, t);
}

static void add_to_node(nb_cloud_node *node, const double light[3], const double ahead[3])
{
    for (int c = 0; c < 3; c++) {
        node->light[c] += light[c];
        node->ahead[c] += ahead[c];
    }
}

void nb_cloud_nodes_light(nb_cloud_node_builder *tally, const double light[3], const double ahead[3])
{
    const int number = ++tally->lit;
    for (int c = 0; c < 3; c++) {
        tally->light[c] += light[c];
        tally->ahead[c] += ahead[c];
    }
    if (tally->gap_end.stretches >= number) add_to_node(&tally->gap_end, light, ahead);
    for (uint32_t i = tally->count; i > 0 && tally->nodes[i - 1].stretches >= number; i--)
        add_to_node(&tally->nodes[i - 1], light, ahead);
}

/* The last cloud's end is the last node, not that of the stay in its layer, which may be beyond the horizon: the last light would come
 * through all air before that. It takes the place of a node that is there already. */
static void add_end(nb_cloud_node_builder *tally)
{
    const nb_cloud_node end = node_here(tally, tally->end);
    if (tally->count == 0) return;
    if (tally->count > 1 && last_of(tally)->t >= tally->end) tally->count--;
    if (has_gap(tally) && tally->count + 1 < MOST) write_node(tally, &tally->gap_end);
    write_node(tally, &end);
}

void nb_cloud_nodes_end(nb_cloud_node_builder *tally, double through, nebel_cloud_transfer *nodes)
{
    add_end(tally);
    nodes->count = tally->count;
    for (uint32_t i = 0; i < tally->count; i++) {
        nodes->t[i] = (float)tally->nodes[i].t;
        nodes->transmittance[i] = (float)tally->nodes[i].left;
        for (int c = 0; c < 3; c++)
            nodes->in_scattering[i][c] = (float)(tally->nodes[i].light[c] + through * tally->nodes[i].ahead[c]);
    }
}
