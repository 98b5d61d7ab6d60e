#include "trainer/start_memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/raster/gpu_splats.h"
#include "trainer/memory_budget.h"
#include "trainer/initial_model.h"
#include "trainer/memory_plan.h"
#include "trainer/progress.h"

namespace darb {

namespace {

// Of a point: position and colour, drawn one by one, so that their room may be twice as large.
constexpr std::uint64_t kPointBytes = 3 * (8 + 1);
// Of a splat on the host while the model is made: its floats without the bands of colour, its
// distance to its neighbours, and what the search tree holds of it.
constexpr std::uint64_t kSplatBytes = splat_floats(0) * sizeof(float) + 8 + 16;

// Of this process; the most there is where the system does not say.
std::uint64_t address_space() {
    std::ifstream lines("/proc/self/status");
    for (std::string key; lines >> key; lines.ignore(1'000, '\n')) {
        std::uint64_t kilobytes = 0;
        if (key == "VmSize:" && lines >> kilobytes) return kilobytes * 1024;
    }
    return std::numeric_limits<std::uint64_t>::max();
}

MemoryDemand demand_at_start(const Device& device, const Dataset& dataset,
                             const TrainOptions& options, std::uint32_t splats) {
    MemoryDemand demand;
    add_photos(dataset.views, options, demand);
    demand.streams = photos_stream(device, dataset, options, demand, splats);
    demand.splats = splats;
    demand.intersections = splats;  // at least, where a photo sees them
    demand.densifies = false;
    if (options.probe_sh) demand.sh_degree = 0;
    return demand;
}

}  // namespace

std::uint64_t free_host_bytes() {
    std::uint64_t bytes = free_memory();
    rlimit limit{};
    if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
        const std::uint64_t used = address_space();
        bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur > used ? limit.rlim_cur - used : 0);
    }
    return bytes;
}

void check_start_memory(const Device& device, const Dataset& dataset, const TrainOptions& options,
                        std::uint64_t host_bytes) {
    const bool random = starts_random(dataset, options);
    const std::uint64_t points = random ? start_points(dataset, options) : 0;  // others are there
    const std::uint32_t splats = initial_count(dataset, options);
    const MemoryDemand demand = demand_at_start(device, dataset, options, splats);
    const MemoryPlan plan = plan_memory(device, demand);
    const std::uint64_t device_bytes = plan.total();
    const bool shared = device.info().unified_memory;
    const std::uint64_t host = points * kPointBytes + splats * kSplatBytes;
    const std::uint64_t left = host_bytes - std::min(host_bytes, plan.waiting_photos);
    const std::uint64_t room = device.info().heap_bytes;
    const std::uint64_t most = GpuSplats::max_count(device, demand.sh_degree, true);
    std::uint64_t fit = std::min<std::uint64_t>(splats, most);
    if (device_bytes > room) fit = std::min(fit, splats_within(device, demand, room));
    const double needed = double(host) + (shared ? double(device_bytes) : 0);
    if (needed > double(left)) {
        const double each = needed / double(std::max<std::uint64_t>({points, splats, 1}));
        fit = std::min(fit, static_cast<std::uint64_t>(double(left) / each));
    }
    const bool too_many_points = needed > double(left) && points > splats;
    if (fit >= splats && !too_many_points) return;
    const std::string option = random ? "--random-points" : "--cap-max";
    throw NoRoom(
        random ? fmt::format("--random-points {}", points)
               : fmt::format("{}: {} points", dataset.root.string(), splats),
        fmt::format("the start alone takes {} of device memory and {} of host memory; the device "
                    "has {}, the host {} left",
                    format_bytes(double(device_bytes)),
                    format_bytes(double(host + plan.waiting_photos)), format_bytes(double(room)),
                    format_bytes(double(host_bytes))),
        fit > 0 ? fmt::format("{} {} fits.", option, fit)
                : "Smaller photos do: -r 2 takes a quarter of their memory.");
}

}  // namespace darb
