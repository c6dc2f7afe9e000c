# The tests of classic fog in OpenGL watch their context as the passes do.
if(TARGET test_classic_gl)
    target_sources(test_classic_gl PRIVATE pass_help.c projections.c)
endif()
