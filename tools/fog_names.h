/* Files that belong together: pictures by a pattern, and the names made from what its stars stand for. */
#ifndef NB_FOG_NAMES_H
#define NB_FOG_NAMES_H

#include <nebel/scene.h>

#include <stddef.h>

typedef struct nb_fog_files {
    char *image, *depth, *output;
    char *camera, *transmittance; /* NULL: none */
    const char *refused; /* of the results one that would take the place of something that is read; NULL: none */
    int is_result;       /* of an earlier call */
    uint32_t number;     /* the last one in what the last star stands for; above NB_FOG_LAST_FRAME: there is none */
} nb_fog_files;

enum { NB_FOG_LAST_FRAME = 1000000 };

/* The names one by one, the first from 0. */
enum { NB_FOG_NAMES = 5 };
char **nb_fog_names_of(nb_fog_files *files, int i);
void nb_fog_names_free_one(nb_fog_files *files);

typedef struct nb_fog_list {
    nb_fog_files *files; /* by the operand that they come from, then by name */
    size_t count, capacity;
    size_t result_count; /* that matched the operands, too, and were taken out */
} nb_fog_list;

/* What the list is made of. A star in an operand stands for any letters but a slash; where names have as many stars they get
 * what those stand for, in order. Of an operand without a star one star stands for the file's name without folder and
 * ending. */
typedef struct nb_fog_patterns {
    char **images;
    int image_count;
    const char *depth, *output, *camera, *transmittance; /* the last two may be NULL */
} nb_fog_patterns;

/* NB_DONE; NB_FAILED or NB_MISUSED after a message: an operand that no file matches, stars that do not fit, or what nb_fog_spare
 * says; `scene` (NULL: none) is read, too, with its files. */
int nb_fog_names_list(const nb_fog_patterns *patterns, const char *scene, const nebel_scene_data *contents,
                      nb_fog_list *list);

/* What there is to say of a refused result, by its name. */
#define NB_FOG_REFUSAL "cannot write \"%s\": it is one of the files that are read; name another file"

/* Whether there is something by the names of all results. */
int nb_fog_names_are_made(const nb_fog_files *files);

/* Fine with what a failed call left. */
void nb_fog_names_free(nb_fog_list *list);

#endif
