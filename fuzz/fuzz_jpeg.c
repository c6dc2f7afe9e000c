/* Any bytes as a JPEG picture: a texture or an error with a message, and every byte of memory back. */
#include "picture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const nb_bytes bytes = {(unsigned char *)data, size, size};
    if (nb_jpeg_is(&bytes)) check_texture(nb_jpeg_read_texture, &bytes);
    return 0;
}
