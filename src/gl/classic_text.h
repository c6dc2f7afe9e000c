/* Texts of shaders for fog as classic hardware has it. */
#ifndef NB_GL_CLASSIC_TEXT_H
#define NB_GL_CLASSIC_TEXT_H

/* fog_factor, by uniforms that set_factor_numbers sets; and a program that has it at each pixel. */
extern const char nb_factor_text[], nb_pixel_factor_text[];

/* Blending of what is stored, where scene_is_stored says so: device_open, device_blend, device_close. */
extern const char nb_device_text[];

#endif
