#define _POSIX_C_SOURCE 200809L
/* Assimp's way to files, through nb_model_files. */
#include "assimp_load.h"
#include "file/path.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static size_t read_some(struct aiFile *file, char *bytes, size_t size, size_t count)
{
    return fread(bytes, size, count, (FILE *)file->UserData);
}

static size_t write_some(struct aiFile *file, const char *bytes, size_t size, size_t count)
{
    (void)file, (void)bytes, (void)size, (void)count;
    return 0;
}

static size_t tell_position(struct aiFile *file)
{
    const long at = ftell((FILE *)file->UserData);
    return at >= 0 ? (size_t)at : 0;
}

static size_t file_size(struct aiFile *file)
{
    FILE *stream = (FILE *)file->UserData;
    const long at = ftell(stream);
    const long end = at >= 0 && fseek(stream, 0, SEEK_END) == 0 ? ftell(stream) : -1;
    if (at >= 0) fseek(stream, at, SEEK_SET);
    return end >= 0 ? (size_t)end : 0;
}

static enum aiReturn seek(struct aiFile *file, size_t offset, enum aiOrigin origin)
{
    const int from = origin == aiOrigin_CUR ? SEEK_CUR : origin == aiOrigin_END ? SEEK_END : SEEK_SET;
    return fseek((FILE *)file->UserData, (long)offset, from) == 0 ? aiReturn_SUCCESS : aiReturn_FAILURE;
}

static void flush(struct aiFile *file)
{
    (void)file;
}

/* What was made has a name that no file has. */
static const nb_gltf_file *find_made(const nb_assimp *in, const char *path)
{
    for (int i = 0; i < NB_GLTF_FILE_COUNT; i++) {
        const nb_gltf_file *file = &in->made.files[i];
        if (file->bytes.size > 0 && strcmp(nb_path_name(path), file->name) == 0) return file;
    }
    return NULL;
}

static FILE *open_stream(nb_assimp *in, const char *path)
{
    const nb_gltf_file *made = find_made(in, path);
    if (made != NULL) return fmemopen(made->bytes.data, made->bytes.size, "rb");
    const int descriptor = nb_model_files_open(&in->files, path);
    FILE *stream = descriptor >= 0 ? fdopen(descriptor, "rb") : NULL;
    if (stream == NULL && descriptor >= 0) close(descriptor);
    return stream;
}

/* NULL where it is refused or is not there; Assimp asks in this way whether a file exists, too. */
static struct aiFile *open_file(struct aiFileIO *io, const char *path, const char *mode)
{
    FILE *stream = mode[0] == 'r' ? open_stream((nb_assimp *)(void *)io->UserData, path) : NULL;
    struct aiFile *file = stream != NULL ? malloc(sizeof *file) : NULL;
    if (file != NULL) {
        *file = (struct aiFile){read_some, write_some, tell_position, file_size, seek, flush, (aiUserData)stream};
        return file;
    }
    if (stream != NULL) fclose(stream);
    return NULL;
}

static void close_file(struct aiFileIO *io, struct aiFile *file)
{
    (void)io;
    if (file == NULL) return;
    fclose((FILE *)file->UserData);
    free(file);
}

void nb_assimp_set_files(nb_assimp *in)
{
    in->io = (struct aiFileIO){open_file, close_file, (aiUserData)in};
}
