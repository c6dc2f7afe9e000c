/* Fog in shaders: the fog function as text, and the fog packed into numbers that the text reads.
 *
 *     size_t count = 0;
 *     nebel_pack_fog(lighting, camera_position, NULL, 0, &count);           // how many words? lighting: nebel/light.h
 *     nebel_pack_fog(lighting, camera_position, words, capacity, &count);   // each frame: 4 floats a word
 *     // upload the words into a uniform block of 16 KiB or a float texture, put nebel_get_shader_source() behind
 *     // your #version line, and
 *
 *     nebel_transfer fog = nebel_trace(vec3(0), direction, distance);          // in the shader
 *     color = fog.transmittance * color + fog.in_scattering;
 *
 * The text is made of the formulas that the C library is compiled from. It has no #version line, and every name in it
 * begins with nebel_, NEBEL_, nb_ or NB_. Positions are relative to the eye that the fog was packed for, so that float
 * is enough anywhere in the world. No graphics interface is called here: this works for OpenGL, OpenGL ES, WebGL,
 * Vulkan and Direct3D alike; nebel/gl.h does the rest for OpenGL.
 *
 * What the text declares, in every dialect (vec3 is float3 in HLSL); the functions along a ray are macros, so that a
 * program holds those that it calls, once for each call:
 *
 *     struct nebel_transfer { vec3 transmittance; vec3 in_scattering; };
 *     nebel_transfer nebel_trace(vec3 origin, vec3 direction, float t_max);
 *         Light along origin + t direction, 0 <= t <= t_max: origin in metres relative to the packed eye, direction of
 *         unit length, t_max in metres, 1e18 or more for an endless ray. All volumes, exact overlap, any number.
 *     nebel_transfer nebel_trace_list(vec3 origin, vec3 direction, float t_max, int first, int count);
 *         The same for the volumes NEBEL_TILE_ENTRY(first) ... NEBEL_TILE_ENTRY(first + count - 1) alone, ascending: see
 *         nebel_bin_volumes.
 *     vec3 nebel_transmit(vec3 origin, vec3 direction, float t_max);
 *     vec3 nebel_transmit_list(vec3 origin, vec3 direction, float t_max, int first, int count);
 *         Transmittance alone.
 *     vec3 nebel_transmit_shadow(vec3 origin, vec3 direction, float t_max);
 *     vec3 nebel_transmit_shadow_list(vec3 origin, vec3 direction, float t_max, int first, int count);
 *         The same for a ray that does not begin at the eye, as one to a light: `start` and `cutoff` of volumes do not
 *         count.
 *
 * Point and spot lights are packed with the fog that they light, and in-scattering has their light, attenuated by all
 * fog on its way. Where surfaces keep it away the host says, where it defines before the text
 *
 *     NEBEL_LIGHT_VISIBILITY(light, origin, direction, t, end)
 *         A vec2: what share of the light of number `light`, in the order of the lighting, reaches the ray from t
 *         on, and up to where on the ray that holds, more than t and at most `end` (which may be 1e18). Looked up in a
 *         shadow map, say; all but 0 and 1 is soft shadow.
 *
 * With NEBEL_VIEW defined before it, the text also declares, in every dialect:
 *
 *     struct nebel_view_ray { vec3 origin; vec3 direction; float t_max; };
 *     nebel_view_ray nebel_make_view_ray(vec2 pixel, float depth);
 *         The ray of a pixel (gl_FragCoord.xy) up to the surface at `depth`, ready for nebel_trace; 1e18 where there is
 *         none. See nebel_compute_view_rays. Where NEBEL_DEPTH_ENCODING is defined as the number of a nebel_depth_encoding, the text
 *         knows no other; where NEBEL_FROM_EYE is, all rays start at the eye, as nebel_rays says. It reads
 *         NEBEL_RAY(i), a vec4 of nebel_rays; GLSL 3.30 and ES 3.00 declare `uniform vec4 nebel_rays[NEBEL_RAY_TEXELS];`
 *         unless the host defines NEBEL_RAY itself.
 *
 * With NEBEL_TRANSPARENT defined before it, the text also declares, in every dialect, what transparent surfaces and
 * particles need. Blending, for each mode as nebel_blend_surface does it:
 *
 *     struct nebel_blend { vec3 source; vec3 factor; };
 *     nebel_blend nebel_blend_over(vec3 color, float alpha, nebel_transfer fog);
 *     nebel_blend nebel_blend_premultiplied(vec3 color, float alpha, nebel_transfer fog);
 *     nebel_blend nebel_blend_additive(vec3 color, nebel_transfer fog);
 *     nebel_blend nebel_blend_multiply(vec3 color, nebel_transfer fog);
 *     nebel_blend nebel_blend_screen(vec3 color, nebel_transfer fog);
 *     nebel_blend nebel_blend_medium(nebel_transfer medium, nebel_transfer fog);
 *         Over a picture that has its fog already: `fog` is nebel_trace up to the surface, and the pixel becomes
 *         source + factor * pixel. MEDIUM is a particle: the pixel behind times its transmittance, plus its own
 *         in-scattering. With two outputs, location 0 index 0 and 1, all modes are drawn from the back to the front by
 *         glBlendFuncSeparate(GL_ONE, GL_SRC1_COLOR, GL_ZERO, GL_ONE); that needs OpenGL 3.3 or
 *         GL_EXT_blend_func_extended.
 *     vec4 nebel_blend_gray(nebel_blend blend);
 *         Source, and the mean factor as alpha, for one output everywhere:
 *         glBlendFuncSeparate(GL_ONE, GL_SRC_ALPHA, GL_ZERO, GL_ONE). Exact where the factors of the colours are equal:
 *         over, premultiplied, additive; multiply, screen and medium if they are grey. Coloured ones without two
 *         outputs are drawn twice, exact too: first the factor with glBlendFunc(GL_ZERO, GL_SRC_COLOR), then the source
 *         with glBlendFunc(GL_ONE, GL_ONE).
 *
 * Particles:
 *
 *     float nebel_sphere_path_length(vec3 origin, vec3 direction, float t_max, vec3 center, float radius, int power);
 *     float nebel_gaussian_path_length(vec3 origin, vec3 direction, float t_max, vec3 center, float radius, float sigma);
 *         The density of a particle integrated along the ray from t = 0 to t_max [m], closed form:
 *         (1 - r^2)^power, r the distance from the centre in radii, power 0 (even) to 3;
 *         exp(-distance^2 / (2 sigma^2)) within the radius (1e18: without bound). With the t_max of nebel_make_view_ray, that is
 *         with the opaque surface's depth, edges are soft because they are right. Radius and sigma > 0. Positions are
 *         floats: a particle 10,000 radii away still has its digits.
 *     nebel_transfer nebel_medium_transfer(float length, vec3 extinction, vec3 light);
 *         What so much of a medium does to light: extinction and radiance per metre where the density is 1 [1/m].
 *
 * The classic comparison of a particle with the opaque depth around:
 *
 *     struct nebel_depth_taps { float offset; float nothing; float edge; float margin; float brightness; };
 *     nebel_depth_taps nebel_default_taps();
 *         0.0005 of the screen, 100000, 0.5, 0.125, 1.
 *     vec2 nebel_screen_uv(vec4 clip);
 *         Where clip space is on the screen, 0 to 1.
 *     float nebel_compare_taps(float depth, float center, vec4 corners, nebel_depth_taps taps);
 *         What to multiply a particle's colour by: `brightness`, or 0 where it is hidden. Depths are in metres along
 *         the camera's axis: the particle's, and those of the opaque picture at the pixel and `offset` away along both
 *         diagonals; below 0 nothing is there and `nothing` counts. Drawn where they differ by more than `edge`, and
 *         where none is nearer than depth - margin.
 *     float nebel_five_taps(vec2 place, float depth, nebel_depth_taps taps);
 *         The same with depths from NEBEL_OPAQUE_DEPTH(place), which the host defines before the text; else the
 *         function is not there.
 *
 * Where the words come from: NEBEL_FOG_TEXEL(i), a vec4. By default (GLSL 3.30 and ES 3.00) the text declares
 *
 *     layout(std140) uniform nebel_fog_block { vec4 nebel_texels[1024]; };
 *
 * with NEBEL_FOG_TEXTURE defined before it `uniform highp sampler2D nebel_fog_texture;`, rows of NEBEL_TEXTURE_WIDTH texels
 * RGBA32F; a host that defines NEBEL_FOG_TEXEL itself gets neither. The Vulkan and HLSL texts declare nothing: define
 * NEBEL_FOG_TEXEL before them. NEBEL_TILE_ENTRY(i), an int, is only needed by the _list functions, which are there when it is
 * defined; NEBEL_TILES makes GLSL define it and declare `uniform highp usampler2D nebel_tile_texture;`, rows of
 * NEBEL_TEXTURE_WIDTH texels R32UI. NEBEL_VOXEL_TEXEL(i), a uvec4 of nebel_pack_voxels, is only needed for grids, which are
 * no fog without it; NEBEL_VOXELS makes GLSL define it and declare `uniform highp usampler2D nebel_voxel_texture;`,
 * rows of NEBEL_TEXTURE_WIDTH texels RGBA32UI. So is NEBEL_DIFFUSION_TEXEL(i), a vec4 of nebel_pack_diffusion, for light that is
 * scattered more than once; NEBEL_DIFFUSION makes GLSL define it and declare
 * `uniform highp sampler2D nebel_diffusion_texture;`, rows of NEBEL_TEXTURE_WIDTH texels RGBA32F. NEBEL_ENVIRONMENT_TEXEL(i),
 * a vec4 of nebel_pack_environment, is only needed for ambient light by direction, which is dark without it;
 * NEBEL_ENVIRONMENT makes GLSL define it and declare `uniform highp sampler2D nebel_environment_texture;`, rows of
 * NEBEL_TEXTURE_WIDTH texels RGBA32F. NEBEL_FEATURES may be defined as what nebel_pack_features says, and
 * NEBEL_MAX_ITERATIONS as how many turns of loops a ray may take, for drivers that end loops: see docs/shaders.md. The GLSL
 * ES text makes highp the default precision.
 *
 * Ambient light by direction (nebel_environment) is among the in-scattering of fog that has an albedo. Surfaces and
 * what is behind everything ask for it themselves, of words that were packed for surfaces:
 *
 *     vec3 nebel_evaluate_environment(vec3 direction);
 *     vec3 nebel_evaluate_environment_diffuse(vec3 normal);
 *         As in nebel/light.h, of unit length; also of a constant one.
 *
 * With NEBEL_SKY_VIEW_TEXEL(i), a vec4 of nebel_pack_sky_view, or NEBEL_SKY_VIEW, which makes GLSL define it and declare
 * `uniform highp sampler2D nebel_sky_view_texture;` (rows of NEBEL_TEXTURE_WIDTH texels RGBA32F), the text also declares the
 * air of a planet, for rays of unit length from the place that the view was made for:
 *
 *     nebel_transfer nebel_trace_atmosphere(vec3 direction, float t_max);
 *         What nebel_trace_sky_view says; t_max 1e18 or more: to the ground or the end of the air.
 *     struct nebel_ground { float distance; vec3 normal; vec3 sun; vec3 sky; };
 *     nebel_ground nebel_trace_ground(vec3 direction);
 *         What nebel_trace_ground says; distance 1e18 where the ground is not met, and the rest means nothing.
 *
 * Fog that the sun lights knows no surfaces. A host says where they keep the sun away by a function in front of the
 * text, named by
 *
 *     #define NEBEL_SUN_VISIBILITY(origin, direction, t, end) my_sun_lit(origin, direction, t, end)
 *     vec2 my_sun_lit(vec3 origin, vec3 direction, float t, float end)
 *
 * which returns the share of sunlight, 0 to 1, that reaches the ray from t on, and up to where along the ray that holds
 * (more than t, at most end) [m]. Without it all fog is lit. A function with loops of its own counts them in an int for
 * NEBEL_MAX_ITERATIONS, named by `#define NEBEL_SUN_VISIBILITY_ITERATIONS my_turns`. See docs/shaders.md.
 *
 * docs/shaders.md shows a complete shader, the same for Vulkan and HLSL, and says how exact and how fast all this is.
 *
 * A direction of no length, a t_max that is not above 0, or a NaN anywhere gives transmittance 1 and no light.
 * In-scattering is at most NEBEL_MAX_RADIANCE, 65504 (the largest half) unless it was defined before: so emission without
 * end stays a number.
 */
#ifndef NEBEL_SHADER_H
#define NEBEL_SHADER_H

#include <nebel/light.h>
#include <nebel/planet.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum nebel_shader_dialect {
    NEBEL_DIALECT_GLSL_330 = 0,
    NEBEL_DIALECT_GLSL_300_ES,
    NEBEL_DIALECT_GLSL_450, /* for Vulkan */
    NEBEL_DIALECT_HLSL,     /* shader model 5 */
    NEBEL_DIALECT_COUNT
} nebel_shader_dialect;

/* The text for a dialect, zero-terminated; lives for ever. NULL for an unknown number. Any thread. */
NEBEL_API const char *nebel_get_shader_source(nebel_shader_dialect dialect);

#define NEBEL_BLOCK_TEXELS 1024  /* what the uniform block holds: 16 KiB, which every OpenGL ES 3.0 has */
#define NEBEL_TEXTURE_WIDTH 1024 /* words in a row of the texture */

#define NEBEL_MAX_PACKED_VOLUMES 1677721 /* more never fit; of bodies with faces, or of several parts, fewer */

/* One word of packed fog: a vec4. */
typedef struct nebel_texel_f32 {
    float v[4];
} nebel_texel_f32;

/* Packs the fog of a lighting, and its lights, for an eye [m]; for fog without lights nebel_create_lighting(snapshot,
 * NULL, &lighting) makes a lighting. *count receives the number of words needed; they are written when `capacity` is at least that. Same lighting and eye, same words. O(volumes and their parts). Any thread.
 * Errors: ARGUMENT; LIMIT when capacity is too small (not for words NULL and capacity 0, which only asks) or when more
 * than 2^24 words would be needed. */
NEBEL_API nebel_result nebel_pack_fog(const nebel_lighting *lighting, const double eye[3], nebel_texel_f32 *words,
                                      size_t capacity, size_t *count);

/* Four integers of a grid's voxels: a uvec4. */
typedef struct nebel_texel_u32 {
    uint32_t v[4];
} nebel_texel_u32;

/* Packs the voxels of a lighting's fog. *count receives the number of texels needed, 0 where there is no grid; they are
 * written when `capacity` is at least that. A cube of 8 x 8 x 8 voxels takes one texel where all are equal, else 513:
 * each voxel in 65,536 steps between the least and the most of its cube. Where the sun lights fog each grid has besides
 * how much of it lies before the sun, which takes up to 2^23 texels. They do not depend on the eye: pack again when
 * nebel_is_same_voxels denies. O(voxels). Any thread. Errors: ARGUMENT; MEMORY; LIMIT when capacity is too small (not
 * for texels NULL and capacity 0, which only asks) or when more than 2^24 texels (256 MiB) would be needed, for which
 * nebel_pack_fog answers LIMIT, too. */
NEBEL_API nebel_result nebel_pack_voxels(const nebel_lighting *lighting, nebel_texel_u32 *texels, size_t capacity,
                                         size_t *count);

/* Whether nebel_pack_voxels makes the same of both: not where the sun moves, nor in sunlight where the largest
 * extinction of a grid's volume passes a power of two. O(volumes) where they share their grids. Any thread. */
NEBEL_API int nebel_is_same_voxels(const nebel_lighting *a, const nebel_lighting *b);

/* Packs the lattice of light that is scattered more than once. *count receives the number of words needed, 0 where the
 * lighting has no diffusion or lights no fog; they are written when `capacity` is at least that: three a node, seven
 * where fog has colour. They do not depend on the eye. O(nodes). Any thread. Errors: ARGUMENT; LIMIT when capacity is
 * too small (not for words NULL and capacity 0, which only asks) or when more than 2^24 words (256 MiB) would be
 * needed, for which nebel_pack_fog answers LIMIT, too. */
NEBEL_API nebel_result nebel_pack_diffusion(const nebel_lighting *lighting, nebel_texel_f32 *words, size_t capacity,
                                            size_t *count);

/* Packs what a lighting's environment (nebel/light.h) is to the fog that it lights, and where `surfaces` is not 0 what
 * nebel_evaluate_environment and nebel_evaluate_environment_diffuse of the text want. *count receives the number of
 * words needed, 0 where no fog scatters light by direction and surfaces are not asked for; they are written when
 * `capacity` is at least that. A gradient takes 4, and 127 for each phase function; a map up to 524,289 (8 MiB) for
 * each, the same once for surfaces, and one for each of its pixels. They do not depend on the eye: pack again when
 * nebel_is_same_environment denies. O(words). Any thread. Errors: ARGUMENT; LIMIT when capacity is too small (not for
 * words NULL and capacity 0, which only asks) or when more than 2^24 words (256 MiB) would be needed, for which
 * nebel_pack_fog answers LIMIT, too. */
NEBEL_API nebel_result nebel_pack_environment(const nebel_lighting *lighting, int surfaces, nebel_texel_f32 *words,
                                              size_t capacity, size_t *count);

/* Whether nebel_pack_environment makes the same of both. O(phase functions). Any thread. */
NEBEL_API int nebel_is_same_environment(const nebel_lighting *a, const nebel_lighting *b);

/* What the fog and its lights have, as a mask for NEBEL_FEATURES: the text leaves out the shapes, profiles and walks
 * that it does not name, and a driver makes a smaller and faster program. Fog that has more than the shader was
 * compiled for gives wrong answers; masks of several lightings may be joined with |. NULL gives everything. O(volumes
 * and their parts). Any thread. */
NEBEL_API uint32_t nebel_pack_features(const nebel_lighting *lighting);

/* The feature of fog whose volumes are of different light: rays may have to be walked, from event to event. */
#define NEBEL_FEATURE_MIXED 512u

/* The feature of fog of which volumes exclude or replace others. */
#define NEBEL_FEATURE_OVERRIDE 256u

/* The feature of fog that has bodies of several leaves: unions and the like, and intersections. */
#define NEBEL_FEATURE_GROUP 128u

/* The feature of fog that the sun lights. */
#define NEBEL_FEATURE_SUN 524288u

/* The feature of fog that has grids: the text needs NEBEL_VOXELS, or NEBEL_VOXEL_TEXEL, defined before it. */
#define NEBEL_FEATURE_GRID 1048576u

/* The feature of fog that point lights light, which transmittance has no need of. */
#define NEBEL_FEATURE_LIGHTS 2097152u

/* The feature of fog whose light is scattered more than once (nebel/light.h), which transmittance has no need of:
 * the text needs NEBEL_DIFFUSION, or NEBEL_DIFFUSION_TEXEL, defined before it. */
#define NEBEL_FEATURE_DIFFUSION 4194304u

/* The feature of fog that scatters ambient light by direction: the text needs NEBEL_ENVIRONMENT, or
 * NEBEL_ENVIRONMENT_TEXEL, defined before it. Transmittance has no need of it. */
#define NEBEL_FEATURE_ENVIRONMENT 8388608u

/* Packs the table of a view of a planet's air (nebel/planet.h), for the place that it was made for: all that the text's
 * nebel_trace_atmosphere and nebel_trace_ground want. *count receives the number of words needed; they are written when
 * `capacity` is at least that: 5,000 to 10,000 for each kind of air that scatters, from space three times as many,
 * where rays may end within the air six times. The words stay while eye and sun do, however the camera turns. O(words).
 * Any thread. Errors: ARGUMENT; LIMIT when capacity is too small (not for words NULL and capacity 0, which only asks).
 */
NEBEL_API nebel_result nebel_pack_sky_view(const nebel_sky_view *view, nebel_texel_f32 *words, size_t capacity,
                                           size_t *count);

/* ---- views ----------------------------------------------------------------------------------- */

/* How a picture is seen. Matrices are column-major, as OpenGL takes them, in double, so that a camera may be anywhere.
 * Any projection of points to clip space will do: perspective, orthographic, off-axis, reversed, infinite, with an
 * oblique near plane. */
typedef struct nebel_view {
    double eye_from_world[16]; /* rotation and translation */
    double clip_from_eye[16];
    uint32_t width, height; /* pixels, 1 to 65536 */
} nebel_view;

/* What a texel of the host's depth picture holds. */
typedef enum nebel_depth_encoding {
    NEBEL_DEPTH_ENCODING_WINDOW = 0,  /* what a depth buffer holds */
    NEBEL_DEPTH_ENCODING_LOGARITHMIC, /* log(1 + c w) / log(1 + c far), w from clip space: the logarithmic depth of large
                                    worlds */
    NEBEL_DEPTH_ENCODING_AXIAL,       /* metres along the camera's axis */
    NEBEL_DEPTH_ENCODING_RADIAL,      /* metres along the ray, from where rays start by default */
    NEBEL_DEPTH_ENCODING_COUNT
} nebel_depth_encoding;

/* Which depth says that nothing was hit, so that the ray has no end. */
typedef enum nebel_background_depth {
    NEBEL_BACKGROUND_DEPTH_FAR =
        0, /* WINDOW, LOGARITHMIC: the farther end of the range, whichever that is; AXIAL, RADIAL: 0 or less,
                          1e18 or more, NaN */
    NEBEL_BACKGROUND_DEPTH_VALUE, /* background_depth alone, compared as float */
    NEBEL_BACKGROUND_DEPTH_NONE   /* no depth: the farther end of the range is a wall */
} nebel_background_depth;

typedef enum nebel_ray_start {
    NEBEL_RAY_START_EYE =
        0,               /* where the rays of a projection meet; parallel rays: the plane across them through the eye */
    NEBEL_RAY_START_NEAR /* the near plane: for a mirror whose near plane is its surface, for parallel rays that begin
                            behind the eye */
} nebel_ray_start;

/* The convention of the host's depth. {0} is OpenGL's own: clip z from -1 to 1, a depth range from 0 to 1. Reversed
 * depth and infinite far planes need no word here: the matrix tells. */
typedef struct nebel_depth_desc {
    nebel_depth_encoding encoding;
    int zero_to_one;           /* nonzero: clip z reaches from 0 to 1 (glClipControl, Vulkan, Direct3D), not from -1 */
    double range[2];           /* what glDepthRange was given, apart; both 0: 0 and 1 */
    double log_scale, log_far; /* LOGARITHMIC: c [1/m] and far [m], > 0; log_scale 0: 1 */
    nebel_background_depth background;
    double background_depth;
    nebel_ray_start ray_start;
} nebel_depth_desc;

#define NEBEL_RAY_TEXELS 10

/* The rays of a view as the text's nebel_make_view_ray takes them, and the eye that they count from. */
typedef struct nebel_rays {
    double eye[3]; /* [m]: pack the fog for it */
    int from_eye;  /* nonzero: all rays start there */
    nebel_texel_f32 texels[NEBEL_RAY_TEXELS];
} nebel_rays;

/* Computes, in double, what makes rays of pixels and lengths of depths. Pixel (x, y) counts from the lower left corner,
 * as gl_FragCoord does; its centre is at (x + .5, y + .5). A host whose rows count from the top negates the second row
 * of clip_from_eye. Parallel rays go along -z of eye space, others to where w is positive in clip space. `depth` NULL:
 * {0}. O(1). Any thread. Errors: ARGUMENT (a number that is not finite, a matrix that cannot be inverted, one whose
 * rays neither meet in a point nor are parallel with constant w; a size, a range, a kind that is none). */
NEBEL_API nebel_result nebel_compute_view_rays(const nebel_view *view, const nebel_depth_desc *depth, nebel_rays *rays);

/* How well floats hold fog in a view: what they move changes transmittance, and light relative to the brighter of 1 and
 * the brightest source, by at most `error` a pixel or more beside outlines. The lengths are those of the volume that is
 * worst. */
typedef struct nebel_view_error {
    double error;              /* the sum of the next two */
    double by_width, by_pixel; /* because the volume is narrow for its distance; because pixels are */
    double
        by_surface; /* in addition, where surfaces lie in the fog: because their distances are floats. Of all volumes */
    double distance; /* m: of its farthest place from the eye; of endless fog: of what is narrow */
    double width;    /* m: the least between its faces, or over which its density changes; INFINITY: none */
    double pixel;    /* m: the width of a pixel at that distance */
    double clear;    /* m: in a view of parallel rays no volume begins nearer to the plane through the eye. 0 in
                                  others, and where `start` or `cutoff` of a volume counts from there. INFINITY without
                                  volumes */
} nebel_view_error;

/* Bounds by how much places in floats change the fog of a view. Errors: as nebel_compute_view_rays. Any thread.
 * O(volumes and their parts, and the square of the planes of one). */
NEBEL_API nebel_result nebel_find_view_error(const nebel_snapshot *snapshot, const nebel_view *view,
                                             nebel_view_error *error);

/* ---- tiles ----------------------------------------------------------------------------------- */

/* Which volumes each tile of the screen may see, so that many small volumes cost what a tile sees. Tiles are tile_size
 * pixels wide and high (a power of two, 4 to 256), counted from the lower left corner, row by row; tile k owns
 * entries[2 k] = first and entries[2 k + 1] = count, and the volumes of the tile are entries[first] ... entries[first +
 * count - 1], ascending, as nebel_trace_list takes them. *count receives the number of entries needed; they are written
 * when capacity is at least that; with less the result is LIMIT, without a message. `view` must be the one of the eye
 * that the fog was packed for. O(volumes + entries). Any thread. Errors: ARGUMENT (a matrix that cannot be inverted or
 * is not finite), MEMORY, LIMIT as nebel_pack_fog. */
NEBEL_API nebel_result nebel_bin_volumes(const nebel_snapshot *snapshot, const nebel_view *view, uint32_t tile_size,
                                         uint32_t *entries, size_t capacity, size_t *count);

#ifdef __cplusplus
}
#endif
#endif
