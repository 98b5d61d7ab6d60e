#include "tools/darb/pixel_size.h"

#include <charconv>

#include "engine/core/error.h"

namespace darb {

PixelSize parse_size(const std::string& text) {
    PixelSize size;
    const char* end = text.data() + text.size();
    const auto [x, error] = std::from_chars(text.data(), end, size.width);
    const bool has_x = error == std::errc() && x != end && *x == 'x';
    const auto last = has_x ? std::from_chars(x + 1, end, size.height) : std::from_chars_result{};
    const bool whole = has_x && last.ec == std::errc() && last.ptr == end;
    if (!whole || size.width < 16 || size.height < 16 || size.width > 16384 || size.height > 16384)
        throw Error("--size", "'" + text + "' is no size", "Write WIDTHxHEIGHT, 16 to 16384 px.");
    return size;
}

}  // namespace darb
