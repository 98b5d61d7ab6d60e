// How coarsely a scene may be written: the search that web pages and `darb convert` share. Pictures
// of the source decide: the coarsest precision is taken at which the worst of 8 views keeps 50 dB.
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

/// What the worst view must come to for a precision to be taken.
constexpr double kEnoughDb = 50;
/// Where no precision comes to that: the coarsest that is so near to the finest one's worst view.
constexpr double kNoWorseDb = 0.25;
/// Of equal pictures.
constexpr double kEqualPicturesDb = 100;

/// Of pictures against those of the source.
struct PictureLoss {
    std::size_t views = 0;  // 0: not measured
    double mean_db = 0, worst_db = 0;
    std::string worst_view;
};

/// Pictures of a source, of up to 8 of the views evenly picked, as pinholes of at most 800 px.
class PictureMeasure {
  public:
    /// The device has to outlive it. views: at least one. progress: called with the number of
    /// pictures that are made, here and in compare(); may be empty.
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

/// What a search came to.
struct PictureFit {
    int level = 0;                // 0 is the coarsest
    std::size_t bytes = 0;        // of the output
    std::size_t merged_from = 0;  // splats of the source where some were merged, else 0
    PictureLoss loss;
};

/// An output of several precisions, one at a time.
class PictureOutput {
  public:
    virtual ~PictureOutput() = default;
    /// Makes the splats ready at this level, and returns them as a reader of the output gets them.
    virtual SplatModel pack(const SplatModel& splats, int level) = 0;
    /// Makes the output of what was packed last, and returns its bytes; `fit` has all else.
    virtual std::size_t finish(const PictureFit& fit) = 0;
    /// Bytes of the last output that fewer splats would take as well.
    virtual std::size_t fixed_bytes() const { return 0; }
};

struct PictureLimits {
    int levels = 1;               // of the output
    int least_level = 0;          // none coarser is tried
    std::uint64_t max_bytes = 0;  // splats are merged until it fits; 0: as it comes
};

/// Leaves `output` finished. Without a measure the finest level is taken, and the loss stays
/// unknown. Where the size is too large, splats are merged at this level; coarser levels, which
/// leave room for more splats, are tried as long as the worst view gains. Throws Error where not
/// one splat fits.
PictureFit fit_pictures(const SplatModel& source, const PictureMeasure* measure,
                        const PictureLimits& limits, PictureOutput& output);

/// "41.20 dB mean over 8 views, 38.10 dB at worst (view 3)".
std::string loss_text(const PictureLoss& loss);

}  // namespace darb
