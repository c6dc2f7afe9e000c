/* nebel view: a window on a scene. */
#include "commands.h"
#include "decimal.h"
#include "reader.h"
#include "messages.h"
#include "output_check.h"

#if defined(NEBEL_HAVE_VIEWER)
#include "viewer/viewer.h"
#endif

#include <nebel/scene.h>

#include <string.h>

enum { SIZE, EXPOSURE, FRAME, UI_SCALE, SCREENSHOT, WIDGETS, MEMORY };

static const nb_option options[] = {
    [SIZE] = {"size", 's', "WxH", "Of the picture in the window, each side 64 to 8192.\nDefault: 1280x720."},
    [EXPOSURE] = {"exposure", 'e', "EV", "Stops, -20 to 20: 1 doubles the light. Default: 0."},
    [FRAME] = {"frame", 0, "N", "The frame of a moving camera or fog, 0 to 1000000.\nDefault: 0."},
    [UI_SCALE] = {"ui-scale", 0, "N", "How large the controls are, 0.5 to 4. Default: what\nthe screen says."},
    [SCREENSHOT] = {"screenshot", 0, "FILE",
                    "Writes the window (.png or .exr) when its picture is\ncomplete, and ends."},
    [WIDGETS] = {"widgets", 0, "FILE",
                 "Keeps a list of the controls in FILE, a line\n\"x y width height name\" for each: for programs that\n"
                 "press them."},
    [MEMORY] = NB_MEMORY_OPTION,
};

static const char about[] = "Shows SCENE (JSON) in a window, drawn by OpenGL 3.3: turn it, fly through it,\n"
                            "move the sliders of its fog. F1 in the window lists keys and mouse.\n"
                            "\n"
                            "While something moves the picture has fewer pixels, as many as the computer\n"
                            "manages; when it rests it becomes that of 'nebel render --device gl'.\n";

static const char examples[] = "Examples:\n"
                               "  nebel view mist.json\n"
                               "  nebel view mist.json --size 960x540 --screenshot window.png\n"
                               "\n"
                               "Exit status: 0 done, 1 the work failed, 2 the call was wrong.\n";

#if defined(NEBEL_HAVE_VIEWER)
enum { SMALLEST_SIDE = 64, LARGEST_SIDE = 8192 };

static void read_size(nb_arguments *arguments, nb_viewer_options *wanted)
{
    const char *const text = arguments->values[SIZE];
    const char *const middle = text != NULL ? strchr(text, 'x') : NULL;
    uint32_t *const sides[2] = {&wanted->width, &wanted->height};
    if (text == NULL) return;
    int good = middle != NULL &&
               nb_decimal_read_whole(text, (size_t)(middle - text), &wanted->width) == NB_DECIMAL_GOOD &&
               nb_decimal_read_whole(middle + 1, strlen(middle + 1), &wanted->height) == NB_DECIMAL_GOOD;
    for (int i = 0; i < 2; i++) good = good && *sides[i] >= SMALLEST_SIDE && *sides[i] <= LARGEST_SIDE;
    if (!good) nb_options_reject(arguments, SIZE, "is no size such as 1280x720, each side from 64 to 8192");
}

static int view(nb_arguments *arguments)
{
    nb_viewer_options wanted = {.scene = arguments->operands[0], .width = 1280, .height = 720};
    read_size(arguments, &wanted);
    wanted.exposure = nb_options_number(arguments, EXPOSURE, -20, 20, 0);
    wanted.frame = nb_options_number(arguments, FRAME, 0, 1000000, 0);
    wanted.scale = nb_options_number(arguments, UI_SCALE, 0.5, 4, 0);
    nb_reader_limit(nb_options_memory(arguments, MEMORY));
    wanted.screenshot = arguments->values[SCREENSHOT];
    wanted.controls = arguments->values[WIDGETS];
    if (wanted.screenshot != NULL && nebel_get_image_format(wanted.screenshot) == NEBEL_IMAGE_NONE)
        nb_options_reject(arguments, SCREENSHOT, "is no name that ends in .png or .exr");
    if (arguments->misused) return nb_report_misuse("view", "view: nothing was done");
    if (wanted.screenshot != NULL && nb_target_check(wanted.screenshot) != NB_DONE) return NB_FAILED;
    return nb_view_run(&wanted);
}
#else
static int view(nb_arguments *arguments)
{
    (void)arguments;
    return nb_report_failure(
        "view: this program was built without the viewer; install GLFW 3.3 and Dear ImGui (Debian: "
        "g++ libglfw3-dev libimgui-dev) and build it again, or use 'nebel render'");
}
#endif

static int run(int count, char **words)
{
    nb_arguments arguments;
    const int status = nb_options_parse(&nb_commands_view, count, words, &arguments);
    return status >= 0 ? status : view(&arguments);
}

const nb_command nb_commands_view = {
    .name = "view",
    .summary = "a window on a scene",
    .synopsis = "SCENE [options]",
    .about = about,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands = "one scene file",
    .fewest_operands = 1,
    .most_operands = 1,
    .examples = examples,
    .run = run,
};
