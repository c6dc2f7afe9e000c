#include "particles.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

nebel_result nb_particles_set(nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                              const nebel_particle *list, size_t count)
{
    nebel_particle *const copy = nb_allocate(allocator, count, sizeof *copy);
    nb_ball *const balls = nb_allocate(allocator, count, sizeof *balls);
    if (copy == NULL || balls == NULL || count > INT32_MAX) {
        nb_release(allocator, copy);
        nb_release(allocator, balls);
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory for %zu particles", count);
    }
    if (count > 0) memcpy(copy, list, count * sizeof *copy);
    nb_release(allocator, particles->list);
    nb_release(allocator, particles->balls);
    particles->list = copy;
    particles->balls = balls;
    particles->count = count;
    particles->is_grey = 1;
    particles->profiles = 0;
    for (size_t i = 0; i < count; i++) {
        const double *const e = list[i].extinction;
        particles->is_grey &= e[0] == e[1] && e[1] == e[2];
        particles->profiles |= 1 << (int)list[i].profile;
    }
    return NEBEL_OK;
}

nebel_result nb_particles_commit(const nb_particles *particles, const nebel_allocator *allocator, const nebel_log *log,
                                 nebel_snapshot **cloud)
{
    nebel_fog *fog = NULL;
    const nebel_fog_desc desc = {.allocator = *allocator, .log = *log};
    nebel_result result = nebel_create_fog(&desc, &fog);
    for (size_t i = 0; i < particles->count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = nebel_particle_volume(&particles->list[i]);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, cloud);
    nebel_destroy_fog(fog);
    return result;
}

static nb_ball ball_of(const nebel_particle *p, const double eye[3], const double *forward)
{
    nb_ball ball = {.radius = (float)p->radius, .profile = (float)p->profile};
    double square = 0, along = 0;
    for (int i = 0; i < 3; i++) {
        const double way = p->center[i] - eye[i];
        square += way * way;
        if (forward != NULL) along += way * forward[i];
        ball.center[i] = (float)way;
        ball.extinction[i] = (float)p->extinction[i];
        ball.emission[i] = (float)p->emission[i];
    }
    ball.distance = (float)(forward != NULL ? along : sqrt(square));
    return ball;
}

static int compare_distances(const void *a, const void *b)
{
    const float x = ((const nb_ball *)a)->distance, y = ((const nb_ball *)b)->distance;
    return (x < y) - (x > y);
}

/* Attributes of an instance: three vectors of four. */
static void make_objects(nb_particles *particles)
{
    glGenVertexArrays(1, &particles->vertex_array);
    glGenBuffers(1, &particles->buffer);
    glBindVertexArray(particles->vertex_array);
    glBindBuffer(GL_ARRAY_BUFFER, particles->buffer);
    for (GLuint i = 0; i < 3; i++) {
        glEnableVertexAttribArray(i);
        glVertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, sizeof(nb_ball), (const void *)(i * 4 * sizeof(float)));
        glVertexAttribDivisor(i, 1);
    }
}

nebel_result nb_particles_sort(nb_particles *particles, const nebel_log *log, const double eye[3],
                               const double *forward)
{
    for (size_t i = 0; i < particles->count; i++) particles->balls[i] = ball_of(&particles->list[i], eye, forward);
    qsort(particles->balls, particles->count, sizeof *particles->balls, compare_distances);
    if (particles->buffer == 0) make_objects(particles);
    glBindBuffer(GL_ARRAY_BUFFER, particles->buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(particles->count * sizeof *particles->balls), particles->balls,
                 GL_STREAM_DRAW);
    return nb_context_check_memory(log, "the particles; use fewer");
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
