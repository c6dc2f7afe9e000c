/* Ctrl-C and its like: the work ends at the next good moment. */
#ifndef NB_TOOLS_SIGNALS_H
#define NB_TOOLS_SIGNALS_H

/* From now on SIGINT, SIGTERM, SIGHUP and SIGXCPU ask the work to end; a second one ends the program at once. A signal
 * that the caller has told the program to ignore stays ignored. */
void nb_interrupt_listen(void);

/* No longer: a signal ends the program at once, after a line on standard error, "nebel: WHAT: stopped"; one that has come does so
 * now. For work that does not ask. */
void nb_interrupt_unlisten(const char *what);

int nb_interrupt_is_requested(void);

/* Where a signal came, ends the program by it, as the shell expects of an interrupted program; else returns. */
void nb_interrupt_obey(void);

/* Between these two every signal waits, the second one and in a program that does not listen the first one, too: as
 * long as a temporary file is on the disk. The wait is that of a write. */
void nb_interrupt_hold(void);
void nb_interrupt_release(void);

#endif
