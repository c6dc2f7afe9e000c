/* Sunlit and point-lit fog of which most light comes from a small part of the ray, which steps of any length may pass
 * over. The values are from quadrature in optical depth, made without nebel. */
#ifndef LIT_CASES_H
#define LIT_CASES_H

#include <nebel/light.h>

#include <math.h>

typedef struct lit_case {
    const char *name;
    nebel_volume_desc volume;
    nebel_sun sun;           /* of one colour; none: the point light */
    nebel_light point_light; /* the same */
    nebel_ray ray;
    double right; /* radiance, to six digits */
    double tolerance;
} lit_case;

#define LIT_GRAY(x)                                                                                                    \
    {                                                                                                                  \
        (x), (x), (x)                                                                                                  \
    }
#define LIT_HALF_SPACE                                                                                                 \
    {                                                                                                                  \
        .type = NEBEL_SHAPE_HALF_SPACE, .normal = { 0, 1, 0 }                                                          \
    }

static const nebel_shape lit_cut_ball[] = {
    {.type = NEBEL_SHAPE_SPHERE, .radius = 2},
    {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 1, 1}},
    {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, 0.69, 0}, .normal = {0.1827, 0.7308, -0.6577}}};

static const lit_case lit_cases[] = {
    {"point-lit skin of an opaque ball",
     {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, -1, 0}, .radius = 1},
      .extinction = LIT_GRAY(500),
      .albedo = LIT_GRAY(0.9)},
     .point_light = {.position = {1, 2, 3}, .intensity = LIT_GRAY(100)},
     .ray = {{0, 3, 8}, {-0.851919, -3.5, -7.37258}, HUGE_VAL},
     .right = 0.0138474},
    {"point-lit skin of a dense half space",
     {.shape = LIT_HALF_SPACE, .extinction = LIT_GRAY(1000), .albedo = LIT_GRAY(1)},
     .point_light = {.position = {0, 1, 0}, .intensity = LIT_GRAY(10)},
     .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL},
     .right = 0.397490},
    {"point-lit skin of a denser ball",
     {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, -100, 0}, .radius = 100},
      .extinction = LIT_GRAY(1e5),
      .albedo = LIT_GRAY(1)},
     .point_light = {.position = {0, 1, 0}, .intensity = LIT_GRAY(10)},
     .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL},
     .right = 0.397884},
    {"half space in low sun",
     {.shape = LIT_HALF_SPACE, .extinction = LIT_GRAY(1), .albedo = LIT_GRAY(1)},
     .sun = {{0.9797959, 0.2, 0}, LIT_GRAY(3)},
     .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL},
     .right = 0.0397887},
    {"light that falls off faster than the view",
     {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 0, 1}},
      .extinction = LIT_GRAY(300),
      .albedo = LIT_GRAY(1)},
     .point_light = {.position = {20, 0.4, 0}, .intensity = LIT_GRAY(400)},
     .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL},
     .right = 0.00155991},
    {"the same of the sun",
     {.shape = {.type = NEBEL_SHAPE_CYLINDER, .from = {0, -1000, 0}, .radius = 1000},
      .extinction = LIT_GRAY(1),
      .albedo = LIT_GRAY(1)},
     .sun = {{0.9998, 0.02, 0}, LIT_GRAY(1)},
     .ray = {{0, 5, 0}, {0, -1, 0}, HUGE_VAL},
     .right = 0.00156034,
     .tolerance = 1e-2},
    {"edges between the parts of an intersection",
     {.shape = {.type = NEBEL_SHAPE_INTERSECTION, .parts = lit_cut_ball, .part_count = 3},
      .extinction = LIT_GRAY(0.78),
      .albedo = LIT_GRAY(1)},
     .sun = {{0.6, 0.8, 0}, LIT_GRAY(3)},
     .ray = {{1.28, 4.47, 5}, {-0.30725143, -0.71399379, -0.62913387}, HUGE_VAL},
     .right = 0.0353103},
    {"through a point light's center",
     {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 100},
      .extinction = LIT_GRAY(1e-5),
      .albedo = LIT_GRAY(1),
      .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.6}},
     .point_light = {.intensity = LIT_GRAY(1e6)},
     .ray = {{1.7767116663701477, -1.193014723079912, 4.518850686302743},
             {-0.35534233327402953, 0.2386029446159824, -0.9037701372605487},
             HUGE_VAL},
     .right = 25387.8},
    {"thin fog that scatters forwards",
     {.shape = {.type = NEBEL_SHAPE_CYLINDER, .from = {-1, 0, 0}, .to = {1, 0, 0}, .radius = 1},
      .extinction = LIT_GRAY(1e-8),
      .albedo = LIT_GRAY(1),
      .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.99}},
     .sun = {{1, 0, 0}, LIT_GRAY(1000)},
     .ray = {{-5, 0, 0}, {1, 0, 0}, HUGE_VAL},
     .right = 0.0316718},
    {"a skin of height fog that falls off within centimeters",
     {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 9},
      .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -1, .scale_height = 0.0117037},
      .extinction = LIT_GRAY(0.0559355),
      .albedo = LIT_GRAY(1)},
     .point_light = {.position = {4.431659122665204, 0.0018495523022357856, 5.8790028233358047},
                     .intensity = LIT_GRAY(100)},
     .ray = {{0.54347717654788141, 4.5935905822423626, 0.47292021904311099},
             {0.013280766414853463, -0.71585708322138086, 0.69812051799471631},
             HUGE_VAL},
     .right = 0.142125},
    {"skin of height fog that is thinner than doubles hold, in sunlight",
     {.shape = {.type = NEBEL_SHAPE_HALF_SPACE,
                .point = {-60.778640636456174, 141.67782116745997, -50.12711359884031},
                .normal = {-0.9264651064147505, 0.3763111677430206, 0.007232677774471952}},
      .density = {.type = NEBEL_DENSITY_HEIGHT, .base = 100.41844494867553, .scale_height = 23.02190622372655},
      .extinction = LIT_GRAY(242.585445959635),
      .albedo = LIT_GRAY(0.9)},
     .sun = {{-0.026322916236966823, 0.6553460865924946, -0.7548699297684893}, LIT_GRAY(3)},
     .ray = {{-26.695550142048894, 1620.1763365483564, 122.58804224721499},
             {-0.16156734091721905, -0.9867939065911532, -0.011566341837837538},
             HUGE_VAL},
     .right = 0.117086705},
    {"the same in light of point lights",
     {.shape = {.type = NEBEL_SHAPE_HALF_SPACE,
                .point = {0.043727053540297545, -0.08118920456591822, 0.0013248601215495315},
                .normal = {-0.38328130186150844, 0.8525745309680302, 0.3552634413896124}},
      .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -0.08864509136571357, .scale_height = 0.034945545538534926},
      .extinction = LIT_GRAY(186664.2725005074),
      .albedo = LIT_GRAY(0.9)},
     .point_light = {.position = {-0.7358032998230815, 0.044924904270824545, -0.11355863531623242},
                     .intensity = LIT_GRAY(0.13194580690628488)},
     .ray = {{0.3036247085743811, 0.549514621139114, -0.594819848212661},
             {-0.2673434038927895, -0.49842815534285195, 0.8246798641633847},
             10.485935298702293},
     .right = 0.000132050979},
    {"height fog that a point light outside lights behind most of it",
     {.shape = {.type = NEBEL_SHAPE_HALF_SPACE,
                .point = {-0.20526333777035183, -0.3571261863093753, 0.3988659928572781},
                .normal = {0.7941781996413727, -0.3513159988277254, -0.4958407568787237}},
      .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -0.32066953946309384, .scale_height = 0.044675059980476335},
      .extinction = LIT_GRAY(0.13600894158370677),
      .albedo = LIT_GRAY(0.9)},
     .point_light = {.position = {-0.3234988415264247, -1.4228247123941369, -0.9328285060679556},
                     .intensity = LIT_GRAY(5360.051051541452)},
     .ray = {{-2.995716443505167, -0.40370681545135423, 1.02981463170381},
             {0.9762792319725352, 0.08710550343213139, -0.19822081750147175},
             21.134590626784984},
     .right = 0.109772927},
    {"the outskirts of a gaussian",
     {.shape = {.type = NEBEL_SHAPE_WORLD},
      .density = {.type = NEBEL_DENSITY_GAUSSIAN, .sigma = 0.59},
      .extinction = LIT_GRAY(0.001),
      .albedo = LIT_GRAY(1)},
     .point_light = {.position = {0, 2.19, 0}, .intensity = LIT_GRAY(25)},
     .ray = {{10.76, -1.47, 12.42}, {-0.5687533786137285, -0.02550983553415296, -0.8221124269870205}, HUGE_VAL},
     .right = 9.18e-9},
};

enum { LIT_CASES = sizeof lit_cases / sizeof lit_cases[0] };

#endif
