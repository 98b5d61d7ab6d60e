#include "tools/darb/depth_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "engine/check/npy.h"
#include "engine/core/error.h"
#include "engine/core/say.h"

namespace darb {

namespace {

/// Rounded up to two digits.
double unit_for(double farthest) {
    const double unit = farthest / kDepthSteps;
    const double digit = std::pow(10.0, std::floor(std::log10(unit)) - 1);
    return std::ceil(unit / digit) * digit;
}

}  // namespace

void check_depth(const DepthFlags& flags, const Accuracy& accuracy, const EffectChoice& effects) {
    const bool asked = !flags.format.empty();
    const bool on = plan_rendering({}, {}, {.depth = asked}, effects).on(EFFECT_DEPTH);
    if (asked && !on)
        throw Error("--depth", "the effects leave depth out",
                    "Add +depth to --effects, or leave --depth out.");
    if (on && accuracy.value(kStorage) != STORAGE_FLOAT32)
        throw Error("--depth", "depths do not fit the float16 storage that was chosen",
                    "Add --storage float32.");
    if (on && accuracy.value(kRenderScale) != 1)
        throw Error("--depth", "depths would be of the render scale, half the size of the frames",
                    "Add --render-scale 1.");
}

std::filesystem::path depth_file(const DepthFlags& flags, const std::filesystem::path& frame) {
    std::filesystem::path file = frame;
    return file.replace_filename(frame.stem().string() +
                                 (flags.format == "npy" ? "_depth.npy" : "_depth.png"));
}

void DepthFiles::write(const std::filesystem::path& frame, const ImageF& depth) {
    const std::filesystem::path file = depth_file(flags_, frame);
    if (flags_.format != "npy") {
        const DepthRange range = write_depth_png(file, depth, flags_.unit);
        range_.clipped += range.clipped;
        range_.farthest = std::max(range_.farthest, range.farthest);
        return;
    }
    const auto channels = static_cast<size_t>(depth.channels);
    std::vector<float> values;
    for (size_t p = 0; p < depth.data.size(); p += channels) values.push_back(depth.data[p]);
    check::write_npy(file, {size_t(depth.height), size_t(depth.width)},
                     std::span<const float>(values));
}

void DepthFiles::print_clipped() const {
    if (range_.clipped == 0) return;
    say("warning: {} pixels of the depth PNGs lie beyond {:g} world units, their last step, "
        "up to {:g}: --depth-unit {:g} holds all, as does --depth npy\n",
        range_.clipped, kDepthSteps * flags_.unit, range_.farthest, unit_for(range_.farthest));
}

}  // namespace darb
