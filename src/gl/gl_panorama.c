#include "gl_panorama.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* ---- texts ----------------------------------------------------------------------------------- */

/* Sine and cosine of the drivers may be off by a thousandth; these, of an eighth of a turn at most either way, are off
 * by a float's last digit (Taylor). */
const char nb_panorama_ray_text[] =
    "vec2 ray_turn(float quarters)\n" /* cosine, sine */
    "{\n"
    "    float nearest = floor(quarters + 0.5), a = (quarters - nearest) * 1.5707963267949, b = a * a;\n"
    "    float s = a - a * b * (1.0 / 6.0 - b * (1.0 / 120.0 - b * (1.0 / 5040.0 - b * (1.0 / 362880.0))));\n"
    "    float c = 1.0 - b * (0.5 - b * (1.0 / 24.0 - b * (1.0 / 720.0 - b * (1.0 / 40320.0))));\n"
    "    int turn = int(nearest) & 3;\n"
    "    vec2 at = (turn & 1) != 0 ? vec2(-s, c) : vec2(c, s);\n"
    "    return (turn & 2) != 0 ? -at : at;\n"
    "}\n"
    "vec3 ray_origin(vec2 pixel) { return vec3(0.0); }\n"
    "vec3 ray_direction(vec2 pixel)\n"
    "{\n"
    "    vec2 at = RAY_WORD(0).xy + pixel * RAY_WORD(1).xy;\n"
    "    vec2 around = ray_turn(at.x), above = ray_turn(at.y);\n"
    "    return normalize(above.x * (around.x * RAY_WORD(3) + around.y * RAY_WORD(4)) + above.y * RAY_WORD(5));\n"
    "}\n";

/* Boxes are low x, low y, high x, high y. The hull of three directions is bounded by the great circle that goes through
 * the greatest latitude at both ends of its longitudes: nothing of it is above that. Around a pole longitudes say
 * nothing, and the cone around all three counts. Sine, cosine and arcus tangens may be off by a thousandth of a
 * quarter, which is added; what a box has too much costs time alone. A box that reaches over an end of the picture is
 * drawn twice. */
const char nb_panorama_box_text[] =
    "const float box_margin = 0.002;\n"
    "const float box_quarter = 1.5707963267949;\n"
    "vec4 box_around()\n"
    "{\n"
    "    return vec4(RAY_WORD(0).x, -1.0, RAY_WORD(0).x + 4.0, 1.0);\n"
    "}\n"
    "vec2 box_place(vec3 way)\n"
    "{\n"
    "    vec3 seen = vec3(dot(way, RAY_WORD(3)), dot(way, RAY_WORD(4)), dot(way, RAY_WORD(5)));\n"
    "    return vec2(atan(seen.y, seen.x), atan(seen.z, length(seen.xy))) / box_quarter;\n"
    "}\n"
    "vec4 box_of_cone(vec3 way, float radius)\n" /* unit, quarters */
    "{\n"
    "    vec2 at = box_place(way);\n"
    "    radius += box_margin;\n"
    "    vec4 box = vec4(RAY_WORD(0).x, at.y - radius, RAY_WORD(0).x + 4.0, at.y + radius);\n"
    "    if (!(abs(at.y) + radius < 0.99)) return box;\n"
    "    float s = sin(box_quarter * radius), c = cos(box_quarter * at.y);\n"
    "    float side = atan(s, sqrt(max(c * c - s * s, 1e-6))) / box_quarter + box_margin;\n"
    "    return vec4(at.x - side, box.y, at.x + side, box.w);\n"
    "}\n"
    "float box_turn(float from, float to)\n"
    "{\n"
    "    float turn = to - from;\n"
    "    return turn > 2.0 ? turn - 4.0 : turn < -2.0 ? turn + 4.0 : turn;\n"
    "}\n"
    "float box_bulge(float latitude, float half_turn)\n"
    "{\n"
    "    return atan(tan(box_quarter * latitude), cos(box_quarter * half_turn)) / box_quarter;\n"
    "}\n"
    "vec4 box_of_three(vec3 a, vec3 b, vec3 c)\n"
    "{\n"
    "    float shortest = min(dot(a, a), min(dot(b, b), dot(c, c)));\n"
    "    vec2 at[3] = vec2[3](box_place(a), box_place(b), box_place(c));\n"
    "    float left = box_turn(at[0].x, at[1].x), right = left + box_turn(at[1].x, at[2].x);\n"
    "    float low = min(at[0].y, min(at[1].y, at[2].y)), high = max(at[0].y, max(at[1].y, at[2].y));\n"
    "    float first = min(0.0, min(left, right)), last = max(0.0, max(left, right));\n"
    "    bool plain = max(-low, high) < 0.99 && last - first < 1.8 && abs(right - box_turn(at[0].x, at[2].x)) < 1.0;\n"
    "    if (shortest > 1e-30 && plain) {\n"
    "        float half_turn = 0.5 * (last - first);\n"
    "        high = high > 0.0 ? box_bulge(high, half_turn) : high;\n"
    "        low = low < 0.0 ? box_bulge(low, half_turn) : low;\n"
    "        return vec4(at[0].x + first, low, at[0].x + last, high) + box_margin * vec4(-1.0, -1.0, 1.0, 1.0);\n"
    "    }\n"
    "    vec3 x = normalize(a), y = normalize(b), z = normalize(c), middle = x + y + z;\n"
    "    if (!(shortest > 1e-30 && dot(middle, middle) > 0.25)) return box_around();\n"
    "    middle = normalize(middle);\n"
    "    float least = min(dot(middle, x), min(dot(middle, y), dot(middle, z)));\n"
    "    float most = max(length(middle - x), max(length(middle - y), length(middle - z)));\n"
    "    return least > 0.1 ? box_of_cone(middle, 2.0 * asin(min(0.5 * most, 1.0)) / box_quarter) : box_around();\n"
    "}\n"
    "vec4 box_corner(vec4 box, int vertex)\n"
    "{\n"
    "    bool again = vertex > 4;\n"
    "    int corner = again ? max(vertex - 6, 0) : min(vertex, 3);\n"
    "    float begin = RAY_WORD(0).x, shift = box.x < begin ? 4.0 : box.z > begin + 4.0 ? -4.0 : 0.0;\n"
    "    vec2 at = vec2((corner & 1) != 0 ? box.z : box.x, (corner & 2) != 0 ? box.w : box.y);\n"
    "    at.x += again ? shift : 0.0;\n"
    "    bool nothing = again && shift == 0.0;\n"
    "    return nothing ? vec4(2.0, 2.0, 0.0, 1.0) : vec4(0.5 * (at.x - begin) - 1.0, at.y - RAY_WORD(0).y - 1.0, 0.0, "
    "1.0);\n"
    "}\n";

/* The lists of the faces follow each other. */
const char nb_panorama_tile_text[] =
    "uniform ivec3 face_tiling;\n" /* pixels of a face, logarithm of a tile's size, tiles in a row */
    "uniform int face_first[6];\n"
    "int face_entry(vec3 way)\n"
    "{\n"
    "    vec3 size = abs(way);\n"
    "    int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;\n"
    "    vec3 seen = axis == 0 ? way.yzx : axis == 1 ? way.zxy : way;\n"
    "    vec2 at = vec2(seen.z > 0.0 ? -seen.x : seen.x, seen.y) / abs(seen.z);\n"
    "    ivec2 pixel = ivec2((at * 0.5 + 0.5) * float(face_tiling.x));\n"
    "    ivec2 tile = clamp(pixel, ivec2(0), ivec2(face_tiling.x - 1)) >> face_tiling.y;\n"
    "    return face_first[2 * axis + (seen.z > 0.0 ? 0 : 1)] + 2 * (tile.x + tile.y * face_tiling.z);\n"
    "}\n";

/* ---- numbers --------------------------------------------------------------------------------- */

void nb_panorama_rays(const nebel_view *view, const double eye[3], nb_pixel_position point, nebel_rays *rays)
{
    const double *const axes = view->eye_from_world;
    const double step[2] = {4. / view->width, 2. / view->height};
    *rays = (nebel_rays){.eye = {eye[0], eye[1], eye[2]}, .from_eye = 1};
    rays->texels[0].v[0] = (float)(-2 + (point.x - .5) * step[0]);
    rays->texels[0].v[1] = (float)(-1 + (.5 - point.y) * step[1]);
    for (int i = 0; i < 2; i++) rays->texels[1].v[i] = (float)step[i];
    for (int i = 0; i < 3; i++) {
        rays->texels[3].v[i] = (float)-axes[4 * i + 2];
        rays->texels[4].v[i] = (float)axes[4 * i];
        rays->texels[5].v[i] = (float)axes[4 * i + 1];
    }
}

void nb_panorama_direction(const nebel_rays *rays, double x, double y, double direction[3])
{
    const nebel_texel_f32 *const w = rays->texels;
    const double longitude = .5 * PI * ((double)w[0].v[0] + x * (double)w[1].v[0]);
    const double latitude = .5 * PI * ((double)w[0].v[1] + y * (double)w[1].v[1]);
    const double along = cos(latitude) * cos(longitude), across = cos(latitude) * sin(longitude);
    for (int i = 0; i < 3; i++) {
        direction[i] = along * (double)w[3].v[i] + across * (double)w[4].v[i] + sin(latitude) * (double)w[5].v[i];
    }
}

void nb_panorama_look(const nebel_view *view, double x, double y, double direction[3])
{
    const double *const axes = view->eye_from_world;
    const double longitude = PI * (2 * x / view->width - 1), latitude = PI * (y / view->height - .5);
    const double along = cos(latitude) * cos(longitude), across = cos(latitude) * sin(longitude);
    for (int i = 0; i < 3; i++)
        direction[i] = -along * axes[4 * i + 2] + across * axes[4 * i] + sin(latitude) * axes[4 * i + 1];
}

static nebel_view face_of(const double eye[3], int axis, double sign, uint32_t size)
{
    nebel_view face = {.width = size, .height = size};
    double *const m = face.eye_from_world;
    m[4 * ((axis + 1) % 3)] = -sign;
    m[4 * ((axis + 2) % 3) + 1] = 1;
    m[4 * axis + 2] = -sign;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) m[12 + i] -= m[4 * k + i] * eye[k];
    }
    m[15] = 1;
    face.clip_from_eye[0] = face.clip_from_eye[5] = 1;
    face.clip_from_eye[10] = face.clip_from_eye[11] = -1;
    face.clip_from_eye[14] = -1e-6;
    return face;
}

/* A pixel in the middle of a face is two of its width wide. */
void nb_panorama_faces(const double eye[3], uint32_t width, uint32_t height, nebel_view faces[6])
{
    const double pixels = fmax(width / PI, 2 * height / PI);
    const uint32_t size = pixels < 65535 ? (uint32_t)pixels + 1 : 65536;
    for (int i = 0; i < 6; i++) faces[i] = face_of(eye, i / 2, i % 2 == 0 ? 1 : -1, size);
}
