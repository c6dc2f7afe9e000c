# The levels of formula_level.h, for the suites that ask shapes and profiles by name.

foreach(level IN ITEMS float double fast)
    add_library(formula_${level} OBJECT formula_level.c)
    nebel_set_options(formula_${level})
    target_include_directories(formula_${level} PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(formula_${level} PRIVATE NB_LEVEL=${level})
endforeach()
target_compile_definitions(formula_double PRIVATE NB_DOUBLE=1)
target_compile_definitions(formula_fast PRIVATE NB_FAST=1)

foreach(program IN ITEMS nebel_test_core nebel_test_gl)
    if(TARGET ${program})
        target_sources(${program} PRIVATE $<TARGET_OBJECTS:formula_float> $<TARGET_OBJECTS:formula_double>
            $<TARGET_OBJECTS:formula_fast>)
    endif()
endforeach()
