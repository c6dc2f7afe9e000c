# test_elementary and test_elementary_gl hold the elementary functions of every instruction set of this processor family.

function(add_elementary_level name flags)
    add_library(elementary_${name} OBJECT elementary_level.c)
    nebel_set_options(elementary_${name})
    target_include_directories(elementary_${name} PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(elementary_${name} PRIVATE NB_LEVEL=${name} ${ARGN})
    target_compile_options(elementary_${name} PRIVATE -Wno-psabi ${flags})
    target_sources(nebel_test_core PRIVATE $<TARGET_OBJECTS:elementary_${name}>)
endfunction()

foreach(level IN LISTS nebel_levels)
    string(TOUPPER ${level} upper)
    add_elementary_level(${level} "${nebel_flags_${level}}" NB_ISA_${upper}=1)
    add_elementary_level(${level}_fast "${nebel_flags_${level}}" NB_ISA_${upper}=1 NB_FAST=1)
    target_compile_definitions(nebel_test_core PRIVATE NB_HAVE_${upper}=1)
endforeach()
add_elementary_level(reference "" NB_DOUBLE=1)

if(TARGET nebel_test_gl)
    target_sources(nebel_test_gl PRIVATE $<TARGET_OBJECTS:elementary_scalar_fast>)
endif()
