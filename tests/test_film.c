/* Films: that a decoder finds every picture again, for as long as it was meant to be seen; and what is refused. */
#define _GNU_SOURCE
#include "scene_help.h"

#include <fcntl.h>
#include <math.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <signal.h>
#include <unistd.h>

#if defined(NEBEL_HAVE_WEBP)
#include <webp/demux.h>
#endif

enum { WIDTH = 61, HEIGHT = 37, COUNT = 7 };

static char folder[] = "/tmp/nebel_film_XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[4][200];
    static int next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
    return path[next];
}

/* Something that moves, with slow gradients. */
static nebel_image make_picture(int number)
{
    static const char *const names[] = {"R", "G", "B"};
    nebel_image image = {WIDTH, HEIGHT, 3, names, malloc(sizeof(float) * WIDTH * HEIGHT * 3)};
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
        const int x = i / 3 % WIDTH, y = i / 3 / WIDTH;
        image.samples[i] = .5f + .4f * sinf((float)(x + 9 * number) * .1f) * cosf((float)y * .07f + (float)(i % 3));
    }
    return image;
}

static nebel_result make_film(const char *path, const nebel_movie_desc *desc, int count)
{
    nebel_movie *film = NULL;
    nebel_result result = nebel_create_movie(path, desc, &film);
    for (int i = 0; i < count && result == NEBEL_OK; i++) {
        const nebel_image image = make_picture(i);
        result = nebel_add_movie_frame(film, &image);
        free(image.samples);
    }
    if (result == NEBEL_OK) result = nebel_finish_movie(film);
    nebel_destroy_movie(film);
    return result;
}

static size_t file_count(void)
{
    char command[200];
    size_t count = 0;
    snprintf(command, sizeof command, "ls -A %s | wc -l", folder);
    FILE *pipe = popen(command, "r");
    assert_int_equal(fscanf(pipe, "%zu", &count), 1);
    pclose(pipe);
    return count;
}

#if defined(NEBEL_HAVE_WEBP)

static WebPData read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    unsigned char *bytes = malloc(1 << 20);
    const size_t size = fread(bytes, 1, 1 << 20, file);
    fclose(file);
    return (WebPData){bytes, size};
}

/* The bytes that the picture has as a PNG, through nebel's own reader. */
static void read_as_png(int number, unsigned char *bytes)
{
    char path[200];
    const nebel_image image = make_picture(number);
    nebel_image back;
    snprintf(path, sizeof path, "%s/picture.png", folder);
    assert_int_equal(nebel_write_image(path, &(nebel_host){0}, &image), NEBEL_OK);
    assert_int_equal(nebel_read_image(path, &(nebel_host){0}, &back), NEBEL_OK);
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) bytes[i] = (unsigned char)lrintf(255 * back.samples[i]);
    nebel_free_image(&(nebel_host){0}, &back);
    free(image.samples);
    assert_int_equal(remove(path), 0);
}

/* The largest and the mean difference of all pictures' bytes from the PNG's; sees to count and times. */
static void compare_film(const char *path, int count, double rate, int *most, double *mean)
{
    WebPData file = read_file(path);
    WebPAnimDecoderOptions options;
    WebPAnimInfo info;
    assert_true(WebPAnimDecoderOptionsInit(&options));
    WebPAnimDecoder *decoder = WebPAnimDecoderNew(&file, &options);
    assert_non_null(decoder);
    assert_true(WebPAnimDecoderGetInfo(decoder, &info));
    assert_int_equal(info.canvas_width, WIDTH);
    assert_int_equal(info.canvas_height, HEIGHT);
    assert_int_equal(info.frame_count, count);
    assert_int_equal(info.loop_count, 0);
    *most = 0;
    *mean = 0;
    for (int i = 0; i < count; i++) {
        unsigned char wanted[WIDTH * HEIGHT * 3];
        uint8_t *pixels;
        int end;
        assert_true(WebPAnimDecoderGetNext(decoder, &pixels, &end));
        assert_int_equal(end, (int)floor(1000 * (i + 1) / rate + .5));
        read_as_png(i, wanted);
        for (int k = 0; k < WIDTH * HEIGHT * 3; k++) {
            const int off = abs(wanted[k] - pixels[k / 3 * 4 + k % 3]);
            *most = off > *most ? off : *most;
            *mean += off / (double)(WIDTH * HEIGHT * 3 * count);
        }
    }
    assert_false(WebPAnimDecoderHasMoreFrames(decoder));
    WebPAnimDecoderDelete(decoder);
    WebPDataClear(&file);
}

static void every_picture_is_there_without_loss(void **test)
{
    int most;
    double mean;
    const char *path = in_folder("film.webp");
    (void)test;
    assert_int_equal(make_film(path, &(nebel_movie_desc){.frames_per_second = 30, .quality = 100}, COUNT), NEBEL_OK);
    compare_film(path, COUNT, 30, &most, &mean);
    assert_int_equal(most, 0);
    assert_int_equal(file_count(), 1);
    assert_int_equal(remove(path), 0);
}

static void quality_is_bytes(void **test)
{
    int most;
    double rough, fine;
    struct stat small, large;
    const char *path = in_folder("film.WebP");
    (void)test;
    assert_int_equal(make_film(path, &(nebel_movie_desc){.quality = 10}, COUNT), NEBEL_OK);
    assert_int_equal(stat(path, &small), 0);
    compare_film(path, COUNT, 24, &most, &rough);
    assert_int_equal(make_film(path, &(nebel_movie_desc){0}, COUNT), NEBEL_OK);
    assert_int_equal(stat(path, &large), 0);
    compare_film(path, COUNT, 24, &most, &fine);
    assert_true(small.st_size < large.st_size);
    assert_true(fine < rough && fine < 2 && rough < 10);
    assert_int_equal(remove(path), 0);
}

static void one_picture_is_a_film(void **test)
{
    const char *path = in_folder("one.webp");
    (void)test;
    assert_int_equal(make_film(path, &(nebel_movie_desc){.quality = 100}, 1), NEBEL_OK);
    WebPData file = read_file(path);
    int width, height;
    unsigned char wanted[WIDTH * HEIGHT * 3];
    uint8_t *pixels = WebPDecodeRGB(file.bytes, file.size, &width, &height);
    assert_non_null(pixels);
    assert_int_equal(width, WIDTH);
    read_as_png(0, wanted);
    assert_memory_equal(pixels, wanted, sizeof wanted);
    WebPFree(pixels);
    WebPDataClear(&file);
    assert_int_equal(remove(path), 0);
}

static void nothing_is_left_of_what_was_given_up(void **test)
{
    nebel_movie *film;
    journal kept = {0};
    const nebel_image image = make_picture(0);
    const nebel_movie_desc desc = {.host.log = {remember, &kept}};
    (void)test;
    assert_int_equal(nebel_create_movie(in_folder("film.webp"), &desc, &film), NEBEL_OK);
    assert_int_equal(nebel_finish_movie(film), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(kept.last, "has no pictures"));
    assert_int_equal(nebel_add_movie_frame(film, &image), NEBEL_OK);
    nebel_image other = image;
    other.width = WIDTH - 1;
    assert_int_equal(nebel_add_movie_frame(film, &other), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(kept.last, "a picture of 60 x 37 pixels; those before it have 61 x 37"));
    nebel_destroy_movie(film);
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

/* The file that is there stays. */
static void full_disks_leave_the_old_file(void **test)
{
    journal kept = {0};
    struct stat before, after;
    const char *path = in_folder("film.webp");
    const nebel_movie_desc desc = {.host.log = {remember, &kept}, .quality = 100};
    struct rlimit all, little = {.rlim_cur = 500};
    (void)test;
    assert_int_equal(make_film(path, &desc, 2), NEBEL_OK);
    assert_int_equal(stat(path, &before), 0);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &all), 0);
    little.rlim_max = all.rlim_max;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &little), 0);
    const nebel_result result = make_film(path, &desc, COUNT);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &all), 0);
    assert_int_equal(result, NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "cannot write"));
    assert_int_equal(stat(path, &after), 0);
    assert_true(before.st_size == after.st_size && before.st_ino == after.st_ino);
    assert_int_equal(file_count(), 1);
    assert_int_equal(remove(path), 0);
}

/* By a link, which has the name of a film. */
static void streams_that_take_nothing_stop_it_at_once(void **test)
{
    static const char *const names[] = {"R", "G", "B"};
    static float black[3];
    journal kept = {0};
    nebel_movie *film;
    int ends[2];
    char name[40];
    const nebel_image image = {1, 1, 3, names, black};
    const nebel_movie_desc desc = {.host.log = {remember, &kept}};
    (void)test;
    assert_int_equal(pipe(ends), 0);
    snprintf(name, sizeof name, "/dev/fd/%d", ends[1]);
    assert_int_equal(symlink(name, in_folder("film.webp")), 0);
    assert_int_equal(nebel_create_movie(in_folder("film.webp"), &desc, &film), NEBEL_OK);
    assert_int_equal(nebel_add_movie_frame(film, &image), NEBEL_OK);
    close(ends[0]);
    assert_int_equal(nebel_add_movie_frame(film, &image), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "Broken pipe"));
    nebel_destroy_movie(film);
    close(ends[1]);
    const int full = open("/dev/full", O_WRONLY);
    assert_int_equal(dup2(full, ends[1]), ends[1]);
    assert_int_equal(nebel_create_movie(in_folder("film.webp"), &desc, &film), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "No space left"));
    close(ends[1]);
    close(full);
    assert_int_equal(remove(in_folder("film.webp")), 0);
}

static void sides_have_a_limit(void **test)
{
    static const char *const names[] = {"R", "G", "B"};
    journal kept = {0};
    meter m = {.fail_at = 1L << 40};
    nebel_movie *film;
    nebel_image wide = {16384, 1, 3, names, calloc(16384 * 3, sizeof(float))};
    const nebel_movie_desc desc = {
        .host = {.log = {remember, &kept}, .allocator = {metered_allocate, metered_release, &m}}};
    (void)test;
    assert_int_equal(nebel_create_movie(in_folder("film.webp"), &desc, &film), NEBEL_OK);
    assert_int_equal(nebel_add_movie_frame(film, &wide), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(kept.last, "at most 16383 x 16383"));
    wide.width = 100;
    m.fail_at = m.made + 1;
    assert_int_equal(nebel_add_movie_frame(film, &wide), NEBEL_ERROR_MEMORY);
    m.fail_at = 1L << 40;
    assert_int_equal(nebel_add_movie_frame(film, &wide), NEBEL_OK);
    nebel_destroy_movie(film);
    assert_int_equal(m.live, 0);
    free(wide.samples);
}

static void a_finished_film_takes_no_more(void **test)
{
    nebel_movie *film;
    journal kept = {0};
    const nebel_image image = make_picture(0);
    (void)test;
    assert_int_equal(
        nebel_create_movie(in_folder("film.webp"), &(nebel_movie_desc){.host.log = {remember, &kept}}, &film),
        NEBEL_OK);
    assert_int_equal(nebel_add_movie_frame(film, &image), NEBEL_OK);
    assert_int_equal(nebel_finish_movie(film), NEBEL_OK);
    assert_int_equal(nebel_add_movie_frame(film, &image), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(kept.last, "the film is finished already"));
    nebel_destroy_movie(film);
    assert_int_equal(remove(in_folder("film.webp")), 0);
    free(image.samples);
}

static void refusals_say_why(void **test)
{
    journal kept;
    static const struct {
        const char *name;
        double rate;
        int quality;
        nebel_result result;
        const char *words;
    } cases[] = {
        {"film.gif", 0, 0, NEBEL_ERROR_FORMAT, "must end in .webp"},
        {"none/film.webp", 0, 0, NEBEL_ERROR_FILE, "there is no folder"},
        {"film.webp", .5, 0, NEBEL_ERROR_VALUE, "0.5 pictures a second; must be 1 to 100"},
        {"film.webp", 101, 0, NEBEL_ERROR_VALUE, "101 pictures"},
        {"film.webp", 24, 101, NEBEL_ERROR_VALUE, "a quality of 101"},
    };
    (void)test;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        nebel_movie *film = (nebel_movie *)&kept;
        kept = (journal){0};
        const nebel_movie_desc desc = {
            .host.log = {remember, &kept}, .frames_per_second = cases[i].rate, .quality = cases[i].quality};
        assert_int_equal(nebel_create_movie(in_folder(cases[i].name), &desc, &film), cases[i].result);
        assert_null(film);
        if (strstr(kept.last, cases[i].words) == NULL) fail_msg("case %zu says: %s", i, kept.last);
    }
    assert_int_equal(file_count(), 0);
}

#else

static void builds_without_webp_say_so(void **test)
{
    journal kept = {0};
    nebel_movie *film;
    (void)test;
    assert_non_null(strstr(nebel_scene_libraries(), "no WebP"));
    assert_int_equal(make_film(in_folder("a.webp"), &(nebel_movie_desc){0}, COUNT), NEBEL_ERROR_UNSUPPORTED);
    const nebel_movie_desc desc = {.host.log = {remember, &kept}};
    assert_int_equal(nebel_create_movie(in_folder("a.webp"), &desc, &film), NEBEL_ERROR_UNSUPPORTED);
    assert_non_null(strstr(kept.last, "build it with libwebp"));
    assert_int_equal(file_count(), 0);
}

#endif

static int open_folder(void **test)
{
    (void)test;
    return mkdtemp(folder) == NULL;
}

static int close_folder(void **test)
{
    (void)test;
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
#if defined(NEBEL_HAVE_WEBP)
        cmocka_unit_test(every_picture_is_there_without_loss),
        cmocka_unit_test(quality_is_bytes),
        cmocka_unit_test(one_picture_is_a_film),
        cmocka_unit_test(nothing_is_left_of_what_was_given_up),
        cmocka_unit_test(full_disks_leave_the_old_file),
        cmocka_unit_test(streams_that_take_nothing_stop_it_at_once),
        cmocka_unit_test(sides_have_a_limit),
        cmocka_unit_test(a_finished_film_takes_no_more),
        cmocka_unit_test(refusals_say_why),
#else
        cmocka_unit_test(builds_without_webp_say_so),
#endif
    };
    return cmocka_run_group_tests(tests, open_folder, close_folder);
}
