#define _XOPEN_SOURCE 700

#include "signals.h"

#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

static const int signals[] = {SIGINT, SIGTERM, SIGHUP, SIGXCPU};

static volatile sig_atomic_t received, again, is_held;
static int is_listening;

static char farewell[600];
static size_t farewell_size;

static void end_by(int number)
{
    (void)signal(number, SIG_DFL);
    (void)raise(number);
}

static void receive(int number)
{
    if (received == 0)
        received = number;
    else if (is_held)
        again = number;
    else
        end_by(number);
}

/* Where `handler` is not what the caller wants to stay: SIG_IGN. */
static void handle_with(void (*handler)(int))
{
    for (size_t i = 0; i < sizeof signals / sizeof *signals; i++) {
        struct sigaction before;
        struct sigaction ours = {.sa_handler = handler, .sa_flags = SA_RESTART};
        (void)sigemptyset(&ours.sa_mask);
        if (sigaction(signals[i], NULL, &before) != 0 || before.sa_handler == SIG_IGN) continue;
        (void)sigaction(signals[i], &ours, NULL);
    }
}

void nb_interrupt_listen(void)
{
    if (is_listening) return;
    is_listening = 1;
    handle_with(receive);
}

/* Nothing but what a handler may call. */
static void end_at_once(int number)
{
    if (write(STDERR_FILENO, farewell, farewell_size) >= 0) end_by(number);
    end_by(number);
}

void nb_interrupt_unlisten(const char *what)
{
    handle_with(SIG_DFL);
    is_listening = 0;
    const int size =
        snprintf(farewell, sizeof farewell, "%snebel: %s: stopped\n", isatty(STDERR_FILENO) ? "\n" : "", what);
    farewell_size = size < 0 ? 0 : (size_t)size < sizeof farewell ? (size_t)size : sizeof farewell - 1;
    for (size_t i = 1; i + 1 < farewell_size; i++)
        if ((unsigned char)farewell[i] < 0x20 || farewell[i] == 0x7f) farewell[i] = '?';
    if (received != 0) end_at_once(received);
    handle_with(end_at_once);
}

int nb_interrupt_is_requested(void)
{
    return received != 0;
}

void nb_interrupt_obey(void)
{
    if (received != 0) end_by(received);
}

void nb_interrupt_hold(void)
{
    is_held = 1;
    if (!is_listening) handle_with(receive);
}

void nb_interrupt_release(void)
{
    is_held = 0;
    if (again != 0) end_by(again);
    if (is_listening) return;
    handle_with(SIG_DFL);
    nb_interrupt_obey();
}
