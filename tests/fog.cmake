# Fog asked by several threads at once, and over lengths of every size.
find_package(Threads REQUIRED)
target_link_libraries(nebel_test_core PRIVATE Threads::Threads)

# Lengths from 1e-REACH to 1e+REACH m, where float and double must agree within the errors that they state.
if(NOT CMAKE_CROSSCOMPILING AND TEST test_extremes)
    foreach(reach 1 2 4)
        add_check(test_extremes_reach_${reach} nebel_test_core test_extremes 0 ${reach})
    endforeach()
endif()
