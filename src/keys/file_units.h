/* The conventions a file's numbers are in, and the way from them to ours: metres, y up. */
#ifndef NB_KEYS_FILE_UNITS_H
#define NB_KEYS_FILE_UNITS_H

#include <nebel/scene.h>

#include <stdbool.h>

typedef struct nb_file_units {
    bool z_up;
    double unit; /* m, > 0: one unit of the file */
} nb_file_units;

#define NB_SPACE_OURS ((nb_file_units){false, 1})

/* Right-handed all: (x, y, z) with z up is (x, z, -y) with y up. */
void nb_file_units_convert_direction(const nb_file_units *space, double direction[3]);
void nb_file_units_convert_place(const nb_file_units *space, double place[3]);

/* What turns, stretches and moves: position, quaternion, scale. */
void nb_file_units_convert_placement(const nb_file_units *space, double position[3], double rotation[4],
                                     double scale[3]);

/* Parts and planes, too: they must be memory that may be written to. */
void nb_file_units_convert_volume(const nb_file_units *space, nebel_volume_desc *volume);
void nb_file_units_convert_nebula(const nb_file_units *space, nebel_nebula_desc *nebula);
void nb_file_units_convert_cell(const nb_file_units *space, nebel_cell *cell);

/* What goes along the axes of a noise's box, and its wind. */
void nb_file_units_convert_noise(const nb_file_units *space, nebel_scene_noise *noise);

void nb_file_units_convert_camera(const nb_file_units *space, nebel_camera *camera);

/* The other way: from metres, y up, to the file's numbers. */
void nb_file_units_restore_direction(const nb_file_units *space, double direction[3]);
void nb_file_units_restore_place(const nb_file_units *space, double place[3]);
void nb_file_units_restore_placement(const nb_file_units *space, double position[3], double rotation[4],
                                     double scale[3]);
void nb_file_units_restore_camera(const nb_file_units *space, nebel_camera *camera);

void nb_file_units_restore_plane(const nb_file_units *space, nebel_plane *plane);

/* Planes and parts stay as they are. */
void nb_file_units_restore_shape(const nb_file_units *space, nebel_shape *shape);
void nb_file_units_restore_volume(const nb_file_units *space, nebel_volume_desc *volume);
void nb_file_units_restore_nebula(const nb_file_units *space, nebel_nebula_desc *nebula);
void nb_file_units_restore_noise(const nb_file_units *space, nebel_scene_noise *noise);
void nb_file_units_restore_cell(const nb_file_units *space, nebel_cell *cell);

#endif
