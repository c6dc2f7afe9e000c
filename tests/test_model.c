/* Models and height fields. Those of Debian's assimp-testmodels are looked at where they are installed. */
#define _GNU_SOURCE
#include "model_help.h"

#include <math.h>
#include <sys/stat.h>
#include <unistd.h>
#include <png.h>

#define MODELS "/usr/share/assimp/models/"

static void assert_near(const float *got, double x, double y, double z)
{
    const double wanted[3] = {x, y, z};
    for (int i = 0; i < 3; i++)
        if (!(fabs((double)got[i] - wanted[i]) < 1e-5))
            fail_msg("(%g, %g, %g) should be (%g, %g, %g)", (double)got[0], (double)got[1], (double)got[2], x, y, z);
}

/* Every mesh is what the header promises; the number of triangles in all. */
static size_t check_meshes(const nebel_scene *scene)
{
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    size_t count = 0;
    for (size_t m = 0; m < data->mesh_count; m++) {
        const nebel_mesh *mesh = &data->meshes[m];
        count += mesh->triangle_count;
        for (size_t i = 0; i < 3 * (size_t)mesh->triangle_count; i++) {
            assert_true(mesh->indices[i] < mesh->vertex_count);
            const float *n = mesh->normals + 3 * (size_t)mesh->indices[i],
                        *p = mesh->positions + 3 * (size_t)mesh->indices[i];
            assert_true(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]));
            assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-4f);
        }
        assert_true(mesh->texture >= -1 && mesh->texture < (int32_t)data->texture_count);
        assert_true((mesh->texture < 0 && mesh->mask < 0) == (mesh->uvs == NULL));
        assert_true((mesh->mask < 0) == (mesh->alpha_cutoff == 0));
        for (int i = 0; i < 3; i++) assert_true(mesh->base_color[i] >= 0 && mesh->base_color[i] <= 1);
    }
    return count;
}

/* The normal that the order of a triangle's corners gives. */
static void face_normal(const nebel_mesh *mesh, size_t triangle, double normal[3])
{
    const float *p[3];
    for (int k = 0; k < 3; k++) p[k] = mesh->positions + 3 * (size_t)mesh->indices[3 * triangle + (size_t)k];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        normal[i] = (double)((p[1][j] - p[0][j]) * (p[2][k] - p[0][k]) - (p[1][k] - p[0][k]) * (p[2][j] - p[0][j]));
    }
}

static const char triangle_obj[] = "mtllib t.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";

/* ---- places ---------------------------------------------------------------------------------- */

static void test_scale_comes_first_then_rotation_then_position(void **state)
{
    (void)state;
    write_text("t.obj", triangle_obj);
    write_text("t.mtl", "newmtl red\nKd 0.5 0.25 0.125\n");
    nebel_scene *scene =
        load_good("\"file\": \"t.obj\", \"position\": [10, 20, 30], \"rotation\": [0, 0, 1, 1], \"scale\": [2, 3, 4]");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(check_meshes(scene), 1);
    assert_true(mesh->origin[0] == 10 && mesh->origin[1] == 20 && mesh->origin[2] == 30);
    assert_near(mesh->positions + 3 * (size_t)mesh->indices[1], 0, 2, 0);
    assert_near(mesh->positions + 3 * (size_t)mesh->indices[2], -6, 0, 0);
    assert_near(mesh->normals, 0, 0, 1);
    assert_near(mesh->base_color, .5, .25, .125);
    nebel_destroy_scene(scene);
}

static void test_a_mirrored_model_is_not_inside_out(void **state)
{
    (void)state;
    write_text("t.obj", triangle_obj);
    const char *const scales[] = {"[1, 1, 1]", "[-1, 1, 1]", "[1, -2, 3]", "[1, 1, -1]", "[-1, -1, -1]", "[-1, -1, 1]"};
    for (int i = 0; i < 6; i++) {
        char members[200];
        double normal[3];
        snprintf(members, sizeof members, "\"file\": \"t.obj\", \"scale\": %s, \"rotation\": [0.1, 0.2, 0.3, 1]",
                 scales[i]);
        nebel_scene *scene = load_good(members);
        const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
        face_normal(mesh, 0, normal);
        const float *n = mesh->normals + 3 * (size_t)mesh->indices[0];
        assert_true(normal[0] * (double)n[0] + normal[1] * (double)n[1] + normal[2] * (double)n[2] > 0);
        nebel_destroy_scene(scene);
    }
}

static void test_a_model_far_away_stays_precise(void **state)
{
    (void)state;
    write_text("t.obj", triangle_obj);
    nebel_scene *scene = load_good("\"file\": \"t.obj\", \"position\": [1e7, 0, -1e9], \"scale\": 0.001");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_true(mesh->origin[2] == -1e9);
    assert_near(mesh->positions + 3 * (size_t)mesh->indices[1], .001, 0, 0);
    nebel_destroy_scene(scene);
}

static void test_loading_twice_changes_nothing(void **state)
{
    (void)state;
    write_text("t.obj", triangle_obj);
    nebel_scene *scene = load_good("\"file\": \"t.obj\", \"color\": [1, 0.5, 0]");
    const nebel_mesh *meshes = nebel_get_scene_data(scene)->meshes;
    assert_near(meshes->base_color, 1, .5, 0);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK);
    assert_ptr_equal(nebel_get_scene_data(scene)->meshes, meshes);
    nebel_destroy_scene(scene);
}

/* ---- broken models --------------------------------------------------------------------------- */

static void test_broken_models_are_named_with_the_reason(void **state)
{
    (void)state;
    write_text("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\nl 1 2\n");
    write_text("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    assert_broken("\"file\": \"none.obj\"", NEBEL_ERROR_FILE, "No such file or directory");
    assert_broken("\"file\": \"/dev/zero\"", NEBEL_ERROR_FILE, "cannot read the model");
    assert_broken("\"file\": \".\"", NEBEL_ERROR_FILE, "Is a directory");
    assert_broken("\"file\": \"points.obj\"", NEBEL_ERROR_FORMAT, "holds no triangle");
    assert_broken("\"file\": \"bad.obj\"", NEBEL_ERROR_FORMAT, "bad.obj\" ");
}

static void test_files_that_are_no_models_are_told_what_they_are(void **state)
{
    (void)state;
    write_text("empty.obj", "");
    write_text("empty.glb", "");
    write_text("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
    write_text("text.glb", "hello");
    write_text("no.format", "hello");
    assert_broken("\"file\": \"empty.obj\"", NEBEL_ERROR_FORMAT, "empty.obj\" is empty; copy or export it again");
    assert_broken("\"file\": \"empty.glb\"", NEBEL_ERROR_FORMAT, "empty.glb\" is empty; copy or export it again");
    assert_broken("\"file\": \"cut.ply\"", NEBEL_ERROR_FORMAT, "begins like PLY, but its header does not end");
    assert_broken("\"file\": \"text.glb\"", NEBEL_ERROR_FORMAT, "text.glb\" is called .glb, but is no binary glTF");
    write_text("text.gltf", "hello");
    assert_broken("\"file\": \"text.gltf\"", NEBEL_ERROR_FORMAT,
                  "text.gltf\" cannot be read: its content is not what .gltf in its name promises");
    assert_broken("\"file\": \"/dev/null\"", NEBEL_ERROR_FILE, "it is a device, a pipe or a socket; name a file");
    assert_broken("\"file\": \"no.format\"", NEBEL_ERROR_FORMAT,
                  "no.format\" cannot be read: neither its name nor its content tells a known format; names may end in "
                  ".glb, .gltf, .obj, .ply");
}

/* The first `size` bytes of a binary glTF that says it is 300 bytes long. */
static void write_glb(const char *name, unsigned char version, size_t size)
{
    const unsigned char header[12] = {'g', 'l', 'T', 'F', version, 0, 0, 0, 300 % 256, 300 / 256, 0, 0};
    unsigned char bytes[300] = {0};
    memcpy(bytes, header, sizeof header);
    FILE *file = fopen(in_folder(name), "wb");
    fwrite(bytes, 1, size, file);
    fclose(file);
}

static void test_binary_gltf_that_is_cut_short_is_told_how_much_is_missing(void **state)
{
    (void)state;
    write_glb("cut.glb", 2, 11);
    assert_broken("\"file\": \"cut.glb\"", NEBEL_ERROR_FORMAT, "ends after 11 bytes, inside its header");
    write_glb("cut.glb", 2, 12);
    assert_broken("\"file\": \"cut.glb\"", NEBEL_ERROR_FORMAT, "announces 300 bytes, 288 are missing; copy or export");
    write_glb("cut.glb", 2, 299);
    assert_broken("\"file\": \"cut.glb\"", NEBEL_ERROR_FORMAT, "announces 300 bytes, 1 are missing; copy or export");
    write_glb("cut.glb", 2, 300);
    assert_broken("\"file\": \"cut.glb\"", NEBEL_ERROR_FORMAT, "cut.glb\" cannot be read: ");
    write_glb("cut.glb", 9, 300);
    assert_broken("\"file\": \"cut.glb\"", NEBEL_ERROR_FORMAT, "of version 9; versions 1 and 2 are read");
    write_glb("glb.obj", 2, 300);
    assert_broken("\"file\": \"glb.obj\"", NEBEL_ERROR_FORMAT, "is binary glTF; give it a name that ends in .glb");
}

static void test_corners_that_are_no_numbers_are_left_out(void **state)
{
    (void)state;
    journal kept;
    nebel_result result;
    const float corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, NAN, 1, 1};
    const unsigned char faces[2][13] = {{3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0},
                                        {3, 1, 0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0}};
    FILE *file = fopen(in_folder("nan.ply"), "wb");
    fputs(
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n",
        file);
    fwrite(corners, sizeof corners, 1, file);
    fwrite(faces, sizeof faces, 1, file);
    fclose(file);
    nebel_scene *scene = load("\"file\": \"nan.ply\"", &result, &kept);
    assert_int_equal(result, NEBEL_OK);
    assert_int_equal(kept.result, NEBEL_OK);
    assert_non_null(strstr(kept.last, "1 triangles of"));
    assert_int_equal(check_meshes(scene), 1);
    nebel_destroy_scene(scene);
    /* Or are beyond the floats in their place. */
    write_text("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1e30 0 0\nf 1 2 3\nf 2 4 3\n");
    scene = load("\"file\": \"far.obj\", \"scale\": 1e9", &result, &kept);
    assert_int_equal(result, NEBEL_OK);
    assert_non_null(strstr(kept.last, "1 triangles of"));
    assert_int_equal(check_meshes(scene), 1);
    nebel_destroy_scene(scene);
}

static void test_every_truncated_model_is_survived(void **state)
{
    (void)state;
    static const char ply[] =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    for (size_t cut = 0; cut < sizeof ply; cut++) {
        char text[sizeof ply];
        journal kept;
        nebel_result result;
        memcpy(text, ply, sizeof ply);
        text[cut] = '\0';
        write_text("cut.ply", text);
        nebel_scene *scene = load("\"file\": \"cut.ply\"", &result, &kept);
        if (result == NEBEL_OK)
            check_meshes(scene);
        else
            assert_true(kept.last[0] != '\0');
        nebel_destroy_scene(scene);
    }
}

/* ---- textures that are not where they are said to be ------------------------------------------ */

/* A model in the folder sub whose material names this picture; its last message in *kept. */
static size_t count_textures(const char *before, const char *picture, journal *kept)
{
    char text[300];
    nebel_result result;
    snprintf(text, sizeof text, "newmtl red\nmap_Kd %s%s\n", before, picture);
    write_text("sub/t.mtl", text);
    nebel_scene *scene = load("\"file\": \"sub/t.obj\"", &result, kept);
    if (result != NEBEL_OK) fail_msg("%s", kept->last);
    const size_t count = nebel_get_scene_data(scene)->texture_count;
    nebel_destroy_scene(scene);
    return count;
}

static void test_textures_are_looked_for_beside_the_model(void **state)
{
    (void)state;
    journal kept;
    png_image color = {.version = PNG_IMAGE_VERSION, .width = 2, .height = 2, .format = PNG_FORMAT_RGB};
    const unsigned char pixels[12] = {0};
    mkdir(in_folder("sub"), 0700);
    assert_true(png_image_write_to_file(&color, in_folder("sub/color.png"), 0, pixels, 0, NULL));
    write_text("sub/t.obj", "mtllib t.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 2 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    assert_int_equal(count_textures(in_folder("sub/"), "color.png", &kept), 1);
    assert_int_equal(count_textures("/home/author/", "color.png", &kept), 1);
    assert_int_equal(kept.count, 0);
    assert_int_equal(count_textures("../", "none.png", &kept), 0);
    assert_non_null(strstr(kept.last, "the texture \"../none.png\" is outside the folder"));
    mkdir(in_folder("sub/pictures"), 0700);
    assert_int_equal(count_textures("", "pictures", &kept), 0);
    assert_non_null(strstr(kept.last, "sub/pictures\": Is a directory"));
    assert_int_equal(count_textures("", "t.obj", &kept), 0);
    assert_non_null(strstr(kept.last, "sub/t.obj: neither a PNG nor a JPEG picture"));
}

/* ---- normals of models that have none -------------------------------------------------------- */

static const char cube_ply[] =
    "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n"
    "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";

static void test_a_cube_with_shared_corners_keeps_its_edges(void **state)
{
    (void)state;
    write_text("cube.ply", cube_ply);
    nebel_scene *scene = load_good("\"file\": \"cube.ply\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(check_meshes(scene), 12);
    assert_int_equal(mesh->vertex_count, 24);
    for (size_t i = 0; i < 36; i++) {
        double normal[3];
        face_normal(mesh, i / 3, normal);
        assert_near(mesh->normals + 3 * (size_t)mesh->indices[i], normal[0], normal[1], normal[2]);
    }
    nebel_destroy_scene(scene);
}

/* Normals that are none become those of the triangles; what has no area gets one that points up. */
static void test_normals_that_are_no_directions_are_mended(void **state)
{
    (void)state;
    write_text("t.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 5 0 0\nv 6 0 0\nv 5 0 3\nv 7 0 0\nv 8 0 0\nv 9 0 0\n"
                        "vn 0 0 0\nvn nan 0 0\nf 1//1 2//1 3//1\nf 4//2 5//2 6//2\nf 7//1 8//1 9//1\n");
    nebel_scene *scene = load_good("\"file\": \"t.obj\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(check_meshes(scene), 3);
    for (size_t i = 0; i < 9; i++) {
        const double x = (double)mesh->positions[3 * (size_t)mesh->indices[i]];
        assert_near(mesh->normals + 3 * (size_t)mesh->indices[i], 0, x < 2 ? 0 : x < 7 ? -1 : 1, x < 2 ? 1 : 0);
    }
    nebel_destroy_scene(scene);
}

/* Two triangles that share the edge from 0 to z = 1; the second turns away from the first by `angle` degrees. */
static void write_folded_ply(double angle)
{
    char text[500];
    const double radians = angle * acos(-1) / 180;
    snprintf(text, sizeof text,
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
             "0 0 0\n0 0 1\n-1 0 0\n%.9g %.9g 0\n3 0 2 1\n3 0 1 3\n",
             cos(radians), -sin(radians));
    write_text("fold.ply", text);
}

static void test_a_fold_is_sharp_from_sixty_degrees_on(void **state)
{
    (void)state;
    write_folded_ply(59);
    nebel_scene *scene = load_good("\"file\": \"fold.ply\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    const double half = 29.5 * acos(-1) / 180, whole = 61 * acos(-1) / 180;
    assert_int_equal(mesh->vertex_count, 4);
    for (size_t i = 0; i < 2; i++) assert_near(mesh->normals + 3 * i, sin(half), cos(half), 0);
    assert_near(mesh->normals + 3 * 2, 0, 1, 0);
    nebel_destroy_scene(scene);
    write_folded_ply(61);
    scene = load_good("\"file\": \"fold.ply\"");
    mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->vertex_count, 6);
    for (size_t i = 0; i < 3; i++) {
        assert_near(mesh->normals + 3 * (size_t)mesh->indices[i], 0, 1, 0);
        assert_near(mesh->normals + 3 * (size_t)mesh->indices[3 + i], sin(whole), cos(whole), 0);
    }
    nebel_destroy_scene(scene);
}

/* OBJ comes with three vertices for each triangle; places are compared as numbers, where -0 is 0. */
static void test_what_lies_at_one_place_is_smoothed_together(void **state)
{
    (void)state;
    write_text("t.obj", "v 0 0 0\nv 0 0 1\nv -1 0 0\nv 1 0 0\nv -0 -0 1\nf 1 3 2\nf 1 5 4\n");
    nebel_scene *scene = load_good("\"file\": \"t.obj\"");
    assert_int_equal(nebel_get_scene_data(scene)->meshes->vertex_count, 4);
    nebel_destroy_scene(scene);
    write_text("t.obj", "v 0 0 0\nv 0 0 1\nv -1 0 0\nv 1 -1 0\nv 0 0.001 1\nf 1 3 2\nf 1 5 4\n");
    scene = load_good("\"file\": \"t.obj\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->vertex_count, 5);
    assert_near(mesh->normals + 3 * (size_t)mesh->indices[2], 0, 1, 0);
    nebel_destroy_scene(scene);
}

/* At a seam of the texture a vertex stays two, with one normal. */
static void test_a_seam_of_the_texture_stays_smooth(void **state)
{
    (void)state;
    png_image color = {.version = PNG_IMAGE_VERSION, .width = 2, .height = 2, .format = PNG_FORMAT_RGB};
    const unsigned char pixels[12] = {0};
    assert_true(png_image_write_to_file(&color, in_folder("color.png"), 0, pixels, 0, NULL));
    write_text("t.mtl", "newmtl red\nmap_Kd color.png\n");
    write_text("t.obj", "mtllib t.mtl\nusemtl red\nv 0 0 0\nv 0 0 1\nv -1 0 0\nv 1 -1 0\nvt 0 0.25\nvt 1 1\n"
                        "f 1/1 3/1 2/1\nf 1/2 2/2 4/2\n");
    nebel_scene *scene = load_good("\"file\": \"t.obj\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    const double half = acos(-1) / 8;
    assert_int_equal(check_meshes(scene), 2);
    assert_int_equal(mesh->vertex_count, 6);
    assert_near(mesh->normals + 3 * (size_t)mesh->indices[0], sin(half), cos(half), 0);
    assert_near(mesh->normals + 3 * (size_t)mesh->indices[3], sin(half), cos(half), 0);
    assert_true(mesh->uvs[2 * mesh->indices[0] + 1] == .75f && mesh->uvs[2 * mesh->indices[3] + 1] == 0);
    nebel_destroy_scene(scene);
}

/* A cone with its tip up, ten times as high as wide. */
static void write_cone(unsigned sides)
{
    FILE *file = fopen(in_folder("cone.ply"), "w");
    fprintf(file,
            "ply\nformat ascii 1.0\nelement vertex %u\nproperty float x\nproperty float y\nproperty float z\n"
            "element face %u\nproperty list uchar int vertex_indices\nend_header\n0 10 0\n",
            sides + 1, sides);
    for (unsigned i = 0; i < sides; i++)
        fprintf(file, "%.9g 0 %.9g\n", cos(2 * acos(-1) * i / sides), -sin(2 * acos(-1) * i / sides));
    for (unsigned i = 0; i < sides; i++) fprintf(file, "3 0 %u %u\n", i + 1, (i + 1) % sides + 1);
    fclose(file);
}

/* However many triangles meet there, the tip takes a moment, and each has a normal that is near its own. */
static void test_the_tip_of_a_cone_is_seen_from_all_sides(void **state)
{
    (void)state;
    const unsigned sides[] = {3, 24, 1024, 1025, 300000};
    for (int s = 0; s < 5; s++) {
        write_cone(sides[s]);
        nebel_scene *scene = load_good("\"file\": \"cone.ply\"");
        const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
        assert_int_equal(check_meshes(scene), sides[s]);
        for (size_t i = 0; i < sides[s]; i++) {
            double face[3];
            face_normal(mesh, i, face);
            const float *tip = mesh->normals + 3 * (size_t)mesh->indices[3 * i];
            const double length = sqrt(face[0] * face[0] + face[1] * face[1] + face[2] * face[2]);
            assert_true(face[0] * (double)tip[0] + face[1] * (double)tip[1] + face[2] * (double)tip[2] > .99 * length);
        }
        nebel_destroy_scene(scene);
    }
}

/* A bowl y = (x^2 + z^2) / 2 of 40 x 40 cells; shared vertices stay as they are. */
static void test_a_smooth_surface_has_its_normals(void **state)
{
    (void)state;
    enum { CELLS = 40, ROW = CELLS + 1 };
    FILE *file = fopen(in_folder("bowl.ply"), "w");
    fprintf(file,
            "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            "element face %d\nproperty list uchar int vertex_indices\nend_header\n",
            ROW * ROW, 2 * CELLS * CELLS);
    for (int k = 0; k < ROW * ROW; k++) {
        const double x = k % ROW / 20. - 1, z = (double)(k / ROW) / 20. - 1;
        fprintf(file, "%.9g %.9g %.9g\n", x, (x * x + z * z) / 2, z);
    }
    for (int k = 0; k < ROW * CELLS; k++)
        if (k % ROW < CELLS) fprintf(file, "3 %d %d %d\n3 %d %d %d\n", k, k + ROW, k + 1, k + 1, k + ROW, k + ROW + 1);
    fclose(file);
    nebel_scene *scene = load_good("\"file\": \"bowl.ply\"");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(mesh->vertex_count, ROW * ROW);
    assert_int_equal(check_meshes(scene), 2 * CELLS * CELLS);
    for (size_t i = 0; i < ROW * ROW; i++) {
        const float *p = mesh->positions + 3 * i, *n = mesh->normals + 3 * i;
        const double length = sqrt((double)(p[0] * p[0] + p[2] * p[2] + 1));
        const double cosine = ((double)n[1] - (double)(p[0] * n[0] + p[2] * n[2])) / length;
        assert_true(cosine > (i % ROW % CELLS != 0 && i / ROW % CELLS != 0 ? .9999 : .999));
    }
    nebel_destroy_scene(scene);
}

static void test_triangles_with_two_corners_at_one_place_are_left_out(void **state)
{
    (void)state;
    write_text("t.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 0 1\nf 1 2 3\nf 1 1 2\nf 1 2 2\nf 1 2 1\nf 2 3 4\n");
    nebel_scene *scene = load_good("\"file\": \"t.obj\"");
    assert_int_equal(check_meshes(scene), 1);
    assert_int_equal(nebel_get_scene_data(scene)->meshes->vertex_count, 3);
    nebel_destroy_scene(scene);
}

/* ---- height fields --------------------------------------------------------------------------- */

static void write_heights(const char *name, uint32_t width, uint32_t height, const uint16_t *values)
{
    FILE *file = fopen(in_folder(name), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, width, height, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    png_bytep rows[16];
    unsigned char bytes[16][64];
    for (uint32_t y = 0; y < height; y++) {
        rows[y] = bytes[y];
        for (uint32_t x = 0; x < width; x++) {
            bytes[y][2 * x] = (unsigned char)(values[y * width + x] >> 8);
            bytes[y][2 * x + 1] = (unsigned char)values[y * width + x];
        }
    }
    png_write_image(png, rows);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    fclose(file);
}

#define HEIGHTS(name) "\"heightfield\": {\"file\": \"" name "\", \"size\": [6, 2], \"height\": 10}"

static void test_a_height_map_becomes_terrain(void **state)
{
    (void)state;
    const uint16_t values[12] = {0, 0, 0, 0, 65535, 0, 0, 13107, 0, 0, 0, 1};
    write_heights("h.png", 4, 3, values);
    nebel_scene *scene = load_good(HEIGHTS("h.png") ", \"position\": [5, 6, 7], \"color\": [0.25, 0.5, 1]");
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 1);
    assert_int_equal(mesh->vertex_count, 12);
    assert_int_equal(mesh->triangle_count, 12);
    assert_int_equal(check_meshes(scene), 12);
    assert_near(mesh->positions, -3, 0, -1);
    assert_near(mesh->positions + 3 * 4, -3, 10, 0);
    assert_near(mesh->positions + 3 * 7, 3, 2, 0);
    assert_near(mesh->positions + 3 * 11, 3, 10.0 / 65535, 1);
    assert_near(mesh->base_color, .25, .5, 1);
    assert_true(mesh->origin[0] == 5 && mesh->origin[1] == 6 && mesh->origin[2] == 7);
    for (size_t i = 0; i < 12; i++) {
        double normal[3];
        face_normal(mesh, i, normal);
        assert_true(normal[1] > 0);
    }
    nebel_destroy_scene(scene);
}

static void test_a_slope_has_the_normal_of_its_plane(void **state)
{
    (void)state;
    uint16_t values[5 * 4];
    for (uint32_t y = 0; y < 4; y++)
        for (uint32_t x = 0; x < 5; x++) values[y * 5 + x] = (uint16_t)(x * 6000 + y * 3000);
    write_heights("h.png", 5, 4, values);
    nebel_scene *scene = load_good(HEIGHTS("h.png"));
    const nebel_mesh *mesh = nebel_get_scene_data(scene)->meshes;
    const double dx = 10 * 6000 / 65535.0 / 1.5, dz = 10 * 3000 / 65535.0 / (2.0 / 3),
                 length = sqrt(dx * dx + 1 + dz * dz);
    for (size_t i = 0; i < 20; i++) assert_near(mesh->normals + 3 * i, -dx / length, 1 / length, -dz / length);
    nebel_destroy_scene(scene);
}

static void test_what_is_no_height_map(void **state)
{
    (void)state;
    const uint16_t one[2] = {1, 2};
    write_heights("thin.png", 2, 1, one);
    write_text("text.png", "hello");
    png_image color = {.version = PNG_IMAGE_VERSION, .width = 2, .height = 2, .format = PNG_FORMAT_RGB};
    const unsigned char pixels[12] = {0};
    assert_true(png_image_write_to_file(&color, in_folder("color.png"), 0, pixels, 0, NULL));
    assert_broken(HEIGHTS("thin.png"), NEBEL_ERROR_FORMAT, "has 2 x 1 pixels; a height map needs 2 x 2");
    assert_broken(HEIGHTS("text.png"), NEBEL_ERROR_FORMAT, "is not a PNG picture");
    assert_broken(HEIGHTS("color.png"), NEBEL_ERROR_FORMAT, "a height map must be grey");
    assert_broken(HEIGHTS("none.png"), NEBEL_ERROR_FILE, "No such file or directory");
}

/* ---- other places ---------------------------------------------------------------------------- */

static void test_models_are_placed_anew(void **state)
{
    (void)state;
    write_text("t.obj", triangle_obj);
    nebel_scene *scene = load_good("\"file\": \"t.obj\", \"position\": [5, 0, 0]}, {\"file\": \"t.obj\"");
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->model_count, 2);
    nebel_scene_model moved = data->models[0], wrong = moved;
    moved.position[1] = 3;
    moved.has_color = 1;
    moved.color[2] = .5;
    assert_int_equal(nebel_reload_scene_models(scene, &moved, 1), NEBEL_OK);
    assert_int_equal(data->mesh_count, 1);
    assert_near((const float[]){(float)data->meshes[0].origin[0] + data->meshes[0].positions[0],
                                (float)data->meshes[0].origin[1] + data->meshes[0].positions[1],
                                (float)data->meshes[0].origin[2] + data->meshes[0].positions[2]},
                5, 3, 0);
    assert_near(data->meshes[0].base_color, 0, 0, .5);
    wrong.model_index = 2;
    assert_int_equal(nebel_reload_scene_models(scene, &wrong, 1), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(data->mesh_count, 1);
    remove(in_folder("t.obj"));
    assert_int_equal(nebel_reload_scene_models(scene, data->models, 2), NEBEL_ERROR_FILE);
    assert_int_equal(data->mesh_count, 1);
    assert_int_equal(nebel_reload_scene_models(scene, NULL, 0), NEBEL_OK);
    assert_int_equal(data->mesh_count, 0);
    nebel_destroy_scene(scene);
}

/* ---- memory ---------------------------------------------------------------------------------- */

static void survive_every_failing_allocation(const char *text, int in_process)
{
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (long k = 0; result != NEBEL_OK; k++) {
        meter m;
        journal kept;
        nebel_scene *scene = NULL;
        nebel_scene_desc desc = metered_desc(&m, &kept);
        desc.models_in_process = in_process;
        assert_int_equal(nebel_parse_scene(text, strlen(text), in_folder("s.json"), &desc, &scene), NEBEL_OK);
        m.fail_at = m.made + k;
        result = nebel_load_scene_models(scene);
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        if (result != NEBEL_OK) assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 0);
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
        assert_true(k < 500);
    }
}

/* Integers as numbers of vertices, which are made floats. */
static const char quantised_gltf[] =
    "{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}], "
    "\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0}}]}], \"buffers\": [{\"byteLength\": 12, "
    "\"uri\": \"data:;base64,AAAAAAEAAAAAAQAA\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 12, "
    "\"byteStride\": 4}], \"accessors\": [{\"bufferView\": 0, \"componentType\": 5121, \"count\": 3, "
    "\"type\": \"VEC3\"}]}";

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    const uint16_t values[4] = {0, 1, 2, 3};
    char text[300];
    write_text("t.obj", triangle_obj);
    write_text("cube.ply", cube_ply);
    write_text("quad.gltf", quantised_gltf);
    write_heights("h.png", 2, 2, values);
    snprintf(text, sizeof text,
             "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"t.obj\"}, {\"file\": \"cube.ply\"}, "
             "{\"file\": \"quad.gltf\"}, {" HEIGHTS("h.png") "}]}");
    survive_every_failing_allocation(text, 0);
    survive_every_failing_allocation(text, 1);
}

/* ---- models of others ------------------------------------------------------------------------ */

typedef struct known {
    const char *file;
    size_t triangles, textures;
} known;

/* Triangles as Assimp makes them of the files' polygons, less those with two corners at one place: 11160 of the
 * engine's, 56 of the spider's. */
static void test_models_of_many_formats(void **state)
{
    (void)state;
    static const known models[] = {{"glTF2/BoxTextured-glTF/BoxTextured.gltf", 12, 1},
                                   {"glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf", 12, 1},
                                   {"glTF2/BoxTextured-glTF-Binary/BoxTextured.glb", 12, 1},
                                   {"glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb", 110336, 0},
                                   {"OBJ/spider.obj", 1312, 4},
                                   {"OBJ/WusonOBJ.obj", 3732, 0},
                                   {"PLY/Wuson.ply", 3732, 0},
                                   {"PLY/cube.ply", 12, 0},
                                   {"FBX/box.fbx", 12, 0},
                                   {"FBX/huesitos.fbx", 0, 0}};
    if (access(MODELS "OBJ/spider.obj", R_OK) != 0) {
        print_message("assimp-testmodels is not installed\n");
        skip();
    }
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        char members[300];
        snprintf(members, sizeof members, "\"file\": \"" MODELS "%s\"", models[i].file);
        nebel_scene *scene = load_good(members);
        const size_t triangles = check_meshes(scene), textures = nebel_get_scene_data(scene)->texture_count;
        if ((models[i].triangles != 0 && triangles != models[i].triangles) || textures != models[i].textures)
            fail_msg("%s: %zu triangles, %zu textures", models[i].file, triangles, textures);
        for (size_t t = 0; t < textures; t++) {
            const nebel_texture *texture = &nebel_get_scene_data(scene)->textures[t];
            assert_true(texture->width > 0 && texture->height > 0);
            assert_int_equal(texture->rgba[3], 255);
        }
        nebel_destroy_scene(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scale_comes_first_then_rotation_then_position),
        cmocka_unit_test(test_a_mirrored_model_is_not_inside_out),
        cmocka_unit_test(test_a_model_far_away_stays_precise),
        cmocka_unit_test(test_loading_twice_changes_nothing),
        cmocka_unit_test(test_broken_models_are_named_with_the_reason),
        cmocka_unit_test(test_files_that_are_no_models_are_told_what_they_are),
        cmocka_unit_test(test_binary_gltf_that_is_cut_short_is_told_how_much_is_missing),
        cmocka_unit_test(test_corners_that_are_no_numbers_are_left_out),
        cmocka_unit_test(test_every_truncated_model_is_survived),
        cmocka_unit_test(test_textures_are_looked_for_beside_the_model),
        cmocka_unit_test(test_a_cube_with_shared_corners_keeps_its_edges),
        cmocka_unit_test(test_normals_that_are_no_directions_are_mended),
        cmocka_unit_test(test_a_fold_is_sharp_from_sixty_degrees_on),
        cmocka_unit_test(test_what_lies_at_one_place_is_smoothed_together),
        cmocka_unit_test(test_a_seam_of_the_texture_stays_smooth),
        cmocka_unit_test(test_the_tip_of_a_cone_is_seen_from_all_sides),
        cmocka_unit_test(test_a_smooth_surface_has_its_normals),
        cmocka_unit_test(test_triangles_with_two_corners_at_one_place_are_left_out),
        cmocka_unit_test(test_a_height_map_becomes_terrain),
        cmocka_unit_test(test_a_slope_has_the_normal_of_its_plane),
        cmocka_unit_test(test_what_is_no_height_map),
        cmocka_unit_test(test_models_are_placed_anew),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
        cmocka_unit_test(test_models_of_many_formats),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder_tree);
}
