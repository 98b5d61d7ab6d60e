// ErrorScore: which splats stand where the pictures are wrong. Of several training photos since the
// last round, each splat's share of the error |picture - photo|, weighted as it is blended there:
// sum over pixels of alpha T e. Place: budget. The idea of scores over several views is that of
// Taming 3DGS (arXiv 2406.15643) and FastGS (arXiv 2511.04283); this form needs no pass of its own
// over the pixels: blend_backward sums alpha T dL/dcolour, and is given e for dL/dcolour.
#pragma once

#include <vector>

#include "engine/raster/backward.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/loss.h"
#include "shaders/shared/strategy_args.h"

namespace darb {

class ErrorScore {
  public:
    /// photos: how the loss reads them.
    ErrorScore(Device& device, const LossOptions& photos);

    /// Room for so many splats, all at zero; forgets what was there. The queue must be idle.
    void reset(std::uint32_t splats);

    /// Device memory for so many splats beside frames of so many pixels.
    static std::uint64_t device_bytes(std::uint64_t splats, std::uint64_t pixels,
                                      std::uint32_t list_segments);

    struct Images {
        const Buffer& image;             // the picture that is compared
        const Buffer& photo;             // with this
        const Buffer& d_image;           // [3][H][W], scratch here
        const Buffer* shares = nullptr;  // to which that of the view is added; null: shares()
    };
    /// Recorded between Forward::record of a frame and its loss.
    void record(Commands& commands, const FrameView& view, const Frame& frame, Backward& backward,
                const Images& images, std::uint32_t splats);

    /// The shares of several views, added up, to shares(). status: gpu::FrameStatus of a frame.
    void record_sum(Commands& commands, const Buffer& shares, const Buffer& status,
                    std::uint32_t splats);

    /// [N][2]: sum over the photos of the splat's share of their mean error; 1 where one saw it.
    const Buffer& shares() const { return shares_; }
    std::vector<float> state(std::uint32_t splats) const;
    void restore(const std::vector<float>& state);

  private:
    static BufferList<ErrorScore> share_buffers(std::uint64_t splats);
    static BufferList<ErrorScore> segment_buffers(std::uint64_t pixels);

    Device* device_;
    Pipeline image_, share_, sum_;
    std::uint32_t window_intersections_ = 0;  // of the partials that share_ reads
    Buffer shares_, transmittance_;  // the latter: a copy, where lists take several dispatches
};

}  // namespace darb
