if(TARGET nebel_scene)
    nebel_add_program(web_case web_case.c ${internal_libraries} m)
endif()
