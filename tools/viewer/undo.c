#include "undo.h"

#include <string.h>

/* Bytes that all steps may take. */
static const size_t most = (size_t)64 << 20;

static void forget_from(nb_undo_stack *history, size_t first)
{
    for (size_t i = first; i < history->count; i++) nb_document_state_free(&history->steps[i]);
    history->count = first;
    if (history->at > first) history->at = first;
}

static void forget_oldest(nb_undo_stack *history)
{
    nb_document_state_free(&history->steps[0]);
    history->count--;
    history->at -= history->at > 0;
    memmove(history->steps, history->steps + 1, history->count * sizeof *history->steps);
}

static size_t find_limit(size_t size)
{
    const size_t steps = most / size;
    return steps < 2 ? 2 : steps > NB_HISTORY_STEPS ? NB_HISTORY_STEPS : steps;
}

void nb_history_note(nb_undo_stack *history, const nb_document_state *before)
{
    if (history->is_open) return;
    history->is_open = 1;
    forget_from(history, history->at);
    while (history->count >= find_limit(nb_document_state_size(before))) forget_oldest(history);
    if (nb_document_state_copy(before, &history->steps[history->count]) != 0) return;
    history->at = ++history->count;
}

void nb_history_close(nb_undo_stack *history)
{
    history->is_open = 0;
}

static void exchange(nb_document_state *a, nb_document_state *b)
{
    const nb_document_state kept = *a;
    *a = *b;
    *b = kept;
}

int nb_history_undo(nb_undo_stack *history, nb_document_state *now)
{
    if (history->at == 0) return 0;
    history->is_open = 0;
    exchange(&history->steps[--history->at], now);
    return 1;
}

int nb_history_redo(nb_undo_stack *history, nb_document_state *now)
{
    if (history->at == history->count) return 0;
    history->is_open = 0;
    exchange(&history->steps[history->at++], now);
    return 1;
}

void nb_history_forget(nb_undo_stack *history)
{
    forget_from(history, 0);
    history->is_open = 0;
}
