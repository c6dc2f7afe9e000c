# The core's tests for another system: with cross/cmocka.h, because Debian has cmocka for its own processors only, and run by
# CMAKE_CROSSCOMPILING_EMULATOR. A test belongs to the core unless it uses a header of the layers above.
find_package(Threads REQUIRED)

include(helpers.cmake)
nebel_glob(sources test_*.c)
foreach(source IN LISTS sources)
    file(STRINGS ${source} includes REGEX "^#include")
    if(includes MATCHES "(scene|render|gl|gl_[a-z]+|decimal|shortest)\\.h|epoxy|(scene|model|shader|pass|picture)_(help|draft)|cpu/")
        continue()
    endif()
    get_filename_component(name ${source} NAME_WE)
    nebel_add_program(${name} ${source} nebel_test_help nebel_internal m)
    target_include_directories(${name} PRIVATE cross)
    target_compile_definitions(${name} PRIVATE NEBEL_SOURCE="${PROJECT_SOURCE_DIR}")
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES TIMEOUT 600)
endforeach()

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
