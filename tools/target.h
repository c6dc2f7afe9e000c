/* Pictures to be written: what can be known before the work begins. */
#ifndef NB_TARGET_H
#define NB_TARGET_H

typedef enum nb_target_kind {
    NB_TARGET_NONE = 0, /* an ending that no picture has */
    NB_TARGET_PNG,
    NB_TARGET_EXR
} nb_target_kind;

/* By the ending, in any case. */
nb_target_kind nb_target_find_kind(const char *path);

/* NB_DONE when a picture can likely be written there: a file can be made in the folder, which is tried, and the path is
 * no folder. Otherwise NB_FAILED after a message. */
int nb_target_check(const char *path);

#endif
