#define _GNU_SOURCE
/* Models are read by a program of their own, since what reads them trusts its input: its crash, hang or bloat becomes an
 * error here. It is started with posix_spawn, which runs nothing of the host; no signal handler is touched, and only
 * this one process is waited for. */
#include "model_receive.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* Room for what comes, where the system allows it: fewer turns between the two programs. */
enum { PIPE_SIZE = 1 << 20 };

/* Variables that the child gets. */
enum { MAX_VARIABLES = 64 };

typedef struct child {
    pid_t id;
    int handle; /* a descriptor that means this process for ever; -1: none */
    int answer; /* to read from */
} child;

static nebel_result fail_system(const nb_model_load *load, const char *what, int error)
{
    return nb_model_fail(load, error == ENOMEM ? NEBEL_ERROR_MEMORY : NEBEL_ERROR_FILE,
                         "cannot read the model \"%s\": %s: %s", load->source->file, what, strerror(error));
}

/* ---- pipes ----------------------------------------------------------------------------------- */

/* Above the standard ones, which the child's take the place of. */
static int raise_above_standard(int file)
{
    if (file < 0 || file > STDERR_FILENO) return file;
    const int higher = fcntl(file, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    close(file);
    return higher;
}

static void close_pipe(int ends[2])
{
    for (int i = 0; i < 2; i++)
        if (ends[i] >= 0) close(ends[i]);
    ends[0] = ends[1] = -1;
}

static int open_pipe(int ends[2])
{
    if (pipe2(ends, O_CLOEXEC) != 0) {
        ends[0] = ends[1] = -1;
        return errno;
    }
    for (int i = 0; i < 2; i++) ends[i] = raise_above_standard(ends[i]);
    if (ends[0] >= 0 && ends[1] >= 0) return 0;
    const int error = errno;
    close_pipe(ends);
    return error;
}

/* ---- the request ----------------------------------------------------------------------------- */

static nb_wire_request describe(const nb_model_load *load)
{
    const nb_model_source *source = load->source;
    nb_wire_request request = {.magic = NB_WIRE_MAGIC, .version = NB_WIRE_VERSION, .unit = source->space.unit};
    request.flags = (load->points != NULL ? NB_WIRE_POINTS : 0u) | (source->has_fog ? NB_WIRE_HAS_FOG : 0u) |
                    (source->has_color ? NB_WIRE_HAS_COLOR : 0u) | (source->space.z_up ? NB_WIRE_Z_UP : 0u);
    memcpy(request.position, source->position, sizeof request.position);
    memcpy(request.rotation, source->rotation, sizeof request.rotation);
    memcpy(request.scale, source->scale, sizeof request.scale);
    memcpy(request.color, source->color, sizeof request.color);
    request.max_points = load->points != NULL ? load->points->limit : 0;
    request.triangles = load->set != NULL ? load->set->triangle_count : 0;
    request.textures = load->set != NULL ? load->set->texture_count : 0;
    request.bytes = load->set != NULL ? load->set->bytes : 0;
    request.most_bytes = load->most_bytes;
    return request;
}

/* Before there is a reader: nobody can go away meanwhile, which would end this program with SIGPIPE. */
static nebel_result write_request(const nb_model_load *load, int file)
{
    char bytes[NB_WIRE_MAX_REQUEST];
    nb_wire_request request = describe(load);
    const char *const texts[3] = {load->source->file, load->folder, load->name};
    uint32_t *const sizes[3] = {&request.file_size, &request.folder_size, &request.name_size};
    size_t size = sizeof request;
    for (int i = 0; i < 3; i++) {
        const size_t length = strlen(texts[i]) + 1;
        if (length > sizeof bytes - size)
            return nb_model_fail(load, NEBEL_ERROR_LIMIT, "the path of the model \"%.200s\" is too long",
                                 load->source->file);
        memcpy(bytes + size, texts[i], length);
        *sizes[i] = (uint32_t)length;
        size += length;
    }
    memcpy(bytes, &request, sizeof request);
    const int flags = fcntl(file, F_GETFL);
    if (flags < 0 || fcntl(file, F_SETFL, flags | O_NONBLOCK) != 0) return fail_system(load, "pipe", errno);
    const ssize_t written = write(file, bytes, size);
    if (written < 0) return fail_system(load, "pipe", errno);
    return (size_t)written == size ? NEBEL_OK : fail_system(load, "pipe", ENOBUFS);
}

/* ---- the process ----------------------------------------------------------------------------- */

/* What finds shared libraries, and what sanitizers obey; nothing else is its business. */
static bool is_wanted(const char *variable)
{
    static const char *const names[] = {"LD_LIBRARY_PATH=", "ASAN_OPTIONS=", "UBSAN_OPTIONS=", "LSAN_OPTIONS="};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strncmp(variable, names[i], strlen(names[i])) == 0) return true;
    return false;
}

static void choose_variables(char *chosen[MAX_VARIABLES + 1])
{
    /* In place of the limit of address space, which sanitizers do not bear; what the caller says counts more. */
    static const char sanitizer[] = "ASAN_OPTIONS=max_allocation_size_mb=1000:hard_rss_limit_mb=2000:detect_leaks=0";
    /* Large pages: what Assimp makes of a large model takes a third of the time to get memory for. */
    static const char tunables[] = "GLIBC_TUNABLES=glibc.malloc.hugetlb=1";
    size_t count = 0;
    bool has_options = !NB_SANITIZED;
    for (char **at = environ; at != NULL && *at != NULL && count + 2 < MAX_VARIABLES; at++)
        if (is_wanted(*at)) {
            has_options = has_options || strncmp(*at, sanitizer, strcspn(sanitizer, "=")) == 0;
            chosen[count++] = *at;
        }
    if (!has_options) chosen[count++] = (char *)sanitizer;
    chosen[count++] = (char *)tunables;
    chosen[count] = NULL;
}

/* Its standard input and output are the pipes; what Assimp prints belongs on nobody's terminal. */
static int add_actions(posix_spawn_file_actions_t *actions, int request, int answer)
{
    int error = posix_spawn_file_actions_adddup2(actions, request, STDIN_FILENO);
    if (error == 0) error = posix_spawn_file_actions_adddup2(actions, answer, STDOUT_FILENO);
    if (error == 0 && !NB_SANITIZED)
        error = posix_spawn_file_actions_addopen(actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    return error;
}

/* Signals are as a program expects them, whatever the host has made of its own. */
static int set_attributes(posix_spawnattr_t *attributes)
{
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    int error = posix_spawnattr_setsigmask(attributes, &none);
    if (error == 0) error = posix_spawnattr_setsigdefault(attributes, &all);
    if (error == 0) error = posix_spawnattr_setflags(attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    return error;
}

static int spawn(const char *program, int request, int answer, pid_t *id)
{
    char version[16], parent[24], *variables[MAX_VARIABLES + 1];
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    snprintf(version, sizeof version, "%d", NB_WIRE_VERSION);
    snprintf(parent, sizeof parent, "%ld", (long)getpid());
    char *const words[] = {(char *)program, version, parent, NULL};
    choose_variables(variables);
    int error = posix_spawn_file_actions_init(&actions);
    if (error != 0) return error;
    error = posix_spawnattr_init(&attributes);
    if (error == 0) {
        error = add_actions(&actions, request, answer);
        if (error == 0) error = set_attributes(&attributes);
        if (error == 0) error = posix_spawn(id, program, &actions, &attributes, words, variables);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

static int open_handle(pid_t id)
{
#if defined(SYS_pidfd_open)
    return (int)syscall(SYS_pidfd_open, id, 0);
#else
    (void)id;
    return -1;
#endif
}

static nebel_result start(const nb_model_load *load, child *made)
{
    int request[2] = {-1, -1}, answer[2] = {-1, -1};
    const char *program = load->reader.program;
    int error = open_pipe(request);
    if (error == 0) error = open_pipe(answer);
    nebel_result result = error == 0 ? write_request(load, request[1]) : fail_system(load, "pipe", error);
    if (result == NEBEL_OK) {
        error = spawn(program, request[0], answer[1], &made->id);
        if (error != 0)
            result = nb_model_fail(load, error == ENOMEM ? NEBEL_ERROR_MEMORY : NEBEL_ERROR_FILE,
                                   "cannot read the model \"%s\": the program that reads models, \"%s\", does not "
                                   "start: %s; install it there",
                                   load->source->file, program, strerror(error));
    }
    if (result == NEBEL_OK) {
        made->handle = open_handle(made->id);
        made->answer = answer[0];
        answer[0] = -1;
#if defined(F_SETPIPE_SZ)
        fcntl(made->answer, F_SETPIPE_SZ, PIPE_SIZE);
#endif
    }
    close_pipe(request);
    close_pipe(answer);
    return result;
}

/* Where the host ignores SIGCHLD, or waits for any child, the process may be gone and its number another's, even before
 * there is a handle: what is no child of ours is left alone. */
static void stop(const child *running)
{
    siginfo_t info;
    if (waitid(P_PID, (id_t)running->id, &info, WEXITED | WNOHANG | WNOWAIT) != 0) return;
#if defined(SYS_pidfd_send_signal)
    if (running->handle >= 0) {
        (void)syscall(SYS_pidfd_send_signal, running->handle, SIGKILL, NULL, 0);
        return;
    }
#endif
    kill(running->id, SIGKILL);
}

/* Its status, or -1 where somebody else has taken it. */
static int await_end(child *running)
{
    int status = -1;
    pid_t ended;
    close(running->answer);
    do ended = waitpid(running->id, &status, 0);
    while (ended < 0 && errno == EINTR);
    if (running->handle >= 0) close(running->handle);
    return ended == running->id ? status : -1;
}

/* ---- what went wrong ------------------------------------------------------------------------- */

static const char *name_signal(int number)
{
    switch (number) {
    case SIGSEGV:
    case SIGBUS:
        return "access to memory that is not its own";
    case SIGABRT:
        return "an error that it does not handle";
    case SIGFPE:
        return "a division by 0";
    case SIGILL:
        return "an instruction that does not exist";
    default:
        return "a signal";
    }
}

#define REMEDY "the file is damaged or not supported; export it again, or as glTF (.glb)"

static nebel_result fail_time(const nb_model_load *load, const nb_budget *budget)
{
    const unsigned seconds = nb_budget_cpu_seconds(budget);
    if (nb_budget_is_cut(budget))
        return nb_model_fail(load, NEBEL_ERROR_LIMIT,
                             "reading the model \"%s\" takes longer than the %u s that are left of what the scene may "
                             "take (nebel: --memory)",
                             load->source->file, seconds);
    return nb_model_fail(load, NEBEL_ERROR_LIMIT, "reading the model \"%s\" takes longer than %u s; " REMEDY,
                         load->source->file, seconds);
}

static nebel_result fail_budget(const nb_model_load *load, const nb_budget *budget)
{
    return nb_model_fail(load, NEBEL_ERROR_LIMIT, "reading the model \"%s\" takes more than %llu MB of memory; " REMEDY,
                         load->source->file, (unsigned long long)nb_budget_memory(budget) / 1000000);
}

static nebel_result fail_cut(const nb_model_load *load, const nb_budget *budget, int status)
{
    const char *file = load->source->file;
    if (status != -1 && WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return fail_time(load, budget);
    if (status != -1 && WIFSIGNALED(status))
        return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                             "the model \"%s\" cannot be read: its reader was ended by %s; " REMEDY, file,
                             name_signal(WTERMSIG(status)));
    return nb_model_fail(load, NEBEL_ERROR_FORMAT, "the model \"%s\" cannot be read: its reader ended early; " REMEDY,
                         file);
}

static nebel_result judge(const nb_receiver *received, nb_receipt receipt, int status)
{
    const nb_model_load *load = received->load;
    switch (receipt) {
    case NB_RECEIPT_WHOLE:
        return received->result == NEBEL_ERROR_MEMORY ? fail_budget(load, received->budget) : received->result;
    case NB_RECEIPT_CUT:
        return fail_cut(load, received->budget, status);
    case NB_RECEIPT_LATE:
        return fail_time(load, received->budget);
    case NB_RECEIPT_TOO_BIG:
        return fail_budget(load, received->budget);
    case NB_RECEIPT_VERSION:
        return nb_model_fail(load, NEBEL_ERROR_FILE,
                             "cannot read the model \"%s\": \"%s\" belongs to another version of nebel; install both "
                             "together",
                             load->source->file, load->reader.program);
    case NB_RECEIPT_REFUSED:
        return received->result;
    case NB_RECEIPT_MEMORY:
        return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    default:
        return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                             "the model \"%s\" cannot be read: its reader made meshes that cannot be; " REMEDY,
                             load->source->file);
    }
}

static void set_limits(const nb_model_load *load, nb_budget *budget)
{
    const double left = load->seconds != NULL ? load->most_seconds - *load->seconds : 0;
    budget->most_memory = (uint64_t)load->most_bytes;
    if (left > 0 && left < 1e6 && !NB_SANITIZED) budget->most_seconds = 1 + (unsigned)left;
}

nebel_result nb_model_process_read(const nb_model_load *load)
{
    struct stat model;
    child running;
    nb_budget *budget = nb_allocate_zero(&load->allocator, 1, sizeof *budget);
    if (budget == NULL) return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    set_limits(load, budget);
    if (stat(load->source->file, &model) == 0) nb_budget_add(budget, &model);
    nebel_result result = start(load, &running);
    if (result == NEBEL_OK) {
        nb_receiver receiver = {.load = load, .file = running.answer, .budget = budget};
        const nb_receipt receipt = nb_model_receive(&receiver);
        stop(
            &running); /* also where it is whole, or cut: it may go on without an answer; one that ends keeps its status */
        result = judge(&receiver, receipt, await_end(&running));
    }
    nb_release(&load->allocator, budget);
    return result;
}
