/* What Direct3D 9 does with fog: colours that Wine's tests (8.5, dlls/d3d9 and ddraw) recorded on Windows, with the
 * tolerances recorded there. test_classic_d3d9.c asks nebel for them, d3d9/test_d3d9.c a Direct3D 9 device. */
#ifndef D3D9_FACTS_H
#define D3D9_FACTS_H

#include <nebel/classic.h>

/* A quad that fills the view of a camera at the origin which looks along z, x and y from -1 to 1, and the colour of one
 * pixel. World and projection add to z alone; the projection is affine, so that table fog goes by device depth. */
typedef struct d3d9_quad {
    nebel_d3d9_source source;
    double z[2], alpha[2];    /* at the left and the right edge: place, alpha of the specular colour */
    double world, projection; /* added to z before camera space, after it */
    double rhw;               /* of TRANSFORMED */
    double fog_register;      /* SHADER: oFog */
    int is_flat;              /* shade mode FLAT */
} d3d9_quad;

typedef struct d3d9_fact {
    const char *test; /* Wine's name of it */
    nebel_d3d9_fog fog;
    d3d9_quad quad;
    int object;          /* colour without fog, 0xRRGGBB */
    double probe;        /* the pixel: 0 at the left edge, 1 at the right */
    int wanted, most;    /* 0xRRGGBB, and how far off each channel may be */
    int wined3d_differs; /* its fog of the vertex is a function per pixel */
} d3d9_fact;

extern const d3d9_fact d3d9_facts[];
extern const size_t d3d9_fact_count;

/* f of the quad at the probe as nebel has it: of the left and right vertices, then of the pixel. */
double d3d9_factor_of(const nebel_d3d9_fog *fog, const d3d9_quad *quad, double probe);

/* The colour of an object 0xRRGGBB at factor f, rounded. */
int d3d9_color_of(const nebel_d3d9_fog *fog, int object, double f);

/* fog_with_shader_test: red under green fog from .1 to .9, density 1, at z = .001 + step / 10.02. */
enum { D3D9_RAMP_STEPS = 11, D3D9_RAMP_MOST = 13, D3D9_RAMP_OBJECT = 0xff0000 };

typedef struct d3d9_ramp {
    uint32_t table;                 /* FOGTABLEMODE */
    uint32_t first_mode, last_mode; /* FOGVERTEXMODE: all of these are the same */
    nebel_d3d9_source source;       /* SHADER writes (.9 - z) 1.25 to oFog */
    int wanted[D3D9_RAMP_STEPS];
} d3d9_ramp;

enum { D3D9_RAMP_COUNT = 8 };
extern const d3d9_ramp d3d9_ramps[D3D9_RAMP_COUNT];

nebel_d3d9_fog d3d9_ramp_fog(const d3d9_ramp *ramp, uint32_t vertex_mode);
d3d9_quad d3d9_ramp_quad(const d3d9_ramp *ramp, int step);

/* fog_process_vertices: the alpha byte of specular that ProcessVertices makes of a place (.5, 0, .375) in camera space
 * and specular alpha .5, start 0, end 1, density 1, to 1. Table fog never changes it. */
typedef struct d3d9_vertex_fact {
    uint32_t vertex_mode, range;
    int wanted;
} d3d9_vertex_fact;

enum { D3D9_VERTEX_FACT_COUNT = 8 };
extern const d3d9_vertex_fact d3d9_vertex_facts[D3D9_VERTEX_FACT_COUNT];

#endif
