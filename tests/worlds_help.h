/* Scenes of several planets, and views of them. */
#ifndef WORLDS_HELP_H
#define WORLDS_HELP_H

#include "math/vector.h"

#include <nebel/scene.h>

#include <string.h>

enum { WORLDS_MOST = 3 };

typedef struct worlds {
    size_t count;
    nebel_atmosphere *atmospheres[WORLDS_MOST];
    nebel_planet planets[WORLDS_MOST];
    nebel_scene_data scene;
    nebel_sun sun;
} worlds;

typedef struct worlds_body {
    const char *name;
    double center[3], radius, thickness; /* 0: the preset's; center: of those behind the first */
} worlds_body;

static inline void worlds_make(size_t count, const worlds_body *bodies, const double to_sun[3], double sun_diameter,
                               worlds *s)
{
    *s = (worlds){.count = count, .sun = {.irradiance = {5, 4, 3}}};
    memcpy(s->sun.direction, to_sun, sizeof s->sun.direction);
    assert_true(nb_vector_make_unit(s->sun.direction));
    for (size_t i = 0; i < count; i++) {
        nebel_planet *planet = &s->planets[i];
        planet->atmosphere_desc = *nebel_lookup_atmosphere(bodies[i].name);
        if (bodies[i].radius > 0) planet->atmosphere_desc.radius = bodies[i].radius;
        if (bodies[i].thickness > 0) planet->atmosphere_desc.thickness = bodies[i].thickness;
        for (int c = 0; c < 3 && i > 0; c++)
            planet->atmosphere_desc.ground_point[c] =
                bodies[i].center[c] + (c == 1 ? planet->atmosphere_desc.radius : 0);
        assert_int_equal(nebel_create_atmosphere(&planet->atmosphere_desc, &s->atmospheres[i]), NEBEL_OK);
        planet->atmosphere = s->atmospheres[i];
        planet->sun_angular_diameter = sun_diameter;
    }
    s->scene =
        (nebel_scene_data){.has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = count, .planets = s->planets};
    memcpy(s->scene.sun_direction, s->sun.direction, sizeof s->scene.sun_direction);
}

static inline void worlds_free(worlds *s)
{
    for (size_t i = 0; i < s->count; i++) nebel_destroy_atmosphere(s->atmospheres[i]);
}

static const worlds_body worlds_near[] = {{.name = "earth"},
                                          {.name = "moon", .center = {-4e6, 9e6, -2.4e7}},
                                          {.name = "earth", .center = {-2e6, 6e6, -1.2e7}, .radius = 8e5}};
static const worlds_body worlds_before_sun[] = {{.name = "earth"}, {.name = "moon", .center = {-6e6, 6e6, -2.1e7}}};
static const worlds_body worlds_between[] = {{.name = "earth"}, {.name = "moon", .center = {5e6, 8.66e6, 0}}};
static const worlds_body worlds_of_a_moon[] = {{.name = "moon"}, {.name = "earth", .center = {-1e7, 1.2e7, -3e7}}};

static const struct {
    const char *text;
    size_t count;
    const worlds_body *bodies;
    double sun[3], diameter, height, pitch;
} worlds_views[] = {{"by day", 3, worlds_near, {.8, .6, .2}, .53, 2, .35},
                    {"before the sun", 2, worlds_before_sun, {-6e6, 6e6, -2.1e7}, 3, 2, .25},
                    {"an eclipse from space", 2, worlds_between, {.5, .8660254, 0}, 10, 2e7, -1.5},
                    {"from a moon", 2, worlds_of_a_moon, {.8, .6, .2}, .53, 2, .25}};
enum { WORLDS_VIEWS = sizeof worlds_views / sizeof *worlds_views };

#endif
