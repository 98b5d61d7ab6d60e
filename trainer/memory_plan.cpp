#include "trainer/memory_plan.h"

#include <algorithm>

#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/backward.h"
#include "engine/raster/camera_sums.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/loss.h"
#include "trainer/density/density_control.h"
#include "trainer/density/round_buffers.h"
#include "trainer/exposure.h"
#include "trainer/gradient_tree.h"
#include "trainer/resolution_ramp.h"
#include "trainer/schedule.h"
#include "trainer/step.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

constexpr std::uint64_t kFewest =
    1024;  // splats and intersections that FrameBuffers and Backward make room for

FrameSize frame_size(const Device& device, const MemoryDemand& demand) {
    const auto room = [](std::uint64_t wanted, std::uint64_t most) {
        return static_cast<std::uint32_t>(std::max(std::min(wanted, most), kFewest));
    };
    FrameSize size;
    size.splats = room(std::max(demand.splats, demand.room_splats), 0xFFFFFFFFu);
    size.intersections = room(demand.intersections, FrameBuffers::max_intersections(device));
    size.pixels = std::uint64_t(demand.width) * demand.height;
    size.tiles = image_tiles(demand.width, demand.height);
    size.list_segments = demand.list_segments;
    size.cooperates = demand.cooperates;
    size.bucket = FrameBuffers::bucket(device, demand.frame);
    size.shaped = kernel_has_shape(demand.frame.kernel);
    size.depth_sum = demand.frame.depth_sum;
    return size;
}

SplatFloats floats_of(const MemoryDemand& demand) {
    return {demand.sh_degree, demand.frame.kernel, demand.rest_sum};
}

std::uint64_t moment_bytes(std::uint64_t splats, const SplatFloats& of) {
    std::uint64_t sum = 0;
    const auto strides = GpuSplats::strides(of.sh_degree, of.kernel);
    for (int a = 0; a < kAttributeCount; ++a)
        sum += Buffer::charged_bytes(attribute_rows(a, strides[a], 2).bytes(splats));
    return sum;
}

std::uint64_t cameras_bytes(std::uint64_t cameras) {
    return Buffer::charged_bytes(cameras * sizeof(gpu::CameraData));
}

std::uint64_t image_bytes(const Device& device, const MemoryDemand& demand) {
    constexpr std::uint64_t flight = Buffer::charged_bytes(sizeof(gpu::LossResult)) +
                                     Buffer::charged_bytes(sizeof(gpu::FrameStatus));
    return Buffer::charged_bytes(demand.image_pixels * 4 * d_image_planes(demand.frame)) +
           Loss::device_bytes(device, demand.width, demand.height) + cameras_bytes(demand.views) +
           2 * flight + DensityControl::fixed_bytes(demand.frame.kernel);
}

std::uint64_t effect_bytes(const MemoryDemand& demand) {
    std::uint64_t bytes = Buffer::charged_bytes(4);  // of the smoothing filter, where it is off
    if (demand.smoothing_photos > 0)
        bytes = Buffer::charged_bytes(std::max<std::uint64_t>(demand.splats, 1) * 4) +
                cameras_bytes(demand.smoothing_photos);
    if (demand.exposure_photos > 0)
        bytes += Exposure::device_bytes(
            {demand.exposure_photos, demand.exposure_grid, demand.batch}, demand.image_pixels);
    return bytes;
}

std::uint64_t strategy_bytes(const MemoryDemand& demand) {
    std::uint64_t bytes = demand.streams ? 0 : demand.small_pixels * 4;
    if (demand.small_cameras > 0) bytes += cameras_bytes(demand.small_cameras);
    return bytes + strategy_row(demand.strategy).device_bytes(demand.frame.kernel);
}

MemoryPlan plan_resident(const Device& device, const MemoryDemand& demand) {
    const FrameSize size = frame_size(device, demand);
    FrameBytes bytes = FrameBuffers::device_bytes(device, demand.frame, size);
    bytes += Backward::device_bytes(size);
    MemoryPlan plan;
    plan.parameters =
        GpuSplats::parameter_bytes(demand.splats, demand.sh_degree, demand.frame.kernel);
    plan.moments = moment_bytes(demand.splats, floats_of(demand)) +
                   rest_sum_bytes(demand.splats, floats_of(demand));
    plan.frame = bytes.splats;
    if (demand.cameras) plan.frame += CameraSums::device_bytes(size.splats);
    if (demand.by_views)
        plan.frame += GradientTree::device_bytes(demand.splats, demand.sh_degree,
                                                 demand.frame.kernel, demand.batch);
    plan.intersections = bytes.intersections;
    const std::uint64_t words = demand.photo_pixels + demand.depth_pixels;
    plan.photos = words * 4;
    if (demand.streams) {
        plan.photos =
            2 * Buffer::charged_bytes(demand.image_pixels * (demand.depth_pixels > 0 ? 8 : 4));
        plan.waiting_photos = (words + demand.small_pixels) * 4;
    }
    plan.images = bytes.images + image_bytes(device, demand);
    plan.effects = effect_bytes(demand) + strategy_bytes(demand);
    return plan;
}

}  // namespace

std::uint64_t round_peak(const Device& device, const MemoryDemand& demand, std::uint32_t before,
                         std::uint32_t after) {
    const MemoryPlan plan = plan_resident(device, demand);
    return plan.resident() - plan.parameters - plan.moments +
           round_bytes(before, after, floats_of(demand));
}

MemoryPlan plan_memory(const Device& device, const MemoryDemand& demand) {
    MemoryPlan plan = plan_resident(device, demand);
    if (demand.densifies) {
        const auto n = static_cast<std::uint32_t>(demand.splats);
        plan.densify = round_peak(device, demand, n, n) - plan.resident();
    }
    if (demand.averages) plan.average = plan.parameters;
    return plan;
}

std::uint64_t splats_within(const Device& device, const MemoryDemand& demand,
                            std::uint64_t budget_bytes) {
    const double intersections =
        double(demand.intersections) / std::max(double(demand.splats), 1.0);
    const auto total = [&](std::uint64_t splats) {
        MemoryDemand d = demand;
        d.splats = splats;
        d.intersections = static_cast<std::uint64_t>(intersections * static_cast<double>(splats));
        return plan_memory(device, d).total();
    };
    const std::uint64_t fixed_bytes = total(0), all_bytes = total(demand.splats);
    if (budget_bytes <= fixed_bytes || all_bytes <= fixed_bytes) return 0;
    const double each = double(all_bytes - fixed_bytes) / double(demand.splats);
    auto splats = static_cast<std::uint64_t>(double(budget_bytes - fixed_bytes) / each);
    // Almost a line: what whole blocks add is taken off again.
    for (std::uint64_t bytes; splats > 0 && (bytes = total(splats)) > budget_bytes;)
        splats -=
            std::min(splats, 1 + static_cast<std::uint64_t>(double(bytes - budget_bytes) / each));
    return splats;
}

void add_photos(const std::vector<View>& views, const TrainOptions& options, MemoryDemand& demand) {
    const Schedule schedule(options);
    demand.sh_degree = options.sh_degree;
    demand.rest_sum = schedule.rest_every > 1;
    demand.frame = forward_options(options);
    std::uint32_t training = 0;
    for (const View& view : views) {
        demand.width = std::max(demand.width, view.camera.width);
        demand.height = std::max(demand.height, view.camera.height);
        ++demand.views;
        if (view.is_test) continue;
        const std::uint64_t pixels = std::uint64_t(view.camera.width) * view.camera.height;
        demand.image_pixels = std::max(demand.image_pixels, pixels);
        demand.photo_pixels += pixels;
        if (compares_depth(options, view)) demand.depth_pixels += pixels;
        ++training;
    }
    demand.exposure_photos = options.exposure ? training : 0;
    demand.exposure_grid = options.exposure_grid;
    demand.smoothing_photos = options.antialias ? training : 0;
    // With HugeSplatPath::always every frame is cut and shared from the first on.
    if (options.huge_splat_path == HugeSplatPath::always) {
        demand.cooperates = true;
        demand.list_segments = 2;
    }
    demand.strategy = options.strategy;
    demand.batch = options.batch;
    demand.by_views = steps_by_views(options);
    demand.cameras = options.refine_cameras;
    const std::vector<RampStep> steps = schedule.ramp_steps(std::max(demand.width, demand.height));
    if (steps.empty()) return;
    for (const View& view : views) {
        const Camera small = divided(view.camera, steps.back().divisor);  // the largest
        if (!view.is_test)
            demand.small_pixels +=
                std::uint64_t(small.width) * small.height * (compares_depth(options, view) ? 2 : 1);
    }
    demand.small_cameras = demand.views;
}

}  // namespace darb
