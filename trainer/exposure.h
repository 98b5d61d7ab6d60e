// Per-photo exposure in training: an affine map of colours a photo between picture and loss,
// trained by Adam beside the splats. Off in pictures for evaluation. The mean of all maps stays the
// identity. It maps what the splats show and leaves the background as it is.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "engine/gpu/buffer_list.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "trainer/exposure_fit.h"

namespace darb {

/// The step of one photo's map.
struct ExposureStep {
    std::uint32_t photo = 0, pixels = 0;
    float rate = 0;  // of Adam
    int visits = 1;  // of this photo, this one counted
};

/// What a map applies to.
struct ExposedPicture {
    const Buffer& image;          // float [3][H W]
    const Buffer& transmittance;  // float [H W], what of the background is seen
    glm::vec3 background;
};

class Exposure {
  public:
    /// For `photos` photos of at most `pixels` pixels, all identities; steps of `batch` views.
    Exposure(Device& device, std::uint32_t photos, std::uint64_t pixels, int batch = 1);

    /// Device memory of an Exposure made with these arguments.
    static std::uint64_t device_bytes(std::uint32_t photos, std::uint64_t pixels, int batch = 1);

    /// image [3][H W] over picture.background -> mapped(), the picture as this photo shows it.
    void record(Commands& commands, const ExposedPicture& picture, std::uint32_t photo,
                std::uint32_t pixels);
    const Buffer& mapped() const { return mapped_; }

    /// d_image [4][H W], whose first three planes are dL/d(mapped), becomes dL/d(image) and
    /// dL/d(1 - transmittance), as ForwardOptions::alpha_gradient takes them; the map's own
    /// gradient stays for the step of this place in the batch.
    void record_backward(Commands& commands, const ExposedPicture& picture, const Buffer& d_image,
                         const ExposureStep& step, int place = 0);
    /// The photo's Adam step of what record_backward left. status: gpu::FrameStatus of the frame.
    void record_step(Commands& commands, const Buffer& status, const ExposureStep& step,
                     int place = 0);

    /// What record_backward left for this place, and as another process has it. The queue must be
    /// idle.
    std::vector<float> gradient(int place) const;
    static std::size_t gradient_floats();
    void set_gradient(int place, const std::vector<float>& values);

    std::vector<ColourMap> maps() const;
    /// maps and moments as one array, for checkpoints: [photos][12] maps, [photos][12][2] moments.
    std::vector<float> state() const;
    void restore(const std::vector<float>& state);
    static std::size_t state_size(std::size_t photos) { return photos * 36; }

  private:
    static BufferList<Exposure> buffers(std::uint64_t photos, std::uint64_t pixels, int batch);
    std::uint32_t photos_;
    Pipeline map_, backward_, update_;
    Buffer maps_, moments_, mapped_, partials_;
};

}  // namespace darb
