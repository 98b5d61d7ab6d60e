// SPDX-License-Identifier: MIT
// GpuSplats: the parameters of N splats in device memory, one buffer an attribute, in the layout of
// attribute_rows.h; with the optimiser's moments beside them where they are trained.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/raster/attribute_rows.h"
#include "engine/scene/splat_model.h"

namespace darb {

class GpuSplats {
  public:
    GpuSplats() = default;
    /// Uploads the model. with_moments adds two floats for each parameter, set to zero,
    /// with_rest_sum one for each of the harmonics above the first band.
    GpuSplats(Device& device, const SplatModel& model, bool with_moments,
              bool with_rest_sum = false);

    /// Copies everything back to the host; kernel, footprint, origin and degree as given at the
    /// start.
    SplatModel download() const;

    std::uint32_t count() const { return count_; }
    int sh_degree() const { return header_.sh_degree; }
    int kernel() const { return header_.kernel; }
    /// They are of this kernel from now on, with the same attributes.
    void set_kernel(int kernel);
    Footprint footprint() const { return header_.footprint; }
    bool antialias() const { return header_.antialias; }
    const glm::dvec3& origin() const { return header_.origin; }
    bool has_moments() const { return static_cast<bool>(moments_[0]); }

    /// Floats per splat of an attribute (0 for kShRest at degree 0, and of an optional attribute
    /// that the model does not have).
    std::uint32_t stride(int attribute) const { return strides_[attribute]; }
    /// How a splat's floats lie in the attribute's buffer; of_each: 2 in the buffer of moments.
    AttributeRows rows(int attribute, std::uint32_t of_each = 1) const {
        return attribute_rows(attribute, strides_[attribute], of_each);
    }
    Buffer& parameters(int attribute) { return parameters_[attribute]; }
    const Buffer& parameters(int attribute) const { return parameters_[attribute]; }
    Buffer& moments(int attribute) { return moments_[attribute]; }
    const Buffer& moments(int attribute) const { return moments_[attribute]; }

    /// Sum of the gradients of kShRest since their last step, in the same layout; only where
    /// has_rest_sum().
    Buffer& rest_sum() { return rest_sum_; }
    bool has_rest_sum() const { return has_rest_sum_; }

    /// [N] deviation of the 3D smoothing filter, world units; one unused word where no effect needs
    /// it.
    Buffer& smoothing() { return smoothing_; }
    const Buffer& smoothing() const { return smoothing_; }

    /// Blocking copies in SplatModel's layout: moments as [N][stride][2], first and second, the sum
    /// as [N][stride of kShRest].
    std::vector<float> download_moments(int attribute) const;
    void upload_moments(int attribute, const std::vector<float>& values);
    std::vector<float> download_rest_sum() const;
    void upload_rest_sum(const std::vector<float>& values);

    /// To be called after an attribute's buffers were replaced by ones for another count (density
    /// control).
    void set_count(std::uint32_t count) { count_ = count; }

    /// The first `count` splats, a multiple of kFrozenUnit, are drawn and never change: no step of
    /// the optimizer and no round of density control touches them, and they stay the first.
    void freeze(std::uint32_t count);
    std::uint32_t frozen() const { return frozen_; }
    static constexpr std::uint32_t kFrozenUnit = 64;  // bindings may begin at such multiples
    /// The rows of the splats behind the frozen ones, of so many floats each; not for rows in
    /// blocks.
    BufferRange trained(const Buffer& rows, std::uint32_t floats) const {
        return {rows, std::uint64_t{frozen_} * floats * sizeof(float)};
    }
    std::uint32_t trained_count() const { return count_ - frozen_; }

    /// The ranges that passes over splats take, one per dispatch, as the harmonics and their
    /// moments are bound by range where one binding of the device does not hold them all.
    std::vector<SplatRange> ranges() const;
    /// The same for the splats that are not frozen.
    std::vector<SplatRange> trained_ranges() const;
    /// Appends one buffer per attribute, in the order of ATTRIBUTE_*, as passes over a range bind
    /// them: where one is too wide to be bound whole, only the rows of the range.
    void bind_parameters(const SplatRange& range, std::vector<BufferRange>& to) const;
    void bind_moments(const SplatRange& range, std::vector<BufferRange>& to) const;
    /// rest_sum() likewise.
    BufferRange rest_sum(const SplatRange& range) const;

    /// Device memory of the parameters of so many splats of this kernel; their moments take twice
    /// as much.
    static std::uint64_t parameter_bytes(std::uint64_t count, int sh_degree, int kernel);
    /// Floats per splat of the attributes, 0 for those that the kernel does not take.
    static std::array<std::uint32_t, kAttributeCount> strides(int sh_degree, int kernel);

    /// The most splats that this device's bindings and its largest buffer allow.
    static std::uint32_t max_count(const Device& device, int sh_degree, bool with_moments);

  private:
    SplatModel header_;  // no splats, only what is not per splat
    std::uint32_t count_ = 0;
    std::uint32_t frozen_ = 0;
    std::uint64_t binding_bytes_ = 0;  // the most that one binding holds
    std::array<std::uint32_t, kAttributeCount> strides_{};
    std::array<Buffer, kAttributeCount> parameters_;
    std::array<Buffer, kAttributeCount> moments_;  // first and second moment of each float
    bool has_rest_sum_ = false;
    Buffer rest_sum_;
    Buffer smoothing_;
};

}  // namespace darb
