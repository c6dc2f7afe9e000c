/* Every number and name of good scenes is changed, saved and read again: what the reader keeps, saving must write. */
#define _POSIX_C_SOURCE 200809L

#include "scene/scene_data.h"
#include "scene_help.h"

#include <math.h>
#include <unistd.h>

/* All lengths half as long is a change of everything after which cells still touch, and portals lie in faces. */
static const nb_file_units half = {.unit = .5};

enum { MOST = 64 };

typedef struct change {
    nebel_scene *scene;
    nebel_scene_data data;
    nebel_volume_desc volumes[MOST];
    const char *volume_names[MOST];
    nebel_volume_track entries[MOST];
    nebel_volume_desc own[MOST];
    nebel_volume_key *keys[MOST];
    nebel_nebula_desc nebulae[MOST];
    const char *nebula_names[MOST];
    nebel_transform nebula_places[MOST];
    nebel_cells_desc cells;
    nebel_cell cell[MOST];
    const char *cell_names[MOST];
    nebel_portal portals[MOST];
    double (*vertices[MOST])[3];
    nebel_factor_desc classic;
    nebel_d3d9_fog device;
    float table[NEBEL_CURVE_ENTRIES];
    nebel_scene_model models[MOST];
    nebel_light lights[MOST];
    nebel_planet planets[NEBEL_MAX_PLANETS];
    nebel_camera_key camera_keys[MOST];
    char names[3 * MOST][32];
    int name_count;
} change;

static const char *name_anew(change *c, const char *kind)
{
    char *name = c->names[c->name_count++];
    snprintf(name, sizeof *c->names, "%s \"%d\" \u00e4", kind, c->name_count);
    return name;
}

static void dim(double rgb[3])
{
    for (int i = 0; i < 3; i++) rgb[i] /= 2;
}

/* ---- the sections ---------------------------------------------------------------------------- */

/* Parts and planes belong to the scene: copies of them change. They are few, and the process is short. */
static nebel_shape copy_shape(const nebel_shape *from)
{
    nebel_shape shape = *from;
    nebel_plane *planes = malloc((from->plane_count + 1) * sizeof *planes);
    nebel_shape *parts = malloc((from->part_count + 1) * sizeof *parts);
    for (size_t i = 0; i < from->plane_count; i++) planes[i] = from->planes[i];
    for (size_t i = 0; i < from->part_count; i++) parts[i] = copy_shape(&from->parts[i]);
    shape.planes = planes;
    shape.parts = parts;
    return shape;
}

static void free_shape(const nebel_shape *shape)
{
    for (size_t i = 0; i < shape->part_count; i++) free_shape(&shape->parts[i]);
    free((void *)shape->planes);
    free((void *)shape->parts);
}

static void change_volume(nebel_volume_desc *volume)
{
    volume->shape = copy_shape(&volume->shape);
    nb_file_units_convert_volume(&half, volume);
    dim(volume->source);
    dim(volume->albedo);
    if (volume->density.type == NEBEL_DENSITY_RADIAL) volume->density.power = volume->density.power % 3 + 1;
    if (volume->density.type == NEBEL_DENSITY_HEIGHT) volume->density.below = !volume->density.below;
}

static void change_entry(change *c, size_t i)
{
    nebel_volume_track *entry = &c->entries[i];
    if (entry->key_count == 0) return;
    c->own[i] = *entry->base;
    change_volume(&c->own[i]);
    c->keys[i] = malloc(entry->key_count * sizeof *c->keys[i]);
    for (size_t k = 0; k < entry->key_count; k++) {
        nebel_volume_key *key = &c->keys[i][k];
        const nebel_shape own = c->own[i].shape;
        *key = entry->keys[k];
        key->frame += 1;
        key->volume.shape.plane_count = key->volume.shape.part_count = 0;
        nb_file_units_convert_volume(&half, &key->volume);
        key->volume.shape.planes = own.planes, key->volume.shape.plane_count = own.plane_count;
        key->volume.shape.parts = own.parts, key->volume.shape.part_count = own.part_count;
        dim(key->volume.source);
        dim(key->volume.albedo);
        key->volume.density.power = c->own[i].density.power;
        key->volume.density.below = c->own[i].density.below;
    }
    entry->base = &c->own[i];
    entry->keys = c->keys[i];
}

static bool is_written(const change *c, size_t i)
{
    const nebel_volume_origin origin = nebel_get_volume_origin(c->scene, i);
    return origin == NEBEL_VOLUME_STATIC || origin == NEBEL_VOLUME_ANIMATED;
}

static void change_volumes(change *c)
{
    for (size_t i = 0; i < c->data.volume_count; i++) {
        c->volumes[i] = c->data.volumes[i];
        c->volume_names[i] = c->data.volume_names[i];
        c->entries[i] = c->data.volume_tracks[i];
        if (!is_written(c, i)) continue;
        change_volume(&c->volumes[i]);
        c->volume_names[i] = name_anew(c, "fog");
        c->volumes[i].priority = c->entries[i].key_count > 0 ? c->volumes[i].priority : 7;
        if (c->entries[i].key_count == 0 && !(c->volumes[i].extinction[0] == 0)) c->entries[i].contrast = .03;
        change_entry(c, i);
    }
    c->data.volumes = c->volumes;
    c->data.volume_names = c->volume_names;
    c->data.volume_tracks = c->entries;
}

static void change_nebulae(change *c)
{
    for (size_t i = 0; i < c->data.nebula_count; i++) {
        nebel_nebula_desc *nebula = &c->nebulae[i];
        *nebula = c->data.nebulae[i];
        nebula->shape = copy_shape(&nebula->shape);
        nb_file_units_convert_nebula(&half, nebula);
        nebula->seed++;
        if (nebula->points == NULL) nebula->dimming = nebula->dimming > .5 ? .25 : .75;
        nebula->count++;
        nebula->profile = (nebel_particle_profile)((nebula->profile + 1) % NEBEL_PARTICLE_PROFILE_COUNT);
        c->nebula_names[i] = name_anew(c, "nebula");
        c->nebula_places[i] = c->data.nebula_transforms[i];
    }
    c->data.nebulae = c->nebulae;
    c->data.nebula_names = c->nebula_names;
    c->data.nebula_transforms = c->nebula_places;
}

static void change_portals(change *c)
{
    for (size_t i = 0; i < c->cells.portal_count; i++) {
        nebel_portal *portal = &c->portals[i];
        *portal = c->cells.portals[i];
        double(*vertices)[3] = malloc(portal->vertex_count * sizeof *vertices);
        for (size_t v = 0; v < portal->vertex_count; v++)
            for (int k = 0; k < 3; k++) vertices[v][k] = portal->vertices[v][k] / 2;
        c->vertices[i] = vertices;
        portal->vertices = (const double(*)[3])vertices;
    }
    if (c->cells.portals != NULL) c->cells.portals = c->portals;
}

static void change_cells(change *c)
{
    if (c->data.cells == NULL) return;
    c->cells = *c->data.cells;
    for (size_t i = 0; i < c->cells.cell_count; i++) {
        c->cell[i] = c->cells.cells[i];
        c->cell[i].shape = copy_shape(&c->cell[i].shape);
        nb_file_units_convert_cell(&half, &c->cell[i]);
        dim(c->cell[i].color);
        c->cell_names[i] = name_anew(c, "cell");
    }
    c->cells.cells = c->cell;
    c->cells.model = (nebel_cell_model)((c->cells.model + 1) % NEBEL_CELL_MODEL_COUNT);
    c->cells.span = (nebel_cell_span)((c->cells.span + 1) % NEBEL_SPAN_COUNT);
    c->cells.ungrouped = !c->cells.ungrouped;
    change_portals(c);
    c->data.cells = &c->cells;
    c->data.cell_names = c->cell_names;
}

static void change_device(change *c)
{
    c->device = *c->data.classic_d3d9;
    c->device.fog_color ^= 0x10203;
    c->device.fog_table_mode = (c->device.fog_table_mode + 1) % 4;
    c->device.fog_vertex_mode = (c->device.fog_vertex_mode + 1) % 4;
    c->device.fog_start -= 1;
    c->device.fog_end /= 2;
    c->device.fog_density *= 2;
    c->device.range_fog_enable = !c->device.range_fog_enable;
    c->data.classic_d3d9 = &c->device;
}

/* A curve becomes a table, and a table another. */
static void change_curve(change *c)
{
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++)
        c->table[i] = c->data.classic_curve == NEBEL_CURVE_TABLE ? c->data.classic_table[i] / 2 : (float)i / 256;
    c->data.classic_curve = NEBEL_CURVE_TABLE;
    c->data.classic_table = c->table;
}

static void change_classic(change *c)
{
    if (c->data.classic == NULL) return;
    if (c->data.classic_d3d9 != NULL) change_device(c);
    change_curve(c);
    c->classic = *c->data.classic;
    c->classic.start /= 2;
    c->classic.end /= 2;
    c->classic.density *= 2;
    dim(c->classic.color);
    c->classic.coordinate = (nebel_factor_coordinate)!c->classic.coordinate;
    c->classic.stage = (nebel_factor_stage)!c->classic.stage;
    c->data.classic = &c->classic;
}

static void change_camera(change *c)
{
    nb_file_units_convert_camera(&half, &c->data.camera);
    c->data.camera.vertical_fov /= 2;
    c->data.camera.projection = (nebel_projection)((c->data.camera.projection + 1) % 3);
    for (size_t i = 0; i < c->data.camera_key_count; i++) {
        c->camera_keys[i] = c->data.camera_keys[i];
        c->camera_keys[i].frame += 1;
        nb_file_units_convert_camera(&half, &c->camera_keys[i].camera);
        c->camera_keys[i].camera.vertical_fov /= 2;
        c->camera_keys[i].camera.projection = c->data.camera.projection;
    }
    c->data.camera_keys = c->camera_keys;
    if (c->data.turntable_frames > 0) c->data.turntable_frames++;
}

static void change_models(change *c)
{
    for (size_t i = 0; i < c->data.model_count; i++) {
        nebel_scene_model *model = &c->models[i];
        *model = c->data.models[i];
        nb_file_units_convert_placement(&half, model->position, model->rotation, model->scale);
        model->size[0] /= 2;
        model->size[1] /= 2;
        model->height /= 2;
        if (!model->is_heightfield) model->scale[1] *= 2;
        if (model->has_color) dim(model->color);
    }
    c->data.models = c->models;
}

static void change_lights(change *c)
{
    for (size_t i = 0; i < c->data.light_count; i++) {
        nebel_light *light = &c->lights[i];
        *light = c->data.lights[i];
        nb_file_units_convert_place(&half, light->position);
        dim(light->intensity);
        light->radius = light->radius > 0 ? 2 * light->radius : .25;
        if (light->type != NEBEL_LIGHT_SPOT) continue;
        const double direction[3] = {light->direction[1], light->direction[2], light->direction[0]};
        memcpy(light->direction, direction, sizeof direction);
        light->outer_angle = (light->outer_angle + 180) / 2;
        light->inner_angle = (light->inner_angle + 1) / 2;
    }
    c->data.lights = c->lights;
}

static void change_air(nebel_atmosphere_component *air)
{
    for (int k = 0; k < 3; k++) {
        air->scattering[k] = air->scattering[k] / 2 + 1e-6;
        air->absorption[k] = air->absorption[k] / 2 + 1e-7 * k;
    }
    air->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = air->phase.g / 2 + .25};
    if (air->profile == NEBEL_COMPONENT_EXPONENTIAL) air->scale_height *= 1.5;
    if (air->profile == NEBEL_COMPONENT_TENT) air->center_height *= .75, air->half_width *= .75;
}

/* Of layers that are one above the other, all of them, so that they stay apart. */
static void change_cloud(const nebel_planet *planet, nebel_cloud_layer *layer)
{
    assert_int_equal(nebel_resolve_cloud_layer(planet->atmosphere_desc.thickness, layer, NULL, layer), NEBEL_OK);
    layer->base *= .75;
    layer->top *= .75;
    layer->coverage /= 2;
    layer->extinction /= 2;
    layer->cell_size *= 2;
    layer->erosion = layer->erosion == NEBEL_ZERO ? .5 : NEBEL_ZERO;
    layer->patchiness = layer->patchiness == NEBEL_ZERO ? .25 : NEBEL_ZERO;
    layer->droplet_diameter = 30;
    layer->wind[0] += 5;
    layer->wind[1] -= 7;
}

static void change_layers(nebel_textured_planet_desc *desc)
{
    desc->rotation_period += 12;
    desc->land_coverage = .375;
    desc->atmosphere.height = desc->radius / 16;
    desc->atmosphere.is_disabled = !desc->atmosphere.is_disabled;
    desc->atmosphere.brightness = desc->atmosphere.is_disabled ? 0 : .75;
    for (uint32_t i = 0; i < desc->cloud_shell_count; i++) {
        nebel_cloud_shell *shell = &desc->cloud_shells[i];
        shell->height = desc->radius / 64 * (i + 1);
        shell->rotation_period -= 3;
        shell->gain = .25;
        shell->coverage = .625;
        for (int k = 0; k < 3; k++) shell->color[k] = .125 * (k + 1), shell->uv_tiling[k] = k + 2;
    }
}

static void change_planets(change *c)
{
    for (size_t i = 0; i < c->data.planet_count; i++) {
        nebel_planet *planet = &c->planets[i];
        *planet = c->data.planets[i];
        dim(planet->atmosphere_desc.ground_albedo);
        planet->sun_angular_diameter += .25;
        for (uint32_t k = 0; k < planet->atmosphere_desc.component_count; k++)
            change_air(&planet->atmosphere_desc.components[k]);
        for (uint32_t k = 0; k < planet->cloud_layer_count; k++) change_cloud(planet, &planet->cloud_layers[k]);
        change_layers(&planet->textured_desc);
    }
    c->data.planets = c->planets;
}

static void change_all(change *c)
{
    nebel_scene_data *data = &c->data;
    change_volumes(c);
    change_nebulae(c);
    change_cells(c);
    change_classic(c);
    change_camera(c);
    change_models(c);
    change_lights(c);
    change_planets(c);
    dim(data->background);
    dim(data->ambient);
    dim(data->environment.zenith);
    dim(data->environment.horizon);
    dim(data->environment.ground);
    data->shows_ambient = !data->shows_ambient;
    dim(data->sun_irradiance);
    data->max_opacity = data->max_opacity == 0 ? .75 : data->max_opacity / 2;
}

static void free_change(change *c)
{
    for (size_t i = 0; i < c->data.volume_count; i++) {
        if (is_written(c, i)) free_shape(&c->volumes[i].shape);
        if (c->entries[i].key_count > 0) free_shape(&c->own[i].shape);
        free(c->keys[i]);
    }
    for (size_t i = 0; i < c->data.nebula_count; i++) free_shape(&c->nebulae[i].shape);
    for (size_t i = 0; i < c->cells.cell_count; i++) free_shape(&c->cell[i].shape);
    for (size_t i = 0; i < c->cells.portal_count; i++) free(c->vertices[i]);
    nebel_destroy_scene(c->scene);
}

/* ---- what is read again ---------------------------------------------------------------------- */

static const char *where; /* the file */

/* The last of 15 digits may be off by a half, 5e-15 where the first is 1; a conversion rounds a little more. */
#define SAME(a, b) same((const double *)(a), (const double *)(b), sizeof *(a) / sizeof(double), #a)
static void same(const double *a, const double *b, size_t count, const char *what)
{
    for (size_t i = 0; i < count; i++)
        if (!(fabs(a[i] - b[i]) <= 6e-15 * fabs(b[i]) + 1e-300))
            fail_msg("%s: %s[%zu] is %.17g, and should be %.17g", where, what, i, a[i], b[i]);
}

#define WHOLE(a, b)                                                                                                    \
    do {                                                                                                               \
        if ((a) != (b)) fail_msg("%s: %s is not as it was saved", where, #a);                                          \
    } while (0)
#define WORD(a, b)                                                                                                     \
    do {                                                                                                               \
        if (strcmp(a, b) != 0) fail_msg("%s: %s is %s, and should be %s", where, #a, a, b);                            \
    } while (0)

static void same_shape(const nebel_shape *a, const nebel_shape *b)
{
    WHOLE(a->type, b->type);
    SAME(&a->transform.position, &b->transform.position);
    SAME(&a->transform.rotation, &b->transform.rotation);
    SAME(&a->transform.scale, &b->transform.scale);
    SAME(&a->min, &b->min);
    SAME(&a->max, &b->max);
    SAME(&a->center, &b->center);
    SAME(&a->radius, &b->radius);
    SAME(&a->radii, &b->radii);
    SAME(&a->from, &b->from);
    SAME(&a->to, &b->to);
    SAME(&a->radius_from, &b->radius_from);
    SAME(&a->radius_to, &b->radius_to);
    SAME(&a->point, &b->point);
    SAME(&a->normal, &b->normal);
    WHOLE(a->plane_count, b->plane_count);
    WHOLE(a->part_count, b->part_count);
    for (size_t i = 0; i < a->plane_count; i++) {
        SAME(&a->planes[i].normal, &b->planes[i].normal);
        SAME(&a->planes[i].distance, &b->planes[i].distance);
    }
    for (size_t i = 0; i < a->part_count; i++) same_shape(&a->parts[i], &b->parts[i]);
}

static void same_density(const nebel_density *a, const nebel_density *b)
{
    WHOLE(a->type, b->type);
    WHOLE(a->below, b->below);
    WHOLE(a->power, b->power);
    SAME(&a->base, &b->base);
    SAME(&a->scale_height, &b->scale_height);
    SAME(&a->from, &b->from);
    SAME(&a->to, &b->to);
    SAME(&a->center, &b->center);
    SAME(&a->sigma, &b->sigma);
    SAME(&a->edge_width, &b->edge_width);
}

static void same_volume(const nebel_volume_desc *a, const nebel_volume_desc *b)
{
    WHOLE(a->operation, b->operation);
    WHOLE(a->priority, b->priority);
    same_shape(&a->shape, &b->shape);
    same_density(&a->density, &b->density);
    SAME(&a->extinction, &b->extinction);
    SAME(&a->source, &b->source);
    SAME(&a->albedo, &b->albedo);
    WHOLE(a->phase.type, b->phase.type);
    SAME(&a->phase.g, &b->phase.g);
    SAME(&a->phase.alpha, &b->phase.alpha);
    SAME(&a->phase.diameter, &b->phase.diameter);
    SAME(&a->emission, &b->emission);
    SAME(&a->start, &b->start);
    SAME(&a->cutoff, &b->cutoff);
}

static void same_volumes(const nebel_scene_data *a, const nebel_scene_data *b)
{
    WHOLE(a->volume_count, b->volume_count);
    for (size_t i = 0; i < a->volume_count; i++) {
        const nebel_volume_track *x = &a->volume_tracks[i], *y = &b->volume_tracks[i];
        WORD(a->volume_names[i], b->volume_names[i]);
        WHOLE(x->key_count, y->key_count);
        if (x->key_count == 0) same_volume(&a->volumes[i], &b->volumes[i]);
        if (x->key_count > 0) same_volume(x->base, y->base);
        for (size_t k = 0; k < x->key_count; k++) {
            SAME(&x->keys[k].frame, &y->keys[k].frame);
            same_volume(&x->keys[k].volume, &y->keys[k].volume);
        }
    }
}

static void same_nebulae(const nebel_scene_data *a, const nebel_scene_data *b)
{
    WHOLE(a->nebula_count, b->nebula_count);
    for (size_t i = 0; i < a->nebula_count; i++) {
        const nebel_nebula_desc *x = &a->nebulae[i], *y = &b->nebulae[i];
        WORD(a->nebula_names[i], b->nebula_names[i]);
        same_shape(&x->shape, &y->shape);
        same_density(&x->density, &y->density);
        WHOLE(x->count, y->count);
        WHOLE(x->seed, y->seed);
        WHOLE(x->profile, y->profile);
        SAME(&x->radius_range, &y->radius_range);
        SAME(&x->absorption, &y->absorption);
        SAME(&x->emission, &y->emission);
        SAME(&x->dimming, &y->dimming);
        SAME(&x->turbulence, &y->turbulence);
        SAME(&x->turbulence_scale, &y->turbulence_scale);
        WHOLE(x->color_count, y->color_count);
        for (size_t k = 0; k < x->color_count; k++) SAME(&x->colors[k], &y->colors[k]);
    }
}

static void same_cells(const nebel_scene_data *a, const nebel_scene_data *b)
{
    const nebel_cells_desc *x = a->cells, *y = b->cells;
    WHOLE(x == NULL, y == NULL);
    if (x == NULL) return;
    WHOLE(x->cell_count, y->cell_count);
    WHOLE(x->model, y->model);
    WHOLE(x->span, y->span);
    WHOLE(x->ungrouped, y->ungrouped);
    for (size_t i = 0; i < x->cell_count; i++) {
        WORD(a->cell_names[i], b->cell_names[i]);
        same_shape(&x->cells[i].shape, &y->cells[i].shape);
        SAME(&x->cells[i].density, &y->cells[i].density);
        SAME(&x->cells[i].color, &y->cells[i].color);
    }
    WHOLE(x->portals == NULL, y->portals == NULL);
    WHOLE(x->portal_count, y->portal_count);
    for (size_t i = 0; i < x->portal_count; i++) {
        const nebel_portal *p = &x->portals[i], *q = &y->portals[i];
        WHOLE(p->cells[0], q->cells[0]);
        WHOLE(p->cells[1], q->cells[1]);
        WHOLE(p->vertex_count, q->vertex_count);
        for (size_t k = 0; k < p->vertex_count; k++) SAME(&p->vertices[k], &q->vertices[k]);
    }
}

static void same_view(const nebel_camera *a, const nebel_camera *b)
{
    SAME(&a->position, &b->position);
    SAME(&a->look_at, &b->look_at);
    SAME(&a->up, &b->up);
    SAME(&a->vertical_fov, &b->vertical_fov);
    SAME(&a->view_height, &b->view_height);
    WHOLE(a->projection, b->projection);
}

static void same_camera(const nebel_scene_data *a, const nebel_scene_data *b)
{
    same_view(&a->camera, &b->camera);
    WHOLE(a->turntable_frames, b->turntable_frames);
    WHOLE(a->camera_key_count, b->camera_key_count);
    for (size_t i = 0; i < a->camera_key_count; i++) {
        SAME(&a->camera_keys[i].frame, &b->camera_keys[i].frame);
        same_view(&a->camera_keys[i].camera, &b->camera_keys[i].camera);
    }
}

static void same_models(const nebel_scene_data *a, const nebel_scene_data *b)
{
    WHOLE(a->model_count, b->model_count);
    for (size_t i = 0; i < a->model_count; i++) {
        const nebel_scene_model *x = &a->models[i], *y = &b->models[i];
        SAME(&x->position, &y->position);
        if (!x->is_heightfield) SAME(&x->rotation, &y->rotation);
        if (!x->is_heightfield) SAME(&x->scale, &y->scale);
        if (x->is_heightfield) SAME(&x->size, &y->size);
        if (x->is_heightfield) SAME(&x->height, &y->height);
        WHOLE(x->has_color, y->has_color);
        if (x->has_color) SAME(&x->color, &y->color);
    }
}

/* Directions are made unit ones, which rounds all their numbers alike. */
static void same_lights(const nebel_scene_data *a, const nebel_scene_data *b)
{
    WHOLE(a->light_count, b->light_count);
    for (size_t i = 0; i < a->light_count; i++) {
        const nebel_light *x = &a->lights[i], *y = &b->lights[i];
        SAME(&x->position, &y->position);
        SAME(&x->intensity, &y->intensity);
        SAME(&x->radius, &y->radius);
        SAME(&x->direction, &y->direction);
        SAME(&x->inner_angle, &y->inner_angle);
        SAME(&x->outer_angle, &y->outer_angle);
    }
}

static void same_air(const nebel_atmosphere_component *a, const nebel_atmosphere_component *b)
{
    WHOLE(a->profile, b->profile);
    SAME(&a->scattering, &b->scattering);
    SAME(&a->absorption, &b->absorption);
    WHOLE(a->phase.type, b->phase.type);
    SAME(&a->phase.g, &b->phase.g);
    SAME(&a->scale_height, &b->scale_height);
    SAME(&a->center_height, &b->center_height);
    SAME(&a->half_width, &b->half_width);
}

static void same_clouds(const nebel_cloud_layer *a, const nebel_cloud_layer *b)
{
    WHOLE(a->type, b->type);
    WHOLE(a->seed, b->seed);
    SAME(&a->base, &b->base);
    SAME(&a->top, &b->top);
    SAME(&a->coverage, &b->coverage);
    SAME(&a->extinction, &b->extinction);
    SAME(&a->cell_size, &b->cell_size);
    SAME(&a->erosion, &b->erosion);
    SAME(&a->patchiness, &b->patchiness);
    SAME(&a->droplet_diameter, &b->droplet_diameter);
    SAME(&a->wind, &b->wind);
}

static void same_shells(const nebel_textured_planet_desc *a, const nebel_textured_planet_desc *b)
{
    SAME(&a->rotation_period, &b->rotation_period);
    SAME(&a->land_coverage, &b->land_coverage);
    SAME(&a->atmosphere.height, &b->atmosphere.height);
    SAME(&a->atmosphere.brightness, &b->atmosphere.brightness);
    WHOLE(a->atmosphere.is_disabled, b->atmosphere.is_disabled);
    WHOLE(a->cloud_shell_count, b->cloud_shell_count);
    for (uint32_t i = 0; i < a->cloud_shell_count; i++) {
        const nebel_cloud_shell *x = &a->cloud_shells[i], *y = &b->cloud_shells[i];
        SAME(&x->height, &y->height);
        SAME(&x->rotation_period, &y->rotation_period);
        SAME(&x->color, &y->color);
        SAME(&x->uv_tiling, &y->uv_tiling);
        SAME(&x->gain, &y->gain);
        SAME(&x->coverage, &y->coverage);
    }
}

static void same_planets(const nebel_scene_data *a, const nebel_scene_data *b)
{
    WHOLE(a->planet_count, b->planet_count);
    for (size_t i = 0; i < a->planet_count; i++) {
        const nebel_planet *x = &a->planets[i], *y = &b->planets[i];
        WHOLE(x->model, y->model);
        if (x->model == NEBEL_PLANET_TEXTURED) {
            same_shells(&x->textured_desc, &y->textured_desc);
            continue;
        }
        SAME(&x->atmosphere_desc.ground_albedo, &y->atmosphere_desc.ground_albedo);
        SAME(&x->sun_angular_diameter, &y->sun_angular_diameter);
        WHOLE(x->atmosphere_desc.component_count, y->atmosphere_desc.component_count);
        for (uint32_t k = 0; k < x->atmosphere_desc.component_count; k++)
            same_air(&x->atmosphere_desc.components[k], &y->atmosphere_desc.components[k]);
        WHOLE(x->cloud_layer_count, y->cloud_layer_count);
        for (uint32_t k = 0; k < x->cloud_layer_count; k++) same_clouds(&x->cloud_layers[k], &y->cloud_layers[k]);
    }
}

static void same_data(const nebel_scene_data *a, const nebel_scene_data *b)
{
    same_camera(a, b);
    WHOLE(a->shows_ambient, b->shows_ambient);
    if (!a->shows_ambient) SAME(&a->background, &b->background);
    WHOLE(a->environment.type, b->environment.type);
    if (a->environment.type == NEBEL_ENVIRONMENT_CONSTANT) SAME(&a->ambient, &b->ambient);
    SAME(&a->environment.zenith, &b->environment.zenith);
    SAME(&a->environment.horizon, &b->environment.horizon);
    SAME(&a->environment.ground, &b->environment.ground);
    WHOLE(a->has_sun, b->has_sun);
    if (a->has_sun) SAME(&a->sun_direction, &b->sun_direction);
    if (a->has_sun) SAME(&a->sun_irradiance, &b->sun_irradiance);
    SAME(&a->max_opacity, &b->max_opacity);
    WHOLE(a->diffusion == NULL, b->diffusion == NULL);
    if (a->diffusion != NULL) assert_memory_equal(a->diffusion, b->diffusion, sizeof *a->diffusion);
    same_volumes(a, b);
    same_nebulae(a, b);
    same_cells(a, b);
    same_models(a, b);
    same_lights(a, b);
    same_planets(a, b);
    WHOLE(a->classic == NULL, b->classic == NULL);
    if (a->classic == NULL) return;
    SAME(&a->classic->start, &b->classic->start);
    SAME(&a->classic->end, &b->classic->end);
    SAME(&a->classic->density, &b->classic->density);
    SAME(&a->classic->color, &b->classic->color);
    WHOLE(a->classic->coordinate, b->classic->coordinate);
    WHOLE(a->classic->stage, b->classic->stage);
    WHOLE(a->classic_curve, b->classic_curve);
    if (a->classic_curve == NEBEL_CURVE_TABLE)
        assert_memory_equal(a->classic_table, b->classic_table, NEBEL_CURVE_ENTRIES * sizeof(float));
    WHOLE(a->classic_d3d9 == NULL, b->classic_d3d9 == NULL);
    if (a->classic_d3d9 != NULL) assert_memory_equal(a->classic_d3d9, b->classic_d3d9, sizeof *a->classic_d3d9);
}

/* ---- files ----------------------------------------------------------------------------------- */

static void copy_file(const char *from, const char *to)
{
    static char bytes[1 << 20];
    FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
    if (in == NULL || out == NULL) fail_msg("cannot copy %s to %s", from, to);
    const size_t size = fread(bytes, 1, sizeof bytes, in);
    assert_true(size < sizeof bytes);
    assert_int_equal(fwrite(bytes, 1, size, out), size);
    fclose(in);
    fclose(out);
}

static void check_file(const char *name)
{
    static change c;
    char copy[64] = "/tmp/nebel_round_XXXXXX";
    journal kept = {0};
    nebel_scene *again = NULL;
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    where = name;
    const int file = mkstemp(copy);
    assert_true(file >= 0);
    close(file);
    copy_file(name, copy);
    c = (change){.name_count = 0};
    if (nebel_load_scene(copy, &desc, &c.scene) != NEBEL_OK) fail_msg("%s: %s", name, kept.last);
    c.data = *nebel_get_scene_data(c.scene);
    change_all(&c);
    if (nebel_save_scene(copy, &desc, nebel_get_scene_data(c.scene), &c.data, NULL) != NEBEL_OK ||
        nebel_load_scene(copy, &desc, &again) != NEBEL_OK)
        fail_msg("%s: %s", name, kept.last);
    same_data(nebel_get_scene_data(again), &c.data);
    nebel_destroy_scene(again);
    free_change(&c);
    unlink(copy);
}

/* Without those that need models beside them: gates, points. */
static void test_good_scenes(void **state)
{
    (void)state;
    static const char *const names[] = {
        "examples/scenes/cells-grouped",   "examples/scenes/cells-portals",  "examples/scenes/cells-printed",
        "examples/scenes/cells-seam",      "examples/scenes/clearing",       "examples/scenes/cloud",
        "examples/scenes/curve-table",     "examples/scenes/device-depth",   "examples/scenes/device-range",
        "examples/scenes/forty-volumes",   "examples/scenes/glowing-sphere", "examples/scenes/ground-fog",
        "examples/scenes/linear-plane",    "examples/scenes/linear-radial",  "examples/scenes/morning-mist",
        "examples/scenes/nebula",          "examples/scenes/soft-edges",     "examples/scenes/street-lamps",
        "examples/scenes/sun-shafts",      "examples/scenes/vertex-coarse",  "examples/scenes/vertex-sphere",
        "examples/engines/bevy",           "examples/engines/godot",         "examples/engines/hdrp",
        "examples/engines/unreal",         "fuzz/corpus/scene/camera_keys",  "fuzz/corpus/scene/capsule",
        "fuzz/corpus/scene/cells",         "fuzz/corpus/scene/classic",      "fuzz/corpus/scene/classic_device",
        "fuzz/corpus/scene/classic_table", "fuzz/corpus/scene/colors",       "fuzz/corpus/scene/cone",
        "fuzz/corpus/scene/contract",      "fuzz/corpus/scene/convex",       "fuzz/corpus/scene/presets",
        "fuzz/corpus/scene/cylinder",      "fuzz/corpus/scene/ellipsoid",    "fuzz/corpus/scene/every_import",
        "fuzz/corpus/scene/every_key",     "fuzz/corpus/scene/fog_keys",     "fuzz/corpus/scene/gradient",
        "fuzz/corpus/scene/half_space",    "fuzz/corpus/scene/heightfield",  "fuzz/corpus/scene/import",
        "fuzz/corpus/scene/lights",        "fuzz/corpus/scene/linear",       "fuzz/corpus/scene/minimal",
        "fuzz/corpus/scene/nebula",        "fuzz/corpus/scene/numbers",      "fuzz/corpus/scene/point_light",
        "fuzz/corpus/scene/scattering",    "fuzz/corpus/scene/soft_edge",    "fuzz/corpus/scene/space",
        "fuzz/corpus/scene/sphere_radial", "fuzz/corpus/scene/text",         "fuzz/corpus/scene/turntable",
        "fuzz/corpus/scene/union",         "fuzz/corpus/scene/planet",       "fuzz/corpus/scene/planets",
        "fuzz/corpus/scene/clouds",        "fuzz/corpus/scene/layers",       "examples/scenes/clouds",
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s.json", NEBEL_SOURCE, names[i]);
        check_file(path);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_good_scenes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
