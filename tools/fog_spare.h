/* What must not be the same among the files of `nebel fog`. */
#ifndef NB_FOG_SPARE_H
#define NB_FOG_SPARE_H

#include "fog_names.h"

/* Takes from the list what is no picture to begin with, but the result of another one of the list by an earlier call: the pattern of
 * pictures fits those of results, too. Marks results that would take the place of something that is read. NB_MISUSED or NB_FAILED after a
 * message, where two results have one name or all are marked. */
int nb_fog_spare(nb_fog_list *list, const char *scene, const nebel_scene_data *contents);

#endif
