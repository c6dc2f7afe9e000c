/* Options of a command: one table makes the parser, the checks and the help page. */
#ifndef NB_OPTIONS_H
#define NB_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

enum { NB_MAX_OPTIONS = 32 };

typedef struct nb_option {
    const char *name;  /* without the dashes */
    char letter;       /* 0: none */
    const char *value; /* what the help calls the value; NULL: the option takes none */
    const char *help;  /* lines of at most 52 characters */
} nb_option;

typedef struct nb_command {
    const char *name;
    const char *summary;  /* half a line, for the list of commands */
    const char *synopsis; /* what follows "nebel NAME" */
    const char *about;    /* paragraphs, wrapped */
    const nb_option *options;
    size_t option_count;
    const char *operands; /* their names, for messages */
    int fewest_operands, most_operands;
    const char *examples; /* the rest of the page, from the examples on */
    int (*run)(int count, char **words);
} nb_command;

/* What a command was called with. */
typedef struct nb_arguments {
    const nb_command *command;
    const char *values[NB_MAX_OPTIONS]; /* by position in the table; NULL: not given; "" for an option without value */
    char **operands;                    /* at the beginning of the words */
    int operand_count;
    int misused; /* a value asked for was not what the option takes, and was reported */
} nb_arguments;

/* Takes apart the words after the command's name: --name value, --name=value, -x value, -xvalue; -- ends the options;
 * the last of repeated options counts. Returns -1 to go on, or the exit status where the call was wrong or asked for
 * help. */
int nb_options_parse(const nb_command *command, int count, char **words, nb_arguments *arguments);

/* The page that --help prints. */
void nb_options_print_help(const nb_command *command);

/* Values with their range, or `fallback` where the option is not given. A value that is none is reported and sets
 * arguments->misused. */
double nb_options_number(nb_arguments *arguments, int option, double low, double high, double fallback);
uint32_t nb_options_whole(nb_arguments *arguments, int option, uint32_t low, uint32_t high, uint32_t fallback);

/* --memory of the commands that read scenes. */
#define NB_MEMORY_OPTION                                                                                               \
    {                                                                                                                  \
        "memory", 0, "MB",                                                                                             \
            "The most that the scene and its pictures may take,\n64 to 1048576; it may take a second of\n"             \
            "preparation for each 64. Default: 4096."                                                                  \
    }
uint64_t nb_options_memory(nb_arguments *arguments, int option); /* bytes */

/* The position of the value in `names`, which ends with NULL. */
int nb_options_choice(nb_arguments *arguments, int option, const char *const *names, int fallback);

/* Reports that the option's value is wrong: "NAME: --option: 'value' PROBLEM". */
void nb_options_reject(nb_arguments *arguments, int option, const char *problem);

/* Reports that the option has no place here, whatever its value: "NAME: --option PROBLEM". */
void nb_options_refuse(nb_arguments *arguments, int option, const char *problem);

/* The name that `word` was likely meant to be; NULL: none is near. */
const char *nb_options_nearest(const char *word, const char *const *names, size_t count);

#endif
