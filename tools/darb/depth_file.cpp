#include "tools/darb/depth_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "engine/check/dump.h"
#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/data/image_io.h"

namespace darb {

namespace {

// Viridis, from its near end: five of its colours.
constexpr std::array<std::array<float, 3>, 5> kDepthColours{
    {{253, 231, 37}, {93, 201, 99}, {33, 144, 141}, {59, 82, 139}, {68, 1, 84}}};

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

std::vector<std::filesystem::path> depth_files(const DepthFlags& flags,
                                               const std::filesystem::path& frame) {
    const std::string stem = frame.stem().string() + "_depth";
    std::filesystem::path numbers = frame, picture = frame;
    return {numbers.replace_filename(stem + (flags.format == "npy" ? ".npy" : ".png")),
            picture.replace_filename(stem + "_colours.png")};
}

void add_depth_files(const DepthFlags& flags, const std::vector<std::filesystem::path>& frames,
                     std::vector<std::filesystem::path>& files) {
    for (const auto& frame : frames)
        for (auto& file : depth_files(flags, frame)) files.push_back(std::move(file));
}

ImageU8 depth_picture(const ImageF& depth) {
    const auto channels = static_cast<size_t>(depth.channels);
    std::vector<float> seen;
    for (size_t p = 0; p < depth.data.size(); p += channels)
        if (depth.data[p] > 0) seen.push_back(depth.data[p]);
    std::ranges::sort(seen);
    const float near = seen.empty() ? 0 : seen[seen.size() / 100];
    const float far = seen.empty() ? 1 : seen[seen.size() - 1 - seen.size() / 100];
    ImageU8 picture(depth.width, depth.height, 3);
    for (size_t p = 0; p < depth.data.size() / channels; ++p) {
        const float value = depth.data[p * channels];
        if (value <= 0) continue;
        const float share = std::clamp((value - near) / std::max(far - near, 1e-9f), 0.0f, 1.0f);
        const float at = share * (std::size(kDepthColours) - 1);
        const size_t low = std::min(static_cast<size_t>(at), std::size(kDepthColours) - 2);
        for (size_t c = 0; c < 3; ++c)
            picture.data[3 * p + c] = static_cast<std::uint8_t>(std::lround(std::lerp(
                kDepthColours[low][c], kDepthColours[low + 1][c], at - static_cast<float>(low))));
    }
    return picture;
}

void DepthFiles::write(const std::filesystem::path& frame, const ImageF& depth) {
    const std::vector<std::filesystem::path> files = depth_files(flags_, frame);
    const std::filesystem::path& file = files.front();
    write_png(files.back(), depth_picture(depth));
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
