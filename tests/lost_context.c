/* Loaded before a program that uses libepoxy: its context of OpenGL is lost whenever a file appears, which goes. */
#include <epoxy/gl.h>

#include <stdlib.h>
#include <unistd.h>

static GLenum EPOXY_CALLSPEC find_status(void)
{
    const char *const file = getenv("NEBEL_LOSE_CONTEXT");
    return file != NULL && unlink(file) == 0 ? GL_GUILTY_CONTEXT_RESET_ARB : GL_NO_ERROR;
}

__attribute__((constructor)) static void replace(void)
{
    epoxy_glGetGraphicsResetStatusARB = find_status;
}
