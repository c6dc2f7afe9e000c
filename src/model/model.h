/* Models become meshes: what the loaders share. */
#ifndef NB_MODEL_MODEL_H
#define NB_MODEL_MODEL_H

#include "base/arena.h"
#include "math/affine.h"
#include "file/file.h"
#include "image/image_codec.h"
#include "keys/file_units.h"

#include <sys/stat.h>

/* What a triangle counts in the scene's memory beside its vertices: what renderers make of it takes most of that (measured
 * of terrain in sunlit fog, where shadows of surfaces take 300). */
#define NB_TRIANGLE_BYTES 256.0

/* The most triangles of all models together. */
#define NB_MAX_TRIANGLES ((uint64_t)1 << 28)

/* A model or height field as the file describes it. */
typedef struct nb_model_source {
    const char *file;   /* path, resolved against the scene's folder */
    bool has_fog;       /* in its nodes */
    const char *where;  /* "FILE:LINE:COLUMN: models[0].file", for messages; NULL: none */
    const char *folder; /* which its references may not leave, as `file`; NULL: that of the file */
    bool is_heightfield;
    nb_file_units space; /* of the file's own numbers */
    double position[3], rotation[4], scale[3];
    double size[2], height; /* height field */
    bool has_color;
    double color[3];
} nb_model_source;

/* Meshes and textures of loaded models. */
typedef struct nb_model_set {
    nebel_mesh *meshes;
    size_t mesh_count, mesh_capacity;
    nebel_texture *textures;
    size_t texture_count, texture_capacity;
    uint64_t triangle_count;
    double bytes; /* what is counted of the scene's memory, with all that came before the models */
} nb_model_set;

/* Where models are read. */
typedef struct nb_model_reader {
    const char *program; /* path of nebel-read-model */
    bool in_process;     /* without it */
} nb_model_reader;

typedef struct nb_point_set {
    double (*places)[3]; /* m */
    size_t count, capacity;
    size_t limit; /* the most there may be */
} nb_point_set;

/* Takes what has been read in place of the set, which then counts only; the memory stays the caller's. */
typedef struct nb_model_sink {
    void (*mesh)(void *user, const nebel_mesh *mesh);
    void (*texture)(void *user, const nebel_texture *texture);
    void *user;
} nb_model_sink;

/* Decompresses a view of a glTF buffer: gltf_data.h. */
struct nb_meshopt_view;
typedef bool (*nb_unpack)(const struct nb_meshopt_view *view, const unsigned char *bytes, unsigned char *result);

/* What a loader works with; `set` receives the meshes, or `points` the vertices: those at one place once, in metres and
 * where the source places them. */
typedef struct nb_model_load {
    nebel_allocator allocator;
    nebel_log log;
    const nb_model_source *source;
    nb_model_set *set;
    nb_point_set *points;
    nb_model_reader reader;
    double most_bytes;             /* that the set may take, with what it begins with; 0: any */
    double most_seconds, *seconds; /* that the scene may take for its preparation, and has taken; 0, NULL: any */
    const nb_model_sink *sink;     /* NULL: none */
    const char *folder, *name;     /* which references may not leave, and the file seen from it: set by nb_model_read */
    void (*opened)(void *user, const char *path, const struct stat *status); /* told of files; NULL: nobody */
    void *opened_user;
    nb_unpack unpack; /* of EXT_meshopt_compression; NULL: not supported */
} nb_model_load;

/* Files beyond are not noted. */
#define NB_MAX_FILES ((size_t)1 << 16)

nebel_result nb_heightfield_load(const nb_model_load *load);

/* Where a model's numbers are in the world. */
nb_affine nb_model_place(const nb_model_source *model);

/* Reads a model file, in a process of its own or not, as load->reader says, or a height field. Counts the time. */
nebel_result nb_model_read(const nb_model_load *load);

/* Reads it in this process; folder and name are set. */
nebel_result nb_assimp_load(const nb_model_load *load);

/* Has nebel-read-model read it, within limits, and checks what comes of it. Folder and name are set. */
nebel_result nb_model_process_read(const nb_model_load *load);

/* The path of nebel-read-model where nobody names one. */
const char *nb_model_default_program(void);

/* Memory for positions and normals, uvs where wanted. False when memory is out; release the mesh also then. */
bool nb_mesh_allocate_vertices(const nebel_allocator *allocator, uint32_t count, bool has_uvs, nebel_mesh *mesh);
void nb_mesh_release(const nebel_allocator *allocator, nebel_mesh *mesh);

/* Hand over a mesh or a texture, also its memory on failure. Errors: LIMIT, MEMORY. */
nebel_result nb_model_add_mesh(const nb_model_load *load, nebel_mesh *mesh);
nebel_result nb_model_add_texture(const nb_model_load *load, const nebel_texture *texture, int32_t *index);

/* Whether the set may grow by so many bytes. LIMIT, said, where it may not. */
nebel_result nb_model_check_room(const nb_model_load *load, double bytes);
double nb_mesh_bytes(uint64_t vertices, bool has_uvs, uint64_t triangles);

/* Bytes that are left for a picture; 0: any. */
uint64_t nb_model_room(const nb_model_load *load);

/* LIMIT, and says that there are more than NB_MAX_TRIANGLES. */
nebel_result nb_model_refuse_triangles(const nb_model_load *load);

/* Logs "FILE:LINE:COLUMN: models[0].file: message" and returns the result. */
nebel_result nb_model_fail(const nb_model_load *load, nebel_result result, const char *format, ...) NB_PRINTF(3, 4);

/* The same of what is left out: no error. */
void nb_model_note(const nb_model_load *load, const char *format, ...) NB_PRINTF(2, 3);

/* A log that keeps the last message, so that it can be passed on with the model's place before it. */
typedef struct nb_note {
    char text[512];
} nb_note;

nebel_log nb_note_log(nb_note *note);

#endif
