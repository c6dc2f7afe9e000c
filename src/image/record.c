/* The records of pictures and films: what they were made from. Files are walked by their headers, and their checksums are
 * compared; pixels are not looked at. */
#define _POSIX_C_SOURCE 200809L
#include "movie.h"
#include "image_writer.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

/* Bytes that are looked at in one go. */
enum { PIECE = 16384 };

typedef struct record_reader {
    int file;
    uint64_t size;
    char *record; /* room for NEBEL_MAX_RECORD and the end */
} record_reader;

/* A file of more parts or channels is not ours. */
enum { MAX_PARTS = 1 << 22, MAX_CHANNELS = 1024 };

static bool read_at(const record_reader *in, uint64_t at, void *bytes, size_t size)
{
    if (at > in->size || size > in->size - at) return false;
    for (size_t got = 0; got < size;) {
        const ssize_t count = pread(in->file, (char *)bytes + got, size - got, (off_t)(at + got));
        if (count == 0 || (count < 0 && errno != EINTR)) return false;
        if (count > 0) got += (size_t)count;
    }
    return true;
}

static uint32_t number_le(const unsigned char *at)
{
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static uint32_t number_be(const unsigned char *at)
{
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

static bool take(const record_reader *in, uint64_t at, uint32_t size)
{
    if (size > NEBEL_MAX_RECORD || !read_at(in, at, in->record, size)) return false;
    in->record[size] = '\0';
    return true;
}

/* ---- PNG: chunks up to IEND ------------------------------------------------------------------- */

static bool take_text(const record_reader *in, uint64_t at, uint32_t size)
{
    static const char key[] = NB_RECORD_KEY;
    char found[sizeof key];
    if (size < sizeof key || !read_at(in, at, found, sizeof found)) return true;
    return memcmp(found, key, sizeof key) != 0 || take(in, at + sizeof key, size - (uint32_t)sizeof key);
}

/* The checksum of a chunk counts its kind and its data, and stands behind them. */
static bool has_png_checksum(const record_reader *in, uint64_t at, uint32_t size)
{
    unsigned char bytes[PIECE];
    uLong sum = crc32(0, NULL, 0);
    for (uint64_t left = 4 + (uint64_t)size; left > 0;) {
        const size_t step = left < PIECE ? (size_t)left : PIECE;
        if (!read_at(in, at, bytes, step)) return false;
        sum = crc32(sum, bytes, (uInt)step);
        at += step;
        left -= step;
    }
    return read_at(in, at, bytes, 4) && number_be(bytes) == sum;
}

/* True where the file is whole. */
static bool walk_png(const record_reader *in)
{
    unsigned char head[8];
    uint64_t at = 8;
    for (int i = 0; i < MAX_PARTS && read_at(in, at, head, sizeof head); i++) {
        const uint32_t size = number_be(head);
        if (memcmp(head + 4, "tEXt", 4) == 0 && !take_text(in, at + 8, size)) return false;
        if (!has_png_checksum(in, at + 4, size)) return false;
        at += 12 + (uint64_t)size;
        if (memcmp(head + 4, "IEND", 4) == 0) return true;
    }
    return false;
}

/* ---- OpenEXR: attributes, then the blocks as the table of their places names them ----------------- */

/* Text up to its 0; the place behind that, 0 where it is longer. */
static uint64_t read_name(const record_reader *in, uint64_t at, char name[256])
{
    for (size_t i = 0; i < 256; i++) {
        if (!read_at(in, at + i, &name[i], 1)) return 0;
        if (name[i] == '\0') return at + i + 1;
    }
    return 0;
}

typedef struct exr_facts {
    uint32_t top, width, rows, block_rows, channels;
} exr_facts;

/* A list has a name, its 0 and 16 bytes for each channel, and a 0. */
static bool count_channels(const record_reader *in, uint64_t at, uint32_t size, exr_facts *facts)
{
    char name[256];
    const uint64_t end = at + size;
    for (facts->channels = 0; facts->channels < MAX_CHANNELS; facts->channels++) {
        at = read_name(in, at, name);
        if (at == 0 || at > end) return false;
        if (name[0] == '\0') return true;
        at += 16;
    }
    return false;
}

static bool take_attribute(const record_reader *in, const char *name, uint64_t at, uint32_t size, exr_facts *facts)
{
    unsigned char bytes[16];
    if (strcmp(name, NB_RECORD_KEY) == 0) return take(in, at, size);
    if (strcmp(name, "dataWindow") == 0) {
        if (size != sizeof bytes || !read_at(in, at, bytes, sizeof bytes)) return false;
        facts->top = number_le(bytes + 4);
        facts->width = number_le(bytes + 8) - number_le(bytes) + 1;
        facts->rows = number_le(bytes + 12) - facts->top + 1;
    }
    if (strcmp(name, "channels") == 0) return count_channels(in, at, size, facts);
    if (strcmp(name, "compression") == 0) {
        if (size != 1 || !read_at(in, at, bytes, 1)) return false;
        facts->block_rows = bytes[0] == 3 ? 16 : 0; /* that of our files, ZIP */
    }
    return true;
}

/* Whether `size` bytes from there on decompress to `wanted` bytes and have their checksum. */
static bool decompresses(const record_reader *in, uint64_t at, uint32_t size, uint64_t wanted, z_stream *zip)
{
    unsigned char packed[PIECE], bytes[PIECE];
    int found = inflateReset(zip);
    for (uint64_t left = size; left > 0 && found == Z_OK;) {
        const size_t step = left < PIECE ? (size_t)left : PIECE;
        if (!read_at(in, at, packed, step)) return false;
        at += step;
        left -= step;
        zip->next_in = packed;
        zip->avail_in = (uInt)step;
        do {
            zip->next_out = bytes;
            zip->avail_out = PIECE;
            found = inflate(zip, Z_NO_FLUSH);
        } while (found == Z_OK && zip->avail_out == 0 && zip->total_out <= wanted);
        if (found == Z_BUF_ERROR) found = Z_OK; /* it waits for more */
    }
    return found == Z_STREAM_END && zip->total_out == wanted;
}

/* Blocks stand one behind the other. One that is as large as its pixels is not compressed, and has no checksum. */
static bool hold_blocks(const record_reader *in, uint64_t table, const exr_facts *facts, z_stream *zip)
{
    const uint64_t count = facts->rows / facts->block_rows + (facts->rows % facts->block_rows != 0);
    uint64_t free_from = table + 8 * count;
    unsigned char bytes[8];
    for (uint64_t i = 0; i < count; i++) {
        const uint64_t rows_left = facts->rows - i * facts->block_rows;
        const uint64_t rows = rows_left < facts->block_rows ? rows_left : facts->block_rows;
        const uint64_t pixels = rows * facts->width * facts->channels * sizeof(float);
        if (!read_at(in, table + 8 * i, bytes, sizeof bytes)) return false;
        const uint64_t block = number_le(bytes) | (uint64_t)number_le(bytes + 4) << 32;
        if (block < free_from || !read_at(in, block, bytes, sizeof bytes)) return false;
        const uint32_t size = number_le(bytes + 4);
        if (number_le(bytes) != facts->top + (uint32_t)(i * facts->block_rows)) return false;
        if (size > in->size - block - 8) return false;
        if (size != pixels && !decompresses(in, block + 8, size, pixels, zip)) return false;
        free_from = block + 8 + size;
    }
    return true;
}

static bool check_blocks(const record_reader *in, uint64_t table, const exr_facts *facts)
{
    z_stream zip = {0};
    if (facts->rows == 0 || facts->width == 0 || facts->block_rows == 0) return false;
    if (inflateInit(&zip) != Z_OK) return false;
    const bool good = hold_blocks(in, table, facts, &zip);
    (void)inflateEnd(&zip);
    return good;
}

static bool walk_exr(const record_reader *in)
{
    exr_facts facts = {0};
    char name[256], type[256];
    unsigned char size[4];
    uint64_t at = 8;
    for (int i = 0; i < MAX_PARTS; i++) {
        at = read_name(in, at, name);
        if (at == 0) return false;
        if (name[0] == '\0') return check_blocks(in, at, &facts);
        at = read_name(in, at, type);
        if (at == 0 || !read_at(in, at, size, sizeof size)) return false;
        if (!take_attribute(in, name, at + 4, number_le(size), &facts)) return false;
        at += 4 + (uint64_t)number_le(size);
    }
    return false;
}

/* ---- WebP: chunks, as many as the first one says ------------------------------------------------ */

static bool walk_webp(const record_reader *in)
{
    unsigned char head[8];
    if (!read_at(in, 0, head, sizeof head)) return false;
    const uint64_t end = 8 + (uint64_t)number_le(head + 4);
    if (end > in->size) return false;
    uint64_t at = 12;
    for (int i = 0; i < MAX_PARTS && at < end; i++) {
        if (!read_at(in, at, head, sizeof head)) return false;
        const uint32_t size = number_le(head + 4);
        if (memcmp(head, NB_FILM_RECORD, 4) == 0 && !take(in, at + 8, size)) return false;
        at += 8 + (uint64_t)size + size % 2;
    }
    return at == end;
}

/* ---- which of them ------------------------------------------------------------------------------ */

static bool walk(const record_reader *in)
{
    static const unsigned char png[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, exr[] = {0x76, 0x2f, 0x31, 0x01};
    unsigned char head[12];
    if (!read_at(in, 0, head, sizeof head)) return false;
    if (memcmp(head, png, sizeof png) == 0) return walk_png(in);
    if (memcmp(head, exr, sizeof exr) == 0) return walk_exr(in);
    return memcmp(head, "RIFF", 4) == 0 && memcmp(head + 8, "WEBP", 4) == 0 && walk_webp(in);
}

nebel_result nebel_read_record(const char *path, char record[NEBEL_MAX_RECORD + 1])
{
    struct stat status;
    int file;
    if (path == NULL || record == NULL) return NEBEL_ERROR_ARGUMENT;
    record[0] = '\0';
    if (nb_file_open(&(nebel_log){0}, NULL, "picture", path, &file) != NEBEL_OK) return NEBEL_OK;
    if (fstat(file, &status) == 0) {
        const record_reader in = {file, (uint64_t)status.st_size, record};
        if (!walk(&in)) record[0] = '\0';
    }
    close(file);
    return NEBEL_OK;
}
