// Shapes and densities.
#include "widgets.h"
#include "fog_panel.h"
#include "owned_shape.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <string.h>
#include <time.h>

namespace
{

using namespace controls;

const double degree = 3.14159265358979323846 / 180;

/* ---- transforms
 * ------------------------------------------------------------------------------------------------------
 */

bool is_plain(const nebel_transform &t)
{
    return t.position[0] == 0 && t.position[1] == 0 && t.position[2] == 0 && t.rotation[0] == 0 && t.rotation[1] == 0 &&
           t.rotation[2] == 0 && t.scale[0] == t.scale[1] && t.scale[1] == t.scale[2] && fabs(t.scale[0]) <= 1;
}

// A quaternion as turns about y, then the turned x, then the turned z, in degrees: the rotation is Ry Rx Rz.
void find_turns(const double q[4], double turns[3])
{
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double by = length > 0 ? 1 / length : 0;
    const double x = q[0] * by, y = q[1] * by, z = q[2] * by, w = length > 0 ? q[3] * by : 1;
    turns[0] = atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y)) / degree;
    turns[1] = asin(fmax(-1, fmin(1, 2 * (w * x - y * z)))) / degree;
    turns[2] = atan2(2 * (x * y + w * z), 1 - 2 * (x * x + z * z)) / degree;
}

void make_rotation(const double turns[3], double q[4])
{
    const double sy = sin(turns[0] * degree / 2), cy = cos(turns[0] * degree / 2);
    const double sx = sin(turns[1] * degree / 2), cx = cos(turns[1] * degree / 2);
    const double sz = sin(turns[2] * degree / 2), cz = cos(turns[2] * degree / 2);
    q[0] = cy * sx * cz + sy * cx * sz;
    q[1] = sy * cx * cz - cy * sx * sz;
    q[2] = cy * cx * sz - sy * sx * cz;
    q[3] = cy * cx * cz + sy * sx * sz;
}

} // namespace

bool draw_rotation(double rotation[4])
{
    double turns[3];
    find_turns(rotation, turns);
    if (!drag("rotation [deg]", turns, 3, 50, -DBL_MAX, "%.4g",
              "About the vertical, then about the axis to the right, then about the one towards you."))
        return false;
    turns[1] = fmax(-90, fmin(90, turns[1]));
    make_rotation(turns, rotation);
    return true;
}

bool draw_transform(nebel_transform *transform, double reach)
{
    if (!ImGui::TreeNodeEx("transform", is_plain(*transform) ? 0 : ImGuiTreeNodeFlags_DefaultOpen)) {
        note_place("transform");
        return false;
    }
    note_place("transform");
    bool changed = drag_place("position", transform->position, reach, "Moves the shape.");
    changed |= draw_rotation(transform->rotation);
    changed |= drag("scale", transform->scale, 3, 0.1, -DBL_MAX, "%.4g",
                    "Stretches the shape along its axes, before it is turned. Less than 0 mirrors; 0 is not possible.");
    ImGui::TreePop();
    return changed;
}

namespace
{

/* ---- what is made of pieces
 * -------------------------------------------------------------------------------------------
 */

bool draw_planes(nb_panel *panel, nebel_shape *shape, double reach)
{
    bool changed = false;
    size_t gone = shape->plane_count;
    for (size_t i = 0; i < shape->plane_count; i++) {
        const Owner owner("planes", i);
        nebel_plane *const plane = const_cast<nebel_plane *>(&shape->planes[i]);
        changed |= drag("normal", plane->normal, 3, 1, -DBL_MAX, "%.3g",
                        "Which way the plane faces: out of the fog. Its length means nothing.");
        changed |= drag("distance", &plane->distance, 1, reach / 10, -DBL_MAX, "%.4g m",
                        "Where the plane is along its normal: inside where n . x <= distance.");
        ImGui::SameLine();
        if (shape->plane_count > 1 && press("x", "Takes this plane away.")) gone = i;
        ImGui::Separator();
    }
    if (gone < shape->plane_count) {
        nb_shape_remove_plane(shape, gone);
        changed = true;
    }
    if (shape->plane_count < NEBEL_MAX_SHAPE_PLANES &&
        press("Add a plane", "A copy of the last plane, turned round.")) {
        panel->is_out_of_memory |= nb_shape_add_plane(shape) != 0;
        changed = true;
    }
    return changed;
}

bool draw_part(nb_panel *panel, nebel_shape *shape, size_t index, double reach, bool *goes)
{
    const Owner owner("parts", index);
    char title[48];
    snprintf(title, sizeof title, "part %u: %s###part", unsigned(index + 1), nb_shape_title(shape->parts[index].type));
    const bool is_open = ImGui::TreeNodeEx(title, shape->part_count <= 3 ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    note_place("open");
    if (!is_open) return false;
    const bool changed = draw_shape(panel, const_cast<nebel_shape *>(&shape->parts[index]), reach, true);
    *goes = shape->part_count > 1 && press("Remove this part", "Takes the part away. Ctrl + Z brings it back.");
    ImGui::TreePop();
    return changed;
}

bool draw_parts(nb_panel *panel, nebel_shape *shape, double reach)
{
    bool changed = false;
    size_t gone = shape->part_count;
    for (size_t i = 0; i < shape->part_count; i++) {
        bool goes = false;
        changed |= draw_part(panel, shape, i, reach, &goes);
        if (goes) gone = i;
    }
    if (gone < shape->part_count) {
        nb_shape_remove_part(shape, gone);
        changed = true;
    }
    if (shape->part_count < NEBEL_MAX_SHAPE_LEAVES && press("Add a part", "A copy of the last part.")) {
        panel->is_out_of_memory |= nb_shape_add_part(shape) != 0;
        changed = true;
    }
    return changed;
}

/* ---- shapes
 * ----------------------------------------------------------------------------------------------------------
 */

bool draw_axis(nebel_shape *shape, double reach)
{
    bool changed = drag_place("from", shape->from, reach, "One end of the axis.");
    return drag_place("to", shape->to, reach, "The other end of the axis.") || changed;
}

bool draw_numbers(nb_panel *panel, nebel_shape *shape, double reach)
{
    bool changed = false;
    switch (shape->type) {
    case NEBEL_SHAPE_HALF_SPACE:
        changed = drag_place("point", shape->point, reach, "A place in the plane that bounds the fog.");
        return drag("normal", shape->normal, 3, 1, -DBL_MAX, "%.3g", "Which way the plane faces: out of the fog.") ||
               changed;
    case NEBEL_SHAPE_BOX:
        changed = drag_place("min", shape->min, reach, "The lowest corner [m]: less than max in x, y and z.");
        return drag_place("max", shape->max, reach, "The highest corner.") || changed;
    case NEBEL_SHAPE_SPHERE:
        changed = drag_place("center", shape->center, reach, "Where the sphere is.");
        return drag_length("radius", &shape->radius, "From the centre to the surface.") || changed;
    case NEBEL_SHAPE_ELLIPSOID:
        changed = drag_place("center", shape->center, reach, "Where the ellipsoid is.");
        return drag("radii", shape->radii, 3, 0.01, 1e-6, "%.4g", "From the centre along x, y and z.") || changed;
    case NEBEL_SHAPE_CYLINDER:
    case NEBEL_SHAPE_CAPSULE:
        changed = draw_axis(shape, reach);
        return drag_length("radius", &shape->radius, "From the axis to the surface.") || changed;
    case NEBEL_SHAPE_CONE:
        changed = draw_axis(shape, reach);
        changed |= drag("radius from", &shape->radius_from, 1, 0.01, 0, "%.4g m", "At the first end; 0 is a tip.");
        return drag("radius to", &shape->radius_to, 1, 0.01, 0, "%.4g m", "At the other end; 0 is a tip.") || changed;
    case NEBEL_SHAPE_CONVEX:
        return draw_planes(panel, shape, reach);
    case NEBEL_SHAPE_UNION:
    case NEBEL_SHAPE_INTERSECTION:
        return draw_parts(panel, shape, reach);
    default:
        return false;
    }
}

bool choose_shape(nb_panel *panel, nebel_shape *shape, double reach)
{
    const char *titles[NEBEL_SHAPE_COUNT];
    int type = shape->type;
    for (int i = 0; i < NEBEL_SHAPE_COUNT; i++) titles[i] = nb_shape_title(nebel_shape_type(i));
    if (!choose("shape", &type, titles, NEBEL_SHAPE_COUNT, "Where the fog is. Another shape starts where you look at."))
        return false;
    panel->is_out_of_memory |=
        nb_shape_change(shape, nebel_shape_type(type), panel->data->camera.look_at, reach / 4) != 0;
    return true;
}

/* ---- densities
 * -------------------------------------------------------------------------------------------------------
 */

bool draw_height(nebel_density *density, double reach)
{
    static const char *const names[] = {"grows", "constant"};
    int below = density->below;
    bool changed = drag("base", &density->base, 1, reach / 10, -DBL_MAX, "%.4g m",
                        "The height y at which the fog is as thick as its extinction says.");
    changed |= slide("scale height", &density->scale_height, 0.01, 1e4, "%.4g m", true,
                     "How much higher the fog has thinned to 37 %. Ctrl + click types a number in.");
    changed |= choose("below", &below, names, 2, "Whether the fog gets thicker under its base.");
    density->below = nebel_below(below);
    return changed;
}

bool draw_density_numbers(nebel_density *density, double reach)
{
    bool changed = false;
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        return draw_height(density, reach);
    case NEBEL_DENSITY_LINEAR:
        changed = drag_place("none at", density->from, reach, "Where the density is 0.");
        return drag_place("full at", density->to, reach, "Where the density is 1.") || changed;
    case NEBEL_DENSITY_RADIAL:
        return slide_whole("power", &density->power, 1, 3, false,
                           "(1 - r^2)^power from the centre to the surface: more is softer.");
    case NEBEL_DENSITY_GAUSSIAN:
        changed = drag_place("middle", density->center, reach, "Where the fog is thickest.");
        return drag_length("sigma", &density->sigma, "How far from there it has thinned to 61 %.") || changed;
    case NEBEL_DENSITY_SOFT_EDGE:
        return drag_length("edge", &density->edge_width, "How far inside of the surface the fog is full.");
    default:
        return false;
    }
}

// Numbers that another kind of density needs, where they are not yet.
void complete_density(nebel_density *density, const double place[3], double size)
{
    if (!(density->scale_height > 0)) density->scale_height = size;
    if (!(density->sigma > 0)) density->sigma = size;
    if (!(density->edge_width > 0)) density->edge_width = size / 4;
    if (density->power < 1) density->power = 1;
    if (memcmp(density->from, density->to, sizeof density->from) != 0) return;
    memcpy(density->center, place, sizeof density->center);
    memcpy(density->from, place, sizeof density->from);
    memcpy(density->to, place, sizeof density->to);
    density->to[1] += size;
}

/* ---- noise
 * -----------------------------------------------------------------------------------------------------------
 */

// What the scene file allows.
const double least_share = 1e-6, most_motion = 1000;

void limit(double *numbers, int count, double low, double high)
{
    for (int i = 0; i < count; i++) numbers[i] = fmin(fmax(numbers[i], low), high);
}

// A cell has two voxels at least.
bool draw_lattice(nebel_noise_desc *desc)
{
    double size[3];
    for (int i = 0; i < 3; i++) size[i] = double(desc->size[i]);
    bool changed = drag("cells", desc->frequency, 3, 1, 0, "%.4g",
                        "How many there are along each axis of the box: more are smaller. Waves are two cells long, "
                        "cells two voxels at least.");
    for (int i = 0; i < 3; i++) limit(&desc->frequency[i], 1, least_share, size[i] / 2);
    changed |= drag("voxels", size, 3, 10, 1, "%.0f",
                    "Along each axis of the box. More of them show smaller octaves and take longer.");
    for (int i = 0; i < 3; i++) {
        limit(&size[i], 1, fmax(1, ceil(2 * desc->frequency[i])), NEBEL_MAX_GRID_SIZE);
        desc->size[i] = size_t(size[i]);
    }
    return changed;
}

bool draw_octaves(nebel_noise_desc *desc)
{
    int seed = int(desc->seed);
    bool changed = slide_whole("octaves", &desc->octaves, 1, 16, false,
                               "Each has half the size of the one before; those of less than two voxels are left out.");
    changed |= slide("gain", &desc->gain, 0.01, 1, "%.3f", false, "The weight of an octave to that of the one before.");
    changed |= slide("coverage", &desc->coverage, 0.01, 1, "%.3f", false, "The less, the farther apart are the wisps.");
    changed |= drag("soft faces", desc->falloff, 3, 0.2, 0, "%.3g",
                    "Over this part of the box the density rises from 0 on its faces, along each axis; 0.5 at most.");
    changed |= ImGui::DragInt("noise seed", &seed, 0.1f, 0, INT_MAX, "%d", ImGuiSliderFlags_AlwaysClamp);
    note_place("noise seed");
    explain("Another number: other wisps of the same kind.");
    limit(&desc->gain, 1, least_share, 1);
    limit(&desc->coverage, 1, least_share, 1);
    limit(desc->falloff, 3, 0, 0.5);
    desc->seed = uint32_t(seed);
    return changed;
}

bool draw_motion(nebel_scene_noise *noise)
{
    bool changed = drag("velocity", noise->velocity, 3, 0.1, -DBL_MAX, "%.4g", "Wind: in cells for each frame.");
    changed |= drag("evolution", &noise->evolution, 1, 0.1, -DBL_MAX, "%.4g a frame",
                    "At 1 it is another after each frame; smaller octaves change sooner.");
    limit(noise->velocity, 3, -most_motion, most_motion);
    limit(&noise->evolution, 1, -most_motion, most_motion);
    return changed;
}

double now()
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// The density owns its grid.
bool replace_noise(nb_panel *panel, nebel_density *density)
{
    nb_deferred_noise *const held = &panel->held_noise;
    nebel_grid *fresh = nullptr;
    const double start = now();
    const nebel_result result = nebel_update_scene_noise(panel->loaded, density->grid, &held->noise, &fresh);
    held->seconds = now() - start;
    panel->is_out_of_memory |= result == NEBEL_ERROR_MEMORY;
    if (result != NEBEL_OK) return false;
    nebel_release_grid(density->grid);
    density->grid = fresh;
    return true;
}

// Noise that takes longer to be made follows once its control is let go [s].
const double quick_noise = 0.05;

// Other grids are those of a file.
bool draw_noise(nb_panel *panel, nebel_density *density, bool moves)
{
    nb_deferred_noise *const held = &panel->held_noise;
    const unsigned here = ImGui::GetID("noise");
    nebel_scene_noise noise;
    if (!nebel_get_scene_noise(panel->loaded, density->grid, &noise)) return false;
    if (held->owner == here) noise = held->noise;
    bool changed = draw_lattice(&noise.desc);
    changed |= draw_octaves(&noise.desc);
    if (moves) changed |= draw_motion(&noise);
    if (changed) {
        held->owner = here;
        held->noise = noise;
    }
    if (held->owner != here || (ImGui::IsAnyItemActive() && held->seconds > quick_noise)) return false;
    held->owner = 0;
    return replace_noise(panel, density);
}

} // namespace

bool draw_shape(nb_panel *panel, nebel_shape *shape, double reach, bool may_change)
{
    bool changed = may_change && choose_shape(panel, shape, reach);
    changed |= draw_numbers(panel, shape, reach);
    return draw_transform(&shape->transform, reach) || changed;
}

bool draw_density(nb_panel *panel, nebel_density *density, double reach, bool moves)
{
    static const char *const names[] = {"constant", "height", "linear", "radial", "gaussian", "soft edge"};
    int type = density->type;
    if (type == NEBEL_DENSITY_GRID) return draw_noise(panel, density, moves);
    if (type == NEBEL_DENSITY_ALTITUDE) return draw_height(density, reach); // above the ball of the file
    bool changed = choose("density", &type, names, NEBEL_DENSITY_GRID,
                          "How thick the fog is from place to place. Radial is for spheres and ellipsoids; a soft edge "
                          "is not for the world, unions and intersections.");
    if (changed) {
        density->type = nebel_density_type(type);
        complete_density(density, panel->data->camera.look_at, reach / 4);
    }
    return draw_density_numbers(density, reach) || changed;
}
