/* What the tests of errors in OpenGL share: messages, and functions that take the place of a driver's. Include after
 * <epoxy/gl.h>. */
#ifndef GL_ERRORS_H
#define GL_ERRORS_H

#include "fog_help.h"

static fog_messages messages;

static inline void expect_message(nebel_result result, nebel_result wanted, const char *part)
{
    assert_int_equal(result, wanted);
    if (messages.count == 0 || messages.result != wanted || strstr(messages.text, part) == NULL)
        fail_msg("'%s' says nothing of '%s'", messages.text, part);
    messages.count = 0;
}

/* glIsVertexArray in a lost context, where no name is known any longer. */
static inline GLboolean EPOXY_CALLSPEC is_nothing(GLuint name)
{
    (void)name;
    return GL_FALSE;
}

static PFNGLGETINTEGERVPROC true_get_integer;

/* glGetIntegerv of a driver that has hardly any textures. */
static inline void EPOXY_CALLSPEC narrow_textures(GLenum name, GLint *value)
{
    true_get_integer(name, value);
    if (name == GL_MAX_TEXTURE_SIZE) *value = 3;
}

#endif
