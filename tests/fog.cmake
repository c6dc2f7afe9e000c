# The tests of the core's queries with random fog, and with threads of their own.
find_package(Threads REQUIRED)
target_sources(test_find PRIVATE random_fog.c)
target_sources(test_planes PRIVATE random_fog.c)
target_sources(test_segments PRIVATE random_fog.c)
target_sources(test_threads PRIVATE random_fog.c)
target_link_libraries(test_threads PRIVATE Threads::Threads)
