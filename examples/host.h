/* What the examples say to who starts them where something is missing. */
#ifndef HOST_H
#define HOST_H

#include <nebel/light.h>

#include <stdio.h>

/* For nebel's own words. */
static inline void host_write(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result, (void)user;
    fprintf(stderr, "nebel: %s\n", message);
}

static const nebel_log host_log = {.write = host_write};

/* Without a window there is nothing to show. `why` is what the window library says; NULL: nothing. An exit status. */
static inline int host_refuse(const char *program, const char *why)
{
    fprintf(stderr,
            "%s: no window with OpenGL: %s\n"
            "%s: start it in a desktop session; without a screen try: xvfb-run -a %s\n",
            program, why != NULL ? why : "the window library does not say why", program, program);
    return 1;
}

/* Drivers compile shaders before the first picture, software for some seconds: so long the window is empty. */
static inline void host_say_compiling(const char *program)
{
    fprintf(stderr, "%s: the driver compiles shaders; the picture follows\n", program);
}

#endif
