/* nebel render: a scene to a picture, to many, or to a film. */
#define _POSIX_C_SOURCE 200809L

#include "warn_atmosphere.h"
#include "commands.h"
#include "warn_endless_fog.h"
#include "refine_meshes.h"
#include "signals.h"
#include "aov.h"
#include "load_scene.h"
#include "progress_bar.h"
#include "render_options.h"
#include "render_out.h"
#include "messages.h"
#include "shutter.h"
#include "noise_estimate.h"

#include <nebel/render.h>
#include <nebel/shader.h>

#if defined(NEBEL_HAVE_GL)
#include "gl_offscreen.h"
#endif

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char about[] = "Renders SCENE (JSON): models lit by the sun, lights and the ambient light, in\n"
                            "exact fog.\n"
                            "\n"
                            "A picture appears under its name when it is complete: it is written beside its\n"
                            "place and renamed. /dev/stdout and /dev/null are written to directly, pipes and\n"
                            "other devices are refused. Ctrl-C ends the work and leaves nothing behind;\n"
                            "pictures that were complete stay.\n"
                            "\n"
                            "Where standard error is a terminal, a bar shows how long it will take.\n";

static const char examples[] = "Examples:\n"
                               "  A first look, then the real one:\n"
                               "    nebel render mist.json -o look.png --size 320x180 --samples 1\n"
                               "    nebel render mist.json -o mist.png --size 1920x1080 --samples 16\n"
                               "  Everything a compositor wants, in linear light:\n"
                               "    nebel render mist.json -o mist.exr --aov\n"
                               "  Four seconds of film, in one file or as pictures:\n"
                               "    nebel render orbit.json -o orbit.webp --frames 0-95\n"
                               "    nebel render orbit.json -o 'frames/orbit_%04d.png' --frames 0-95\n"
                               "  The same by four processes, which go on where they were:\n"
                               "    mpirun -n 4 nebel render orbit.json -o orbit.webp --frames 0-95 --resume\n"
                               "\n"
                               "Exit status: 0 done, 1 the work failed, 2 the call was wrong.\n";

/* ---- the pictures ---------------------------------------------------------------------------- */

/* What lives as long as all frames. */
typedef struct nb_render_state {
    const nb_render_arguments *wanted;
    nb_report_listener listener;
    nb_load_result loaded;
    nebel_renderer *renderer; /* of the CPU */
    nb_refined_scene finer;
    nebel_cells *cells; /* of the methods of that name */
#if defined(NEBEL_HAVE_GL)
    nb_gl_offscreen painter; /* of OpenGL */
#endif
    float *samples[NB_LAYER_COUNT]; /* NULL: not wanted */
    nb_shutter shutter;
    uint32_t sub_frame, sub_frames; /* times of a picture: which is in work, of how many */
    float *interleaved;             /* all planes pixel by pixel; NULL where there is only one */
    nb_progress_bar meter;
    nb_jobs jobs;
    nb_render_out out;
    nb_render_item item; /* in work */
    int has_moved;       /* the fog is that of the time `moved_to`, in frames */
    double moved_to;
} nb_render_state;

/* Pixels that are rendered at once. */
static size_t count_pixels(const nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    return (size_t)wanted->width * (all->out.band_rows > 0 ? all->out.band_rows : wanted->height);
}

static float *allocate_pixels(const nb_render_state *all, uint32_t channels)
{
    const size_t most = SIZE_MAX / sizeof(float) / channels, pixels = count_pixels(all);
    return pixels <= most ? malloc(pixels * channels * sizeof(float)) : NULL;
}

static int writes_plane(const nb_render_arguments *wanted, int which)
{
    return which == NB_LAYER_COLOR || (wanted->aov && nb_layer_is_known((nb_aov)which, wanted->gl, wanted->method));
}

static uint32_t count_channels(const nb_render_arguments *wanted)
{
    uint32_t count = 0;
    for (int i = 0; i < NB_LAYER_COUNT; i++) count += writes_plane(wanted, i) ? nb_layer_kinds[i].channels : 0;
    return count;
}

/* The standard error is told whether it is written or not. */
static int allocate_planes(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    int good = 1;
    for (int i = 0; i < NB_LAYER_COUNT && good; i++) {
        if (!writes_plane(wanted, i) &&
            (i != NB_LAYER_STANDARD_ERROR || !nb_layer_is_known((nb_aov)i, wanted->gl, wanted->method)))
            continue;
        all->samples[i] = allocate_pixels(all, nb_layer_kinds[i].channels);
        good = all->samples[i] != NULL;
    }
    if (good && wanted->aov) {
        all->interleaved = allocate_pixels(all, count_channels(wanted));
        good = all->interleaved != NULL;
    }
    if (good && wanted->shutter > 0) good = nb_shutter_open(&all->shutter, all->samples, count_pixels(all));
    if (good) return NB_DONE;
    return nb_report_failure("render: --size: out of memory for %u x %u pixels; ask for fewer",
                             (unsigned)all->wanted->width, (unsigned)all->wanted->height);
}

static void free_studio(nb_render_state *all)
{
    for (int i = 0; i < NB_LAYER_COUNT; i++) free(all->samples[i]);
    free(all->interleaved);
    nb_shutter_free(&all->shutter);
    nebel_destroy_renderer(all->renderer);
    nebel_destroy_cells(all->cells);
    nb_render_out_free(&all->out);
#if defined(NEBEL_HAVE_GL)
    nb_gl_painter_close(&all->painter);
#endif
    nb_refine_free(&all->finer);
    nb_load_free(&all->loaded);
}

/* Hardware shows what it has stored. */
static void show_light(const nb_render_arguments *wanted, size_t pixels, float *samples)
{
    if (nebel_method_blends_stored(wanted->method))
        nebel_encode_srgb(pixels, samples, wanted->exposure, samples);
    else
        nebel_tone_map(pixels, samples, wanted->exposure, samples);
}

/* The picture of all planes that are wanted. */
static nebel_image join_planes(nb_render_state *all, const char *names[NB_MAX_LAYER_CHANNELS])
{
    const nb_render_arguments *const wanted = all->wanted;
    const nebel_window *const window = &all->item.window;
    const size_t pixels = (size_t)window->width * window->height;
    nebel_image image = {.width = window->width, .height = window->height, .channel_names = names};
    const uint32_t of = count_channels(wanted);
    for (int i = 0; i < NB_LAYER_COUNT; i++) {
        if (!writes_plane(wanted, i)) continue;
        if (all->interleaved != NULL)
            nb_layer_interleave((nb_aov)i, all->samples[i], pixels, image.channel_count, of, all->interleaved);
        for (uint32_t c = 0; c < nb_layer_kinds[i].channels; c++)
            names[image.channel_count++] = nb_layer_kinds[i].names[c];
    }
    image.samples = all->interleaved != NULL ? all->interleaved : all->samples[NB_LAYER_COLOR];
    if (wanted->is_film || wanted->format == NEBEL_IMAGE_PNG) show_light(wanted, pixels, image.samples);
    return image;
}

static int write_item(nb_render_state *all)
{
    const char *names[NB_MAX_LAYER_CHANNELS];
    const nebel_image image = join_planes(all, names);
    return nb_render_out_write(&all->out, &all->item, &image);
}

static void show_share(nb_render_state *all, double of_item)
{
    nb_jobs_show(&all->jobs, &all->meter, all->out.band_rows > 0 ? "band" : "frame", of_item);
}

static int show_progress(size_t done, size_t total, void *user)
{
    nb_render_state *const all = user;
    if (!all->wanted->gl)
        nb_interrupt_listen(); /* from the first call on the library asks again and again; OpenGL seldom */
    nb_jobs_answer(&all->jobs);
    const double share = total > 0 ? (double)done / (double)total : 0;
    if (all->jobs.is_chief) show_share(all, (all->sub_frame + share) / all->sub_frames);
    return nb_interrupt_is_requested();
}

/* The samples from `first_sample` on, at a time. */
static nebel_result trace_samples(nb_render_state *all, double time, uint32_t first_sample, uint32_t count)
{
    const nb_render_arguments *const wanted = all->wanted;
    const nebel_frame_desc desc = {
        .camera = nebel_get_scene_camera(all->loaded.scene, time),
        .width = wanted->width,
        .height = wanted->height,
        .samples = wanted->samples,
        .tolerance = wanted->tolerance,
        .progress = show_progress,
        .progress_user = all,
        .bounces = wanted->bounces,
        .seed = wanted->seed,
        .time = time,
        .window = all->item.window,
        .first_sample = first_sample,
        .sample_count = count,
    };
    const nebel_frame frame = {
        .color = all->samples[NB_LAYER_COLOR],
        .transmittance = all->samples[NB_LAYER_TRANSMITTANCE],
        .in_scattering = all->samples[NB_LAYER_IN_SCATTERING],
        .depth = all->samples[NB_LAYER_DEPTH],
        .normal = all->samples[NB_LAYER_NORMAL],
        .error = all->samples[NB_LAYER_ERROR],
        .standard_error = all->samples[NB_LAYER_STANDARD_ERROR],
    };
    const nebel_result result = nebel_set_renderer_lighting(all->renderer, all->loaded.lighting);
    return result == NEBEL_OK ? nebel_render_frame(all->renderer, &desc, &frame) : result;
}

/* Puts the fog and the light of the scene to a time. */
static nebel_result move_to(nb_render_state *all, double time)
{
    if (all->has_moved && all->moved_to == time) return NEBEL_OK;
    const nebel_result result = nb_load_move_fog(&all->loaded, time);
    all->has_moved = result == NEBEL_OK;
    all->moved_to = time;
    nb_refine_light(&all->finer, nebel_get_scene_data(all->loaded.scene));
    return result;
}

/* Each sample at its time, while the shutter is open. */
static nebel_result trace_motion(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const size_t pixels = (size_t)all->item.window.width * all->item.window.height;
    nb_shutter_begin(&all->shutter);
    for (uint32_t i = 0; i < wanted->samples; i++) {
        const double time = all->item.frame + wanted->shutter * nb_shutter_time(i, wanted->samples);
        all->sub_frame = i;
        nebel_result result = move_to(all, time);
        if (result == NEBEL_OK) result = trace_samples(all, time, i, 1);
        if (result != NEBEL_OK) return result;
        nb_shutter_add(&all->shutter, all->samples, pixels);
    }
    nb_shutter_finish(&all->shutter, all->samples, pixels);
    return NEBEL_OK;
}

static nebel_result trace_frame(nb_render_state *all)
{
    return all->wanted->shutter > 0 ? trace_motion(all) : trace_samples(all, all->item.frame, 0, 0);
}

/* Two passes take the fog's own light, unless a response curve has none. */
static nebel_vertex_desc look_of(nebel_method method, const nebel_scene_data *scene)
{
    nebel_vertex_desc look = {.curve = scene->classic_curve, .table = scene->classic_table};
    if (scene->classic != NULL && (method != NEBEL_METHOD_TWO_PASS || look.curve != NEBEL_CURVE_PHYSICAL))
        look.color = scene->classic->color;
    return look;
}

static const nebel_scene_data *surfaces_of(const nb_render_state *all)
{
    return all->wanted->tessellation.max_error > 0 ? &all->finer.data : nebel_get_scene_data(all->loaded.scene);
}

#if defined(NEBEL_HAVE_GL)
static nebel_gl_method gl_method(nebel_method method)
{
    static const nebel_gl_method methods[NEBEL_METHOD_COUNT] = {
        [NEBEL_METHOD_EXACT] = NEBEL_GL_METHOD_EXACT,       [NEBEL_METHOD_FIVE_TAP] = NEBEL_GL_METHOD_FIVE_TAP,
        [NEBEL_METHOD_VERTEX] = NEBEL_GL_METHOD_VERTEX,     [NEBEL_METHOD_ADDITIVE] = NEBEL_GL_METHOD_ADDITIVE,
        [NEBEL_METHOD_CELLS] = NEBEL_GL_METHOD_CELLS,       [NEBEL_METHOD_CELLS_PIXEL] = NEBEL_GL_METHOD_CELLS_PIXEL,
        [NEBEL_METHOD_LINEAR] = NEBEL_GL_METHOD_LINEAR,     [NEBEL_METHOD_EXP] = NEBEL_GL_METHOD_EXP,
        [NEBEL_METHOD_EXP2] = NEBEL_GL_METHOD_EXP2,         [NEBEL_METHOD_FOG_COORD] = NEBEL_GL_METHOD_FOG_COORD,
        [NEBEL_METHOD_TWO_PASS] = NEBEL_GL_METHOD_TWO_PASS, [NEBEL_METHOD_ALPHA] = NEBEL_GL_METHOD_ALPHA,
        [NEBEL_METHOD_D3D9] = NEBEL_GL_METHOD_D3D9,
    };
    return methods[method];
}

static nebel_result draw_frame(nb_render_state *all)
{
    const nebel_scene_data *const scene = nebel_get_scene_data(all->loaded.scene);
    const nebel_vertex_desc look = look_of(all->wanted->method, scene);
    const nebel_gl_frame_desc desc = {
        .camera = nebel_get_scene_camera(all->loaded.scene, all->item.frame),
        .width = all->wanted->width,
        .height = all->wanted->height,
        .samples = all->wanted->samples,
        .progress = show_progress,
        .progress_user = all,
        .method = gl_method(all->wanted->method),
        .cells = all->cells,
        .factor = scene->classic,
        .vertex = &look,
        .d3d9 = scene->classic_d3d9,
        .z_near = scene->classic_z_near,
        .z_far = scene->classic_z_far,
        .time = all->item.frame,
        .clouds_by_processor = 1,
    };
    const nebel_gl_planes wanted = {
        .color = all->samples[NB_LAYER_COLOR],
        .transmittance = all->samples[NB_LAYER_TRANSMITTANCE],
        .in_scattering = all->samples[NB_LAYER_IN_SCATTERING],
        .depth = all->samples[NB_LAYER_DEPTH],
        .normal = all->samples[NB_LAYER_NORMAL],
    };
    if (all->jobs.made == 0) nb_progress_bar_say(&all->meter, "OpenGL: compiling shaders...");
    return nb_gl_painter_draw(&all->painter, all->item.frame, &desc, &wanted);
}

static int open_gl(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const int status = nb_gl_painter_open(&all->painter, wanted->scene, &all->loaded, surfaces_of(all), wanted->method,
                                          &all->listener);
    if (status != NB_DONE || wanted->quiet) return status;
    if (wanted->aov) nb_report_message("note: --device gl: there is no channel error; OpenGL knows no bound of it");
    return NB_DONE;
}
#else
static nebel_result draw_frame(studio *all)
{
    (void)all;
    return NEBEL_ERROR_UNSUPPORTED;
}

static int open_gl(studio *all)
{
    (void)all;
    return nb_report_failure(
        "render: --device gl: this program was built without OpenGL; build it with NEBEL_BUILD_GL=ON, "
        "or say --device cpu");
}
#endif

static int render_frame(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    if (all->jobs.is_chief) show_share(all, 0);
    all->listener.mode = NB_REPORT_KEEP; /* that the frame was stopped is no news */
    const nebel_result result = wanted->gl ? draw_frame(all) : trace_frame(all);
    all->listener.mode = NB_REPORT_PRINT;
    if (result == NEBEL_OK || nb_interrupt_is_requested()) return NB_DONE;
    return nb_report_failure("render: %s: %s", wanted->scene,
                             all->listener.kept[0] != '\0' ? all->listener.kept : nebel_result_text(result));
}

/* Of a picture; bands know their own alone. */
static void note_spread(const nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const size_t pixels = (size_t)wanted->width * wanted->height;
    if (all->out.band_rows == 0 && all->samples[NB_LAYER_STANDARD_ERROR] != NULL && !wanted->quiet)
        nb_spread_report(all->samples[NB_LAYER_STANDARD_ERROR], 3 * pixels, wanted->samples);
}

static int move_fog(nb_render_state *all)
{
    const nebel_result result = all->wanted->shutter > 0 ? NEBEL_OK : move_to(all, all->item.frame);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&all->listener, all->wanted->scene, result);
}

static int make_item(nb_render_state *all)
{
    char what[500];
    (void)snprintf(what, sizeof what, "render: %s", all->wanted->output);
    nb_interrupt_unlisten(what); /* no file is open, and what is prepared may take long */
    int status = move_fog(all);
    if (status == NB_DONE) status = render_frame(all);
    if (status != NB_DONE || nb_interrupt_is_requested()) return status;
    status = write_item(all);
    if (status == NB_DONE) note_spread(all);
    return status;
}

/* Makes an item, or finds it there, and joins the parts of its file when it was the last one. */
static int do_item(nb_render_state *all, uint64_t number)
{
    all->item = nb_render_out_item(&all->out, number);
    const int is_there = nb_render_out_has(&all->out, &all->item);
    const int has_replaced = !is_there && all->wanted->resume && nb_render_out_is_made(&all->out, number);
    const int status = is_there ? NB_DONE : make_item(all);
    if (status != NB_DONE || nb_interrupt_is_requested()) return status;
    if (has_replaced) nb_jobs_note_replaced(&all->jobs);
    return nb_jobs_finish(&all->jobs, number, is_there) ? nb_render_out_join(&all->out, &all->item) : NB_DONE;
}

/* What of a planet moves. */
static const char *name_movers(const nebel_scene_data *scene)
{
    if (scene->planet_count == 0) return "";
    return scene->planets->model == NEBEL_PLANET_TEXTURED ? ", a textured planet turns with \"rotation_period\""
                                                          : ", clouds drift with \"wind\"";
}

static void note_stillness(const nebel_scene *scene, const nb_render_arguments *wanted)
{
    const nebel_scene_data *const data = nebel_get_scene_data(scene);
    if (data->turntable_frames > 0 || data->camera_key_count > 1 || data->animated_volume_count > 0 ||
        data->has_endless_motion || data->sun_key_count > 1)
        return;
    nb_report_message("note: %s: nothing moves, all frames are the same picture; "
                      "the camera turns with \"turntable\", camera and sun move with \"keys\"%s",
                      wanted->scene, name_movers(data));
}

static void warn_of_light(const nebel_scene_data *scene, const nb_render_arguments *wanted)
{
    if (wanted->method != NEBEL_METHOD_EXACT) return;
    nb_warn_of_darkness(scene, wanted->scene);
    nb_warn_of_deep_air(scene, wanted->scene);
}

/* What the scene has beside its cells is not drawn. */
static void note_other_fog(const nebel_scene_data *scene, const nb_render_arguments *wanted)
{
    if (wanted->quiet || (scene->volume_count == 0 && scene->nebula_count == 0)) return;
    nb_report_message("note: %s: --method cells draws the section \"cells\" alone; \"fog\" and \"nebula\" are left out",
                      wanted->scene);
}

static int takes_cells(nebel_method method)
{
    return method == NEBEL_METHOD_CELLS || method == NEBEL_METHOD_CELLS_PIXEL;
}

static int make_cells(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const nebel_scene_data *const scene = nebel_get_scene_data(all->loaded.scene);
    if (!takes_cells(wanted->method)) return NB_DONE;
    if (scene->cells == NULL)
        return nb_report_failure("render: %s: there is no section \"cells\" for --method cells; add one, or say "
                                 "--method exact",
                                 wanted->scene);
    note_other_fog(scene, wanted);
    nebel_cells_desc desc = *scene->cells;
    desc.host.log = nb_report_log(&all->listener);
    const nebel_result result = nebel_create_cells(&desc, &all->cells);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&all->listener, wanted->scene, result);
}

/* Over an edge as long as that the factor goes most of its way from 1 to 0, which no two vertices know of. */
static double reach_of(nebel_method method, const nebel_factor_desc *factor)
{
    if (method != NEBEL_METHOD_LINEAR) return 1 / factor->density;
    return factor->start < factor->end ? factor->end - factor->start : (double)INFINITY;
}

static void note_coarseness(const nebel_scene_data *scene, const nb_render_arguments *wanted)
{
    nebel_factor_desc factor;
    if (wanted->quiet || !nb_render_takes_factor(wanted->method) || scene->classic->stage != NEBEL_STAGE_VERTEX ||
        scene->classic->coordinate == NEBEL_COORDINATE_USER ||
        nebel_resolve_factor(scene->classic, &factor) != NEBEL_OK)
        return;
    const double longest = nb_refine_find_longest_edge(scene), reach = reach_of(wanted->method, &factor);
    if (longest <= reach) return;
    nb_report_message("note: %s: the factor is computed at vertices, and edges are up to %.3g m long, where fog grows "
                      "within %.3g m; \"stage\": \"pixel\" in \"classic\" computes it everywhere",
                      wanted->scene, longest, reach);
}

static int check_classic(const nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const nebel_scene_data *const scene = nebel_get_scene_data(all->loaded.scene);
    if (wanted->method == NEBEL_METHOD_D3D9 && scene->classic_d3d9 == NULL)
        return nb_report_failure(
            "render: %s: there is no \"d3d9\" in a section \"classic\" for --method d3d9; add it, or "
            "say --method exact",
            wanted->scene);
    if (nb_render_takes_color(wanted->method) && scene->classic == NULL)
        return nb_report_failure("render: %s: there is no section \"classic\" for --method %s; add one, or say "
                                 "--method exact",
                                 wanted->scene, nebel_method_name(wanted->method));
    note_coarseness(scene, wanted);
    return NB_DONE;
}

static int choose_method(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const nebel_scene_data *const scene = nebel_get_scene_data(all->loaded.scene);
    const nebel_cell_stage stage =
        wanted->method == NEBEL_METHOD_CELLS ? NEBEL_CELLS_PER_VERTEX : NEBEL_CELLS_PER_PIXEL;
    const nebel_vertex_desc look = look_of(wanted->method, scene);
    const nebel_method_desc desc = {.factor = scene->classic,
                                    .vertex = &look,
                                    .d3d9 = scene->classic_d3d9,
                                    .z_near = scene->classic_z_near,
                                    .z_far = scene->classic_z_far};
    const nebel_result result = takes_cells(wanted->method)
                                    ? nebel_set_renderer_cells(all->renderer, all->cells, stage)
                                    : nebel_set_renderer_method(all->renderer, wanted->method, &desc);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&all->listener, wanted->scene, result);
}

/* Which of the limits left triangles above the bound. */
static const char *name_limit(const nb_refined_scene *finer)
{
    if (finer->deepest_count == 0) return "--tessellate-triangles";
    return finer->deepest_count == finer->over_count ? "--tessellate-depth"
                                                     : "--tessellate-triangles and --tessellate-depth";
}

static void note_tessellation(const nb_render_arguments *wanted, const nb_refined_scene *finer)
{
    if (wanted->quiet) return;
    nb_report_message("note: %s: %zu triangles became %zu; the fog's factor is within %.3g of the exact one",
                      wanted->scene, finer->triangles_before, finer->triangles, finer->error);
    if (finer->over_count == 0) return;
    nb_report_message("note: %s: %zu triangles are left above --tessellate, because a limit ended it; allow more with "
                      "%s, or a larger error",
                      wanted->scene, finer->over_count, name_limit(finer));
}

static int refuse_tessellation(const nb_render_state *all)
{
    const nebel_scene *const scene = all->loaded.scene;
    const size_t volume = nb_refine_find_unproven(scene, all->wanted->first_frame);
    char place[32] = "fog";
    if (volume < nebel_get_scene_data(scene)->volume_count) (void)snprintf(place, sizeof place, "fog[%zu]", volume);
    return nb_report_failure("render: %s: %s: %s, or leave out --tessellate", all->wanted->scene, place,
                             all->listener.kept);
}

static int tessellate(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    if (wanted->tessellation.max_error == 0) return NB_DONE;
    const nebel_camera camera = nebel_get_scene_camera(all->loaded.scene, wanted->first_frame);
    nebel_tessellation_desc desc = wanted->tessellation;
    for (int i = 0; i < 3; i++) desc.eye[i] = camera.position[i];
    all->listener.mode = NB_REPORT_KEEP; /* which volume it is the library does not know */
    const nebel_result result =
        nb_refine_make(nebel_get_scene_data(all->loaded.scene), all->loaded.fog, &desc, &all->finer);
    all->listener.mode = NB_REPORT_PRINT;
    if (result == NEBEL_ERROR_UNSUPPORTED) return refuse_tessellation(all);
    if (result != NEBEL_OK)
        return nb_report_failure("render: %s: %s", wanted->scene,
                                 all->listener.kept[0] != '\0' ? all->listener.kept : nebel_result_text(result));
    note_tessellation(wanted, &all->finer);
    return NB_DONE;
}

static int open_renderer(nb_render_state *all)
{
    nebel_cpu_renderer_desc desc = all->wanted->renderer;
    desc.host.log = nb_report_log(&all->listener);
    const nebel_result result =
        nebel_create_cpu_renderer(surfaces_of(all), all->loaded.lighting, &desc, &all->renderer);
    return result == NEBEL_OK ? choose_method(all) : nb_report_result(&all->listener, all->wanted->scene, result);
}

/* Before the long work. */
static int check_count(const nb_render_state *all)
{
    const size_t count = nebel_get_scene_data(all->loaded.scene)->volume_count;
    if (!all->wanted->gl || count <= NEBEL_MAX_PACKED_VOLUMES) return NB_DONE;
    return nb_report_failure("render: --device gl: %s: %zu volumes are too many for shaders, which take %d; use fewer, "
                             "or say --device cpu",
                             all->wanted->scene, count, NEBEL_MAX_PACKED_VOLUMES);
}

static int choose_scattering(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    nebel_scene *const scene = all->loaded.scene;
    const nebel_diffusion_desc by_default = {0};
    const int is_off = wanted->scattering == NB_SCATTERING_OFF;
    if (wanted->scattering == NB_SCATTERING_OF_FILE) return NB_DONE;
    if (!is_off && nebel_get_scene_data(scene)->diffusion != NULL) return NB_DONE;
    const nebel_result result = nebel_set_scene_diffusion(scene, is_off ? NULL : &by_default);
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&all->listener, wanted->scene, result);
}

/* What OpenGL's targets take for a pixel (189), and films for one of a picture: an estimate from above, as it depends on
 * what there is to see. */
#define GL_PIXEL_BYTES 192.0
#define FILM_PIXEL_BYTES 0.5
#define LOSSLESS_PIXEL_BYTES 3.0

static double count_bytes(const nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    const double channels = count_channels(wanted);
    double bytes = ((wanted->aov ? 2 : 1) + (wanted->shutter > 0 ? 1 : 0)) * channels * sizeof(float) +
                   (wanted->gl ? GL_PIXEL_BYTES : 0);
    if (wanted->is_film)
        bytes += ((double)wanted->last_frame - wanted->first_frame + 1) *
                 (wanted->quality == 100 ? LOSSLESS_PIXEL_BYTES : FILM_PIXEL_BYTES);
    return bytes * (double)count_pixels(all);
}

/* Samples and threads take nothing worth counting. */
static int charge_pictures(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    char what[96];
    (void)snprintf(what, sizeof what, "--size: %s of %u x %u pixels", wanted->is_film ? "a film" : "a picture",
                   (unsigned)wanted->width, (unsigned)wanted->height);
    const nebel_result result = nebel_charge_scene(all->loaded.scene, what, (uint64_t)count_bytes(all));
    return result == NEBEL_OK ? NB_DONE : nb_report_result(&all->listener, wanted->scene, result);
}

static int load(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    int status = nb_load_file(wanted->scene, 1, &all->listener, &all->loaded);
    if (status == NB_DONE) status = nb_render_out_spare(&all->out, nebel_get_scene_data(all->loaded.scene));
    if (status == NB_DONE) status = check_count(all);
    if (status == NB_DONE) status = choose_scattering(all);
    if (status == NB_DONE) status = charge_pictures(all);
    return status == NB_DONE ? nb_load_fog(wanted->scene, wanted->first_frame, &all->listener, &all->loaded) : status;
}

static int set_up(nb_render_state *all)
{
    const nb_render_arguments *const wanted = all->wanted;
    int status = load(all);
    if (status != NB_DONE || nb_interrupt_is_requested()) return status;
    if (!wanted->quiet && wanted->last_frame > wanted->first_frame) note_stillness(all->loaded.scene, wanted);
    if (all->jobs.is_chief) warn_of_light(nebel_get_scene_data(all->loaded.scene), wanted);
    status = check_classic(all);
    if (status == NB_DONE) status = make_cells(all);
    if (status == NB_DONE) status = tessellate(all);
    if (status == NB_DONE) status = allocate_planes(all);
    if (status != NB_DONE) return status;
    return wanted->gl ? open_gl(all) : open_renderer(all);
}

static void summarize(const nb_render_state *all, double seconds)
{
    const nb_render_arguments *const wanted = all->wanted;
    char span[32], count[128] = "";
    const int is_one = !wanted->many_frames && all->out.band_rows == 0 && all->jobs.all_kept == 0;
    nb_progress_bar_write_span(seconds, span, sizeof span);
    if (!is_one) nb_jobs_describe(&all->jobs, all->out.band_rows > 0 ? "band" : "picture", count, sizeof count);
    nb_report_message("%s: %s%s%u x %u, %u sample%s, %s", wanted->output, count, is_one ? "" : ", ",
                      (unsigned)wanted->width, (unsigned)wanted->height, (unsigned)wanted->samples,
                      wanted->samples > 1 ? "s" : "", span);
}

static int is_made(void *user, uint64_t item)
{
    const nb_render_state *const all = user;
    return nb_render_out_is_made(&all->out, item);
}

/* Before the items: what all processes need, and whether they agree on what that is. */
static int prepare(nb_render_state *all)
{
    char name[NEBEL_MAX_RECORD + 1];
    int status = nb_render_out_check(&all->out, &all->jobs);
    if (status == NB_DONE) status = nb_render_out_open(&all->out);
    if (status == NB_DONE) status = set_up(all);
    if (status == NB_DONE && !nb_interrupt_is_requested())
        status = nb_render_out_sign(&all->out, nebel_get_scene_data(all->loaded.scene));
    if (nb_interrupt_is_requested()) return status;
    nb_render_out_name_job(&all->out, name);
    if (status == NB_DONE && all->wanted->resume && !all->wanted->quiet)
        nb_jobs_survey(&all->jobs, nb_render_out_count_items(&all->out), is_made, all);
    return nb_jobs_begin(&all->jobs, nb_render_out_count_items(&all->out), nb_render_out_group(&all->out), status,
                         name);
}

static int render(const nb_render_arguments *wanted)
{
    nb_render_state all = {
        .wanted = wanted, .meter = nb_progress_bar_start(wanted->quiet), .listener = {.quiet = wanted->quiet}};
    all.jobs = nb_jobs_of(&wanted->shard);
    all.sub_frames = wanted->shutter > 0 ? wanted->samples : 1;
    int status = nb_jobs_join(&all.jobs);
    if (status != NB_DONE) return status;
    nb_render_arguments own = *wanted;
    own.quiet |= !all.jobs.is_chief; /* what one has said need not be repeated */
    all.wanted = &own;
    all.listener.quiet = own.quiet;
    if (all.jobs.is_joined && !own.quiet) nb_progress_bar_write_lines(&all.meter);
    all.out = nb_render_out_of(all.wanted, &all.jobs, &all.listener);
    status = prepare(&all);
    uint64_t item;
    if (status == NB_DONE && !own.quiet) nb_jobs_note_copies(&all.jobs);
    nb_progress_bar_begin(&all.meter);
    while (status == NB_DONE && !nb_interrupt_is_requested() && nb_jobs_take(&all.jobs, &item))
        status = do_item(&all, item);
    if (status == NB_DONE && !nb_interrupt_is_requested()) status = nb_render_out_finish(&all.out);
    const double seconds = nb_progress_bar_end(&all.meter);
    free_studio(&all);
    if (nb_interrupt_is_requested()) return nb_report_failure("render: %s: stopped", wanted->output);
    status = nb_jobs_end(&all.jobs, status);
    if (status == NB_DONE && !own.quiet) summarize(&all, seconds);
    return status;
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    nb_render_arguments wanted = {0};
    int status = nb_options_parse(&nb_commands_render, count, words, &arguments);
    if (status < 0) status = nb_render_call_read(&arguments, &wanted);
    if (status >= 0) return status;
    status = render(&wanted);
    nb_interrupt_obey();
    return status;
}

const nb_command nb_commands_render = {
    .name = "render",
    .summary = "a scene to a picture, to many, or to a film",
    .synopsis = "SCENE -o FILE [options]",
    .about = about,
    .options = nb_render_options,
    .option_count = NB_RENDER_OPTIONS,
    .operands = "one scene file",
    .fewest_operands = 1,
    .most_operands = 1,
    .examples = examples,
    .run = run,
};
