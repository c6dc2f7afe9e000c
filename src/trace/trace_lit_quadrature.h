/* The rule that sums the light of the sun or of a point light over a step, and the estimate of its error. Included by
 * trace_sun.h.
 *
 * The rule is Kronrod's extension, of seven nodes, of Lobatto's rule of four. Both ends are nodes: light in a thin skin
 * where a step begins or ends is seen however deep the step is. The error is that of Lobatto's rule where the light is
 * smooth. It has two parts.
 *
 * The first is from null rules: sums over the nodes that vanish for polynomials up to a degree. The difference of both
 * rules is one of them, and may be small by chance where the light has a kink. So rules of four degrees are compared:
 * where they do not fall from degree to degree the light is not smooth, and the estimate is larger. (Berntsen and
 * Espelid, Error Estimation in Automatic Quadrature Routines, ACM TOMS 17, 1991.)
 *
 * The second is what nodes cannot show, gap by gap: the loss of transmittance between two nodes times the most light
 * that arrives between them, where the light changes by large factors from one to the other. */

#define SUN_NODES 7

/* On [0, 1]. Source: Gander and Gautschi, Adaptive Quadrature - Revisited, BIT 40, 2000; derived again from the
 * conditions that x^2 to x^8 are exact. */
static const double sun_nodes[SUN_NODES] = {
    0, 0.091751709536136983, 0.27639320225002103, 0.5, 0.72360679774997897, 0.90824829046386302, 1};
static const double sun_weights[SUN_NODES] = {11.0 / 420,  72.0 / 490, 125.0 / 588, 16.0 / 70,
                                              125.0 / 588, 72.0 / 490, 11.0 / 420};

/* Null rules of degrees 2 to 5, orthogonal to each other with the weights of the rule, of equal norm. The last is the
 * difference of both rules. */
#define NULL_RULES 4
static const double null_weights[NULL_RULES][SUN_NODES] = {
    {-0.074748254744185103, -0.057068597388101508, 0.27133470585628078, 0, -0.27133470585628078, 0.057068597388101508,
     0.074748254744185103},
    {0.084756554138236212, -0.085857288607563850, -0.13759180866596810, 0.27738508627059061, -0.13759180866596810,
     -0.085857288607563850, 0.084756554138236212},
    {-0.085183541999991910, 0.17884818204250355, -0.13605442176870740, 0, 0.13605442176870740, -0.17884818204250355,
     0.085183541999991910},
    {0.057142857142857141, -0.14693877551020409, 0.20408163265306123, -0.22857142857142857, 0.20408163265306123,
     -0.14693877551020409, 0.057142857142857141}};

/* What a node stands for if its weight were 1. */
typedef struct sun_node {
    nb_real light[3], doubt[3];  /* light, and by how much of itself that may be off, */
    nb_real noise[3];            /* of which so much is rounding */
    nb_real amount[3];           /* optical depth */
    nb_real depth[3], behind[3]; /* optical depth up to it, and e^-depth */
    nb_real way[3], through[3];  /* the same from it to the light */
    nb_real most;                /* radiance of the brightest fog there, opaque and with nothing before the light */
} sun_node;

/* By what the estimate is larger where null rules do not fall from degree to degree. */
#define ROUGHNESS NB_F(16.0)

/* The same of the last degree alone, which shows a small kink in light that else is steep: there the lower degrees fall. Of
 * 200,000 kinks and roots anywhere in light of random slope and curvature half as many pass for smooth as without it. */
#define KINKED NB_F(4.0)

/* Through the four nodes of Lobatto's rule goes a cubic, whose integral is their sum. By how much the other nodes are off
 * it adds up to the difference of both rules. Without signs it cannot vanish by chance. */
static nb_real off_cubic(const nb_real light[SUN_NODES])
{
    static const double cubic[3][4] = {
        {0.52981150277058676, 0.58869622048869869, -0.17202955382303202, 0.05352183056274658},
        {-0.125, 0.625, 0.625, -0.125},
        {0.05352183056274658, -0.17202955382303202, 0.58869622048869869, 0.52981150277058676}};
    nb_real off = NB_F(0.0);
    for (int i = 0; i < 3; i++) {
        const nb_real between = REAL(cubic[i][0]) * light[0] + REAL(cubic[i][1]) * light[2] +
                                REAL(cubic[i][2]) * light[4] + REAL(cubic[i][3]) * light[6];
        off = off + REAL(sun_weights[2 * i + 1]) * nb_abs(light[2 * i + 1] - between);
    }
    return off;
}

/* What is told of an error that is an estimate, as a multiple of it. Steps are tried against the estimate itself: what they
 * may add in all is that much less than the budget. */
#define ESTIMATE_MARGIN (4.0 / 3)

/* The estimate of the error by null rules; `kinked` is KINKED, or 0 where the light can have no kink. */
static nb_real error_by_null_rules(const nb_real light[SUN_NODES], nb_real kinked)
{
    nb_real off[NULL_RULES];
    for (int i = 0; i < NULL_RULES; i++) {
        off[i] = NB_F(0.0);
        for (int n = 0; n < SUN_NODES; n++)
            if (null_weights[i][n] != 0) off[i] = off[i] + REAL(null_weights[i][n]) * light[n];
        off[i] = nb_abs(off[i]);
    }
    const nb_real fine = nb_max(off[2], off[3]), coarse = nb_max(off[0], off[1]);
    const nb_real ratio = nb_min(fine / nb_max(coarse, NB_TINY), NB_F(1.0));
    const nb_real last = nb_min(off[3] / nb_max(off[2], NB_TINY), NB_F(1.0));
    return nb_max(off[3] * (NB_F(1.0) + kinked * last), fine * nb_sqrt(ratio) * (NB_F(1.0) + ROUGHNESS * ratio));
}

/* Null rules may all be small by chance. What nodes are off a cubic is not, and goes with the fourth power of the length where the
 * rule goes with the ninth or so. Of 70,000 powers with any exponent at both ends, and peaks, in light of random steepness the
 * rule is off by more than is told for a fifth to a tenth as many; for 1 in 30 this is over twice what null rules say. */
#define UNLIKELY NB_F(0.4)

static nb_real error_of_rule(const nb_real light[SUN_NODES], nb_real sum, nb_real kinked)
{
    const nb_real off = off_cubic(light), share = nb_min(off / nb_max(sum, NB_TINY), NB_F(1.0));
    return nb_max(error_by_null_rules(light, kinked), UNLIKELY * off * nb_sqrt(share));
}

/* By how much the way to the light may be less deep somewhere between node j and the next than at both: where it falls
 * before and rises behind, as steeply as it does there. */
static nb_real dip_of_way(const sun_node at[SUN_NODES], int c, int j)
{
    const int a = j > 0 ? j - 1 : 0, b = j < SUN_NODES - 2 ? j + 1 : SUN_NODES - 2;
    const double gap = sun_nodes[j + 1] - sun_nodes[j];
    const nb_real falls = (at[a].way[c] - at[a + 1].way[c]) * REAL(gap / (sun_nodes[a + 1] - sun_nodes[a]));
    const nb_real rises = (at[b + 1].way[c] - at[b].way[c]) * REAL(gap / (sun_nodes[b + 1] - sun_nodes[b]));
    const nb_real least = nb_min(at[j].way[c], at[j + 1].way[c]);
    return nb_min(nb_max(nb_min(falls, rises), NB_F(0.0)), least);
}

/* Loss of transmittance between node j and the next: by the transmittances, or where these hardly differ by its rate. */
static nb_real loss_between(const sun_node at[SUN_NODES], int c, int j)
{
    const nb_real lost = at[j].behind[c] - at[j + 1].behind[c];
    const nb_real mean = (at[j].amount[c] + at[j + 1].amount[c]) * REAL(0.5 * (sun_nodes[j + 1] - sun_nodes[j]));
    const nb_real before = at[j].behind[c];
    return nb_select(lost > before * (NB_F(1024.0) * NB_EPSILON), lost, before * nb_min(mean, NB_F(1.0)));
}

/* Light that changes by e^3 from node to node is not seen by any rule. What rules miss goes with the sixth power. */
#define UNSEEN_CHANGE 3.0

/* What part of the light between two nodes they may not show, between which its logarithm changes so. */
static nb_real unseen_share(nb_real change)
{
    const nb_real share = nb_min(change * REAL(1 / UNSEEN_CHANGE), NB_F(1.0)), square = share * share;
    return square * square * square;
}

/* What nodes may not show in one channel; `steepness` becomes by how much the logarithm of the light changes over the
 * first gap, if that is more. */
static nb_real unseen_light(const sun_node at[SUN_NODES], int c, nb_real *steepness)
{
    nb_real unseen = NB_F(0.0);
    for (int j = 0; j + 1 < SUN_NODES; j++) {
        const sun_node *first = &at[j], *last = &at[j + 1];
        const nb_real dip = dip_of_way(at, c, j);
        const nb_real change = nb_abs((last->depth[c] - first->depth[c]) + (last->way[c] - first->way[c])) + dip;
        nb_real most = nb_max(first->most * first->through[c], last->most * last->through[c]);
        if (nb_any(dip > NB_F(0.0))) {
            const nb_real least = nb_min(first->way[c], last->way[c]) - dip; /* e^-way may have been 0 */
            most = nb_select(dip > NB_F(0.0), nb_max(first->most, last->most) * nb_exp(-least), most);
        }
        unseen = unseen + most * loss_between(at, c, j) * unseen_share(change);
        if (j == 0) *steepness = nb_max(*steepness, change);
    }
    return unseen;
}

/* Fog that nodes do not show: by how much the rule is off the optical depth of the step, which is exact but for the
 * rounding of `terms` sums; with `most` light on it. */
static nb_real unseen_fog(const sun_node at[SUN_NODES], int c, nb_real terms, nb_real most)
{
    nb_real amount = NB_F(0.0);
    for (int n = 0; n < SUN_NODES; n++) amount = amount + REAL(sun_weights[n]) * at[n].amount[c];
    const nb_real last = at[SUN_NODES - 1].depth[c], rounding = (last + amount) * (NB_F(8.0) + terms) * NB_EPSILON;
    const nb_real off = nb_abs(amount - (last - at[0].depth[c])) - rounding;
    return most * (at[0].behind[c] * nb_clamp(off, NB_F(0.0), NB_F(1.0)));
}

/* The error that is told, as a multiple of what the nodes are off a cubic: light from voxels is not as smooth as rules
 * want it. */
#define VOXEL_CAUTION NB_F(4.0)

/* The same where a kink is known to be in the step. Of 200,000 kinks and roots anywhere in an exponential of random steepness the
 * rule is off by more than that at 4. */
#define KINK_CAUTION NB_F(2.0)

/* Of the worst channel. */
static nb_real off_cubics(const sun_node at[SUN_NODES])
{
    nb_real off = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        nb_real light[SUN_NODES];
        for (int n = 0; n < SUN_NODES; n++) light[n] = at[n].light[c];
        off = nb_max(off, off_cubic(light));
    }
    return off;
}

/* What the rule makes of a step. */
typedef struct lit_sum {
    nb_real light[3];
    nb_real error, rounding; /* of the worst channel */
    nb_real noise;           /* of that, what comes of arithmetic */
    nb_real steepness;       /* see unseen_light */
} lit_sum;

/* `most`: radiance of the brightest fog anywhere in the step, opaque and with nothing before the light; `terms`: how many
 * media there are; `is_gray`: channels have the same depths. */
static lit_sum sum_nodes_of_step(const sun_node at[SUN_NODES], nb_real most, nb_real terms, int is_gray)
{
    const nb_real zero = NB_F(0.0);
    lit_sum sum = {{zero, zero, zero}, zero, zero, zero, zero};
    nb_real unseen = zero;
    for (int c = 0; c < (is_gray ? 1 : 3); c++)
        unseen = nb_max(unseen, unseen_light(at, c, &sum.steepness) + unseen_fog(at, c, terms, most));
    for (int c = 0; c < 3; c++) {
        nb_real light[SUN_NODES], rounding = zero, noise = zero;
        for (int n = 0; n < SUN_NODES; n++) {
            light[n] = at[n].light[c];
            const nb_real weighted = REAL(sun_weights[n]) * light[n];
            sum.light[c] = sum.light[c] + weighted;
            rounding = rounding + weighted * at[n].doubt[c];
            noise = noise + weighted * at[n].noise[c];
        }
        sum.error = nb_max(sum.error, error_of_rule(light, sum.light[c], KINKED));
        sum.rounding = nb_max(sum.rounding, rounding);
        sum.noise = nb_max(sum.noise, noise);
    }
    sum.error = sum.error + unseen;
    return sum;
}
