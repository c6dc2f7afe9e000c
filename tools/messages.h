/* What the program says on standard error, and how it ends. */
#ifndef NB_TOOLS_MESSAGES_H
#define NB_TOOLS_MESSAGES_H

#include <nebel/nebel.h>

#include <stdatomic.h>

#if defined(__GNUC__)
#define NB_REPORT_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define NB_REPORT_PRINTF(text, first)
#endif

/* Exit statuses, the same for every command. */
enum {
    NB_DONE = 0,   /* the work is done */
    NB_FAILED = 1, /* the work failed */
    NB_MISUSED = 2 /* the call was wrong */
};

/* Bytes that are no printable character of UTF-8 become '?', so that no name in a file can steer a terminal. */
void nb_report_mask(char *text);

/* "nebel: MESSAGE" on a line of its own, masked. */
void nb_report_message(const char *format, ...) NB_REPORT_PRINTF(1, 2);

/* The same; returns NB_FAILED. */
int nb_report_failure(const char *format, ...) NB_REPORT_PRINTF(1, 2);

/* The same, with the way to the help page of `command` (NULL: of the program); returns NB_MISUSED. */
int nb_report_misuse(const char *command, const char *format, ...) NB_REPORT_PRINTF(2, 3);

/* What becomes of a library's messages. */
typedef enum nb_report_mode {
    NB_REPORT_PRINT = 0,
    NB_REPORT_DROP, /* while threads work: the messages would come in any order */
    NB_REPORT_KEEP  /* the first one stays in `kept`, without the number of a ray that it may begin with */
} nb_report_mode;

typedef struct nb_report_listener {
    size_t printed; /* so that an error never passes in silence */
    nb_report_mode mode;
    int quiet; /* what is no error is left out */
    atomic_int kept_count;
    char kept[512];
} nb_report_listener;

/* A log callback that does with messages what the listener's mode says, PRINT for one thread only; `listener` must
 * outlive what the log is given to. */
nebel_log nb_report_log(nb_report_listener *listener);

/* Ends an error path of a library call: says what the result means if the library has not. Returns NB_FAILED. */
int nb_report_result(const nb_report_listener *listener, const char *what, nebel_result result);

/* Draws `text` over the last status line of the terminal; "" clears it. Messages push the status line away. */
void nb_report_status(const char *text);

#endif
