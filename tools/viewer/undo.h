/* What was before each change, to be had back. */
#ifndef NB_TOOLS_VIEWER_UNDO_H
#define NB_TOOLS_VIEWER_UNDO_H

#include "document_state.h"

enum { NB_HISTORY_STEPS = 100 };

typedef struct nb_undo_stack {
    nb_document_state steps[NB_HISTORY_STEPS]; /* the oldest first; those from `at` on were undone */
    size_t count, at;
    int is_open; /* further changes belong to the last step */
} nb_undo_stack;

/* Keeps a copy of what was before a change, unless the last step is open; what was undone is forgotten. Where memory is
 * out, or the steps would take too much of it, the oldest are forgotten. */
void nb_history_note(nb_undo_stack *history, const nb_document_state *before);

/* The next change is a step of its own. */
void nb_history_close(nb_undo_stack *history);

/* Exchanges `now` for what was before the last step, or after the one that was undone last. 0: there is none. */
int nb_history_undo(nb_undo_stack *history, nb_document_state *now);
int nb_history_redo(nb_undo_stack *history, nb_document_state *now);

void nb_history_forget(nb_undo_stack *history);

#endif
