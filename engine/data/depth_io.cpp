#include "engine/data/depth_io.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace {

void put_u32(std::string& to, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(value >> shift & 0xff);
}

void put_chunk(std::string& to, const char* type, const std::string& data) {
    put_u32(to, static_cast<std::uint32_t>(data.size()));
    const std::string body = type + data;
    to += body;
    put_u32(to, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                 static_cast<uInt>(body.size()))));
}

float first_channel(const ImageF& image, std::size_t pixel) {
    return image.data[pixel * static_cast<std::size_t>(image.channels)];
}

}  // namespace

DepthRange write_depth_png(const std::filesystem::path& path, const ImageF& depth, double unit) {
    if (!(unit > 0) || depth.channels < 1)
        throw Error(path.string(),
                    fmt::format("depths of {} channels in units of {}", depth.channels, unit),
                    "Use a unit above 0 and at least one channel.");
    DepthRange range;
    std::string rows;
    for (int y = 0; y < depth.height; ++y) {
        rows += '\0';  // no filter
        for (int x = 0; x < depth.width; ++x) {
            const double value =
                first_channel(depth, static_cast<std::size_t>(y) * depth.width + x);
            const double steps = value / unit + 0.5;
            const auto grey =
                static_cast<std::uint32_t>(std::clamp(steps, 0.0, double{kDepthSteps}));
            range.clipped += steps >= kDepthSteps + 1 ? 1 : 0;
            range.farthest = std::max(range.farthest, value);
            rows += static_cast<char>(grey >> 8);
            rows += static_cast<char>(grey & 0xff);
        }
    }
    uLongf bytes = compressBound(static_cast<uLong>(rows.size()));
    std::string packed(bytes, '\0');
    const int result =
        compress(reinterpret_cast<Bytef*>(packed.data()), &bytes,
                 reinterpret_cast<const Bytef*>(rows.data()), static_cast<uLong>(rows.size()));
    DARB_CHECK(result == Z_OK, "zlib {}", result);
    packed.resize(bytes);

    std::string header, file = "\x89PNG\r\n\x1a\n";
    put_u32(header, static_cast<std::uint32_t>(depth.width));
    put_u32(header, static_cast<std::uint32_t>(depth.height));
    header += std::string("\x10\0\0\0\0", 5);  // 16 bits, grey, the standard methods
    put_chunk(file, "IHDR", header);
    put_chunk(file, "tEXt",
              std::string("DepthUnit") + '\0' + fmt::format("{} world units a step", unit));
    put_chunk(file, "IDAT", packed);
    put_chunk(file, "IEND", "");
    write_file_atomic(path, file);
    return range;
}

}  // namespace darb
