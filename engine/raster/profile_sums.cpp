// SPDX-License-Identifier: MIT
#include "engine/raster/profile_sums.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/raster/forward.h"

namespace darb {

namespace {

constexpr std::uint64_t kSumBytes = PROFILE_SUMS * sizeof(float);

}  // namespace

ProfileSums::ProfileSums(Device& device, const ForwardOptions& options)
    : device_(&device),
      options_(options),
      add_(device, "profile_sums", {}, false),
      sums_(device, "profile sums", kSumBytes) {
    make_pipeline(false);
    make_buffers(device, *this, frame_buffers({}), "profile gradient");
    clear();
}

void ProfileSums::make_pipeline(bool segmented) {
    SpecConstants constants = kernel_constants(*device_, options_);
    constants["ALPHA_GRADIENT"] = options_.alpha_gradient || options_.depth_sum ? 1 : 0;
    constants["SEGMENT"] = segmented ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
    const std::uint32_t subgroup = add_block_constants(*device_, constants);
    constants["THREADS"] = static_cast<std::int32_t>(subgroup);
    gradient_ = Pipeline(*device_, "profile_gradient", constants, true, subgroup);
    segmented_ = segmented;
}

void ProfileSums::set_kernel(int kernel) {
    options_.kernel = kernel;
    make_pipeline(segmented_);
}

BufferList<ProfileSums> ProfileSums::frame_buffers(const FrameSize& size) {
    const std::uint64_t state = size.list_segments > 1 ? size.pixels * 4 : 4;
    return {{&ProfileSums::rows_, "profile rows", size.tiles * kSumBytes},
            {&ProfileSums::transmittance_, "profile transmittance", state},
            {&ProfileSums::behind_, "profile behind", state}};
}

FrameBytes ProfileSums::device_bytes(const FrameSize& size) {
    FrameBytes bytes;
    bytes.images = charged_bytes(frame_buffers(size)) + Buffer::charged_bytes(kSumBytes);
    return bytes;
}

void ProfileSums::reserve(const FrameSize& size) {
    const BufferList<ProfileSums> wanted = frame_buffers(size);
    const bool fits = std::ranges::all_of(
        wanted, [&](const auto& row) { return (this->*row.buffer).bytes() >= row.bytes; });
    if (!fits) make_buffers(*device_, *this, wanted, "profile gradient");
}

void ProfileSums::record(Commands& commands, const FrameView& view, const Frame& frame,
                         const Buffer& d_image) {
    const FrameSize& size = frame.size;
    if (size.list_segments > 1 && !segmented_) make_pipeline(true);
    const gpu::CameraData& camera = view.camera;
    const std::uint32_t tiles_y = (camera.height + TILE_SIZE - 1) / TILE_SIZE;
    const std::uint32_t rows = camera.tiles_x * tiles_y;
    if (rows_.bytes() < rows * kSumBytes)
        throw Error("profile gradient", "a frame that is larger than the buffers",
                    "Call reserve after each growth of the frame.");
    gpu::BlendArgs args{camera.width,
                        camera.height,
                        camera.tiles_x,
                        view.background.r,
                        view.background.g,
                        view.background.b,
                        0,
                        size.list_segments};
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    const FrameImages& images = frame.images;
    commands.pass("profile gradient");
    const bool parts = size.list_segments > 1;
    if (parts)  // the pass keeps its state there, the backward blend begins with the frame's
        commands.copy(images.final_transmittance, transmittance_,
                      std::uint64_t{camera.width} * camera.height * 4);
    for (args.segment = args.segments; args.segment-- > 0;)
        commands.dispatch(
            gradient_, args,
            {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection, s.shape, s.light,
             s.bound, d_image, parts ? transmittance_ : images.final_transmittance,
             images.last_intersection, rows_, behind_},
            camera.tiles_x, tiles_y);
    commands.dispatch(add_, gpu::ProfileSumArgs{rows}, {rows_, frame.counters.status, sums_}, 1);
}

std::vector<float> ProfileSums::read() const {
    return sums_.download<float>(PROFILE_SUMS);
}

void ProfileSums::write(const std::vector<float>& sums) {
    DARB_CHECK(sums.size() == PROFILE_SUMS, "{} sums", sums.size());
    sums_.upload(sums);
}

}  // namespace darb
