/* Where the ray of a pixel meets a triangle, as text behind the declarations of surface_place, surface_corner, surface_face,
 * surface_edge_a and surface_edge_b. */
#ifndef NB_GL_SURFACE_TEXT_H
#define NB_GL_SURFACE_TEXT_H

extern const char nb_surface_edge_text[], nb_surface_distance_text[], nb_surface_inset_text[];

#endif
