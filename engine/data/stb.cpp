// SPDX-License-Identifier: MIT
// The only translation unit with the code of stb_image_write. Pictures are read by other libraries:
// see image_io.h.
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wextra"
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
