#define _POSIX_C_SOURCE 200809L

#include "screenshot.h"

#include "../signals.h"
#include "../messages.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Numbers tried until somebody should tidy up. */
enum { MOST_PICTURES = 9999 };

/* OpenGL has the lowest row first. */
static void turn_over(uint32_t width, uint32_t height, const unsigned char *rgba, float *rgb)
{
    for (uint32_t y = 0; y < height; y++) {
        const unsigned char *const row = rgba + 4 * (size_t)(height - 1 - y) * width;
        float *const out = rgb + 3 * (size_t)y * width;
        for (size_t x = 0; x < width; x++) {
            for (size_t c = 0; c < 3; c++) out[3 * x + c] = (float)row[4 * x + c] / 255;
        }
    }
}

int nb_picture_write(const char *path, uint32_t width, uint32_t height, const nebel_log *log)
{
    static const char *const names[] = {"R", "G", "B"};
    const size_t pixels = (size_t)width * height;
    unsigned char *const rgba = malloc(pixels * 4);
    float *const rgb = malloc(pixels * 3 * sizeof *rgb);
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (rgba != NULL && rgb != NULL) {
        const nebel_image image = {width, height, 3, names, rgb};
        const nebel_host host = {.log = *log};
        glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
        glReadPixels(0, 0, (GLsizei)width, (GLsizei)height, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
        turn_over(width, height, rgba, rgb);
        nb_interrupt_hold();
        result = nebel_write_image(path, &host, &image);
        nb_interrupt_release();
    } else {
        log->write(NEBEL_LOG_ERROR, result, "out of memory for the picture", log->user);
    }
    free(rgba);
    free(rgb);
    return result == NEBEL_OK ? NB_DONE : NB_FAILED;
}

int nb_picture_name(char *name, size_t size)
{
    for (int i = 1; i <= MOST_PICTURES; i++) {
        (void)snprintf(name, size, "nebel-%d.png", i);
        if (access(name, F_OK) != 0) return 0;
    }
    return -1;
}
