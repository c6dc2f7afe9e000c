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

#include <nebel/light.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- fog factors ----------------------------------------------------------------------------- */

/* f = (end - c) / (end - start), exp(-density c) or exp(-(density c)^2), clamped to [0, 1] last; colour = f surface +
 * (1 - f) fog. c is the distance or fog coordinate [m]. end == start gives a step: 1 below start, 0 from it on.
 * Source: OpenGL 2.1, section 3.10. Any thread. */
NEBEL_API double nebel_fog_factor_linear(double c, double start, double end);
NEBEL_API double nebel_fog_factor_exp(double c, double density);
NEBEL_API double nebel_fog_factor_exp2(double c, double density);

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
NEBEL_API nebel_result nebel_resolve_factor(const nebel_factor_desc *desc, nebel_factor_desc *resolved);

/* c of a place in eye coordinates [m] for a resolved description; `user` is returned with COORDINATE_USER. Any thread.
 */
NEBEL_API double nebel_compute_fog_coordinate(const nebel_factor_desc *resolved, const double place[3], double user);

/* f for a resolved description, clamped to [0, 1] last; 1 where anything is a NaN. Source: OpenGL 2.1, section 3.10.
 * Any thread. */
NEBEL_API double nebel_compute_fog_factor(const nebel_factor_desc *resolved, double c);

/* out = f surface + (1 - f) fog in red, green and blue; alpha is that of the surface. out may be surface. Any thread.
 */
NEBEL_API void nebel_blend_fog_factor(double f, const float surface[4], const double fog[3], float out[4]);

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
NEBEL_API void nebel_reset_d3d9_fog(nebel_d3d9_fog *fog);

/* SetRenderState and GetRenderState for the states above; start, end and density are the bits of a float, as there.
 * Any thread. Errors: ARGUMENT (NULL, another state), VALUE (a mode that is none); nothing has changed then. */
NEBEL_API nebel_result nebel_set_d3d9_state(nebel_d3d9_fog *fog, uint32_t state, uint32_t value);
NEBEL_API nebel_result nebel_get_d3d9_state(const nebel_d3d9_fog *fog, uint32_t state, uint32_t *value);

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
NEBEL_API double nebel_compute_d3d9_vertex_factor(const nebel_d3d9_fog *fog, const nebel_d3d9_vertex *vertex);

/* The factor of a pixel: with table fog that of `depth`, otherwise `vertex_factor`, the interpolated one. `depth` is
 * the pixel's z in camera space where nebel_d3d9_uses_w says so (1 / rhw of transformed vertices), and its device
 * depth otherwise. Any thread. */
NEBEL_API double nebel_compute_d3d9_pixel_factor(const nebel_d3d9_fog *fog, double vertex_factor, double depth);

/* 1 where table fog goes by w, 0 where by z: by the element [3][4] of the projection that the device was given, row by
 * row as D3DMATRIX has it. It counts for transformed vertices, too. Any thread. */
NEBEL_API int nebel_d3d9_uses_w(const float projection[16]);

/* FOGCOLOR as red, green and blue, 0 to 1, for nebel_blend_fog_factor. Any thread. */
NEBEL_API void nebel_get_d3d9_color(const nebel_d3d9_fog *fog, double rgb[3]);

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
    double scale;       /* k [1/m], >= 0; 0: 0.03 for EXP, 0.04 for EXP2, else 0.05 */
    const float *table; /* TABLE: NEBEL_CURVE_ENTRIES weights, 0 to 1 */
} nebel_curve;

/* Checks a curve and puts its default in; *resolved may be *curve. Any thread. Errors: ARGUMENT (NULL, an unknown type,
 * no table), VALUE (a scale that is negative or not finite). */
NEBEL_API nebel_result nebel_resolve_curve(const nebel_curve *curve, nebel_curve *resolved);

/* The amount of a resolved curve as its formula gives it, not clamped; s [m], 0 where it is negative or a NaN. Any
 * thread. */
NEBEL_API double nebel_compute_curve_amount(const nebel_curve *resolved, double s);

/* The same as a weight for blending, clamped to [0, 1]. Any thread. */
NEBEL_API double nebel_compute_curve_weight(const nebel_curve *resolved, double s);

/* ---- fog per vertex -------------------------------------------------------------------------- */

/* The eye in an object's coordinates: the inverse of `eye_from_object`, of a model-view matrix, at the origin. Sixteen
 * numbers in the memory order of OpenGL and of Direct3D, which is the same: those of the translation are 12 to 14. One
 * inversion a frame and object stands for the transformation of each vertex. Any thread. Errors: ARGUMENT (NULL, not
 * finite, not affine, or without an inverse); then `eye` is as it was. */
NEBEL_API nebel_result nebel_compute_object_eye(const double eye_from_object[16], double eye[3]);

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

/* NULL or {0}: the exact light of fog without lights. */
typedef struct nebel_vertex_desc {
    const nebel_lighting *lighting; /* of the snapshot; NULL: its fog gives source and emission alone */
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
NEBEL_API nebel_result nebel_resolve_vertex_desc(const nebel_vertex_desc *desc, nebel_vertex_desc *resolved);

/* What fog does between the eye and each of n vertices, written to `output_count` streams at once. In float; through
 * boxes of constant density f is what nebel_compute_segment_transmittance gives, to the bit, and the fastest. A byte is
 * 255 times the number, rounded to nearest, halves upwards. A vertex that holds a NaN or an infinity gets f = 1 and no
 * light; of one more than 1e18 m away only the range of f is sure. Streams may lie in each other, as the members of a
 * structure do, but no two of them, nor an output and the positions, may share a byte; where arrays lie in each other
 * their strides must be the same. Without state; any thread. Same bits for every isa and for every way of splitting the
 * vertices into calls. Errors: ARGUMENT (NULL, an unknown format, a stride that is too short, streams that share bytes,
 * an eye or origin that is not finite or more than 1e15 m away, curves as above), VALUE, UNSUPPORTED (isa not
 * available), MEMORY (scratch for very many volumes on one ray). Nothing has been written when the error is one of the
 * arguments. */
NEBEL_API nebel_result nebel_compute_vertex_fog(const nebel_snapshot *snapshot, const nebel_vertex_desc *desc, size_t n,
                                                const nebel_vertices *vertices, const nebel_vertex_output *outputs,
                                                size_t output_count);

/* ---- transparent surfaces in fog ------------------------------------------------------------- */

/* What a surface does to the light L behind it. `color` and `alpha` are the surface's own, without fog. */
typedef enum nebel_blend_mode {
    NEBEL_BLEND_OVER = 0,      /* alpha color + (1 - alpha) L */
    NEBEL_BLEND_PREMULTIPLIED, /* color + (1 - alpha) L */
    NEBEL_BLEND_ADDITIVE,      /* color + L */
    NEBEL_BLEND_MULTIPLY,      /* color L */
    NEBEL_BLEND_SCREEN,        /* color + (1 - color) L */
    NEBEL_BLEND_COUNT
} nebel_blend_mode;

/* The pixel becomes source + factor * pixel. In OpenGL: the first and second colour of glBlendFunc(GL_ONE,
 * GL_SRC1_COLOR). */
typedef struct nebel_blend {
    double source[3], factor[3];
} nebel_blend;

/* How to draw a transparent surface over a pixel that has its fog already: `fog` is the light of the way from the eye
 * to the surface. Exact for every mode, RGB transmittance, any fog behind and any stack of surfaces drawn from the back
 * to the front, as long as all of them and the pixel were fogged by the same fog. alpha is read by OVER and
 * PREMULTIPLIED alone. An unknown mode leaves the pixel as it is. Linear light. Source of the formulas:
 * src/formulas/blend.inc. Any thread. */
NEBEL_API nebel_blend nebel_blend_surface(nebel_blend_mode mode, const double color[3], double alpha,
                                          const nebel_transfer *fog);

/* ---- tessellation ---------------------------------------------------------------------------- */

/* Between vertices hardware interpolates: where triangles are large against a volume its fog breaks. nebel_tessellate
 * splits triangles until fog at their vertices is near enough to the exact fog everywhere, and not at vertices alone.
 *
 * {0}: the eye at the origin, red, 1/255. */
typedef struct nebel_tessellation_desc {
    nebel_host host;
    double eye[3];        /* m, in the coordinates of the fog; at most 1e15 */
    int channel;          /* whose factor: 0 red, 1 green, 2 blue */
    double max_error;     /* the bound of the factor's error, > 0; 0: 1/255 */
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

/* The same surface in more triangles. Vertices of the input come first, in their order; vertex input_vertex_count + i
 * lies half-way between the two of parents[i], which come before it: what else vertices have, normals and texture
 * coordinates, is the mean of both, in the same order. */
typedef struct nebel_tessellation {
    size_t vertex_count, triangle_count;
    const float (*positions)[3]; /* m from the same origin */
    const uint32_t *indices;     /* three for each triangle, turned as those of the input */
    size_t input_vertex_count;   /* how many of the vertices are those of the input */
    const uint32_t (*parents)[2];
    size_t added_triangles;
    double error;               /* proven bound of what is left, of all triangles; at most 1 */
    size_t unresolved_count;    /* triangles whose bound is above the one asked for: 0 where it was met */
    size_t depth_limited_count; /* those of them that `max_depth` left; the others were left by `max_triangles` */
} nebel_tessellation;

/* Splits triangles until |f - L| <= bound everywhere on each, where f is the exact transmittance between the eye and
 * the place, and L is linear between the exact f of the three corners. The bound is proven by interval arithmetic, not
 * sampled: it holds for every place of every triangle but for the rounding of double, for which 1e-6 is counted; a
 * bound below that cannot be met. What the factors of the vertices are off by themselves (nebel_compute_vertex_fog)
 * comes on top.
 *
 * Where a sharp edge of the fog crosses a triangle the error falls with the size of the triangle alone, and at the
 * silhouette of a round volume with its square root: `max_depth` and `max_triangles` end that. Then the result is OK,
 * unresolved_count says how many triangles are left, and error how much.
 *
 * Edges are halved at their middle, for all triangles that share them: there are no T-junctions, also where vertices at
 * one place differ in their index, but none is looked for between meshes of different calls. What neighbours need may
 * exceed both limits. The longest edge of a triangle is halved first, so that angles stay at least half as wide as they
 * were. Triangles without area are triangles like others.
 *
 * The fog: any but soft edges of cylinders, cones, capsules and convex bodies of more than 32 planes, and volumes that
 * have, together with those that exclude or replace their fog where both may be, more than 8 leaves. Any thread.
 * *tessellation is NULL on an error: ARGUMENT (NULL, a stride below 12, an index that is too large, a channel or
 * allocator that is none, a depth above 48), VALUE (a bound that is negative or not finite, an eye or origin that is
 * not finite or more than 1e15 m away, a vertex of a triangle that is not finite, or farther than 5e5 m from the eye
 * along an axis), UNSUPPORTED (fog without a proof), LIMIT (2^32 - 1 vertices or edges), MEMORY. */
NEBEL_API nebel_result nebel_tessellate(const nebel_snapshot *snapshot, const nebel_tessellation_desc *desc,
                                        const nebel_triangles *triangles, nebel_tessellation **tessellation);
NEBEL_API void nebel_destroy_tessellation(nebel_tessellation *tessellation); /* NULL is fine */

/* ==== cells with portals ========================================================================== */

/* Fog in cells with portals: the fog of engines whose world is made of convex rooms.
 *
 * Every cell has a density D [1/m] and a colour F. What a cell does to a surface of colour P is
 *
 *     I = D (Zmax - Zmin), clamped to 0..1;    pixel = I F + (1 - I) P
 *
 * where Zmin is the depth at which the cell is entered, through the plane of a portal, and Zmax that of the surface or
 * of the portal through which the cell is left. The cell of the eye begins at the eye.
 *
 *     const nebel_cell rooms[] = {
 *         {.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, 0, 0}, .max = {4, 3, 9}}},                        // no fog
 *         {.shape = {.type = NEBEL_SHAPE_BOX, .min = {4, 0, 0}, .max = {9, 3, 9}},
 *          .density = .1, .color = {.5, .5, .6}}};
 *     nebel_cells *cells = NULL;
 *     nebel_create_cells(&(nebel_cells_desc){.cells = rooms, .cell_count = 2}, &cells);
 *
 *     const nebel_cell_view view = {.eye = {1, 1, 4}, .forward = {1, 0, 0}};
 *     const nebel_cell_point point = {.position = {9, 1, 4}};
 *     nebel_cell_fog fog;
 *     nebel_compute_cell_fog(cells, &view, 1, &point, 0, &fog, 0);
 *     // fog.alpha = .1 * 5; pixel = fog.color + (1 - fog.alpha) * surface
 *
 * Two cells, each drawn in turn, give I_a + I_b - I_a I_b, while the linear model over both is I_a + I_b: a seam. Cells
 * that touch and have the same density and colour are therefore grouped along the ray and fogged once over their whole
 * span; `ungrouped` shows the seam. The exponential model I = 1 - exp(-D length) has none: with the span RAY it is the
 * fog of nebel_volume_from_cell for each cell, exactly.
 *
 * Source: the technique of engines of cells and portals around 2000; docs/classic.md has its printed form, what is
 * wrong with it, and pictures. Nothing here calls a graphics interface.
 */

/* ---- describing cells ------------------------------------------------------------------------ */

#define NEBEL_MAX_CELLS 1024
#define NEBEL_MAX_PORTAL_VERTICES 64

typedef struct nebel_cell {
    nebel_shape shape; /* a box or a convex body, with its transform; it must end in every direction */
    double density;    /* D, 1/m, >= 0; 0: no fog */
    double color[3];   /* F, radiance of opaque fog, >= 0 */
} nebel_cell;

/* A convex polygon through which one sees from one cell into another. */
typedef struct nebel_portal {
    size_t cells[2];             /* two different ones */
    const double (*vertices)[3]; /* m, either way round; where the two cells touch */
    size_t vertex_count;         /* 3 to NEBEL_MAX_PORTAL_VERTICES */
} nebel_portal;

typedef enum nebel_cell_model {
    NEBEL_CELL_LINEAR = 0,  /* I = D span */
    NEBEL_CELL_EXPONENTIAL, /* I = 1 - exp(-D span) */
    NEBEL_CELL_MODEL_COUNT
} nebel_cell_model;

/* What Zmax - Zmin is. */
typedef enum nebel_cell_span {
    NEBEL_SPAN_RAY = 0, /* m along the ray from the eye to the point */
    NEBEL_SPAN_DEPTH,   /* m of depth along the view's axis, where the ray crosses the planes: the formula as it was
                            meant. Changes when the camera turns */
    NEBEL_SPAN_PRINTED, /* m of depth as printed: Z = -(A x + B y + D) / C of the planes at the point's own x and y,
                            which with perspective is not where the ray crosses them */
    NEBEL_SPAN_COUNT
} nebel_cell_span;

/* Cells must not overlap. Lengths below 1e-6 of the extent of all cells, or 1e-12 of their largest coordinate, count as
 * nothing: cells that near touch, and cells that overlap as little do not. */
typedef struct nebel_cells_desc {
    nebel_host host;
    const nebel_cell *cells; /* 1 to NEBEL_MAX_CELLS */
    size_t cell_count;
    const nebel_portal *portals; /* the only ways from cell to cell, all else being walls; NULL: there are no walls, and
                                    the portals are wherever cells touch */
    size_t portal_count;
    nebel_cell_model model;
    nebel_cell_span span;
    int ungrouped;                       /* nonzero: each cell is fogged for itself */
    size_t *failed_cell, *failed_portal; /* NULL, or where the index of what is wrong is written: SIZE_MAX where it is
                                            none */
} nebel_cells_desc;

typedef struct nebel_cells nebel_cells;

/* Checks cells and portals and makes them ready for queries. Everything is copied. The order of the cells means
 * nothing. Cost: every pair of cells once, and every face of those that touch. On an error *cells is NULL. Errors:
 * ARGUMENT (NULL, an unknown model or span), LIMIT (too many), MEMORY, and VALUE: a cell that is neither box nor convex
 * body, that is empty (planes that face inwards), without end, or overlaps another; a density that is negative or not
 * finite; a portal of one and the same or of unknown cells, that is not convex or of no area, or does not lie
 * where its cells touch. */
NEBEL_API nebel_result nebel_create_cells(const nebel_cells_desc *desc, nebel_cells **cells);
NEBEL_API void nebel_destroy_cells(nebel_cells *cells); /* NULL is fine */

/* The portals, given or derived; arrays of the second live as long as the cells. Vertices of derived ones go
 * counterclockwise as seen from cells[1]. index < nebel_get_cell_portal_count. Any thread. */
NEBEL_API size_t nebel_get_cell_portal_count(const nebel_cells *cells);
NEBEL_API nebel_portal nebel_get_cell_portal(const nebel_cells *cells, size_t index);

/* The same fog as a volume for nebel_add_volume: extinction D in all colours, source F. Its arrays are the cell's. Any
 * thread. */
NEBEL_API nebel_volume_desc nebel_volume_from_cell(const nebel_cell *cell);

/* ---- asking ---------------------------------------------------------------------------------- */

typedef struct nebel_cell_view {
    double eye[3];     /* m */
    double forward[3]; /* the view's axis, any length but 0; Z counts from the eye along it, > 0 in front. Not read with
                          NEBEL_SPAN_RAY */
    int ignore_walls;  /* nonzero: fog as though there were no walls. For vertices: a wall may hide one whose polygon is
                          seen beside it, and that part of it is interpolated */
} nebel_cell_view;

typedef struct nebel_cell_point {
    double position[3];  /* m, of a vertex or another point of a surface */
    nebel_plane surface; /* of its polygon, for Zmax; normal 0, or seen edge-on: the point's own Z. Read with
                            NEBEL_SPAN_PRINTED alone */
} nebel_cell_point;

/* What the cells do to the point: pixel = color + (1 - alpha) P. */
typedef struct nebel_cell_fog {
    double color[3]; /* of all fog before the point, weakened by the fog before that */
    double alpha;    /* 0 to 1 */
} nebel_cell_fog;

/* One fog on the way, as an engine draws it: an alpha polygon in the colour, behind those that come before it. */
typedef struct nebel_cell_segment {
    double color[3];
    double intensity;             /* I, 0 to 1 */
    double from, to;              /* Zmin and Zmax, or m along the ray */
    size_t first_cell, last_cell; /* cells in which it begins and ends */
} nebel_cell_segment;

/* What the cells do to each of n points. Strides in bytes; 0: without gaps. points and fog share no bytes,
 * but may lie in the same structures.
 *
 * The way goes straight from the eye to the point. With portals given it begins in the eye's cell and ends where it
 * leaves a cell other than through a portal: behind that wall there is no fog, as there is none for an eye outside all
 * cells. Without, fog is wherever cells are, and an eye outside sees it through their faces. Cells behind the eye do
 * nothing. An eye in a portal is in the cell that it looks into. With DEPTH and PRINTED a point that is not in front
 * of the eye (Z <= 0) has no fog; with PRINTED a plane that is seen edge-on (C = 0) is met where the ray crosses it,
 * and Z is kept between 0 and the point's Zmax. A way that runs in a face belongs to one of the two cells, by the rule
 * of docs/scene-file.md. A point that is not finite has no fog. Any thread. Errors: ARGUMENT (NULL, an eye that is not
 * finite, a forward that has no direction, a stride shorter than its elements, points and fog that share bytes). */
NEBEL_API nebel_result nebel_compute_cell_fog(const nebel_cells *cells, const nebel_cell_view *view, size_t n,
                                              const nebel_cell_point *points, size_t point_stride, nebel_cell_fog *fog,
                                              size_t fog_stride);

/* The layers of fog before one point, from the eye on, as many as there is room for; in *count how many there are, at
 * most NEBEL_MAX_CELLS. Any thread. Errors as nebel_compute_cell_fog. */
NEBEL_API nebel_result nebel_compute_cell_segments(const nebel_cells *cells, const nebel_cell_view *view,
                                                   const nebel_cell_point *point, size_t room,
                                                   nebel_cell_segment *layers, size_t *count);

#ifdef __cplusplus
}
#endif

#endif
