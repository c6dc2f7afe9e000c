/* A grey picture as terrain: one vertex for each pixel, two triangles for each cell. */
#include "model.h"

static double height_at(const nb_heights *map, const nb_model_source *source, uint32_t x, uint32_t z)
{
    return source->height * map->values[(size_t)z * map->width + x] / map->max;
}

/* The picture's top row is the far edge, -z. */
static void place_grid_vertices(const nb_heights *map, const nb_model_source *source, float *positions)
{
    for (uint32_t z = 0; z < map->height; z++)
        for (uint32_t x = 0; x < map->width; x++) {
            *positions++ = (float)(source->size[0] * ((double)x / (map->width - 1) - .5));
            *positions++ = (float)height_at(map, source, x, z);
            *positions++ = (float)(source->size[1] * ((double)z / (map->height - 1) - .5));
        }
}

/* The slope at i of a row or column of `count` heights `step` metres apart: central differences, one-sided at the
 * edges. */
static double slope(double before, double after, uint32_t i, uint32_t count, double step)
{
    return (after - before) / (i == 0 || i == count - 1 ? step : 2 * step);
}

/* The normal of y = h(x, z) is (-dh/dx, 1, -dh/dz). */
static void place_normals(const nb_heights *map, const nb_model_source *source, float *normals)
{
    const uint32_t width = map->width, depth = map->height;
    const double step_x = source->size[0] / (width - 1), step_z = source->size[1] / (depth - 1);
    for (uint32_t z = 0; z < depth; z++)
        for (uint32_t x = 0; x < width; x++) {
            const uint32_t left = x > 0 ? x - 1 : x, right = x + 1 < width ? x + 1 : x;
            const uint32_t far = z > 0 ? z - 1 : z, near = z + 1 < depth ? z + 1 : z;
            double normal[3] = {
                -slope(height_at(map, source, left, z), height_at(map, source, right, z), x, width, step_x), 1,
                -slope(height_at(map, source, x, far), height_at(map, source, x, near), z, depth, step_z)};
            nb_vector_normalize(normal, 3);
            for (int i = 0; i < 3; i++) *normals++ = (float)normal[i];
        }
}

/* Counter-clockwise seen from above. */
static void place_grid_triangles(const nb_heights *map, uint32_t *indices)
{
    for (uint32_t z = 0; z + 1 < map->height; z++)
        for (uint32_t x = 0; x + 1 < map->width; x++) {
            const uint32_t a = z * map->width + x, b = a + 1, c = a + map->width, d = c + 1;
            const uint32_t cell[6] = {a, c, b, b, c, d};
            for (int i = 0; i < 6; i++) *indices++ = cell[i];
        }
}

static nebel_result build_heightfield(const nb_model_load *load, const nb_heights *map)
{
    const nb_model_source *source = load->source;
    const uint64_t triangle_count = 2 * (uint64_t)(map->width - 1) * (map->height - 1);
    if (triangle_count > NB_MAX_TRIANGLES)
        return nb_model_fail(load, NEBEL_ERROR_LIMIT, "the height map makes %llu triangles; at most %llu",
                             (unsigned long long)triangle_count, (unsigned long long)NB_MAX_TRIANGLES);
    const nebel_result room =
        nb_model_check_room(load, nb_mesh_bytes((uint64_t)map->width * map->height, false, triangle_count));
    if (room != NEBEL_OK) return room;
    nebel_mesh mesh = {.triangle_count = (uint32_t)triangle_count,
                       .texture = -1,
                       .mask = -1,
                       .indices = nb_allocate(&load->allocator, triangle_count, 3 * sizeof(uint32_t))};
    if (mesh.indices == NULL || !nb_mesh_allocate_vertices(&load->allocator, map->width * map->height, false, &mesh)) {
        nb_mesh_release(&load->allocator, &mesh);
        return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    }
    place_grid_vertices(map, source, (float *)mesh.positions);
    place_normals(map, source, (float *)mesh.normals);
    place_grid_triangles(map, (uint32_t *)mesh.indices);
    for (int i = 0; i < 3; i++) {
        mesh.origin[i] = source->position[i];
        mesh.base_color[i] = source->has_color ? (float)source->color[i] : 0.5f;
    }
    return nb_model_add_mesh(load, &mesh);
}

/* The largest file of a height map. */
#define HEIGHT_FILE_LIMIT ((size_t)1 << 31)

static nebel_result read_map(const nb_model_load *load, nb_heights *map)
{
    const char *file = load->source->file;
    nb_note note = {""};
    const nb_codec codec = {
        .allocator = load->allocator, .log = nb_note_log(&note), .name = file, .room = nb_model_room(load)};
    nb_bytes bytes;
    nebel_result result =
        nb_file_read(&load->allocator, &load->log, load->source->where, "height map", file, HEIGHT_FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    if (!nb_png_is(&bytes))
        result = nb_model_fail(load, NEBEL_ERROR_FORMAT, "\"%s\" is not a PNG picture", file);
    else if ((result = nb_png_read_heights(&codec, &bytes, "a height map", map)) != NEBEL_OK)
        nb_model_fail(load, result, "%s", note.text);
    nb_release(&load->allocator, bytes.data);
    return result;
}

nebel_result nb_heightfield_load(const nb_model_load *load)
{
    nb_heights map = {0};
    nebel_result result = read_map(load, &map);
    if (result != NEBEL_OK) return result;
    if (map.width < 2 || map.height < 2)
        result = nb_model_fail(load, NEBEL_ERROR_FORMAT, "\"%s\" has %lu x %lu pixels; a height map needs 2 x 2",
                               load->source->file, (unsigned long)map.width, (unsigned long)map.height);
    else
        result = build_heightfield(load, &map);
    nb_release(&load->allocator, map.values);
    return result;
}
