/* Fog as words: every place is brought to the eye in long double before it becomes float. */
#include "pack_environment.h"
#include "pack_diffusion.h"
#include "texel_layout.h"
#include "pack_voxels.h"

#include "base/precision.h"
#include "diffusion/diffusion.h"
#include "fog/snapshot.h"
#include "medium/grid.h"

#include <nebel/shader.h>

#include <math.h>
#include <string.h>

#define MOST_WORDS ((size_t)1 << 24) /* indices are exact floats */

_Static_assert(NEBEL_MAX_PACKED_VOLUMES == (MOST_WORDS - NB_HEADER_TEXELS) / NB_MEDIUM_TEXELS,
               "what the public header says");

/* Beyond this a float's square is none. */
#define FARTHEST 1e18L

/* What one step of an integral may be off by, relative to the brightest source: a hundred of them stay below a grey
 * level. */
#define STEP_TOLERANCE 3e-5

typedef struct packer {
    const nebel_lighting *lighting;
    nebel_texel_f32 *words;
    size_t used; /* words behind those of the media that are taken */
    size_t rank; /* of the medium, counted from 0 */
    long double eye[3];
} packer;

static float narrow(long double x)
{
    return (float)fminl(fmaxl(x, -FARTHEST), FARTHEST);
}

static void set_word(nebel_texel_f32 *word, const long double v[3], double last)
{
    for (int i = 0; i < 3; i++) word->v[i] = narrow(v[i]);
    word->v[3] = (float)last;
}

static void set_color(nebel_texel_f32 *word, const double v[3], double last)
{
    for (int i = 0; i < 3; i++) word->v[i] = (float)v[i];
    word->v[3] = (float)last;
}

_Static_assert(NEBEL_FEATURE_MIXED == NB_HAS_MIXED && NEBEL_FEATURE_GRID == NB_HAS_GRID &&
                   NEBEL_FEATURE_LIGHTS == NB_HAS_LIGHTS && NEBEL_FEATURE_DIFFUSION == NB_HAS_DIFFUSION &&
                   NEBEL_FEATURE_ENVIRONMENT == NB_HAS_ENVIRONMENT && NEBEL_FEATURE_OVERRIDE == NB_HAS_OVERRIDE &&
                   NEBEL_FEATURE_GROUP == NB_HAS_GROUP && NEBEL_FEATURE_SUN == NB_HAS_SUN,
               "the public names of features");

/* ---- leaves ---------------------------------------------------------------------------------- */

static int type_of(const nb_leaf *leaf)
{
    switch (leaf->type) {
    case NB_LEAF_PLANES:
        return NB_TYPE_PLANES;
    case NB_LEAF_BOX:
        return NB_TYPE_BOX;
    case NB_LEAF_SPHERE:
        return NB_TYPE_SPHERE;
    case NB_LEAF_CYLINDER:
        return NB_TYPE_CYLINDER;
    case NB_LEAF_CONE:
        return NB_TYPE_CONE;
    case NB_LEAF_CAPSULE:
        return NB_TYPE_CAPSULE;
    default:
        return NB_TYPE_WORLD;
    }
}

static void apply(const long double matrix[9], const long double v[3], long double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = matrix[3 * i] * v[0] + matrix[3 * i + 1] * v[1] + matrix[3 * i + 2] * v[2];
}

static void way_to_eye(const packer *p, const nb_leaf *leaf, long double way[3])
{
    for (int i = 0; i < 3; i++) way[i] = (p->eye[i] - leaf->exact_origin[i]) - leaf->exact_rest[i];
}

/* In the world's axes around the eye; the power of two keeps the largest component near 1 and changes no digit. A soft
 * edge has units of its own: `edge` is how deep it is, 0 where there is none. */
static void pack_face(const nb_leaf *leaf, const nb_face *face, const long double way[3], double edge,
                      nebel_texel_f32 *word)
{
    long double normal[3], largest = 0, distance = (long double)face->distance;
    for (int i = 0; i < 3; i++) {
        normal[i] = 0;
        for (int j = 0; j < 3; j++) normal[i] += leaf->exact_matrix[3 * j + i] * (long double)face->normal[j];
        distance -= normal[i] * way[i];
        largest = fmaxl(largest, fabsl(normal[i]));
    }
    int exponent;
    frexpl(largest, &exponent);
    const long double scale = edge > 0 ? (long double)(face->inverse_length / edge) : ldexpl(1, -exponent);
    for (int i = 0; i < 3; i++) word->v[i] = narrow(normal[i] * scale);
    word->v[3] = narrow(distance * scale);
}

static void pack_faces(packer *p, const nb_volume *body, const nb_leaf *leaf, nebel_texel_f32 *word)
{
    long double way[3];
    const double edge = body->density.type == NEBEL_DENSITY_SOFT_EDGE ? body->density.edge_width : 0;
    way_to_eye(p, leaf, way);
    word->v[1] = (float)leaf->face_count;
    word->v[2] = (float)p->used;
    for (size_t i = 0; i < leaf->face_count; i++)
        pack_face(leaf, &body->faces[leaf->first_face + i], way, edge, &p->words[p->used++]);
}

static void pack_frame(const packer *p, const nb_leaf *leaf, nebel_texel_f32 *word)
{
    long double way[3], place[3], low[3], high[3];
    way_to_eye(p, leaf, way);
    apply(leaf->exact_matrix, way, place);
    for (int i = 0; i < 3; i++) {
        low[i] = (long double)leaf->low[i] - place[i];
        high[i] = (long double)leaf->high[i] - place[i];
    }
    const int box = leaf->type == NB_LEAF_BOX;
    set_word(&word[1], box ? low : place, 0);
    if (box) set_word(&word[2], high, 0);
    for (int i = 0; i < 3; i++) set_word(&word[3 + i], &leaf->exact_matrix[3 * i], 0);
}

static void pack_leaf(packer *p, const nb_volume *body, const nb_leaf *leaf, unsigned folds, nebel_texel_f32 *word)
{
    memset(word, 0, NB_LEAF_TEXELS * sizeof *word);
    const int framed = leaf->type != NB_LEAF_WORLD && leaf->type != NB_LEAF_PLANES;
    word->v[0] = (float)(type_of(leaf) + (framed && !leaf->aligned ? NB_TYPE_ROTATED : 0));
    word->v[1] = (float)(leaf->type == NB_LEAF_CAPSULE ? leaf->length : leaf->radius);
    word->v[2] = (float)leaf->slope;
    word->v[3] = (float)folds;
    if (leaf->type == NB_LEAF_PLANES) pack_faces(p, body, leaf, word);
    if (framed) pack_frame(p, leaf, word);
}

/* The steps of the program behind a leaf, up to the next one: see layout.h. */
static unsigned folds_behind(const nb_volume *body, size_t *step)
{
    unsigned folds = 0, above = 1;
    for (; *step < body->step_count && body->steps[*step] != NB_OP_LEAF; ++*step, above <<= 1)
        if (body->steps[*step] == NB_OP_INTERSECTION) folds |= above;
    return folds | above;
}

static void pack_group(packer *p, const nb_volume *body, nebel_texel_f32 *word)
{
    long double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        const long double margin =
            1e-6L * (fabsl((long double)body->low[i] - p->eye[i]) + fabsl((long double)body->high[i] - p->eye[i]));
        low[i] = (long double)body->low[i] - p->eye[i] - (isfinite(margin) ? margin : 0);
        high[i] = (long double)body->high[i] - p->eye[i] + (isfinite(margin) ? margin : 0);
    }
    memset(word, 0, NB_LEAF_TEXELS * sizeof *word);
    nebel_texel_f32 *leaves = &p->words[p->used];
    set_word(&word[0], low, (double)p->used);
    set_word(&word[1], high, 0);
    p->used += body->leaf_count * NB_LEAF_TEXELS;
    size_t step = 1;
    for (size_t i = 0; i < body->leaf_count; i++, step++)
        pack_leaf(p, body, &body->leaves[i], folds_behind(body, &step), &leaves[i * NB_LEAF_TEXELS]);
}

/* ---- profiles -------------------------------------------------------------------------------- */

static int kind_of(const nb_volume *body)
{
    if (!nb_volume_has_fog(body)) return NB_KIND_EXCLUDE;
    switch (body->density.type) {
    case NEBEL_DENSITY_HEIGHT:
        return body->density.below == NEBEL_BELOW_GROW ? NB_KIND_HEIGHT : NB_KIND_HEIGHT_CAPPED;
    case NEBEL_DENSITY_LINEAR:
        return NB_KIND_LINEAR;
    case NEBEL_DENSITY_GAUSSIAN:
        return NB_KIND_GAUSSIAN;
    case NEBEL_DENSITY_SOFT_EDGE:
        return body->leaves[0].type == NB_LEAF_BOX      ? NB_KIND_SOFT_EDGE
               : body->leaves[0].type == NB_LEAF_PLANES ? NB_KIND_SOFT_PLANES
                                                        : NB_KIND_SOFT_ROUND;
    case NEBEL_DENSITY_GRID:
        return NB_KIND_GRID;
    case NEBEL_DENSITY_ALTITUDE:
        return NB_KIND_ALTITUDE;
    case NEBEL_DENSITY_RADIAL:
        return NB_KIND_RADIAL + body->density.power - 1;
    default:
        return NB_KIND_CONSTANT;
    }
}

/* gradient . x + value = 0 at `from`, 1 at `to` */
static void pack_linear(const packer *p, const nebel_density *density, nebel_texel_f32 *word)
{
    long double axis[3], square = 0, value = 0;
    for (int i = 0; i < 3; i++) {
        axis[i] = (long double)density->to[i] - (long double)density->from[i];
        square += axis[i] * axis[i];
        value += axis[i] * (p->eye[i] - (long double)density->from[i]);
    }
    for (int i = 0; i < 3; i++) word->v[i] = narrow(axis[i] / square);
    word->v[3] = narrow(value / square);
}

static void pack_grid_rate(const nb_volume *body, nebel_texel_f32 *word)
{
    double rate[3];
    nb_grid_rate(body->density.grid, body->leaves[0].low, body->leaves[0].high, rate);
    for (int i = 0; i < 3; i++) word->v[i] = narrow((long double)rate[i]);
}

/* The height in all its digits: the shader's have none left of a planet's radius. */
static void pack_altitude(packer *p, const nebel_density *density, nebel_texel_f32 *word)
{
    const long double scale = (long double)density->scale_height;
    long double way[3], square = 0;
    for (int i = 0; i < 3; i++) {
        way[i] = p->eye[i] - (long double)density->center[i];
        square += way[i] * way[i];
        word->v[i] = narrow(way[i]);
    }
    const int grows = density->below == NEBEL_BELOW_GROW;
    const long double height = sqrtl(square) - (long double)density->radius - (long double)density->base;
    word->v[3] = (float)p->used;
    p->words[p->used++] = (nebel_texel_f32){
        {narrow(scale), grows ? narrow(scale * (long double)NB_GROWTH_DEPTH) : 0, grows ? 1e18f : 1, narrow(height)}};
}

static void pack_density(packer *p, const nb_volume *body, nebel_texel_f32 *word)
{
    const nebel_density *density = &body->density;
    const long double height = density->type == NEBEL_DENSITY_HEIGHT ? (long double)density->scale_height : 1;
    memset(word, 0, sizeof *word);
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        word->v[1] = narrow(1 / height);
        word->v[3] = narrow((p->eye[1] - (long double)density->base) / height);
        break;
    case NEBEL_DENSITY_LINEAR:
        pack_linear(p, density, word);
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        for (int i = 0; i < 3; i++) word->v[i] = narrow(p->eye[i] - (long double)density->center[i]);
        word->v[3] = narrow(0.70710678118654752440L / (long double)density->sigma);
        break;
    case NEBEL_DENSITY_SOFT_EDGE:
        word->v[0] = (float)body->edge.gain;
        word->v[1] = (float)body->edge.steepness;
        word->v[2] = (float)body->edge.inner;
        word->v[3] = narrow(1 / (long double)density->edge_width);
        break;
    case NEBEL_DENSITY_GRID:
        pack_grid_rate(body, word);
        break;
    case NEBEL_DENSITY_ALTITUDE:
        pack_altitude(p, density, word);
        break;
    default:
        break;
    }
}

/* ---- scattering ------------------------------------------------------------------------------ */

/* Whether anything needs to know what it scatters: of ambient light diffusion does. */
static int scatters(const nebel_lighting *lighting, size_t number)
{
    const nb_medium *medium = &lighting->snapshot->media[number];
    const nb_medium_light *lit = &lighting->media[number];
    const int is_diffuse = (lighting->diffusion != NULL && nb_medium_is_lit(medium, lit)) ||
                           (lighting->local_diffusion != NULL && nb_medium_scatters(medium));
    return lit->scatters_sun || lit->scatters_lights || is_diffuse;
}

static void pack_scattering(packer *p, size_t number, nebel_texel_f32 *word)
{
    const nb_medium *medium = &p->lighting->snapshot->media[number];
    const nb_phase *phase = &medium->body.phase;
    nebel_texel_f32 *scattering = &p->words[p->used];
    if (!scatters(p->lighting, number)) return;
    word[NB_MEDIUM_SCATTERING].v[3] = (float)p->used;
    word[NB_MEDIUM_AHEAD].v[3] = (float)medium->ahead;
    p->used += NB_SCATTERING_TEXELS;
    memset(scattering, 0, NB_SCATTERING_TEXELS * sizeof *scattering);
    set_color(&scattering[0], medium->body.albedo, phase->lobe_count);
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        scattering[1 + i] =
            (nebel_texel_f32){{(float)lobe->factor, (float)lobe->alpha, (float)lobe->peak, (float)lobe->slope}};
    }
}

static void pack_sun(const nebel_lighting *lighting, nebel_texel_f32 word[2])
{
    memset(word, 0, 2 * sizeof *word);
    if (!lighting->scatters_sun) return;
    const nb_sun_depth_method way = lighting->sun_depth_method;
    const int form = way == NB_SUN_DEPTH_FLAT ? NB_SUN_FLAT : way == NB_SUN_DEPTH_HEIGHT ? NB_SUN_HEIGHT : NB_SUN_STEPS;
    set_color(&word[0], lighting->to_sun, form);
    set_color(&word[1], lighting->irradiance, 0);
}

static void pack_light(const packer *p, const nb_light *light, nebel_texel_f32 word[NB_LIGHT_TEXELS])
{
    long double place[3];
    for (int i = 0; i < 3; i++) place[i] = (long double)light->place[i] - p->eye[i];
    memset(word, 0, NB_LIGHT_TEXELS * sizeof *word);
    set_word(&word[0], place, light->radius2);
    set_color(&word[1], light->intensity, light->clear);
    set_color(&word[2], light->axis, light->is_spot ? light->edge : -1);
    word[3].v[0] = light->is_spot ? (float)light->rise : 1e30f; /* without a cone everything is within */
    word[3].v[1] = (float)light->inner;
}

static void pack_lights(packer *p, const nebel_lighting *lighting)
{
    if (!lighting->scatters_lights) return;
    p->words[0].v[3] = (float)lighting->light_count;
    p->words[NB_HEADER_LIGHTS].v[3] = (float)p->used;
    for (size_t i = 0; i < lighting->light_count; i++, p->used += NB_LIGHT_TEXELS)
        pack_light(p, &lighting->lights[i], &p->words[p->used]);
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* The length along which a density changes, 0 where it does not or where it goes by its body. */
static double length_of(const nebel_density *density)
{
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
    case NEBEL_DENSITY_ALTITUDE:
        return density->scale_height;
    case NEBEL_DENSITY_GAUSSIAN:
        return density->sigma;
    default:
        return 0;
    }
}

/* How wide fog is: the widest of its bodies; where none has bounds, the lengths of densities, or how far light goes. */
static double width_of(const nebel_lighting *lighting)
{
    double body = 0, length = 0, way = 0;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_volume *b = &lighting->snapshot->media[i].body;
        for (int k = 0; k < 3; k++) {
            const double width = b->high[k] - b->low[k];
            if (width < HUGE_VAL) body = fmax(body, width);
            if (b->extinction[k] > 0) way = fmax(way, 1 / b->extinction[k]);
        }
        length = fmax(length, length_of(&b->density));
    }
    return body > 0 ? body : length > 0 ? length : way;
}

/* Floats near 1 are as fine as a tenth of that. */
static float nearest_distance(const nebel_lighting *lighting)
{
    const double width = width_of(lighting);
    return (float)(1e-6 * (width > 0 && width < 1 ? width : 1));
}

static double light_flags(const nb_medium *medium, size_t rank)
{
    return (medium->emits ? NB_LIGHT_EMITS : 0) + (nb_volume_covers(&medium->body) ? NB_LIGHT_COVERS : 0) +
           NB_LIGHT_RANK * (double)rank;
}

static void pack_medium(packer *p, size_t number, nebel_texel_f32 *word)
{
    const nb_medium *medium = &p->lighting->snapshot->media[number];
    const nb_medium_light *lit = &p->lighting->media[number];
    const nb_volume *body = &medium->body;
    const int by_direction = lit->environment != NULL;
    set_color(&word[0], body->extinction, kind_of(body));
    set_color(&word[1], by_direction ? body->emission : lit->light, light_flags(medium, p->rank));
    set_color(&word[2], by_direction ? body->albedo : lit->radiance, (double)body->leaf_count);
    pack_density(p, body, &word[3]);
    if (body->leaf_count > 1)
        pack_group(p, body, &word[NB_MEDIUM_LEAF]);
    else
        pack_leaf(p, body, &body->leaves[0], 1, &word[NB_MEDIUM_LEAF]);
    word[NB_MEDIUM_START].v[3] = (float)body->start;
    word[NB_MEDIUM_CUTOFF].v[3] = narrow((long double)body->cutoff);
    pack_scattering(p, number, word);
}

static size_t count_fog_words(const nebel_lighting *lighting)
{
    size_t count = NB_HEADER_TEXELS + lighting->snapshot->medium_count * NB_MEDIUM_TEXELS;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_volume *body = &lighting->snapshot->media[i].body;
        count += body->face_count + (body->leaf_count > 1 ? body->leaf_count * NB_LEAF_TEXELS : 0);
        count += scatters(lighting, i) ? NB_SCATTERING_TEXELS : 0;
        count += body->density.type == NEBEL_DENSITY_ALTITUDE;
    }
    if (lighting->scatters_lights) count += lighting->light_count * NB_LIGHT_TEXELS;
    return count + nb_count_lattice_words(lighting);
}

nebel_result nebel_pack_fog(const nebel_lighting *lighting, const double eye[3], nebel_texel_f32 *words,
                            size_t capacity, size_t *count)
{
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    if (eye == NULL || count == NULL || (words == NULL && capacity > 0))
        return nb_fail(&lighting->log, NEBEL_ERROR_ARGUMENT, "pack: eye, words and count must not be NULL");
    for (int i = 0; i < 3; i++)
        if (!(fabs(eye[i]) <= 1e15))
            return nb_fail(&lighting->log, NEBEL_ERROR_ARGUMENT,
                           "pack: the eye must be finite and at most 1e15 m away");
    nebel_result result = nb_check_voxels(lighting);
    if (result == NEBEL_OK) result = nb_check_lattices(lighting);
    if (result == NEBEL_OK) result = nb_check_environment(lighting);
    if (result != NEBEL_OK) return result;
    *count = count_fog_words(lighting);
    if (*count > MOST_WORDS)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                       "pack: %zu volumes are too many for shaders: they take %zu words, of which %zu can be "
                       "addressed; use fewer volumes, or nebel_trace",
                       lighting->snapshot->medium_count, *count, MOST_WORDS);
    if (words == NULL) return NEBEL_OK;
    if (capacity < *count)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT, "pack: %zu words are needed, there is room for %zu", *count,
                       capacity);
    packer p = {lighting,
                words,
                NB_HEADER_TEXELS + lighting->snapshot->medium_count * NB_MEDIUM_TEXELS,
                0,
                {(long double)eye[0], (long double)eye[1], (long double)eye[2]}};
    words[0] = (nebel_texel_f32){{(float)lighting->snapshot->medium_count,
                                  (float)(STEP_TOLERANCE * fmax(1, lighting->largest_radiance)),
                                  (float)lighting->snapshot->max_opacity, 0}};
    pack_sun(lighting, &words[NB_HEADER_SUN]);
    words[NB_HEADER_LATTICE] = (nebel_texel_f32){{0, 0, nearest_distance(lighting), 0}};
    const unsigned precision = nb_full_precision();
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        if (i > 0 && lighting->snapshot->media[i].body.rank > lighting->snapshot->media[i - 1].body.rank) p.rank++;
        pack_medium(&p, i, &words[NB_HEADER_TEXELS + i * NB_MEDIUM_TEXELS]);
    }
    pack_lights(&p, lighting);
    if (lighting->diffusion != NULL) words[NB_HEADER_LATTICE].v[0] = (float)p.used;
    if (lighting->local_diffusion != NULL)
        words[NB_HEADER_LATTICE].v[1] = (float)(p.used + nb_own_lattice_word(lighting));
    nb_pack_lattice_words(lighting, p.eye, &words[p.used]);
    nb_restore_precision(precision);
    nb_place_voxels(lighting, words);
    nb_place_filters(lighting, words);
    return NEBEL_OK;
}

/* ---- features -------------------------------------------------------------------------------- */

static uint32_t features_of_leaf(const nb_leaf *leaf)
{
    static const uint32_t bits[] = {[NB_TYPE_WORLD] = 0,
                                    [NB_TYPE_PLANES] = NB_HAS_PLANES,
                                    [NB_TYPE_BOX] = NB_HAS_BOX,
                                    [NB_TYPE_SPHERE] = NB_HAS_SPHERE,
                                    [NB_TYPE_CYLINDER] = NB_HAS_CYLINDER,
                                    [NB_TYPE_CONE] = NB_HAS_CONE,
                                    [NB_TYPE_CAPSULE] = NB_HAS_CAPSULE};
    const int framed = leaf->type != NB_LEAF_WORLD && leaf->type != NB_LEAF_PLANES;
    return bits[type_of(leaf)] | (framed && !leaf->aligned ? NB_HAS_ROTATED : 0);
}

static uint32_t features_of_kind(int kind)
{
    if (kind == NB_KIND_CONSTANT) return 0;
    if (kind <= NB_KIND_LINEAR) return NB_HAS_SLOPE;
    if (kind == NB_KIND_GAUSSIAN) return NB_HAS_GAUSSIAN;
    if (kind == NB_KIND_SOFT_EDGE) return NB_HAS_SOFT_EDGE;
    if (kind == NB_KIND_SOFT_ROUND) return NB_HAS_SOFT_ROUND;
    if (kind == NB_KIND_SOFT_PLANES) return NB_HAS_SOFT_PLANES;
    if (kind == NB_KIND_GRID) return NB_HAS_GRID;
    if (kind == NB_KIND_ALTITUDE) return NB_HAS_ALTITUDE;
    return kind == NB_KIND_EXCLUDE ? 0 : NB_HAS_RADIAL;
}

/* Whether two media may differ in their quotient of light and extinction, on which the walk for light depends. */
static int is_mixed(const nebel_lighting *lighting)
{
    const nb_medium *media = lighting->snapshot->media;
    const nb_medium_light *first = NULL;
    int first_emits = 0;
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_medium_light *lit = &lighting->media[i];
        if (!nb_volume_has_fog(&media[i].body)) continue;
        if (first == NULL) {
            first = lit;
            first_emits = media[i].emits;
            continue;
        }
        if (media[i].emits || first_emits || lit->environment != first->environment) return 1;
        for (int c = 0; c < 3; c++)
            if (lit->radiance[c] < first->radiance[c] || lit->radiance[c] > first->radiance[c]) return 1;
    }
    return 0;
}

uint32_t nebel_pack_features(const nebel_lighting *lighting)
{
    if (lighting == NULL) return NB_HAS_ALL;
    uint32_t features = (lighting->snapshot->medium_count > 1 ? NB_HAS_SEVERAL : 0) |
                        (is_mixed(lighting) ? NB_HAS_MIXED : 0) |
                        (lighting->snapshot->max_opacity < 1 ? NB_HAS_MAX_OPACITY : 0) |
                        (lighting->scatters_sun ? NB_HAS_SUN : 0) | (lighting->scatters_lights ? NB_HAS_LIGHTS : 0) |
                        (lighting->diffusion != NULL || lighting->local_diffusion != NULL ? NB_HAS_DIFFUSION : 0) |
                        (lighting->environment_light_count > 0 ? NB_HAS_ENVIRONMENT : 0);
    for (size_t i = 0; i < lighting->snapshot->medium_count; i++) {
        const nb_volume *body = &lighting->snapshot->media[i].body;
        features |= features_of_kind(kind_of(body)) | (body->leaf_count > 1 ? NB_HAS_GROUP : 0) |
                    (nb_volume_covers(body) ? NB_HAS_OVERRIDE : 0) |
                    (nb_volume_has_distances(body) ? NB_HAS_DISTANCES : 0);
        for (size_t k = 0; k < body->leaf_count; k++) features |= features_of_leaf(&body->leaves[k]);
    }
    return features;
}
