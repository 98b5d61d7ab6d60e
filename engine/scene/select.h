// SPDX-License-Identifier: MIT
// Which splats are meant: by place, by what a view shows of them, by their values, by the parts
// that they form. Each way is a value, so that a window, a script and a project mean the same.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/scene/clutter.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/region.h"
#include "engine/scene/splat_model.h"

namespace darb {

/// The pixel at which the point is seen; nothing behind the camera.
inline std::optional<glm::dvec2> pixel_of(const Camera& c, const glm::dvec3& world) {
    const glm::dvec3 p = c.rotation * world + c.translation;
    if (!(p.z > 0)) return {};
    return glm::dvec2(c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
}
double distance_to_segment(const glm::dvec2& p, const glm::dvec2& a, const glm::dvec2& b);

/// a and b are opposite corners, px.
SplatSet in_rectangle(const SplatModel& model, const Camera& camera, glm::dvec2 a, glm::dvec2 b);
/// The outline in px; its ends are joined, and the even-odd rule decides what is inside.
SplatSet in_lasso(const SplatModel& model, const Camera& camera,
                  const std::vector<glm::dvec2>& lasso);
/// Splats within the radius of the line through the points, px.
SplatSet under_brush(const SplatModel& model, const Camera& camera,
                     const std::vector<glm::dvec2>& stroke, double radius);
SplatSet in_region(const SplatModel& model, const Region& region);
/// By opacity, 0 to 1.
SplatSet by_opacity(const SplatModel& model, double low, double high);
/// By the largest standard deviation, world units.
SplatSet by_scale(const SplatModel& model, double low, double high);
/// By colour without harmonics above degree 0; all channels must be within the tolerance, sRGB 0 to
/// 1.
SplatSet by_colour(const SplatModel& model, const glm::dvec3& colour, double tolerance);
/// The base colour, sRGB, not clamped.
glm::dvec3 base_colour(const SplatModel& model, std::size_t splat);
/// Adds all splats nearer than `distance` (world units, above 0) to one of the mask.
SplatSet grown(const SplatModel& model, const SplatSet& mask, double distance);
/// The splats of all parts (parts_of_splats) that have one of the mask; splats of `unseen` connect
/// nothing.
SplatSet connected(const SplatModel& model, const SplatSet& mask, const SplatSet& unseen);
/// A flood begins at no splat whose opacity is below this: its colour is hardly seen.
inline constexpr double kFloodOpacity = 0.1;
/// The splat whose centre is nearest to `at` (world) and all that hangs together with it: they
/// touch, or a chain of splats that touch leads to them (parts_of_splats), and in no channel is the
/// base colour of one farther from the first splat's than `within`, sRGB 0 to 1. Splats of `unseen`
/// are neither found nor do they connect anything. The set is empty where no splat can be first.
SplatSet flooded(const SplatModel& model, const glm::dvec3& at, double within,
                 const SplatSet& unseen);

/// Splats `first`, `first` + 1 ... of a model, `count` of them.
struct SplatRun {
    std::uint32_t first = 0, count = 0;
    bool operator==(const SplatRun&) const = default;
};
/// The splats of the set as ranges, in order.
std::vector<SplatRun> ranges_of(const SplatSet& set);

std::vector<std::uint32_t> splats_in(const std::vector<SplatRun>& ranges);
/// Throws Error where a range is beyond `size`.
SplatSet set_of_ranges(const std::vector<SplatRun>& ranges, std::size_t size);

/// How a new selection is combined with the one before.
enum class Combine { replace, add, subtract };

namespace by {

struct Everything {};
struct Nothing {};
struct Rectangle {
    Camera view;
    glm::dvec2 from{0.0}, to{0.0};  // px
};
struct Polygon {
    Camera view;
    std::vector<glm::dvec2> outline;  // px
};
struct Brush {
    Camera view;
    std::vector<glm::dvec2> stroke;  // px
    double radius = 1;               // px
};
struct Opacity {
    double low = 0, high = 1;
};
struct Size {
    double low = 0, high = 0;  // world
};
struct Colour {
    glm::dvec3 colour{1.0};  // sRGB, 0 to 1
    double within = 0;
};
struct Isolated {
    double share = 0.01;  // isolated_splats
};
struct Haze {
    double opacity = 0.1, size = 5;  // hazy_splats
};
/// What is near the selection, and the selection.
struct Near {
    double distance = 0;  // world
};
/// The parts to which the selection belongs.
struct Connected {};
/// What touches the splat nearest to a place, or touches what does, in colours like its own.
struct Flood {
    glm::dvec3 at{0.0};  // world
    double within = 0;   // of each channel, sRGB, 0 to 1
};
struct Layer {
    std::string name;
};
/// By their numbers in the scene as it was opened, followed by what was added since; deleted ones
/// count.
struct Numbers {
    std::vector<SplatRun> ranges;
};

}  // namespace by

/// One way to say which splats are meant. Region: those whose centre is inside.
using Selector = std::variant<by::Everything, by::Nothing, Region, by::Rectangle, by::Polygon,
                              by::Brush, by::Opacity, by::Size, by::Colour, by::Isolated, by::Haze,
                              by::Near, by::Connected, by::Flood, by::Layer, by::Numbers>;

}  // namespace darb
