/* Fog volumes in a Direct3D 9 program without shaders: nebel writes the fog between the eye and each vertex into the
 * alpha of the vertex's specular colour, and the device blends with FOGCOLOR. The camera goes round; Escape ends. With
 * a file name: one frame, written there as a PPM.
 *
 *     x86_64-w64-mingw32-gcc d3d9_specular.c -Iinclude -Lbuild -lnebel -ld3d9 -lgdi32 -luser32 -o d3d9_specular.exe */
#include <nebel/classic.h>

#include "engine_d3d9.h"

/* The device has one colour for all fog. */
static const uint32_t fog_color = 0xffd0d8e0;

#define FIRST_ANGLE .4

/* Mist in the valleys, and a thick ball of it on a slope, in the coordinates of the landscape. */
static nebel_snapshot *make_fog(void)
{
    const nebel_volume_desc mist = {.shape = {.type = NEBEL_SHAPE_WORLD},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -.3, .scale_height = .3},
                                    .extinction = {.6, .6, .6}};
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {3, .8, 1}, .radius = 2},
                                    .density = {.type = NEBEL_DENSITY_RADIAL, .power = 1},
                                    .extinction = {1.5, 1.5, 1.5}};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    if (nebel_create_fog(&(nebel_fog_desc){0}, &fog) == NEBEL_OK && nebel_add_volume(fog, &mist, NULL) == NEBEL_OK &&
        nebel_add_volume(fog, &ball, NULL) == NEBEL_OK)
        nebel_commit_fog(fog, &snapshot);
    nebel_destroy_fog(fog);
    return snapshot;
}

/* The device uses specular alpha where it computes no fog of its own: both modes are NONE. */
static void set_fog_states(IDirect3DDevice9 *device)
{
    IDirect3DDevice9_SetRenderState(device, D3DRS_FOGENABLE, TRUE);
    IDirect3DDevice9_SetRenderState(device, D3DRS_FOGCOLOR, fog_color);
    IDirect3DDevice9_SetRenderState(device, D3DRS_FOGVERTEXMODE, D3DFOG_NONE);
    IDirect3DDevice9_SetRenderState(device, D3DRS_FOGTABLEMODE, D3DFOG_NONE);
}

/* Once a frame and object. */
static nebel_result fog_vertices(const nebel_snapshot *fog, engine *host)
{
    nebel_vertices points = {.positions = host->vertices->place, .position_stride = sizeof(engine_vertex)};
    const nebel_vertex_output alpha = {NEBEL_VERTEX_SPECULAR_ALPHA, &host->vertices->specular, sizeof(engine_vertex)};
    const nebel_result found = nebel_compute_object_eye(host->view, points.eye);
    return found == NEBEL_OK ? nebel_compute_vertex_fog(fog, NULL, VERTICES, &points, &alpha, 1) : found;
}

int main(int argc, char **argv)
{
    static engine host;
    nebel_snapshot *const fog = make_fog();
    int running = fog != NULL && engine_open(&host, "nebel: fog in specular alpha", argc < 2), failed = !running;
    if (running) set_fog_states(host.device);
    for (double angle = FIRST_ANGLE; running; angle += .01) {
        engine_turn(&host, angle);
        failed = fog_vertices(fog, &host) != NEBEL_OK;
        engine_draw(&host, fog_color);
        if (argc > 1) failed = failed || !engine_save(&host, argv[1]);
        running = !failed && argc < 2 && engine_show(&host);
    }
    engine_close(&host);
    nebel_release_snapshot(fog);
    return failed;
}
