/* Clouds in pictures of the CPU: among the air along a ray, behind and before surfaces, on any number of threads. */
#include "render_clouds_help.h"
#include "test_render_scene.h"

static nebel_transfer air_to(const world *w, const nebel_sun *sun, nebel_ray ray, double t)
{
    nebel_transfer transfer;
    ray.t_max = t;
    assert_int_equal(nebel_trace_atmosphere(w->atmosphere, sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    return transfer;
}

/* Air up to t in the shade of clouds. */
static nebel_transfer shaded_to(const world *w, const nebel_sun *sun, const nebel_ray *ray,
                                const nebel_air_shadow *shade, double t)
{
    nebel_transfer transfer = air_to(w, sun, *ray, t);
    for (uint32_t k = 0; k < shade->count && (double)shade->t[k] < t; k++) {
        const nebel_transfer a = air_to(w, sun, *ray, (double)shade->t[k]),
                             b = air_to(w, sun, *ray, fmin(t, (double)shade->t[k + 1]));
        for (int c = 0; c < 3; c++)
            transfer.in_scattering[c] -=
                (1 - (double)shade->transmittance[k][c]) * (b.in_scattering[c] - a.in_scattering[c]);
    }
    return transfer;
}

/* The table of air in pictures is off by up to 2.7e-2 for rays that end in it. Clouds and air in short pieces: sum of T_air dS_cloud + T_cloud dS_air, with clouds as a straight line between nodes. */
static void compose(const world *w, const nebel_sun *sun, const nebel_ray *ray, const nebel_cloud_transfer *nodes,
                    const nebel_air_shadow *shade, double light[3])
{
    enum { STEPS = 24 };
    const nebel_transfer all = shaded_to(w, sun, ray, shade, HUGE_VAL);
    const uint32_t last = nodes->count - 1;
    nebel_transfer before = shaded_to(w, sun, ray, shade, nodes->count > 0 ? (double)nodes->t[0] : 0);
    for (int c = 0; c < 3; c++) light[c] = nodes->count > 0 ? before.in_scattering[c] : 0;
    for (uint32_t k = 1; k < nodes->count; k++)
        for (int i = 1; i <= STEPS; i++) {
            const double part = (double)i / STEPS,
                         t = (double)nodes->t[k - 1] * (1 - part) + (double)nodes->t[k] * part;
            const double left = (double)nodes->transmittance[k - 1] +
                                (part - .5 / STEPS) * (double)(nodes->transmittance[k] - nodes->transmittance[k - 1]);
            const nebel_transfer here = shaded_to(w, sun, ray, shade, t);
            for (int c = 0; c < 3; c++)
                light[c] += left * (here.in_scattering[c] - before.in_scattering[c]) +
                            .5 * (here.transmittance[c] + before.transmittance[c]) / STEPS *
                                (double)(nodes->in_scattering[k][c] - nodes->in_scattering[k - 1][c]);
            before = here;
        }
    for (int c = 0; c < 3; c++)
        light[c] += (nodes->count > 0 ? (double)nodes->transmittance[last] : 1) *
                    (all.in_scattering[c] - (nodes->count > 0 ? before.in_scattering[c] : 0));
}

static void clouds_and_air_are_one(void **state)
{
    (void)state;
    static const struct {
        double height, pitch;
    } views[] = {{2, .4}, {1500, .1}, {9000, -.5}};
    world w;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    make_world(&(nebel_cloud_layer){.coverage = .5, .extinction = .01}, &w);
    nebel_sun sun = {.irradiance = {5, 4, 3}};
    memcpy(sun.direction, w.scene.sun_direction, sizeof sun.direction);
    assert_int_equal(nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = w.clouds, .sun = sun}, &view),
                     NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        const nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        test_picture picture = render(&w, &camera, 2, 1, 0);
        const double spread = 2 * tan(30 * test_pi / 180) / HEIGHT;
        double worst = 0;
        size_t cloudy = 0;
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            if (!nb_test_tries(i, WIDTH * HEIGHT)) continue;
            const nebel_ray ray = planet_ray(&camera, views[v].pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
            const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
            nebel_cloud_transfer nodes;
            nebel_air_shadow shade;
            double light[3];
            assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, &ray, 0, &shade, 0), NEBEL_OK);
            assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, spread / length, NULL, &nodes, 0), NEBEL_OK);
            compose(&w, &sun, &ray, &nodes, &shade, light);
            cloudy += nodes.count > 0;
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)picture.planes.in_scattering[3 * i + (uint32_t)c] - light[c]));
        }
        print_message("from %g m: %zu pixels with clouds, off by %.2g at most\n", views[v].height, cloudy, worst);
        assert_true(cloudy > nb_test_count(WIDTH * HEIGHT) / 16 && worst < 3e-2);
        test_picture_free(&picture);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    free_world(&w);
}

/* Bits are the same on any number of threads; time moves clouds that have wind, and a second sample changes little. */
static void pictures_are_still(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.wind = {300, 0}}, &w);
    const nebel_camera camera = planet_camera(2, .4);
    test_picture pictures[3] = {render(&w, &camera, 1, 1, 0), render(&w, &camera, 3, 1, 0),
                                render(&w, &camera, 2, 1, 7)};
    const size_t size = (size_t)WIDTH * HEIGHT * 3;
    double moved = 0;
    assert_memory_equal(pictures[0].planes.color, pictures[1].planes.color, size * sizeof(float));
    for (size_t i = 0; i < size; i++)
        moved = fmax(moved, fabs((double)pictures[0].planes.color[i] - (double)pictures[2].planes.color[i]));
    assert_true(moved > .1);
    for (int i = 0; i < 3; i++) test_picture_free(&pictures[i]);
    free_world(&w);
}

/* A wall that stands in clouds is seen through as much of them as a ray to it meets, also beside its edge. */
static void clouds_end_at_surfaces(void **state)
{
    (void)state;
    static const float corners[4][3] = {{-3e3f, -3e3f, 0}, {0, -3e3f, 0}, {0, 3e3f, 0}, {-3e3f, 3e3f, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const double height = 1500, way = 2000;
    world w;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    make_world(&(nebel_cloud_layer){.coverage = .9, .extinction = .002}, &w);
    const nebel_mesh wall = {.origin = {0, height, -way},
                             .positions = corners[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .base_color = {1, 1, 1},
                             .texture = -1};
    w.scene.mesh_count = 1;
    w.scene.meshes = &wall;
    nebel_sun sun = {.irradiance = {5, 4, 3}};
    memcpy(sun.direction, w.scene.sun_direction, sizeof sun.direction);
    assert_int_equal(nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = w.clouds, .sun = sun}, &view),
                     NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    const nebel_camera camera = planet_camera(height, 0);
    test_picture picture = render(&w, &camera, 2, 4, 0);
    double worst = 0;
    int cloudy = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        nebel_ray ray = planet_ray(&camera, 0, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
        nebel_cloud_transfer nodes;
        if (i % WIDTH >= WIDTH / 2) continue;
        ray.t_max = way * length / fabs(ray.direction[2]);
        assert_int_equal(
            nebel_trace_clouds(workspace, 1, &ray, 0, 2 * tan(30 * test_pi / 180) / HEIGHT / length, NULL, &nodes, 0),
            NEBEL_OK);
        const double left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
        const nebel_transfer air = air_to(&w, &sun, ray, ray.t_max);
        cloudy += left > .05 && left < .95;
        worst = fmax(worst, fabs((double)picture.planes.transmittance[3 * i + 1] - left * air.transmittance[1]));
    }
    print_message("a wall in clouds: %d pixels see it through some, off by %.2g at most\n", cloudy, worst);
    assert_true(cloudy > 60 && worst < 1e-2);
    test_picture_free(&picture);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    free_world(&w);
}

typedef struct ball {
    double center[3], radius, extinction;
} ball;

static const double shine[3] = {2, 1.5, 1};

static nebel_lighting *make_ball(const ball *b)
{
    nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = b->radius}};
    for (int c = 0; c < 3; c++) {
        volume.shape.center[c] = b->center[c];
        volume.extinction[c] = b->extinction;
        volume.source[c] = shine[c];
    }
    return fog_commit_lit(&(nebel_fog_desc){0}, &volume, 1, NULL);
}

/* Where a ray of length 1 is in the ball: the root of a quadratic. */
static void meet_ball(const ball *b, const nebel_ray *ray, double ends[2])
{
    double along = 0, square = 0;
    for (int c = 0; c < 3; c++) {
        along += (b->center[c] - ray->origin[c]) * ray->direction[c];
        square += pow(b->center[c] - ray->origin[c], 2);
    }
    const double half = sqrt(fmax(0, b->radius * b->radius - square + along * along));
    ends[0] = fmax(0, along - half);
    ends[1] = fmax(0, along + half);
}

static int ascend(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Clouds, straight between nodes, and the ball: T_ball dS_cloud + T_cloud dS_ball in short pieces between all places where either
 * begins to change. */
static void compose_ball(const ball *b, const nebel_ray *ray, const nebel_cloud_transfer *nodes, double light[3])
{
    enum { STEPS = 200 };
    double ends[2], places[NEBEL_MAX_CLOUD_NODES + 3] = {0};
    uint32_t count = 1, next = 0;
    meet_ball(b, ray, ends);
    for (uint32_t k = 0; k < nodes->count; k++) places[count++] = (double)nodes->t[k];
    for (int i = 0; i < 2; i++) places[count++] = ends[i];
    qsort(places, count, sizeof *places, ascend);
    memset(light, 0, 3 * sizeof *light);
    for (uint32_t p = 0; p + 1 < count; p++) {
        const double step = (places[p + 1] - places[p]) / STEPS, middle = .5 * (places[p] + places[p + 1]);
        while (next < nodes->count && (double)nodes->t[next] < middle) next++;
        const uint32_t k = next > 0 ? next - 1 : 0;
        const int among = next > 0 && next < nodes->count;
        const double way = among ? (double)nodes->t[next] - (double)nodes->t[k] : 1;
        for (int i = 0; i < STEPS; i++) {
            const double t = places[p] + (i + .5) * step, part = (t - (double)nodes->t[k]) / way;
            const double left = exp(-b->extinction * fmax(0, fmin(t, ends[1]) - ends[0]));
            double cloud = next > 0 ? (double)nodes->transmittance[k] : 1;
            if (among) cloud += part * (double)(nodes->transmittance[next] - nodes->transmittance[k]);
            for (int c = 0; c < 3; c++) {
                if (t > ends[0] && t < ends[1]) light[c] += step * cloud * left * b->extinction * shine[c];
                if (among)
                    light[c] +=
                        step / way * left * (double)(nodes->in_scattering[next][c] - nodes->in_scattering[k][c]);
            }
        }
    }
}

typedef struct off {
    double most, beyond; /* beyond: what is told */
    int both;
} off;

/* Steps through clouds may lie elsewhere as the last digit of a ray does. Whether they do not: those of a few rays that differ in it
 * are alike, and the picture without fog shows them. */
static int have_same_nodes(nebel_cloud_workspace *workspace, const nebel_ray *ray, double spread, const float shown[3],
                           double tolerance, nebel_cloud_transfer *nodes)
{
    enum { OTHERS = 6 };
    assert_int_equal(nebel_trace_clouds(workspace, 1, ray, 0, spread, NULL, nodes, 0), NEBEL_OK);
    for (int i = 0; i < OTHERS; i++) {
        nebel_ray other = *ray;
        nebel_cloud_transfer its;
        other.direction[i % 3] *= 1 + (i < 3 ? 1e-13 : -1e-13);
        assert_int_equal(nebel_trace_clouds(workspace, 1, &other, 0, spread, NULL, &its, 0), NEBEL_OK);
        if (its.count != nodes->count) return 0;
        for (uint32_t k = 0; k < its.count; k++)
            if (fabs((double)its.t[k] / (double)nodes->t[k] - 1) > 1e-6 ||
                fabs((double)its.transmittance[k] - (double)nodes->transmittance[k]) > 1e-6)
                return 0;
    }
    for (int c = 0; c < 3 && nodes->count > 0; c++)
        if (fabs((double)shown[c] - (double)nodes->in_scattering[nodes->count - 1][c]) > tolerance) return 0;
    return nodes->count > 0;
}

/* Air adds its light, and takes some of what is behind it. */
static void compare_ball(const world *w, const ball *b, nebel_cloud_workspace *workspace, const test_picture *picture,
                         const test_picture *clear, const nebel_camera *camera, off *is)
{
    const nebel_sun sun = {
        .direction = {w->scene.sun_direction[0], w->scene.sun_direction[1], w->scene.sun_direction[2]},
        .irradiance = {5, 4, 3}};
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        if (!nb_test_tries(i, WIDTH * HEIGHT)) continue;
        nebel_ray ray = planet_ray(camera, .4, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
        const double spread = 2 * tan(30 * test_pi / 180) / HEIGHT / length;
        nebel_cloud_transfer nodes;
        double light[3], ends[2];
        nebel_ray unit = ray;
        for (int c = 0; c < 3; c++) unit.direction[c] /= length;
        meet_ball(b, &unit, ends);
        if (!(ends[1] > ends[0])) continue;
        const nebel_transfer air = air_to(w, &sun, ray, HUGE_VAL);
        if (!have_same_nodes(workspace, &ray, spread, clear->planes.in_scattering + 3 * i, 1e-4 + air.in_scattering[0],
                             &nodes))
            continue;
        compose_ball(b, &unit, &nodes, light);
        is->both++;
        for (int c = 0; c < 3; c++) {
            const double far = fabs((double)picture->planes.in_scattering[3 * i + (uint32_t)c] - light[c]);
            is->most = fmax(is->most, far);
            is->beyond = fmax(is->beyond, far - (double)picture->planes.error[i] - air.in_scattering[c] -
                                              (1 - air.transmittance[c]) * light[c]);
        }
    }
}

/* A shining ball before, in and behind clouds, in air so thin that it hardly counts. */
static void fog_lies_among_clouds(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        ball ball;
        double cloud;
    } cases[] = {{"before", {{0, 350, -900}, 300, 3e-3}, .02},
                 {"half in thick", {{0, 1100, -2600}, 600, 3e-3}, .02},
                 {"half in thin", {{0, 1100, -2600}, 600, 3e-3}, .001},
                 {"within thin", {{0, 1800, -3600}, 800, 3e-3}, .001},
                 {"behind thin", {{0, 5200, -12000}, 2000, 1e-3}, .001}};
    const size_t count = sizeof cases / sizeof *cases;
    const nebel_camera camera = planet_camera(2, .4);
    world w;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    test_picture clear;
    for (size_t v = 0; v < count; v++) {
        off is = {0};
        if (v == 0 || cases[v].cloud != cases[v - 1].cloud) {
            make_world_in(1e-4, &(nebel_cloud_layer){.coverage = .8, .extinction = cases[v].cloud}, &w);
            nebel_cloud_lighting_desc desc = {.clouds = w.clouds, .sun = {.irradiance = {5, 4, 3}}};
            memcpy(desc.sun.direction, w.scene.sun_direction, sizeof desc.sun.direction);
            assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
            assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
            clear = render(&w, &camera, 2, 1, 0);
        }
        nebel_lighting *const fog = make_ball(&cases[v].ball);
        test_picture picture = render_in(&w, fog, &camera, 2, 1, 0);
        compare_ball(&w, &cases[v].ball, workspace, &picture, &clear, &camera, &is);
        print_message("a ball %s clouds: %d pixels with both, off by %.2g at most, %.2g beyond what is told\n",
                      cases[v].name, is.both, is.most, is.beyond);
        assert_true(is.both > (int)nb_test_count(20) && is.most < 6e-3 &&
                    is.beyond < 1e-4); /* the tolerance, 2e-3, times light up to 2, and that of haze */
        test_picture_free(&picture);
        nebel_release_lighting(fog);
        if (v + 1 < count && cases[v].cloud == cases[v + 1].cloud) continue;
        test_picture_free(&clear);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        free_world(&w);
    }
}

/* Where the light is in the mean that a ball adds, in pixels. */
static void find_center(const world *w, nebel_lighting *fog, uint32_t samples, double center[2])
{
    const nebel_camera camera = planet_camera(2, .4);
    test_picture picture = render_in(w, fog, &camera, 2, samples, 0), clear = render(w, &camera, 2, samples, 0);
    double sum = 0;
    center[0] = center[1] = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        const double more = (double)picture.planes.color[3 * i] - (double)clear.planes.color[3 * i];
        sum += more;
        center[0] += more * (i % WIDTH);
        center[1] += more * (double)(i / WIDTH);
    }
    for (int c = 0; c < 2; c++) center[c] /= sum;
    test_picture_free(&picture);
    test_picture_free(&clear);
}

/* The first of several samples is beside the middle of its pixel, where clouds are found. */
static void samples_leave_fog_before_clouds_where_it_is(void **state)
{
    (void)state;
    double one[2], several[2];
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, &w);
    nebel_lighting *const fog = make_ball(&(ball){{0, 200, -600}, 150, 6e-3});
    find_center(&w, fog, 1, one);
    find_center(&w, fog, 4, several);
    print_message("a ball before closed clouds: at %.3f %.3f, of 4 samples at %.3f %.3f\n", one[0], one[1], several[0],
                  several[1]);
    for (int c = 0; c < 2; c++) assert_true(fabs(several[c] - one[c]) < .05);
    nebel_release_lighting(fog);
    free_world(&w);
}

/* Of a row's pixels in the mean, of red. */
static double row_light(const test_picture *picture, int y)
{
    double sum = 0;
    for (int x = 0; x < WIDTH; x++) sum += (double)picture->planes.color[3 * (y * WIDTH + x)];
    return sum / WIDTH;
}

/* Closed clouds hide a dusk: no row stands out, wherever in a pixel the horizon lies; the air is a tenth brighter there at most. */
static void dusk_does_not_shine_through_at_the_horizon(void **state)
{
    (void)state;
    double most = 0;
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, &w);
    memcpy(w.scene.sun_direction, (const double[3]){.2, -.07, -.98}, sizeof w.scene.sun_direction);
    for (int i = 0; i < 8; i++) {
        if (!nb_test_tries((size_t)i, 8)) continue;
        const nebel_camera camera = planet_camera(60, .125 * i * 2 * tan(30 * test_pi / 180) / HEIGHT);
        test_picture picture = render(&w, &camera, 2, 4, 0);
        for (int y = 1; y + 1 < HEIGHT; y++)
            most = fmax(most, row_light(&picture, y) / fmax(row_light(&picture, y - 1), row_light(&picture, y + 1)));
        test_picture_free(&picture);
    }
    print_message("under closed clouds at dusk a row has %.3f of the light of those beside it at most\n", most);
    assert_true(most < 1.1);
    free_world(&w);
}

/* By how much the pixel that stands out most is darker or brighter than all eight around it, of light. */
static double find_dot(const test_picture *picture)
{
    double most = 0;
    for (int i = 0; i < (HEIGHT - 2) * (WIDTH - 2) * 3; i++) {
        const int x = 1 + i / 3 % (WIDTH - 2), y = 1 + i / 3 / (WIDTH - 2), c = i % 3;
        const float *const here = picture->planes.color + 3 * (y * WIDTH + x) + c;
        double low = HUGE_VAL, high = 0;
        for (int k = 0; k < 9; k++) {
            const double there = (double)here[3 * ((k / 3 - 1) * WIDTH + k % 3 - 1)];
            if (k == 4) continue;
            low = fmin(low, there);
            high = fmax(high, there);
        }
        most = fmax(most, fmax(low - (double)*here, (double)*here - high));
    }
    return most;
}

/* The standard deviation of a picture's light. */
static double find_spread(const test_picture *picture)
{
    double sum = 0, square = 0;
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
        const double light = (double)picture->planes.color[i];
        sum += light / (WIDTH * HEIGHT * 3);
        square += light * light / (WIDTH * HEIGHT * 3);
    }
    return sqrt(square - sum * sum);
}

/* From orbit the next row's sheet lies farther off than it is deep, and mist below it. */
static void sheets_over_mist_have_no_dots(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .base = 1500, .coverage = .5}, &w);
    memcpy(w.scene.sun_direction, (const double[3]){.927, .046, -.371}, sizeof w.scene.sun_direction);
    nebel_lighting *const mist = planet_mist(w.planet.atmosphere_desc.radius, w.scene.sun_direction);
    nebel_camera camera = planet_camera(3e5, -.55);
    camera.vertical_fov = 10;
    test_picture picture = render_in(&w, mist, &camera, 2, 1, 0);
    const double dot = find_dot(&picture);
    const double spread = find_spread(&picture);
    print_message("a sheet over mist: no pixel stands out by %.4g of light, %.3g of its standard deviation\n", dot,
                  dot / spread);
    assert_true(dot < .25 * spread);
    test_picture_free(&picture);
    nebel_release_lighting(mist);
    free_world(&w);
}

/* From orbit closed clouds hide the ground up to its edge, whatever samples meet beside the middles of pixels: on the way to
 * the ground seen aslant they lie within less than a pixel. */
static void clouds_hide_the_ground_from_orbit(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, &w);
    const double height = 4e5, dip = acos(w.planet.atmosphere_desc.radius / (w.planet.atmosphere_desc.radius + height));
    nebel_camera camera = planet_camera(height, -dip - .05);
    camera.vertical_fov = 9;
    test_picture picture = render(&w, &camera, 2, 4, 0);
    int ground = 0, sky = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const float left = picture.planes.transmittance[3 * ((size_t)y * WIDTH + x)];
            if (test_depth(&picture, x, y) < HUGE_VALF) {
                ground++;
                assert_true(left < .1f);
            } else {
                sky += left > .5f;
            }
        }
    assert_true(ground > WIDTH * HEIGHT / 3 && sky > WIDTH * HEIGHT / 20);
    test_picture_free(&picture);
    free_world(&w);
}

static void the_ground_has_shadows(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.coverage = .5}, &w);
    w.planet.atmosphere_desc.ground_albedo[1] = .5;
    const nebel_camera camera = planet_camera(800, -.6);
    test_picture picture = render(&w, &camera, 2, 1, 0);
    double darkest = HUGE_VAL, brightest = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
        darkest = fmin(darkest, (double)picture.planes.color[3 * i + 1]);
        brightest = fmax(brightest, (double)picture.planes.color[3 * i + 1]);
    }
    assert_true(brightest > 2 * darkest);
    test_picture_free(&picture);
    free_world(&w);
}

/* A black wall under clouds. */
static test_picture render_wall(world *w, double way, const nebel_camera *camera)
{
    static const float corners[4][3] = {{-3e4f, -3e4f, 0}, {3e4f, -3e4f, 0}, {3e4f, 3e4f, 0}, {-3e4f, 3e4f, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const nebel_mesh wall = {.origin = {0, 0, -way},
                             .positions = corners[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .texture = -1};
    w->scene.mesh_count = 1;
    w->scene.meshes = &wall;
    return render(w, camera, 2, 1, 0);
}

/* Of sunlight straight down: the optical depth in short steps, and the slab of delta-Eddington's slab (Joseph, Wiscombe and Weinman 1976). */
static double let_through(const nebel_clouds *clouds, double x, double z)
{
    enum { STEPS = 200 };
    const double g = .86, wide = g / (1 + g), low = 1500, high = 2500;
    double depth = 0;
    for (int i = 0; i < STEPS; i++) {
        const double place[1][3] = {{x, low + (high - low) * (i + .5) / STEPS, z}};
        float extinction;
        assert_int_equal(nebel_compute_cloud_extinction(clouds, 0, 0, 1, place, 0, &extinction), NEBEL_OK);
        depth += (double)extinction * (high - low) / STEPS;
    }
    const double apart = (1 - g * g) * depth;
    return (5 - exp(-apart)) / (4 + 3 * (1 - wide) * apart);
}

/* Under closed clouds air before a wall has that part of its light which they let through from above, where the sun is, too. */
static void air_under_clouds_is_dim(void **state)
{
    (void)state;
    enum { PLACES = 24 };
    const double way = 4000;
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .base = 1500, .top = 2500, .coverage = 1}, &w);
    memcpy(w.scene.sun_direction, (const double[3]){0, 1, 0}, sizeof w.scene.sun_direction);
    const nebel_camera camera = planet_camera(100, 0);
    test_picture under = render_wall(&w, way, &camera);
    w.planet.clouds = NULL;
    test_picture clear = render_wall(&w, way, &camera);
    w.planet.clouds = w.clouds;
    double sum[3] = {0, 0, 0}, of[3] = {0, 0, 0}, through = 0;
    int count = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const size_t i = (size_t)y * WIDTH + x;
            const nebel_ray ray = planet_ray(&camera, 0, x, y, WIDTH, HEIGHT);
            if (clear.planes.depth[i] < 3900 || ray.direction[1] > .3) continue; /* the ground; clouds */
            for (int c = 0; c < 3; c++) {
                sum[c] += (double)under.planes.in_scattering[3 * i + (size_t)c];
                of[c] += (double)clear.planes.in_scattering[3 * i + (size_t)c];
            }
            for (int k = 0; k < PLACES && y == HEIGHT / 2; k++, count++) {
                const double t = way * (k + .5) / PLACES;
                through += let_through(w.clouds, t * ray.direction[0], t * ray.direction[2]);
            }
        }
    through /= count;
    print_message("closed clouds let %.3f through; air has %.3f %.3f %.3f of its light\n", through, sum[0] / of[0],
                  sum[1] / of[1], sum[2] / of[2]);
    assert_true(count > 0 && through < .5);
    for (int c = 0; c < 3; c++) assert_true(fabs(sum[c] / of[c] / through - 1) < .1);
    test_picture_free(&under);
    test_picture_free(&clear);
    free_world(&w);
}

/* What a surface sends out, without haze. */
static double light_of(const test_picture *picture, size_t i, int c)
{
    const size_t k = 3 * i + (size_t)c;
    return ((double)picture->planes.color[k] - (double)picture->planes.in_scattering[k]) /
           (double)picture->planes.transmittance[k];
}

/* Of what is as far around a place as clouds are above it. */
static double let_through_around(const nebel_clouds *clouds, double x, double z)
{
    enum { ACROSS = 8 };
    double sum = 0;
    for (int i = 0; i < ACROSS * ACROSS; i++)
        sum += let_through(clouds, x + 1500 * ((i % ACROSS + .5) / ACROSS - .5),
                           z + 1500 * ((int)(i / ACROSS) + .5 - .5 * ACROSS) / ACROSS);
    return sum / (ACROSS * ACROSS);
}

/* A wall that faces away from a low sun, and the ground in its shadow, under closed clouds: they have that part of the sky's light
 * which comes through from above. */
static void surfaces_under_clouds_have_less_sky(void **state)
{
    (void)state;
    static const float corners[4][3] = {{-3e4f, 0, 0}, {3e4f, 0, 0}, {3e4f, 500, 0}, {-3e4f, 500, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const nebel_mesh wall = {.origin = {0, 0, -2000},
                             .positions = corners[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .base_color = {.8f, .8f, .8f},
                             .texture = -1};
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .base = 1500, .top = 2500, .coverage = 1}, &w);
    memcpy(w.scene.sun_direction, (const double[3]){0, .17, -.985}, sizeof w.scene.sun_direction);
    for (int c = 0; c < 3; c++) w.planet.atmosphere_desc.ground_albedo[c] = .5;
    nebel_environment_map *const map = planet_even_sky(&w.scene);
    w.scene.mesh_count = 1;
    w.scene.meshes = &wall;
    const nebel_camera camera = planet_camera(100, 0);
    test_picture under = render(&w, &camera, 2, 1, 0);
    w.planet.clouds = NULL;
    test_picture clear = render(&w, &camera, 2, 1, 0);
    w.planet.clouds = w.clouds;
    double worst[2] = {0, 0}, mean[2] = {0, 0}, darkest = 1;
    int count[2] = {0, 0};
    for (uint32_t i = 3; i < WIDTH * HEIGHT; i += 7) {
        if (!nb_test_tries(i / 7, WIDTH * HEIGHT / 7)) continue;
        const nebel_ray ray = planet_ray(&camera, 0, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        const int is_wall = ray.direction[1] > -.04; /* z is -1: the wall stands on -.05 */
        const double t = is_wall ? 2000 : -100 / ray.direction[1];
        if (ray.direction[1] > .18 || fabs(ray.direction[1] + .05) < .01) continue;
        const double through = let_through_around(w.clouds, t * ray.direction[0], -t);
        for (int c = 0; c < 3; c++) {
            const double is = light_of(&under, i, c) / light_of(&clear, i, c) / through;
            worst[is_wall] = fmax(worst[is_wall], fabs(is - 1));
            mean[is_wall] += is / 3;
        }
        darkest = fmin(darkest, through);
        count[is_wall]++;
    }
    print_message(
        "of the sky %.3f and more comes through; %d places of a wall have %.3f of that in the mean, but for %.3f; "
        "%d of the ground %.3f, but for %.3f\n",
        darkest, count[1], mean[1] / count[1], worst[1], count[0], mean[0] / count[0], worst[0]);
    assert_true(count[0] > (int)nb_test_count(30) && count[1] > (int)nb_test_count(10) && darkest < .6);
    for (int k = 0; k < 2; k++) assert_true(fabs(mean[k] / count[k] - 1) < .1 && worst[k] < .15);
    test_picture_free(&under);
    test_picture_free(&clear);
    nebel_release_environment_map(map);
    free_world(&w);
}

/* Where the weather has no clouds, all is as without them, to the last bit. */
static void no_clouds_change_nothing(void **state)
{
    (void)state;
    static const float none = 0;
    world w;
    make_world(&(nebel_cloud_layer){.weather_map = {1, 1, 1, &none}}, &w);
    const nebel_camera camera = planet_camera(2, .4);
    test_picture with = render_wall(&w, 4000, &camera); /* with it both have tables for rays that end in the air */
    w.planet.clouds = NULL;
    test_picture without = render_wall(&w, 4000, &camera);
    w.planet.clouds = w.clouds;
    assert_memory_equal(with.planes.color, without.planes.color, (size_t)WIDTH * HEIGHT * 3 * sizeof(float));
    test_picture_free(&with);
    test_picture_free(&without);
    free_world(&w);
}

static void bad_times_are_refused(void **state)
{
    (void)state;
    world w;
    nebel_renderer *renderer;
    make_world(&(nebel_cloud_layer){.seed = 1}, &w);
    test_picture picture = test_picture_make(WIDTH, HEIGHT);
    assert_int_equal(
        nebel_create_cpu_renderer(&w.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer), NEBEL_OK);
    nebel_frame_desc desc = {
        .camera = planet_camera(2, 0), .width = WIDTH, .height = HEIGHT, .samples = 1, .time = (double)NAN};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_ERROR_VALUE);
    desc.time = 0;
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    test_picture_free(&picture);
    free_world(&w);
}

static double mean_change(const test_picture *a, const test_picture *b)
{
    double sum = 0;
    for (size_t i = 0; i < (size_t)3 * WIDTH * HEIGHT; i++)
        sum += fabs((double)(a->planes.color[i] - b->planes.color[i])) / (3 * WIDTH * HEIGHT);
    return sum;
}

/* Through the base and the top of a sheet, and to where pixels are wider than it is high, pictures change by as much as those before
 * or behind them do: where something were switched one of them would stand out. */
static void a_flight_through_clouds_has_no_jump(void **state)
{
    (void)state;
    enum { FRAMES = 10, FEWEST = 2 };
    const int frames = nb_test_count(FRAMES) > FEWEST ? (int)nb_test_count(FRAMES) : FEWEST;
    static const double begins[] = {290, 790, 2e5}, steps[] = {2, 2, 500};
    world w;
    make_world(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS}, &w);
    nebel_renderer *const renderer = create_renderer(&w, NULL, 2);
    for (int k = 0; k < 3; k++) {
        double changes[FRAMES];
        test_picture last = {0};
        for (int i = 0; i <= frames; i++) {
            const double height = begins[k] + i * steps[k];
            const nebel_camera camera = planet_camera(height, -acos(6.36e6 / (6.36e6 + height)) - .2);
            test_picture next = render_frame(renderer, &camera, 1, 0);
            if (i > 0) changes[i - 1] = mean_change(&last, &next);
            if (i > 0) test_picture_free(&last);
            last = next;
        }
        test_picture_free(&last);
        print_message("from %g m by %g m: changes of", begins[k], steps[k]);
        for (int i = 0; i < frames; i++) print_message(" %.2g", changes[i]);
        print_message("\n");
        for (int i = 0; i < frames; i++) {
            const double before = i > 0 ? changes[i - 1] : 0, behind = i < frames - 1 ? changes[i + 1] : 0;
            assert_true(changes[i] > 0 && changes[i] < 2.5e-3 && changes[i] < 1.5 * fmax(before, behind));
        }
    }
    nebel_destroy_renderer(renderer);
    free_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clouds_and_air_are_one),
        cmocka_unit_test(pictures_are_still),
        cmocka_unit_test(clouds_end_at_surfaces),
        cmocka_unit_test(fog_lies_among_clouds),
        cmocka_unit_test(samples_leave_fog_before_clouds_where_it_is),
        cmocka_unit_test(dusk_does_not_shine_through_at_the_horizon),
        cmocka_unit_test(the_ground_has_shadows),
        cmocka_unit_test(air_under_clouds_is_dim),
        cmocka_unit_test(surfaces_under_clouds_have_less_sky),
        cmocka_unit_test(sheets_over_mist_have_no_dots),
        cmocka_unit_test(clouds_hide_the_ground_from_orbit),
        cmocka_unit_test(a_flight_through_clouds_has_no_jump),
        cmocka_unit_test(no_clouds_change_nothing),
        cmocka_unit_test(bad_times_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, free_air);
}
