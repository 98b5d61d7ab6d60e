// SPDX-License-Identifier: MIT
#include "trainer/step/memory_plan.h"

#include <algorithm>

#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/backward.h"
#include "engine/raster/camera_sums.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gpu_splats.h"
#include "engine/raster/loss.h"
#include "engine/raster/profile_sums.h"
#include "trainer/growth/density_control.h"
#include "trainer/growth/predicted_growth.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/step/batch_step.h"
#include "trainer/step/exposure.h"
#include "trainer/step/photos.h"
#include "trainer/step/step.h"

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
    size.depth_spread = demand.frame.depth_spread;
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
    std::uint64_t bytes = Buffer::charged_bytes(4);  // the smoothing filter's, where it is off
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
    if (demand.profile) bytes += ProfileSums::device_bytes(size);
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

void add_photos(const std::vector<View>& views, const Schedule& schedule, MemoryDemand& demand) {
    const TrainOptions& options = schedule.options;
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
    demand.exposure_photos = options.exposure ? exposure_count(views) : 0;
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
    demand.profile = options.learn_kernel > 0;
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

namespace {

constexpr double kMemoryShare = 0.85;  // share of the device's memory that a run can hope for
constexpr std::uint32_t kNoLimit = 0xFFFFFFFFu;
// The share of the intersections that the device can bind; beyond it the number of splats stops
// growing.
constexpr double kMostIntersections = 0.7;
}  // namespace

std::uint64_t usable_bytes(const DeviceInfo& info) {
    return static_cast<std::uint64_t>(kMemoryShare * static_cast<double>(info.heap_bytes));
}

bool photos_stream(const Device& device, const Dataset& dataset, const Schedule& schedule,
                   const MemoryDemand& photos, std::uint32_t start_splats) {
    const TrainOptions& options = schedule.options;
    const PhotoPlace place = device.tuning().photos;
    if (place != PhotoPlace::automatic) return place == PhotoPlace::streamed;
    const bool shared = device.info().unified_memory;
    if (shared && !options.max_memory_bytes) return false;
    MemoryDemand all = photos;
    all.splats = start_splats;
    all.densifies = false;
    if (shared) {  // the ramp does without its smaller photos where there is no room
        all.small_pixels = all.small_cameras = 0;
    } else {
        all.splats = std::max(start_splats, wanted_splats(device, dataset, schedule,
                                                          photos.photo_pixels, start_splats));
        all.densifies = has_rounds(schedule);
        all.averages = schedule.averages();
    }
    all.intersections =
        static_cast<std::uint64_t>(intersection_room(0) * static_cast<double>(all.splats));
    MemoryDemand streamed = all;
    streamed.streams = true;
    const std::uint64_t total = plan_memory(device, all).total();
    return total > options.max_memory_bytes.value_or(usable_bytes(device.info())) &&
           plan_memory(device, streamed).total() < total;
}

MemoryBudget::MemoryBudget(Device& device, const Dataset& dataset, const Schedule& schedule,
                           std::uint32_t start_splats)
    : device_(&device), schedule_(schedule) {
    add_photos(dataset.views, schedule, photos_);
    photos_.streams = photos_stream(device, dataset, schedule, photos_, start_splats);
}

MemoryDemand MemoryBudget::demand(const HeldMemory& held) const {
    MemoryDemand demand = photos_;
    demand.splats = held.splats;
    demand.room_splats = held.frame.splats;
    demand.intersections = held.frame.intersections;
    demand.list_segments = held.frame.list_segments;
    demand.cooperates = held.frame.cooperates;
    demand.sh_degree = held.sh_degree;
    demand.densifies = false;
    demand.averages = held.averages;
    demand.small_pixels = held.small_pixels;
    demand.small_cameras = held.small_cameras;
    return demand;
}

std::uint64_t MemoryBudget::planned_bytes(const HeldMemory& held) const {
    return std::max(planned_bytes_, plan_memory(*device_, demand(held)).total());
}

void MemoryBudget::record(const HeldMemory& held) {
    const std::array<std::uint64_t, 6> now{held.splats,
                                           held.frame.intersections,
                                           std::uint64_t(held.sh_degree),
                                           held.frame.list_segments,
                                           held.frame.cooperates,
                                           std::uint64_t(held.divisor)};
    if (now == recorded_) return;
    recorded_ = now;
    planned_bytes_ = planned_bytes(held);
}

void MemoryBudget::record_round(const HeldMemory& held, std::uint32_t before) {
    MemoryDemand round = demand(held);
    round.splats = before;
    planned_bytes_ = std::max(planned_bytes_, round_peak(*device_, round, before, held.splats));
}

// Memory for a frame with half more intersections than the fullest one so far, in buffers that have
// grown to half more than that. It follows from what a checkpoint holds rather than from the
// current size of the buffers, so that a run which is resumed, or shows other pictures meanwhile,
// has the same limit.
MemoryDemand MemoryBudget::growth_demand(const HeldMemory& held,
                                         const TrainCounters& counters) const {
    MemoryDemand grown = demand(held);
    std::uint64_t most = counters.most_intersections;
    if (held.divisor > 1) {
        // Photos of the ramp's larger step are still to come, and frames in which a splat has more
        // intersections: at the sizes that splats come to, about as many times more as sides are
        // longer.
        grown.small_pixels = std::max(grown.small_pixels, photos_.small_pixels);
        most *= static_cast<std::uint64_t>(held.divisor);
    }
    if (schedule_.options.probe_sh)  // what is on trial is to have room, and what follows it
        grown.sh_degree = grown.sh_degree == 0
                              ? std::min(1, schedule_.options.sh_degree)
                              : predict_degree(schedule_, schedule_.options.iterations);
    grown.room_splats = 0;
    grown.intersections = std::max(4 * grown.splats, most + most / 2);
    grown.intersections += grown.intersections / 2;
    grown.list_segments = counters.longest_list > LIST_SEGMENT ? 2 : photos_.list_segments;
    grown.cooperates = photos_.cooperates || counters.huge_splats > 0;
    grown.densifies = true;
    grown.averages = schedule_.averages();
    return grown;
}

// The budget without what is in use beyond the plan.
std::uint64_t MemoryBudget::bytes_to_plan(const HeldMemory& held) const {
    const std::uint64_t budget = schedule_.options.max_memory_bytes.value_or(0);
    const std::uint64_t in_use = device_->allocated_bytes();
    const std::uint64_t planned = plan_memory(*device_, demand(held)).resident();
    const std::uint64_t extra = in_use - std::min(in_use, planned);
    return budget - std::min(budget, extra);
}

std::uint32_t MemoryBudget::splats_within_memory(const HeldMemory& held,
                                                 const TrainCounters& counters) const {
    if (!schedule_.options.max_memory_bytes || held.splats == 0) return kNoLimit;
    const std::uint64_t within =
        splats_within(*device_, growth_demand(held, counters), bytes_to_plan(held));
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(within, kNoLimit));
}

std::uint32_t MemoryBudget::growth_limit(const HeldMemory& held, const TrainCounters& counters) {
    within_memory_ = splats_within_memory(held, counters);
    const bool near = counters.most_intersections >
                      kMostIntersections * FrameBuffers::max_intersections(*device_);
    if (near && stopped_by_intersections_ == 0) stopped_by_intersections_ = held.splats;
    limit_ = std::min({schedule_.options.max_splats.value_or(kNoLimit), within_memory_,
                       GpuSplats::max_count(*device_, schedule_.options.sh_degree, true),
                       near ? held.splats : kNoLimit});
    return limit_;
}

void MemoryBudget::end_round(std::uint32_t splats) {
    if (within_memory_ == limit_ && splats >= within_memory_) stopped_by_memory_ = within_memory_;
}

bool MemoryBudget::has_room_for_round(const HeldMemory& held) const {
    if (!schedule_.options.max_memory_bytes) return true;
    return round_peak(*device_, demand(held), held.splats, held.splats) <= bytes_to_plan(held);
}

bool MemoryBudget::has_room_for_degree(const HeldMemory& held, int degree) const {
    if (!schedule_.options.max_memory_bytes) return true;
    MemoryDemand wanted = demand(held);
    wanted.sh_degree = degree;
    wanted.averages = schedule_.averages();
    if (held.divisor > 1) wanted.small_pixels = std::max(wanted.small_pixels, photos_.small_pixels);
    return plan_memory(*device_, wanted).total() <= bytes_to_plan(held);
}

}  // namespace darb
