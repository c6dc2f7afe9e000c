#define _GNU_SOURCE
/* System calls that reading a model has no use for: no sockets, no other programs, no other processes. */
#include "confine.h"

#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(__linux__) && (defined(__x86_64__) || defined(__aarch64__)) && !defined(__ILP32__)
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>

#if defined(__x86_64__)
#define ARCHITECTURE AUDIT_ARCH_X86_64
#else
#define ARCHITECTURE AUDIT_ARCH_AARCH64
#endif

/* Numbers from here on are those of another interface of x86-64. */
#define OTHER_INTERFACE 0x40000000u

static const unsigned denied[] = {
    SYS_socket,
    SYS_socketpair,
    SYS_connect,
    SYS_execve,
    SYS_execveat,
    SYS_clone,
    SYS_ptrace,
    SYS_kill,
    SYS_tkill,
    SYS_rt_sigqueueinfo,
    SYS_process_vm_readv,
    SYS_process_vm_writev,
    SYS_setns,
    SYS_unshare,
    SYS_mount,
    SYS_bpf,
    SYS_keyctl,
    SYS_perf_event_open,
    SYS_userfaultfd,
    SYS_add_key,
    SYS_shmget,
    SYS_open_by_handle_at,
    SYS_memfd_create,
    SYS_msgget,
    SYS_setpriority,
    SYS_sched_setaffinity,
#if defined(SYS_fork)
    SYS_fork,
    SYS_vfork,
#endif
#if defined(SYS_clone3)
    SYS_clone3,
#endif
#if defined(SYS_pidfd_open)
    SYS_pidfd_open,
    SYS_pidfd_send_signal,
#endif
#if defined(SYS_io_uring_setup)
    SYS_io_uring_setup,
#endif
};

/* Room for a few lines per call. */
enum { MAX_LINES = 2 * (sizeof denied / sizeof *denied) + 20 };

typedef struct program {
    struct sock_filter lines[MAX_LINES];
    unsigned short count;
} program;

static void add(program *rules, uint16_t code, uint32_t value, uint8_t if_true, uint8_t if_false)
{
    rules->lines[rules->count++] = (struct sock_filter){code, if_true, if_false, value};
}

static void load(program *rules, size_t offset)
{
    add(rules, BPF_LD | BPF_W | BPF_ABS, (uint32_t)offset, 0, 0);
}

static void add_answer(program *rules, uint32_t action)
{
    add(rules, BPF_RET | BPF_K, action, 0, 0);
}

static void deny(program *rules)
{
    add_answer(rules, SECCOMP_RET_ERRNO | EPERM);
}

/* A call that is fine with one first argument only, whose upper half is 0. */
static void allow_for(program *rules, unsigned number, uint32_t argument)
{
    add(rules, BPF_JMP | BPF_JEQ | BPF_K, number, 0, 4);
    load(rules, offsetof(struct seccomp_data, args));
    add(rules, BPF_JMP | BPF_JEQ | BPF_K, argument, 0, 1);
    add_answer(rules, SECCOMP_RET_ALLOW);
    deny(rules);
}

void nb_confine_calls(void)
{
    program rules = {.count = 0};
    if (NB_SANITIZED) return;
    load(&rules, offsetof(struct seccomp_data, arch));
    add(&rules, BPF_JMP | BPF_JEQ | BPF_K, ARCHITECTURE, 1, 0);
    add_answer(&rules, SECCOMP_RET_KILL_PROCESS);
    load(&rules, offsetof(struct seccomp_data, nr));
    add(&rules, BPF_JMP | BPF_JGE | BPF_K, OTHER_INTERFACE, 0, 1);
    deny(&rules);
    for (size_t i = 0; i < sizeof denied / sizeof *denied; i++) {
        add(&rules, BPF_JMP | BPF_JEQ | BPF_K, denied[i], 0, 1);
        deny(&rules);
    }
    allow_for(&rules, SYS_tgkill, (uint32_t)getpid()); /* abort() */
    load(&rules, offsetof(struct seccomp_data, nr));
    allow_for(&rules, SYS_prlimit64, 0);
    add_answer(&rules, SECCOMP_RET_ALLOW);
    const struct sock_fprog whole = {rules.count, rules.lines};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0) prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &whole);
}
#else
void nb_confine_calls(void) {}
#endif
