#include "trainer/density/error_score.h"

#include <algorithm>

#include "engine/primitives/groups.h"

namespace darb {

namespace {

Pipeline share_pipeline(Device& device, std::uint32_t window_intersections) {
    return Pipeline(device, "error_share",
                    {{"THREADS", SPLAT_GROUP},
                     {"WINDOW_INTERSECTIONS", static_cast<std::int32_t>(window_intersections)}});
}

}  // namespace

ErrorScore::ErrorScore(Device& device, const LossOptions& photos)
    : device_(&device),
      image_(device, "error_image",
             {{"THREADS", SPLAT_GROUP},
              {"USE_MASK", photos.use_mask ? 1 : 0},
              {"USE_ALPHA", photos.use_alpha ? 1 : 0}}),
      share_(share_pipeline(device, 0)),
      sum_(device, "add_views", {{"THREADS", SPLAT_GROUP}, {"SEEN", 1}}) {
    reset(0);
}

BufferList<ErrorScore> ErrorScore::share_buffers(std::uint64_t splats) {
    return {{&ErrorScore::shares_, "error shares", splats * 2 * sizeof(float)}};
}

BufferList<ErrorScore> ErrorScore::segment_buffers(std::uint64_t pixels) {
    return {{&ErrorScore::transmittance_, "transmittance kept", pixels * 4}};
}

std::uint64_t ErrorScore::device_bytes(std::uint64_t splats, std::uint64_t pixels,
                                       std::uint32_t list_segments) {
    std::uint64_t bytes = charged_bytes(share_buffers(std::max<std::uint64_t>(splats, 1)));
    if (list_segments > 1) bytes += charged_bytes(segment_buffers(pixels));
    return bytes;
}

void ErrorScore::record_sum(Commands& commands, const Buffer& shares, const Buffer& status,
                            std::uint32_t splats) {
    if (splats == 0) return;
    const Groups g = groups_for(splats);
    commands.pass("error share");
    commands.dispatch(sum_, gpu::SplatArgs{splats}, {shares, shares_, status}, g.x, g.y);
}

void ErrorScore::reset(std::uint32_t splats) {
    restore(std::vector<float>(std::size_t{std::max(splats, 1u)} * 2, 0.0f));
}

std::vector<float> ErrorScore::state(std::uint32_t splats) const {
    return shares_.download<float>(std::size_t{splats} * 2);
}

void ErrorScore::restore(const std::vector<float>& state) {
    const std::uint64_t bytes = state.size() * sizeof(float);
    if (shares_.bytes() != bytes)
        make_buffers(*device_, *this, share_buffers(state.size() / 2), "error share");
    shares_.upload(state);
}

// Long lists: blend_backward keeps the pixels' state in the final transmittance, which the backward
// pass of the loss wants as it was.
void ErrorScore::record(Commands& commands, const FrameView& view, const Frame& frame,
                        Backward& backward, const Images& images, std::uint32_t splats) {
    if (splats == 0) return;
    const gpu::CameraData& camera = view.camera;
    const std::uint32_t pixels = camera.width * camera.height;
    const Groups each_pixel = groups_for(pixels), each_splat = groups_for(splats);
    const Buffer& transmittance = frame.images.final_transmittance;
    const bool several = frame.size.list_segments > 1;
    if (several && transmittance_.bytes() < transmittance.bytes())
        make_buffers(*device_, *this, segment_buffers(frame.size.pixels), "error share");
    commands.pass("error share");
    commands.dispatch(image_,
                      gpu::ErrorImageArgs{camera.width, camera.height, view.background.r,
                                          view.background.g, view.background.b},
                      {images.image, images.photo, images.d_image}, each_pixel.x, each_pixel.y);
    if (several) commands.copy(transmittance, transmittance_, std::uint64_t{pixels} * 4);
    backward.record_shares(commands, view, frame, images.d_image);
    if (several) commands.copy(transmittance_, transmittance, std::uint64_t{pixels} * 4);
    const BlendBackward& sums = backward.blend();
    if (sums.window_intersections() != window_intersections_) {
        window_intersections_ = sums.window_intersections();
        share_ = share_pipeline(*device_, window_intersections_);
    }
    commands.dispatch(
        share_, gpu::ErrorShareArgs{splats, 1.0f / static_cast<float>(pixels)},
        {frame.splats.intersection_count, frame.splats.first_intersection, sums.partials(0),
         sums.partials(1), sums.partials(2), sums.partials(3), sums.partials(4),
         frame.counters.status, images.shares ? *images.shares : shares_},
        each_splat.x, each_splat.y);
}

}  // namespace darb
