/* NanoVDB: a file is segments; a segment is a header, an entry for each grid, and the grids, whole or compressed. A
 * grid is a tree whose nodes point to each other by offsets. PNanoVDB reads it, and checks every address against the
 * end of the memory, so that a damaged tree gives wrong voxels at worst. Source: NanoVDB's util/IO.h and NanoVDB.h,
 * version 32. */
#include "grid_file.h"

#include <blosc.h>
#include <string.h>
#include <zlib.h>

#define PNANOVDB_C
#define PNANOVDB_ADDRESS_64
#define PNANOVDB_BUF_BOUNDS_CHECK
#include <nanovdb/PNanoVDB.h>

enum {
    HEADER_SIZE = 16,
    ENTRY_SIZE = 176,
    MAJOR_VERSION = 32,
    CLASS_LEVEL_SET = 1,
    GRID_SIZE = 672, /* of the grid alone, without its tree */
    TREE_SIZE = 64,
    /* Each stands for 4096 voxels along each axis; each voxel may look at all of them. */
    MOST_TILES = 4096
};

typedef enum codec_kind { CODEC_NONE, CODEC_ZIP, CODEC_BLOSC } codec_kind;

/* Blosc's pieces hold at most this. */
#define BLOSC_PIECE ((size_t)1 << 30)

/* What an entry says. */
typedef struct entry {
    uint64_t grid_size, file_size;
    uint32_t type, grid_class, name_size;
    const char *name; /* without a zero byte where the file has none */
} entry;

typedef struct nb_nanovdb_reader {
    const nb_codec *codec;
    const nb_bytes *bytes;
    size_t at;
} nb_nanovdb_reader;

static nebel_result fail_nanovdb(const nb_nanovdb_reader *in, nebel_result result, const char *text)
{
    return nb_fail(&in->codec->log, result, "%s: %s", in->codec->name, text);
}

static nebel_result fail_short(const nb_nanovdb_reader *in)
{
    return nb_fail(&in->codec->log, NEBEL_ERROR_FORMAT, "%s: ends after %zu bytes, in the middle of what it says",
                   in->codec->name, in->bytes->size);
}

/* ---- bytes ----------------------------------------------------------------------------------- */

static size_t bytes_left(const nb_nanovdb_reader *in)
{
    return in->bytes->size - in->at;
}

static uint64_t number_at(const unsigned char *bytes, int size)
{
    uint64_t value = 0;
    for (int i = size; i-- > 0;) value = value << 8 | bytes[i];
    return value;
}

static bool is_magic(const unsigned char *bytes)
{
    return memcmp(bytes, "NanoVDB", 7) == 0 && bytes[7] >= '0' && bytes[7] <= '2';
}

/* ---- headers and entries --------------------------------------------------------------------- */

typedef struct segment {
    uint16_t count, codec;
} segment;

static nebel_result read_segment(nb_nanovdb_reader *in, segment *s)
{
    const unsigned char *header = in->bytes->data + in->at;
    if (bytes_left(in) < HEADER_SIZE)
        return in->at == 0 ? fail_nanovdb(in, NEBEL_ERROR_FORMAT, "is not a NanoVDB file") : fail_short(in);
    if (!is_magic(header)) return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "is not a NanoVDB file");
    const uint64_t major = number_at(header + 8, 4) >> 21;
    if (major != MAJOR_VERSION)
        return nb_fail(&in->codec->log, NEBEL_ERROR_UNSUPPORTED,
                       "%s: is of NanoVDB's version %u; this program reads %d", in->codec->name, (unsigned)major,
                       MAJOR_VERSION);
    *s = (segment){(uint16_t)number_at(header + 12, 2), (uint16_t)number_at(header + 14, 2)};
    if (s->codec > CODEC_BLOSC)
        return fail_nanovdb(in, NEBEL_ERROR_UNSUPPORTED, "is compressed in a way that is not known");
    in->at += HEADER_SIZE;
    return NEBEL_OK;
}

static nebel_result read_entry(nb_nanovdb_reader *in, entry *e)
{
    const unsigned char *from = in->bytes->data + in->at;
    if (bytes_left(in) < ENTRY_SIZE) return fail_short(in);
    e->grid_size = number_at(from, 8);
    e->file_size = number_at(from + 8, 8);
    e->type = (uint32_t)number_at(from + 32, 4);
    e->grid_class = (uint32_t)number_at(from + 36, 4);
    e->name_size = (uint32_t)number_at(from + 136, 4);
    e->name = (const char *)from + ENTRY_SIZE;
    in->at += ENTRY_SIZE;
    if (bytes_left(in) < e->name_size) return fail_short(in);
    in->at += e->name_size;
    return NEBEL_OK;
}

static bool is_named(const entry *e, const char *name)
{
    const size_t size = strlen(name);
    return (e->name_size == size || (e->name_size == size + 1 && e->name[size] == '\0')) &&
           memcmp(e->name, name, size) == 0;
}

/* Looks for the grid among a segment's entries; behind them in->at is where its bytes are, or the next segment. */
static nebel_result search_segment(nb_nanovdb_reader *in, const segment *s, const char *name, entry *found,
                                   bool *has_found)
{
    uint64_t before = 0, all = 0;
    for (unsigned i = 0; i < s->count; i++) {
        entry e;
        const nebel_result result = read_entry(in, &e);
        if (result != NEBEL_OK) return result;
        if (!*has_found && (name == NULL || is_named(&e, name))) {
            *found = e;
            *has_found = true;
            before = all;
        }
        if (e.file_size > in->bytes->size - all) return fail_short(in);
        all += e.file_size;
    }
    const uint64_t skipped = *has_found ? before : all;
    if (skipped > bytes_left(in)) return fail_short(in);
    in->at += (size_t)skipped;
    return NEBEL_OK;
}

static nebel_result find_grid(nb_nanovdb_reader *in, const char *name, segment *s, entry *found)
{
    bool has_found = false;
    while (!has_found) {
        if (in->at > 0 && bytes_left(in) == 0)
            return nb_fail(&in->codec->log, NEBEL_ERROR_FORMAT, "%s: holds no grid%s%s", in->codec->name,
                           name != NULL ? " of the name " : "", name != NULL ? name : "");
        nebel_result result = read_segment(in, s);
        if (result == NEBEL_OK) result = search_segment(in, s, name, found, &has_found);
        if (result != NEBEL_OK) return result;
    }
    return NEBEL_OK;
}

/* ---- compression ----------------------------------------------------------------------------- */

/* A piece: its size, then itself. */
static bool take_piece(nb_nanovdb_reader *in, const unsigned char **piece, size_t *size)
{
    if (bytes_left(in) < 8) return false;
    const uint64_t wanted = number_at(in->bytes->data + in->at, 8);
    if (wanted > bytes_left(in) - 8) return false;
    *piece = in->bytes->data + in->at + 8;
    *size = (size_t)wanted;
    in->at += 8 + (size_t)wanted;
    return true;
}

static nebel_result unzip(nb_nanovdb_reader *in, unsigned char *to, size_t size)
{
    const unsigned char *piece;
    size_t piece_size;
    uLongf written = (uLongf)size;
    if (!take_piece(in, &piece, &piece_size)) return fail_short(in);
    const int unzipped = uncompress(to, &written, piece, (uLong)piece_size);
    if (unzipped == Z_MEM_ERROR) return fail_nanovdb(in, NEBEL_ERROR_MEMORY, "out of memory");
    if (unzipped != Z_OK || written != size)
        return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "its compressed bytes are damaged");
    return NEBEL_OK;
}

static nebel_result unblosc(nb_nanovdb_reader *in, unsigned char *to, size_t size)
{
    while (size > 0) {
        const unsigned char *piece;
        size_t piece_size, says;
        const size_t wanted = size < BLOSC_PIECE ? size : BLOSC_PIECE;
        if (!take_piece(in, &piece, &piece_size)) return fail_short(in);
        if (blosc_cbuffer_validate(piece, piece_size, &says) != 0 || says != wanted ||
            blosc_decompress_ctx(piece, to, wanted, 1) != (int)wanted)
            return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "its compressed bytes are damaged");
        to += wanted;
        size -= wanted;
    }
    return NEBEL_OK;
}

static nebel_result copy_plain(const nb_nanovdb_reader *in, unsigned char *to, size_t size)
{
    if (bytes_left(in) < size) return fail_short(in);
    memcpy(to, in->bytes->data + in->at, size);
    return NEBEL_OK;
}

static nebel_result decompress(nb_nanovdb_reader *in, uint16_t codec, unsigned char *to, size_t size)
{
    if (codec == CODEC_ZIP) return unzip(in, to, size);
    return codec == CODEC_BLOSC ? unblosc(in, to, size) : copy_plain(in, to, size);
}

/* ---- the tree -------------------------------------------------------------------------------- */

typedef struct tree {
    pnanovdb_buf_t buffer;
    pnanovdb_root_handle_t root;
    uint32_t type;
    int64_t low[3]; /* index of the first active voxel along each axis */
} tree;

static bool is_known_type(uint32_t type)
{
    return type == PNANOVDB_GRID_TYPE_FLOAT || type == PNANOVDB_GRID_TYPE_DOUBLE || type == PNANOVDB_GRID_TYPE_FP4 ||
           type == PNANOVDB_GRID_TYPE_FP8 || type == PNANOVDB_GRID_TYPE_FP16 || type == PNANOVDB_GRID_TYPE_FPN;
}

/* Bytes that one byte of a file can become: deflate's limit; LZ4, which Blosc packs with, has 255. Memory is taken before
 * anything is unpacked, so that what an entry says must not be more. */
enum { MOST_EXPANSION = 1032 };

static int may_hold(const nb_nanovdb_reader *in, uint16_t codec, uint64_t size)
{
    const uint64_t left = bytes_left(in);
    return size <= left || (codec != CODEC_NONE && size / MOST_EXPANSION <= left);
}

static nebel_result check_entry(const nb_nanovdb_reader *in, uint16_t codec, const entry *e)
{
    if (!is_known_type(e->type))
        return nb_fail(&in->codec->log, NEBEL_ERROR_UNSUPPORTED,
                       "%s: its voxels are of NanoVDB's type %u; float, double, Fp4, Fp8, Fp16 and FpN are read",
                       in->codec->name, (unsigned)e->type);
    if (e->grid_class == CLASS_LEVEL_SET)
        return fail_nanovdb(in, NEBEL_ERROR_UNSUPPORTED,
                            "is a level set, which holds distances; make a fog volume of it (vdb_tool -ls2fog)");
    if (e->grid_size < GRID_SIZE + TREE_SIZE || e->grid_size > SIZE_MAX / 2)
        return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "says of its grid that it is too small or too large");
    if (!may_hold(in, codec, e->grid_size)) return fail_short(in);
    return NEBEL_OK;
}

/* The tree's own numbers, against the size of the memory it is in. */
static nebel_result open_tree(const nb_nanovdb_reader *in, const entry *e, unsigned char *memory, tree *t,
                              nb_voxels *voxels)
{
    const pnanovdb_grid_handle_t grid = {{0}};
    t->buffer = pnanovdb_make_buf((uint32_t *)(void *)memory, e->grid_size / sizeof(uint32_t));
    if (!is_magic(memory) || pnanovdb_grid_get_grid_type(t->buffer, grid) != e->type)
        return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "its grid is damaged, or is not what its entry says");
    t->root = pnanovdb_tree_get_root(t->buffer, pnanovdb_grid_get_tree(t->buffer, grid));
    const uint64_t tiles = pnanovdb_root_get_tile_count(t->buffer, t->root), root = t->root.address.byte_offset;
    const uint64_t room = PNANOVDB_GRID_TYPE_GET(t->type, root_size) +
                          (tiles <= MOST_TILES ? tiles : 0) * PNANOVDB_GRID_TYPE_GET(t->type, root_tile_size);
    if (root > e->grid_size || room > e->grid_size - root)
        return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "its tree is damaged");
    if (tiles > MOST_TILES) return fail_nanovdb(in, NEBEL_ERROR_LIMIT, "its voxels are too far apart");
    const pnanovdb_coord_t low = pnanovdb_root_get_bbox_min(t->buffer, t->root);
    const pnanovdb_coord_t high = pnanovdb_root_get_bbox_max(t->buffer, t->root);
    const int64_t first[3] = {low.x, low.y, low.z}, last[3] = {high.x, high.y, high.z};
    for (int i = 0; i < 3; i++) {
        if (first[i] > last[i]) return fail_nanovdb(in, NEBEL_ERROR_FORMAT, "has no active voxels");
        t->low[i] = first[i];
        voxels->size[i] = (size_t)(last[i] - first[i] + 1);
    }
    return NEBEL_OK;
}

static float voxel_at(const tree *t, pnanovdb_coord_t at)
{
    pnanovdb_uint32_t level;
    const pnanovdb_address_t address =
        pnanovdb_root_get_value_address_and_level(t->type, t->buffer, t->root, &at, &level);
    switch (t->type) {
    case PNANOVDB_GRID_TYPE_DOUBLE:
        return (float)pnanovdb_read_double(t->buffer, address);
    case PNANOVDB_GRID_TYPE_FP4:
        return pnanovdb_root_fp4_read_float(t->buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FP8:
        return pnanovdb_root_fp8_read_float(t->buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FP16:
        return pnanovdb_root_fp16_read_float(t->buffer, address, &at, level);
    case PNANOVDB_GRID_TYPE_FPN:
        return pnanovdb_root_fpn_read_float(t->buffer, address, &at, level);
    default:
        return pnanovdb_read_float(t->buffer, address);
    }
}

static void copy_voxels(const tree *t, nb_voxels *voxels)
{
    float *to = voxels->data;
    for (size_t z = 0; z < voxels->size[2]; z++)
        for (size_t y = 0; y < voxels->size[1]; y++)
            for (size_t x = 0; x < voxels->size[0]; x++)
                *to++ =
                    voxel_at(t, (pnanovdb_coord_t){(int32_t)(t->low[0] + (int64_t)x), (int32_t)(t->low[1] + (int64_t)y),
                                                   (int32_t)(t->low[2] + (int64_t)z)});
}

static nebel_result read_tree(nb_nanovdb_reader *in, const segment *s, const entry *e, unsigned char *memory,
                              nb_voxels *voxels)
{
    tree t = {.type = e->type};
    nebel_result result = decompress(in, s->codec, memory, (size_t)e->grid_size);
    if (result == NEBEL_OK) result = open_tree(in, e, memory, &t, voxels);
    voxels->type = NEBEL_VOXEL_FLOAT;
    if (result == NEBEL_OK) result = nb_voxels_allocate(in->codec, voxels);
    if (result == NEBEL_OK) copy_voxels(&t, voxels);
    return result;
}

nebel_result nb_nanovdb_read(const nb_codec *codec, const nb_bytes *bytes, const char *name, nb_voxels *voxels)
{
    nb_nanovdb_reader in = {codec, bytes, 0};
    segment s = {0, 0};
    entry e = {0};
    voxels->data = NULL;
    nebel_result result = find_grid(&in, name, &s, &e);
    if (result == NEBEL_OK) result = check_entry(&in, s.codec, &e);
    if (result != NEBEL_OK) return result;
    unsigned char *memory = nb_allocate_zero(&codec->allocator, (size_t)e.grid_size, 1);
    if (memory == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    result = read_tree(&in, &s, &e, memory, voxels);
    nb_release(&codec->allocator, memory);
    return result;
}
