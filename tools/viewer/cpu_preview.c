#include "cpu_preview.h"

#include <nebel/render.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <threads.h>
#include <time.h>

/* The first picture has one pixel of so many either way; each that follows has half. */
enum { COARSEST = 8 };

struct nb_cpu_preview {
    nebel_scene_data scene; /* of the thread, with the light of the wish */
    thrd_t thread;
    mtx_t lock; /* of all that follows */
    cnd_t news, rest;
    nb_preview_request wish;
    int is_asked, is_ended, is_working, is_fresh, must_rest;
    nb_preview_image made, taken;
};

/* ---- the thread
 * ------------------------------------------------------------------------------------------------------
 */

typedef struct nb_preview_work {
    nb_cpu_preview *twin;
    nebel_renderer *renderer;
    nb_preview_request wish;
    int may_stop;
} nb_preview_work;

static int is_out_of_date(nb_cpu_preview *twin)
{
    mtx_lock(&twin->lock);
    const int is = twin->is_asked || twin->is_ended || twin->must_rest;
    mtx_unlock(&twin->lock);
    return is;
}

static int stop(size_t done, size_t total, void *user)
{
    const nb_preview_work *const w = user;
    (void)done, (void)total;
    return w->may_stop && is_out_of_date(w->twin);
}

static nebel_result render(nb_preview_work *w, const nb_preview_image *picture)
{
    const size_t pixels = (size_t)picture->width * picture->height;
    const nebel_frame_desc desc = {.camera = w->wish.camera,
                                   .width = picture->width,
                                   .height = picture->height,
                                   .samples = 1,
                                   .progress = stop,
                                   .progress_user = w,
                                   .time = w->wish.frame};
    nebel_frame frame = {.color = NULL};
    float **const planes[NB_LOOK_PLANES] = {&frame.color, &frame.transmittance, &frame.in_scattering, &frame.depth};
    *planes[w->wish.plane] = picture->rgb;
    const nebel_result result = nebel_render_frame(w->renderer, &desc, &frame);
    if (result != NEBEL_OK || w->wish.plane != NB_LOOK_DEPTH) return result;
    for (size_t i = pixels; i-- > 0;) {
        const float depth = picture->rgb[i] < 1e18f ? picture->rgb[i] : 1e18f;
        for (size_t c = 0; c < 3; c++) picture->rgb[3 * i + c] = depth;
    }
    return NEBEL_OK;
}

static double now(void)
{
    struct timespec time;
    timespec_get(&time, TIME_UTC);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void publish(nb_cpu_preview *twin, nb_preview_image picture)
{
    mtx_lock(&twin->lock);
    free(twin->made.rgb);
    twin->made = picture;
    twin->is_fresh = 1;
    mtx_unlock(&twin->lock);
}

/* Nonzero: go on with the next one. */
static int make_picture(nb_preview_work *w, uint32_t by)
{
    nb_preview_image picture = {(w->wish.width + by - 1) / by, (w->wish.height + by - 1) / by, NULL, 0};
    const double start = now();
    picture.rgb = malloc(sizeof(float[3]) * picture.width * picture.height);
    if (picture.rgb == NULL) return 0;
    w->may_stop = by < COARSEST;
    if (render(w, &picture) != NEBEL_OK) {
        free(picture.rgb);
        return 0;
    }
    picture.seconds = now() - start;
    publish(w->twin, picture);
    return !is_out_of_date(w->twin);
}

/* The light goes over here, where no frame is under way. */
static void take_light(nebel_scene_data *scene, const nb_preview_request *wish)
{
    const nebel_scene_data *const light = &wish->light;
    scene->lights = wish->lights;
    scene->light_count = light->light_count;
    memcpy(scene->background, light->background, sizeof scene->background);
    memcpy(scene->ambient, light->ambient, sizeof scene->ambient);
    scene->environment = light->environment;
    scene->shows_ambient = light->shows_ambient;
    scene->has_sun = light->has_sun;
    memcpy(scene->sun_direction, light->sun_direction, sizeof scene->sun_direction);
    memcpy(scene->sun_irradiance, light->sun_irradiance, sizeof scene->sun_irradiance);
}

static nebel_result set_method(nb_preview_work *w)
{
    const nb_preview_request *const wish = &w->wish;
    const nebel_cell_stage stage = wish->method == NEBEL_METHOD_CELLS ? NEBEL_CELLS_PER_VERTEX : NEBEL_CELLS_PER_PIXEL;
    const nebel_result result = nebel_set_renderer_cells(w->renderer, wish->cells, stage);
    if (result != NEBEL_OK || wish->cells != NULL) return result;
    return nebel_set_renderer_method(w->renderer, wish->method, &(nebel_method_desc){.factor = &wish->factor});
}

static nebel_result prepare(nb_preview_work *w)
{
    nb_cpu_preview *const twin = w->twin;
    const nebel_cpu_renderer_desc desc = {.thread_count = 0};
    take_light(&twin->scene, &w->wish);
    const nebel_result result = w->renderer != NULL
                                    ? nebel_set_renderer_lighting(w->renderer, w->wish.fog)
                                    : nebel_create_cpu_renderer(&twin->scene, w->wish.fog, &desc, &w->renderer);
    return result == NEBEL_OK ? set_method(w) : result;
}

static void forget(nb_preview_request *wish)
{
    nebel_release_lighting(wish->fog);
    nebel_destroy_cells(wish->cells);
    free(wish->lights);
    wish->fog = NULL;
    wish->cells = NULL;
    wish->lights = NULL;
}

/* Waits for a wish; 0 at the end. */
static int take_wish(nb_preview_work *w)
{
    nb_cpu_preview *const twin = w->twin;
    mtx_lock(&twin->lock);
    twin->is_working = 0;
    cnd_signal(&twin->rest);
    while (!twin->is_asked && !twin->is_ended) cnd_wait(&twin->news, &twin->lock);
    const int goes_on = !twin->is_ended;
    if (goes_on) {
        w->wish = twin->wish;
        twin->wish.fog = NULL;
        twin->wish.cells = NULL;
        twin->wish.lights = NULL;
        twin->is_asked = 0;
        twin->is_working = 1;
    }
    mtx_unlock(&twin->lock);
    return goes_on;
}

static int run(void *user)
{
    nb_preview_work w = {.twin = user};
    while (take_wish(&w)) {
        uint32_t by = COARSEST;
        if (prepare(&w) == NEBEL_OK) {
            while (make_picture(&w, by) && by > 1) by /= 2;
        }
        /* The renderer looks neither at cells nor at point lights between frames. */
        forget(&w.wish);
    }
    nebel_destroy_renderer(w.renderer);
    return 0;
}

/* ---- the window's side
 * ------------------------------------------------------------------------------------------------
 */

static int start(nb_cpu_preview *twin)
{
    if (mtx_init(&twin->lock, mtx_plain) != thrd_success) return -1;
    if (cnd_init(&twin->news) == thrd_success) {
        if (cnd_init(&twin->rest) == thrd_success) {
            if (thrd_create(&twin->thread, run, twin) == thrd_success) return 0;
            cnd_destroy(&twin->rest);
        }
        cnd_destroy(&twin->news);
    }
    mtx_destroy(&twin->lock);
    return -1;
}

nb_cpu_preview *nb_cpu_preview_open(const nebel_scene_data *scene)
{
    nb_cpu_preview *const twin = calloc(1, sizeof *twin);
    if (twin == NULL) return NULL;
    twin->scene = *scene;
    if (start(twin) == 0) return twin;
    free(twin);
    return NULL;
}

void nb_cpu_preview_close(nb_cpu_preview *twin)
{
    if (twin == NULL) return;
    mtx_lock(&twin->lock);
    twin->is_ended = 1;
    cnd_signal(&twin->news);
    mtx_unlock(&twin->lock);
    (void)thrd_join(twin->thread, NULL);
    forget(&twin->wish);
    cnd_destroy(&twin->rest);
    cnd_destroy(&twin->news);
    mtx_destroy(&twin->lock);
    free(twin->made.rgb);
    free(twin->taken.rgb);
    free(twin);
}

void nb_cpu_preview_rest(nb_cpu_preview *twin)
{
    if (twin == NULL) return;
    mtx_lock(&twin->lock);
    twin->is_asked = 0;
    twin->must_rest = 1;
    while (twin->is_working) cnd_wait(&twin->rest, &twin->lock);
    twin->must_rest = 0;
    mtx_unlock(&twin->lock);
}

void nb_cpu_preview_ask(nb_cpu_preview *twin, const nb_preview_request *wish)
{
    nebel_lighting *const fog = nebel_retain_lighting(wish->fog);
    mtx_lock(&twin->lock);
    nb_preview_request before = twin->wish;
    twin->wish = *wish;
    twin->wish.fog = fog;
    twin->is_asked = 1;
    cnd_signal(&twin->news);
    mtx_unlock(&twin->lock);
    forget(&before);
}

int nb_cpu_preview_take(nb_cpu_preview *twin, nb_preview_image *picture)
{
    mtx_lock(&twin->lock);
    const int is_fresh = twin->is_fresh;
    if (is_fresh) {
        free(twin->taken.rgb);
        twin->taken = twin->made;
        twin->made.rgb = NULL;
        twin->is_fresh = 0;
    }
    mtx_unlock(&twin->lock);
    *picture = twin->taken;
    return is_fresh;
}

int nb_cpu_preview_is_done(nb_cpu_preview *twin)
{
    mtx_lock(&twin->lock);
    const int is = !twin->is_asked && !twin->is_working && !twin->is_fresh;
    mtx_unlock(&twin->lock);
    return is;
}
