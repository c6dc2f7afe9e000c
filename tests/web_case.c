/* What check_web.py needs of the library: `web_case text` writes the GLSL ES 3.00 text, `web_case features SCENE...` a line with the
 * feature mask of each scene, and `web_case picture SCENE WIDTH HEIGHT` the packed fog and the rays of a view as JSON. */
#include <nebel/scene.h>
#include <nebel/shader.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    (void)user;
    (void)fprintf(stderr, "web_case: %s\n", message);
}

static void require(nebel_result result)
{
    if (result != NEBEL_OK) exit(1);
}

static nebel_scene *load(const char *path)
{
    const nebel_scene_desc desc = {.host.log = {print_message, NULL}};
    nebel_scene *scene = NULL;
    require(nebel_load_scene(path, &desc, &scene));
    return scene;
}

static void print_features(const char *path)
{
    nebel_scene *scene = load(path);
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    require(nebel_commit_scene_fog(scene, &snapshot));
    require(nebel_create_scene_lighting(scene, snapshot, 0, NULL, &lighting));
    printf("%u %s\n", (unsigned)nebel_pack_features(lighting), path);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_scene(scene);
}

/* ---- pictures -------------------------------------------------------------------------------- */

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count > 0 ? count : 1, size);
    if (memory == NULL) exit(1);
    return memory;
}

static void print_words(const char *name, const nebel_texel_f32 *words, size_t count)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < 4 * count; i++) printf("%s%.9g", i > 0 ? "," : "", (double)words[i / 4].v[i % 4]);
    printf("],\n");
}

/* Packs words into `words`, or counts them where it is NULL. */
typedef nebel_result (*pack_fn)(const nebel_lighting *lighting, const double eye[3], nebel_texel_f32 *words,
                                size_t capacity, size_t *count);

static void print_packed(const char *name, pack_fn pack, const nebel_lighting *lighting, const double eye[3])
{
    size_t count = 0;
    require(pack(lighting, eye, NULL, 0, &count));
    nebel_texel_f32 *words = allocate(count, sizeof *words);
    require(pack(lighting, eye, words, count, &count));
    print_words(name, words, count);
    free(words);
}

static nebel_result pack_nodes(const nebel_lighting *lighting, const double eye[3], nebel_texel_f32 *words,
                               size_t capacity, size_t *count)
{
    (void)eye;
    return nebel_pack_diffusion(lighting, words, capacity, count);
}

static nebel_result pack_environment(const nebel_lighting *lighting, const double eye[3], nebel_texel_f32 *words,
                                     size_t capacity, size_t *count)
{
    (void)eye;
    return nebel_pack_environment(lighting, 0, words, capacity, count);
}

static void print_voxels(const nebel_lighting *lighting)
{
    size_t count = 0;
    require(nebel_pack_voxels(lighting, NULL, 0, &count));
    nebel_texel_u32 *texels = allocate(count, sizeof *texels);
    require(nebel_pack_voxels(lighting, texels, count, &count));
    printf("\"voxels\": [");
    for (size_t i = 0; i < 4 * count; i++) printf("%s%u", i > 0 ? "," : "", (unsigned)texels[i / 4].v[i % 4]);
    printf("],\n");
    free(texels);
}

typedef struct frame {
    double position[3], right[3], up[3], forward[3];
    double reach; /* to where it looks [m] */
    double slope; /* half of the picture's height, at distance 1 */
    unsigned width, height;
} frame;

static void cross(const double a[3], const double b[3], double result[3])
{
    for (int i = 0; i < 3; i++) result[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* Returns the length. */
static double normalize(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++) v[i] /= length;
    return length;
}

static frame frame_of(const nebel_camera *camera, unsigned width, unsigned height)
{
    frame f = {.slope = tan(camera->vertical_fov * (acos(-1) / 360)), .width = width, .height = height};
    for (int i = 0; i < 3; i++) {
        f.position[i] = camera->position[i];
        f.forward[i] = camera->look_at[i] - camera->position[i];
    }
    f.reach = normalize(f.forward);
    cross(f.forward, camera->up, f.right);
    (void)normalize(f.right);
    cross(f.right, f.forward, f.up);
    return f;
}

/* The words of nebel_make_view_ray. The page brings distances along the rays, so that the planes of the projection do not matter. */
static void print_rays(const frame *f)
{
    const double near = .1;
    nebel_view view = {.width = f->width, .height = f->height};
    for (int i = 0; i < 3; i++) {
        view.eye_from_world[4 * i] = f->right[i];
        view.eye_from_world[4 * i + 1] = f->up[i];
        view.eye_from_world[4 * i + 2] = -f->forward[i];
        view.eye_from_world[12] -= f->right[i] * f->position[i];
        view.eye_from_world[13] -= f->up[i] * f->position[i];
        view.eye_from_world[14] += f->forward[i] * f->position[i];
    }
    view.eye_from_world[15] = 1;
    view.clip_from_eye[0] = (double)f->height / f->width / f->slope;
    view.clip_from_eye[5] = 1 / f->slope;
    view.clip_from_eye[10] = view.clip_from_eye[11] = -1;
    view.clip_from_eye[14] = -2 * near;
    const nebel_depth_desc depth = {.encoding = NEBEL_DEPTH_ENCODING_RADIAL};
    nebel_rays rays;
    require(nebel_compute_view_rays(&view, &depth, &rays));
    print_words("rays", rays.texels, NEBEL_RAY_TEXELS);
}

/* Surfaces up to twice as far away as where the camera looks, and none every fifth pixel: 0. The page gets it as a float. */
static double distance_at(const frame *f, unsigned x, unsigned y)
{
    const unsigned step = (7 * x + 13 * y) % 40;
    return step % 5 == 0 ? 0 : (double)(float)(f->reach * step / 20);
}

/* For each pixel, rows from the bottom: a line as `nebel trace` reads it, and the distance on the page. */
static void print_pixels(const frame *f)
{
    printf("\"pixels\": [\n");
    for (unsigned y = 0; y < f->height; y++)
        for (unsigned x = 0; x < f->width; x++) {
            const double side = ((2 * x + 1.) / f->width - 1) * f->slope * f->width / f->height;
            const double rise = ((2 * y + 1.) / f->height - 1) * f->slope, distance = distance_at(f, x, y);
            printf("%s[\"", x + y > 0 ? ",\n" : "");
            for (int i = 0; i < 3; i++) printf("%.17g ", f->position[i]);
            double direction[3];
            for (int i = 0; i < 3; i++) direction[i] = f->forward[i] + side * f->right[i] + rise * f->up[i];
            (void)normalize(direction);
            for (int i = 0; i < 3; i++) printf("%.17g ", direction[i]);
            if (distance > 0) printf("%.17g\", %.17g]", distance, distance);
            if (!(distance > 0)) printf("inf\", 0]");
        }
    printf("]");
}

static void print_picture(const char *path, unsigned width, unsigned height)
{
    nebel_scene *scene = load(path);
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    require(nebel_commit_scene_fog(scene, &snapshot));
    require(nebel_create_scene_lighting(scene, snapshot, 0, NULL, &lighting));
    const frame f = frame_of(&nebel_get_scene_data(scene)->camera, width, height);
    printf("{\"features\": %u, \"width\": %u, \"height\": %u,\n", (unsigned)nebel_pack_features(lighting), width,
           height);
    print_packed("fog", nebel_pack_fog, lighting, f.position);
    print_voxels(lighting);
    print_packed("nodes", pack_nodes, lighting, f.position);
    print_packed("environment", pack_environment, lighting, f.position);
    print_rays(&f);
    print_pixels(&f);
    printf("}\n");
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_scene(scene);
}

int main(int argc, char **argv)
{
    const char *const task = argc > 1 ? argv[1] : "";
    if (strcmp(task, "text") == 0) {
        (void)fputs(nebel_get_shader_source(NEBEL_DIALECT_GLSL_300_ES), stdout);
    } else if (strcmp(task, "features") == 0) {
        for (int i = 2; i < argc; i++) print_features(argv[i]);
    } else if (strcmp(task, "picture") == 0 && argc == 5) {
        print_picture(argv[2], (unsigned)strtoul(argv[3], NULL, 10), (unsigned)strtoul(argv[4], NULL, 10));
    } else {
        return 2;
    }
    return fflush(stdout) == 0 ? 0 : 1;
}
