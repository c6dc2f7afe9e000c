/* Classic fog: what OpenGL 1.x and Direct3D 9 do by themselves, and how a volume of fog gets into them.
 *
 * Old hardware blends each vertex or pixel with one colour: f surface + (1 - f) fog. This header has the factor f as
 * OpenGL and Direct3D 9 compute it, response curves that make a weight of a length in fog, and fog per vertex: what any
 * nebel fog does between the eye and each vertex, written where the program keeps it.
 *
 *     typedef struct vertex { float x, y, z; uint32_t diffuse, specular; } vertex;
 *
 *     nebel_vertices points = {.positions = mesh, .position_stride = sizeof(vertex)};
 *     nebel_compute_object_eye(world_view, points.eye);                        // once a frame and object
 *     const nebel_vertex_output alpha = {
 *         NEBEL_VERTEX_SPECULAR_ALPHA, &mesh[0].specular, sizeof(vertex)};
 *     nebel_compute_vertex_fog(snapshot, NULL, count, &points, &alpha, 1);
 *
 * `world_view` brings the mesh to the camera, and the snapshot's fog is placed in the coordinates of the mesh.
 * docs/classic.md shows how programs use it. Nothing here calls a graphics interface; OpenGL passes are in nebel/gl.h.
 *
 * A number that is no number (NaN) gives no fog, f = 1, throughout.
 */
#ifndef NEBEL_CLASSIC_H
#define NEBEL_CLASSIC_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- fog factors ----------------------------------------------------------------------------- */

typedef enum nebel_factor_mode {
    NEBEL_FACTOR_EXP = 0, /* exp(-density c) */
    NEBEL_FACTOR_EXP2,    /* exp(-(density c)^2) */
    NEBEL_FACTOR_LINEAR,  /* (end - c) / (end - start) */
    NEBEL_FACTOR_COUNT
} nebel_factor_mode;

/* What c is. */
typedef enum nebel_factor_coordinate {
    NEBEL_COORDINATE_PLANE = 0, /* |z| of the place in eye coordinates: changes when the camera turns */
    NEBEL_COORDINATE_RADIAL,    /* distance to the eye */
    NEBEL_COORDINATE_USER,      /* a number of the program's own, also below 0, as with GL_EXT_fog_coord */
    NEBEL_COORDINATE_COUNT
} nebel_factor_coordinate;

/* Where the formula is evaluated. The stages differ in LINEAR fog with start == end alone, which OpenGL leaves open
 * and Direct3D 9 decides: per vertex f is 0 everywhere, per pixel 1 where c < start, else 0. */
typedef enum nebel_factor_stage { NEBEL_STAGE_VERTEX = 0, NEBEL_STAGE_PIXEL, NEBEL_STAGE_COUNT } nebel_factor_stage;

/* {0} is the state of a new OpenGL context with fog enabled. */
typedef struct nebel_factor_desc {
    nebel_factor_mode mode;
    nebel_factor_coordinate coordinate;
    nebel_factor_stage stage;
    double start, end; /* LINEAR, in units of c; both 0: 0 and 1. start > end is legal: fog that ends */
    double density;    /* EXP, EXP2: 1 / unit of c, >= 0; 0: 1 */
    double color[3];   /* of opaque fog */
} nebel_factor_desc;

/* Checks a description and puts its defaults in; *resolved may be *desc. What is resolved stays as it is when resolved
 * again. Any thread. Errors: ARGUMENT (NULL, an unknown mode, coordinate or stage), VALUE (a number that is not finite,
 * a density below 0). */
nebel_result nebel_resolve_factor(const nebel_factor_desc *desc, nebel_factor_desc *resolved);

/* c of a place in eye coordinates [m] for a resolved description; `user` is returned with COORDINATE_USER. Any thread.
 */
double nebel_compute_fog_coordinate(const nebel_factor_desc *resolved, const double place[3], double user);

/* f for a resolved description, clamped to [0, 1] last; 1 where anything is a NaN. Source: OpenGL 2.1, section 3.10.
 * Any thread. */
double nebel_compute_fog_factor(const nebel_factor_desc *resolved, double c);

/* out = f surface + (1 - f) fog in red, green and blue; alpha is that of the surface. out may be surface. Any thread.
 */
void nebel_blend_fog_factor(double f, const float surface[4], const double fog[3], float out[4]);

/* ---- Direct3D 9 ------------------------------------------------------------------------------ */

/* Numbers of D3DRENDERSTATETYPE. */
typedef enum nebel_d3d9_state {
    NEBEL_D3DRS_FOGENABLE = 28,
    NEBEL_D3DRS_FOGCOLOR = 34,
    NEBEL_D3DRS_FOGTABLEMODE = 35,
    NEBEL_D3DRS_FOGSTART = 36,
    NEBEL_D3DRS_FOGEND = 37,
    NEBEL_D3DRS_FOGDENSITY = 38,
    NEBEL_D3DRS_RANGEFOGENABLE = 48,
    NEBEL_D3DRS_FOGVERTEXMODE = 140
} nebel_d3d9_state;

/* Numbers of D3DFOGMODE. */
typedef enum nebel_d3d9_mode {
    NEBEL_D3DFOG_NONE = 0,
    NEBEL_D3DFOG_EXP = 1,
    NEBEL_D3DFOG_EXP2 = 2,
    NEBEL_D3DFOG_LINEAR = 3
} nebel_d3d9_mode;

/* The fog of a device. {0} is fog switched off; nebel_reset_d3d9_fog gives the state of a new device. */
typedef struct nebel_d3d9_fog {
    uint32_t fog_enable;       /* FOGENABLE: 0 */
    uint32_t fog_color;        /* FOGCOLOR: 0; a D3DCOLOR, 0xAARRGGBB, whose alpha is ignored */
    uint32_t fog_table_mode;   /* FOGTABLEMODE: NONE; fog per pixel. It wins over fog_vertex_mode */
    uint32_t fog_vertex_mode;  /* FOGVERTEXMODE: NONE; fog per vertex */
    float fog_start, fog_end;  /* FOGSTART 0, FOGEND 1: metres of camera space; device depth for table fog where
                                  nebel_d3d9_uses_w says 0 */
    float fog_density;         /* FOGDENSITY: 1 */
    uint32_t range_fog_enable; /* RANGEFOGENABLE: 0; vertex fog by distance to the camera instead of |z| */
} nebel_d3d9_fog;

/* The documented defaults. Any thread. */
void nebel_reset_d3d9_fog(nebel_d3d9_fog *fog);

/* SetRenderState and GetRenderState for the states above; start, end and density are the bits of a float, as there.
 * Any thread. Errors: ARGUMENT (NULL, another state), VALUE (a mode that is none); nothing has changed then. */
nebel_result nebel_set_d3d9_state(nebel_d3d9_fog *fog, uint32_t state, uint32_t value);
nebel_result nebel_get_d3d9_state(const nebel_d3d9_fog *fog, uint32_t state, uint32_t *value);

/* Where a vertex comes from. */
typedef enum nebel_d3d9_source {
    NEBEL_D3D9_FIXED = 0,   /* the fixed pipeline (D3DFVF_XYZ): the device computes the factor */
    NEBEL_D3D9_TRANSFORMED, /* transformed by the program (D3DFVF_XYZRHW): the factor is the specular colour's alpha */
    NEBEL_D3D9_SHADER       /* a vertex shader: the factor is oFog */
} nebel_d3d9_source;

typedef struct nebel_d3d9_vertex {
    nebel_d3d9_source source;
    double position[3];    /* FIXED: in camera space [m] */
    double specular_alpha; /* FIXED without fog_vertex_mode, TRANSFORMED: 0 to 1 */
    double fog_register;   /* SHADER: oFog, clamped here; 0 where the shader does not write it */
} nebel_d3d9_vertex;

/* The factor of a vertex: what ProcessVertices writes to specular alpha, what is interpolated over a triangle. 1 where
 * fog is switched off. Any thread. */
double nebel_compute_d3d9_vertex_factor(const nebel_d3d9_fog *fog, const nebel_d3d9_vertex *vertex);

/* The factor of a pixel: with table fog that of `depth`, otherwise `vertex_factor`, the interpolated one. `depth` is
 * the pixel's z in camera space where nebel_d3d9_uses_w says so (1 / rhw of transformed vertices), and its device
 * depth otherwise. Any thread. */
double nebel_compute_d3d9_pixel_factor(const nebel_d3d9_fog *fog, double vertex_factor, double depth);

/* 1 where table fog goes by w, 0 where by z: by the element [3][4] of the projection that the device was given, row by
 * row as D3DMATRIX has it. It counts for transformed vertices, too. Any thread. */
int nebel_d3d9_uses_w(const float projection[16]);

/* FOGCOLOR as red, green and blue, 0 to 1, for nebel_blend_fog_factor. Any thread. */
void nebel_get_d3d9_color(const nebel_d3d9_fog *fog, double rgb[3]);

/* ---- response curves ------------------------------------------------------------------------- */

/* From the length s of a way in fog to the amount of fog. All but PHYSICAL are looks, and pass 1. */
typedef enum nebel_curve_type {
    NEBEL_CURVE_PHYSICAL = 0, /* 1 - exp(-k s) */
    NEBEL_CURVE_LINEAR,       /* k s */
    NEBEL_CURVE_EXP,          /* exp(k s) - 1 */
    NEBEL_CURVE_EXP2,         /* exp((k s)^2) - 1 */
    NEBEL_CURVE_TABLE,        /* the table at k s, linear between its entries: entry 0 at 0, entry 255 from 1 on */
    NEBEL_CURVE_COUNT
} nebel_curve_type;

#define NEBEL_CURVE_ENTRIES 256

typedef struct nebel_curve {
    nebel_curve_type type;
    double scale;       /* 1/m, >= 0; 0: 0.03 for EXP, 0.04 for EXP2, else 0.05 */
    const float *table; /* TABLE: NEBEL_CURVE_ENTRIES weights, 0 to 1 */
} nebel_curve;

/* Checks a curve and puts its default in; *resolved may be *curve. Any thread. Errors: ARGUMENT (NULL, an unknown type,
 * no table), VALUE (a k that is negative or not finite). */
nebel_result nebel_resolve_curve(const nebel_curve *curve, nebel_curve *resolved);

/* The amount of a resolved curve as its formula gives it, not clamped; s [m], 0 where it is negative or a NaN. Any
 * thread. */
double nebel_compute_curve_amount(const nebel_curve *resolved, double s);

/* The same as a weight for blending, clamped to [0, 1]. Any thread. */
double nebel_compute_curve_weight(const nebel_curve *resolved, double s);

/* ---- fog per vertex -------------------------------------------------------------------------- */

/* The eye in an object's coordinates: the inverse of `eye_from_object`, of a model-view matrix, at the origin. Sixteen
 * numbers in the memory order of OpenGL and of Direct3D, which is the same: those of the translation are 12 to 14. One
 * inversion a frame and object stands for the transformation of each vertex. Any thread. Errors: ARGUMENT (NULL, not
 * finite, not affine, or without an inverse); then `eye` is as it was. */
nebel_result nebel_compute_object_eye(const double eye_from_object[16], double eye[3]);

typedef struct nebel_vertices {
    const void *positions;  /* three floats each, x y z [m] */
    size_t position_stride; /* bytes, 12 or more; 0: 12 */
    double origin[3];       /* m, where positions count from, in the coordinates of the fog */
    double eye[3];          /* m, in the coordinates of the fog */
} nebel_vertices;

/* What is written for each vertex. f is the factor, 1 without fog; a = 1 - f the amount of fog. */
typedef enum nebel_vertex_format {
    NEBEL_VERTEX_FACTOR = 0, /* a float: f, 0 to 1 */
    NEBEL_VERTEX_COORDINATE, /* a float: a coordinate_end, for glFogCoord with GL_LINEAR from 0 to coordinate_end */
    NEBEL_VERTEX_RGBA_FLOAT, /* four floats: the light that fog adds, and a. Blend with GL_ONE, GL_ONE_MINUS_SRC_ALPHA
                                for fog that also weakens what is behind, with GL_ONE, GL_ONE for fog that only adds */
    NEBEL_VERTEX_RGBA8,      /* the same in four bytes */
    NEBEL_VERTEX_SPECULAR_ALPHA, /* f in the alpha of a D3DCOLOR, which is its byte 3; its other bytes are not touched
                                  */
    NEBEL_VERTEX_ALPHA,          /* a in byte 3 of four, whose others are the fog's color and not touched. Blend with
                                    GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA */
    NEBEL_VERTEX_FORMAT_COUNT
} nebel_vertex_format;

/* One stream of results, also in the same structures as the positions or other streams. */
typedef struct nebel_vertex_output {
    nebel_vertex_format format;
    void *data;    /* of the first vertex */
    size_t stride; /* bytes, at least the size of the format: 16 for RGBA_FLOAT, else 4; 0: that size */
} nebel_vertex_output;

/* NULL or {0}: the exact light of the fog. */
typedef struct nebel_vertex_desc {
    nebel_isa isa;
    int channel;            /* whose transmittance is f: 0 red, 1 green, 2 blue */
    nebel_curve_type curve; /* of the way's optical depth: k is the extinction of the volumes */
    const float *table;     /* curve TABLE */
    const double *color;    /* red, green, blue of opaque fog: light is a color. NULL: the fog's own light, which only
                               the curve PHYSICAL has */
    double coordinate_end;  /* COORDINATE, > 0; 0: 100 */
} nebel_vertex_desc;

/* Checks a description and puts its defaults in. Any thread. Errors: ARGUMENT (NULL, a channel or curve that is none,
 * a curve without its table, another isa than those of nebel.h), VALUE (a color or coordinate_end that is negative or
 * not a finite float). */
nebel_result nebel_resolve_vertex_desc(const nebel_vertex_desc *desc, nebel_vertex_desc *resolved);

/* What fog does between the eye and each of n vertices, written to `output_count` streams at once. In float; through
 * boxes of constant density f is what nebel_compute_segment_transmittance gives, to the bit, and the fastest. A byte is 255 times
 * the number, rounded to nearest, halves upwards. A vertex that holds a NaN or an infinity gets f = 1 and no light; of
 * one more than 1e18 m away only the range of f is sure. Streams may lie in each other, as the members of a structure
 * do, but no two of them, nor an output and the positions, may share a byte; where arrays lie in each other their
 * strides must be the same. Without state; any thread. Same bits for every isa and for every way of splitting the
 * vertices into calls. Errors: ARGUMENT (NULL, an unknown format, a stride that is too short, streams that share bytes,
 * an eye or origin that is not finite or more than 1e15 m away, curves as above), VALUE, UNSUPPORTED (isa not
 * available), MEMORY (scratch for very many volumes on one ray). Nothing has been written when the error is one of the
 * arguments. */
nebel_result nebel_compute_vertex_fog(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc, size_t n,
                                      const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                                      size_t output_count);

/* ---- tessellation ---------------------------------------------------------------------------- */

/* Between vertices hardware interpolates: where triangles are large against a volume its fog breaks. nebel_tessellate
 * splits triangles until fog at their vertices is near enough to the exact fog everywhere, and not at vertices alone.
 *
 * {0}: the eye at the origin, red, 1/255. */
typedef struct nebel_tessellation_desc {
    nebel_allocator allocator;
    double eye[3];        /* m, in the coordinates of the fog; at most 1e15 */
    int channel;          /* whose factor: 0 red, 1 green, 2 blue */
    double max_error;     /* of the error of the factor, > 0; 0: 1/255 */
    unsigned max_depth;   /* how often a triangle may be halved, at most 48; 0: 20 */
    size_t max_triangles; /* no triangle is halved for its error where there are so many; 0: 2^18 */
} nebel_tessellation_desc;

typedef struct nebel_triangles {
    const void *positions;  /* three floats each, x y z [m] */
    size_t position_stride; /* bytes, 12 or more; 0: 12 */
    double origin[3];       /* m, where positions count from, in the coordinates of the fog */
    size_t vertex_count;
    const uint32_t *indices; /* three for each triangle */
    size_t triangle_count;
} nebel_triangles;

/* The same surface in more triangles. Vertices of the input come first, in their order; vertex vertex_count_before + i
 * lies half-way between the two of parents[i], which come before it: what else vertices have, normals and texture
 * coordinates, is the mean of both, in the same order. */
typedef struct nebel_tessellation {
    size_t vertex_count, triangle_count;
    const float (*positions)[3]; /* m from the same origin */
    const uint32_t *indices;     /* three for each triangle, turned as those of the input */
    size_t input_vertex_count;   /* of the input */
    const uint32_t (*parents)[2];
    size_t added_triangles;
    double error;               /* proven bound of what is left, of all triangles; at most 1 */
    size_t unresolved_count;    /* triangles whose bound is above the one asked for: 0 where it was met */
    size_t depth_limited_count; /* those of them that `max_depth` left; the others were left by `max_triangles` */
} nebel_tessellation;

/* Splits triangles until |f - L| <= bound everywhere on each, where f is the exact transmittance between the eye and
 * the place, and L is linear between the exact f of the three corners. The bound is proven by interval arithmetic, not
 * sampled: it holds for every place of every triangle but for the rounding of double, for which 1e-6 is counted; a
 * bound below that cannot be met. What the factors of the vertices are off by themselves (nebel_compute_vertex_fog) comes on
 * top.
 *
 * Where a sharp edge of the fog crosses a triangle the error falls with the size of the triangle alone, and at the
 * silhouette of a round volume with its square root: `max_depth` and `max_triangles` end that. Then the result is OK,
 * over_count says how many triangles are left, and error how much.
 *
 * Edges are halved at their middle, for all triangles that share them: there are no T-junctions, also where vertices at
 * one place differ in their index, but none is looked for between meshes of different calls. What neighbours need may
 * exceed both limits. The longest edge of a triangle is halved first, so that angles stay at least half as wide as they
 * were. Triangles without area are triangles like others.
 *
 * The fog: any but soft edges of cylinders, cones, capsules and convex bodies of more than 32 planes, and volumes that
 * have, together with those that exclude or replace their fog where both may be, more than 8 leaves. Any
 * thread. *tessellation is NULL on an error: ARGUMENT (NULL, a stride below 12, an index that is too large, a channel
 * or allocator that is none, a depth above 48), VALUE (a bound that is negative or not finite, an eye or origin that is
 * not finite or more than 1e15 m away, a vertex of a triangle that is not finite, or farther than 5e5 m from the eye
 * along an axis), UNSUPPORTED (fog without a proof), LIMIT (2^32 - 1 vertices or edges), MEMORY. */
nebel_result nebel_tessellate(const nebel_snapshot *snapshot, const nebel_tessellation_desc *desc,
                              const nebel_triangles *triangles, nebel_tessellation **tessellation);
void nebel_destroy_tessellation(nebel_tessellation *tessellation); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif
