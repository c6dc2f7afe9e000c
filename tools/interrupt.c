#define _XOPEN_SOURCE 700

#include "interrupt.h"

#include <signal.h>
#include <stddef.h>

static const int signals[] = {SIGINT, SIGTERM, SIGHUP};

static volatile sig_atomic_t received;

static void receive(int number)
{
    received = number;
}

void nb_interrupt_listen(void)
{
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
        struct sigaction before;
        struct sigaction ours = {.sa_handler = receive, .sa_flags = (int)SA_RESETHAND | SA_RESTART};
        (void)sigemptyset(&ours.sa_mask);
        if (sigaction(signals[i], NULL, &before) != 0 || before.sa_handler == SIG_IGN) continue;
        (void)sigaction(signals[i], &ours, NULL);
    }
}

int nb_interrupt_is_requested(void)
{
    return received != 0;
}

void nb_interrupt_obey(void)
{
    if (received == 0) return;
    (void)signal(received, SIG_DFL);
    (void)raise(received);
}
