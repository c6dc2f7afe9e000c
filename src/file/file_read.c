#define _GNU_SOURCE
#include "file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FIRST_READ = 1 << 16 };

static nebel_result fail_read(const nebel_log *log, const char *where, const char *what, const char *path, int error)
{
    return nb_fail(log, NEBEL_ERROR_FILE, "%s%scannot read the %s \"%s\": %s", where != NULL ? where : "",
                   where != NULL ? ": " : "", what, path, strerror(error));
}

int nb_file_descriptor(const char *path)
{
    static const char *const standard[] = {"/dev/stdin", "/dev/stdout", "/dev/stderr"};
    static const char *const folders[] = {"/dev/fd/", "/proc/self/fd/"};
    for (int i = 0; i < 3; i++)
        if (strcmp(path, standard[i]) == 0) return i;
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        const size_t size = strlen(folders[i]);
        const char *name = path + size;
        if (strncmp(path, folders[i], size) != 0) continue;
        const size_t digits = strspn(name, "0123456789");
        if (digits > 0 && digits < 9 && name[digits] == '\0') return atoi(name);
    }
    return -1;
}

static nebel_result refuse(const nebel_log *log, const char *where, const char *what, const char *path)
{
    return nb_fail(log, NEBEL_ERROR_FILE,
                   "%s%scannot read the %s \"%s\": it is a device, a pipe or a socket; name a file",
                   where != NULL ? where : "", where != NULL ? ": " : "", what, path);
}

/* ---- the one way to open what is read --------------------------------------------------------- */

#if defined(O_PATH)
enum { LOOK = O_PATH };
#else
enum { LOOK = O_RDONLY | O_NONBLOCK };
#endif

/* Whether it is a regular file. What is none is not opened at all: a pipe would wait, and a device may do something. */
static nebel_result look(const nebel_log *log, const char *where, const char *what, const char *path)
{
    struct stat status;
    const int file = open(path, LOOK | O_CLOEXEC | O_NOCTTY);
    if (file < 0) return fail_read(log, where, what, path, errno);
    const int error = fstat(file, &status) == 0 ? 0 : errno;
    close(file);
    if (error != 0) return fail_read(log, where, what, path, error);
    if (S_ISDIR(status.st_mode)) return fail_read(log, where, what, path, EISDIR);
    return S_ISREG(status.st_mode) ? NEBEL_OK : refuse(log, where, what, path);
}

nebel_result nb_file_open(const nebel_log *log, const char *where, const char *what, const char *path, int *file)
{
    struct stat status;
    *file = -1;
    nebel_result result = look(log, where, what, path);
    if (result != NEBEL_OK) return result;
    /* It may be another one by now. */
    const int opened = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (opened < 0) return fail_read(log, where, what, path, errno);
    if (fstat(opened, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(opened);
        return refuse(log, where, what, path);
    }
    *file = opened;
    return NEBEL_OK;
}

FILE *nb_file_open_stream(const nebel_log *log, const char *where, const char *what, const char *path)
{
    int file;
    if (nb_file_open(log, where, what, path, &file) != NEBEL_OK) return NULL;
    FILE *stream = fdopen(file, "rb");
    const int error = errno;
    if (stream != NULL) return stream;
    close(file);
    fail_read(log, where, what, path, error);
    return NULL;
}

nebel_result nb_file_check(const nebel_log *log, const char *where, const char *what, const char *path)
{
    const nebel_result result = look(log, where, what, path);
    if (result != NEBEL_OK) return result;
    return access(path, R_OK) == 0 ? NEBEL_OK : fail_read(log, where, what, path, errno);
}

/* ---- reading --------------------------------------------------------------------------------- */

/* A regular file tells its size, which saves growing; it may still be longer or shorter when it is read. */
static size_t guess_size(int file, size_t limit)
{
    struct stat status;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size <= 0) return FIRST_READ;
    return (uintmax_t)status.st_size < limit ? (size_t)status.st_size + 1 : limit + 1;
}

/* Reads to the end or until more than `limit` bytes have come. Returns 0, ENOMEM or the error of reading. */
static int read_all(const nebel_allocator *allocator, int file, size_t limit, nb_bytes *bytes)
{
    size_t wanted = guess_size(file, limit);
    while (bytes->size <= limit) {
        void *data = bytes->data;
        if (bytes->size == bytes->capacity &&
            !nb_grow(allocator, &data, 1, bytes->size, &bytes->capacity, bytes->size + wanted))
            return ENOMEM;
        bytes->data = data;
        const ssize_t count = read(file, bytes->data + bytes->size, bytes->capacity - bytes->size);
        if (count == 0) return 0;
        if (count < 0 && errno != EINTR) return errno;
        if (count > 0) bytes->size += (size_t)count;
        wanted = FIRST_READ;
    }
    return 0;
}

nebel_result nb_file_read_open(const nebel_allocator *allocator, const nebel_log *log, const char *where,
                               const char *what, const char *path, int file, size_t limit, nb_bytes *bytes)
{
    *bytes = (nb_bytes){0};
    const int error = read_all(allocator, file, limit, bytes);
    if (error == 0 && bytes->size <= limit) return NEBEL_OK;
    nb_release(allocator, bytes->data);
    const size_t size = bytes->size;
    *bytes = (nb_bytes){0};
    if (error == 0 || size > limit)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "%s%sthe %s \"%s\" is larger than %zu bytes, the most that is read",
                       where != NULL ? where : "", where != NULL ? ": " : "", what, path, limit);
    const nebel_result result = fail_read(log, where, what, path, error);
    return error == ENOMEM ? NEBEL_ERROR_MEMORY : result;
}

static nebel_result read_and_close(const nebel_allocator *allocator, const nebel_log *log, const char *where,
                                   const char *what, const char *path, int file, size_t limit, nb_bytes *bytes)
{
    const nebel_result result = nb_file_read_open(allocator, log, where, what, path, file, limit, bytes);
    close(file);
    return result;
}

nebel_result nb_file_read_stream(const nebel_allocator *allocator, const nebel_log *log, const char *what,
                                 const char *path, size_t limit, nb_bytes *bytes)
{
    *bytes = (nb_bytes){0};
    if (nb_file_descriptor(path) < 0) return nb_file_read(allocator, log, NULL, what, path, limit, bytes);
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY);
    if (file < 0) return fail_read(log, NULL, what, path, errno);
    return read_and_close(allocator, log, NULL, what, path, file, limit, bytes);
}

nebel_result nb_file_read(const nebel_allocator *allocator, const nebel_log *log, const char *where, const char *what,
                          const char *path, size_t limit, nb_bytes *bytes)
{
    int file;
    *bytes = (nb_bytes){0};
    const nebel_result result = nb_file_open(log, where, what, path, &file);
    if (result != NEBEL_OK) return result;
    return read_and_close(allocator, log, where, what, path, file, limit, bytes);
}
