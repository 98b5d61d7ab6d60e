// SPDX-License-Identifier: MIT
// MeshPicture: a triangle mesh on the device and pictures of it, by compute passes: they find the
// least depth of each pixel, then the face that has it, then its colour. Frames under way take
// turns with its buffers, in the order of the queue.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/mesh/triangle_mesh.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/scene/camera.h"
#include "viewer/display.h"

namespace darb {

class MeshPicture {
  public:
    /// Uploads the mesh. Throws Error where it has no faces, or more than the device binds at once.
    MeshPicture(Device& device, const TriangleMesh& mesh);

    bool has_room(int width, int height) const;
    /// Makes room for pictures of this size. The queue must be idle where there was none.
    void reserve(int width, int height);

    /// Draws the mesh as the camera, a pinhole, sees it, over the display's background. to:
    /// B8G8R8A8 [height][width].
    void record(Commands& commands, const Camera& camera, const DisplaySettings& display,
                const Buffer& to);
    /// The same into a picture of its own, which record_blend shows.
    void record(Commands& commands, const Camera& camera, const DisplaySettings& display);
    const Buffer& pixels() const { return pixels_; }
    /// The bits of a float [height][width]: the depth along the optical axis, world units; infinity
    /// where there is no face.
    const Buffer& depth() const { return depth_; }

  private:
    Device* device_;
    Pipeline raster_, raster_large_, shade_;
    glm::dvec3 origin_;
    std::uint32_t faces_ = 0;
    bool has_colours_ = false;
    Buffer position_, face_, colour_, large_;
    Buffer depth_, face_of_, pixels_;
};

/// What Forward::record_blend does, with a mesh among the splats.
class MeshBlend {
  public:
    /// options: those of the frames, which are stored as float32 and sorted by the splats' centres.
    MeshBlend(Device& device, const ForwardOptions& options)
        : device_(&device), options_(options) {}
    /// After Forward::record_intersections of a frame, and MeshPicture::record of the same camera.
    /// nearer: the share of its depth by which the mesh counts as nearer.
    void record(Commands& commands, const Camera& camera, const MeshPicture& mesh, float nearer,
                Frame& frame);

  private:
    Device* device_;
    ForwardOptions options_;
    Pipeline pipelines_[2];  // made when needed: for whole lists, for parts
};

}  // namespace darb
