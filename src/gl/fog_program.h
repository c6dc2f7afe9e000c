/* The programs of the passes: one for each way in which fog is stored and light goes out, made when first needed. */
#ifndef NB_GL_FOG_PROGRAM_H
#define NB_GL_FOG_PROGRAM_H

#include "gl_caps.h"

#include <nebel/gl.h>

/* Texture units of the samplers in a program. */
enum { NB_UNIT_FOG, NB_UNIT_TILES, NB_UNIT_VOXELS, NB_UNIT_NODES, NB_UNIT_ENVIRONMENT, NB_UNIT_DEPTH, NB_UNIT_COLOR };
enum { NB_UNIT_AIR = 15 }; /* behind those of scenes; OpenGL ES has no more */

enum { NB_MAX_PASS_SAMPLES = 32 };

/* The texts of a shader, one after the other. */
typedef struct nb_shader_parts {
    const char *list[17];
    int count;
} nb_shader_parts;

/* The first line of a shader. */
const char *nb_program_version(const nb_context *context);

/* What the fog's text is told of the context's limits, in `text`; "" where there are none. `shares` is what divides
 * them in GLSL, with its operator. Returns text. */
const char *nb_program_limits(const nb_context *context, const char *shares, char *text, size_t size);

/* What the first texts of a program say of its output: "" or an extension, behind the version; what is defined. */
const char *nb_program_extension(const nb_context *context, nebel_gl_output output);
const char *nb_program_output(nebel_gl_output output);

/* A vertex shader without attributes: three vertices cover the viewport. */
extern const char nb_triangle_text[];

/* Compiles and links. UNSUPPORTED, with the driver's words, where it refuses; *name is 0 then. */
nebel_result nb_program_build(const nebel_log *log, const nb_shader_parts *vertex, const nb_shader_parts *fragment,
                              unsigned *name);

typedef struct nb_program_kind {
    int in_texture, tiled, multisampled;
    nebel_gl_output output;
    nebel_depth_encoding depth;
    int from_eye;         /* all rays start where the fog was packed for */
    int panorama;         /* rays go all around, and tiles are of six faces; depth is the distance */
    int shafts;           /* surfaces shade fog */
    int step;             /* one of several passes; its output counts for the last program alone */
    int air;              /* the fog lies in that of so many planets, which is bound */
    int daylit;           /* and has the sun and the sky of its place there */
    int clouds;           /* the air is in their shade */
    int shaded;           /* and so is the fog, by its place */
    uint32_t features;    /* of the fog: what the text leaves out makes it faster */
    const char *shade[2]; /* texts before that of the fog; NULL: none */
} nb_program_kind;

typedef struct nb_program {
    nb_program_kind kind;
    unsigned name;
    int rays, corner, tiling, face_first, sample_range,
        sample_places; /* where its uniforms are; -1: it has none such */
} nb_program;

typedef struct nb_programs {
    nb_program *list;
    size_t count, capacity;
} nb_programs;

/* Finds the program, or compiles and links it, which changes the current program. It stays where it is until the next
 * call. UNSUPPORTED with the driver's words where it refuses; MEMORY. */
nebel_result nb_programs_find(nb_programs *programs, const nb_context *context, const nebel_allocator *allocator,
                              const nebel_log *log, const nb_program_kind *kind, const nb_program **program);

/* Deletes them in OpenGL. */
void nb_programs_delete(const nb_programs *programs);

#endif
