// SPDX-License-Identifier: MIT
#include "engine/raster/gpu_splats.h"

#include <algorithm>
#include <string>

#include "engine/core/error.h"
#include "engine/scene/splat_model.h"

namespace darb {

std::array<std::uint32_t, kAttributeCount> GpuSplats::strides(int sh_degree, int kernel) {
    std::array<std::uint32_t, kAttributeCount> floats{};
    for (int a = 0; a < kAttributeCount; ++a)
        floats[a] = kernel_takes(kernel, a) ? attribute_floats(a, sh_degree) : 0;
    return floats;
}

void GpuSplats::set_kernel(int kernel) {
    DARB_CHECK(strides(header_.sh_degree, kernel) == strides_, "kernel {}", kernel);
    header_.kernel = kernel;
}

std::uint64_t GpuSplats::parameter_bytes(std::uint64_t count, int sh_degree, int kernel) {
    std::uint64_t bytes = 0;
    const std::array<std::uint32_t, kAttributeCount> all = strides(sh_degree, kernel);
    for (int a = 0; a < kAttributeCount; ++a)
        bytes += Buffer::charged_bytes(attribute_rows(a, all[a]).bytes(count));
    return bytes;
}

GpuSplats::GpuSplats(Device& device, const SplatModel& model, bool with_moments, bool with_rest_sum)
    : count_(static_cast<std::uint32_t>(model.size())),
      binding_bytes_(device.info().max_storage_buffer_bytes),
      has_rest_sum_(with_rest_sum) {
    header_.sh_degree = model.sh_degree;
    header_.kernel = model.kernel;
    header_.footprint = model.footprint;
    header_.antialias = model.antialias;
    header_.origin = model.origin;
    smoothing_ = Buffer(device, "smoothing", 4);
    check_splat_shapes(model);
    for (int a = 0; a < kAttributeCount; ++a) {
        strides_[a] = model.floats(a);
        parameters_[a] = Buffer(device, attribute_name(a), rows(a).bytes(count_));
        upload_rows(parameters_[a], rows(a), attribute_values(model, a));
        if (!with_moments) continue;
        const std::uint64_t bytes = rows(a, 2).bytes(count_);
        moments_[a] = Buffer(device, std::string("moments of ") + attribute_name(a), bytes);
        moments_[a].upload(std::vector<std::byte>(bytes));
    }
    if (!with_moments) return;
    const std::uint64_t bytes = with_rest_sum ? rows(kShRest).bytes(count_) : 0;
    rest_sum_ = Buffer(device, "sum of sh_rest", bytes);
    rest_sum_.upload(std::vector<std::byte>(bytes));
}

SplatModel GpuSplats::download() const {
    SplatModel model = header_;
    for (int a = 0; a < kAttributeCount; ++a)
        attribute_values(model, a) = download_rows(parameters_[a], rows(a), count_);
    return model;
}

std::vector<float> GpuSplats::download_moments(int attribute) const {
    return download_rows(moments_[attribute], rows(attribute, 2), count_);
}

void GpuSplats::upload_moments(int attribute, const std::vector<float>& values) {
    upload_rows(moments_[attribute], rows(attribute, 2), values);
}

std::vector<float> GpuSplats::download_rest_sum() const {
    return has_rest_sum_ ? download_rows(rest_sum_, rows(kShRest), count_) : std::vector<float>{};
}

void GpuSplats::upload_rest_sum(const std::vector<float>& values) {
    upload_rows(rest_sum_, rows(kShRest), values);
}

std::vector<SplatRange> GpuSplats::ranges() const {
    return splat_ranges(count_, rows(kShRest, has_moments() ? 2 : 1).floats_held(), binding_bytes_);
}

std::vector<SplatRange> GpuSplats::trained_ranges() const {
    std::vector<SplatRange> trained = splat_ranges(
        trained_count(), rows(kShRest, has_moments() ? 2 : 1).floats_held(), binding_bytes_);
    for (SplatRange& range : trained) range.first += frozen_;
    return trained;
}

void GpuSplats::freeze(std::uint32_t count) {
    DARB_CHECK(count <= count_ && count % kFrozenUnit == 0, "{} of {} splats to freeze", count,
               count_);
    frozen_ = count;
}

void GpuSplats::bind_parameters(const SplatRange& range, std::vector<BufferRange>& to) const {
    for (int a = 0; a < kAttributeCount; ++a)
        to.push_back(bound_rows(parameters_[a], rows(a), range));
}

void GpuSplats::bind_moments(const SplatRange& range, std::vector<BufferRange>& to) const {
    for (int a = 0; a < kAttributeCount; ++a)
        to.push_back(bound_rows(moments_[a], rows(a, 2), range));
}

BufferRange GpuSplats::rest_sum(const SplatRange& range) const {
    return has_rest_sum_ ? bound_rows(rest_sum_, rows(kShRest), range) : BufferRange(rest_sum_);
}

// Rotations are the widest of what is bound whole, beside four words a splat of a frame; the
// harmonics are bound by range, but are one buffer.
std::uint32_t GpuSplats::max_count(const Device& device, int sh_degree, bool with_moments) {
    const std::uint64_t word = (with_moments ? 2 : 1) * sizeof(float);
    const std::array<std::uint32_t, kAttributeCount> all = strides(sh_degree, KERNEL_GAUSSIAN);
    std::uint32_t widest = 0;
    for (int a = 0; a < kAttributeCount; ++a)
        widest = std::max(widest, attribute_rows(a, all[a]).floats_held());
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        {device.info().max_storage_buffer_bytes / (4 * word),
         device.info().max_allocation_bytes / (widest * word) / ROW_BLOCK * ROW_BLOCK, 1u << 30}));
}

}  // namespace darb
