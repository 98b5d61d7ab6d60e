// SPDX-License-Identifier: MIT
#include "trainer/step/iterate_average.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/optim_args.h"

namespace darb {

namespace {
std::string mean_name(int attribute) {
    return std::string("mean of ") + attribute_name(attribute);
}
}  // namespace

IterateAverage::IterateAverage(Device& device)
    : device_(&device),
      commands_(device),
      average_(device, "average", SpecConstants{{"THREADS", SPLAT_GROUP}}) {}

void IterateAverage::add(const GpuSplats& splats) {
    for (int a = 0; count_ > 0 && a < kAttributeCount; ++a)
        if (const std::uint64_t bytes = splats.rows(a).bytes(splats.count());
            bytes > 0 && mean_[a].bytes() != bytes)
            throw Error(mean_name(a),
                        fmt::format("holds {} bytes, the splats {}", mean_[a].bytes(), bytes),
                        "Call clear() where the splats became others.");
    if (count_ == 0)
        for (int a = 0; a < kAttributeCount; ++a)
            mean_[a] = Buffer(*device_, mean_name(a), splats.rows(a).bytes(splats.count()));
    const float share = 1.0f / static_cast<float>(++count_);
    commands_.begin();
    commands_.pass("average");
    for (int a = 0; a < kAttributeCount; ++a) {
        const Buffer& value = splats.parameters(a);
        const AttributeRows rows = splats.rows(a);
        const std::uint64_t bytes = rows.bytes(splats.count());
        if (bytes == 0) continue;
        if (count_ == 1) {
            commands_.copy(value, mean_[a], bytes);
            continue;
        }
        for (const SplatRange& range : splats.ranges()) {
            const gpu::AverageArgs args{static_cast<std::uint32_t>(rows.bytes(range.count) / 4),
                                        share};
            const Groups g = groups_for(args.count);
            commands_.dispatch(
                average_, args,
                {range_of_rows(value, rows, range), range_of_rows(mean_[a], rows, range)}, g.x,
                g.y);
        }
    }
    commands_.submit_and_wait();
}

void IterateAverage::swap(GpuSplats& splats) {
    if (count_ == 0) return;
    for (int a = 0; a < kAttributeCount; ++a) std::swap(splats.parameters(a), mean_[a]);
}

void IterateAverage::clear() {
    count_ = 0;
    mean_ = {};
}

std::vector<std::vector<float>> IterateAverage::state(const GpuSplats& splats) const {
    std::vector<std::vector<float>> state;
    if (count_ == 0) return state;
    for (int a = 0; a < kAttributeCount; ++a)
        state.push_back(download_rows(mean_[a], splats.rows(a), splats.count()));
    return state;
}

void IterateAverage::restore(const std::vector<std::vector<float>>& state, std::uint32_t count,
                             const GpuSplats& splats) {
    clear();
    if (state.empty()) return;
    count_ = count;
    for (int a = 0; a < kAttributeCount; ++a) {
        mean_[a] = Buffer(*device_, mean_name(a), splats.rows(a).bytes(splats.count()));
        upload_rows(mean_[a], splats.rows(a), state[a]);
    }
}

}  // namespace darb
