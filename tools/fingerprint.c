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

enum { READ_SIZE = 1 << 18 };

/* Offset basis and prime, 2^88 + 0x13b, of the 128-bit hash. Source: Fowler, Noll, Vo,
 * Eastlake, draft-eastlake-fnv. */
nb_fingerprint nb_fingerprint_start(void)
{
    return (nb_fingerprint){UINT64_C(0x6c62272e07bb0142), UINT64_C(0x62b821756295c58d)};
}

void nb_fingerprint_add(nb_fingerprint *print, const void *bytes, size_t size)
{
    const unsigned char *const at = bytes;
    uint64_t high = print->high, low = print->low;
    for (size_t i = 0; i < size; i++) {
        low ^= at[i];
        const uint64_t by_half = (low & UINT32_MAX) * 0x13b, by_other = (low >> 32) * 0x13b + (by_half >> 32);
        high = high * 0x13b + (low << 24) + (by_other >> 32);
        low *= 0x13b;
    }
    *print = (nb_fingerprint){high, low};
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

/* 0 or an error number. */
static int add_open(nb_fingerprint *print, int file, unsigned char *buffer)
{
    uint64_t size = 0;
    struct stat status;
    if (fstat(file, &status) != 0) return errno;
    if (!S_ISREG(status.st_mode)) return ENXIO; /* a device may have no end */
    for (;;) {
        const ssize_t count = read(file, buffer, READ_SIZE);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return errno;
        if (count == 0) break;
        nb_fingerprint_add(print, buffer, (size_t)count);
        size += (size_t)count;
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
