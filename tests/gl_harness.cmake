# Every test_NAME_gl.c evaluates GLSL through gl_harness.h.
share_with(test_*_gl gl_harness.c)
