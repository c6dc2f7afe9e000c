# The tests that compare pictures of both renderers.
nebel_glob(picture_tests test_picture_*.c)
foreach(source IN LISTS picture_tests)
    get_filename_component(name ${source} NAME_WE)
    if(TARGET ${name})
        target_sources(${name} PRIVATE picture_help.c odd_state.c pass_help.c projections.c random_fog.c)
    endif()
endforeach()
