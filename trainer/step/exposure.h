// SPDX-License-Identifier: MIT
// Per-photo exposure in training: an affine map of colours a photo, or a bilateral grid of them,
// between picture and loss, trained by Adam beside the splats. The faces of a panorama are one
// photo and share one (exposure_numbers). Off in pictures for evaluation. The mean of all maps
// stays the identity. It maps what the splats show and leaves the background as it is.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <vector>

#include "engine/core/image.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "trainer/options/options.h"

namespace darb {

/// Row-major [3][4]: out_r = m[r][0] R + m[r][1] G + m[r][2] B + m[r][3].
using ColourMap = std::array<float, 12>;
constexpr ColourMap kIdentityColours = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// The map that fits apply_exposure(map, render, photo) to the photo over the background by least
/// squares, over the pixels that count (all, or alpha of at least 128 where alpha is a mask); held
/// to the identity by a weight of 1e-6 a pixel, so that pictures of one colour have an answer.
ColourMap fit_exposure(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                       bool alpha_is_mask);

/// Returns RGB, not clamped. Where alpha is no mask, a pixel is mapped by the share that the
/// photo's alpha says: what is behind is the background, which no exposure changes.
ImageF apply_exposure(const ColourMap& map, const ImageF& image, const ImageU8& photo,
                      bool alpha_is_mask);

/// One step of Adam on a photo's map.
struct ExposureStep {
    std::uint32_t photo = 0, pixels = 0;  // photo: the number of its map
    float rate = 0;                       // Adam's learning rate
    int visits = 1;                       // steps of this map, this one included
};

/// What a map applies to.
struct ExposedPicture {
    const Buffer& image;          // float [3][H W]
    const Buffer& transmittance;  // float [H W], share of the background that is seen
    glm::vec3 background;
    std::uint32_t width = 0;  // px, read for grids
};

/// What is trained for each photo.
struct ExposureMaps {
    std::uint32_t photos = 0;
    bool grid = false;          // a grid of maps, EXPOSURE_GRID_*; false: one map
    int batch = 1;              // views in a step
    std::size_t terms() const;  // floats per photo
    /// Length of Exposure::state(), floats.
    std::size_t state_size() const { return photos * terms() * 3; }
};

/// The maps that these options train for so many photos.
ExposureMaps exposure_maps(const TrainOptions& options, std::uint32_t photos);

class Exposure {
  public:
    /// For photos of at most `pixels` pixels; all maps begin as identities.
    Exposure(Device& device, const ExposureMaps& maps, std::uint64_t pixels);

    /// Device memory of an Exposure made with these arguments.
    static std::uint64_t device_bytes(const ExposureMaps& maps, std::uint64_t pixels);

    /// image [3][H W] over picture.background -> mapped(), the picture as this photo shows it.
    void record(Commands& commands, const ExposedPicture& picture, std::uint32_t photo,
                std::uint32_t pixels);
    const Buffer& mapped() const { return mapped_; }

    /// d_image [4][H W], whose first three planes are dL/d(mapped), becomes dL/d(image) and
    /// dL/d(1 - transmittance), as ForwardOptions::alpha_gradient takes them; the map's own
    /// gradient stays for the step of this place in the batch.
    void record_backward(Commands& commands, const ExposedPicture& picture, const Buffer& d_image,
                         const ExposureStep& step, int place = 0);
    /// Takes the photo's Adam step by the gradient that record_backward left. status:
    /// gpu::FrameStatus of the frame.
    void record_step(Commands& commands, const Buffer& status, const ExposureStep& step,
                     int place = 0);

    /// The gradient that record_backward left for this place; set_gradient puts another process's
    /// there. The queue must be idle.
    std::vector<float> gradient(int place) const;
    std::size_t gradient_floats() const;
    void set_gradient(int place, const std::vector<float>& values);

    /// One map per photo; where there is a grid, the mean of its maps.
    std::vector<ColourMap> maps() const;
    /// maps and moments as one array, for checkpoints: [photos][terms], [photos][terms][2].
    std::vector<float> state() const;
    void restore(const std::vector<float>& state);

  private:
    static BufferList<Exposure> buffers(const ExposureMaps& maps, std::uint64_t pixels);
    BufferRange partials(int place) const;

    ExposureMaps of_;
    Pipeline map_, gradient_, backward_,
        update_;  // backward_: for grids; for one map gradient_ does both
    Buffer maps_, moments_, mapped_, partials_;
};

}  // namespace darb
