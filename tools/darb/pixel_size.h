// A size in pixels, as --size takes it.
#pragma once

#include <string>

namespace darb {

struct PixelSize {
    int width = 0, height = 0;
};

/// WIDTHxHEIGHT, 16 to 16384 px each. Throws Error.
PixelSize parse_size(const std::string& text);

}  // namespace darb
