// SPDX-License-Identifier: MIT
// The depth images beside the frames of darb render.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/depth_io.h"
#include "engine/plan/accuracy.h"
#include "engine/plan/effect_plan.h"

namespace darb {

struct DepthFlags {
    std::string format;   // png or npy; empty: none
    std::string reading;  // of kDepthReadings; empty: the usual one of the kernel
    double unit = 0.001;  // world units of one step of a PNG
};

/// Throws Error where depths are asked for and the accuracy cannot hold them, or the effects leave
/// them out.
void check_depth(const DepthFlags& flags, const Accuracy& accuracy, const EffectChoice& effects);

/// The names FRAME_depth.png or FRAME_depth.npy, and FRAME_depth_colours.png, a picture of it for
/// people.
std::vector<std::filesystem::path> depth_files(const DepthFlags& flags,
                                               const std::filesystem::path& frame);

/// Appends the depth files of all frames.
void add_depth_files(const DepthFlags& flags, const std::vector<std::filesystem::path>& frames,
                     std::vector<std::filesystem::path>& files);

/// From near yellow over green to far dark blue, between the 1st and the 99th percentile of what is
/// seen; black where nothing is. depth: first channel, 0 where nothing is seen.
ImageU8 depth_picture(const ImageF& depth);

class DepthFiles {
  public:
    explicit DepthFiles(const DepthFlags& flags) : flags_(flags) {}
    /// depth: from Renderer::render_depth. Writes FRAME_depth.png in steps of the unit, or
    /// FRAME_depth.npy in world units, and the picture beside it.
    void write(const std::filesystem::path& frame, const ImageF& depth);
    /// Prints on stderr how many pixels lay beyond the last step, and which unit would hold all.
    void print_clipped() const;

  private:
    DepthFlags flags_;
    DepthRange range_;  // over all that were written
};

}  // namespace darb
