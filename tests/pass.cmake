# Every test_pass_NAME.c draws through pass_help.h.
nebel_glob(pass_tests test_pass_*.c)
foreach(source IN LISTS pass_tests)
    get_filename_component(name ${source} NAME_WE)
    if(TARGET ${name})
        target_sources(${name} PRIVATE odd_state.c pass_help.c projections.c)
    endif()
endforeach()
