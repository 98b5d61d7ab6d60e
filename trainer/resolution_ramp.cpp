#include "trainer/resolution_ramp.h"

#include <algorithm>
#include <cmath>

#include "engine/primitives/groups.h"
#include "shaders/shared/strategy_args.h"

namespace darb {

Camera divided(const Camera& camera, double divisor) {
    Camera smaller = camera;
    smaller.width = std::max(1, static_cast<int>(std::lround(camera.width / divisor)));
    smaller.height = std::max(1, static_cast<int>(std::lround(camera.height / divisor)));
    const double x = double(smaller.width) / camera.width,
                 y = double(smaller.height) / camera.height;
    smaller.fx *= x;
    smaller.cx *= x;
    smaller.fy *= y;
    smaller.cy *= y;
    return smaller;
}

ResolutionRamp::ResolutionRamp(Device& device)
    : device_(&device),
      commands_(device),
      pipeline_(device, "downsample_photo", {{"THREADS", SPLAT_GROUP}}) {}

Buffer ResolutionRamp::downsample(const Buffer& photo, const Camera& camera, const Camera& smaller,
                                  Memory memory) {
    const gpu::DownsampleArgs args{
        static_cast<std::uint32_t>(camera.width), static_cast<std::uint32_t>(camera.height),
        static_cast<std::uint32_t>(smaller.width), static_cast<std::uint32_t>(smaller.height)};
    const std::uint64_t pixels = std::uint64_t{args.out_width} * args.out_height;
    const bool depths = photo.bytes() >= std::uint64_t{args.width} * args.height * 8;
    if (depths && !depths_)
        depths_ = Pipeline(*device_, "downsample_photo", {{"THREADS", SPLAT_GROUP}, {"DEPTHS", 1}});
    Buffer result(*device_, "smaller " + photo.name(), pixels * (depths ? 8 : 4), memory);
    const Groups g = groups_for(pixels);
    commands_.begin();
    commands_.pass("downsample");
    commands_.dispatch(depths ? depths_ : pipeline_, args, {photo, result}, g.x, g.y);
    commands_.submit_and_wait();
    return result;
}

}  // namespace darb
