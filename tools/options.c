#include "options.h"

#include "decimal.h"
#include "messages.h"

#include <stdio.h>
#include <string.h>

static const nb_option help_option = {"help", 'h', NULL, "Print this page."};

/* ---- likely meanings ------------------------------------------------------------------------- */

enum { LONGEST_NAME = 32 };

static size_t smallest(size_t a, size_t b, size_t c)
{
    const size_t least = a < b ? a : b;
    return least < c ? least : c;
}

/* How many letters must be put in, left out, changed or swapped with their neighbor to make b of a. */
static size_t distance_between(const char *a, size_t a_size, const char *b, size_t b_size)
{
    size_t rows[3][LONGEST_NAME + 1];
    for (size_t j = 0; j <= b_size; j++) rows[0][j] = j;
    for (size_t i = 1; i <= a_size; i++) {
        size_t *const now = rows[i % 3];
        const size_t *const last = rows[(i + 2) % 3], *const before = rows[(i + 1) % 3];
        now[0] = i;
        for (size_t j = 1; j <= b_size; j++) {
            now[j] = smallest(last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1]));
            if (i < 2 || j < 2 || a[i - 1] != b[j - 2] || a[i - 2] != b[j - 1]) continue;
            if (before[j - 2] + 1 < now[j]) now[j] = before[j - 2] + 1;
        }
    }
    return rows[a_size % 3][b_size];
}

const char *nb_options_nearest(const char *word, const char *const *names, size_t count)
{
    const size_t size = strlen(word);
    if (size == 0 || size > LONGEST_NAME) return NULL;
    const char *nearest = NULL;
    size_t least = (size + 3) / 3; /* a third of the letters may be wrong, and one in any case */
    for (size_t i = 0; i < count; i++) {
        const char *const name = names[i];
        const size_t name_size = strlen(name);
        if (name_size > LONGEST_NAME) continue;
        const size_t distance = distance_between(word, size, name, name_size);
        const int begins = size >= 3 && strncmp(word, name, size) == 0;
        if (distance <= least || (begins && nearest == NULL)) {
            nearest = name;
            least = distance > 0 ? distance - 1 : 0;
        }
    }
    return nearest;
}

/* ---- taking the call apart ------------------------------------------------------------------- */

/* The words still to be read. */
typedef struct words {
    char **next;
    int left;
} words;

static int find_option(const nb_command *command, const char *name, size_t size)
{
    for (size_t i = 0; i < command->option_count; i++) {
        const char *const known = command->options[i].name;
        if (strlen(known) == size && memcmp(known, name, size) == 0) return (int)i;
    }
    return -1;
}

static int find_letter(const nb_command *command, char letter)
{
    for (size_t i = 0; i < command->option_count; i++) {
        if (command->options[i].letter == letter) return (int)i;
    }
    return -1;
}

static int reject_unknown(const nb_command *command, const char *word, size_t size)
{
    char name[LONGEST_NAME + 1] = "";
    if (size > 2 && size - 2 <= LONGEST_NAME) memcpy(name, word + 2, size - 2);
    const char *names[NB_MAX_OPTIONS + 1] = {help_option.name};
    for (size_t i = 0; i < command->option_count; i++) names[i + 1] = command->options[i].name;
    const char *const nearest = nb_options_nearest(name, names, command->option_count + 1);
    if (nearest == NULL) {
        return nb_report_misuse(command->name, "%s: there is no option '%.*s'", command->name, (int)size, word);
    }
    return nb_report_misuse(command->name, "%s: there is no option '%.*s'; did you mean '--%s'?", command->name,
                            (int)size, word, nearest);
}

/* Sets an option; `inline_value` is what stands after = or after the letter, or NULL. */
static int set_option(nb_arguments *arguments, int option, const char *inline_value, words *rest)
{
    const nb_command *const command = arguments->command;
    const nb_option *const known = &command->options[option];
    if (known->value == NULL && inline_value != NULL) {
        return nb_report_misuse(command->name, "%s: --%s takes no value", command->name, known->name);
    }
    const char *value = known->value == NULL ? "" : inline_value;
    if (value == NULL) {
        if (rest->left == 0) {
            return nb_report_misuse(command->name, "%s: --%s needs a value: --%s %s", command->name, known->name,
                                    known->name, known->value);
        }
        value = *rest->next++;
        rest->left--;
    }
    arguments->values[option] = value;
    return -1;
}

static int show_help(const nb_command *command)
{
    nb_options_print_help(command);
    return NB_DONE;
}

static int take_long_option(nb_arguments *arguments, const char *word, words *rest)
{
    const char *const equals = strchr(word, '=');
    const size_t size = equals != NULL ? (size_t)(equals - word) : strlen(word);
    if (strcmp(word, "--help") == 0) return show_help(arguments->command);
    const int option = find_option(arguments->command, word + 2, size - 2);
    if (option < 0) return reject_unknown(arguments->command, word, size);
    return set_option(arguments, option, equals != NULL ? equals + 1 : NULL, rest);
}

static int take_short_option(nb_arguments *arguments, const char *word, words *rest)
{
    if (strcmp(word, "-h") == 0) return show_help(arguments->command);
    const int option = find_letter(arguments->command, word[1]);
    if (option < 0) return reject_unknown(arguments->command, word, strlen(word));
    return set_option(arguments, option, word[2] != '\0' ? word + 2 : NULL, rest);
}

static int take_operand(nb_arguments *arguments, char *word)
{
    const nb_command *const command = arguments->command;
    if (arguments->operand_count == command->most_operands) {
        return nb_report_misuse(command->name, "%s: '%s' is one too many; it takes %s: nebel %s %s", command->name,
                                word, command->operands, command->name, command->synopsis);
    }
    arguments->operands[arguments->operand_count++] = word;
    return -1;
}

int nb_options_parse(const nb_command *command, int count, char **words_given, nb_arguments *arguments)
{
    *arguments = (nb_arguments){.command = command, .operands = words_given};
    words rest = {words_given, count};
    int ended = 0;
    while (rest.left > 0) {
        char *const word = *rest.next++;
        rest.left--;
        int status = -1;
        if (!ended && strcmp(word, "--") == 0) {
            ended = 1;
        } else if (ended || word[0] != '-' || word[1] == '\0') {
            status = take_operand(arguments, word);
        } else if (word[1] == '-') {
            status = take_long_option(arguments, word, &rest);
        } else {
            status = take_short_option(arguments, word, &rest);
        }
        if (status >= 0) return status;
    }
    if (arguments->operand_count < command->fewest_operands) {
        return nb_report_misuse(command->name, "%s: it takes %s: nebel %s %s", command->name, command->operands,
                                command->name, command->synopsis);
    }
    return -1;
}

/* ---- values ---------------------------------------------------------------------------------- */

void nb_options_reject(nb_arguments *arguments, int option, const char *problem)
{
    const nb_command *const command = arguments->command;
    nb_report_message("%s: --%s: '%s' %s", command->name, command->options[option].name, arguments->values[option],
                      problem);
    arguments->misused = 1;
}

void nb_options_refuse(nb_arguments *arguments, int option, const char *problem)
{
    const nb_command *const command = arguments->command;
    nb_report_message("%s: --%s %s", command->name, command->options[option].name, problem);
    arguments->misused = 1;
}

double nb_options_number(nb_arguments *arguments, int option, double low, double high, double fallback)
{
    const char *const text = arguments->values[option];
    if (text == NULL) return fallback;
    double number;
    const int is_number = nb_decimal_read(text, strlen(text), &number) == NB_DECIMAL_GOOD;
    if (is_number && number >= low && number <= high) return number;
    char problem[96];
    (void)snprintf(problem, sizeof problem, "is no number from %g to %g", low, high);
    nb_options_reject(arguments, option, problem);
    return fallback;
}

uint32_t nb_options_whole(nb_arguments *arguments, int option, uint32_t low, uint32_t high, uint32_t fallback)
{
    const char *const text = arguments->values[option];
    if (text == NULL) return fallback;
    uint32_t number;
    const int is_number = nb_decimal_read_whole(text, strlen(text), &number) == NB_DECIMAL_GOOD;
    if (is_number && number >= low && number <= high) return number;
    char problem[96];
    (void)snprintf(problem, sizeof problem, "is no whole number from %lu to %lu", (unsigned long)low,
                   (unsigned long)high);
    nb_options_reject(arguments, option, problem);
    return fallback;
}

uint64_t nb_options_memory(nb_arguments *arguments, int option)
{
    return (uint64_t)nb_options_whole(arguments, option, 64, 1048576, 4096) << 20;
}

int nb_options_choice(nb_arguments *arguments, int option, const char *const *names, int fallback)
{
    const char *const text = arguments->values[option];
    if (text == NULL) return fallback;
    char problem[256] = "is unknown; it takes";
    size_t used = strlen(problem);
    int count = 0;
    for (; names[count] != NULL; count++) {
        if (strcmp(text, names[count]) == 0) return count;
        const int wrote = snprintf(problem + used, sizeof problem - used, "%s %s", count > 0 ? "," : "", names[count]);
        used += wrote > 0 && (size_t)wrote < sizeof problem - used ? (size_t)wrote : 0;
    }
    const char *const nearest = nb_options_nearest(text, names, (size_t)count);
    if (nearest != NULL) (void)snprintf(problem + used, sizeof problem - used, "; did you mean '%s'?", nearest);
    nb_options_reject(arguments, option, problem);
    return fallback;
}

/* ---- the help page --------------------------------------------------------------------------- */

enum { HELP_COLUMN = 26 };

/* Each line of `help` starts in the column of the first. */
static void print_option(const nb_option *option)
{
    char letter[8] = "    ";
    if (option->letter != 0) (void)snprintf(letter, sizeof letter, "-%c, ", option->letter);
    const char *const value = option->value != NULL ? option->value : "";
    const int width = printf("  %s--%s%s%s", letter, option->name, value[0] != '\0' ? " " : "", value);
    int column = width;
    if (column >= HELP_COLUMN) {
        (void)putchar('\n');
        column = 0;
    }
    for (const char *line = option->help; line != NULL;) {
        const char *const end = strchr(line, '\n');
        const int size = end != NULL ? (int)(end - line) : (int)strlen(line);
        (void)printf("%*s%.*s\n", HELP_COLUMN - column, "", size, line);
        column = 0;
        line = end != NULL ? end + 1 : NULL;
    }
}

void nb_options_print_help(const nb_command *command)
{
    (void)printf("nebel %s: %s\n\nUsage: nebel %s %s\n\n%s\n", command->name, command->summary, command->name,
                 command->synopsis, command->about);
    (void)printf("Options:\n");
    for (size_t i = 0; i < command->option_count; i++) print_option(&command->options[i]);
    print_option(&help_option);
    (void)printf("\n%s", command->examples);
}
