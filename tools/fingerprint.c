#define _POSIX_C_SOURCE 200809L
#include "fingerprint.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { READ_SIZE = 1 << 18 }; /* a multiple of 8 */

/* Offset basis and prime, 2^88 + 0x13b, of the 128-bit hash. Source: Fowler, Noll, Vo,
 * Eastlake, draft-eastlake-fnv. */
nb_fingerprint nb_fingerprint_start(void)
{
    return (nb_fingerprint){UINT64_C(0x6c62272e07bb0142), UINT64_C(0x62b821756295c58d)};
}

static nb_fingerprint multiply(nb_fingerprint print)
{
    const uint64_t by_half = (print.low & UINT32_MAX) * 0x13b, by_other = (print.low >> 32) * 0x13b + (by_half >> 32);
    return (nb_fingerprint){print.high * 0x13b + (print.low << 24) + (by_other >> 32), print.low * 0x13b};
}

void nb_fingerprint_add(nb_fingerprint *print, const void *bytes, size_t size)
{
    const unsigned char *const at = bytes;
    nb_fingerprint now = *print;
    for (size_t i = 0; i < size; i++) {
        now.low ^= at[i];
        now = multiply(now);
    }
    *print = now;
}

/* Eight bytes at a time, the first one lowest, which takes an eighth of the time; what is left at the end one by one. */
static void add_words(nb_fingerprint *print, const unsigned char *bytes, size_t size)
{
    nb_fingerprint now = *print;
    size_t i = 0;
    for (; i + 8 <= size; i += 8) {
        uint64_t word = 0;
        for (int k = 0; k < 8; k++) word |= (uint64_t)bytes[i + (size_t)k] << 8 * k;
        now.low ^= word;
        now = multiply(now);
    }
    *print = now;
    nb_fingerprint_add(print, bytes + i, size - i);
}

void nb_fingerprint_add_text(nb_fingerprint *print, const char *text)
{
    nb_fingerprint_add(print, text, strlen(text) + 1);
}

void nb_fingerprint_add_whole(nb_fingerprint *print, uint64_t number)
{
    unsigned char bytes[8];
    for (int i = 0; i < 8; i++) bytes[i] = (unsigned char)(number >> 8 * i);
    nb_fingerprint_add(print, bytes, sizeof bytes);
}

void nb_fingerprint_add_number(nb_fingerprint *print, double number)
{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    nb_fingerprint_add_whole(print, bits);
}

/* Reads as much as there is, up to READ_SIZE. 0 or an error number. */
static int fill(int file, unsigned char *buffer, size_t *count)
{
    for (*count = 0; *count < READ_SIZE;) {
        const ssize_t more = read(file, buffer + *count, READ_SIZE - *count);
        if (more < 0 && errno != EINTR) return errno;
        if (more == 0) return 0;
        if (more > 0) *count += (size_t)more;
    }
    return 0;
}

/* 0 or an error number. */
static int add_open(nb_fingerprint *print, int file, unsigned char *buffer)
{
    uint64_t size = 0;
    struct stat status;
    if (fstat(file, &status) != 0) return errno;
    if (!S_ISREG(status.st_mode)) return ENXIO; /* a device may have no end */
    size_t count = READ_SIZE;
    while (count == READ_SIZE) {
        const int error = fill(file, buffer, &count);
        if (error != 0) return error;
        add_words(print, buffer, count);
        size += count;
    }
    nb_fingerprint_add_whole(print, size);
    return 0;
}

int nb_fingerprint_add_file(nb_fingerprint *print, const char *path)
{
    unsigned char *const buffer = malloc(READ_SIZE);
    if (buffer == NULL) return ENOMEM;
    /* What is no regular file does not hold us up. */
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    int error = file < 0 ? errno : add_open(print, file, buffer);
    if (file >= 0 && close(file) != 0 && error == 0) error = errno;
    free(buffer);
    return error;
}

void nb_fingerprint_write(const nb_fingerprint *print, char text[NB_FINGERPRINT_TEXT])
{
    (void)snprintf(text, NB_FINGERPRINT_TEXT, "%016" PRIx64 "%016" PRIx64, print->high, print->low);
}
