#include "tools/darb/depth_file.h"

#include <span>
#include <string>
#include <vector>

#include "engine/check/npy.h"
#include "engine/data/depth_io.h"

namespace darb {

void write_depth(const std::filesystem::path& frame, const ImageF& depth, bool npy, double unit) {
    std::filesystem::path file = frame;
    file.replace_filename(frame.stem().string() + (npy ? "_depth.npy" : "_depth.png"));
    if (!npy) return write_depth_png(file, depth, unit);
    const auto channels = static_cast<size_t>(depth.channels);
    std::vector<float> values;
    for (size_t p = 0; p < depth.data.size(); p += channels) values.push_back(depth.data[p]);
    check::write_npy(file, {size_t(depth.height), size_t(depth.width)},
                     std::span<const float>(values));
}

}  // namespace darb
