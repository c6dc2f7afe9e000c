# test_gltf compresses data as an exporter would.
if(TARGET nebel_test_cpu AND TARGET nebel_meshopt)
    target_link_libraries(nebel_test_cpu PRIVATE nebel_meshopt)
    target_compile_definitions(nebel_test_cpu PRIVATE NEBEL_HAVE_MESHOPT=1)
endif()
