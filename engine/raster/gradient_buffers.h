// SPDX-License-Identifier: MIT
// GradientBuffers: dL/d(every attribute) of N splats in device memory, of one view or added over
// several, and what the views showed of each splat. Backward fills them, callers may, too;
// AdamUpdate makes a step of them. Sums of floats depend on their order: whoever adds several
// chooses it, so that a result repeats.
#pragma once

#include <array>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/gpu_splats.h"

namespace darb {

class GradientBuffers {
  public:
    GradientBuffers() = default;
    /// For splats of this count and these attributes; all zero, as the sum over no view.
    GradientBuffers(Device& device, const GpuSplats& splats);
    /// Whether these are for splats with the same counts.
    bool is_of(const GpuSplats& splats) const;

    std::uint32_t count() const { return count_; }
    /// Floats per splat, as GpuSplats has them.
    std::uint32_t stride(int attribute) const { return strides_[attribute]; }
    AttributeRows rows(int attribute) const {
        return attribute_rows(attribute, strides_[attribute]);
    }
    /// Gradients in the layout of rows(); zero beyond the degree of harmonics in use.
    Buffer& of(int attribute) { return gradients_[attribute]; }
    const Buffer& of(int attribute) const { return gradients_[attribute]; }
    /// [N][2]: sum over the views of |dL/dmean| in NDC units, and how many showed the splat;
    /// negative where a gradient of one was not finite: no step is made of it.
    Buffer& views() { return views_; }
    const Buffer& views() const { return views_; }

    /// As GpuSplats::bind_parameters.
    void bind(const SplatRange& range, std::vector<BufferRange>& to) const;

    /// Sets all to zero.
    void record_clear(Commands& commands) const;
    /// Adds `other` to these. Throws Error where it is not for the same splats.
    void record_add(Commands& commands, const GradientBuffers& other);

    /// Copies of a caller's own values, in the layout of SplatModel. Throws Error where their count
    /// differs or a value is not finite. The queue must be idle.
    void upload(int attribute, const std::vector<float>& values);
    std::vector<float> download(int attribute) const;

    /// Device memory for so many splats.
    static std::uint64_t device_bytes(std::uint64_t count, int sh_degree, int kernel);

  private:
    Device* device_ = nullptr;
    std::uint32_t count_ = 0;
    std::array<std::uint32_t, kAttributeCount> strides_{};
    std::array<Buffer, kAttributeCount> gradients_;
    Buffer views_;
    Pipeline add_;
};

}  // namespace darb
