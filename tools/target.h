/* Pictures to be written: what can be known before the work begins. */
#ifndef NB_TARGET_H
#define NB_TARGET_H

/* NB_DONE when a picture can likely be written there: a file can be made in the folder, which is tried, and the path is
 * no folder. Otherwise NB_FAILED after a message. */
int nb_target_check(const char *path);

#endif
