/* What a program that wants a model and nebel-read-model write to each other, through two pipes of one machine. Numbers
 * are those of the machine; both programs are of one version. */
#ifndef NB_MODEL_MODEL_WIRE_H
#define NB_MODEL_MODEL_WIRE_H

#include <stdint.h>

/* To be raised with every change here, and with every change of what a model becomes. */
#define NB_WIRE_VERSION 2

/* The whole request is one write to a pipe that nobody reads yet. */
#define NB_WIRE_MAX_REQUEST 32768

#define NB_WIRE_MAGIC "nebmodl"

enum { NB_WIRE_POINTS = 1, NB_WIRE_HAS_FOG = 2, NB_WIRE_HAS_COLOR = 4, NB_WIRE_Z_UP = 8 };

/* Behind it: file, folder and name, each with its zero byte. */
typedef struct nb_wire_request {
    char magic[8];
    uint32_t version, flags;
    double position[3], rotation[4], scale[3];
    double unit, color[3];
    uint64_t max_points;
    uint64_t triangles, textures;               /* that the set has already */
    double bytes, most_bytes;                   /* of the scene: counted already, and that it may take; 0: any */
    uint32_t file_size, folder_size, name_size; /* with the zero byte */
    uint32_t unused;
} nb_wire_request;

typedef enum nb_wire_type {
    NB_WIRE_HELLO = 1, /* code: the version */
    NB_WIRE_FILE,      /* a path: it will be read */
    NB_WIRE_MESSAGE,   /* code: its nebel_result; a text */
    NB_WIRE_TEXTURE,   /* nb_wire_texture, texels */
    NB_WIRE_MESH,      /* nb_wire_mesh, positions, normals, uvs, indices */
    NB_WIRE_PLACES,    /* points of 3 doubles */
    NB_WIRE_END        /* code: the nebel_result of it all; nb_wire_end */
} nb_wire_type;

typedef struct nb_wire_frame {
    uint32_t type;
    int32_t code;
    uint64_t size; /* of what follows */
} nb_wire_frame;

typedef struct nb_wire_texture {
    uint32_t width, height;
} nb_wire_texture;

typedef struct nb_wire_mesh {
    uint32_t vertex_count, triangle_count, has_uvs;
    int32_t texture, mask; /* of the set */
    float base_color[3], alpha_cutoff;
} nb_wire_mesh;

/* Of what came before it, so that nothing can be missing. */
typedef struct nb_wire_end {
    uint64_t meshes, textures, points;
} nb_wire_end;

enum { NB_WIRE_MAX_MESSAGE = 2048, NB_WIRE_MAX_MESSAGES = 1000, NB_WIRE_MAX_PATH = 8192 };

#endif
