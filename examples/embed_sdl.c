/* Fog in an engine's own shader, OpenGL 3.3 and SDL2: each fragment asks for the fog between the eye and itself while
 * it is drawn (forward rendering). Needs no pass, no texture, and of nebel the core alone. Left and right turn the
 * camera, Escape ends.
 *
 *     cc embed_sdl.c $(pkg-config --cflags --libs nebel sdl2 epoxy) -lm */
#define SDL_MAIN_HANDLED
#include <nebel/shader.h>

#include "engine.h"
#include "fog.h"
#include "host.h"

#include <SDL.h>

static SDL_Window *open_window(void)
{
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1"); /* SIGTERM ends it, also where a driver is busy with shaders */
    if (SDL_Init(SDL_INIT_VIDEO) != 0) return NULL;
    if (!strcmp(SDL_GetCurrentVideoDriver(), "offscreen") && !SDL_getenv("SDL_VIDEODRIVER"))
        return SDL_SetError("no display; SDL would draw into memory, where nobody sees it"), NULL;
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
    SDL_GL_SetAttribute(SDL_GL_FRAMEBUFFER_SRGB_CAPABLE, 1);
    SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 24);
    return SDL_CreateWindow("nebel: fog in a shader", 0, 0, WIDTH, HEIGHT, SDL_WINDOW_OPENGL);
}

/* Packed for the eye of this frame, into the uniform block that the text declares. */
static nebel_result upload_fog(const nebel_lighting *lighting, const double eye[3])
{
    static nebel_texel_f32 words[NEBEL_BLOCK_TEXELS]; /* more fog than this goes into a texture: NEBEL_FOG_TEXTURE */
    size_t count;
    const nebel_result result = nebel_pack_fog(lighting, eye, words, NEBEL_BLOCK_TEXELS, &count);
    glBufferData(GL_UNIFORM_BUFFER, sizeof words, words, GL_STREAM_DRAW);
    return result;
}

/* The text leaves out what this fog does not have: without NEBEL_FEATURES drivers compile all that fog can be. */
static engine open_engine(const nebel_lighting *lighting)
{
    char head[128];
    const char *const texts[] = {head, nebel_get_shader_source(NEBEL_DIALECT_GLSL_330),
                                 "flat in vec3 color;\n"
                                 "in vec3 place;\n"
                                 "out vec4 pixel;\n"
                                 "void main()\n"
                                 "{\n"
                                 "    nebel_transfer fog = nebel_trace(vec3(0.0), normalize(place), length(place));\n"
                                 "    pixel = vec4(fog.transmittance * color + fog.in_scattering, 1.0);\n"
                                 "}\n"};
    snprintf(head, sizeof head, "#version 330 core\n#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n",
             nebel_pack_features(lighting));
    host_say_compiling("embed_sdl");
    return engine_open(3, texts);
}

int main(void)
{
    SDL_Window *const window = open_window();
    const SDL_GLContext context = window ? SDL_GL_CreateContext(window) : NULL;
    nebel_fog *fog = NULL;
    nebel_snapshot *const snapshot = make_fog(&fog);
    nebel_lighting *const lighting = light_fog(snapshot);
    if (!context) return host_refuse("embed_sdl", SDL_GetError());
    if (!lighting) return 1;

    engine host = open_engine(lighting);
    unsigned block;
    glGenBuffers(1, &block);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, block); /* where nebel_fog_block is unless told otherwise */
    glEnable(GL_FRAMEBUFFER_SRGB);                 /* the window shows sRGB */

    const Uint8 *const keys = SDL_GetKeyboardState(NULL);
    nebel_result result = NEBEL_OK;
    int running = 1;
    for (double angle = 0; result == NEBEL_OK && running;) {
        for (SDL_Event event; SDL_PollEvent(&event);)
            running &= event.type != SDL_QUIT && !(event.type == SDL_KEYDOWN && event.key.keysym.sym == SDLK_ESCAPE);
        angle += .02 * (keys[SDL_SCANCODE_RIGHT] - keys[SDL_SCANCODE_LEFT]);
        engine_turn(&host, angle);
        result = upload_fog(lighting, host.eye);
        engine_draw(&host);
        SDL_GL_SwapWindow(window);
    }
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    SDL_GL_DeleteContext(context);
    SDL_DestroyWindow(window);
    SDL_Quit();
    return result != NEBEL_OK;
}
