# Every test_NAME_gl.c evaluates GLSL through gl_harness.h.
nebel_glob(gl_tests test_*_gl.c)
foreach(source IN LISTS gl_tests)
    get_filename_component(name ${source} NAME_WE)
    if(TARGET ${name})
        target_sources(${name} PRIVATE gl_harness.c)
    endif()
endforeach()
