# Suites: files test_NAME.c, many of which are compiled into one program.

# The sources of all suites, or of those that NEBEL_TEST_SUITES names.
function(nebel_find_suites result)
    nebel_glob(sources test_*.c)
    if(NEBEL_TEST_SUITES)
        list(FILTER sources INCLUDE REGEX "/(${NEBEL_TEST_SUITES})\\.c$")
    endif()
    set(${result} ${sources} PARENT_SCOPE)
endfunction()

# The library that a suite needs, by its name and its headers: core, scene, cpu or gl.
function(nebel_library_of_suite result source)
    file(STRINGS ${source} includes REGEX "^#include")
    if(source MATCHES "_gl\\.c$")
        set(library gl)
    elseif(includes MATCHES "nebel/render\\.h|cpu/|(render|model|cell|worlds)_help|render_scene|(shadows|jobs)\\.h")
        set(library cpu)
    elseif(includes MATCHES "nebel/scene\\.h|scene/|(scene)_(help|draft)|(decimal|shortest)\\.h")
        set(library scene)
    else()
        set(library core)
    endif()
    set(${result} ${library} PARENT_SCOPE)
endfunction()

# The program nebel_test_<library> of the suites, and a test for each of them.
function(nebel_add_suites library sources)
    set(program nebel_test_${library})
    set(table ${CMAKE_CURRENT_BINARY_DIR}/suites_${library}.inc)
    set(lines "")
    foreach(source IN LISTS sources)
        get_filename_component(name ${source} NAME_WE)
        file(STRINGS ${source} without_arguments REGEX "^int main\\(void\\)")
        if(without_arguments)
            string(APPEND lines "SUITE(${name})\n")
        else()
            string(APPEND lines "SUITE_WITH_ARGUMENTS(${name})\n")
        endif()
        # In the program main is suites.c's; that of a suite is run_NAME.
        set_source_files_properties(${source} PROPERTIES
            COMPILE_DEFINITIONS main=run_${name} COMPILE_OPTIONS -Wno-missing-prototypes)
    endforeach()
    file(CONFIGURE OUTPUT ${table} CONTENT "${lines}" @ONLY)
    nebel_add_program(${program} "${sources};suites.c" ${ARGN} m)
    set_source_files_properties(suites.c PROPERTIES OBJECT_DEPENDS ${table})
    target_compile_definitions(${program} PRIVATE
        NEBEL_SOURCE="${PROJECT_SOURCE_DIR}" NEBEL_TOOL="${PROJECT_BINARY_DIR}/nebel" NB_SUITES="${table}")
    foreach(source IN LISTS sources)
        get_filename_component(name ${source} NAME_WE)
        add_check(${name} ${program} ${name})
    endforeach()
endfunction()
