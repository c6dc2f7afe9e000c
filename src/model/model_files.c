#define _GNU_SOURCE
#include "model_files.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(SYS_openat2)
#include <linux/openat2.h>
#endif

/* Paths longer than this are refused. */
enum { PATH_SIZE = 4096 };

/* A pipe without a writer would hold up whoever opens it. */
enum { READ_FLAGS = O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK };

/* ---- the folder ------------------------------------------------------------------------------ */

nebel_result nb_model_files_begin(nb_model_files *files, const nebel_log *log)
{
    const char *folder = files->folder[0] != '\0' ? files->folder : ".";
    files->real_root = NULL;
    files->refusal = NB_REFUSAL_NONE;
    files->root = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (files->root < 0)
        return nb_fail(log, NEBEL_ERROR_FILE, "cannot open the folder \"%s\" of the model: %s", folder,
                       strerror(errno));
    files->real_root = realpath(folder, NULL);
    return NEBEL_OK;
}

void nb_model_files_end(nb_model_files *files)
{
    if (files->root >= 0) close(files->root);
    free(files->real_root);
    files->root = -1;
    files->real_root = NULL;
}

/* ---- names ----------------------------------------------------------------------------------- */

static int hex_digit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* RFC 3986, section 2.1. A zero byte ends no name. */
bool nb_model_files_decode(const char *text, char *decoded)
{
    bool found = false;
    while (*text != '\0') {
        const int high = text[0] == '%' ? hex_digit(text[1]) : -1, low = high >= 0 ? hex_digit(text[2]) : -1;
        const bool encoded = low >= 0 && high + low > 0;
        *decoded++ = encoded ? (char)(high * 16 + low) : *text;
        text += encoded ? 3 : 1;
        found = found || encoded;
    }
    *decoded = '\0';
    return found;
}

/* Absolute paths into the folder as seen from it. */
static const char *strip_root(const nb_model_files *files, const char *path)
{
    const size_t size = files->real_root != NULL ? strlen(files->real_root) : 0;
    if (path[0] != '/' || size == 0 || strncmp(path, files->real_root, size) != 0) return path;
    const char *rest = path + size;
    while (*rest == '/') rest++;
    return rest > path + size || files->real_root[size - 1] == '/' ? rest : path;
}

/* ---- opening --------------------------------------------------------------------------------- */

/* Without openat2 (Linux 5.6) the path is looked at before it is opened. */
static int open_resolved(const nb_model_files *files, const char *path, int flags)
{
    char joined[PATH_SIZE], real[PATH_MAX];
    const char *root = files->real_root != NULL ? files->real_root : "";
    const size_t root_size = strlen(root);
    const int size = snprintf(joined, sizeof joined, "%s/%s", root, path);
    if (root_size == 0 || path[0] == '/' || size < 0 || (size_t)size >= sizeof joined) {
        errno = EXDEV;
        return -1;
    }
    if (realpath(joined, real) == NULL) return -1;
    if (strncmp(real, root, root_size) != 0 || (root_size > 1 && real[root_size] != '/')) {
        errno = EXDEV;
        return -1;
    }
    return open(real, flags | O_NOFOLLOW);
}

static int open_beneath(const nb_model_files *files, const char *path, int flags)
{
#if defined(SYS_openat2)
    const struct open_how how = {.flags = (unsigned)flags, .resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS};
    const long file = syscall(SYS_openat2, files->root, path, &how, sizeof how);
    if (file >= 0 || (errno != ENOSYS && errno != EPERM)) return (int)file;
#endif
    return open_resolved(files, path, flags);
}

static int refuse(nb_model_files *files, nb_refusal refusal, const char *path)
{
    if (files->refusal == NB_REFUSAL_NONE) {
        files->refusal = refusal;
        snprintf(files->refused, sizeof files->refused, "%s", path);
    }
    errno = EACCES;
    return -1;
}

static void tell_opened(const nb_model_files *files, const char *path, bool is_model, const struct stat *status)
{
    char joined[PATH_SIZE];
    if (files->opened == NULL) return;
    if (!is_model) {
        snprintf(joined, sizeof joined, "%s%s", files->folder, path);
        path = joined;
    }
    files->opened(files->user, path, status);
}

static int open_either(const nb_model_files *files, const char *path, bool is_model, int flags)
{
    return is_model ? open(files->file, flags) : open_beneath(files, path, flags);
}

/* What is no regular file is not opened at all: opening a device may do something. */
static int open_regular(nb_model_files *files, const char *path)
{
    struct stat status;
    const bool is_model = strcmp(path, files->name) == 0;
    const char *inside = strip_root(files, path);
    const int seen = open_either(files, inside, is_model, O_PATH | O_CLOEXEC);
    if (seen < 0) return errno == EXDEV ? refuse(files, NB_REFUSAL_OUTSIDE, path) : -1;
    const bool known = fstat(seen, &status) == 0;
    close(seen);
    if (known && S_ISDIR(status.st_mode)) {
        errno = EISDIR;
        return -1;
    }
    if (!known || !S_ISREG(status.st_mode)) return refuse(files, NB_REFUSAL_SPECIAL, path);
    const int file = open_either(files, inside, is_model, READ_FLAGS);
    if (file < 0) return -1;
    if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(file);
        return refuse(files, NB_REFUSAL_SPECIAL, path);
    }
    tell_opened(files, is_model ? files->file : inside, is_model, &status);
    return file;
}

int nb_model_files_open(nb_model_files *files, const char *path)
{
    char decoded[PATH_SIZE];
    if (strlen(path) >= sizeof decoded) {
        errno = ENAMETOOLONG;
        return -1;
    }
    const bool encoded = strcmp(path, files->name) != 0 && nb_model_files_decode(path, decoded);
    int file = open_regular(files, encoded && files->has_uris ? decoded : path);
    if (file < 0 && encoded && errno == ENOENT) file = open_regular(files, files->has_uris ? path : decoded);
    return file;
}

const char *nb_model_files_refusal_text(nb_refusal refusal)
{
    return refusal == NB_REFUSAL_SPECIAL ? "is a device, a pipe or a socket; name a file"
                                         : "is outside the folder of the model, as are links to absolute paths; move "
                                           "it there, or name a folder that "
                                           "holds both as \"folder\"";
}
