#include "sun_shadow_maps.h"

#include "gl_camera.h"
#include "gl_panorama.h"
#include "gl_state.h"

#include "math/vector.h"

#include <math.h>

/* ---- what is seen ---------------------------------------------------------------------------- */

typedef struct rectangle {
    double low[2], high[2];
} rectangle;

/* The surfaces of a picture, block by block of pixels: the nearest and the farthest of each. */
typedef struct nb_seen_survey {
    const nebel_rays *rays;
    int panorama;
    const float *blocks;    /* four floats each */
    uint32_t columns, rows; /* of blocks */
    uint32_t width, height; /* pixels */
    double nearest, farthest;
    rectangle seen[NB_CASCADES];
    double low[3], high[3]; /* a box around the fog that the sun lights, relative to the eye */
} nb_seen_survey;

static rectangle nothing(void)
{
    return (rectangle){{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
}

static void include_point(rectangle *r, const double at[2])
{
    for (int i = 0; i < 2; i++) {
        r->low[i] = fmin(r->low[i], at[i]);
        r->high[i] = fmax(r->high[i], at[i]);
    }
}

static void clip(rectangle *r, const rectangle *to)
{
    for (int i = 0; i < 2; i++) {
        r->low[i] = fmax(r->low[i], to->low[i]);
        r->high[i] = fmin(r->high[i], to->high[i]);
    }
}

static void use_axes(nb_shadows *shadows, const double sun[3])
{
    for (int i = 0; i < 3; i++) {
        shadows->light[3 * i] = (float)shadows->across[0][i];
        shadows->light[3 * i + 1] = (float)shadows->across[1][i];
        shadows->light[3 * i + 2] = (float)sun[i];
    }
}

void nb_shadows_turn(nb_shadows *shadows, const double sun[3])
{
    double axis[3] = {0, 0, 0};
    int least = 0;
    for (int i = 1; i < 3; i++) {
        if (fabs(sun[i]) < fabs(sun[least])) least = i;
    }
    axis[least] = 1;
    nb_vector_cross(axis, sun, shadows->across[0]);
    (void)nb_vector_make_unit(shadows->across[0]);
    nb_vector_cross(shadows->across[0], sun, shadows->across[1]);
    use_axes(shadows, sun);
}

/* The middle of the widest gap between angles, of which a quarter of a circle more is the same. */
static double widest_gap(double angles[3])
{
    static const double quarter = 1.5707963267948966;
    double middle = 0, widest = 0;
    for (int i = 0; i < 3; i++) {
        double gap = quarter;
        for (int k = 0; k < 3; k++) {
            const double apart = angles[k] - angles[i], ahead = apart - quarter * floor(apart / quarter);
            if (k != i && ahead < gap && ahead > 0) gap = ahead;
        }
        if (gap > widest) {
            widest = gap;
            middle = angles[i] + .5 * gap;
        }
    }
    return middle;
}

void nb_shadows_turn_fog(nb_shadows *shadows, const double sun[3])
{
    double angles[3], turned[2][3];
    nb_shadows_turn(shadows, sun);
    for (int i = 0; i < 3; i++) angles[i] = atan2(shadows->across[1][i], shadows->across[0][i]);
    const double turn = widest_gap(angles);
    for (int i = 0; i < 3; i++) {
        turned[0][i] = cos(turn) * shadows->across[0][i] + sin(turn) * shadows->across[1][i];
        turned[1][i] = cos(turn) * shadows->across[1][i] - sin(turn) * shadows->across[0][i];
    }
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++) shadows->across[k][i] = turned[k][i];
    }
    use_axes(shadows, sun);
}

static void find_distances(nb_seen_survey *s)
{
    const size_t count = (size_t)s->columns * s->rows;
    s->nearest = HUGE_VAL;
    s->farthest = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(s->blocks[4 * i] > 0)) continue;
        s->nearest = fmin(s->nearest, (double)s->blocks[4 * i]);
        s->farthest = fmax(s->farthest, (double)s->blocks[4 * i + 1]);
    }
}

/* Distances grow by the same factor from map to map, as texels on the screen shrink. */
static void set_ends(nb_shadows *shadows, const nb_seen_survey *s)
{
    for (int k = 0; k < NB_CASCADES; k++) {
        const double share = (k + 1.) / NB_CASCADES;
        shadows->ends[k] = (float)(s->nearest * pow(s->farthest / s->nearest, share));
    }
    shadows->ends[NB_CASCADES - 1] = HUGE_VALF;
}

/* words + x words + y words */
static void combine(const nebel_texel_f32 words[3], double x, double y, double v[3])
{
    for (int i = 0; i < 3; i++) v[i] = (double)words[0].v[i] + x * (double)words[1].v[i] + y * (double)words[2].v[i];
}

/* The rays through the corners of a block. Distances along a ray are `size` times the steps along its way. */
typedef struct beam {
    double origin[4][3], way[4][3];
    double least_size, most_size;
} beam;

/* Pixels from the left, and from below. */
typedef struct extent {
    double left, low, right, high;
} extent;

static extent block_extent(const nb_seen_survey *s, uint32_t column, uint32_t row)
{
    const double left = column * (double)NB_SURVEY_BLOCK, low = row * (double)NB_SURVEY_BLOCK;
    return (extent){left, low, fmin(left + NB_SURVEY_BLOCK, s->width), fmin(low + NB_SURVEY_BLOCK, s->height)};
}

/* Of a length, which bends away from its tangent plane, that plane is a lower bound, and the corners an upper. */
static beam make_beam(const nb_seen_survey *s, const extent *e)
{
    beam b = {.least_size = HUGE_VAL};
    double middle[3];
    combine(s->rays->texels + 3, .5 * (e->left + e->right), .5 * (e->low + e->high), middle);
    const double size = nb_vector_length(middle);
    for (int i = 0; i < 4; i++) {
        const double x = i & 1 ? e->right : e->left, y = i & 2 ? e->high : e->low;
        combine(s->rays->texels, x, y, b.origin[i]);
        combine(s->rays->texels + 3, x, y, b.way[i]);
        b.least_size = fmin(b.least_size, nb_vector_dot(middle, b.way[i]) / size);
        b.most_size = fmax(b.most_size, nb_vector_length(b.way[i]));
    }
    return b;
}

/* Light coordinates are affine along each of two ways across the beam and one along it: the corners bound them. */
static void include_beam(const nb_shadows *shadows, const beam *b, double near, double far, rectangle *seen)
{
    const double steps[2] = {near / b->most_size, far / b->least_size};
    for (int i = 0; i < 8; i++) {
        double at[2];
        for (int k = 0; k < 2; k++) {
            at[k] = nb_vector_dot(shadows->across[k], b->origin[i / 2]) +
                    steps[i & 1] * nb_vector_dot(shadows->across[k], b->way[i / 2]);
        }
        include_point(seen, at);
    }
}

/* Half the opening of the cone around a block of a panorama: its corners are the farthest from its middle, unless it
 * reaches around. */
static double opening_of(const nb_seen_survey *s, const extent *e, const double middle[3])
{
    double least = 1;
    if (2 * (e->right - e->left) > s->width) return 3.2;
    for (int i = 0; i < 4; i++) {
        double corner[3];
        nb_panorama_direction(s->rays, i & 1 ? e->right : e->left, i & 2 ? e->high : e->low, corner);
        least = fmin(least, nb_vector_dot(middle, corner));
    }
    return acos(fmax(least, -1)) + 1e-6;
}

static void include_cone(const nb_shadows *shadows, const double middle[3], double opening, double near, double far,
                         rectangle *seen)
{
    double at[2][2];
    for (int k = 0; k < 2; k++) {
        const double angle = acos(fmin(fmax(nb_vector_dot(shadows->across[k], middle), -1), 1));
        const double most = cos(fmax(angle - opening, 0)), least = cos(fmin(angle + opening, 3.1415926535897932));
        at[0][k] = fmin(near * least, far * least);
        at[1][k] = fmax(near * most, far * most);
    }
    include_point(seen, at[0]);
    include_point(seen, at[1]);
}

static void include_round(const nb_shadows *shadows, const nb_seen_survey *s, const extent *e, double near, double far,
                          rectangle *seen)
{
    double middle[3];
    nb_panorama_direction(s->rays, .5 * (e->left + e->right), .5 * (e->low + e->high), middle);
    include_cone(shadows, middle, opening_of(s, e, middle), near, far, seen);
}

static void include_block(const nb_shadows *shadows, const nb_seen_survey *s, const extent *e, double near, double far,
                          rectangle *seen)
{
    if (s->panorama) {
        include_round(shadows, s, e, near, far, seen);
    } else {
        const beam b = make_beam(s, e);
        include_beam(shadows, &b, near, far, seen);
    }
}

/* Surfaces may be anywhere between the nearest and the farthest of their block. */
static void find_rectangles(const nb_shadows *shadows, nb_seen_survey *s)
{
    for (int k = 0; k < NB_CASCADES; k++) s->seen[k] = nothing();
    for (uint32_t row = 0; row < s->rows; row++) {
        for (uint32_t column = 0; column < s->columns; column++) {
            const float *const block = s->blocks + 4 * ((size_t)row * s->columns + column);
            if (!(block[0] > 0)) continue;
            const extent e = block_extent(s, column, row);
            double from = 0;
            for (int k = 0; k < NB_CASCADES; k++) {
                const double near = fmax(from, (double)block[0]),
                             far = fmin((double)shadows->ends[k], (double)block[1]);
                if (near <= far) include_block(shadows, s, &e, near, far, &s->seen[k]);
                from = (double)shadows->ends[k];
            }
        }
    }
}

/* How wide a pixel is at most: what other samples may see beside the surveyed. */
static double pixel_width(const nb_seen_survey *s, double t)
{
    double width = 0;
    if (s->panorama) return t * fmax(6.3 / s->width, 3.2 / s->height);
    for (int i = 0; i < 3; i++) {
        width = fmax(width, fabs((double)s->rays->texels[1].v[i]) + t * fabs((double)s->rays->texels[4].v[i]));
        width = fmax(width, fabs((double)s->rays->texels[2].v[i]) + t * fabs((double)s->rays->texels[5].v[i]));
    }
    return width;
}

/* Some texels at the borders belong to the filter. */
static void lay_map(nb_shadows *shadows, const nb_seen_survey *s, int map, const rectangle *seen)
{
    enum { BORDER = 4 };
    const rectangle r = *seen;
    if (!(r.low[0] <= r.high[0] && r.low[1] <= r.high[1])) {
        shadows->ends[map] = 0;
        return;
    }
    const double pixel = 2 * pixel_width(s, fmin((double)shadows->ends[map], s->farthest));
    for (int i = 0; i < 2; i++) {
        const double margin = pixel + .01 * (r.high[i] - r.low[i]);
        const double side = r.high[i] - r.low[i] + 2 * margin;
        const double texels = (shadows->size - 2. * BORDER) / side;
        shadows->places[map][i] = (float)(r.low[i] - margin - BORDER / texels);
        shadows->places[map][2 + i] = (float)texels;
        shadows->seen_low[i] = fmin(shadows->seen_low[i], r.low[i] - margin);
        shadows->seen_high[i] = fmax(shadows->seen_high[i], r.high[i] + margin);
    }
}

/* Over which all that may cast shadows lies. */
static rectangle casting(const nb_shadows *shadows, const double eye[3], const nb_meshes *meshes)
{
    rectangle r = nothing();
    for (int corner = 0; corner < 8; corner++) {
        double at[2] = {0, 0};
        for (int i = 0; i < 3; i++) {
            const double way = (corner >> i & 1 ? meshes->high[i] : meshes->low[i]) - eye[i];
            for (int k = 0; k < 2; k++) at[k] += shadows->across[k][i] * way;
        }
        include_point(&r, at);
    }
    return r;
}

/* Heights of all that may cast shadows, and how fine floats are there. */
static void find_heights(nb_shadows *shadows, const double eye[3], const nb_meshes *meshes)
{
    double low = HUGE_VAL, high = -HUGE_VAL, farthest = 0;
    for (int corner = 0; corner < 8; corner++) {
        double height = 0;
        for (int i = 0; i < 3; i++) {
            const double way = (corner >> i & 1 ? meshes->high[i] : meshes->low[i]) - eye[i];
            height += (double)shadows->light[3 * i + 2] * way;
            farthest = fmax(farthest, fabs(way));
        }
        low = fmin(low, height);
        high = fmax(high, height);
    }
    shadows->rounding = (float)(0x1p-20 * farthest);
    shadows->low = (float)low - shadows->rounding;
    shadows->high = (float)high + shadows->rounding;
}

/* Of ground the maps cover what lies in the way of the sun's light past all that casts shadows, and are shared out over the
 * distances of that. */
static void leave_ground(const nb_shadows *shadows, nb_seen_survey *s, const double eye[3], const nb_meshes *meshes)
{
    const rectangle all = casting(shadows, eye, meshes);
    for (int k = 0; k < NB_CASCADES && shadows->sees_ground; k++) clip(&s->seen[k], &all);
}

/* The same for distances. */
static void bound_distances(const nb_shadows *shadows, nb_seen_survey *s, const double eye[3], const nb_meshes *meshes)
{
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double way = fmax(fabs(meshes->low[i] - eye[i]), fabs(meshes->high[i] - eye[i]));
        square += way * way;
    }
    if (shadows->sees_ground) s->farthest = fmax(s->nearest, fmin(s->farthest, 4 * sqrt(square)));
}

static void draw_survey(const nb_context *context, unsigned program, const nb_targets *targets)
{
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, targets->survey_buffer);
    nb_state_clear(context, 0, 0, targets->survey_width, targets->survey_height);
    glUseProgram(program);
    glUniform2i(glGetUniformLocation(program, "scene_size"), (GLint)targets->width, (GLint)targets->height);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_PLACE);
    glBindTexture(GL_TEXTURE_2D, targets->place);
    glBindSampler(NB_UNIT_PLACE, 0);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static int read_survey(nb_shadows *shadows, const nebel_allocator *allocator, const nb_targets *targets)
{
    const size_t wanted = 4 * (size_t)targets->survey_width * targets->survey_height;
    if (wanted > shadows->capacity) {
        nb_release(allocator, shadows->blocks);
        shadows->blocks = nb_allocate(allocator, wanted, sizeof *shadows->blocks);
        shadows->capacity = shadows->blocks != NULL ? wanted : 0;
    }
    if (shadows->blocks == NULL) return 0;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets->survey_buffer);
    glReadPixels(0, 0, (GLsizei)targets->survey_width, (GLsizei)targets->survey_height, GL_RGBA, GL_FLOAT,
                 shadows->blocks);
    return 1;
}

nebel_result nb_shadows_fit(nb_shadows *shadows, const nb_context *context, const nebel_allocator *allocator,
                            const nebel_log *log, unsigned program, const nb_targets *targets, const nebel_rays *rays,
                            int panorama, const nb_meshes *meshes)
{
    nb_seen_survey s = {.rays = rays,
                        .panorama = panorama,
                        .columns = targets->survey_width,
                        .rows = targets->survey_height,
                        .width = targets->width,
                        .height = targets->height};
    for (int i = 0; i < 2; i++) {
        shadows->seen_low[i] = HUGE_VAL;
        shadows->seen_high[i] = -HUGE_VAL;
    }
    draw_survey(context, program, targets);
    if (!read_survey(shadows, allocator, targets)) {
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory; ask for fewer pixels");
    }
    s.blocks = shadows->blocks;
    find_distances(&s);
    if (!(s.farthest > 0)) return NEBEL_OK;
    bound_distances(shadows, &s, rays->eye, meshes);
    set_ends(shadows, &s);
    find_rectangles(shadows, &s);
    leave_ground(shadows, &s, rays->eye, meshes);
    for (int k = 0; k < NB_CASCADES; k++) lay_map(shadows, &s, k, &s.seen[k]);
    find_heights(shadows, rays->eye, meshes);
    return NEBEL_OK;
}

static int is_empty(const rectangle *r)
{
    return !(r->low[0] <= r->high[0] && r->low[1] <= r->high[1]);
}

/* How far from the eye across the light, at least and at most. */
static void find_radii(const rectangle *r, double *nearest, double *farthest)
{
    double near[2], far[2];
    for (int k = 0; k < 2; k++) {
        near[k] = fmax(fmax(r->low[k], -r->high[k]), 0);
        far[k] = fmax(fabs(r->low[k]), fabs(r->high[k]));
    }
    *nearest = hypot(near[0], near[1]);
    *farthest = hypot(far[0], far[1]);
}

typedef struct nb_depth_range {
    double low, high;
} nb_depth_range;

/* Leaves of the distances t those where low <= origin + t way <= high may hold. */
static void clip_distances(nb_depth_range origin, nb_depth_range way, double low, double high, nb_depth_range *t)
{
    const double rise[2] = {way.high, -way.low}, over[2] = {origin.high - low, high - origin.low};
    for (int i = 0; i < 2; i++) {
        if (rise[i] > 0) t->low = fmax(t->low, -over[i] / rise[i]);
        if (rise[i] < 0) t->high = fmin(t->high, -over[i] / rise[i]);
        if (rise[i] == 0 && over[i] < 0) t->high = -HUGE_VAL;
    }
}

static nb_depth_range range_of(const double corners[4][3], int axis)
{
    nb_depth_range r = {corners[0][axis], corners[0][axis]};
    for (int i = 1; i < 4; i++) {
        r.low = fmin(r.low, corners[i][axis]);
        r.high = fmax(r.high, corners[i][axis]);
    }
    return r;
}

/* Leaves of the distances those where the rays of a block may be in sunlit fog. */
static void clip_to_fog(const nb_seen_survey *s, const extent *e, nb_depth_range *t)
{
    if (s->panorama) {
        double middle[3];
        nb_panorama_direction(s->rays, .5 * (e->left + e->right), .5 * (e->low + e->high), middle);
        const double most = 2 * sin(.5 * fmin(opening_of(s, e, middle), 3.1415926535897932));
        for (int i = 0; i < 3; i++)
            clip_distances((nb_depth_range){0, 0}, (nb_depth_range){middle[i] - most, middle[i] + most}, s->low[i],
                           s->high[i], t);
        return;
    }
    const beam b = make_beam(s, e);
    nb_depth_range steps = {t->low / b.most_size, t->high / b.least_size};
    for (int i = 0; i < 3; i++)
        clip_distances(range_of(b.origin, i), range_of(b.way, i), s->low[i], s->high[i], &steps);
    *t = (nb_depth_range){fmax(t->low, steps.low * b.least_size), fmin(t->high, steps.high * b.most_size)};
}

/* Places, and how near to the eye and how far from it they are across the light. */
typedef struct region {
    rectangle around;
    double nearest, farthest;
} region;

/* Of all places in sunlit fog before the surfaces of the blocks, those within a rectangle. Where a block has pixels
 * without surface, rays go on to `reach`. */
static region places_before(const nb_shadows *shadows, const nb_seen_survey *s, double reach, const rectangle *within)
{
    region all = {.around = nothing(), .nearest = HUGE_VAL};
    for (uint32_t row = 0; row < s->rows; row++) {
        for (uint32_t column = 0; column < s->columns; column++) {
            const float *const block = s->blocks + 4 * ((size_t)row * s->columns + column);
            const extent e = block_extent(s, column, row);
            rectangle r = nothing();
            double nearest, farthest;
            nb_depth_range t = {0, block[2] > 0 ? reach : (double)block[1]};
            clip_to_fog(s, &e, &t);
            if (!(t.low <= t.high)) continue;
            include_block(shadows, s, &e, t.low, t.high, &r);
            clip(&r, within);
            if (is_empty(&r)) continue;
            find_radii(&r, &nearest, &farthest);
            all.nearest = fmin(all.nearest, nearest);
            all.farthest = fmax(all.farthest, farthest);
            include_point(&all.around, r.low);
            include_point(&all.around, r.high);
        }
    }
    return all;
}

/* Rays from the eye go away from it across the light. What a texel is off along a ray is in proportion to the way there
 * where texels are in proportion to the distance across: each map is a square around the eye, its side a multiple of the
 * one before. */
static void lay_squares(nb_shadows *shadows, const nb_seen_survey *s, double reach, const region *seen)
{
    static const double most_ratio = 4096;
    const double farthest = seen->farthest, nearest = fmax(seen->nearest, farthest / most_ratio);
    for (int k = 0; k < shadows->count; k++) {
        const double side = nearest * pow(farthest / nearest, (k + 1.) / shadows->count);
        rectangle square = {{-side, -side}, {side, side}};
        clip(&square, &seen->around);
        square = places_before(shadows, s, reach, &square).around;
        lay_map(shadows, s, k, &square);
    }
}

/* Parallel rays have no such place: the maps lie side by side, along the longer side. */
static void lay_tiles(nb_shadows *shadows, const nb_seen_survey *s, const rectangle *seen)
{
    const int axis = seen->high[1] - seen->low[1] > seen->high[0] - seen->low[0], columns = shadows->count / 2;
    for (int k = 0; k < shadows->count; k++) {
        const int place[2] = {k % columns, k / columns}, most[2] = {columns, 2};
        rectangle tile;
        for (int i = 0; i < 2; i++) {
            const int way = i == axis ? 0 : 1;
            const double step = (seen->high[i] - seen->low[i]) / most[way];
            tile.low[i] = seen->low[i] + place[way] * step;
            tile.high[i] = tile.low[i] + step;
        }
        lay_map(shadows, s, k, &tile);
    }
}

static int are_parallel(const nb_seen_survey *s)
{
    int same = !s->panorama;
    for (int i = 0; i < 3; i++)
        same = same && s->rays->texels[4].v[i] == 0 && s->rays->texels[5].v[i] == 0; /* directions do not change */
    return same;
}

void nb_shadows_fit_fog(nb_shadows *shadows, const nb_shadows *surfaces, const nb_targets *targets,
                        const nebel_rays *rays, int panorama, const nb_meshes *meshes, const nb_sunlit_fog *fog)
{
    static const double longest = 1000; /* times the way across: of rays nearly along the light */
    nb_seen_survey s = {.rays = rays,
                        .panorama = panorama,
                        .blocks = surfaces->blocks,
                        .columns = targets->survey_width,
                        .rows = targets->survey_height,
                        .width = targets->width,
                        .height = targets->height};
    for (int i = 0; i < 3; i++) {
        s.low[i] = fog->bounds.min[i] - rays->eye[i];
        s.high[i] = fog->bounds.max[i] - rays->eye[i];
    }
    const rectangle all = casting(shadows, rays->eye, meshes);
    double nearest;
    find_radii(&all, &nearest, &s.farthest);
    const double reach = longest * s.farthest;
    const region seen = places_before(shadows, &s, reach, &all);
    for (int k = 0; k < shadows->count; k++) shadows->ends[k] = is_empty(&seen.around) ? 0 : 1;
    find_heights(shadows, rays->eye, meshes);
    if (is_empty(&seen.around)) return;
    if (are_parallel(&s)) {
        lay_tiles(shadows, &s, &seen.around);
    } else {
        lay_squares(shadows, &s, reach, &seen);
    }
}

/* ---- maps ------------------------------------------------------------------------------------ */

static nebel_result make_shadow_texture(nb_shadows *shadows, const nebel_log *log)
{
    const GLsizei size = (GLsizei)shadows->size;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADOWS);
    shadows->texture = nb_targets_make_array();
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, size, size, shadows->count, 0, GL_DEPTH_COMPONENT,
                 GL_FLOAT, NULL);
    glGenFramebuffers(1, &shadows->buffer);
    glBindFramebuffer(GL_FRAMEBUFFER, shadows->buffer);
    const GLenum none = GL_NONE;
    glDrawBuffers(1, &none);
    glReadBuffer(GL_NONE);
    return nb_context_check_memory(log, "the shadow maps; ask for smaller ones");
}

/* Whether a mesh reaches over the map. */
static int is_in_map(const nb_shadows *shadows, int map, const nb_mesh *mesh, const double eye[3])
{
    rectangle r = nothing();
    for (int corner = 0; corner < 8; corner++) {
        double at[2] = {0, 0};
        for (int i = 0; i < 3; i++) {
            const double p = (double)(corner >> i & 1 ? mesh->high[i] : mesh->low[i]) + (mesh->origin[i] - eye[i]);
            for (int k = 0; k < 2; k++) at[k] += shadows->across[k][i] * p;
        }
        include_point(&r, at);
    }
    const float *const place = shadows->places[map];
    for (int i = 0; i < 2; i++) {
        const double end = (double)place[i] + shadows->size / (double)place[2 + i];
        if (!(r.high[i] >= (double)place[i] && r.low[i] <= end)) return 0;
    }
    return 1;
}

/* Slope up to which what leans counts as leaning: of steeper faces the sun sees hardly anything. */
enum { MOST_LEAN = 4 };

static void draw_map(const nb_shadows *shadows, int map, unsigned program, const nb_meshes *meshes, const double eye[3])
{
    const float *const place = shadows->places[map], size = (float)shadows->size;
    const GLint offset = glGetUniformLocation(program, "scene_offset"),
                cutoff = glGetUniformLocation(program, "scene_cutoff");
    glUniform3f(glGetUniformLocation(program, "map_low"), place[0], place[1], shadows->low);
    glUniform3f(glGetUniformLocation(program, "map_scale"), 2 * place[2] / size, 2 * place[3] / size,
                2 / (shadows->high - shadows->low));
    const float texel = 1 / fminf(place[2], place[3]) / (shadows->high - shadows->low);
    glUniform1f(glGetUniformLocation(program, "map_lean"), shadows->leaning ? MOST_LEAN * texel : 0);
    for (size_t i = 0; i < meshes->count; i++) {
        const nb_mesh *const mesh = &meshes->list[i];
        float from_eye[3];
        if (!is_in_map(shadows, map, mesh, eye)) continue;
        nb_camera_subtract(mesh->origin, eye, from_eye);
        glUniform3fv(offset, 1, from_eye);
        nb_meshes_bind_mask(mesh, cutoff);
        glBindVertexArray(mesh->vertex_array);
        glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    }
}

nebel_result nb_shadows_draw(nb_shadows *shadows, const nb_context *context, const nebel_log *log, unsigned program,
                             const nb_meshes *meshes, const double eye[3])
{
    static const GLfloat empty = 1;
    if (shadows->texture == 0) {
        const nebel_result result = make_shadow_texture(shadows, log);
        if (result != NEBEL_OK) return result;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, shadows->buffer);
    nb_state_clear(context, 0, 0, shadows->size, shadows->size);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glUseProgram(program);
    glUniformMatrix3fv(glGetUniformLocation(program, "scene_light"), 1, GL_FALSE, shadows->light);
    for (int map = 0; map < shadows->count; map++) {
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, shadows->texture, 0, map);
        glClearBufferfv(GL_DEPTH, 0, &empty);
        if (shadows->ends[map] > 0) draw_map(shadows, map, program, meshes, eye);
    }
    return NEBEL_OK;
}

void nb_shadows_delete(const nb_shadows *shadows)
{
    glDeleteFramebuffers(1, &shadows->buffer);
    glDeleteTextures(1, &shadows->texture);
}
