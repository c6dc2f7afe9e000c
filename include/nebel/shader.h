/* Fog in shaders: the fog function as text, and the fog packed into numbers that the text reads.
 *
 *     size_t count = 0;
 *     nebel_pack_fog(snapshot, camera_position, NULL, 0, &count);           // how many words?
 *     nebel_pack_fog(snapshot, camera_position, words, capacity, &count);   // each frame: 4 floats a word
 *     // upload the words into a uniform block of 16 KiB or a float texture, put nebel_shader_text() behind your #version line, and
 *
 *     nebel_light fog = nebel_trace(vec3(0), direction, distance);          // in the shader
 *     color = fog.transmittance * color + fog.in_scattering;
 *
 * The text is made of the formulas that the C library is compiled from. It has no #version line, and every name in it begins
 * with nebel_, NEBEL_, nb_ or NB_. Positions are relative to the eye that the fog was packed for, so that float is enough
 * anywhere in the world. No graphics interface is called here: this works for OpenGL, OpenGL ES, WebGL, Vulkan and Direct3D alike;
 * nebel/gl.h does the rest for OpenGL.
 *
 * What the text declares, in every dialect (vec3 is float3 in HLSL):
 *
 *     struct nebel_light { vec3 transmittance; vec3 in_scattering; };
 *     nebel_light nebel_trace(vec3 origin, vec3 direction, float t_max);
 *         Light along origin + t direction, 0 <= t <= t_max: origin in metres relative to the packed eye, direction of unit length,
 *         t_max in metres, 1e18 or more for an endless ray. All volumes, exact overlap, any number.
 *     nebel_light nebel_trace_list(vec3 origin, vec3 direction, float t_max, int first, int count);
 *         The same for the volumes NEBEL_INDEX(first) ... NEBEL_INDEX(first + count - 1) alone, ascending: see nebel_tiles.
 *     vec3 nebel_transmit(vec3 origin, vec3 direction, float t_max);
 *     vec3 nebel_transmit_list(vec3 origin, vec3 direction, float t_max, int first, int count);
 *         Transmittance alone.
 *
 * Where the words come from: NEBEL_WORD(i), a vec4. By default (GLSL 3.30 and ES 3.00) the text declares
 *
 *     layout(std140) uniform nebel_fog_block { vec4 nebel_words[1024]; };
 *
 * with NEBEL_TEXTURE defined before it `uniform highp sampler2D nebel_fog_texture;`, rows of NEBEL_TEXTURE_WIDTH texels RGBA32F;
 * a host that defines NEBEL_WORD itself gets neither. The Vulkan and HLSL texts declare nothing: define NEBEL_WORD before them.
 * NEBEL_INDEX(i), an int, is only needed by the _list functions; NEBEL_TILES makes GLSL declare
 * `uniform highp usampler2D nebel_tile_texture;`, rows of NEBEL_TEXTURE_WIDTH texels R32UI.
 */
#ifndef NEBEL_SHADER_H
#define NEBEL_SHADER_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum nebel_dialect {
    NEBEL_DIALECT_GLSL_330 = 0,
    NEBEL_DIALECT_GLSL_300_ES,
    NEBEL_DIALECT_GLSL_450, /* for Vulkan */
    NEBEL_DIALECT_HLSL,     /* shader model 5 */
    NEBEL_DIALECT_COUNT
} nebel_dialect;

/* The text for a dialect, zero-terminated; lives for ever. NULL for an unknown number. Any thread. */
const char *nebel_shader_text(nebel_dialect dialect);

#define NEBEL_BLOCK_WORDS 1024    /* what the uniform block holds: 16 KiB, which every OpenGL ES 3.0 has */
#define NEBEL_TEXTURE_WIDTH 1024  /* words in a row of the texture */

/* One word of packed fog: a vec4. */
typedef struct nebel_word {
    float v[4];
} nebel_word;

/* Packs a snapshot for an eye [m]. *count receives the number of words needed; they are written when `capacity` is at least that.
 * Same snapshot and eye, same words. O(volumes and their parts). Any thread.
 * Errors: ARGUMENT; LIMIT when capacity is too small (not for words NULL and capacity 0, which only asks) or when more than
 * 2^24 words would be needed. */
nebel_result nebel_pack_fog(const nebel_snapshot *snapshot, const double eye[3], nebel_word *words, size_t capacity,
                            size_t *count);

/* ---- views ---------------------------------------------------------------------------------------------------------- */

/* How a picture is seen. Matrices are column-major, as OpenGL takes them, in double, so that a camera may be anywhere. Any
 * projection of points to clip space will do: perspective, orthographic, off-axis, reversed, infinite, with an oblique near
 * plane. */
typedef struct nebel_view {
    double eye_from_world[16];  /* rotation and translation */
    double clip_from_eye[16];
    uint32_t width, height;     /* pixels, 1 to 65536 */
} nebel_view;

/* ---- tiles ----------------------------------------------------------------------------------------------------------- */

/* Which volumes each tile of the screen may see, so that many small volumes cost what a tile sees. Tiles are tile_size pixels
 * wide and high (a power of two, 4 to 256), counted from the lower left corner, row by row; tile k owns entries[2 k] = first and
 * entries[2 k + 1] = count, and the volumes of the tile are entries[first] ... entries[first + count - 1], ascending, as
 * nebel_trace_list takes them. *count receives the number of entries needed; they are written when capacity is at least that.
 * `view` must be the one of the eye that the fog was packed for. O(volumes + entries). Any thread.
 * Errors: ARGUMENT (a matrix that cannot be inverted or is not finite), MEMORY, LIMIT as nebel_pack_fog. */
nebel_result nebel_tile_volumes(const nebel_snapshot *snapshot, const nebel_view *view, uint32_t tile_size,
                                uint32_t *entries, size_t capacity, size_t *count);

#ifdef __cplusplus
}
#endif
#endif
