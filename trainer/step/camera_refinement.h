// SPDX-License-Identifier: MIT
// CameraRefinement: poses of the training photos, and the intrinsics that they share, trained
// beside the splats. The gradient through the picture comes from the device; the reprojection of
// tracks anchors it. Where shutters roll, each photo's turn and move are trained, too. Adam, a
// camera and a group of intrinsics at a time, in coordinates of which a step of 1 shifts a picture
// by 1 px (engine/scene/pose_metric.h). What moves the scene as a whole is taken out of every step.
// All on the host in double, rounded to float where it is kept: a run repeats, and every rank makes
// the same step.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/data/track_adjustment.h"
#include "engine/render/render_gradients.h"
#include "engine/scene/pose_metric.h"
#include "trainer/options/options.h"

namespace darb {

/// How far the cameras have come from where they began, each the root of the mean square over a
/// picture, px at the photos' whole size.
struct CameraMoves {
    std::size_t cameras = 0;
    double median_px = 0, largest_px = 0;
    double median_degrees = 0, largest_degrees = 0;  // angle that a camera turned by
    double largest_focal = 0;                        // share by which a focal length changed
    double largest_centre_px = 0;                    // shift of a principal point
    bool shutters = false;
    double median_rolled_px = 0, largest_rolled_px = 0;  // change of the shift over a read-out
};

/// What one photo of a step says about its camera.
struct CameraVisit {
    int view = 0;  // index in Dataset::views
    CameraGradient gradient;
    int width = 0, height = 0;  // size of the picture, px
};

class CameraRefinement {
  public:
    /// Throws Error where fewer than three photos are trained on.
    CameraRefinement(const Dataset& dataset, const TrainOptions& options);
    /// Another length of the same run from now on.
    void set_iterations(int iterations) { iterations_ = iterations; }

    /// The refined camera of a view at its whole size; of a held-out one only the intrinsics are
    /// refined.
    const Camera& camera(int view) const { return cameras_[static_cast<std::size_t>(view)]; }

    /// After an iteration's step of the splats; nothing happens before the run's share
    /// camera_from. True where cameras changed.
    /// share: of its rates.
    bool step(int iteration, std::span<const CameraVisit> visits, double share = 1);

    /// Whether shutters are trained: from the start, or since a state with them was restored.
    bool shutters() const { return shutters_; }
    /// The same state() with shutters added, which begin still and are trained from then on.
    std::vector<float> with_shutters(const std::vector<float>& state) const;

    CameraMoves moves() const;

    /// For checkpoints: values, moments and visits of poses, of their shutters where those are
    /// trained, then of intrinsics. Where a run tries shutters, a state tells by its size whether
    /// it has them.
    std::vector<float> state() const;
    void restore(const std::vector<float>& state);

  private:
    template <std::size_t N>
    struct Trained {
        std::array<float, N> value{}, first{}, second{};  // px; moments of Adam
        float visits = 0;
        void step(const std::array<double, N>& gradient, double rate);
    };
    struct Pose {
        int view = 0;
        PoseMetric metric;
        Trained<6> trained;
        Trained<6> shutter;  // change of turn and -move, over the read-out as kRowSpread says
        std::vector<TrackObservation> tracks;
    };
    static constexpr std::size_t kPoseFloats = 19;  // of a Trained<6>, in a state
    struct Group {                                  // views with the same intrinsics
        double trained_views = 0;
        glm::dvec4 unit{1.0};  // change of fx, fy, cx, cy that shifts a picture by 1 px
        Trained<4> trained;
    };
    std::size_t state_size(bool shutters) const {
        return poses_.size() * kPoseFloats * (shutters ? 2 : 1) + groups_.size() * 13;
    }
    double rate(int iteration) const;
    void add_anchor(const Pose& pose, CameraGradient& gradient) const;
    PoseVector pose_gradient(const Pose& pose, const CameraGradient& gradient) const;
    PoseVector step_of(const Pose& pose) const;
    PoseVector shutter_step_of(const Pose& pose) const;
    void place_cameras();

    double rate_px_, anchor_, from_;
    int iterations_;
    bool shutters_, tries_shutters_;       // whether shutters are trained; whether that may change
    std::vector<Camera> start_, cameras_;  // [view]
    std::vector<glm::dvec3> points_;       // points of the data set, which stay fixed
    std::vector<Pose> poses_;              // one per training photo, in order
    std::vector<Group> groups_;
    std::vector<int> pose_of_, group_of_;  // [view], pose -1: held out
    Gauge gauge_;
};

// The pose under which the picture of a scene comes nearest to a photo, the scene as it is: what
// makes held-out photos comparable between runs whose cameras moved, or whose poses are not exact.

class CameraAlignment {
  public:
    /// Aligns cameras with pictures of this model.
    CameraAlignment(Device& device, const SplatModel& model, const Accuracy& accuracy = {});

    /// The camera, turned and moved, with another turn and move of a shutter that rolls; its
    /// intrinsics stay. Takes 40 steps of Adam on the mean
    /// squared error, from 0.2 px at first to 0.01 px in the end, and returns the best camera on
    /// the way. photo: RGBA of the camera's size. Masked pixels do not count where alpha is a mask.
    Camera align(const Camera& camera, const ImageU8& photo, const glm::vec3& background,
                 bool alpha_is_mask);

  private:
    GradientRenderer renderer_;
    std::vector<glm::dvec3> places_;  // centres of splats
    double depth_ = 1;
};

}  // namespace darb
