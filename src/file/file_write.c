#define _DEFAULT_SOURCE
#include "file.h"
#include "path.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_LINKS = 40, NAME_TRIES = 16 };

/* ---- where to write -------------------------------------------------------------------------- */

/* Follows symbolic links to the path they end at, which need not exist, but not those of open files. NULL, with errno, where that fails. */
static const char *follow_links(nb_arena *arena, const char *path)
{
    char target[PATH_MAX];
    for (int i = 0; i < MAX_LINKS; i++) {
        struct stat status;
        if (nb_file_descriptor(path) >= 0) return path;
        if (lstat(path, &status) != 0) return errno == ENOENT ? path : NULL;
        if (!S_ISLNK(status.st_mode)) return path;
        const ssize_t size = readlink(path, target, sizeof target - 1);
        if (size < 0) return NULL;
        target[size] = '\0';
        const char *folder = nb_path_folder(arena, path);
        path = folder != NULL ? nb_path_join(arena, folder, target) : NULL;
        if (path == NULL) errno = ENOMEM;
        if (path == NULL) return NULL;
    }
    errno = ELOOP;
    return NULL;
}

/* Creates a file that nobody can have put there before, beside `path`. Its mode is what a plain open would give, or
 * that of the file it replaces. -1, with errno, on failure. */
static int create_beside(nb_arena *arena, const char *path, const char **temporary)
{
    const char *folder = nb_path_folder(arena, path);
    for (int i = 0; folder != NULL && i < NAME_TRIES; i++) {
        unsigned long long number;
        char name[40];
        if (getrandom(&number, sizeof number, 0) != (ssize_t)sizeof number) return -1;
        snprintf(name, sizeof name, ".nebel-%016llx.tmp", number);
        *temporary = nb_path_join(arena, folder, name);
        if (*temporary == NULL) break;
        const int file = open(*temporary, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (file >= 0 || errno != EEXIST) return file;
    }
    errno = folder == NULL || *temporary == NULL ? ENOMEM : EEXIST;
    return -1;
}

/* ---- writing --------------------------------------------------------------------------------- */

/* 0 or an error number. */
static int write_all(int file, const nb_bytes *bytes)
{
    for (size_t written = 0; written < bytes->size;) {
        const ssize_t count = write(file, bytes->data + written, bytes->size - written);
        if (count < 0 && errno != EINTR) return errno;
        if (count > 0) written += (size_t)count;
    }
    return 0;
}

/* The same at a place of the file. */
static int write_at(int file, uint64_t offset, const unsigned char *data, size_t size)
{
    for (size_t written = 0; written < size;) {
        const ssize_t count = pwrite(file, data + written, size - written, (off_t)(offset + written));
        if (count < 0 && errno != EINTR) return errno;
        if (count > 0) written += (size_t)count;
    }
    return 0;
}

/* What is open already goes on from where it stands: opened anew it would lose what was appended to. */
static int open_directly(const char *path)
{
    const int descriptor = nb_file_descriptor(path);
    if (descriptor >= 0) return fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
    return open(path, O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
}

static int write_directly(const char *path, const nb_bytes *bytes)
{
    const int file = open_directly(path);
    if (file < 0) return errno;
    const int error = write_all(file, bytes);
    return close(file) != 0 && error == 0 ? errno : error;
}

static bool is_null(const struct stat *status)
{
    struct stat null;
    return S_ISCHR(status->st_mode) && stat("/dev/null", &null) == 0 && status->st_rdev == null.st_rdev;
}

/* What is written to as it is: an open file, which may be a regular one, but it is the open one that is meant, or /dev/null. `path` has
 * no links any more but those of open files. */
static bool is_direct(const char *path, const struct stat *status)
{
    return !S_ISDIR(status->st_mode) && (nb_file_descriptor(path) >= 0 || is_null(status));
}

bool nb_file_is_special(const char *path)
{
    struct stat status;
    if (stat(path, &status) != 0 || S_ISDIR(status.st_mode)) return false;
    return !S_ISREG(status.st_mode) || nb_file_descriptor(path) >= 0;
}

/* 0 or an error number. */
static int check_writing(const char *path)
{
    const int descriptor = nb_file_descriptor(path);
    if (descriptor < 0) return access(path, W_OK) == 0 ? 0 : errno;
    const int flags = fcntl(descriptor, F_GETFL);
    if (flags < 0) return errno;
    return (flags & O_ACCMODE) == O_RDONLY ? EBADF : 0;
}

/* What is at a path, and where its bytes go. */
typedef struct nb_write_target {
    const char *path; /* symbolic links followed */
    bool exists, is_direct;
    struct stat status; /* where it exists */
} nb_write_target;

struct nb_sink {
    nebel_allocator allocator;
    nebel_log log;
    nb_arena arena;
    const char *path, *temporary; /* as the caller names it; the file beside it, NULL: there is none */
    nb_write_target found;
    int file;
    uint64_t written; /* bytes in the file before those in `bytes` */
    nb_bytes bytes;   /* not written yet; of a direct target all */
    int error;        /* of the first write that failed */
};

/* 0 or an error number. */
static int find_target(nb_arena *arena, const char *path, nb_write_target *found)
{
    *found = (nb_write_target){.path = follow_links(arena, path)};
    if (found->path == NULL) return errno;
    found->exists = stat(found->path, &found->status) == 0;
    if (!found->exists && errno != ENOENT) return errno;
    if (found->exists && S_ISDIR(found->status.st_mode)) return EISDIR;
    found->is_direct = found->exists && is_direct(found->path, &found->status);
    if (found->exists && !found->is_direct && !S_ISREG(found->status.st_mode)) return ENXIO;
    return found->exists ? check_writing(found->path) : 0;
}

/* A pipe that nobody reads any more, and a device that is always full: what is written there is lost. */
static int try_directly(const char *path)
{
    struct stat status, full;
    struct pollfd pipe = {.fd = nb_file_descriptor(path), .events = POLLOUT};
    if (pipe.fd < 0 || fstat(pipe.fd, &status) != 0) return 0;
    if (S_ISCHR(status.st_mode) && stat("/dev/full", &full) == 0 && status.st_rdev == full.st_rdev) return ENOSPC;
    return S_ISFIFO(status.st_mode) && poll(&pipe, 1, 0) == 1 && (pipe.revents & POLLERR) != 0 ? EPIPE : 0;
}

static int try_file(nb_arena *arena, const char *path, size_t size)
{
    nb_write_target found;
    const char *temporary = NULL;
    const int error = find_target(arena, path, &found);
    if (error != 0) return error;
    if (found.is_direct) return try_directly(found.path);
    const int file = create_beside(arena, found.path, &temporary);
    if (file < 0) return errno;
    const int full = size > 0 ? posix_fallocate(file, 0, (off_t)size) : 0;
    close(file);
    const int gone = unlink(temporary) == 0 ? 0 : errno;
    return full == ENOSPC || full == EFBIG || full == EDQUOT ? full : gone;
}

/* ---- what went wrong ------------------------------------------------------------------------- */

static nebel_result fail_write(nb_arena *arena, const nebel_log *log, const char *path, int error)
{
    if (error == 0) return NEBEL_OK;
    if (error == ENOMEM) return nb_fail(log, NEBEL_ERROR_MEMORY, "cannot write \"%s\": out of memory", path);
    if (error == EISDIR)
        return nb_fail(log, NEBEL_ERROR_FILE, "cannot write \"%s\": it is a folder; name a file in it", path);
    if (error == ENXIO)
        return nb_fail(
            log, NEBEL_ERROR_FILE,
            "cannot write \"%s\": it is a device, a pipe or a socket; name a file, or what is open already, as "
            "/dev/stdout",
            path);
    if (error == EBADF) return nb_fail(log, NEBEL_ERROR_FILE, "cannot write \"%s\": it is not open to writing", path);
    const char *folder = nb_path_folder(arena, path);
    struct stat status;
    if (error == ENOENT && path[0] != '\0' && folder != NULL && folder[0] != '\0') {
        const bool is_there = stat(folder, &status) == 0;
        return nb_fail(log, NEBEL_ERROR_FILE, "cannot write \"%s\": %s \"%s\"%s", path,
                       is_there ? "no file can be made in" : "there is no folder", folder,
                       is_there ? "" : "; make it first");
    }
    return nb_fail(log, NEBEL_ERROR_FILE, "cannot write \"%s\": %s", path, strerror(error));
}

/* ---- a file in the making -------------------------------------------------------------------- */

/* More than that is not kept back. */
enum { SINK_BYTES = 1 << 20 };

static int open_sink(nb_sink *sink)
{
    const int error = find_target(&sink->arena, sink->path, &sink->found);
    if (error != 0 || sink->found.is_direct) return error;
    sink->file = create_beside(&sink->arena, sink->found.path, &sink->temporary);
    if (sink->file >= 0) return 0;
    sink->temporary = NULL;
    return errno;
}

nebel_result nb_sink_open(const nebel_allocator *allocator, const nebel_log *log, const char *path, nb_sink **sink)
{
    nb_sink *made = nb_allocate_zero(allocator, 1, sizeof *made + strlen(path) + 1);
    *sink = NULL;
    if (made == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "cannot write \"%s\": out of memory", path);
    *made = (nb_sink){.allocator = *allocator, .log = *log, .arena = {.allocator = *allocator}, .file = -1};
    made->path = strcpy((char *)(made + 1), path);
    const int error = open_sink(made);
    const nebel_result result = fail_write(&made->arena, log, path, error);
    if (result == NEBEL_OK)
        *sink = made;
    else
        nb_sink_close(made);
    return result;
}

static int flush_sink(nb_sink *sink)
{
    const int error = write_at(sink->file, sink->written, sink->bytes.data, sink->bytes.size);
    sink->written += sink->bytes.size;
    sink->bytes.size = 0;
    return error;
}

static int write_sink(nb_sink *sink, uint64_t offset, const unsigned char *data, size_t size)
{
    if (offset < sink->written) {
        const size_t before = size < sink->written - offset ? size : (size_t)(sink->written - offset);
        const int error = write_at(sink->file, offset, data, before);
        if (error != 0 || before == size) return error;
        return write_sink(sink, offset + before, data + before, size - before);
    }
    if (!nb_bytes_write(&sink->allocator, &sink->bytes, (size_t)(offset - sink->written), data, size)) return ENOMEM;
    return sink->file >= 0 && sink->bytes.size >= SINK_BYTES ? flush_sink(sink) : 0;
}

bool nb_sink_write(nb_sink *sink, uint64_t offset, const void *data, size_t size)
{
    if (sink->error == 0) sink->error = write_sink(sink, offset, data, size);
    return sink->error == 0;
}

uint64_t nb_sink_size(const nb_sink *sink)
{
    return sink->written + sink->bytes.size;
}

static int rename_sink(nb_sink *sink)
{
    const nb_write_target *found = &sink->found;
    int error = flush_sink(sink);
    if (error == 0 && found->exists && fchmod(sink->file, found->status.st_mode & 0777) != 0) error = errno;
    if (error == 0 && fsync(sink->file) != 0) error = errno;
    if (close(sink->file) != 0 && error == 0) error = errno;
    sink->file = -1;
    if (error == 0 && rename(sink->temporary, found->path) != 0) error = errno;
    if (error == 0) sink->temporary = NULL;
    return error;
}

nebel_result nb_sink_finish(nb_sink *sink)
{
    if (sink->error == 0)
        sink->error = sink->found.is_direct ? write_directly(sink->path, &sink->bytes) : rename_sink(sink);
    return fail_write(&sink->arena, &sink->log, sink->path, sink->error);
}

bool nb_sink_has_failed(const nb_sink *sink)
{
    return sink->error != 0;
}

void nb_sink_close(nb_sink *sink)
{
    if (sink == NULL) return;
    if (sink->file >= 0) close(sink->file);
    if (sink->temporary != NULL) unlink(sink->temporary);
    const nebel_allocator allocator = sink->allocator;
    nb_release(&allocator, sink->bytes.data);
    nb_arena_release(&sink->arena);
    nb_release(&allocator, sink);
}

nebel_result nb_file_write(const nebel_allocator *allocator, const nebel_log *log, const char *path,
                           const nb_bytes *bytes)
{
    nb_sink *sink;
    nebel_result result = nb_sink_open(allocator, log, path, &sink);
    if (result != NEBEL_OK) return result;
    nb_sink_write(sink, 0, bytes->data, bytes->size);
    result = nb_sink_finish(sink);
    nb_sink_close(sink);
    return result;
}

nebel_result nb_file_try_room(const nebel_allocator *allocator, const nebel_log *log, const char *path, size_t size)
{
    nb_arena arena = {.allocator = *allocator};
    const nebel_result result = fail_write(&arena, log, path, try_file(&arena, path, size));
    nb_arena_release(&arena);
    return result;
}

nebel_result nb_file_try(const nebel_allocator *allocator, const nebel_log *log, const char *path)
{
    return nb_file_try_room(allocator, log, path, 0);
}
