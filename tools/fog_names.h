/* Files that belong together: pictures by a pattern, and the names made from what its stars stand for. */
#ifndef NB_FOG_NAMES_H
#define NB_FOG_NAMES_H

#include <stddef.h>

typedef struct nb_fog_files {
    char *image, *depth, *output;
    char *camera, *transmittance; /* NULL: none */
} nb_fog_files;

typedef struct nb_fog_list {
    nb_fog_files *files; /* by the operand that they come from, then by name */
    size_t count, capacity;
} nb_fog_list;

/* What the list is made of. A star in an operand stands for any letters but a slash; where names have as many stars they get
 * what those stand for, in order. Of an operand without a star one star stands for the file's name without folder and
 * ending. */
typedef struct nb_fog_patterns {
    char **images;
    int image_count;
    const char *depth, *output, *camera, *transmittance; /* the last two may be NULL */
} nb_fog_patterns;

/* NB_DONE; NB_FAILED or NB_MISUSED after a message: an operand that no file matches, stars that do not fit, one name for two
 * results, or a result in the place of something that is read; `scene` (NULL: none) is read, too. */
int nb_fog_names_list(const nb_fog_patterns *patterns, const char *scene, nb_fog_list *list);

/* Fine with what a failed call left. */
void nb_fog_names_free(nb_fog_list *list);

#endif
