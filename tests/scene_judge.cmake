if(TARGET nebel_scene)
    nebel_add_program(scene_judge scene_judge.c ${internal_libraries} m)
endif()
