# Calls with NULL of every function that the headers declare.
set(null_cpu classic light nebel particles photograph planet render scene shader)
set(null_gl gl)
foreach(library IN ITEMS cpu gl)
    if(NOT TARGET nebel_test_${library})
        continue()
    endif()
    set(calls ${CMAKE_CURRENT_BINARY_DIR}/null_calls_${library}.inc)
    list(TRANSFORM null_${library} REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/include/nebel/\\1.h" OUTPUT_VARIABLE headers)
    add_custom_command(OUTPUT ${calls}
        COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/null_calls.py ${PROJECT_SOURCE_DIR}/include/nebel ${calls}
                ${null_${library}}
        DEPENDS null_calls.py ${headers} VERBATIM)
    target_sources(nebel_test_${library} PRIVATE ${calls})
    target_compile_definitions(nebel_test_${library} PRIVATE NB_NULL_CALLS_${library}="${calls}")
endforeach()
