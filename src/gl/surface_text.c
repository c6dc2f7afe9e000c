#include "surface_text.h"

/* The volume that a ray spans with an edge, and what rounding may make of it. */
const char nb_surface_edge_text[] =
    "vec2 edge_volume(vec3 direction, vec3 a, vec3 b)\n"
    "{\n"
    "    vec3 from = dot(a, a) < dot(b, b) ? a : b;\n"
    "    return vec2(dot(b - a, cross(direction, from)), 2e-7 * length(b - a) * length(from));\n"
    "}\n";

/* Rasterizers move corners by parts of a pixel, so that a ray may pass its triangle by. Beyond a crest the plane of the triangle
 * that faces away is nearer than that of the crest itself. So the distance is that of the place as far within the triangle,
 * and what faces away is seen where there is nothing else: surface_rank is the factor of depth. */
const char nb_surface_inset_text[] =
    "float surface_rank = 1.0;\n"
    "float surface_inset(vec3 origin, vec3 direction, float t)\n"
    "{\n"
    "    vec3 c = surface_corner - origin, a = c + surface_edge_a, b = c + surface_edge_b;\n"
    "    vec2 by_a = edge_volume(direction, b, c), by_b = edge_volume(direction, c, a);\n"
    "    vec2 by_c = edge_volume(direction, a, b);\n"
    "    float whole = by_a.x + by_b.x + by_c.x, side = whole < 0.0 ? -1.0 : 1.0;\n"
    "    vec3 weights = side * vec3(by_a.x, by_b.x, by_c.x);\n"
    "    if (whole == 0.0 || all(greaterThanEqual(weights, -vec3(by_a.y, by_b.y, by_c.y)))) return t;\n"
    "    if (dot(surface_face, direction) > 0.0) surface_rank = 1e-6;\n"
    "    weights = abs(weights);\n"
    "    return dot(direction, a * weights.x + b * weights.y + c * weights.z) / (weights.x + weights.y + weights.z);\n"
    "}\n";

const char nb_surface_distance_text[] =
    "float surface_distance(vec3 origin, vec3 direction)\n"
    "{\n"
    "    float cosine = dot(surface_face, direction);\n"
    "    float met = dot(surface_face, surface_corner - origin) / cosine;\n"
    "    float near = dot(surface_place - origin, direction);\n"
    "    float slack = abs(near) * min(0.5, 0.01 + abs(near) * 1e-5) ;\n"
    "    slack += length(surface_corner - origin) * (1e-4 + 1e-6 / max(abs(cosine), 1e-6));\n"
    "    return met > near - slack && met < near + slack ? met : near;\n"
    "}\n";
