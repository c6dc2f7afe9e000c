#include "file_units.h"

/* ---- numbers --------------------------------------------------------------------------------- */

static void scale_all(double factor, double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) numbers[i] *= factor;
}

static void convert_inverse_lengths(const nb_file_units *space, double rgb[3])
{
    for (int c = 0; c < 3; c++) rgb[c] /= space->unit;
}

static void swap_y_and_z(double vector[3])
{
    const double y = vector[1];
    vector[1] = vector[2];
    vector[2] = y;
}

void nb_file_units_convert_direction(const nb_file_units *space, double direction[3])
{
    if (!space->z_up) return;
    swap_y_and_z(direction);
    direction[2] = -direction[2];
}

void nb_file_units_convert_place(const nb_file_units *space, double place[3])
{
    nb_file_units_convert_direction(space, place);
    scale_all(space->unit, place, 3);
}

/* Lengths along the axes, and scales: without signs. */
static void convert_extents(const nb_file_units *space, double unit, double extents[3])
{
    if (space->z_up) swap_y_and_z(extents);
    scale_all(unit, extents, 3);
}

/* A rotation turns about the same axis by the same angle in either convention. */
void nb_file_units_convert_placement(const nb_file_units *space, double position[3], double rotation[4],
                                     double scale[3])
{
    nb_file_units_convert_place(space, position);
    nb_file_units_convert_direction(space, rotation);
    convert_extents(space, 1, scale);
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* What was the least y is the largest z. */
static void convert_box(const nb_file_units *space, double min[3], double max[3])
{
    nb_file_units_convert_place(space, min);
    nb_file_units_convert_place(space, max);
    if (!space->z_up) return;
    const double near = min[2];
    min[2] = max[2];
    max[2] = near;
}

static void convert_shape(const nb_file_units *space, nebel_shape *shape)
{
    nebel_transform *transform = &shape->transform;
    nb_file_units_convert_placement(space, transform->position, transform->rotation, transform->scale);
    convert_box(space, shape->min, shape->max);
    nb_file_units_convert_place(space, shape->center);
    nb_file_units_convert_place(space, shape->from);
    nb_file_units_convert_place(space, shape->to);
    nb_file_units_convert_place(space, shape->point);
    nb_file_units_convert_direction(space, shape->normal);
    convert_extents(space, space->unit, shape->radii);
    shape->radius *= space->unit;
    shape->radius_from *= space->unit;
    shape->radius_to *= space->unit;
    for (size_t i = 0; i < shape->plane_count; i++) {
        nebel_plane *plane = (nebel_plane *)&shape->planes[i];
        nb_file_units_convert_direction(space, plane->normal);
        plane->distance *= space->unit;
    }
    for (size_t i = 0; i < shape->part_count; i++) convert_shape(space, (nebel_shape *)&shape->parts[i]);
}

static void convert_density(const nb_file_units *space, nebel_density *density)
{
    nb_file_units_convert_place(space, density->from);
    nb_file_units_convert_place(space, density->to);
    nb_file_units_convert_place(space, density->center);
    density->base *= space->unit;
    density->scale_height *= space->unit;
    density->sigma *= space->unit;
    density->edge_width *= space->unit;
    density->radius *= space->unit;
}

void nb_file_units_convert_volume(const nb_file_units *space, nebel_volume_desc *volume)
{
    convert_shape(space, &volume->shape);
    convert_density(space, &volume->density);
    convert_inverse_lengths(space, volume->extinction);
    convert_inverse_lengths(space, volume->emission);
    volume->start *= space->unit;
    volume->cutoff *= space->unit;
}

void nb_file_units_convert_nebula(const nb_file_units *space, nebel_nebula_desc *nebula)
{
    convert_shape(space, &nebula->shape);
    convert_density(space, &nebula->density);
    convert_inverse_lengths(space, nebula->absorption);
    convert_inverse_lengths(space, nebula->emission);
    scale_all(space->unit, nebula->radius_range, 2);
    nebula->turbulence *= space->unit;
    nebula->turbulence_scale *= space->unit;
}

void nb_file_units_convert_cell(const nb_file_units *space, nebel_cell *cell)
{
    convert_shape(space, &cell->shape);
    cell->density /= space->unit;
}

/* Which axis of a box is which: the same both ways. */
static void exchange_axes(const nb_file_units *space, nebel_noise_desc *noise)
{
    const size_t size = noise->size[1];
    if (!space->z_up) return;
    noise->size[1] = noise->size[2];
    noise->size[2] = size;
    swap_y_and_z(noise->frequency);
    swap_y_and_z(noise->falloff);
}

void nb_file_units_convert_noise(const nb_file_units *space, nebel_scene_noise *noise)
{
    exchange_axes(space, &noise->desc);
    nb_file_units_convert_direction(space, noise->velocity);
}

/* ---- camera ---------------------------------------------------------------------------------- */

void nb_file_units_convert_camera(const nb_file_units *space, nebel_camera *camera)
{
    nb_file_units_convert_place(space, camera->position);
    nb_file_units_convert_place(space, camera->look_at);
    nb_file_units_convert_direction(space, camera->up);
    camera->view_height *= space->unit;
}

/* ---- the other way --------------------------------------------------------------------------- */

void nb_file_units_restore_direction(const nb_file_units *space, double direction[3])
{
    if (!space->z_up) return;
    direction[2] = -direction[2];
    swap_y_and_z(direction);
}

void nb_file_units_restore_place(const nb_file_units *space, double place[3])
{
    nb_file_units_restore_direction(space, place);
    for (int i = 0; i < 3; i++) place[i] /= space->unit;
}

void nb_file_units_restore_placement(const nb_file_units *space, double position[3], double rotation[4],
                                     double scale[3])
{
    nb_file_units_restore_place(space, position);
    nb_file_units_restore_direction(space, rotation);
    convert_extents(space, 1, scale);
}

void nb_file_units_restore_camera(const nb_file_units *space, nebel_camera *camera)
{
    nb_file_units_restore_place(space, camera->position);
    nb_file_units_restore_place(space, camera->look_at);
    nb_file_units_restore_direction(space, camera->up);
    camera->view_height /= space->unit;
}

void nb_file_units_restore_shape(const nb_file_units *space, nebel_shape *shape)
{
    nebel_transform *transform = &shape->transform;
    const double back = 1 / space->unit, near = shape->min[2];
    if (space->z_up) {
        shape->min[2] = shape->max[2];
        shape->max[2] = near;
    }
    double *const places[] = {shape->min, shape->max, shape->center, shape->from, shape->to, shape->point};
    nb_file_units_restore_placement(space, transform->position, transform->rotation, transform->scale);
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) nb_file_units_restore_place(space, places[i]);
    nb_file_units_restore_direction(space, shape->normal);
    convert_extents(space, back, shape->radii);
    shape->radius *= back;
    shape->radius_from *= back;
    shape->radius_to *= back;
}

void nb_file_units_restore_plane(const nb_file_units *space, nebel_plane *plane)
{
    nb_file_units_restore_direction(space, plane->normal);
    plane->distance /= space->unit;
}

static void restore_density(const nb_file_units *space, nebel_density *density)
{
    const double back = 1 / space->unit;
    nb_file_units_restore_place(space, density->from);
    nb_file_units_restore_place(space, density->to);
    nb_file_units_restore_place(space, density->center);
    density->base *= back;
    density->scale_height *= back;
    density->sigma *= back;
    density->edge_width *= back;
    density->radius *= back;
}

void nb_file_units_restore_volume(const nb_file_units *space, nebel_volume_desc *volume)
{
    nb_file_units_restore_shape(space, &volume->shape);
    restore_density(space, &volume->density);
    volume->start /= space->unit;
    volume->cutoff /= space->unit;
    scale_all(space->unit, volume->extinction, 3);
    scale_all(space->unit, volume->emission, 3);
}

void nb_file_units_restore_nebula(const nb_file_units *space, nebel_nebula_desc *nebula)
{
    nb_file_units_restore_shape(space, &nebula->shape);
    restore_density(space, &nebula->density);
    scale_all(space->unit, nebula->absorption, 3);
    scale_all(space->unit, nebula->emission, 3);
    scale_all(1 / space->unit, nebula->radius_range, 2);
    nebula->turbulence /= space->unit;
    nebula->turbulence_scale /= space->unit;
}

void nb_file_units_restore_noise(const nb_file_units *space, nebel_scene_noise *noise)
{
    exchange_axes(space, &noise->desc);
    nb_file_units_restore_direction(space, noise->velocity);
}

void nb_file_units_restore_cell(const nb_file_units *space, nebel_cell *cell)
{
    nb_file_units_restore_shape(space, &cell->shape);
    cell->density *= space->unit;
}
