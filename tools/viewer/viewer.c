#define _POSIX_C_SOURCE 200809L

#include "viewer.h"

#include "../signals.h"
#include "../progress_bar.h"
#include "../messages.h"
#include "../output_check.h"
#include "document.h"
#include "input.h"
#include "camera_control.h"
#include "panel.h"
#include "screenshot.h"
#include "display_pass.h"
#include "gl_preview.h"
#include "cpu_preview.h"
#include "file_watch.h"
#include "window.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How long after the last movement the picture waits before it becomes whole [s]. */
static const double rest = 0.15;

/* The last one that keys and nebel render have; keys may be before 0, too. */
static const double last_frame = 1000000;

/* How long a message that is no fault is shown [s]. */
static const double message_seconds = 6;

typedef struct viewer {
    const nb_viewer_options *settings;
    nb_window window;
    nb_document draft;
    nb_gl_preview stage;
    nb_display_pass screen;
    nb_cpu_preview *twin; /* NULL: nobody has asked for it yet */
    int twin_is_stale, has_cpu;
    nb_file_watch watch;
    nb_input hands;
    nb_panel panel;
    nb_display look;
    nebel_camera home;
    nebel_log log;
    char message[512]; /* the last one, for the window */
    int is_fault;      /* it says what went wrong */
    char refusal[512]; /* what of the present frame OpenGL does not draw; "": it draws it */
    int is_asking;     /* whether OpenGL draws it */
    double said;       /* when it was said [s] */
    nebel_volume_origin *origins;
    size_t origin_count;
    double lost;        /* when the context was lost last [s] */
    double cpu_seconds; /* that its last picture took */
    double moved;       /* when something changed last [s] */
    double frame;       /* that the panel shows and changes */
    double clock;       /* frames, with their fractions, while time goes on */
    int was_playing;
    int blank_turns; /* so many without a picture: it takes long to come, and the window says so first */
    int wants_picture, wants_window_picture;
    int was_warned, has_changes; /* that changes are lost if the window is left; that the draft has not taken yet */
    double placing_seconds;      /* that models took to be loaded last */
} viewer;

/* ---- messages
 * --------------------------------------------------------------------------------------------------------
 */

/* Where the fine picture was given up the library says "stopped", which is no news, nor is it that the CPU has to draw. */
static void listen(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    viewer *const all = user;
    if (result == NEBEL_ERROR_CANCELLED && all->stage.was_stopped) return;
    if (result == NEBEL_ERROR_UNSUPPORTED && all->is_asking) {
        (void)snprintf(all->refusal, sizeof all->refusal, "%s", message);
        return;
    }
    (void)snprintf(all->message, sizeof all->message, "%s", message);
    all->is_fault = level == NEBEL_LOG_ERROR;
    nb_report_message("%s", message);
}

static void say(viewer *all, const char *words)
{
    (void)snprintf(all->message, sizeof all->message, "%s", words);
    all->is_fault = 0;
    all->said = all->window.time;
}

/* What went well need not stand there for long. */
static void let_message_fade(viewer *all)
{
    if (!all->is_fault && all->window.time - all->said > message_seconds) all->message[0] = '\0';
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
    all->home = all->draft.data.camera;
}

/* The draft's fog to the renderer, particles in the way that is wished for. */
static nebel_result set_fog(viewer *all)
{
    nb_document *const draft = &all->draft;
    nebel_lighting *fog = draft->volumes;
    const int is_whole = all->look.particles == NB_LOOK_AS_FOG;
    nebel_result result = is_whole ? nb_document_whole(draft, &fog) : NEBEL_OK;
    if (result == NEBEL_OK) result = nebel_set_gl_renderer_lighting(all->stage.renderer, fog);
    if (result != NEBEL_OK) return result;
    return nebel_set_gl_renderer_particles(all->stage.renderer, draft->particles, is_whole ? 0 : draft->particle_count);
}

static nebel_result open_stage(viewer *all)
{
    all->stage = (nb_gl_preview){.is_needed = is_needed, .user = all};
    const nebel_result result = nb_gl_preview_open(&all->draft.data, &all->log, &all->stage);
    return result == NEBEL_OK ? set_fog(all) : result;
}

static void watch_files(viewer *all)
{
    nb_watch_open(&all->watch, all->settings->scene, all->draft.data.paths, all->draft.data.path_count);
}

/* All that a context of OpenGL has. */
static int open_window(viewer *all, uint32_t width, uint32_t height)
{
    const nb_viewer_options *const settings = all->settings;
    nb_window *const window = &all->window;
    if (nb_window_open(window, settings->scene, width, height) != NB_DONE) return NB_FAILED;
    /* Who reads where the controls are waits for them. */
    if (settings->controls != NULL) window->patience = 0.02;
    nebel_result result = nb_screen_open(&all->log, &all->screen);
    if (result == NEBEL_OK) result = open_stage(all);
    if (result != NEBEL_OK) return fail(all, result);
    if (nb_panel_open(window->handle, settings->scale > 0 ? settings->scale : window->scale) != 0)
        return nb_report_failure("view: out of memory");
    window->has_panel = 1;
    return NB_DONE;
}

static void close_window(viewer *all)
{
    if (all->window.has_panel) nb_panel_close();
    nb_gl_preview_close(&all->stage);
    nb_screen_close(&all->screen);
    nb_window_close(&all->window);
    all->window.has_panel = 0;
}

static int open_viewer(viewer *all)
{
    const nb_viewer_options *const settings = all->settings;
    const nebel_result result = nb_document_open(settings->scene, settings->frame, &all->log, &all->draft);
    if (result != NEBEL_OK) return fail(all, result);
    if (nb_target_check_window(settings->screenshot, settings->controls, settings->scene, &all->draft.data) != NB_DONE)
        return NB_FAILED;
    watch_files(all);
    set_home(all);
    return open_window(all, settings->width, settings->height);
}

static void close_viewer(viewer *all)
{
    nb_cpu_preview_close(all->twin);
    close_window(all);
    nb_watch_close(&all->watch);
    nb_document_close(&all->draft);
    free(all->origins);
}

/* ---- methods
 * ---------------------------------------------------------------------------------------------------------
 */

static int is_of_cells(nebel_method method)
{
    return method == NEBEL_METHOD_CELLS || method == NEBEL_METHOD_CELLS_PIXEL;
}

static int has_factor(nebel_method method)
{
    return method == NEBEL_METHOD_LINEAR || method == NEBEL_METHOD_EXP || method == NEBEL_METHOD_EXP2;
}

/* A method whose section has gone is none any longer. */
static void check_method(viewer *all)
{
    const nb_document_state *const good = &all->draft.good;
    const nebel_method method = all->look.method;
    if ((is_of_cells(method) && good->cells == NULL) || (has_factor(method) && !good->has_classic))
        all->look.method = NEBEL_METHOD_EXACT;
}

/* What OpenGL does not draw. */
static const char *explain_method(const viewer *all)
{
    if (all->look.method == NEBEL_METHOD_CELLS_PIXEL) return "drawn by the CPU alone";
    return all->refusal[0] != '\0' ? "drawn by the CPU alone" : "";
}

/* What can be shown of what is wished for. */
static nb_display shown_look(const viewer *all)
{
    nb_display look = all->look;
    if (explain_method(all)[0] == '\0') return look;
    look.method = NEBEL_METHOD_EXACT;
    look.compare = NB_LOOK_CPU_ALONE;
    return look;
}

/* ---- changes
 * ---------------------------------------------------------------------------------------------------------
 */

static void note_change(viewer *all)
{
    all->moved = all->window.time;
    all->was_warned = 0;
    all->twin_is_stale = 1;
    if (all->stage.state > NB_STAGE_COARSE) all->stage.state = NB_STAGE_COARSE;
}

static int is_moving(const viewer *all)
{
    return all->settings->screenshot == NULL && (all->panel.plays || all->window.time - all->moved < rest);
}

/* What ends the program: memory that is out, and a context that draws nothing any longer. All else is said, and
 * something can be done about it. */
static nebel_result forgive(nebel_result result)
{
    return result == NEBEL_ERROR_MEMORY || result == NEBEL_ERROR_UNSUPPORTED ? result : NEBEL_OK;
}

/* A stage with the draft's scene in the place of ours, which stays where that fails. */
static nebel_result renew_stage(viewer *all)
{
    nb_gl_preview old = all->stage;
    const nebel_result result = open_stage(all);
    if (result != NEBEL_OK) {
        nb_gl_preview_close(&all->stage);
        all->stage = old;
        return result;
    }
    nb_gl_preview_close(&old);
    return NEBEL_OK;
}

/* Models that take longer to be loaded follow once the control is let go [s]. Renderers cannot be told of them. */
static const double quick_placing = 0.1;

static nebel_result renew_renderers(viewer *all)
{
    nb_document *const draft = &all->draft;
    const int waits = all->panel.is_held && all->placing_seconds > quick_placing;
    if (!draft->planets_are_new && (!draft->models_are_stale || waits)) return NEBEL_OK;
    const double start = nb_window_now();
    nb_cpu_preview_close(all->twin);
    all->twin = NULL;
    nebel_result result = draft->models_are_stale ? nb_document_place_models(draft) : NEBEL_OK;
    if (result == NEBEL_OK) result = renew_stage(all);
    draft->planets_are_new = 0;
    all->placing_seconds = nb_window_now() - start;
    note_change(all);
    return forgive(result);
}

/* What the fog does not take is undone and said. */
static nebel_result use_fog(viewer *all, nebel_result committed)
{
    if (forgive(committed) != NEBEL_OK) return committed;
    note_change(all);
    check_method(all);
    const nebel_result result = forgive(set_fog(all));
    return result == NEBEL_OK ? renew_renderers(all) : result;
}

/* It reads the air and the sky of a planet, which other numbers make anew. */
static void rest_twin(viewer *all)
{
    if (all->draft.data.planet_count == 0) return;
    nb_cpu_preview_rest(all->twin);
    all->twin_is_stale = 1;
}

static nebel_result set_frame(viewer *all, double frame)
{
    rest_twin(all);
    return use_fog(all, nb_document_set_frame(&all->draft, frame));
}

/* Air is slow to be made: other planets come once the control is let go. */
static int must_wait(const viewer *all)
{
    const nb_document *const draft = &all->draft;
    return all->panel.is_held && !nb_document_state_has_same_planets(&draft->now, &draft->good);
}

static nebel_result commit(viewer *all)
{
    all->has_changes = 0;
    say(all, "");
    rest_twin(all);
    return use_fog(all, nb_document_commit(&all->draft));
}

static nebel_result step(viewer *all, int back)
{
    nebel_result result = NEBEL_OK;
    rest_twin(all);
    if (!(back ? nb_document_undo(&all->draft, &result) : nb_document_redo(&all->draft, &result))) return NEBEL_OK;
    say(all, "");
    return use_fog(all, result);
}

static int is_same_camera(const nebel_camera *a, const nebel_camera *b)
{
    const size_t size = sizeof a->position;
    return memcmp(a->position, b->position, size) == 0 && memcmp(a->look_at, b->look_at, size) == 0 &&
           memcmp(a->up, b->up, size) == 0 && a->vertical_fov == b->vertical_fov && a->view_height == b->view_height &&
           a->projection == b->projection;
}

/* The fresh draft in the place of ours, unless it cannot be drawn. */
static nebel_result replace_draft(viewer *all, const nb_document *fresh)
{
    nb_document old = all->draft;
    nb_cpu_preview_close(all->twin);
    all->twin = NULL;
    all->draft = *fresh;
    nb_document_show(&all->draft);
    const nebel_result result = renew_stage(all);
    if (result != NEBEL_OK) {
        nb_document_close(&all->draft);
        all->draft = old;
        nb_document_show(&all->draft);
        return result;
    }
    nb_document_close(&old);
    check_method(all);
    return NEBEL_OK;
}

/* Where that fails all stays as it is. The view stays where somebody has moved it, unless the file has another camera
 * now. */
static nebel_result read_again(viewer *all)
{
    nb_document fresh;
    const nebel_camera view = all->draft.data.camera, before = nebel_get_scene_data(all->draft.file)->camera;
    say(all, "");
    nb_watch_take(&all->watch);
    all->panel.file_is_newer = 0;
    if (nb_document_open(all->settings->scene, all->draft.frame, &all->log, &fresh) != NEBEL_OK) return NEBEL_OK;
    note_change(all);
    const nebel_result result = replace_draft(all, &fresh);
    if (result != NEBEL_OK) return forgive(result);
    watch_files(all);
    set_home(all);
    if (is_same_camera(&before, &nebel_get_scene_data(fresh.file)->camera)) all->draft.data.camera = view;
    nb_report_message("view: read %s again", all->settings->scene);
    return NEBEL_OK;
}

static nebel_result watch_file(viewer *all)
{
    if (nb_watch_find_changed(&all->watch) == NULL) return NEBEL_OK;
    if (!nb_document_is_changed(&all->draft)) return read_again(all);
    all->panel.file_is_newer = 1;
    return NEBEL_OK;
}

/* Why, the last message has said. */
static nebel_result say_not_saved(viewer *all, nebel_result why)
{
    char words[sizeof all->message];
    (void)snprintf(words, sizeof words, "Nothing is saved. %.480s", all->message);
    memcpy(all->message, words, sizeof words);
    all->is_fault = 1;
    nb_report_message("view: nothing is saved");
    return forgive(why);
}

/* Where the file has gone or is broken it does not have what the window shows. */
static nebel_result say_nothing_to_save(viewer *all)
{
    const nebel_result result = nb_document_try_file(all->settings->scene, &all->log);
    if (result != NEBEL_OK) return say_not_saved(all, result);
    say(all, "Nothing to save: the file has it all.");
    nb_report_message("view: nothing to save");
    return NEBEL_OK;
}

/* A file that somebody else has changed is not written before the question about that was seen; then what is new in it
 * stays there, and is read. */
static nebel_result save(viewer *all)
{
    const char *const path = all->settings->scene;
    const int was_newer = all->panel.file_is_newer, must_read = nb_document_must_be_read(&all->draft);
    say(all, "");
    if (!was_newer && nb_watch_find_changed(&all->watch) != NULL) {
        all->panel.file_is_newer = 1;
        return NEBEL_OK;
    }
    if (!was_newer && !must_read && !all->panel.saves_camera && !nb_document_is_changed(&all->draft))
        return say_nothing_to_save(all);
    rest_twin(all);
    const nebel_result result = nb_document_save(&all->draft, path, all->panel.saves_camera);
    if (result != NEBEL_OK) return say_not_saved(all, result);
    nb_report_message("view: saved %s", path);
    all->panel.file_is_newer = 0;
    nb_watch_take(&all->watch);
    const nebel_result used = was_newer || must_read ? read_again(all) : use_fog(all, NEBEL_OK);
    if (all->message[0] == '\0') say(all, "Saved.");
    return used;
}

/* ---- a lost context
 * --------------------------------------------------------------------------------------------------
 */

/* Within so many seconds a second loss is the fault of what is drawn [s]. */
static const double relapse = 10;

static int recover(viewer *all)
{
    static const char words[] = "The graphics driver was reset; the window has been opened again. Nothing is lost.";
    const double now = all->window.time;
    const int is_relapse = all->lost > 0 && now - all->lost < relapse;
    const uint32_t width = all->window.width, height = all->window.height;
    if (is_relapse)
        return nb_report_failure(
            "view: the graphics driver was reset twice, perhaps by this scene; try a smaller window, "
            "or 'nebel render --device cpu'");
    close_window(all);
    all->window = (nb_window){.handle = NULL};
    if (open_window(all, width > 0 ? width : all->settings->width, height > 0 ? height : all->settings->height) !=
        NB_DONE)
        return nb_report_failure("view: the graphics driver was reset, and no new window opens");
    all->lost = now;
    all->has_cpu = 0;
    all->hands = (nb_input){.x = 0};
    note_change(all);
    nb_report_message("view: %s", words);
    say(all, words);
    return NB_DONE;
}

/* ---- one turn
 * --------------------------------------------------------------------------------------------------------
 */

static void obey_keys(viewer *all)
{
    const nb_input *const hands = &all->hands;
    if (hands->moved_camera) note_change(all);
    if (hands->wants_help) all->panel.help_shown = !all->panel.help_shown;
    if (hands->wants_panel) all->panel.shown = !all->panel.shown;
    if (hands->wants_play) all->panel.plays = !all->panel.plays;
    if (hands->changed_look) note_change(all);
    all->wants_picture |= hands->wants_picture || all->panel.wants_picture;
    all->wants_window_picture |= hands->wants_window_picture;
    if (hands->wants_home || all->panel.wants_home) {
        all->draft.data.camera = all->home;
        note_change(all);
    }
    if (hands->wants_end) nb_window_end(&all->window);
}

static nebel_result obey_panel(viewer *all)
{
    const nb_panel *const panel = &all->panel;
    nebel_result result = NEBEL_OK;
    if (panel->is_out_of_memory) return NEBEL_ERROR_MEMORY;
    if (panel->has_read_message) say(all, "");
    if (panel->camera_changed || panel->look_changed) note_change(all);
    if (panel->look_changed) result = forgive(set_fog(all));
    all->has_changes |= panel->fog_changed;
    if (all->has_changes && !must_wait(all) && result == NEBEL_OK) result = commit(all);
    if (panel->frame_changed && result == NEBEL_OK) result = set_frame(all, all->frame);
    if (!panel->is_held) nb_history_close(&all->draft.history);
    if (!panel->is_held && result == NEBEL_OK) result = renew_renderers(all);
    return result;
}

static nebel_result go_to_frame(viewer *all, double frame)
{
    const double there = fmin(fmax(frame, -last_frame), last_frame);
    return there == all->draft.frame ? NEBEL_OK : set_frame(all, there);
}

/* From the last key on it begins again, unless something moves on without end. */
static double find_clock(const viewer *all)
{
    const double *const range = all->panel.frames, length = range[1] - range[0];
    const double on = all->clock - range[0];
    return all->draft.data.has_endless_motion ? all->clock : range[0] + on - length * floor(on / length);
}

/* Whole frames, as those of a film. */
static nebel_result play(viewer *all)
{
    nb_panel *const panel = &all->panel;
    const int was_playing = all->was_playing;
    panel->plays = panel->plays && panel->frames[0] < panel->frames[1] && all->draft.frame < last_frame;
    all->was_playing = panel->plays;
    if (!panel->plays) return NEBEL_OK;
    if (!was_playing || floor(all->clock) != all->draft.frame) all->clock = all->draft.frame;
    all->clock += all->look.rate * all->window.elapsed;
    all->clock = find_clock(all);
    return go_to_frame(all, floor(all->clock));
}

/* To the next whole frame either way. */
static nebel_result step_frame(viewer *all, int by)
{
    const double frame = all->draft.frame;
    all->panel.plays = 0;
    return go_to_frame(all, by > 0 ? floor(frame) + 1 : ceil(frame) - 1);
}

/* Those of the keys and of the panel's buttons, one at a time. */
static nebel_result obey_commands(viewer *all)
{
    const nb_panel *const panel = &all->panel;
    const nb_input *const hands = &all->hands;
    if (panel->wants_undo || hands->wants_undo) return step(all, 1);
    if (panel->wants_redo || hands->wants_redo) return step(all, 0);
    if (panel->wants_reload || hands->wants_reload) return read_again(all);
    if (panel->steps != 0) return step_frame(all, panel->steps);
    if (hands->steps != 0) return step_frame(all, hands->steps);
    return panel->wants_save || hands->wants_save ? save(all) : NEBEL_OK;
}

static int is_complete(const viewer *all)
{
    if (all->stage.state != NB_STAGE_FINE) return 0;
    return shown_look(all).compare == NB_LOOK_GL_ALONE || all->twin == NULL ||
           (!all->twin_is_stale && nb_cpu_preview_is_done(all->twin));
}

static int list_origins(viewer *all)
{
    const size_t count = all->draft.now.count;
    void *const origins = realloc(all->origins, (count + 1) * sizeof *all->origins);
    if (origins == NULL) return -1;
    all->origins = origins;
    for (size_t i = 0; i < count; i++) all->origins[i] = nb_document_origin(&all->draft, i);
    return 0;
}

static int fill_panel(viewer *all)
{
    static const char *const states[] = {"compiling shaders...", "moving: fewer pixels", "refining...", "complete"};
    nb_panel *const panel = &all->panel;
    const nebel_scene_data *const data = &all->draft.data;
    let_message_fade(all);
    if (list_origins(all) != 0) return nb_report_failure("view: out of memory");
    panel->scene = all->settings->scene;
    panel->driver = all->window.driver;
    panel->data = &all->draft.data;
    panel->now = &all->draft.now;
    panel->origins = all->origins;
    panel->cell_names = data->cell_names;
    panel->loaded = all->draft.scene;
    panel->look = &all->look;
    all->frame = all->draft.frame;
    panel->frame = &all->frame;
    panel->camera_is_keyed = !nb_document_can_save_camera(&all->draft);
    panel->models = nebel_get_scene_data(all->draft.scene)->models;
    panel->note = explain_method(all);
    panel->reason = all->refusal;
    if (!nb_document_find_frames(&all->draft, panel->frames)) panel->frames[0] = panel->frames[1] = 0;
    panel->is_changed = nb_document_is_changed(&all->draft);
    panel->has_past = all->draft.history.at > 0;
    panel->has_future = all->draft.history.at < all->draft.history.count;
    panel->message = all->message;
    panel->is_fault = all->is_fault;
    panel->picture = states[all->stage.state == NB_STAGE_FINE && !is_complete(all) ? NB_STAGE_WHOLE : all->stage.state];
    panel->seconds = all->stage.seconds;
    panel->samples = all->stage.samples;
    panel->cpu_seconds = shown_look(all).compare != NB_LOOK_GL_ALONE && all->has_cpu ? all->cpu_seconds : 0;
    return NB_DONE;
}

/* ---- the CPU's picture
 * ------------------------------------------------------------------------------------------------
 */

/* NULL where the method needs none. */
static nebel_result make_cells(viewer *all, nebel_cells **cells)
{
    *cells = NULL;
    if (!is_of_cells(all->look.method)) return NEBEL_OK;
    nebel_cells_desc desc = all->draft.good.cells_desc;
    desc.host.log = all->log;
    return nebel_create_cells(&desc, cells);
}

/* To be freed. */
static nebel_light *copy_lights(const nebel_scene_data *scene)
{
    nebel_light *const lights = malloc((scene->light_count + 1) * sizeof *lights);
    if (lights != NULL && scene->light_count > 0) memcpy(lights, scene->lights, scene->light_count * sizeof *lights);
    return lights;
}

static nebel_result ask_twin(viewer *all)
{
    nb_preview_request wish = {.camera = all->draft.data.camera,
                               .width = all->window.width,
                               .height = all->window.height,
                               .frame = all->draft.frame,
                               .plane = all->look.plane,
                               .method = all->look.method,
                               .factor = all->draft.good.classic,
                               .light = all->draft.data};
    nebel_result result = nb_document_whole(&all->draft, &wish.fog);
    if (result == NEBEL_OK && all->twin == NULL) all->twin = nb_cpu_preview_open(&all->draft.data);
    if (result == NEBEL_OK && all->twin == NULL) {
        say(all, "Memory or threads are out for the picture of the CPU.");
        return NEBEL_ERROR_MEMORY;
    }
    if (result == NEBEL_OK) result = make_cells(all, &wish.cells);
    if (result != NEBEL_OK) return result;
    wish.lights = copy_lights(&all->draft.data);
    if (wish.lights == NULL) {
        nebel_destroy_cells(wish.cells);
        return NEBEL_ERROR_MEMORY;
    }
    nb_cpu_preview_ask(all->twin, &wish);
    all->twin_is_stale = 0;
    return NEBEL_OK;
}

static void compare(viewer *all)
{
    nb_preview_image picture;
    if (shown_look(all).compare == NB_LOOK_GL_ALONE) return;
    if (all->twin_is_stale) (void)ask_twin(all);
    if (all->twin == NULL || !nb_cpu_preview_take(all->twin, &picture)) return;
    nb_screen_set_cpu(&all->screen, picture.width, picture.height, picture.rgb);
    all->has_cpu = 1;
    all->cpu_seconds = picture.seconds;
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
    char words[64];
    (void)snprintf(words, sizeof words, "Saved %s", name);
    say(all, words);
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
    const nb_display look = shown_look(all);
    nb_screen_draw(&all->screen, all->stage.texture, all->has_cpu, &look, window->width, window->height);
    int status = take_pictures(all, 0);
    if (status == NB_DONE) status = fill_panel(all);
    if (status != NB_DONE) return status;
    nb_panel_draw(&all->panel, all->settings->controls);
    if (status == NB_DONE) status = take_pictures(all, 1);
    nb_window_show(&all->window);
    return status;
}

/* Each frame is tried: OpenGL itself says what it does not draw, and the CPU draws that. */
static nebel_result try_frame(viewer *all)
{
    const nb_window *const window = &all->window;
    all->refusal[0] = '\0';
    const nb_display look = shown_look(all);
    all->is_asking = 1;
    const nebel_result result =
        nb_gl_preview_draw(&all->stage, &all->draft.data.camera, window->width, window->height, &look, is_moving(all));
    all->is_asking = 0;
    if (all->refusal[0] == '\0') return result;
    all->stage.samples = 0;
    all->stage.state = NB_STAGE_FINE;
    return NEBEL_OK;
}

/* Dear ImGui knows how large a window is when it has been drawn once. */
enum { BLANK_TURNS = 2 };

/* The driver compiles shaders in it, for seconds. */
static nebel_result try_first_frame(viewer *all)
{
    if (all->settings->screenshot == NULL && all->blank_turns < BLANK_TURNS) return all->blank_turns++, NEBEL_OK;
    nb_progress_bar meter = nb_progress_bar_start(0);
    nb_progress_bar_say(&meter, "OpenGL: compiling shaders...");
    const nebel_result result = try_frame(all);
    (void)nb_progress_bar_end(&meter);
    return result;
}

/* A frame that cannot be drawn is not tried again before something has changed. */
static nebel_result draw(viewer *all)
{
    all->stage.time = all->draft.frame;
    all->stage.cells = all->draft.cells;
    all->stage.factor = &all->draft.good.classic;
    if (all->stage.state == NB_STAGE_FINE && !is_moving(all)) return NEBEL_OK;
    const nebel_result result = all->stage.state == NB_STAGE_STALE ? try_first_frame(all) : try_frame(all);
    if (result != NEBEL_OK) all->stage.state = NB_STAGE_FINE;
    return nb_window_is_lost(&all->window) ? NEBEL_OK : forgive(result);
}

static int turn(viewer *all)
{
    nb_window *const window = &all->window;
    nb_window_wait(window, is_moving(all) || !is_complete(all) || nb_input_are_busy(&all->hands));
    if (nb_window_is_lost(window)) return recover(all);
    if (window->width == 0 || window->height == 0) return NB_DONE;
    if (window->was_resized) note_change(all);
    nb_input_move(&all->hands, window, &all->draft.data.camera, &all->look);
    obey_keys(all);
    nebel_result result = watch_file(all);
    if (result == NEBEL_OK) result = play(all);
    if (result == NEBEL_OK) result = draw(all);
    if (result != NEBEL_OK) return fail(all, result);
    const int status = show(all);
    result = obey_panel(all);
    if (result == NEBEL_OK) result = obey_commands(all);
    return result == NEBEL_OK ? status : fail(all, result);
}

/* The first wish to leave changes behind is answered with a word, the next one without a change between is obeyed. */
static int is_ended(viewer *all)
{
    if (!nb_window_is_ended(&all->window)) return 0;
    if (all->settings->screenshot != NULL || all->was_warned || !nb_document_is_changed(&all->draft)) return 1;
    nb_window_stay(&all->window);
    all->was_warned = 1;
    say(all, "Your changes are not saved. Ctrl+S saves them; Ctrl+Q again leaves without them.");
    nb_report_message("view: changes are not saved; asked to leave once more before they are lost");
    return 0;
}

int nb_view_run(const nb_viewer_options *settings)
{
    viewer all = {
        .settings = settings,
        .look = {.exposure = settings->exposure, .split = .5, .gain = 16, .range = 50, .samples = 4, .rate = 24},
        .panel = {.shown = 1},
        .twin_is_stale = 1};
    all.log = (nebel_log){.write = listen, .user = &all};
    int status = open_viewer(&all); /* a signal ends the program at once meanwhile */
    nb_interrupt_listen();
    all.look.range = status == NB_DONE ? nb_navigate_distance(&all.draft.data.camera) : 1;
    while (status == NB_DONE && !is_ended(&all) && !nb_interrupt_is_requested()) status = turn(&all);
    close_viewer(&all);
    nb_interrupt_obey();
    return status;
}
