/* Any bytes as an OpenEXR picture: a picture or an error with a message, and every byte of memory back. */
#include "picture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const nb_bytes bytes = {(unsigned char *)data, size, size};
    if (nb_exr_is(&bytes)) check_image(nb_exr_read_image, &bytes);
    return 0;
}
