// SPDX-License-Identifier: MIT
// TrainingPhotos: photos and cameras on the device, whole or, while the resolution ramp lasts, with
// their sides divided. Photos that do not fit wait on the host: a step copies its own to one of two
// places on the device, and the next one's to the other.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/frame_view.h"
#include "engine/scene/camera.h"
#include "shaders/shared/render_args.h"

namespace darb {

/// The camera of a photo whose sides are divided and rounded: it sees the same.
Camera divided(const Camera& camera, double divisor);

/// The number of each training view's exposure, in the order of the views. A photo has one
/// exposure, and the six faces of a panorama are one photo.
std::vector<std::uint32_t> exposure_numbers(const std::vector<View>& views);
/// How many exposures there are.
std::uint32_t exposure_count(const std::vector<View>& views);

class ResolutionRamp {
  public:
    explicit ResolutionRamp(Device& device);

    /// A smaller photo: area means, colours weighted by alpha. photo: [H][W] R G B A of `camera`
    /// and, where it is twice as large, float [H][W] measured depths, of which the nearest measured
    /// one is taken.
    Buffer downsample(const Buffer& photo, const Camera& camera, const Camera& smaller,
                      Memory memory = Memory::device);

  private:
    Device* device_;
    Commands commands_;
    Pipeline pipeline_, depths_;
};

/// A training view as an iteration sees it, at the size that photos have then. It points into
/// TrainingPhotos until their size changes.
struct TrainingView {
    FrameView frame;
    std::uint32_t photo = 0;  // among the training photos
    // uint [H][W], R in the low byte, and where depths were measured float [H][W], world units; on
    // the host where they wait.
    const Buffer* pixels = nullptr;
    bool measured = false;
    std::uint32_t exposure = 0;  // of exposure_numbers()

    int width() const { return static_cast<int>(frame.camera.width); }
    int height() const { return static_cast<int>(frame.camera.height); }
    std::uint32_t size() const { return frame.camera.width * frame.camera.height; }
};

class TrainingPhotos {
  public:
    /// photos: as load_photos gives them, in the order of dataset.views. origin: that of the
    /// splats. stream: the photos wait on the host. depths: measured depths go with the photos of
    /// views that have any. Throws Error where no view is left to train on.
    TrainingPhotos(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                   const glm::dvec3& origin, bool stream, bool depths = false);

    /// The training views among all, ascending.
    const std::vector<int>& views() const { return views_; }
    /// The exposures of the training photos.
    std::uint32_t exposures() const { return exposures_; }
    /// That of the training photo with this place among them.
    std::uint32_t exposure(std::size_t photo) const { return exposure_of_[photo]; }
    std::size_t view_count() const { return view_cameras_.size(); }
    std::uint32_t count() const { return static_cast<std::uint32_t>(views_.size()); }
    TrainingView view(int view, int sh_degree, const glm::vec3& background) const;
    /// The photo of a view, where what is recorded next reads it: copied there first where it
    /// waits, with that of the view `next` after it; -1: not known. Recordings are submitted in the
    /// order of these calls.
    const Buffer& place(Commands& commands, const TrainingView& view, int next = -1);
    /// To be called once the last recording went to the queue; otherwise the next place() copies
    /// again.
    void submitted() { pending_ = false; }
    bool stream() const { return memory_ == Memory::waiting; }
    /// The camera of a view at its whole size.
    const Camera& camera(int view) const { return view_cameras_[view]; }
    /// Replaces the cameras of all views by others of the same sizes. The queue must be idle.
    void set_cameras(const std::vector<Camera>& cameras);
    /// The name of a view.
    const std::string& name(int view) const { return names_[view]; }
    /// Distance of the nearest points from the camera of a view; infinity: there are none.
    double nearest_distance(int view) const { return nearest_[view]; }

    /// Median of the measured depths, world units; 1 where there are none.
    double usual_depth() const { return usual_depth_; }

    int longest_side() const { return longest_side_; }       // px, over all views
    int largest_width() const { return width_; }             // px, over all views
    int largest_height() const { return height_; }           // px, over all views
    std::uint64_t largest_photo() const { return pixels_; }  // pixels of the largest training photo

    /// The cameras of the training photos at their whole size, on the host.
    std::vector<gpu::CameraData> training_cameras() const;
    /// Origin of the splats that the cameras see (SplatModel::origin).
    const glm::dvec3& origin() const { return origin_; }
    /// The mean of their centres.
    glm::vec3 mean_centre() const;

    /// What the sides are divided by now.
    int divisor() const { return divisor_; }
    /// Divides them anew; 1: whole photos. Where the device has no room for smaller ones beside the
    /// whole ones these stay, and has_room_for_smaller() is false from then on. The queue must be
    /// idle.
    void set_divisor(int divisor);
    bool has_room_for_smaller() const { return room_for_smaller_; }
    /// Pixels of all the smaller photos that are there now.
    std::uint64_t small_pixels() const;
    std::uint32_t small_cameras() const { return static_cast<std::uint32_t>(small_.data.size()); }

  private:
    struct Size {
        std::vector<gpu::CameraData> data;  // [view]
        Buffer cameras;
        std::vector<Buffer> photos;  // [view]; empty for views that are held out
    };
    struct Place {
        Buffer pixels;
        int view = -1;  // view whose photo is there once all that was recorded has run
    };
    void upload(const View& view, const ImageU8& photo, const ImageF& depth);
    void make_smaller(ResolutionRamp& ramp, int divisor);
    void fill(Commands& commands, Place& place, int view);

    Device* device_;
    glm::dvec3 origin_;
    std::vector<Camera> view_cameras_;  // [view]
    std::vector<std::string> names_;    // [view]
    std::vector<double> nearest_;       // [view]
    std::vector<int> views_;
    std::vector<std::uint32_t> exposure_of_;  // [training photo]
    std::uint32_t exposures_;
    std::vector<bool> measured_;  // [view]
    double usual_depth_ = 1;
    int longest_side_ = 1, width_ = 1, height_ = 1;
    std::uint64_t pixels_ = 1;
    Memory memory_;  // where the photos lie
    Size whole_, small_;
    std::array<Place, 2> places_;
    bool pending_ = false;  // recorded, and not yet submitted
    int divisor_ = 1;
    bool room_for_smaller_ = true;
};

}  // namespace darb
