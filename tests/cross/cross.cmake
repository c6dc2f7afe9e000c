# The core's tests for another system: with cross/cmocka.h, because Debian has cmocka for its own processors only, and run by
# CMAKE_CROSSCOMPILING_EMULATOR. A test belongs to the core unless it uses a header of the layers above.
find_package(Threads REQUIRED)

include(helpers.cmake)
include(suites.cmake)
function(add_check name)
    add_test(NAME ${name} COMMAND ${ARGN})
    set_tests_properties(${name} PROPERTIES TIMEOUT 600)
endfunction()
nebel_find_suites(sources)
set(suites "")
foreach(source IN LISTS sources)
    nebel_library_of_suite(library ${source})
    if(library STREQUAL core)
        list(APPEND suites ${source})
    endif()
endforeach()
nebel_add_suites(core "${suites}" nebel_test_help nebel_internal)
target_include_directories(nebel_test_core PRIVATE cross)
# gcc 12 for aarch64 stops at a loop of test_layers.c with "internal compiler error: in vect_transform_reduction".
target_compile_options(nebel_test_core PRIVATE $<$<C_COMPILER_ID:GNU>:-fno-tree-loop-vectorize>)

# For scripts/check_wine.sh.
nebel_add_program(bits cross/bits.c nebel m)

foreach(part IN ITEMS elementary fog formula)
    include(${part}.cmake)
endforeach()

# What only Windows has.
if(WIN32)
    foreach(name IN ITEMS test_d3d9 test_specular_example)
        nebel_add_program(${name} d3d9/${name}.c nebel_test_help nebel_internal d3d9 user32 gdi32 m)
        target_include_directories(${name} PRIVATE cross)
        add_test(NAME ${name} COMMAND ${name})
        set_tests_properties(${name} PROPERTIES TIMEOUT 600)
    endforeach()
endif()
