# Films are read back with libwebp's own decoder, where nebel was built with it.
if(TARGET test_film AND nebel_with_webp)
    pkg_check_modules(nebel_webpdemux REQUIRED IMPORTED_TARGET libwebpdemux)
    target_link_libraries(test_film PRIVATE PkgConfig::nebel_webpdemux)
    target_compile_definitions(test_film PRIVATE NEBEL_HAVE_WEBP=1)
endif()
