/* What is in a scene. */
#ifndef NB_INFO_SCENE_H
#define NB_INFO_SCENE_H

/* Prints it to standard output. Returns the exit status: NB_FAILED where the scene or one of its models is wrong. */
int nb_info_print_scene(const char *path);

#endif
