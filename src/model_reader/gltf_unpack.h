/* Decompression that nebel-read-model alone is linked with. */
#ifndef NB_MODEL_READER_GLTF_UNPACK_H
#define NB_MODEL_READER_GLTF_UNPACK_H

#include "model/model.h"

/* EXT_meshopt_compression; NULL where the build has no libmeshoptimizer. */
nb_unpack nb_unpack_meshopt(void);

#endif
