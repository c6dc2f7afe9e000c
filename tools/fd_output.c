#define _POSIX_C_SOURCE 200809L

#include "fd_output.h"

#include "messages.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void nb_output_prepare(void)
{
    (void)signal(SIGPIPE, SIG_IGN);
    (void)signal(SIGXFSZ, SIG_IGN);
    for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; descriptor++) {
        if (fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
        /* The lowest free number is this one. Read only: a write to it fails as it would have when closed. */
        (void)open("/dev/null", O_RDONLY);
    }
}

int nb_output_write(int descriptor, const void *data, size_t size)
{
    const char *rest = data;
    while (size > 0) {
        const ssize_t written = write(descriptor, rest, size);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        rest += written;
        size -= (size_t)written;
    }
    return 0;
}

int nb_output_status(int error)
{
    if (error == 0) return NB_DONE;
    if (error == EPIPE) return NB_FAILED;
    return nb_report_failure("standard output: %s; the output is not complete", strerror(error));
}

int nb_output_finish(int status)
{
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return status;
    const int failed = nb_output_status(errno != 0 ? errno : EIO);
    return status != NB_DONE ? status : failed;
}
