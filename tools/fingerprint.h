/* What a file was made from, as a number of 128 bits: FNV-1a. It finds what has changed, and keeps nobody out who
 * wants to deceive. */
#ifndef NB_FINGERPRINT_H
#define NB_FINGERPRINT_H

#include <stddef.h>
#include <stdint.h>

typedef struct nb_fingerprint {
    uint64_t high, low;
} nb_fingerprint;

/* Hexadecimal digits and the end. */
enum { NB_FINGERPRINT_TEXT = 33 };

nb_fingerprint nb_fingerprint_start(void);

/* Bytes; a text with its end, so that "a", "bc" is not "ab", "c"; numbers, the same on every machine. */
void nb_fingerprint_add(nb_fingerprint *print, const void *bytes, size_t size);
void nb_fingerprint_add_text(nb_fingerprint *print, const char *text);
void nb_fingerprint_add_whole(nb_fingerprint *print, uint64_t number);
void nb_fingerprint_add_number(nb_fingerprint *print, double number);

/* What is in a regular file, in words of eight bytes, and how much; not its name or time. Returns 0, or the errno of what went wrong. */
int nb_fingerprint_add_file(nb_fingerprint *print, const char *path);

void nb_fingerprint_write(const nb_fingerprint *print, char text[NB_FINGERPRINT_TEXT]);

#endif
