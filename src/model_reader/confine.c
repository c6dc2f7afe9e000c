#define _DEFAULT_SOURCE
#include "confine.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__linux__)
#include <sys/prctl.h>
#endif

/* Scene graphs are walked by functions that call themselves. */
static const rlim_t stack_size = (rlim_t)64 << 20;

/* A model and what it names, one after the other. */
enum { MAX_FILES = 64 };

/* ---- the parent ------------------------------------------------------------------------------ */

static void close_others(void)
{
#if defined(SYS_close_range)
    if (syscall(SYS_close_range, STDERR_FILENO + 1u, ~0u, 0u) == 0) return;
#endif
    const long last = sysconf(_SC_OPEN_MAX);
    for (int file = STDERR_FILENO + 1; file < (last > 0 && last < 65536 ? last : 65536); file++) close(file);
}

bool nb_confine_to_parent(long parent)
{
    close_others();
#if defined(PR_SET_PDEATHSIG)
    prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
    return (long)getppid() == parent;
}

/* ---- resources ------------------------------------------------------------------------------- */

static void limit(int resource, rlim_t wanted)
{
    struct rlimit now;
    if (getrlimit(resource, &now) != 0) return;
    if (now.rlim_max != RLIM_INFINITY && wanted > now.rlim_max) wanted = now.rlim_max;
    now.rlim_cur = wanted;
    setrlimit(resource, &now);
}

/* What the limit may be raised to later. */
static void cap(int resource, rlim_t most)
{
    struct rlimit now;
    if (getrlimit(resource, &now) != 0 || now.rlim_max <= most) return;
    now.rlim_max = most;
    setrlimit(resource, &now);
}

static void limit_for_ever(int resource, rlim_t wanted)
{
    const struct rlimit both = {wanted, wanted};
    setrlimit(resource, &both);
}

void nb_confine_resources(void)
{
    limit(RLIMIT_STACK, stack_size);
    limit(RLIMIT_NOFILE, MAX_FILES);
    limit_for_ever(RLIMIT_CORE, 0);
    if (NB_SANITIZED) return;
    limit_for_ever(RLIMIT_FSIZE, 0);
#if defined(RLIMIT_NPROC)
    limit_for_ever(RLIMIT_NPROC, 0);
#endif
}

void nb_confine_budget(const nb_budget *budget)
{
    static rlim_t own_memory = 0; /* the limit it was started with */
    const rlim_t memory = (rlim_t)nb_budget_memory(budget);
    struct rlimit now;
    limit(RLIMIT_CPU, nb_budget_cpu_seconds(budget));
    if (NB_SANITIZED || getrlimit(RLIMIT_AS, &now) != 0) return;
    if (own_memory == 0) own_memory = now.rlim_cur;
    limit(RLIMIT_AS, own_memory != RLIM_INFINITY && own_memory < memory ? own_memory : memory);
    cap(RLIMIT_AS, (rlim_t)nb_budget_most_memory(budget));
}
