#define _POSIX_C_SOURCE 200809L

#include "view.h"

#include "../interrupt.h"
#include "../report.h"
#include "draft.h"
#include "hands.h"
#include "navigate.h"
#include "panel.h"
#include "picture.h"
#include "screen.h"
#include "stage.h"
#include "twin.h"
#include "watch.h"
#include "window.h"

#include <stdio.h>
#include <string.h>

/* How long after the last movement the picture waits before it becomes whole [s]. */
static const double rest = 0.15;

typedef struct viewer {
    const nb_view_settings *settings;
    nb_window window;
    nb_draft draft;
    nb_stage stage;
    nb_screen screen;
    nb_twin *twin; /* NULL: nobody has asked for it yet */
    int twin_is_stale, has_cpu;
    nb_watch watch;
    nb_hands hands;
    nb_panel panel;
    nb_look look;
    nebel_camera home;
    nebel_log log;
    char message[512]; /* the last one, for the window */
    double moved;      /* when something changed last [s] */
    double frame;
    int wants_picture, wants_window_picture;
} viewer;

/* ---- messages
 * --------------------------------------------------------------------------------------------------------
 */

/* Where the fine picture was given up the library says "stopped", which is no news. */
static void listen(nebel_result result, const char *message, void *user)
{
    viewer *const all = user;
    if (result == NEBEL_ERROR_LIMIT && all->stage.was_stopped) return;
    (void)snprintf(all->message, sizeof all->message, "%s", message);
    nb_report_message("%s", message);
}

static int fail(viewer *all, nebel_result result)
{
    if (all->message[0] == '\0') return nb_report_failure("view: %s", nebel_result_text(result));
    return NB_FAILED;
}

/* ---- open and close
 * --------------------------------------------------------------------------------------------------
 */

static int is_needed(void *user)
{
    viewer *const all = user;
    nb_window_poll(&all->window);
    return nb_window_has_news(&all->window);
}

static void set_home(viewer *all)
{
    nebel_camera *const camera = &all->draft.data.camera;
    if (camera->projection == NEBEL_PROJECTION_PANORAMA) {
        camera->projection = NEBEL_PROJECTION_PERSPECTIVE;
        camera->vertical_fov = 75;
        (void)snprintf(all->message, sizeof all->message, "The scene's camera is a panorama; this is a part of it.");
    }
    all->home = *camera;
}

static nebel_result open_stage(viewer *all)
{
    all->stage = (nb_stage){.is_needed = is_needed, .user = all};
    return nb_stage_open(&all->draft.data, all->draft.snapshot, &all->log, &all->stage);
}

static int open_viewer(viewer *all)
{
    const nb_view_settings *const settings = all->settings;
    nb_watch_take(&all->watch, settings->scene);
    nebel_result result = nb_draft_open(settings->scene, settings->frame, &all->log, &all->draft);
    if (result != NEBEL_OK) return fail(all, result);
    set_home(all);
    if (nb_window_open(&all->window, settings->scene, settings->width, settings->height) != NB_DONE) return NB_FAILED;
    result = nb_screen_open(&all->log, &all->screen);
    if (result == NEBEL_OK) result = open_stage(all);
    if (result != NEBEL_OK) return fail(all, result);
    if (nb_panel_open(all->window.handle) != 0) return nb_report_failure("view: memory is out");
    all->window.has_panel = 1;
    return NB_DONE;
}

static void close_viewer(viewer *all)
{
    nb_twin_close(all->twin);
    if (all->window.has_panel) nb_panel_close();
    nb_stage_close(&all->stage);
    nb_screen_close(&all->screen);
    nb_window_close(&all->window);
    nb_draft_close(&all->draft);
}

/* ---- changes
 * ---------------------------------------------------------------------------------------------------------
 */

static void note_change(viewer *all)
{
    all->moved = all->window.time;
    all->twin_is_stale = 1;
    if (all->stage.state > NB_STAGE_COARSE) all->stage.state = NB_STAGE_COARSE;
}

static int is_moving(const viewer *all)
{
    return all->settings->screenshot == NULL && all->window.time - all->moved < rest;
}

static void say(viewer *all, const char *words)
{
    (void)snprintf(all->message, sizeof all->message, "%s", words);
}

/* What the fog does not take is undone and said; memory that is out ends the program. */
static nebel_result use_fog(viewer *all, nebel_result committed)
{
    if (committed == NEBEL_ERROR_MEMORY) return committed;
    note_change(all);
    return nebel_set_gl_renderer_fog(all->stage.renderer, all->draft.snapshot);
}

static nebel_result commit(viewer *all)
{
    say(all, "");
    return use_fog(all, nb_draft_commit(&all->draft));
}

static int is_same_camera(const nebel_camera *a, const nebel_camera *b)
{
    const size_t size = sizeof a->position;
    return memcmp(a->position, b->position, size) == 0 && memcmp(a->look_at, b->look_at, size) == 0 &&
           memcmp(a->up, b->up, size) == 0 && a->vertical_fov == b->vertical_fov && a->view_height == b->view_height &&
           a->projection == b->projection;
}

/* The view stays where somebody has moved it, unless the file has another camera now. */
static nebel_result read_again(viewer *all)
{
    nb_draft fresh;
    const nebel_camera view = all->draft.data.camera, before = nebel_scene_contents(all->draft.scene)->camera;
    say(all, "");
    nb_watch_take(&all->watch, all->settings->scene);
    all->panel.file_is_newer = 0;
    if (nb_draft_open(all->settings->scene, all->draft.frame, &all->log, &fresh) != NEBEL_OK) return NEBEL_OK;
    nb_twin_close(all->twin);
    all->twin = NULL;
    nb_stage_close(&all->stage);
    nb_draft_close(&all->draft);
    all->draft = fresh;
    set_home(all);
    if (is_same_camera(&before, &nebel_scene_contents(fresh.scene)->camera)) all->draft.data.camera = view;
    note_change(all);
    nb_report_message("view: read %s again", all->settings->scene);
    return open_stage(all);
}

static nebel_result watch_file(viewer *all)
{
    if (!nb_watch_is_changed(&all->watch, all->settings->scene)) return NEBEL_OK;
    if (!nb_draft_is_changed(&all->draft)) return read_again(all);
    all->panel.file_is_newer = 1;
    return NEBEL_OK;
}

static void save(viewer *all)
{
    const char *const path = all->settings->scene;
    const int was_newer = all->panel.file_is_newer;
    say(all, "");
    if (nb_draft_save(&all->draft, path, all->panel.saves_camera) != NEBEL_OK) return;
    if (!was_newer) nb_watch_take(&all->watch, path); /* otherwise what else has changed there is read, too */
    all->panel.file_is_newer = 0;
    say(all, "Saved.");
    nb_report_message("view: saved %s", path);
}

/* ---- one turn
 * --------------------------------------------------------------------------------------------------------
 */

static void obey_keys(viewer *all)
{
    const nb_hands *const hands = &all->hands;
    if (hands->moved_camera) note_change(all);
    if (hands->wants_home) {
        all->draft.data.camera = all->home;
        note_change(all);
    }
    if (hands->wants_help) all->panel.help_shown = !all->panel.help_shown;
    if (hands->wants_panel) all->panel.shown = !all->panel.shown;
    if (hands->changed_look) note_change(all);
    if (hands->wants_save) save(all);
    all->wants_picture |= hands->wants_picture;
    all->wants_window_picture |= hands->wants_window_picture;
    if (hands->wants_end) nb_window_end(&all->window);
}

static nebel_result obey_panel(viewer *all)
{
    const nb_panel *const panel = &all->panel;
    if (panel->wants_home) all->draft.data.camera = all->home;
    if (panel->camera_changed || panel->light_changed || panel->wants_home || panel->look_changed) note_change(all);
    if (panel->wants_save) save(all);
    if (panel->wants_reload || all->hands.wants_reload) return read_again(all);
    if (panel->frame_changed) return use_fog(all, nb_draft_set_frame(&all->draft, all->frame));
    return panel->fog_changed || panel->light_changed ? commit(all) : NEBEL_OK;
}

static void fill_panel(viewer *all)
{
    static const char *const states[] = {"", "moving: fewer pixels", "refining", "complete"};
    nb_panel *const panel = &all->panel;
    const nebel_scene_data *const data = &all->draft.data;
    panel->scene = all->settings->scene;
    panel->driver = all->window.driver;
    panel->source = all->draft.scene;
    panel->data = &all->draft.data;
    panel->volumes = all->draft.volumes;
    panel->look = &all->look;
    all->frame = all->draft.frame;
    panel->frame = &all->frame;
    panel->camera_is_keyed = !nb_draft_can_save_camera(&all->draft);
    panel->moves = data->moving_volume_count > 0 || data->camera_key_count > 0 || data->turntable_frames > 0;
    panel->is_changed = nb_draft_is_changed(&all->draft);
    panel->message = all->message;
    panel->picture = states[all->stage.state];
    panel->seconds = all->stage.seconds;
}

/* ---- the CPU's picture
 * ------------------------------------------------------------------------------------------------
 */

static void ask_twin(viewer *all)
{
    const nb_twin_wish wish = {.camera = all->draft.data.camera,
                               .width = all->window.width,
                               .height = all->window.height,
                               .plane = all->look.plane,
                               .light = all->draft.data,
                               .fog = all->draft.snapshot};
    if (all->twin == NULL) all->twin = nb_twin_open(&all->draft.data);
    if (all->twin == NULL) {
        say(all, "Memory or threads are out for the picture of the CPU.");
        return;
    }
    nb_twin_ask(all->twin, &wish);
    all->twin_is_stale = 0;
}

static void compare(viewer *all)
{
    nb_twin_picture picture;
    if (all->look.compare == NB_LOOK_GL_ALONE) return;
    if (all->twin_is_stale) ask_twin(all);
    if (all->twin == NULL || !nb_twin_take(all->twin, &picture)) return;
    nb_screen_set_cpu(&all->screen, picture.width, picture.height, picture.rgb);
    all->has_cpu = 1;
}

static int is_complete(const viewer *all)
{
    if (all->stage.state != NB_STAGE_FINE) return 0;
    return all->look.compare == NB_LOOK_GL_ALONE || all->twin == NULL ||
           (!all->twin_is_stale && nb_twin_is_done(all->twin));
}

/* ---- pictures
 * --------------------------------------------------------------------------------------------------------
 */

static void keep_picture(viewer *all)
{
    char name[32];
    if (nb_picture_name(name, sizeof name) != 0 ||
        nb_picture_write(name, all->window.width, all->window.height, &all->log) != NB_DONE)
        return;
    (void)snprintf(all->message, sizeof all->message, "Saved %s", name);
    nb_report_message("view: saved %s", name);
}

/* Pictures that were asked for are taken once they are complete: first without the controls, then with them. */
static int take_pictures(viewer *all, int with_controls)
{
    const char *const screenshot = all->settings->screenshot;
    int *const wanted = with_controls ? &all->wants_window_picture : &all->wants_picture;
    if (!is_complete(all)) return NB_DONE;
    if (screenshot != NULL && with_controls) {
        nb_window_end(&all->window);
        return nb_picture_write(screenshot, all->window.width, all->window.height, &all->log);
    }
    if (*wanted) keep_picture(all);
    *wanted = 0;
    return NB_DONE;
}

static int show(viewer *all)
{
    const nb_window *const window = &all->window;
    compare(all);
    nb_screen_draw(&all->screen, all->stage.texture, all->has_cpu, &all->look, window->width, window->height);
    int status = take_pictures(all, 0);
    fill_panel(all);
    nb_panel_draw(&all->panel, all->settings->controls);
    if (status == NB_DONE) status = take_pictures(all, 1);
    nb_window_show(&all->window);
    return status;
}

static int turn(viewer *all)
{
    nb_window *const window = &all->window;
    nb_window_wait(window, is_moving(all) || !is_complete(all) || nb_hands_are_busy(&all->hands));
    if (nb_window_is_lost(window)) {
        return nb_report_failure("view: the graphics driver was reset and its context is lost; start the viewer again");
    }
    if (window->width == 0 || window->height == 0) return NB_DONE;
    if (window->was_resized) note_change(all);
    nb_hands_move(&all->hands, window, &all->draft.data.camera, &all->look);
    obey_keys(all);
    nebel_result result = watch_file(all);
    if (result != NEBEL_OK) return fail(all, result);
    result =
        nb_stage_draw(&all->stage, &all->draft.data.camera, window->width, window->height, &all->look, is_moving(all));
    if (result != NEBEL_OK) return fail(all, result);
    const int status = show(all);
    const nebel_result obeyed = obey_panel(all);
    return obeyed == NEBEL_OK ? status : fail(all, obeyed);
}

int nb_view_run(const nb_view_settings *settings)
{
    viewer all = {.settings = settings,
                  .look = {.exposure = settings->exposure, .split = .5, .gain = 16, .range = 50, .samples = 4},
                  .panel = {.shown = 1}};
    all.log = (nebel_log){.write = listen, .user = &all};
    nb_interrupt_listen();
    int status = open_viewer(&all);
    all.look.range = status == NB_DONE ? nb_navigate_distance(&all.draft.data.camera) : 1;
    while (status == NB_DONE && !nb_window_is_ended(&all.window) && !nb_interrupt_is_requested()) status = turn(&all);
    close_viewer(&all);
    nb_interrupt_obey();
    return status;
}
