/* PNG (ISO 15948) with stored blocks of zlib (RFC 1950, 1951). */
#include "height_map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 65535 };

static void put(uint8_t **to, uint32_t value, int bytes)
{
    for (int i = bytes - 1; i >= 0; i--) *(*to)++ = (uint8_t)(value >> 8 * i);
}

static uint32_t checksum(const uint8_t *bytes, size_t size)
{
    uint32_t crc = ~0u;
    for (size_t i = 0; i < size; i++) {
        crc ^= bytes[i];
        for (int k = 0; k < 8; k++) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320u : 0);
    }
    return ~crc;
}

static uint32_t adler(const uint8_t *bytes, size_t size)
{
    uint32_t a = 1, b = 0;
    for (size_t i = 0; i < size; i++) {
        a = (a + bytes[i]) % 65521;
        b = (b + a) % 65521;
    }
    return b << 16 | a;
}

/* A chunk's name stands before its data, in the same memory. */
static void write_chunk(const uint8_t *named, size_t size, FILE *file)
{
    uint8_t numbers[8], *at = numbers;
    put(&at, (uint32_t)size - 4, 4);
    put(&at, checksum(named, size), 4);
    (void)fwrite(numbers, 1, 4, file);
    (void)fwrite(named, 1, size, file);
    (void)fwrite(numbers + 4, 1, 4, file);
}

/* Rows of big-endian samples, each after a filter byte of 0. */
static void set_rows(const nb_terrain *terrain, uint32_t side, uint8_t *row)
{
    float low = INFINITY, high = -INFINITY;
    for (uint32_t v = 0; v < terrain->vertex_count; v++) {
        low = fminf(low, terrain->positions[3 * (size_t)v + 1]);
        high = fmaxf(high, terrain->positions[3 * (size_t)v + 1]);
    }
    for (uint32_t v = 0; v < terrain->vertex_count; v++) {
        if (v % side == 0) *row++ = 0;
        const float height = (terrain->positions[3 * (size_t)v + 1] - low) / (high - low);
        put(&row, (uint32_t)(height * 65535 + .5f), 2);
    }
}

/* Returns the size of the chunk. */
static size_t pack(const uint8_t *rows, size_t size, uint8_t *chunk)
{
    uint8_t *at = chunk;
    memcpy(at, "IDAT\x78\x01", 6);
    at += 6;
    for (size_t first = 0; first < size; first += BLOCK) {
        const uint32_t count = size - first < BLOCK ? (uint32_t)(size - first) : BLOCK;
        *at++ = first + count == size;
        *at++ = (uint8_t)count;
        *at++ = (uint8_t)(count >> 8);
        *at++ = (uint8_t)~count;
        *at++ = (uint8_t)(~count >> 8);
        memcpy(at, rows + first, count);
        at += count;
    }
    put(&at, adler(rows, size), 4);
    return (size_t)(at - chunk);
}

static void write_head(uint32_t side, FILE *file)
{
    uint8_t head[17] = "IHDR", *at = head + 4;
    put(&at, side, 4);
    put(&at, side, 4);
    put(&at, 16u << 24, 4); /* 16 bits, grey */
    *at = 0;                /* not interlaced */
    (void)fwrite("\x89PNG\r\n\x1a\n", 1, 8, file);
    write_chunk(head, sizeof head, file);
}

int nb_height_map_write(const nb_terrain *terrain, FILE *file)
{
    const uint32_t side = (uint32_t)lrint(sqrt(terrain->vertex_count));
    const size_t size = (size_t)side * (2 * (size_t)side + 1);
    uint8_t *const rows = malloc(size), *const chunk = malloc(size + 5 * (size / BLOCK + 1) + 10);
    if (rows != NULL && chunk != NULL) {
        set_rows(terrain, side, rows);
        write_head(side, file);
        write_chunk(chunk, pack(rows, size, chunk), file);
        write_chunk((const uint8_t *)"IEND", 4, file);
    }
    const int status = rows != NULL && chunk != NULL ? 0 : -1;
    free(rows);
    free(chunk);
    return status;
}
