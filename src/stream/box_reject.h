/* Which boxes the ways from one place miss, found without a division. Included after stream_packet.h. */
#ifndef NB_STREAM_BOX_REJECT_H
#define NB_STREAM_BOX_REJECT_H

NB_INLINE nb_vec3 nb_most3(nb_vec3 a, nb_vec3 b)
{
    return nb_vec3(nb_max(a.x, b.x), nb_max(a.y, b.y), nb_max(a.z, b.z));
}

/* A start outside two planes is left behind by them where the other end is so, too: where on some axis sign * way is
 * less than bound. The sign is 0 where the start is between the planes. */
typedef struct nb_box_reject {
    float sign[3], bound[3];
} nb_box_reject;

/* The margin covers the roundings of nb_cross_slab: beyond it a crossing comes out at 1 or more, or at 0 or less, so
 * that leaving a box out changes no bit. */
static nb_box_reject nb_make_fence(const nb_slabs *box)
{
    const float margin = 1 - 0x1p-20f;
    nb_box_reject made;
    for (int c = 0; c < 3; c++) {
        const int below = box->low[c] > 0, above = box->high[c] < 0;
        made.sign[c] = (float)(below - above);
        made.bound[c] = below ? box->low[c] * margin : above ? -box->high[c] * margin : -HUGE_VALF;
    }
    return made;
}

/* Whether all ways between low and high, lane by lane, miss the box; low and high are the same packet where `one` says
 * so, a constant. The order makes a NaN count as no miss, or leaves it to the axes after it. */
NB_INLINE int nb_is_missed(const nb_box_reject *f, nb_vec3 low, nb_vec3 high, int one)
{
    const nb_vec3 sign = nb_vec3(nb_splat(f->sign[0]), nb_splat(f->sign[1]), nb_splat(f->sign[2]));
    const nb_vec3 bound = nb_vec3(nb_splat(f->bound[0]), nb_splat(f->bound[1]), nb_splat(f->bound[2]));
    const nb_vec3 reach = one ? nb_mul3(sign, low) : nb_most3(nb_mul3(sign, low), nb_mul3(sign, high));
    const nb_vec3 short_of = nb_sub3(bound, reach);
    return nb_all(nb_max(nb_max(short_of.x, short_of.y), short_of.z) > NB_F(0.0));
}

/* The boxes that are not missed. Returns how many. */
NB_INLINE size_t nb_list_boxes(const nb_box_reject *fences, size_t count, nb_vec3 low, nb_vec3 high, int one,
                               unsigned char *list)
{
    size_t found = 0;
    for (size_t i = 0; i < count; i++) {
        list[found] = (unsigned char)i;
        found += !nb_is_missed(&fences[i], low, high, one);
    }
    return found;
}

#endif
