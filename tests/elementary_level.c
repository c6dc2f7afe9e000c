/* One level of elementary_level.h; NB_LEVEL is its name, the macros of prelude.h say what it is. */
#include "elementary_level.h"

#include "formulas/prelude.h"
#include "formulas/elementary.inc"

#define JOIN_EXPANDED(a, b) a##b
#define JOIN(a, b) JOIN_EXPANDED(a, b)

static nb_real evaluate(nb_elementary function, nb_real a, nb_real b)
{
    switch (function) {
#define CASE(name, expression)                                                                                         \
    case NB_ELEMENTARY_##name:                                                                                         \
        return expression;
        NB_ELEMENTARY_FUNCTIONS(CASE)
#undef CASE
    case NB_ELEMENTARY_COUNT:
        break;
    }
    return a;
}

void JOIN(nb_elementary_, NB_LEVEL)(nb_elementary function, size_t count, const nb_scalar *a, const nb_scalar *b,
                                    nb_scalar *result)
{
    for (size_t i = 0; i < count; i += NB_WIDTH)
        nb_store_lanes(result + i, evaluate(function, nb_load_lanes(a + i), nb_load_lanes(b + i)));
}

/* Lane `one` holds 1, the others 0. */
static nb_real one_hot(int one)
{
    nb_scalar lanes[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) lanes[i] = (nb_scalar)(i == one);
    return nb_load_lanes(lanes);
}

static const char *check_masks(int one)
{
    const nb_real x = one_hot(one);
    const nb_mask hot = x > NB_F(0.5);
    const nb_wmask wide_hot = nb_widen(x) > NB_W(0.5);
    if (!nb_any(hot) || !nb_wany(wide_hot)) return "any misses a lane";
    if (nb_all(nb_not(hot)) || nb_wall(nb_wnot(wide_hot))) return "all misses a lane";
    if (nb_any(nb_and(hot, nb_not(hot))) || nb_wany(nb_wand(wide_hot, nb_wnot(wide_hot)))) return "any sees a lane";
    if (!nb_all(nb_or(hot, nb_not(hot))) || !nb_wall(nb_wor(wide_hot, nb_wnot(wide_hot)))) return "all sees no lane";
    if (nb_any(nb_xor(hot, nb_narrow_mask(wide_hot)))) return "a narrow mask differs";
    if (nb_wany(nb_wxor(wide_hot, nb_widen_mask(hot)))) return "a wide mask differs";
    return NULL;
}

static const char *check_lanes(void)
{
    double from[NB_WIDTH], to[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) from[i] = i + 0.5;
    const nb_wide x = nb_wload_lanes(from);
    nb_wstore_lanes(to, x + x);
    for (int i = 0; i < NB_WIDTH; ++i) {
        if (to[i] != 2 * from[i]) return "wide load or store";
        if ((double)nb_lane(x, i) != from[i]) return "a wide lane";
        if ((double)nb_lane(nb_narrow(x), i) != from[i]) return "a lane";
    }
    const nb_wmask equal = nb_wsplat(0.25) == NB_W(0.25);
    const nb_mask same = nb_splat((nb_scalar)0.25) == NB_F(0.25);
    return nb_wall(equal) && nb_all(same) ? NULL : "a splat";
}

const char *JOIN(nb_elementary_lanes_, NB_LEVEL)(void)
{
    for (int one = 0; one < NB_WIDTH; ++one) {
        const char *fault = check_masks(one);
        if (fault) return fault;
    }
    if (!nb_all(nb_mask_true) || nb_any(nb_mask_false) || !nb_wall(nb_wmask_true) || nb_wany(nb_wmask_false))
        return "the constant masks";
    return check_lanes();
}
