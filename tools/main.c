/* nebel: exact fog from the command line. */
#include "abort_guard.h"
#include "commands.h"
#include "fd_output.h"
#include "messages.h"

#include <nebel/nebel.h>

#include <stdio.h>
#include <string.h>

static const nb_command *const commands[] = {
    &nb_commands_render, &nb_commands_fog,  &nb_commands_trace,
    &nb_commands_view,   &nb_commands_info, &nb_commands_compare,
#if defined(NEBEL_HAVE_BENCH)
    &nb_commands_bench,
#endif
};

enum { COMMANDS = sizeof commands / sizeof *commands };

static const char help_option[] = "--help", version_option[] = "--version";

static int print_help(void)
{
    (void)printf("nebel: exact fog, in pictures and in numbers\n\nUsage: nebel COMMAND [options]\n\nCommands:\n");
    for (int i = 0; i < COMMANDS; i++) (void)printf("  %-10s%s\n", commands[i]->name, commands[i]->summary);
    (void)printf("\n"
                 "Examples:\n"
                 "  A picture of a scene:\n"
                 "    nebel render mist.json -o mist.png\n"
                 "  Fog over a photograph whose depth is known:\n"
                 "    nebel fog street.png -d street.exr --hfov 60 -v 150 -o foggy.png\n"
                 "  What fog does to the light along one ray, 50 m straight ahead:\n"
                 "    echo '0 1.7 0  0 0 -1  50' | nebel trace mist.json\n"
                 "\n"
                 "  nebel COMMAND --help    options and examples of a command\n"
                 "  nebel --version         the version\n"
                 "\n"
                 "Exit status: 0 done, 1 the work failed, 2 the call was wrong.\n");
    return NB_DONE;
}

static int reject_command(const char *word)
{
    const char *names[COMMANDS + 2] = {help_option, version_option};
    for (int i = 0; i < COMMANDS; i++) names[i + 2] = commands[i]->name;
    const char *const kind = word[0] == '-' ? "option" : "command";
    const char *const nearest = nb_options_nearest(word, names, COMMANDS + 2);
    if (nearest == NULL) return nb_report_misuse(NULL, "there is no %s '%s'", kind, word);
    return nb_report_misuse(NULL, "there is no %s '%s'; did you mean '%s'?", kind, word, nearest);
}

static const nb_command *find_command(const char *name)
{
    for (int i = 0; i < COMMANDS; i++) {
        if (strcmp(name, commands[i]->name) == 0) return commands[i];
    }
    return NULL;
}

static int asks_for_help(const char *word)
{
    return strcmp(word, help_option) == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0;
}

/* "nebel help", "nebel help COMMAND", and the same with --help. */
static int help_with(int count, char **words)
{
    if (count == 0 || asks_for_help(words[0])) return print_help();
    const nb_command *const command = find_command(words[0]);
    if (command == NULL) return reject_command(words[0]);
    nb_options_print_help(command);
    return NB_DONE;
}

static int print_version(void)
{
    (void)printf("nebel %s\n", nebel_version());
    return NB_DONE;
}

static int run(int count, char **words)
{
    if (count == 0) return nb_report_misuse(NULL, "a command is missing");
    const char *const word = words[0];
    if (asks_for_help(word)) return help_with(count - 1, words + 1);
    if (strcmp(word, version_option) == 0) return print_version();
    const nb_command *const command = find_command(word);
    return command != NULL ? command->run(count - 1, words + 1) : reject_command(word);
}

int main(int count, char **words)
{
    nb_output_prepare();
    nb_abort_explain();
    return nb_output_finish(run(count > 0 ? count - 1 : 0, words + 1));
}
