/* Lattices of light that is scattered more than once: where they are as words, their nodes as texels. */
#include "pack_diffusion.h"

#include "texel_layout.h"

#include "diffusion/diffusion.h"
#include "fog/snapshot.h"

#define MOST_DIFFUSION_TEXELS ((size_t)1 << 24) /* indices are exact floats */

/* The lattice, the one of what is beside it, and that of own light. */
enum { MOST_LATTICES = 3 };

static size_t list_lattices(const nebel_lighting *lighting, const nb_diffusion *all[MOST_LATTICES])
{
    size_t count = 0;
    for (const nb_diffusion *d = lighting->diffusion; d != NULL; d = d->beside) all[count++] = d;
    if (lighting->local_diffusion != NULL) all[count++] = lighting->local_diffusion;
    return count;
}

/* Behind the number of all channels. */
static size_t second_texels(const nb_diffusion *d)
{
    return (d->is_own ? 3 : d->has_sky ? 2 : 0) * (size_t)d->channel_count;
}

static size_t texels_of_node(const nb_diffusion *d)
{
    return 2 * (size_t)d->channel_count + 1 + second_texels(d);
}

static size_t count_diffusion_texels(const nebel_lighting *lighting)
{
    const nb_diffusion *all[MOST_LATTICES];
    const size_t lattices = list_lattices(lighting, all);
    size_t count = 0;
    for (size_t i = 0; i < lattices; i++)
        count += nb_diffusion_lattice_nodes(&all[i]->lattice) * texels_of_node(all[i]);
    return count;
}

nebel_result nb_check_lattices(const nebel_lighting *lighting)
{
    const size_t count = count_diffusion_texels(lighting);
    if (count <= MOST_DIFFUSION_TEXELS) return NEBEL_OK;
    return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                   "pack: the lattice of multiple scattering is too large for shaders: it takes %zu texels, of which "
                   "%zu can be addressed; use fewer cells, or nebel_trace or the CPU's renderer (--device cpu)",
                   count, MOST_DIFFUSION_TEXELS);
}

/* ---- words ----------------------------------------------------------------------------------- */

size_t nb_count_lattice_words(const nebel_lighting *lighting)
{
    const nb_diffusion *all[MOST_LATTICES];
    return NB_LATTICE_TEXELS * list_lattices(lighting, all);
}

static int flags_of(const nb_diffusion *d)
{
    int flags = (d->beside != NULL ? NB_LATTICE_BESIDE : 0) | (d->has_sky ? NB_LATTICE_SKY : 0) |
                (d->is_own ? NB_LATTICE_OWN : 0);
    for (int i = 0; i < 6; i++) flags |= (d->lattice.ends[i / 2][i % 2] == NB_END_LEVEL) << i;
    return flags;
}

static void pack_diffusion_lattice(const nb_diffusion *d, const long double eye[3], size_t first, nebel_texel_f32 *word)
{
    const nb_diffusion_lattice *l = &d->lattice;
    for (int a = 0; a < 3; a++) {
        word[0].v[a] = (float)((long double)l->low[a] - eye[a]);
        word[1].v[a] = (float)l->spacing[a];
        word[2].v[a] = (float)l->size[a];
    }
    word[0].v[3] = (float)first;
    word[1].v[3] = (float)d->channel_count;
    word[2].v[3] = (float)flags_of(d);
    for (int i = 0; i < 6; i++) {
        word[3 + i] = (nebel_texel_f32){{0}};
        for (int c = 0; c < 3; c++) word[3 + i].v[c] = (float)d->gain[d->channel_count == 1 ? 0 : c][i / 2][i % 2];
    }
    const double *light = d->is_own ? d->irradiance : d->skylight;
    word[9] = (nebel_texel_f32){{(float)light[0], (float)light[1], (float)light[2]}};
}

size_t nb_own_lattice_word(const nebel_lighting *lighting)
{
    return lighting->local_diffusion != NULL ? nb_count_lattice_words(lighting) - NB_LATTICE_TEXELS : 0;
}

void nb_pack_lattice_words(const nebel_lighting *lighting, const long double eye[3], nebel_texel_f32 *words)
{
    const nb_diffusion *all[MOST_LATTICES];
    const size_t lattices = list_lattices(lighting, all);
    size_t first = 0;
    for (size_t i = 0; i < lattices; i++) {
        pack_diffusion_lattice(all[i], eye, first, &words[i * NB_LATTICE_TEXELS]);
        first += nb_diffusion_lattice_nodes(&all[i]->lattice) * texels_of_node(all[i]);
    }
}

/* ---- texels ---------------------------------------------------------------------------------- */

_Static_assert(NB_NODE_DIFFUSE == 0 && NB_NODE_FLUX == 1 && NB_NODE_TURNED == 4 && NB_NODE_WIDTH == 7 &&
                   NB_NODE_NUMBERS == 8 && NB_NODE_DIMMED == 0 && NB_NODE_ABSORBED == 4 && NB_NODE_SKY_NUMBERS == 8 &&
                   NB_NODE_OWN_TURNED == 0 && NB_NODE_OWN_ONCE == 4 && NB_NODE_OWN_GLOW == 8 &&
                   NB_NODE_OWN_NUMBERS == 12,
               "what layout.h says");

static nebel_texel_f32 *pack_numbers(const float *numbers, size_t texels, nebel_texel_f32 *word)
{
    for (size_t k = 0; k < texels; k++, numbers += 4)
        *word++ = (nebel_texel_f32){{numbers[0], numbers[1], numbers[2], numbers[3]}};
    return word;
}

/* Numbers of the march lie as texels do, but for the one of all channels. Returns the word behind the last. */
static nebel_texel_f32 *pack_nodes(const nb_diffusion *d, nebel_texel_f32 *word)
{
    const size_t nodes = nb_diffusion_lattice_nodes(&d->lattice), texels = 2 * (size_t)d->channel_count;
    for (size_t i = 0; i < nodes; i++) {
        const float *numbers = &d->nodes[i * d->node_numbers];
        word = pack_numbers(numbers, texels, word);
        *word++ = (nebel_texel_f32){{numbers[4 * texels]}};
        word = pack_numbers(&numbers[4 * texels + 1], second_texels(d), word);
    }
    return word;
}

nebel_result nebel_pack_diffusion(const nebel_lighting *lighting, nebel_texel_f32 *words, size_t capacity,
                                  size_t *count)
{
    if (lighting == NULL) return NEBEL_ERROR_ARGUMENT;
    if (count == NULL || (words == NULL && capacity > 0))
        return nb_fail(&lighting->log, NEBEL_ERROR_ARGUMENT, "pack: words and count must not be NULL");
    const nebel_result result = nb_check_lattices(lighting);
    if (result != NEBEL_OK) return result;
    *count = count_diffusion_texels(lighting);
    if (words == NULL) return NEBEL_OK;
    if (capacity < *count)
        return nb_fail(&lighting->log, NEBEL_ERROR_LIMIT,
                       "pack: %zu words of multiple scattering are needed, there is room for %zu", *count, capacity);
    const nb_diffusion *all[MOST_LATTICES];
    const size_t lattices = list_lattices(lighting, all);
    for (size_t i = 0; i < lattices; i++) words = pack_nodes(all[i], words);
    return NEBEL_OK;
}
