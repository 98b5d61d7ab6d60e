// SPDX-License-Identifier: MIT
#include "engine/raster/gradient_buffers.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/optim_args.h"

namespace darb {

namespace {
constexpr std::uint64_t kViewBytes = 2 * sizeof(float);
}

GradientBuffers::GradientBuffers(Device& device, const GpuSplats& splats)
    : device_(&device),
      count_(splats.count()),
      add_(device, "add_gradients", {{"THREADS", SPLAT_GROUP}}) {
    for (int a = 0; a < kAttributeCount; ++a) {
        strides_[a] = splats.stride(a);
        gradients_[a] =
            Buffer(device, std::string("gradients of ") + attribute_name(a), rows(a).bytes(count_));
    }
    views_ = Buffer(device, "views of gradients", count_ * kViewBytes);
    Commands commands(device);
    commands.begin();
    record_clear(commands);
    commands.submit_and_wait();
}

bool GradientBuffers::is_of(const GpuSplats& splats) const {
    if (!device_ || count_ != splats.count()) return false;
    for (int a = 0; a < kAttributeCount; ++a)
        if (strides_[a] != splats.stride(a)) return false;
    return true;
}

std::uint64_t GradientBuffers::device_bytes(std::uint64_t count, int sh_degree, int kernel) {
    return GpuSplats::parameter_bytes(count, sh_degree, kernel) +
           Buffer::charged_bytes(count * kViewBytes);
}

void GradientBuffers::bind(const SplatRange& range, std::vector<BufferRange>& to) const {
    for (int a = 0; a < kAttributeCount; ++a)
        to.push_back(bound_rows(gradients_[a], rows(a), range));
}

void GradientBuffers::record_clear(Commands& commands) const {
    if (count_ == 0) return;
    for (const Buffer& buffer : gradients_)
        if (buffer.bytes() > 0) commands.fill(buffer, 0);
    commands.fill(views_, 0);
}

void GradientBuffers::record_add(Commands& commands, const GradientBuffers& other) {
    if (other.count_ != count_ || other.strides_ != strides_)
        throw Error(
            "gradients",
            fmt::format("of {} splats are to be added to those of {}", other.count_, count_),
            "Both must be of the same splats.");
    const auto add = [&](const Buffer& from, const Buffer& to, const AttributeRows& rows) {
        for (const SplatRange& range :
             splat_ranges(count_, rows.floats_held(), device_->info().max_storage_buffer_bytes)) {
            const gpu::AddArgs args{
                static_cast<std::uint32_t>(rows.bytes(range.count) / sizeof(float))};
            const Groups g = groups_for(args.count);
            commands.dispatch(add_, args,
                              {range_of_rows(from, rows, range), range_of_rows(to, rows, range)},
                              g.x, g.y);
        }
    };
    commands.pass("add gradients");
    for (int a = 0; a < kAttributeCount; ++a)
        if (strides_[a] > 0) add(other.gradients_[a], gradients_[a], rows(a));
    add(other.views_, views_, {2, 0});
}

void GradientBuffers::upload(int attribute, const std::vector<float>& values) {
    const std::size_t wanted = std::size_t{count_} * strides_[attribute];
    const std::string where = std::string("gradients of ") + attribute_name(attribute);
    if (values.size() != wanted)
        throw Error(where,
                    fmt::format("{} values, {} splats of {} need {}", values.size(), count_,
                                strides_[attribute], wanted),
                    "Give one for each float of the attribute.");
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
            throw Error(where, fmt::format("value {} is {}", i, values[i]),
                        "Gradients must be finite.");
    upload_rows(gradients_[attribute], rows(attribute), values);
}

std::vector<float> GradientBuffers::download(int attribute) const {
    return download_rows(gradients_[attribute], rows(attribute), count_);
}

}  // namespace darb
