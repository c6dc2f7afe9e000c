/* nebel info: what this program is, and what is in a scene. */
#include "commands.h"
#include "info_scene.h"
#include "isa_option.h"
#include "system_info.h"
#include "ranks.h"
#include "reader.h"
#include "messages.h"
#include "thread_pool.h"

#include <nebel/nebel.h>
#include <nebel/render.h>
#include <nebel/scene.h>

#if defined(NEBEL_HAVE_GL)
#include "gl_context.h"
#endif

#include <stdio.h>

enum { MEMORY };

static const nb_option options[] = {[MEMORY] = NB_MEMORY_OPTION};

static const char about[] = "Without SCENE: version, compiler, libraries, processor, instruction sets, OpenGL\n"
                            "and threads, as bug reports need them.\n"
                            "\n"
                            "With SCENE: checks the file and its models and says what is in them (camera,\n"
                            "light, fog by shape and density, triangles, bounds), how far one sees from the\n"
                            "camera, and what looks like a mistake.\n";

static const char examples[] = "Examples:\n"
                               "  nebel info\n"
                               "  nebel info mist.json\n"
                               "\n"
                               "Exit status: 0 done, 1 the scene or a model is wrong, 2 the call was wrong.\n";

#if defined(__x86_64__)
#define ARCHITECTURE "x86-64"
#elif defined(__aarch64__)
#define ARCHITECTURE "aarch64"
#else
#define ARCHITECTURE "another architecture"
#endif

#if defined(__OPTIMIZE__)
#define OPTIMIZATION "optimized"
#else
#define OPTIMIZATION "not optimized"
#endif

#if defined(NDEBUG)
#define ASSERTIONS "without assertions"
#else
#define ASSERTIONS "with assertions"
#endif

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZER ", with AddressSanitizer"
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define SANITIZER ", with AddressSanitizer"
#endif
#if !defined(SANITIZER)
#define SANITIZER ""
#endif

#if defined(NEBEL_HAVE_VIEWER)
#define VIEWER "GLFW, Dear ImGui"
#else
#define VIEWER "not in this build"
#endif

static void print_instruction_sets(void)
{
    (void)printf("instruction sets:");
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (nebel_isa_available((nebel_isa)isa)) (void)printf(" %s", nebel_isa_name((nebel_isa)isa));
    }
    (void)printf("\nchosen: %s\n", nebel_isa_name(nb_isa_best()));
}

/* What `nebel render --device gl` would draw with. */
static void print_opengl(void)
{
#if defined(NEBEL_HAVE_GL)
    nb_gl_context gl;
    if (nb_gl_context_open_any(&gl) == 0) {
        (void)printf("OpenGL: %s\n", gl.renderer);
        nb_gl_context_close(&gl);
    } else {
        (void)printf("OpenGL: none: %s\n", gl.fault);
    }
#else
    (void)printf("OpenGL: not in this build\n");
#endif
}

static int print_program(void)
{
    char processor[256];
    nb_machine_read_processor(processor, sizeof processor);
    (void)printf("nebel %s\n", nebel_version());
    (void)printf("compiler: %s\n", nb_machine_compiler());
    (void)printf("build: %s, %s, %s%s\n", ARCHITECTURE, OPTIMIZATION, ASSERTIONS, SANITIZER);
    (void)printf("scene libraries: %s\n", nebel_scene_libraries());
    const char *const reader = nb_reader_path();
    (void)printf("model reader: %s\n", reader != NULL ? reader : "not beside this program");
    (void)printf("renderer libraries: %s\n", nebel_cpu_libraries());
    (void)printf("processor: %s\n", processor);
    print_instruction_sets();
    print_opengl();
    (void)printf("viewer: " VIEWER "\n");
    const char *const ranks = nb_ranks_library();
    (void)printf("MPI: %s\n", ranks != NULL ? ranks : "not in this build");
    (void)printf("threads: %d\n", nb_workers_available());
    return NB_DONE;
}

static int run(int count, char **words)
{
    nb_arguments arguments;
    const int status = nb_options_parse(&nb_commands_info, count, words, &arguments);
    if (status >= 0) return status;
    nb_reader_limit(nb_options_memory(&arguments, MEMORY));
    if (arguments.misused) return nb_report_misuse("info", "info: nothing was done");
    return arguments.operand_count == 0 ? print_program() : nb_info_print_scene(arguments.operands[0]);
}

const nb_command nb_commands_info = {
    .name = "info",
    .summary = "what this program is, or what is in a scene",
    .synopsis = "[SCENE] [options]",
    .about = about,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands = "one scene file or nothing",
    .most_operands = 1,
    .examples = examples,
    .run = run,
};
