/* A small engine of OpenGL 1.1, which knows vertices with a colour and nothing else: the scene of engine.h in tiles. It
 * stands for yours in embed_vertex_colors.c. */
#ifndef ENGINE_FIXED_H
#define ENGINE_FIXED_H

#include <epoxy/gl.h>
#include <math.h>
#include <stddef.h>

enum { WIDTH = 640, HEIGHT = 400, MOST_VERTICES = 80000 };

/* `color` is what the hardware takes, `surface` what it would be without fog. */
typedef struct engine_vertex {
    float place[3], surface[3], color[3];
} engine_vertex;

typedef struct engine {
    engine_vertex vertices[MOST_VERTICES];
    size_t count;
    double angle, eye[3];
} engine;

/* Tiles between two squares or circles, of radius r0 and r1 and heights y0 and y1. The sides of squares are lit. */
static inline void engine_add_ring(engine *e, int sides, const float middle[2], double r0, double y0, double r1,
                                   double y1, const float color[3])
{
    static const float light[4] = {.7f, .8f, .5f, .4f};
    for (int i = 0; i < 4 * sides; i++) {
        const int upper = i / 2 & 1, side = i / 4 + ((i + 1) / 2 & 1);
        const double angle = (side - .5) * 6.283185307179586 / sides, r = upper ? r1 : r0;
        engine_vertex *const v = &e->vertices[e->count++];
        v->place[0] = (float)((double)middle[0] + r * cos(angle));
        v->place[1] = (float)(upper ? y1 : y0);
        v->place[2] = (float)((double)middle[1] + r * sin(angle));
        for (int c = 0; c < 3; c++) v->surface[c] = color[c] * (sides == 4 && y0 < y1 ? light[i / 4] : 1);
    }
}

/* Tiles are finest around the middle of the ground and at the horizon, where fog has its details. */
static inline void engine_open(engine *e)
{
    static const float sky[3] = {.25f, .45f, .8f}, ground[3] = {.12f, .2f, .06f}, middle[2] = {0, 0};
    static const float boxes[3][3] = {{-4, 0, 1.5f}, {3, -3, 2}, {-9, -22, 6}};
    static const float colors[3][3] = {{.5f, .1f, .08f}, {.5f, .3f, .1f}, {.3f, .3f, .3f}};
    enum { RINGS = 80 };
    for (int k = 0; k < RINGS; k++) {
        const double a = (double)k / RINGS, b = (k + 1.) / RINGS, low = 1.6 * a * a - .01, high = 1.6 * b * b - .01;
        engine_add_ring(e, 96, middle, 200 * a * a, 0, 200 * b * b, 0, ground);
        engine_add_ring(e, 96, middle, 400 * cos(low), 400 * sin(low), 400 * cos(high), 400 * sin(high), sky);
        for (int i = 0; i < 3; i++) {
            const double height = 2 * (double)boxes[i][2], r = height * sqrt(.5);
            engine_add_ring(e, 4, boxes[i], r, height * a, r, height * b, colors[i]);
            engine_add_ring(e, 4, boxes[i], r * (1 - a), height, r * (1 - b), height, colors[i]);
        }
    }
    glEnable(GL_DEPTH_TEST);
    glEnableClientState(GL_VERTEX_ARRAY);
    glEnableClientState(GL_COLOR_ARRAY);
    glVertexPointer(3, GL_FLOAT, sizeof(engine_vertex), e->vertices->place);
    glColorPointer(3, GL_FLOAT, sizeof(engine_vertex), e->vertices->color);
    glMatrixMode(GL_PROJECTION);
    glFrustum(-.1 / 1.5 * WIDTH / HEIGHT, .1 / 1.5 * WIDTH / HEIGHT, -.1 / 1.5, .1 / 1.5, .1, 1000);
    glMatrixMode(GL_MODELVIEW);
}

/* Stands 10 m from the middle, 2 m high, and looks level through it. */
static inline void engine_turn(engine *e, double angle)
{
    e->angle = angle;
    e->eye[0] = -10 * sin(angle), e->eye[1] = 2, e->eye[2] = 10 * cos(angle);
}

static inline void engine_draw(const engine *e)
{
    glLoadIdentity();
    glTranslated(0, -2, -10);
    glRotated(e->angle * 57.29577951308232, 0, 1, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArrays(GL_QUADS, 0, (GLsizei)e->count);
}

#endif
