/* The benchmark scenes: one landscape, camera and sun, and a fog of choice. In memory, and as files for the program. */
#ifndef NB_BENCH_SCENES_H
#define NB_BENCH_SCENES_H

#include "terrain.h"

#include <nebel/nebel.h>
#include <nebel/scene.h>

typedef enum nb_bench_fog {
    NB_FOG_NONE = 0,
    NB_FOG_BOX,        /* scene A1 */
    NB_FOG_SPHERE,     /* scene B1 */
    NB_FOG_LIT_BOX,    /* A2, lit by the scene's sun and ambient light */
    NB_FOG_LIT_SPHERE, /* B2 */
    NB_FOG_HEIGHT,     /* C */
    NB_FOG_CLOUD       /* D */
} nb_bench_fog;

enum { NB_BENCH_WIDTH = 1280, NB_BENCH_HEIGHT = 720 };

typedef struct nb_bench_scene {
    nb_terrain terrain;
    nebel_mesh mesh;
    nebel_scene_data data;
} nb_bench_scene;

/* The landscape without fog, of quads x quads quads, to be seen in a picture `aspect` times as wide as high. Returns 0,
 * or -1 without memory. The scene must not move. */
int nb_bench_scene_make(uint32_t quads, double aspect, nb_bench_scene *scene);
void nb_bench_scene_free(nb_bench_scene *scene);

/* Makes scene C of the landscape: ten square pillars, and a low sun. Returns 0, or -1 without memory. */
int nb_bench_scene_add_pillars(nb_bench_scene *scene);

/* The fog in the light of the scene. NULL for no fog and on an error. */
nebel_lighting *nb_bench_fog_commit(nb_bench_fog fog, const nebel_scene_data *scene);

/* The same for one thread, with the CPU seconds of committing and lighting it and how many bytes it has kept, without voxels. */
nebel_lighting *nb_bench_fog_measure(nb_bench_fog fog, const nebel_scene_data *scene, double *seconds, size_t *bytes);

/* Writes the scene with the fog of A1 into a folder: mesh.json takes the terrain as a PLY model, map.json as a height
 * map. Returns 0 or -1. */
int nb_bench_scene_write(const nb_bench_scene *scene, const char *folder);

/* Removes what nb_bench_scene_write has written. */
void nb_bench_scene_remove(const char *folder);

#endif
