#include "gl_particles.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

void nb_particles_release(const nebel_allocator *allocator, const nb_particles *particles)
{
    nb_release(allocator, particles->list);
    nb_release(allocator, particles->balls);
    for (int i = 0; i < 2; i++) nb_release(allocator, particles->order[i]);
}

static int is_within(const double *numbers, int count, double low, double high)
{
    int good = 1;
    for (int i = 0; i < count; i++) good &= numbers[i] >= low && numbers[i] <= high;
    return good;
}

/* As for nebel_add_volume. */
static nebel_result check_particles(const nebel_log *log, const nebel_particle *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const nebel_particle *const p = &list[i];
        if ((unsigned)p->profile >= NEBEL_PARTICLE_PROFILE_COUNT)
            return nb_fail(log, NEBEL_ERROR_ARGUMENT, "particles: particle %zu: profile %d is unknown", i,
                           (int)p->profile);
        if (!is_within(p->center, 3, -NEBEL_MAX_LENGTH, NEBEL_MAX_LENGTH) ||
            !is_within(&p->radius, 1, NEBEL_MIN_LENGTH, NEBEL_MAX_LENGTH) ||
            !is_within(p->extinction, 3, 0, NEBEL_MAX_AMOUNT) || !is_within(p->emission, 3, 0, NEBEL_MAX_AMOUNT))
            return nb_fail(
                log, NEBEL_ERROR_VALUE,
                "particles: particle %zu: its center must be within 1e15 m, its radius from 1e-15 to 1e15 m, "
                "extinction and emission from 0 to 1e9",
                i);
    }
    return NEBEL_OK;
}

nebel_result nb_particles_set(nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                              const nebel_particle *list, size_t count)
{
    nb_particles made = {.count = count, .is_grey = 1};
    const nebel_result valid = check_particles(log, list, count);
    if (valid != NEBEL_OK) return valid;
    made.list = nb_allocate(allocator, count, sizeof *made.list);
    made.balls = nb_allocate(allocator, count, sizeof *made.balls);
    for (int i = 0; i < 2; i++) made.order[i] = nb_allocate(allocator, count, sizeof *made.order[i]);
    if (made.list == NULL || made.balls == NULL || made.order[0] == NULL || made.order[1] == NULL ||
        count > INT32_MAX) {
        nb_particles_release(allocator, &made);
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory for %zu particles", count);
    }
    if (count > 0) memcpy(made.list, list, count * sizeof *made.list);
    for (size_t i = 0; i < count; i++) {
        const double *const e = list[i].extinction;
        made.is_grey &= e[0] == e[1] && e[1] == e[2];
        made.profiles |= 1 << (int)list[i].profile;
    }
    made.vertex_array = particles->vertex_array;
    made.buffer = particles->buffer;
    nb_particles_release(allocator, particles);
    *particles = made;
    return NEBEL_OK;
}

nebel_result nb_particles_commit(const nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                                 nebel_lighting **cloud)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    const nebel_fog_desc desc = {.host = {.allocator = *allocator, .log = *log}};
    nebel_result result = nebel_create_fog(&desc, &fog);
    for (size_t i = 0; i < particles->count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&particles->list[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) result = nebel_create_lighting(snapshot, NULL, cloud);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return result;
}

static nb_particle_sphere ball_of(const nebel_particle *p, const double eye[3])
{
    nb_particle_sphere ball = {.radius = (float)p->radius, .profile = (float)p->profile};
    for (int i = 0; i < 3; i++) {
        ball.center[i] = (float)(p->center[i] - eye[i]);
        ball.extinction[i] = (float)p->extinction[i];
        ball.emission[i] = (float)p->emission[i];
    }
    return ball;
}

static float distance_of(const nebel_particle *p, const double eye[3], const double *forward)
{
    double square = 0, along = 0;
    for (int i = 0; i < 3; i++) {
        const double way = p->center[i] - eye[i];
        square += way * way;
        if (forward != NULL) along += way * forward[i];
    }
    return (float)(forward != NULL ? along : sqrt(square));
}

/* The bits of a float count up with it where it is positive, and down where it is not. */
static uint32_t nearness_of(float distance)
{
    uint32_t bits = 0;
    memcpy(&bits, &distance, sizeof bits);
    return bits >> 31 != 0 ? bits : ~bits & 0x7fffffff;
}

/* Counts what there is of each digit, then puts all in place: stable. */
static void sort_by_digit(const nb_sorted_particle *from, nb_sorted_particle *to, size_t count, int shift)
{
    enum { DIGITS = 2048 };
    uint32_t next[DIGITS] = {0}, sum = 0;
    for (size_t i = 0; i < count; i++) next[from[i].nearness >> shift & (DIGITS - 1)]++;
    for (int i = 0; i < DIGITS; i++) {
        const uint32_t here = next[i];
        next[i] = sum;
        sum += here;
    }
    for (size_t i = 0; i < count; i++) to[next[from[i].nearness >> shift & (DIGITS - 1)]++] = from[i];
}

/* From the farthest to the nearest. */
static void sort_balls(nb_particles *particles, const double eye[3], const double *forward)
{
    nb_sorted_particle *const first = particles->order[0], *const second = particles->order[1];
    for (size_t i = 0; i < particles->count; i++) {
        const float distance = distance_of(&particles->list[i], eye, forward);
        first[i] = (nb_sorted_particle){nearness_of(distance), (uint32_t)i};
    }
    sort_by_digit(first, second, particles->count, 0);
    sort_by_digit(second, first, particles->count, 11);
    sort_by_digit(first, second, particles->count, 22);
    for (size_t i = 0; i < particles->count; i++) particles->balls[i] = ball_of(&particles->list[second[i].index], eye);
}

/* Attributes of an instance: three vectors of four. */
static void make_particle_objects(nb_particles *particles)
{
    glGenVertexArrays(1, &particles->vertex_array);
    glGenBuffers(1, &particles->buffer);
    glBindVertexArray(particles->vertex_array);
    glBindBuffer(GL_ARRAY_BUFFER, particles->buffer);
    for (GLuint i = 0; i < 3; i++) {
        glEnableVertexAttribArray(i);
        glVertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, sizeof(nb_particle_sphere),
                              (const void *)(i * 4 * sizeof(float)));
        glVertexAttribDivisor(i, 1);
    }
}

nebel_result nb_particles_sort(nb_particles *particles, const nebel_log *log, const double eye[3],
                               const double *forward)
{
    sort_balls(particles, eye, forward);
    if (particles->buffer == 0) make_particle_objects(particles);
    glBindBuffer(GL_ARRAY_BUFFER, particles->buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(particles->count * sizeof *particles->balls), particles->balls,
                 GL_STREAM_DRAW);
    return nb_context_check_memory(log, "the particles; use fewer");
}

/* Whether the ray from a place meets a box that is `margin` larger to all sides. */
static int meets(const double from[3], const double way[3], const double low[3], const double high[3], double margin)
{
    double enter = 0, leave = HUGE_VAL;
    for (int i = 0; i < 3; i++) {
        const double under = low[i] - margin - from[i], over = high[i] + margin - from[i];
        if (way[i] == 0 && (under > 0 || over < 0)) return 0;
        if (way[i] == 0) continue;
        enter = fmax(enter, (way[i] > 0 ? under : over) / way[i]);
        leave = fmin(leave, (way[i] > 0 ? over : under) / way[i]);
    }
    return enter <= leave;
}

int nb_particles_shade(const nb_particles *particles, const double to_light[3], const double low[3],
                       const double high[3])
{
    const double away[3] = {-to_light[0], -to_light[1], -to_light[2]};
    for (size_t i = 0; i < particles->count; i++) {
        const nebel_particle *const p = &particles->list[i];
        const int takes = p->extinction[0] > 0 || p->extinction[1] > 0 || p->extinction[2] > 0;
        if (takes && meets(p->center, away, low, high, p->radius)) return 1;
    }
    return 0;
}

void nb_particles_draw(const nb_particles *particles, int vertices)
{
    glBindVertexArray(particles->vertex_array);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, vertices, (GLsizei)particles->count);
}

void nb_particles_delete(const nb_particles *particles)
{
    glDeleteVertexArrays(1, &particles->vertex_array);
    glDeleteBuffers(1, &particles->buffer);
}
