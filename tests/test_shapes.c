/* Intervals of a ray in every shape: against closed forms of the literature, against intervals worked out in twice the
 * digits, and where a ray lies in a face, grazes, is far away or goes through an apex. */
#include "formula_inputs.h"
#include "formula_truth.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#if defined(__SANITIZE_ADDRESS__)
enum { RAYS = 3000 };
#else
enum { RAYS = 30000 };
#endif

enum { ENTER, LEAVE, ENTER_SLACK, LEAVE_SLACK };

typedef struct level {
    const char *name;
    nb_formula_evaluate *evaluate;
    nb_formula_digits digits;
} level;

static const level levels[] = {
    {"float", nb_formula_float, NB_DIGITS_DOUBLE},
    {"double", nb_formula_double, NB_DIGITS_LONG},
    {"fast", nb_formula_fast, NB_DIGITS_FLOAT},
};
enum { LEVELS = sizeof levels / sizeof levels[0] };

static const nb_formula shapes[] = {NB_FORMULA_box,  NB_FORMULA_half_space, NB_FORMULA_ball,
                                    NB_FORMULA_tube, NB_FORMULA_cone,       NB_FORMULA_capsule};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

static const char *const formula_names[] = {
#define NAME(name, expression) #name,
    NB_FORMULAS(NAME)
#undef NAME
};

/* ---- asking ---------------------------------------------------------------------------------- */

typedef struct interval {
    long double v[NB_FORMULA_OUTPUTS];
} interval;

static interval ask(const level *l, nb_formula formula, const long double in[NB_FORMULA_INPUTS])
{
    interval i;
    l->evaluate(formula, in, i.v);
    return i;
}

/* A ray in the shape's frame, what describes the shape from a6 on, reach 0. */
static interval ask_ray(const level *l, nb_formula formula, const long double p[3], const long double d[3],
                        const long double *shape, size_t count)
{
    long double in[NB_FORMULA_INPUTS] = {p[0], p[1], p[2], d[0], d[1], d[2]};
    memcpy(in + 6, shape, count * sizeof in[0]);
    return ask(l, formula, in);
}

static int is_hit(const interval *i)
{
    return i->v[ENTER] < i->v[LEAVE];
}

static long double chord(const interval *i)
{
    return is_hit(i) ? i->v[LEAVE] - i->v[ENTER] : 0;
}

/* The part of the interval from 0 to t_max, as every caller clips it. */
static long double clipped(const interval *i, long double t_max)
{
    return fmaxl(0, fminl(i->v[LEAVE], t_max) - fmaxl(i->v[ENTER], 0));
}

static void expect(const char *what, long double got, long double wanted, long double tolerance)
{
    const long double error = fabsl(got - wanted);
    if (!(error <= tolerance * fabsl(wanted))) fail_msg("%s: %.20Lg instead of %.20Lg", what, got, wanted);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

typedef struct chord_case {
    long double p[3], d[3], t_max, chord;
} chord_case;

static void expect_chords(const char *id, nb_formula formula, const long double *shape, size_t size,
                          const chord_case *cases, size_t count)
{
    for (size_t l = 0; l < 2; ++l)
        for (size_t i = 0; i < count; ++i) {
            char what[80];
            snprintf(what, sizeof what, "%s case %zu in %s", id, i, levels[l].name);
            const interval got = ask_ray(&levels[l], formula, cases[i].p, cases[i].d, shape, size);
            const long double rounding = 4 * nb_formula_unit(levels[l].digits) * fabsl(got.v[LEAVE]);
            const long double error = fabsl(clipped(&got, cases[i].t_max) - cases[i].chord);
            if (!(error <= 1e-12L * cases[i].chord + (cases[i].chord > 0 ? rounding : 0)))
                fail_msg("%s: off by %.2Lg", what, error);
        }
}

/* T01, to 1e-12 and the rounding of an end 1e6 m away: outside, camera inside and ray ending inside, a miss, a camera
 * 1e6 m away, nearly a tangent. */
static void ball_chords_are_those_of_T01(void **state)
{
    (void)state;
    const chord_case cases[] = {
        {{-5, .7L, .4L}, {.9938079899999065L, .09938079899999065L, -.04969039949999533L}, 1e18L, 3.193743884534262L},
        {{.5L, -.3L, .2L}, {0, 0, 1}, 1.2L, 1.2L},
        {{-5, 3, 0}, {1, 0, 0}, 1e18L, 0},
        {{-1000000, .5L, 0}, {1, 0, 0}, 1e18L, 3.872983346207417L},
        {{-5, 1.999L, 0}, {1, 0, 0}, 1e18L, 0.126475294030099L},
    };
    const long double radius = 2;
    expect_chords("T01", NB_FORMULA_ball, &radius, 1, cases, sizeof cases / sizeof cases[0]);
    const interval far = ask_ray(&levels[2], NB_FORMULA_ball, cases[3].p, cases[3].d, &radius, 1);
    expect("T01 far camera in floats alone: half the chord from the same middle", chord(&far), cases[3].chord, 0.05L);
}

/* T02: through, from inside along a diagonal, along an axis 1 mm within and 1 mm beyond a face. */
static void box_chords_are_those_of_T02(void **state)
{
    (void)state;
    const chord_case cases[] = {
        {{-4, .2L, 1.1L}, {.9701425001453319L, .1455213750217998L, .1940285000290664L}, 1e18L, 2.405144948276969L},
        {{.5L, .5L, 1}, {-.5773502691896258L, -.5773502691896258L, .5773502691896258L}, 1e18L, 2.598076211353316L},
        {{0, .999L, -5}, {0, 0, 1}, 1e18L, 3},
        {{0, 1.001L, -5}, {0, 0, 1}, 1e18L, 0},
    };
    const long double box[] = {-1, -1, 0, 2, 1, 3};
    expect_chords("T02", NB_FORMULA_box, box, 6, cases, sizeof cases / sizeof cases[0]);
}

static const long double t03_p[3] = {-4, .3L, .2L};
static const long double t03_d[3] = {.9897594780811197L, .1187711373697344L, -.07918075824648958L};

static void expect_ends(const char *what, const interval *got, long double enter, long double leave)
{
    expect(what, got->v[ENTER], enter, 1e-12L);
    expect(what, got->v[LEAVE], leave, 1e-12L);
}

/* T03: ellipsoid, cylinder, cone and capsule with axis y, each in the frame in which it is round and its axis is z. */
static void round_bodies_end_where_T03_says(void **state)
{
    (void)state;
    const long double *p = t03_p, *d = t03_d;
    const long double unit = 1, cone[] = {1, -1}, length = 4;
    for (int i = 0; i < 2; ++i) {
        const level *l = &levels[i];
        interval got = ask_ray(l, NB_FORMULA_ball, (long double[]){p[0] / 3, p[1], p[2] / .5L},
                               (long double[]){d[0] / 3, d[1], d[2] / .5L}, &unit, 1);
        expect_ends("T03 ellipsoid", &got, 1.416637898233143L, 4.900999179204475L);
        got = ask_ray(l, NB_FORMULA_tube, (long double[]){p[0], p[2], (p[1] + .8L) / 1.6L},
                      (long double[]){d[0], d[2], d[1] / 1.6L}, &unit, 0);
        expect_ends("T03 cylinder", &got, 3.031850626436388L, 4.20977698010503L);
        got = ask_ray(l, NB_FORMULA_cone, (long double[]){p[0], p[2], p[1] / 2}, (long double[]){d[0], d[2], d[1] / 2},
                      cone, 2);
        expect_ends("T03 cone", &got, 3.389621482435516L, 4.600054972027879L);
        got = ask_ray(l, NB_FORMULA_capsule, (long double[]){p[0] / .5L, p[2] / .5L, (p[1] + 1) / .5L},
                      (long double[]){d[0] / .5L, d[2] / .5L, d[1] / .5L}, &length, 1);
        expect_ends("T03 capsule", &got, 3.542806593106597L, 4.520689918229714L);
    }
}

static interval meet(const level *l, const interval *a, const interval *b)
{
    long double in[NB_FORMULA_INPUTS];
    memcpy(in, a->v, sizeof a->v);
    memcpy(in + 4, b->v, sizeof b->v);
    return ask(l, NB_FORMULA_meet, in);
}

static interval planes(const level *l, const long double p[3], const long double d[3], const long double (*faces)[4],
                       size_t count)
{
    const long double none[NB_FORMULA_INPUTS] = {0};
    interval body = ask(l, NB_FORMULA_all, none);
    for (size_t i = 0; i < count; ++i) {
        const interval face = ask_ray(l, NB_FORMULA_half_space, p, d, faces[i], 4);
        body = meet(l, &body, &face);
    }
    return body;
}

/* T03: an octahedron of 8 and a tetrahedron of 4 half spaces that meet. */
static void plane_bodies_end_where_T03_says(void **state)
{
    (void)state;
    long double octahedron[8][4];
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 4; ++k) octahedron[i][k] = k < 3 && (i >> k & 1) ? -1 : 1;
    const long double tetrahedron[][4] = {{-1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}, {1, 1, 1, 1}};
    const long double p[] = {-1, .25L, .3L}, d[] = {.9938079899999065L, .04969039949999533L, -.09938079899999065L};
    for (int i = 0; i < 2; ++i) {
        interval got = planes(&levels[i], t03_p, t03_d, (const long double(*)[4])octahedron, 8);
        expect_ends("T03 octahedron", &got, 3.915092591497677L, 4.125581440502929L);
        got = planes(&levels[i], p, d, tetrahedron, 4);
        expect_ends("T03 tetrahedron", &got, 1.006230589874905L, 1.535825637177487L);
    }
}

/* ---- against twice the digits ---------------------------------------------------------------- */

typedef struct quad_ray {
    nb_quad p[3], d[3];
} quad_ray;

static quad_ray exact_ray(const long double *in)
{
    quad_ray ray;
    for (int i = 0; i < 3; ++i) ray.p[i] = (nb_quad)in[i], ray.d[i] = (nb_quad)in[3 + i];
    return ray;
}

/* The ray before the march rounded it: off by 3 roundings of the distance, and by 2 of the direction (of each component
 * where the shape is not turned, as half spaces ask). */
static quad_ray ray_before_rounding(nb_formula_dice *dice, nb_formula formula, nb_formula_digits digits,
                                    const long double *in)
{
    const long double unit = nb_formula_unit(digits);
    const long double distance = fabsl(in[0]) + fabsl(in[1]) + fabsl(in[2]) + 1;
    const long double speed = sqrtl(in[3] * in[3] + in[4] * in[4] + in[5] * in[5]);
    quad_ray ray = exact_ray(in);
    for (int i = 0; i < 3; ++i) {
        ray.p[i] += (nb_quad)(nb_formula_between(dice, -3, 3) * unit * distance);
        ray.d[i] +=
            (nb_quad)(nb_formula_between(dice, -2, 2) * unit * (formula == NB_FORMULA_half_space ? in[3 + i] : speed));
    }
    return ray;
}

/* The truth used below is itself right: 20 points along a ray are between its ends where they are in the shape. */
static void truth_agrees_with_membership(void **state)
{
    (void)state;
    nb_formula_dice dice = {1};
    for (int s = 0; s < SHAPES; ++s)
        for (int i = 0; i < 2000; ++i) {
            long double in[NB_FORMULA_INPUTS];
            nb_formula_draw(&dice, shapes[s], NB_DIGITS_DOUBLE, in);
            const quad_ray ray = exact_ray(in);
            const nb_quad_interval span = nb_truth_interval(shapes[s], in, ray.p, ray.d);
            for (int k = 0; k < 20; ++k) {
                const nb_quad t = (nb_quad)(nb_formula_pick(&dice, 2) && span.hit
                                                ? (long double)span.enter + nb_formula_between(&dice, -.5L, 1.5L) *
                                                                                (long double)(span.leave - span.enter)
                                                : nb_formula_between(&dice, -10, 10));
                const nb_quad x[] = {ray.p[0] + t * ray.d[0], ray.p[1] + t * ray.d[1], ray.p[2] + t * ray.d[2]};
                const int between = span.hit && t > span.enter && t < span.leave;
                if (t < (nb_quad)1e17L && t > (nb_quad)-1e17L)
                    assert_int_equal(nb_truth_inside(shapes[s], in, x), between);
            }
        }
}

/* The worst ratio of true error and slack, and where. */
typedef struct worst {
    long double ratio, in[NB_FORMULA_INPUTS], slack, error;
} worst;

static void note(worst *w, const long double *in, long double error, long double slack)
{
    const long double ratio = error <= 0 ? 0 : slack > 0 ? error / slack : (long double)INFINITY;
    if (!(ratio <= w->ratio)) {
        w->ratio = ratio, w->slack = slack, w->error = error;
        memcpy(w->in, in, sizeof w->in);
    }
}

/* A true interval is found with both ends within their slack; where there is none, what is found is no longer than
 * both. */
static void note_interval(worst *w, const long double *in, const interval *got, const nb_quad_interval *truth)
{
    const long double *v = got->v;
    if (!truth->hit) {
        note(w, in, v[LEAVE] - v[ENTER], v[ENTER_SLACK] + v[LEAVE_SLACK]);
        return;
    }
    if (truth->enter > (nb_quad)-1e17L)
        note(w, in, fabsl((long double)((nb_quad)v[ENTER] - truth->enter)), v[ENTER_SLACK]);
    if (truth->leave < (nb_quad)1e17L)
        note(w, in, fabsl((long double)((nb_quad)v[LEAVE] - truth->leave)), v[LEAVE_SLACK]);
}

static void report(const char *what, nb_formula formula, const level *l, const worst *w)
{
    print_message("%s, %s in %s: error at most %.2Lf of the slack\n", what, formula_names[formula], l->name, w->ratio);
    if (w->ratio <= 1) return;
    for (int i = 0; i < 13; ++i) print_message(" %.21Lg", w->in[i]);
    fail_msg("error %.6Lg, slack %.6Lg", w->error, w->slack);
}

/* A ray that leans by less than the noise of the direction: only one of the ends of its half space is known. */
static int is_level(nb_formula formula, const long double *in)
{
    if (formula != NB_FORMULA_half_space) return 0;
    long double along = 0;
    for (int i = 0; i < 3; ++i) along += in[3 + i] * in[6 + i];
    return fabsl(along) <= 3 * in[12];
}

static int is_within(nb_quad t, long double end, long double slack)
{
    const nb_quad apart = t - (nb_quad)end;
    return apart <= (nb_quad)slack && apart >= -(nb_quad)slack;
}

/* Ahead of its start it is on the side that is found, or within the slack of an end. */
static void expect_sides(const long double *in, const quad_ray *ray, const interval *got)
{
    const long double *v = got->v, places[] = {1e-3L, 1, 1e3L, 1e9L, 1e15L};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; ++i) {
        const nb_quad t = (nb_quad)places[i];
        const nb_quad x[] = {ray->p[0] + t * ray->d[0], ray->p[1] + t * ray->d[1], ray->p[2] + t * ray->d[2]};
        const int is_inside = nb_truth_inside(NB_FORMULA_half_space, in, x);
        const int found_inside = places[i] > v[ENTER] && places[i] < v[LEAVE];
        if (is_inside == found_inside || is_within(t, v[ENTER], v[ENTER_SLACK])) continue;
        if (is_within(t, v[LEAVE], v[LEAVE_SLACK])) continue;
        for (int k = 0; k < 14; ++k) print_message(" %.21Lg", in[k]);
        fail_msg("%d at %Lg, not %d", found_inside, places[i], is_inside);
    }
}

static void check_slack(const char *what, int rounded)
{
    for (int l = 0; l < LEVELS; ++l) {
        if (levels[l].digits == NB_DIGITS_LONG && NB_QUAD_DIGITS == LDBL_MANT_DIG) continue;
        for (int s = 0; s < SHAPES; ++s) {
            nb_formula_dice dice = {(unsigned)(10 * l + s)};
            worst w = {0};
            for (size_t i = 0; i < nb_test_count(RAYS); ++i) {
                long double in[NB_FORMULA_INPUTS];
                nb_formula_draw(&dice, shapes[s], levels[l].digits, in);
                const quad_ray ray =
                    rounded ? ray_before_rounding(&dice, shapes[s], levels[l].digits, in) : exact_ray(in);
                const nb_quad_interval truth = nb_truth_interval(shapes[s], in, ray.p, ray.d);
                const interval got = ask(&levels[l], shapes[s], in);
                if (is_level(shapes[s], in))
                    expect_sides(in, &ray, &got);
                else
                    note_interval(&w, in, &got, &truth);
            }
            report(what, shapes[s], &levels[l], &w);
        }
    }
}

static void slack_covers_the_error_of_the_arithmetic(void **state)
{
    (void)state;
    check_slack("exact rays", 0);
}

static void slack_covers_the_rounding_of_the_ray_too(void **state)
{
    (void)state;
    check_slack("rounded rays", 1);
}

/* Slack that covered everything would be honest and useless: a ray that passes a ball well inside knows its ends to
 * some roundings of its coordinates. */
static void slack_is_small_where_rays_do_not_graze(void **state)
{
    (void)state;
    nb_formula_dice dice = {77};
    for (int l = 0; l < LEVELS; ++l)
        for (int i = 0; i < 2000; ++i) {
            const long double far = powl(10, nb_formula_between(&dice, 0, 6));
            const long double x = nb_formula_between(&dice, -.6L, .6L), y = nb_formula_between(&dice, -.6L, .6L);
            const long double unit = nb_formula_unit(levels[l].digits), reach = 8 * unit * (far + 4);
            const long double in[NB_FORMULA_INPUTS] = {x, -far, y, 0, 1, 0, 1, 0, 0, 0, 0, 0, reach};
            if (reach > .01L) continue;
            const interval got = ask(&levels[l], NB_FORMULA_ball, in);
            assert_true(is_hit(&got) && got.v[ENTER_SLACK] <= 10 * reach && got.v[LEAVE_SLACK] <= 10 * reach);
        }
}

/* ---- the bad cases --------------------------------------------------------------------------- */

typedef struct span_case {
    long double p[3], d[3], shape[6], enter, leave; /* a miss leaves first */
} span_case;

/* To 64 roundings; through an apex, where both roots are one, to the square root of one. */
static int is_near(const level *l, const interval *got, int end, long double wanted)
{
    const long double unit = nb_formula_unit(l->digits), slack = got->v[end + ENTER_SLACK];
    const long double tolerance = fmaxl(64 * unit * fmaxl(1, fabsl(wanted)), fminl(slack, 16 * sqrtl(unit)));
    return fabsl(got->v[end] - wanted) <= tolerance;
}

static void expect_span(const level *l, const char *what, size_t i, const interval *got, const span_case *wanted)
{
    const long double length = got->v[LEAVE] - got->v[ENTER], slack = got->v[ENTER_SLACK] + got->v[LEAVE_SLACK];
    const int good = wanted->leave < wanted->enter
                         ? length <= slack
                         : is_near(l, got, ENTER, wanted->enter) && is_near(l, got, LEAVE, wanted->leave);
    if (!good) fail_msg("%s %zu in %s: %.20Lg to %.20Lg", what, i, l->name, got->v[ENTER], got->v[LEAVE]);
}

static void expect_spans(const char *what, nb_formula formula, const span_case *cases, size_t count)
{
    for (int l = 0; l < LEVELS; ++l)
        for (size_t i = 0; i < count; ++i) {
            const interval got = ask_ray(&levels[l], formula, cases[i].p, cases[i].d, cases[i].shape, 6);
            expect_span(&levels[l], what, i, &got, &cases[i]);
        }
}

#define EXPECT_SPANS(what, formula, cases) expect_spans(what, formula, cases, sizeof(cases) / sizeof(cases)[0])

/* Of two boxes that touch, exactly one owns a ray in the common face, whatever the sign of the zero in its direction.
 */
static void touching_boxes_share_rays_in_the_face(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l)
        for (int axis = 0; axis < 3; ++axis)
            for (int negative = 0; negative < 2; ++negative) {
                long double p[3] = {.5L, .5L, .5L}, d[3] = {0, 0, 0},
                            box[2][6] = {{0, 0, 0, 1, 1, 1}, {0, 0, 0, 1, 1, 1}};
                p[axis] = 1, d[axis] = negative ? -0.0L : 0;
                p[(axis + 1) % 3] = -2, d[(axis + 1) % 3] = 1;
                box[1][axis] = 1, box[1][3 + axis] = 2;
                const interval a = ask_ray(&levels[l], NB_FORMULA_box, p, d, box[0], 6);
                const interval b = ask_ray(&levels[l], NB_FORMULA_box, p, d, box[1], 6);
                assert_int_equal(is_hit(&a) + is_hit(&b), 1);
                assert_int_equal(is_hit(&b), !negative);
                assert_true(chord(is_hit(&a) ? &a : &b) == 1);
            }
}

static int covers(const interval *i, long double from, long double to)
{
    return i->v[ENTER] <= from && i->v[LEAVE] >= to;
}

/* The same for half spaces that touch; beside the face a level ray is inside or outside all the way. */
static void touching_half_spaces_share_rays_in_the_face(void **state)
{
    (void)state;
    for (int l = 0; l < LEVELS; ++l)
        for (int negative = 0; negative < 2; ++negative)
            for (int side = -1; side <= 1; ++side) {
                const long double below[] = {0, 1, 0, 2, 1}, above[] = {0, -1, 0, -2, -1};
                const long double p[] = {0, 2 + side * .25L, 0}, d[] = {.6L, negative ? -0.0L : 0, -.8L};
                const interval a = ask_ray(&levels[l], NB_FORMULA_half_space, p, d, below, 5);
                const interval b = ask_ray(&levels[l], NB_FORMULA_half_space, p, d, above, 5);
                const int in_a = covers(&a, -1e6L, 1e6L), in_b = covers(&b, -1e6L, 1e6L);
                assert_int_equal(in_a, side < 0);
                assert_int_equal(in_b, side >= 0);
                assert_true(in_a || !(a.v[ENTER] < 1e6L && a.v[LEAVE] > -1e6L));
                assert_true(in_b || !(b.v[ENTER] < 1e6L && b.v[LEAVE] > -1e6L));
            }
}

/* The interval is that of the whole line: a camera inside has its start behind it, a shape behind ends before 0, and a
 * ray of no length meets nothing. */
static void cameras_inside_behind_and_of_no_length(void **state)
{
    (void)state;
    const long double inside[] = {.25L, .25L, .5L}, behind[] = {.25L, .25L, 9}, up[] = {0, 0, 1};
    const long double box[] = {-1, -1, 0, 1, 1, 1}, cone[] = {1, -.5L}, one = 1;
    const struct {
        nb_formula formula;
        const long double *shape;
        size_t size;
    } bodies[] = {{NB_FORMULA_box, box, 6},
                  {NB_FORMULA_ball, &one, 1},
                  {NB_FORMULA_tube, &one, 0},
                  {NB_FORMULA_cone, cone, 2},
                  {NB_FORMULA_capsule, &one, 1}};
    for (int l = 0; l < LEVELS; ++l)
        for (size_t i = 0; i < sizeof bodies / sizeof bodies[0]; ++i) {
            const interval in = ask_ray(&levels[l], bodies[i].formula, inside, up, bodies[i].shape, bodies[i].size);
            const interval out = ask_ray(&levels[l], bodies[i].formula, behind, up, bodies[i].shape, bodies[i].size);
            assert_true(in.v[ENTER] < 0 && in.v[LEAVE] > 0 && clipped(&in, 0) == 0);
            assert_true(is_hit(&out) && out.v[LEAVE] < 0 && clipped(&out, 1e18L) == 0);
            assert_true(fabsl(chord(&in) - chord(&out)) <= 64 * nb_formula_unit(levels[l].digits));
        }
}

/* Parallel to the axis exactly, and by less than any digit: 1e-15 is where squares meet the bound of the reciprocal. */
static void tubes_along_their_axis(void **state)
{
    (void)state;
    const span_case cases[] = {
        {{.5L, .5L, -5}, {0, 0, 1}, {0}, 5, 6},
        {{.5L, .5L, -5}, {0, -0.0L, 2}, {0}, 2.5L, 3},
        {{0, 0, -5}, {0, 0, 1}, {0}, 5, 6},
        {{.9L, .5L, -5}, {0, 0, 1}, {0}, 1, 0},
        {{.9L, .5L, -5}, {5e-16L, 0, 1}, {0}, 1, 0},
        {{.5L, .5L, -5}, {5e-16L, 0, 1}, {0}, 5, 6},
        {{-.9L, .5L, -5}, {7e-17L, 3e-16L, 1}, {0}, 1, 0},
        {{-.5L, .5L, 5}, {9e-16L, 2e-16L, -1}, {0}, 4, 5},
    };
    EXPECT_SPANS("tube", NB_FORMULA_tube, cases);
}

/* Of length 0 a ball; along the axis and beside it; across one end. */
static void capsules_long_and_of_no_length(void **state)
{
    (void)state;
    const span_case cases[] = {
        {{-5, 0, 0}, {1, 0, 0}, {0}, 4, 6},
        {{-5, .6L, 0}, {1, 0, 0}, {0}, 5 - .8L, 5 + .8L},
        {{0, 0, -5}, {0, 0, 1}, {0}, 4, 6},
        {{-5, 1.5L, 0}, {1, 0, 0}, {0}, 1, 0},
        {{.6L, 0, -5}, {0, 0, 1}, {4}, 5 - .8L, 9 + .8L},
        {{0, 0, -5}, {0, -0.0L, 1}, {4}, 4, 10},
        {{1.5L, 0, -5}, {0, 0, 1}, {4}, 1, 0},
        {{1.5L, 0, -5}, {5e-16L, 0, 1}, {4}, 1, 0},
        {{-5, 0, 4.6L}, {1, 0, 0}, {4}, 5 - .8L, 5 + .8L},
        {{-5, .6L, 2}, {1, 0, 0}, {4}, 5 - .8L, 5 + .8L},
    };
    EXPECT_SPANS("capsule", NB_FORMULA_capsule, cases);
}

/* Radius z: along the axis, through the apex, parallel to a side (the square term is 0) both ways, parallel to the axis
 * past the other nappe both ways; radius 1 - z the other way round; slope 0 a tube. */
static void cones_through_apex_and_along_sides(void **state)
{
    (void)state;
    const span_case cases[] = {
        {{0, 0, -1}, {0, 0, 1}, {0, 1}, 1, 2},
        {{-.5L, 0, -1}, {.5L, 0, 1}, {0, 1}, 1, 2},
        {{2, 0, 1}, {-2, 0, -1}, {0, 1}, 1, 0},
        {{-2, 0, 0}, {1, 0, 0}, {0, 1}, 1, 0},
        {{0, 0, .5L}, {1, 0, 1}, {0, 1}, -.25L, .5L},
        {{0, .5L, .5L}, {1, 0, 1}, {0, 1}, 0, .5L},
        {{0, .5L, .5L}, {-1, 0, -1}, {0, 1}, -.5L, 0},
        {{.5L, 0, -3}, {0, 0, 1}, {0, 1}, 3.5L, 4},
        {{.5L, 0, 3}, {0, 0, -1}, {0, 1}, 2, 2.5L},
        {{.5L, 0, -3}, {0, 0, 1}, {1, -1}, 3, 3.5L},
        {{0, 0, .5L}, {1, 0, -1}, {1, -1}, -.25L, .5L},
        {{-3, 0, .5L}, {1, 0, 0}, {0, 1}, 2.5L, 3.5L},
        {{-3, 0, .5L}, {1, 0, 0}, {.5L, .5L}, 2.25L, 3.75L},
        {{.5L, 0, -3}, {0, 0, 1}, {1, 0}, 3, 4},
        {{-3, .6L, .5L}, {1, 0, 0}, {1, 0}, 2.2L, 3.8L},
        {{-3, 0, -.5L}, {1, 0, 0}, {0, 1}, 1, 0},
    };
    EXPECT_SPANS("cone", NB_FORMULA_cone, cases);
}

static interval combine(const level *l, nb_formula formula, const long double a[4], const long double b[4])
{
    long double in[NB_FORMULA_INPUTS];
    memcpy(in, a, 4 * sizeof in[0]);
    memcpy(in + 4, b, 4 * sizeof in[0]);
    return ask(l, formula, in);
}

/* Meets and hulls, with slacks as far as any part may pull the end: 4.75 +- .5 reaches beyond 5 +- .125 by .25. */
static void meets_and_hulls_carry_the_slack_of_both(void **state)
{
    (void)state;
    const long double a[] = {5, 9, .125L, .125L}, b[] = {4.75L, 8, .5L, .25L}, apart[] = {10, 11, 0, 0};
    const long double miss[] = {1e18L, -1e18L, 0, 0}, doubtful[] = {10, 10, .25L, .25L};
    for (int l = 0; l < LEVELS; ++l) {
        const interval both = combine(&levels[l], NB_FORMULA_meet, a, b);
        assert_true(both.v[ENTER] == 5 && both.v[LEAVE] == 8);
        assert_true(both.v[ENTER_SLACK] == .25L && both.v[LEAVE_SLACK] == .25L);
        const interval none = combine(&levels[l], NB_FORMULA_meet, a, apart);
        assert_false(is_hit(&none));
        const interval hull = combine(&levels[l], NB_FORMULA_hull, a, b);
        assert_true(hull.v[ENTER] == 4.75L && hull.v[LEAVE] == 9);
        assert_true(hull.v[ENTER_SLACK] == .5L && hull.v[LEAVE_SLACK] == .125L);
        for (int order = 0; order < 2; ++order) {
            const interval one = combine(&levels[l], NB_FORMULA_hull, order ? a : miss, order ? miss : a);
            assert_true(one.v[ENTER] == 5 && one.v[LEAVE] == 9 && one.v[LEAVE_SLACK] == .125L);
            const interval may = combine(&levels[l], NB_FORMULA_hull, order ? a : doubtful, order ? doubtful : a);
            assert_true(may.v[ENTER] == 5 && may.v[LEAVE] == 10);
            assert_true(may.v[LEAVE_SLACK] == 1.125L); /* it may as well end at 9 - .125 */
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ball_chords_are_those_of_T01),
        cmocka_unit_test(box_chords_are_those_of_T02),
        cmocka_unit_test(round_bodies_end_where_T03_says),
        cmocka_unit_test(plane_bodies_end_where_T03_says),
        cmocka_unit_test(truth_agrees_with_membership),
        cmocka_unit_test(slack_covers_the_error_of_the_arithmetic),
        cmocka_unit_test(slack_covers_the_rounding_of_the_ray_too),
        cmocka_unit_test(slack_is_small_where_rays_do_not_graze),
        cmocka_unit_test(touching_boxes_share_rays_in_the_face),
        cmocka_unit_test(touching_half_spaces_share_rays_in_the_face),
        cmocka_unit_test(cameras_inside_behind_and_of_no_length),
        cmocka_unit_test(tubes_along_their_axis),
        cmocka_unit_test(capsules_long_and_of_no_length),
        cmocka_unit_test(cones_through_apex_and_along_sides),
        cmocka_unit_test(meets_and_hulls_carry_the_slack_of_both),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
