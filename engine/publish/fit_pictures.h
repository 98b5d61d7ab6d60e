// SPDX-License-Identifier: MIT
// How coarsely a scene may be written: the search that web pages and `darb convert` share.
// Pictures of the source decide: it takes the coarsest precision at which the worst of 8 views
// keeps 50 dB.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// The PSNR that the worst view must reach for a precision to be accepted.
constexpr double kEnoughDb = 50;
/// Where no precision reaches that, the coarsest is taken whose worst view is this close to that of
/// the finest.
constexpr double kNoWorseDb = 0.25;
/// PSNR given to equal pictures.
constexpr double kEqualPicturesDb = 100;

/// How pictures differ from those of the source.
struct PictureLoss {
    std::size_t views = 0;  // 0: not measured
    double mean_db = 0, worst_db = 0;
    std::string worst_view;
};

/// Pictures of a source from up to 8 of the views, evenly picked, as pinholes of at most 800 px.
class PictureMeasure {
  public:
    /// The device must outlive this object. views: at least one. progress: called with the
    /// number of pictures made so far, here and in compare(); may be empty.
    using Progress = std::function<void(std::size_t pictures)>;
    PictureMeasure(Device& device, const SplatModel& source, const std::vector<View>& views,
                   const glm::vec3& background, Progress progress = {});
    PictureLoss compare(const SplatModel& splats) const;

  private:
    ImageF picture(class Renderer& renderer, std::size_t view) const;

    Device& device_;
    glm::vec3 background_;
    Progress progress_;
    mutable std::size_t pictures_ = 0;
    std::vector<std::string> names_;
    std::vector<Camera> cameras_;
    std::vector<ImageF> truths_;
};

/// The result of a search.
struct PictureFit {
    int level = 0;                // 0 is the coarsest
    std::size_t bytes = 0;        // size of the output
    std::size_t merged_from = 0;  // splats of the source, where some were merged; else 0
    PictureLoss loss;
};

/// An output that can be written with several precisions, one at a time.
class PictureOutput {
  public:
    virtual ~PictureOutput() = default;
    /// Prepares the splats at this level, and returns them as a reader of the output would get
    /// them.
    virtual SplatModel pack(const SplatModel& splats, int level) = 0;
    /// Makes the output of the splats packed last, and returns its size in bytes; `fit` has
    /// everything else.
    virtual std::size_t finish(const PictureFit& fit) = 0;
    /// Bytes of the last output that do not depend on the number of splats.
    virtual std::size_t fixed_bytes() const { return 0; }
};

struct PictureLimits {
    int levels = 1;               // number of precisions
    int least_level = 0;          // no coarser level is tried
    std::uint64_t max_bytes = 0;  // splats are merged until it fits; 0: no limit
};

/// Leaves `output` finished. Without a measure, the finest level is taken, and the loss stays
/// unknown. Where the output is too large, splats are merged at that level; coarser levels, which
/// leave room for more splats, are tried as long as the worst view gains. Throws Error where not
/// even one splat fits.
PictureFit fit_pictures(const SplatModel& source, const PictureMeasure* measure,
                        const PictureLimits& limits, PictureOutput& output);

/// As text: "41.20 dB mean over 8 views, 38.10 dB at worst (view 3)".
std::string loss_text(const PictureLoss& loss);

}  // namespace darb
