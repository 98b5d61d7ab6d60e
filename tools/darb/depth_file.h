// Depth images beside the frames of darb render.
#pragma once

#include <filesystem>

#include "engine/core/image.h"
#include "engine/data/depth_io.h"
#include "engine/plan/accuracy.h"
#include "engine/plan/effect_plan.h"

namespace darb {

struct DepthFlags {
    std::string format;   // png or npy; empty: none asked for
    double unit = 0.001;  // world units of one step of a PNG
};

/// Throws Error where depths are on and the accuracy has no place for them, or are asked for and
/// the effects leave them out.
void check_depth(const DepthFlags& flags, const Accuracy& accuracy, const EffectChoice& effects);

/// FRAME_depth.png or FRAME_depth.npy.
std::filesystem::path depth_file(const DepthFlags& flags, const std::filesystem::path& frame);

class DepthFiles {
  public:
    explicit DepthFiles(const DepthFlags& flags) : flags_(flags) {}
    /// depth: Renderer::render_depth. FRAME_depth.png in steps of the unit, or FRAME_depth.npy in
    /// world units.
    void write(const std::filesystem::path& frame, const ImageF& depth);
    /// Says on stderr how many pixels lay beyond the last step, and which unit holds all.
    void print_clipped() const;

  private:
    DepthFlags flags_;
    DepthRange range_;  // of all that were written
};

}  // namespace darb
