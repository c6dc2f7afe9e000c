/* A frame of the scene renderer while it is drawn: what its parts share. */
#ifndef NB_GL_GL_FRAME_H
#define NB_GL_GL_FRAME_H

#include "method.h"
#include "gl_renderer.h"

#include "frame/surface_lighting.h"
#include "frame/pixel_samples.h"

typedef struct nb_gl_frame {
    nebel_gl_renderer *renderer;
    const nebel_gl_frame_desc *desc;
    double ahead; /* how far before the camera the eye is [m] */
    uint32_t samples, done;
    nb_surface_lighting light;
    double eye[3];
    int panorama;
    const nebel_planet *planet;          /* with air; NULL: none */
    const nebel_textured_planet *layers; /* a planet of them; NULL: none */
    const nebel_clouds *clouds;          /* with volume, in that air; NULL: none */
    nebel_lighting *fog;                 /* the renderer's, or that of r->daylit; NULL: none */
    float even_shade;      /* part of that sun that clouds leave to it, where that is the same everywhere */
    unsigned place, depth; /* where rays end now: as those of the targets */
    nb_method method;
    double reach;            /* [m]: 1, or how far models are, where they are nearer */
    nebel_view view;         /* through the pixels' centres; of a panorama without clip_from_eye */
    nb_pixel_position point; /* of the present sample */
    nebel_view sample_view;  /* through that */
    nebel_rays rays;         /* of sample_view, or of the panorama */
    nebel_view sun_view;     /* of all that is seen, against the sun's light */
    int casts;               /* the sun shines, and there is something to cast shadows */
    int dims;                /* particles dim the sun */
    int shafts;              /* models shade fog */
    nb_sunlit_fog sunlit;    /* that fog */
} nb_gl_frame;

/* Moves a camera of parallel rays up to what it sees. Returns how far [m]. */
double nb_gl_frame_go_near(const nebel_gl_renderer *renderer, nebel_camera *camera, const nebel_gl_frame_desc *desc);

/* CANCELLED where progress, which is told the samples that are done, stops the frame. */
nebel_result nb_gl_frame_ask(const nb_gl_frame *f);

/* Whether the frame has some: fog, or air; particles. */
int nb_gl_frame_has_fog(const nb_gl_frame *f);
int nb_gl_frame_has_particles(const nb_gl_frame *f);

/* Of the present sample. The program is current, the texture on a unit that becomes the active one. */
void nb_gl_frame_set_rays(const nb_gl_frame *f, unsigned program);
void nb_gl_frame_set_vector(unsigned program, const char *name, const float v[3]);
void nb_gl_frame_bind_texture(GLuint unit, GLenum target, unsigned texture);

/* Up to where rays end now, into the targets. */
nebel_result nb_gl_frame_draw_fog(const nb_gl_frame *f);
nebel_result nb_gl_frame_draw_particles(const nb_gl_frame *f);

/* Blending has room for one factor a target: grey particles are drawn into one, others into one for each colour. */
int nb_gl_frame_count_veil_layers(const nb_gl_frame *f);

/* The program that asks the fog of `passes`, NULL: none, and that fog. The kind is given but for its fog. */
nebel_result nb_gl_frame_find_light(const nb_gl_frame *f, const nebel_gl *passes, nb_composite_key kind,
                                    nebel_gl_fog_resources *fog, unsigned *program);

/* ---- the sun --------------------------------------------------------------------------------- */

/* What shades surfaces and fog, around what the first sample sees. */
nebel_result nb_gl_frame_prepare_sun(nb_gl_frame *f);

/* Uniforms of the maps, and of the lists of fog along the sun's light. */
void nb_gl_frame_set_shadows(const nb_gl_frame *f, unsigned program);
void nb_gl_frame_set_tiles(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program);

/* ---- textured planets ----------------------------------------------------------------------- */

/* Of the whole frame: maps, targets, programs. MEMORY, LIMIT, UNSUPPORTED. */
nebel_result nb_gl_frame_prepare_shells(const nb_gl_frame *f);

/* The ground, among the surfaces. */
void nb_gl_frame_draw_shell_ground(const nb_gl_frame *f);

/* All shells of the present sample, each with fog and particles before it, over each other; changes where rays end, and what
 * is in the targets of fog and particles. */
nebel_result nb_gl_frame_draw_shells(nb_gl_frame *f);

/* What light_text asks for. */
void nb_gl_frame_set_shells(const nb_gl_frame *f, unsigned program);

/* ---- clouds with volume ---------------------------------------------------------------------- */

/* As they are in this frame, before anything is drawn; *workspace: of them. VALUE, MEMORY. */
nebel_result nb_gl_frame_set_clouds(nb_gl_frame *f, nebel_cloud_workspace **workspace);

/* Of the whole frame; changes where rays end, and what is in the targets of fog. VALUE, MEMORY. */
nebel_result nb_gl_frame_trace_clouds(nb_gl_frame *f);

/* Up to the surfaces of the present sample. */
nebel_result nb_gl_frame_end_clouds(nb_gl_frame *f);

/* For light_text. */
void nb_gl_frame_bind_clouds(const nb_gl_frame *f);

#endif
