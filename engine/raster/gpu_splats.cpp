#include "engine/raster/gpu_splats.h"

#include <algorithm>
#include <string>

#include "engine/scene/splat_shapes.h"

namespace darb {

std::array<std::uint32_t, kAttributeCount> GpuSplats::strides(int sh_degree) {
    std::array<std::uint32_t, kAttributeCount> floats{};
    for (int a = 0; a < kAttributeCount; ++a) floats[a] = attribute_floats(a, sh_degree);
    return floats;
}

std::uint64_t GpuSplats::parameter_bytes(std::uint64_t count, int sh_degree) {
    std::uint64_t bytes = 0;
    for (const std::uint32_t stride : strides(sh_degree))
        bytes += Buffer::charged_bytes(count * stride * sizeof(float));
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
        const std::vector<float>& values = attribute_values(model, a);
        strides_[a] = model.floats(a);
        const std::uint64_t bytes = values.size() * sizeof(float);
        parameters_[a] = Buffer(device, attribute_name(a), bytes);
        if (bytes > 0) parameters_[a].upload(values);
        if (!with_moments) continue;
        moments_[a] = Buffer(device, std::string("moments of ") + attribute_name(a), 2 * bytes);
        if (bytes > 0) moments_[a].upload(std::vector<float>(2 * values.size(), 0.0f));
    }
    if (!with_moments) return;
    const size_t sums = with_rest_sum ? model.sh_rest.size() : 0;
    rest_sum_ = Buffer(device, "sum of sh_rest", sums * sizeof(float));
    if (sums > 0) rest_sum_.upload(std::vector<float>(sums, 0.0f));
}

SplatModel GpuSplats::download() const {
    SplatModel model = header_;
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t floats = size_t{count_} * strides_[a];
        if (floats > 0) attribute_values(model, a) = parameters_[a].download<float>(floats);
    }
    return model;
}

std::vector<SplatRange> GpuSplats::ranges() const {
    return splat_ranges(count_, strides_[kShRest] * (has_moments() ? 2 : 1), binding_bytes_);
}

BufferRange bound_rows(const Buffer& buffer, int attribute, const SplatRange& range,
                       std::uint64_t floats) {
    if (!kSplatAttributes[static_cast<size_t>(attribute)].per_coefficient || floats == 0)
        return buffer;
    return {buffer, range.first * floats * sizeof(float), range.count * floats * sizeof(float)};
}

void GpuSplats::bind_parameters(const SplatRange& range, std::vector<BufferRange>& to) const {
    for (int a = 0; a < kAttributeCount; ++a)
        to.push_back(bound_rows(parameters_[a], a, range, strides_[a]));
}

void GpuSplats::bind_moments(const SplatRange& range, std::vector<BufferRange>& to) const {
    for (int a = 0; a < kAttributeCount; ++a)
        to.push_back(bound_rows(moments_[a], a, range, strides_[a] * 2));
}

BufferRange GpuSplats::rest_sum(const SplatRange& range) const {
    return bound_rows(rest_sum_, kShRest, range, has_rest_sum_ ? strides_[kShRest] : 0);
}

// Rotations are the widest of what is bound whole, beside four words a splat of a frame; the
// harmonics are bound by range, but are one buffer.
std::uint32_t GpuSplats::max_count(const Device& device, int sh_degree, bool with_moments) {
    const std::uint64_t word = (with_moments ? 2 : 1) * sizeof(float);
    const std::array<std::uint32_t, kAttributeCount> all = strides(sh_degree);
    const std::uint32_t widest = *std::max_element(all.begin(), all.end());
    return static_cast<std::uint32_t>(
        std::min<std::uint64_t>({device.info().max_storage_buffer_bytes / (4 * word),
                                 device.info().max_allocation_bytes / (widest * word), 1u << 30}));
}

}  // namespace darb
