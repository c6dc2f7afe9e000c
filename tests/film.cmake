# Films are read back with libwebp's own decoder, where nebel was built with it.
if(TARGET nebel_test_scene AND nebel_with_webp)
    pkg_check_modules(nebel_webpdemux REQUIRED IMPORTED_TARGET libwebpdemux)
    target_link_libraries(nebel_test_scene PRIVATE PkgConfig::nebel_webpdemux)
    target_compile_definitions(nebel_test_scene PRIVATE NEBEL_HAVE_WEBP=1)
endif()
