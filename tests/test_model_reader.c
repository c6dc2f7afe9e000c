/* Models are read by a process of its own: good ones come out as if they were read here, and nothing that the process
 * does harms this one. */
#define _GNU_SOURCE
#include "model_help.h"
#include "model/model_budget.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <sys/syscall.h>
#include <threads.h>

#if defined(__linux__)
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#endif

#define MODELS "/usr/share/assimp/models/"

static const char quad_obj[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

/* ---- scenes ---------------------------------------------------------------------------------- */

static nebel_result load_by(const char *reader, int in_process, const char *file, journal *kept, nebel_scene **scene)
{
    char text[1000];
    const nebel_scene_desc desc = {
        .host.log = {remember, kept}, .model_reader = reader, .models_in_process = in_process};
    *kept = (journal){0};
    snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"%s\"}]}", file);
    if (nebel_parse_scene(text, strlen(text), in_folder("scene.json"), &desc, scene) != NEBEL_OK)
        fail_msg("%s", kept->last);
    return nebel_load_scene_models(*scene);
}

static nebel_result try_model(const char *reader, const char *file, journal *kept)
{
    nebel_scene *scene = NULL;
    const nebel_result result = load_by(reader, 0, file, kept, &scene);
    nebel_destroy_scene(scene);
    return result;
}

static int count_files(void)
{
    int count = 0;
    DIR *files = opendir("/proc/self/fd");
    assert_non_null(files);
    while (readdir(files) != NULL) count++;
    closedir(files);
    return count;
}

/* ---- good models ----------------------------------------------------------------------------- */

static void assert_same_bytes(const void *a, const void *b, size_t size)
{
    assert_true((a == NULL) == (b == NULL));
    if (a != NULL) assert_memory_equal(a, b, size);
}

static void assert_same_meshes(const nebel_scene_data *a, const nebel_scene_data *b)
{
    assert_int_equal(a->mesh_count, b->mesh_count);
    assert_int_equal(a->texture_count, b->texture_count);
    for (size_t i = 0; i < a->mesh_count; i++) {
        const nebel_mesh *x = &a->meshes[i], *y = &b->meshes[i];
        assert_int_equal(x->vertex_count, y->vertex_count);
        assert_int_equal(x->triangle_count, y->triangle_count);
        assert_true(x->texture == y->texture && x->mask == y->mask && x->alpha_cutoff == y->alpha_cutoff);
        assert_memory_equal(x->base_color, y->base_color, sizeof x->base_color);
        assert_memory_equal(x->origin, y->origin, sizeof x->origin);
        assert_same_bytes(x->positions, y->positions, 12 * (size_t)x->vertex_count);
        assert_same_bytes(x->normals, y->normals, 12 * (size_t)x->vertex_count);
        assert_same_bytes(x->uvs, y->uvs, 8 * (size_t)x->vertex_count);
        assert_same_bytes(x->indices, y->indices, 12 * (size_t)x->triangle_count);
    }
    for (size_t i = 0; i < a->texture_count; i++) {
        assert_int_equal(a->textures[i].width, b->textures[i].width);
        assert_same_bytes(a->textures[i].rgba, b->textures[i].rgba,
                          4 * (size_t)a->textures[i].width * a->textures[i].height);
    }
}

static void test_a_process_reads_what_this_one_reads(void **state)
{
    (void)state;
    static const char *const files[] = {"quad.obj", MODELS "OBJ/spider.obj",
                                        MODELS "glTF2/BoxTextured-glTF-Binary/BoxTextured.glb"};
    write_text("quad.obj", quad_obj);
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        journal kept;
        nebel_scene *apart = NULL, *here = NULL;
        if (files[i][0] == '/' && access(files[i], R_OK) != 0) continue;
        if (load_by(NULL, 0, files[i], &kept, &apart) != NEBEL_OK) fail_msg("%s", kept.last);
        if (load_by("/nowhere", 1, files[i], &kept, &here) != NEBEL_OK) fail_msg("%s", kept.last);
        assert_true(nebel_get_scene_data(apart)->mesh_count > 0);
        assert_same_meshes(nebel_get_scene_data(apart), nebel_get_scene_data(here));
        nebel_destroy_scene(apart);
        nebel_destroy_scene(here);
    }
}

static void test_a_missing_reader_is_an_error(void **state)
{
    (void)state;
    journal kept;
    write_text("quad.obj", quad_obj);
    assert_int_equal(try_model("/nowhere/reader", "quad.obj", &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "quad.obj"));
    assert_non_null(strstr(kept.last, "\"/nowhere/reader\", does not start"));
}

/* The more descriptors are left, the farther it comes: to the model, to the first pipe, to the second. */
static void test_a_host_without_descriptors_is_told(void **state)
{
    (void)state;
    journal kept;
    struct rlimit before;
    int without_pipe = 0;
    write_text("quad.obj", quad_obj);
    const int files = count_files();
    assert_int_equal(getrlimit(RLIMIT_NOFILE, &before), 0);
    for (rlim_t left = 0; left < 4; left++) {
        const int next = open("/dev/null", O_RDONLY);
        close(next);
        const struct rlimit few = {(rlim_t)next + left, before.rlim_max};
        assert_int_equal(setrlimit(RLIMIT_NOFILE, &few), 0);
        const nebel_result result = try_model(NULL, "quad.obj", &kept);
        assert_int_equal(setrlimit(RLIMIT_NOFILE, &before), 0);
        assert_int_equal(result, NEBEL_ERROR_FILE);
        assert_non_null(strstr(kept.last, "quad.obj\": "));
        assert_non_null(strstr(kept.last, "Too many open files"));
        without_pipe += strstr(kept.last, "pipe: ") != NULL;
    }
    assert_true(without_pipe >= 2);
    assert_int_equal(count_files(), files);
}

/* ---- odd readers ----------------------------------------------------------------------------- */

static void test_what_a_reader_sends_is_checked(void **state)
{
    (void)state;
    static const struct {
        const char *mode;
        nebel_result result;
        const char *message;
    } odd[] = {{"nothing", NEBEL_ERROR_FORMAT, "ended early"},
               {"hello", NEBEL_ERROR_FORMAT, "ended early"},
               {"crash", NEBEL_ERROR_FORMAT, "memory that is not its own"},
               {"abort", NEBEL_ERROR_FORMAT, "ended by an error that it does not handle"},
               {"division", NEBEL_ERROR_FORMAT, "ended by a division by 0"},
               {"instruction", NEBEL_ERROR_FORMAT, "ended by an instruction that does not exist"},
               {"closes", NEBEL_ERROR_FORMAT, "cannot be read"},
               {"version", NEBEL_ERROR_FILE, "another version"},
               {"garbage", NEBEL_ERROR_FORMAT, "cannot be"},
               {"chatter", NEBEL_ERROR_FORMAT, "cannot be"},
               {"vast", NEBEL_ERROR_LIMIT, "memory"},
               {"vast texture", NEBEL_ERROR_LIMIT, "memory"},
               {"points", NEBEL_ERROR_FORMAT, "cannot be"},
               {"index", NEBEL_ERROR_FORMAT, "cannot be"},
               {"place", NEBEL_ERROR_FORMAT, "cannot be"},
               {"normal", NEBEL_ERROR_FORMAT, "cannot be"},
               {"texture", NEBEL_ERROR_FORMAT, "cannot be"},
               {"color", NEBEL_ERROR_FORMAT, "cannot be"},
               {"cutoff", NEBEL_ERROR_FORMAT, "cannot be"},
               {"size", NEBEL_ERROR_FORMAT, "cannot be"},
               {"none", NEBEL_ERROR_FORMAT, "cannot be"},
               {"no end", NEBEL_ERROR_FORMAT, "ended early"},
               {"lost", NEBEL_ERROR_FORMAT, "cannot be"},
               {"escape", NEBEL_ERROR_FORMAT, "?[2J"},
               {"lingers", NEBEL_OK, ""},
               {"good", NEBEL_OK, ""}};
    char reader[300];
    const ssize_t size = readlink("/proc/self/exe", reader, sizeof reader - 20);
    assert_true(size > 0);
    reader[size] = '\0';
    strcpy(strrchr(reader, '/') + 1, "odd_reader");
    const int files = count_files();
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        journal kept;
        write_text(odd[i].mode, "model");
        const nebel_result result = try_model(reader, odd[i].mode, &kept);
        if (result != odd[i].result || strstr(kept.last, odd[i].message) == NULL)
            fail_msg("%s gave %d: %s", odd[i].mode, result, kept.last);
    }
    assert_int_equal(count_files(), files);
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1); /* no child is left */
}

/* ---- hosts ----------------------------------------------------------------------------------- */

/* Recursion without an end for Assimp's reader of AC3D. */
static void write_deep_model(void)
{
    FILE *file = fopen(in_folder("deep.ac"), "w");
    fputs("AC3Db\nMATERIAL \"\" rgb 1 1 1 amb 1 1 1 emis 0 0 0 spec 0 0 0 shi 0 trans 0\n", file);
    for (int i = 0; i < 100000; i++) fputs("OBJECT group\nkids 1\n", file);
    fputs("OBJECT poly\nkids 0\n", file);
    fclose(file);
}

static void test_hosts_may_ignore_their_children(void **state)
{
    (void)state;
    journal kept;
    write_text("quad.obj", quad_obj);
    write_deep_model();
    void (*const before)(int) = signal(SIGCHLD, SIG_IGN);
    assert_int_equal(try_model(NULL, "quad.obj", &kept), NEBEL_OK);
    assert_int_equal(try_model(NULL, "deep.ac", &kept), NEBEL_ERROR_FORMAT);
    assert_non_null(strstr(kept.last, "deep.ac"));
    assert_ptr_equal(signal(SIGCHLD, before), SIG_IGN);
}

static void test_children_of_a_host_stay_its_own(void **state)
{
    (void)state;
    journal kept;
    int status;
    write_text("quad.obj", quad_obj);
    const pid_t own = fork();
    if (own == 0) _exit(7);
    assert_int_equal(try_model(NULL, "quad.obj", &kept), NEBEL_OK);
    assert_int_equal(waitpid(own, &status, 0), own);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 7);
}

static void test_a_host_may_have_closed_its_standard_files(void **state)
{
    (void)state;
    int status;
    write_text("quad.obj", quad_obj);
    const pid_t host = fork();
    if (host == 0) {
        journal kept;
        for (int i = 0; i < 3; i++) close(i);
        _exit(try_model(NULL, "quad.obj", &kept) == NEBEL_OK ? 0 : 1);
    }
    assert_int_equal(waitpid(host, &status, 0), host);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static int load_often(void *result)
{
    journal kept;
    for (int i = 0; i < 3; i++) {
        const bool good = try_model(NULL, "quad.obj", &kept) == NEBEL_OK;
        const bool refused = try_model(NULL, "deep.ac", &kept) == NEBEL_ERROR_FORMAT;
        if (!good || !refused) *(int *)result = 1;
    }
    return 0;
}

static void test_many_threads_may_read_models(void **state)
{
    (void)state;
    thrd_t threads[4];
    int results[4] = {0};
    write_text("quad.obj", quad_obj);
    write_deep_model();
    const int files = count_files();
    for (int i = 0; i < 4; i++) assert_int_equal(thrd_create(&threads[i], load_often, &results[i]), thrd_success);
    for (int i = 0; i < 4; i++) thrd_join(threads[i], NULL);
    for (int i = 0; i < 4; i++) assert_int_equal(results[i], 0);
    assert_int_equal(count_files(), files);
}

/* The state of a process in one letter; 0: there is none. */
static char state_of(long id)
{
    char path[64], line[300] = "";
    snprintf(path, sizeof path, "/proc/%ld/stat", id);
    FILE *file = fopen(path, "r");
    if (file == NULL) return 0;
    const bool read = fgets(line, sizeof line, file) != NULL;
    fclose(file);
    const char *name_end = read ? strrchr(line, ')') : NULL;
    return name_end != NULL ? name_end[2] : 0;
}

static long find_child(pid_t parent)
{
    char path[64];
    long child = 0;
    snprintf(path, sizeof path, "/proc/%ld/task/%ld/children", (long)parent, (long)parent);
    for (int i = 0; i < 500 && child == 0; i++) {
        FILE *file = fopen(path, "r");
        if (file == NULL) return 0;
        if (fscanf(file, "%ld", &child) != 1) child = 0;
        fclose(file);
        usleep(10000);
    }
    return child;
}

static void test_the_reader_dies_with_its_parent(void **state)
{
    (void)state;
    write_text("endless.smd", "version 1\n\nnodes");
    const pid_t host = fork();
    if (host == 0) {
        journal kept;
        (void)try_model(NULL, "endless.smd", &kept);
        _exit(0);
    }
    const long reader = find_child(host);
    kill(host, SIGKILL);
    assert_int_equal(waitpid(host, NULL, 0), host);
    if (reader == 0) skip();
    char now = state_of(reader);
    for (int i = 0; i < 200 && now != 0 && now != 'Z'; i++, now = state_of(reader)) usleep(10000);
    if (now != 0 && now != 'Z') fail_msg("the reader goes on: %c", now);
}

/* ---- what the reader may do ------------------------------------------------------------------ */

/* The line of a file of /proc that begins so; "" where there is none. */
static void find_line(long id, const char *name, const char *begin, char line[300])
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%ld/%s", id, name);
    FILE *file = fopen(path, "r");
    bool found = false;
    while (file != NULL && !found && fgets(line, 300, file) != NULL) found = strncmp(line, begin, strlen(begin)) == 0;
    if (!found) line[0] = '\0';
    if (file != NULL) fclose(file);
}

static int count_files_of(long id)
{
    char path[64];
    int count = 0;
    snprintf(path, sizeof path, "/proc/%ld/fd", id);
    DIR *files = opendir(path);
    for (const struct dirent *entry; files != NULL && (entry = readdir(files)) != NULL;)
        count += entry->d_name[0] != '.';
    if (files != NULL) closedir(files);
    return count;
}

static void test_the_reader_is_confined(void **state)
{
    (void)state;
    static const char *const limits[] = {"Max core file size        0 ", "Max file size             0 ",
                                         "Max processes             0 ", "Max open files            64 ",
                                         "Max cpu time              5 ", "Max address space         8"};
    char line[300] = "";
    if (NB_SANITIZED) skip();
    write_text("endless.smd", "version 1\n\nnodes");
    const int open_file = open("/dev/null", O_RDONLY); /* which the reader must not get */
    const pid_t host = fork();
    if (host == 0) {
        journal kept;
        (void)try_model(NULL, "endless.smd", &kept);
        _exit(0);
    }
    const long reader = find_child(host);
    for (int i = 0; i < 200 && reader != 0; i++) {
        find_line(reader, "status", "Seccomp:", line);
        if (strstr(line, "2") != NULL) break;
        usleep(10000);
    }
    char found[sizeof limits / sizeof *limits][300];
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) find_line(reader, "limits", limits[i], found[i]);
    const int files = count_files_of(reader);
    kill(host, SIGKILL);
    assert_int_equal(waitpid(host, NULL, 0), host);
    close(open_file);
    if (reader == 0) skip();
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
        if (found[i][0] == '\0') fail_msg("%s", limits[i]);
    assert_non_null(strstr(found[5], "5100273664")); /* nor may it allow itself more than that and the scene's memory */
    if (files > 5) fail_msg("%d files", files);      /* the standard ones, the folder and the model */
#if defined(__x86_64__) || defined(__aarch64__)
    if (line[0] != '\0') assert_non_null(strstr(line, "2"));
#endif
}

/* ---- hostile models -------------------------------------------------------------------------- */

/* Whether a model of such text gives a result, and a last message that names the file and says `words`. */
static void check_told(const char *file, const char *text, nebel_result result, const char *words)
{
    journal kept;
    write_text(file, text);
    assert_int_equal(try_model(NULL, file, &kept), result);
    assert_non_null(strstr(kept.last, file));
    assert_non_null(strstr(kept.last, words));
}

/* Where Assimp puts another corner in place of one that does not exist, and tells nobody but its log. */
static void test_what_assimp_makes_up_is_told(void **state)
{
    (void)state;
    check_told("corner.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9999999\n", NEBEL_OK, "out of range");
}

static void test_more_memory_than_a_file_warrants(void **state)
{
    (void)state;
    if (NB_SANITIZED) skip(); /* no limit then */
    check_told("counts.off", "OFF\n300000000 300000000 0\n0 0 0\n", NEBEL_ERROR_LIMIT, "MB of memory");
}

/* ---- files that a model names ---------------------------------------------------------------- */

static void test_references_stay_in_the_folder(void **state)
{
    (void)state;
    journal kept;
    nebel_result result;
    mkdir(in_folder("sub"), 0700);
    write_text("paint.mtl", "newmtl red\nKd 1 0 0\n");
    write_text("sub/quad.obj", "mtllib ../paint.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    nebel_scene *scene = load("\"file\": \"sub/quad.obj\"", &result, &kept);
    assert_int_equal(result, NEBEL_OK);
    assert_non_null(strstr(kept.last, "without \"../paint.mtl\""));
    assert_non_null(strstr(kept.last, "outside the folder"));
    assert_true(nebel_get_scene_data(scene)->meshes[0].base_color[1] > 0);
    nebel_destroy_scene(scene);
    for (int i = 0; i < 2; i++) {
        scene = load(i == 0 ? "\"file\": \"sub/quad.obj\", \"folder\": \".\""
                            : "\"file\": \"sub/quad.obj\", \"folder\": \"sub/..\"",
                     &result, &kept);
        assert_int_equal(result, NEBEL_OK);
        assert_int_equal(kept.count, 0);
        assert_true(nebel_get_scene_data(scene)->meshes[0].base_color[0] == 1);
        assert_true(nebel_get_scene_data(scene)->meshes[0].base_color[1] == 0);
        nebel_destroy_scene(scene);
    }
    mkdir(in_folder("other"), 0700);
    assert_broken("\"file\": \"sub/quad.obj\", \"folder\": \"other\"", NEBEL_ERROR_FORMAT, "does not hold the model");
    assert_broken("\"file\": \"sub/quad.obj\", \"folder\": \"missing\"", NEBEL_ERROR_FILE, "cannot open the folder");
}

static void test_links_and_pipes_are_no_way_out(void **state)
{
    (void)state;
    journal kept;
    nebel_result result;
    mkdir(in_folder("sub"), 0700);
    assert_int_equal(symlink("../paint.mtl", in_folder("sub/link.mtl")), 0);
    assert_int_equal(mkfifo(in_folder("sub/pipe"), 0600), 0);
    for (int i = 0; i < 2; i++) {
        write_text("sub/quad.obj", i == 0 ? "mtllib link.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
                                          : "mtllib pipe\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        nebel_scene *scene = load("\"file\": \"sub/quad.obj\"", &result, &kept);
        assert_int_equal(result, NEBEL_OK);
        assert_non_null(strstr(kept.last, i == 0 ? "outside the folder" : "a pipe"));
        nebel_destroy_scene(scene);
    }
    assert_broken("\"file\": \"sub/pipe\"", NEBEL_ERROR_FILE, "a pipe");
    /* The model itself may be a link: the scene names it. */
    assert_int_equal(symlink("sub/quad.obj", in_folder("link.obj")), 0);
    nebel_scene *scene = load_good("\"file\": \"link.obj\"");
    nebel_destroy_scene(scene);
}

#if defined(SYS_openat2) && defined(__linux__)

enum { OLD_CASES = 4 };

typedef struct old_kernel {
    int is_filtered;
    nebel_result results[2][OLD_CASES];
    journal kept[2][OLD_CASES];
    float green[2][OLD_CASES];
} old_kernel;

/* Linux before 5.6 has no openat2: here one thread, and the readers that it starts. */
static int read_on_an_old_kernel(void *user)
{
    old_kernel *out = user;
    struct sock_filter lines[] = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
                                  BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_openat2, 0, 1),
                                  BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
                                  BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)};
    const struct sock_fprog whole = {sizeof lines / sizeof *lines, lines};
    out->is_filtered =
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &whole) == 0;
    for (int here = 0; here < 2 && out->is_filtered; here++)
        for (int i = 0; i < OLD_CASES; i++) {
            char file[40];
            nebel_scene *scene = NULL;
            snprintf(file, sizeof file, "old/case%d.obj", i);
            out->results[here][i] = load_by(NULL, here, file, &out->kept[here][i], &scene);
            if (out->results[here][i] == NEBEL_OK)
                out->green[here][i] = nebel_get_scene_data(scene)->meshes[0].base_color[1];
            nebel_destroy_scene(scene);
        }
    return 0;
}

static void test_references_stay_in_the_folder_on_old_kernels(void **state)
{
    (void)state;
    static const struct {
        const char *name, *refused;
    } cases[OLD_CASES] = {{"in/paint.mtl", NULL},
                          {"in/none.mtl", ""},
                          {"../paint.mtl", "outside the folder"},
                          {"out.mtl", "outside the folder"}};
    static old_kernel got;
    thrd_t thread;
    mkdir(in_folder("old"), 0700);
    mkdir(in_folder("old/in"), 0700);
    write_text("paint.mtl", "newmtl red\nKd 1 0 0\n");
    write_text("old/in/paint.mtl", "newmtl red\nKd 1 0 0\n");
    assert_int_equal(symlink("../paint.mtl", in_folder("old/out.mtl")), 0);
    for (int i = 0; i < OLD_CASES; i++) {
        char file[40], text[200];
        snprintf(file, sizeof file, "old/case%d.obj", i);
        snprintf(text, sizeof text, "mtllib %s\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", cases[i].name);
        write_text(file, text);
    }
    assert_int_equal(thrd_create(&thread, read_on_an_old_kernel, &got), thrd_success);
    thrd_join(thread, NULL);
    if (!got.is_filtered) skip();
    for (int here = 0; here < 2; here++)
        for (int i = 0; i < OLD_CASES; i++) {
            const journal *kept = &got.kept[here][i];
            assert_int_equal(got.results[here][i], NEBEL_OK);
            assert_true((got.green[here][i] == 0) == (cases[i].refused == NULL)); /* the material was read */
            if (cases[i].refused != NULL && strstr(kept->last, cases[i].refused) == NULL) fail_msg("%s", kept->last);
        }
}

#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_process_reads_what_this_one_reads),
        cmocka_unit_test(test_a_missing_reader_is_an_error),
        cmocka_unit_test(test_a_host_without_descriptors_is_told),
        cmocka_unit_test(test_what_a_reader_sends_is_checked),
        cmocka_unit_test(test_hosts_may_ignore_their_children),
        cmocka_unit_test(test_children_of_a_host_stay_its_own),
        cmocka_unit_test(test_a_host_may_have_closed_its_standard_files),
        cmocka_unit_test(test_many_threads_may_read_models),
        cmocka_unit_test(test_the_reader_dies_with_its_parent),
        cmocka_unit_test(test_the_reader_is_confined),
        cmocka_unit_test(test_what_assimp_makes_up_is_told),
        cmocka_unit_test(test_more_memory_than_a_file_warrants),
        cmocka_unit_test(test_references_stay_in_the_folder),
#if defined(SYS_openat2) && defined(__linux__)
        cmocka_unit_test(test_references_stay_in_the_folder_on_old_kernels),
#endif
        cmocka_unit_test(test_links_and_pipes_are_no_way_out)
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder_tree);
}
