if(TARGET test_view_gl)
    target_sources(test_view_gl PRIVATE projections.c)
endif()
