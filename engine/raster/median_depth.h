// SPDX-License-Identifier: MIT
// What the splats of a frame leave of the light along a ray. MedianDepth: at each pixel the depth
// at which half of it, or another share, is left. PointLight: the share that is left at a point.
// Both read the lists of a frame and need no picture. docs/math.md has the formulas and their
// source.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"
#include "engine/raster/gpu_splats.h"
#include "shaders/shared/depth_args.h"

namespace darb {

/// How the depth of a pixel is read: as DEPTH_READING_*, or the mean of the centres' depths, each
/// with its weight in the pixel (Renderer::render_depth).
enum class DepthReading {
    front = DEPTH_READING_FRONT,
    solid = DEPTH_READING_SOLID,
    plane = DEPTH_READING_PLANE,
    expected
};
inline constexpr std::string_view kDepthReadings[] = {"front", "solid", "plane", "expected"};
/// Nothing where there is no such reading.
std::optional<DepthReading> depth_reading_from_name(std::string_view name);

/// What depths are read by where nobody says how: `front`, or `plane` where the kernel's rings rise
/// again along a ray.
DepthReading usual_reading(int kernel);

/// What each splat is along the rays of a view: the slope of its depth over the picture, and its
/// deviation.
class DepthPlanes {
  public:
    DepthPlanes(Device& device, const ForwardOptions& options);
    void record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                const Frame& frame);
    /// vec3 [N] of the last record(), where a splat is visible.
    const Buffer& planes() const { return planes_; }

  private:
    Device* device_;
    Pipeline pass_;
    Buffer planes_;
};

class MedianDepth {
  public:
    /// options: those of the frames. reading: any but `expected`. Throws Error where the kernel
    /// rises again along a ray (more than one pulse) and the reading is not `plane`.
    MedianDepth(Device& device, const ForwardOptions& options, DepthReading reading);

    /// After Forward::record_intersections, or record, of the same view has run and its status was
    /// read: longest_list is from there. level: share of the light left at the surface, in (0, 1).
    void record(Commands& commands, const GpuSplats& splats, const FrameView& view,
                const Frame& frame, std::uint32_t longest_list, float level = 0.5f);

    /// float [H][W][2] of the last record(): depth along the optical axis, world units, 0 where
    /// more light than the level is left behind the last splat; and the opacity of the pixel.
    const Buffer& depth() const { return depth_; }

    /// Device memory for so many splats and pixels, with lists of one segment.
    static std::uint64_t device_bytes(std::uint32_t splats, std::uint64_t pixels);

  private:
    void reserve(std::uint64_t pixels, std::uint32_t segments);

    Device* device_;
    DepthPlanes planes_;
    Pipeline bracket_pass_, search_, walk_;
    Buffer bracket_, ends_, product_, depth_;
};

/// A point in the space of a view: where it is in the picture, px, and its depth along the optical
/// axis, world units.
struct ViewPoint {
    float x = 0, y = 0, depth = 0;
};

class PointLight {
  public:
    /// As MedianDepth.
    PointLight(Device& device, const ForwardOptions& options, DepthReading reading);

    /// The share of the light that is left at each point, which must be in the picture. Records and
    /// submits `commands`, after the same steps as for MedianDepth::record.
    std::vector<float> find(Commands& commands, const GpuSplats& splats, const FrameView& view,
                            const Frame& frame, std::uint32_t longest_list,
                            std::span<const ViewPoint> points);

  private:
    Device* device_;
    DepthPlanes planes_;
    Pipeline pass_;
    std::uint32_t points_of_item_ = 0;
    Buffer points_, items_, light_;
};

}  // namespace darb
