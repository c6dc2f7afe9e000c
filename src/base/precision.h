/* long double with all the digits that the compiler counts on. On x86 they hang on a setting of each thread: Windows
 * starts threads with 53 bits where gcc's long double has 64, and Direct3D 9 may leave 24 in the thread that creates a
 * device. Whoever computes in long double or in quad, which builds on it, asks for all bits first and gives the
 * thread's setting back. */
#ifndef NB_BASE_PRECISION_H
#define NB_BASE_PRECISION_H

/* Returns the setting that was, for nb_restore_precision. */
unsigned nb_full_precision(void);

void nb_restore_precision(unsigned setting);

#endif
