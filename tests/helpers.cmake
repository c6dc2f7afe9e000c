# What several tests call, compiled once. A test takes of it what it calls: members of an archive that a program does not use are
# not linked, nor are the libraries that only they need.
set(helpers d3d9_facts.c formula_inputs.c formula_truth.c lit_density.c lit_edge.c lit_fog.c lit_oracle.c lit_scenes.c lit_shape.c oracle.c oracle_edge.c oracle_shape.c projections.c random_fog.c truth_file.c)
if(nebel_epoxy_FOUND AND NOT CMAKE_CROSSCOMPILING)
    list(APPEND helpers classic_help.c gl_harness.c odd_state.c pass_help.c picture_help.c)
endif()
add_library(nebel_test_help STATIC EXCLUDE_FROM_ALL ${helpers})
nebel_set_options(nebel_test_help)
target_include_directories(nebel_test_help PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
target_compile_definitions(nebel_test_help PRIVATE NEBEL_SOURCE="${PROJECT_SOURCE_DIR}")
