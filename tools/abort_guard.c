#define _DEFAULT_SOURCE

#include "abort_guard.h"

#include "fd_output.h"
#include "messages.h"

#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>
#include <unistd.h>

/* What a thread's stack or a block of an allocator takes, several times. */
enum { MUCH = 64 << 20 };

/* mmap is no more than a system call, so that it may be asked here. */
static int is_memory_out(void)
{
    void *const memory = mmap(NULL, MUCH, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return 1;
    (void)munmap(memory, MUCH);
    return 0;
}

static void explain(int number)
{
    static const char message[] =
        "nebel: out of memory, and a library gave up over it; free some, raise its limit (ulimit -v), or use fewer "
        "triangles or threads\n";
    (void)number;
    if (!is_memory_out()) return; /* abort then ends the program */
    (void)nb_output_write(STDERR_FILENO, message, sizeof message - 1);
    _exit(NB_FAILED);
}

void nb_abort_explain(void)
{
    struct sigaction ours = {.sa_handler = explain};
    (void)sigemptyset(&ours.sa_mask);
    (void)sigaction(SIGABRT, &ours, NULL);
}
