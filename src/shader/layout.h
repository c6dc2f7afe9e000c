/* What the words of packed fog mean. pack.c writes them, media.glsl and fog.glsl read them: this text is compiled as C,
 * GLSL and HLSL. A word is four floats; integers are kept as floats, exact to 2^24, because a texture may change the
 * bits of small numbers. Lengths are in metres, places relative to the packed eye, distances at most 1e18 in size.
 *
 * Word 0: media, what one step of an integral without a closed form may be off by, the largest opacity, lamps that light
 *         fog.
 * Word 1: the direction towards the sun, of length 1; how what the sun adds is had between turns, NB_SUN_.
 * Word 2: the sun's irradiance; the first word of the lamps. The sun's numbers are 0 where no medium is sunlit.
 *
 * A medium, NB_MEDIUM_WORDS words in the snapshot's order:
 *     0  extinction, density kind
 *     1  light per metre at density 1 (radiance times extinction, plus emission), flags and rank: 1 where there is
 *        emission, plus 2 where it covers, plus 4 times its rank, counted from 0: what covers takes away the fog of
 *        every lower rank
 *     2  radiance of opaque fog, leaves
 *     3  the density's coordinate: gradient and value at the eye; gaussian: the way from its centre to the eye,
 *        1 / (sqrt(2) sigma); soft edge of a box: three unused, 1 / distance; of a round body: gain, steepness and
 *        inner of nb_edge, one unused; of planes: unused; grid: cells per unit of the box along each axis, first texel
 *     4  its only leaf; of a body of several: bounds low, first leaf's word; bounds high
 *        The last number of words 5 and 6 is where along a ray it starts to act and where it ends, 1e18 where it does
 *        not [m]; that of word 7 its first scattering word, 0 where it scatters no light of sun or lamps.
 *
 * A leaf, NB_LEAF_WORDS words:
 *     0  leaf type (plus NB_LEAF_TURNED), a, b, folds
 *     1  the eye in the leaf's frame; box: low
 *     2  box: high
 *     3  the matrix, row by row; where the type says that it is turned
 * Scattering, NB_SCATTERING_WORDS words. Ambient light is not here: it is in the light per metre and the radiance.
 *     0  albedo, lobes of the phase function
 *     1  first lobe: factor, alpha, peak, slope of nb_phase_lobe
 *     2  second lobe; zeros where there is none
 *
 * A lamp, NB_LAMP_WORDS words; for formulas/lamp.inc:
 *     0  place, square of the radius, which is not 0
 *     1  intensity, how near to its place light does not pass through fog [m]
 *     2  axis and cosine at the edge of its cone; 0, -1 where it has none
 *     3  what nb_lamp_cone calls rise, cosine of the inner angle, 0, 0
 *
 * Folds are what the program does once the leaf is on its stack: a bit for each step, the first one lowest, 1 where
 * both must hold; above them all a 1. a and b: radius of a ball; radius and slope of a cone; length of a capsule;
 * number of faces and first face's word of planes. A face is one word: normal and distance, which are the world's.
 * Faces with a soft edge are scaled: a place is distance - normal . place edges deep.
 *
 * Voxels are texels of four unsigned integers of 32 bits, the same for every eye. A grid:
 *     0  bricks along x, y, z; 1 where voxels are interpolated, so that the box begins in the middle of the first cell
 *     then one for each brick of 8 x 8 x 8 cells, x fastest: least density and its step, as the bits of floats; the
 *     first texel of its cells, 0 where the whole brick has the least density
 * and for each brick that has cells 512 texels, x fastest: what the corners are above the least density, in steps, 16
 * bits each. Components are the corners with y and z at 00, 10, 01, 11; x low in the lower half, high in the upper. */
#ifndef NB_SHADER_LAYOUT_H
#define NB_SHADER_LAYOUT_H

#define NB_HEADER_WORDS 3
#define NB_HEADER_SUN 1
#define NB_HEADER_LAMPS 2 /* its last number */
#define NB_MEDIUM_WORDS 10
#define NB_MEDIUM_LEAF 4
#define NB_MEDIUM_START 5
#define NB_MEDIUM_CUTOFF 6
#define NB_MEDIUM_SCATTERING 7
#define NB_LEAF_WORDS 6
#define NB_SCATTERING_WORDS 3
#define NB_LAMP_WORDS 4

#define NB_KIND_CONSTANT 0
#define NB_KIND_HEIGHT 1        /* grows below the base */
#define NB_KIND_HEIGHT_CAPPED 2 /* 1 below the base */
#define NB_KIND_LINEAR 3
#define NB_KIND_GAUSSIAN 4
#define NB_KIND_SOFT_EDGE 5 /* of a box */
#define NB_KIND_SOFT_ROUND 6
#define NB_KIND_SOFT_PLANES 7
#define NB_KIND_GRID 8
#define NB_KIND_RADIAL 9 /* plus power - 1, 0 to 2 */
#define NB_KIND_EXCLUDE 12

#define NB_SUN_STEPS 0  /* in steps */
#define NB_SUN_FLAT 1   /* in closed form: flat faces, constant densities */
#define NB_SUN_HEIGHT 2 /* the same: one endless height fog */

#define NB_LIGHT_EMITS 1
#define NB_LIGHT_COVERS 2
#define NB_LIGHT_RANK 4

#define NB_TYPE_WORLD 0
#define NB_TYPE_PLANES 1
#define NB_TYPE_BOX 2
#define NB_TYPE_BALL 3
#define NB_TYPE_TUBE 4
#define NB_TYPE_CONE 5
#define NB_TYPE_CAPSULE 6
#define NB_TYPE_TURNED 8

/* What fog may have: the bits of NEBEL_FEATURES. */
#define NB_HAS_PLANES 1
#define NB_HAS_BOX 2
#define NB_HAS_BALL 4
#define NB_HAS_TUBE 8
#define NB_HAS_CONE 16
#define NB_HAS_CAPSULE 32
#define NB_HAS_TURNED 64
#define NB_HAS_GROUP 128  /* a body of several leaves */
#define NB_HAS_COVER 256  /* exclude or replace */
#define NB_HAS_MIXED 512  /* two media of different light, or one of two that shines */
#define NB_HAS_SLOPE 1024 /* height, linear */
#define NB_HAS_GAUSSIAN 2048
#define NB_HAS_SOFT_EDGE 4096
#define NB_HAS_RADIAL 8192
#define NB_HAS_DISTANCES 16384
#define NB_HAS_MAX_OPACITY 32768
#define NB_HAS_SEVERAL 65536 /* more than one medium */
#define NB_HAS_SOFT_ROUND 131072
#define NB_HAS_SOFT_PLANES 262144
#define NB_HAS_SUN 524288 /* which lights fog */
#define NB_HAS_GRID 1048576
#define NB_HAS_LAMPS 2097152 /* as the sun does */
#define NB_HAS_ALL 4194303
#define NB_HAS_SOFT (NB_HAS_SOFT_EDGE | NB_HAS_SOFT_ROUND | NB_HAS_SOFT_PLANES)
#define NB_HAS_PROFILE (NB_HAS_SLOPE | NB_HAS_GAUSSIAN | NB_HAS_SOFT | NB_HAS_RADIAL | NB_HAS_GRID)

#endif
