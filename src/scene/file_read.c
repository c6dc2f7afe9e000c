#define _POSIX_C_SOURCE 200809L
#include "scene/file.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FIRST_READ = 1 << 16 };

static nebel_result fail(const nebel_log *log, const char *where, const char *what, const char *path, int error)
{
    return nb_fail(log, NEBEL_ERROR_FILE, "%s%scannot read the %s \"%s\": %s", where != NULL ? where : "",
                   where != NULL ? ": " : "", what, path, strerror(error));
}

static nebel_result refuse(const nebel_log *log, const char *where, const char *what, const char *path)
{
    return nb_fail(log, NEBEL_ERROR_FILE,
                   "%s%scannot read the %s \"%s\": it is a device, a pipe or a socket; name a file",
                   where != NULL ? where : "", where != NULL ? ": " : "", what, path);
}

nebel_result nb_file_check(const nebel_log *log, const char *where, const char *what, const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0) return fail(log, where, what, path, errno);
    if (S_ISDIR(status.st_mode)) return fail(log, where, what, path, EISDIR);
    if (!S_ISREG(status.st_mode)) return refuse(log, where, what, path);
    return access(path, R_OK) == 0 ? NEBEL_OK : fail(log, where, what, path, errno);
}

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
    const nebel_result result = fail(log, where, what, path, error);
    return error == ENOMEM ? NEBEL_ERROR_MEMORY : result;
}

nebel_result nb_file_read_stream(const nebel_allocator *allocator, const nebel_log *log, const char *what,
                                 const char *path, size_t limit, nb_bytes *bytes)
{
    *bytes = (nb_bytes){0};
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY);
    if (file < 0) return fail(log, NULL, what, path, errno);
    const nebel_result result = nb_file_read_open(allocator, log, NULL, what, path, file, limit, bytes);
    close(file);
    return result;
}

nebel_result nb_file_read(const nebel_allocator *allocator, const nebel_log *log, const char *where, const char *what,
                          const char *path, size_t limit, nb_bytes *bytes)
{
    *bytes = (nb_bytes){0};
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK); /* a pipe would wait for a writer */
    if (file < 0) return fail(log, where, what, path, errno);
    struct stat status;
    if (fstat(file, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) {
        close(file);
        return refuse(log, where, what, path);
    }
    const nebel_result result = nb_file_read_open(allocator, log, where, what, path, file, limit, bytes);
    close(file);
    return result;
}
