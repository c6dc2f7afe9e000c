/* Where nebel-read-model is: for an installed library in its prefix, for the tests' in the build. */
#include "model/model.h"

const char *nb_model_default_program(void)
{
    return NEBEL_MODEL_READER;
}
