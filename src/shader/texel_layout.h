/* What the words of packed fog mean. pack_fog.c writes them, medium.glsl and fog.glsl read them: this text is compiled as C,
 * GLSL and HLSL. A word is four floats; integers are kept as floats, exact to 2^24, because a texture may change the
 * bits of small numbers. Lengths are in metres, places relative to the packed eye, distances at most 1e18 in size.
 *
 * Word 0: media, what one step of an integral without a closed form may be off by, the largest opacity, point lights
 * that light
 *         fog.
 * Word 1: the direction towards the sun, of length 1; how what the sun adds is had between turns, NB_SUN_.
 * Word 2: the sun's irradiance; the first word of the point lights. The sun's numbers are 0 where no medium is sunlit.
 * Word 3: the first word of the lattice of diffuse light, and of that of own light, 0 where there is none; what is shorter along a ray
 *         has no digits near the eye [m], a millionth of what the fog is wide, or of a metre; one unused.
 *
 * A medium, NB_MEDIUM_TEXELS words in the snapshot's order:
 *     0  extinction, density kind
 *     1  light per metre at density 1 (radiance times extinction, plus emission), flags and rank: 1 where there is
 *        emission, plus 2 where it covers, plus 4 times its rank, counted from 0: what covers takes away the fog of
 *        every lower rank
 *     2  radiance of opaque fog, leaves; where an environment lights it, albedo instead, and word 1 has emission alone
 *     3  the density's coordinate: gradient and value at the eye; gaussian: the way from its centre to the eye,
 *        1 / (sqrt(2) sigma); soft edge of a box: three unused, 1 / distance; of a round body: gain, steepness and
 *        inner of nb_edge, one unused; of planes: unused; grid: cells per unit of the box along each axis, first texel;
 *        altitude: the way from its centre to the eye, the word of its other numbers: scale height, how far under the
 *        base the density is the same everywhere, what it is there, the eye's height above the base
 *     4  its only leaf; of a body of several: bounds low, first leaf's word; bounds high
 *        The last number of words 5 and 6 is where along a ray it starts to act and where it ends, 1e18 where it does
 *        not [m]; that of word 7 its first scattering word, 0 where it scatters no light of sun or point lights; that
 * of word 8
 *        what part of the light it scatters diffusion takes to go straight on; that of word 9 the first environment word of
 *        its phase function's filter, 0 where no environment lights it.
 *
 *
 * A leaf, NB_LEAF_TEXELS words:
 *     0  leaf type (plus NB_LEAF_TURNED), a, b, folds
 *     1  the eye in the leaf's frame; box: low
 *     2  box: high
 *     3  the matrix, row by row; where the type says that it is turned
 * Scattering, NB_SCATTERING_TEXELS words. Ambient light is not here: it is in the light per metre and the radiance.
 *     0  albedo, lobes of the phase function
 *     1  first lobe: factor, alpha, peak, slope of nb_phase_lobe
 *     2  second lobe; zeros where there is none
 *
 * A point light, NB_LIGHT_TEXELS words; for formulas/point_light.inc:
 *     0  place, square of the radius, which is not 0
 *     1  intensity, how near to its place light does not pass through fog [m]
 *     2  axis and cosine at the edge of its cone; 0, -1 where it has none
 *     3  what nb_light_cone calls rise, cosine of the inner angle, 0, 0
 *
 * A lattice, NB_LATTICE_TEXELS words; behind it another one for what is beside it where NB_LATTICE_BESIDE says so:
 *     0  its low end, the texel of its first node
 *     1  the size of a cell [m], channels: 1 or 3
 *     2  cells along each axis, flags: 1 << (2 axis) where fog goes on beyond the low end, twice that for the high one
 *     3  gains of diffuse light that leaves along x upwards; downwards; along y, along z
 *     9  mean radiance of the sky; where NB_LATTICE_SKY says that fog dims it. The unit of own light, where NB_LATTICE_OWN says that the
 *        lattice is of that and not of the sun and the sky
 *
 * Folds are what the program does once the leaf is on its stack: a bit for each step, the first one lowest, 1 where
 * both must hold; above them all a 1. a and b: of the box of a grid in sunlit fog its first
 * texel of sun lattices, unused; radius of a ball; radius and slope of a cone; length of a capsule;
 * number of faces and first face's word of planes. A face is one word: normal and distance, which are the world's.
 * Faces with a soft edge are scaled: a place is distance - normal . place edges deep.
 *
 * Voxels are texels of four unsigned integers of 32 bits, the same for every eye. A grid:
 *     0  bricks along x, y, z; 1 where voxels are interpolated, so that the box begins in the middle of the first cell
 *     then one for each brick of 8 x 8 x 8 cells, x fastest: least density and its step, as the bits of floats; the
 *     first texel of its cells, 0 where the whole brick has the least density
 * and for each brick that has cells 512 texels, x fastest: what the corners are above the least density, in steps, 16
 * bits each. Components are the corners with y and z at 00, 10, 01, 11; x low in the lower half, high in the upper.
 *
 * Behind all grids, where the sun lights fog, come lattices of what lies between places in voxels and the sun
 * (src/light/sun_lattice.h says where its nodes are), NB_SUN_LATTICE_TEXELS texels and the cells between eight nodes:
 *     0  cells along both sides and layers; the axis across layers
 *     1  lean of both sides, first of both sides, as the bits of floats
 *     2  the same of columns per cell and of a step; 1 where there is fog at the faces of the box;
 *        layers per cell, as the bits of a float
 *     3  the faces towards the sun, in cells along both sides and the axis; 1 where the sun is where layers have larger
 *        numbers, else -1; as the bits of floats
 * and the cells, columns of the first side fastest: eight integrals of the density, in steps, as the corners above; all bits 1
 * where what lies between the nodes is to be walked through.
 *
 * Nodes of lattices are texels of four floats, the same for every eye: of each node, x fastest, two for each channel,
 * source radiance and flux of diffuse light; NB_NODE_TURNED, _ONCE, _GLOW and _WIDTH of diffusion/diffusion.h; then one that
 * holds g of what is turned. Where NB_LATTICE_SKY is set two more for each channel: NB_NODE_DIMMED and NB_NODE_ABSORBED; where NB_LATTICE_OWN is,
 * three: NB_NODE_OWN_TURNED, _ONCE and _GLOW.
 *
 * Environment words are vectors of floats, the same for every eye:
 *     0  NB_ENVIRONMENT_; of a map cosine and sine of its rotation, intensity
 *     1  radiance of a constant one; a gradient's zenith; of a map the first words of what white surfaces reflect, and of its
 *        pixels, 0 where they were not asked for
 *     2  a gradient's horizon
 *     3  a gradient's ground
 * then a filter for each phase function that scatters it, and for a map, where they were asked for, the same for surfaces, and
 * its pixels behind one word with its width and height. A filter of a gradient, see sky.c:
 *     0  mean cosine of the phase function, 1 / width of the nodes, number of the last / log(1 + 1 / width)
 * then for each of the NB_FILTER_PIECES four nodes from its number on A filter of a map, B-splines over longitude and
 * latitude, see environment_map.c:
 *     0  columns, rows
 *     then the coefficients, the top row first.
 *
 * Air words are vectors of floats, of one place, see atmosphere/sky_view.h:
 *     0  nb_elevation_map: radius, ground, thickness, height
 *     1  dip, ratio, horizon, half_arc
 *     2  up; 3 level towards the sun; 4 level aside, of length 1
 *     5  the direction towards the sun, of length 1
 *     6  its irradiance above the air
 *     7  columns, levels beside the one at the start, kinds of air that scatter
 *     8  the first words of entries; of extinction; of what air leaves of the sun on the ground; of what it scatters there
 *     9  of those: 1 / scale, first, entries per step, number
 *     10 two lobes of each kind's phase function, as above
 * then the entries, levels fastest, columns, rows: what each kind scattered once, what all scattered more often, 1/m; the
 * extinction, levels fastest, rows, 1/m; sunlight on the ground, for a sun of irradiance 1; the logarithm of the sky's. */
#ifndef NB_SHADER_TEXEL_LAYOUT_H
#define NB_SHADER_TEXEL_LAYOUT_H

#define NB_HEADER_TEXELS 4
#define NB_HEADER_SUN 1
#define NB_HEADER_LIGHTS 2 /* its last number */
#define NB_HEADER_LATTICE 3
#define NB_MEDIUM_TEXELS 10
#define NB_MEDIUM_LEAF 4
#define NB_MEDIUM_START 5
#define NB_MEDIUM_CUTOFF 6
#define NB_MEDIUM_SCATTERING 7
#define NB_MEDIUM_AHEAD 8
#define NB_MEDIUM_FILTER 9
#define NB_LEAF_TEXELS 6
#define NB_SCATTERING_TEXELS 3
#define NB_LIGHT_TEXELS 4
#define NB_LATTICE_TEXELS 10
#define NB_SUN_LATTICE_TEXELS 4

#define NB_LATTICE_BESIDE 64
#define NB_LATTICE_SKY 128
#define NB_LATTICE_OWN 256

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
#define NB_KIND_ALTITUDE 13

#define NB_SUN_STEPS 0  /* in steps */
#define NB_SUN_FLAT 1   /* in closed form: flat faces, constant densities */
#define NB_SUN_HEIGHT 2 /* the same: one endless height fog */

#define NB_ENVIRONMENT_TEXELS 4
#define NB_ENVIRONMENT_CONSTANT 0
#define NB_ENVIRONMENT_GRADIENT 1
#define NB_ENVIRONMENT_MAP 2
#define NB_FILTER_PIECES 126

#define NB_AIR_ELEVATION_MAP 0
#define NB_AIR_AXES 2
#define NB_AIR_SUN 5
#define NB_AIR_IRRADIANCE 6
#define NB_AIR_SIZES 7
#define NB_AIR_PARTS 8
#define NB_AIR_SKIES 9
#define NB_AIR_LOBES 10
#define NB_AIR_TEXELS 18
#define NB_AIR_FALLING 60.0
#define NB_AIR_RISING 64.0
#define NB_AIR_SUNS 257.0

#define NB_LIGHT_EMITS 1
#define NB_LIGHT_COVERS 2
#define NB_LIGHT_RANK 4

#define NB_TYPE_WORLD 0
#define NB_TYPE_PLANES 1
#define NB_TYPE_BOX 2
#define NB_TYPE_SPHERE 3
#define NB_TYPE_CYLINDER 4
#define NB_TYPE_CONE 5
#define NB_TYPE_CAPSULE 6
#define NB_TYPE_ROTATED 8

/* What fog may have: the bits of NEBEL_FEATURES. */
#define NB_HAS_PLANES 1
#define NB_HAS_BOX 2
#define NB_HAS_SPHERE 4
#define NB_HAS_CYLINDER 8
#define NB_HAS_CONE 16
#define NB_HAS_CAPSULE 32
#define NB_HAS_ROTATED 64
#define NB_HAS_GROUP 128    /* a body of several leaves */
#define NB_HAS_OVERRIDE 256 /* exclude or replace */
#define NB_HAS_MIXED 512    /* two media of different light, or one of two that shines */
#define NB_HAS_SLOPE 1024   /* height, linear */
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
#define NB_HAS_LIGHTS 2097152      /* as the sun does */
#define NB_HAS_DIFFUSION 4194304   /* light scattered more than once */
#define NB_HAS_ENVIRONMENT 8388608 /* which lights fog */
#define NB_HAS_ALTITUDE 16777216
#define NB_HAS_ALL 33554431
#define NB_HAS_SOFT (NB_HAS_SOFT_EDGE | NB_HAS_SOFT_ROUND | NB_HAS_SOFT_PLANES)
#define NB_HAS_PROFILE (NB_HAS_SLOPE | NB_HAS_GAUSSIAN | NB_HAS_SOFT | NB_HAS_RADIAL | NB_HAS_GRID | NB_HAS_ALTITUDE)

#endif
