/* Any bytes as a PNG picture, read as a picture, a texture and heights: each is whole or an error with a message, and every
 * byte of memory comes back. */
#include "picture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const nb_bytes bytes = {(unsigned char *)data, size, size};
    if (!nb_png_is(&bytes)) return 0;
    check_image(nb_png_read_image, &bytes);
    check_texture(nb_png_read_texture, &bytes);
    check_heights(&bytes);
    return 0;
}
