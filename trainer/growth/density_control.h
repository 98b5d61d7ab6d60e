// SPDX-License-Identifier: MIT
// Density control `adc` on the device: clone, split and prune between iterations, and the opacity
// reset. Source: 3DGS section 5 with graphdeco's schedule; split offsets come from the kernel's own
// density.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <span>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/scan.h"
#include "engine/raster/gpu_splats.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/optim_args.h"

namespace darb {

struct DensityResult {
    std::uint32_t before = 0, after = 0;
    std::uint32_t pruned = 0, grown = 0;
};

/// A word a splat that a round has decided on, and what it is to be of frozen ones.
struct FrozenWord {
    const Buffer* values;
    std::uint32_t word;
};
/// Puts these in place of what was decided on the first `frozen` splats.
void keep_frozen(Commands& commands, std::uint32_t frozen, std::initializer_list<FrozenWord> words);

/// Zeros the word of each splat that is set in `splats`, [N] 0 or 1. The queue must be idle.
void clear_words(std::span<const std::uint8_t> splats, Buffer& words);

class DensityControl {
  public:
    DensityControl(Device& device, int kernel, Footprint footprint = Footprint::psi);

    /// One round. gradient_sum: [N][2] of Backward. The queue must be idle. args.splat_count is set
    /// here. Beyond max_splats nothing grows, the largest mean gradients go first. New buffers
    /// replace the old ones one attribute at a time, so the peak is one attribute above the total.
    /// fixed: [N], 1 for splats that are pruned but do not grow; empty: none.
    DensityResult run(GpuSplats& splats, const Buffer& gradient_sum, gpu::DensifyArgs args,
                      std::uint32_t max_splats, std::span<const std::uint8_t> fixed = {});

    /// Device memory between rounds.
    static std::uint64_t fixed_bytes(int kernel);
    /// Splits draw from this kernel from now on, which has shapes where the one before had. The
    /// queue must be idle.
    void set_kernel(int kernel, Footprint footprint);

    /// Every opacity down to at most `opacity`, its moments to zero.
    void reset_opacity(GpuSplats& splats, float opacity);

    /// Parameters and moments to a generation of `count`: sources holds, for each, the splat that
    /// it comes from and DENSIFY_*; what is not kept starts with moments of zero. The queue must be
    /// idle.
    void move(GpuSplats& splats, const Buffer& sources, std::uint32_t count);

  private:
    struct Move {
        const Buffer& sources;
        std::uint32_t before, after;  // splats
    };
    void gather(const Move& all, const AttributeRows& rows, bool clear_new, Buffer& buffer);

    Device* device_;
    Commands commands_;
    Pipeline decide_, sources_, gather_, gather_columns_, split_, reset_;
    Buffer quantile_;
};

// What one round of density control works with, and what the round takes of device memory.

/// The working space of a round over N splats.
struct RoundBuffers {
    Buffer keep, grow, action;        // uint [N]
    Buffer keep_offset, grow_offset;  // uint [N]
    Buffer count, keep_total, grow_total;
    Buffer sources;  // uint [2 N][2]

    static BufferList<RoundBuffers> list(std::uint64_t splats);
};

/// What the floats of a splat depend on.
struct SplatFloats {
    int sh_degree = 0, kernel = 0;
    bool rest_sum = false;  // GpuSplats::rest_sum
};
/// Bytes of GpuSplats::rest_sum of so many splats.
std::uint64_t rest_sum_bytes(std::uint64_t splats, const SplatFloats& of);

/// The most bytes that parameters, moments and working space take at a time while a round makes
/// `after` splats out of `before`: attributes are replaced one at a time, so that one exists twice.
std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, const SplatFloats& of);

// Constants of shaders/densify/shape_rows.glsl: which rows the tables over a kernel's shapes have.

inline SpecConstants shape_row_constants(int kernel) {
    if (!kernel_has_shape(kernel)) return {{"SHAPES", 1}};
    const ShapedKernel& shaped = shaped_kernel(kernel);
    return {{"SHAPES", SHAPE_ROWS},
            {"SHAPE_FIRST", static_cast<float>(shaped.first_shape())},
            {"SHAPE_LAST", static_cast<float>(shaped.last_shape())}};
}

// Splats in the order of a space-filling curve: those that lie beside each other in the scene lie
// beside each other in memory, so that what a view does not see comes in long runs. The sort is
// stable and the grid is the caller's: the order repeats. A picture changes by it only where
// splats have the same depth.

/// A cube of 1024 cells a side, in the splats' coordinates.
struct MortonGrid {
    glm::vec3 centre{0};
    float half_side = 1;
};

class MortonOrder {
  public:
    explicit MortonOrder(Device& device);

    /// Parameters and moments into the order of the curve; splats of one cell keep theirs. What is
    /// per splat beside them is the caller's to clear or make anew. The queue must be idle. Takes
    /// less for a moment than a round of density control.
    void run(GpuSplats& splats, DensityControl& density, const MortonGrid& grid);

  private:
    Device* device_;
    Commands commands_;
    Pipeline key_, sources_;
};

}  // namespace darb
