/* The context of the program: OpenGL without a window. */
#include "gl_context.h"
#include "unit.h"

#include <epoxy/gl.h>

static void check_api(nb_gl_api api, int version)
{
    for (int i = 0; i < 3; i++) {
        nb_gl_context gl;
        if (nb_gl_context_open(&gl, api) != 0) fail_msg("%s", gl.fault);
        assert_true(epoxy_gl_version() >= version);
        assert_int_equal(epoxy_is_desktop_gl(), api == NB_GL_API_DESKTOP);
        assert_true(gl.renderer[0] != '\0');
        assert_int_equal(glGetError(), GL_NO_ERROR);
        nb_gl_context_close(&gl);
        assert_int_equal(epoxy_gl_version(), 0);
    }
}

static void test_opens_both_interfaces_again_and_again(void **state)
{
    (void)state;
    check_api(NB_GL_API_DESKTOP, 33);
    check_api(NB_GL_API_ES, 30);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_opens_both_interfaces_again_and_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
