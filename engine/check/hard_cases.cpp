// SPDX-License-Identifier: MIT
#include "engine/check/hard_cases.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <limits>

#include "engine/check/device_walk.h"
#include "engine/core/rng.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"

namespace darb::check {

namespace {

using reference::random_scene;
using reference::TestScene;

// A camera at the origin that looks along z, and splats at depth 2 unless stated otherwise, so that
// their places in the image can be chosen.
struct Stage {
    TestScene scene;

    Stage(int kernel, Footprint footprint, int width, int height) {
        Camera& c = scene.camera;
        c.width = width;
        c.height = height;
        c.fx = c.fy = 64;
        c.cx = width / 2.0;
        c.cy = height / 2.0;
        scene.model.kernel = kernel;
        scene.model.footprint = footprint;
    }
    // x, y in px; scale: roughly the standard deviation in px. The splat is not round, so that the
    // rotation has a gradient.
    void add(double x, double y, double scale, double logit, glm::vec3 colour, double depth = 2) {
        SplatModel& m = scene.model;
        const Camera& c = scene.camera;
        const size_t i = m.size();
        m.resize(i + 1);
        m.position[3 * i] = static_cast<float>((x - c.cx) / c.fx * depth);
        m.position[3 * i + 1] = static_cast<float>((y - c.cy) / c.fy * depth);
        m.position[3 * i + 2] = static_cast<float>(depth);
        const float turn[] = {0.9f, 0.1f, -0.3f, 0.2f}, stretch[] = {1, 0.8f, 1.25f};
        for (size_t a = 0; a < 4; ++a) m.rotation[4 * i + a] = turn[(a + i) % 4];
        m.opacity_logit[i] = static_cast<float>(logit);
        if (kernel_has_shape(m.kernel)) {  // blunt, as at the start, sharp
            m.shape.resize(i + 1);
            m.shape[i] = static_cast<float>(i % 5) * 0.7f - 1.2f;
        }
        for (size_t a = 0; a < 3; ++a) {
            // The centre of the camera has no scale of its own.
            const double world = scale / c.fx * std::max(std::abs(depth), 0.01);
            m.log_scale[3 * i + a] = static_cast<float>(std::log(world)) + std::log(stretch[a]);
            m.sh_dc[3 * i + a] = (colour[static_cast<int>(a)] - 0.5f) / static_cast<float>(SH_C0);
        }
    }
};

// Cycles through this many values for a colour. None is 0: there a colour is cut off, and rounding
// alone decides whether it has a gradient.
float shade(int i, int count) {
    return static_cast<float>(i % count + 1) / static_cast<float>(count);
}

double logit(double opacity) {
    return std::log(opacity / (1 - opacity));
}

HardCase make(const char* name, const char* what, TestScene scene) {
    HardCase c;
    c.name = name;
    c.what = what;
    c.scene = std::move(scene);
    return c;
}

class Cases {
  public:
    Cases(int kernel, Footprint footprint) : kernel_(kernel), footprint_(footprint) {
        if (footprint == Footprint::exact && ends_with_a_jump(kernel))
            gradient_ = "gradient_steep_float32";
    }
    std::vector<HardCase> all() {
        projection();
        parameters();
        blending();
        frames();
        return std::move(cases_);
    }

  private:
    TestScene random(size_t count, std::uint64_t seed, int width = 96, int height = 64,
                     int sh_degree = 3) const {
        return random_scene({.count = count,
                             .width = width,
                             .height = height,
                             .kernel = kernel_,
                             .footprint = footprint_,
                             .sh_degree = sh_degree,
                             .seed = seed});
    }
    HardCase& add(const char* name, const char* what, TestScene scene) {
        cases_.push_back(make(name, what, std::move(scene)));
        cases_.back().gradient_tolerance = gradient_;
        return cases_.back();
    }
    Stage stage(int width = 48, int height = 32) const {
        return {kernel_, footprint_, width, height};
    }

    void projection();
    void parameters();
    void blending();
    void frames();

    int kernel_;
    Footprint footprint_;
    const char* gradient_ = "gradient_scaled_float32";
    std::vector<HardCase> cases_;
};

void Cases::projection() {
    Stage near = stage(96, 64);
    const float plane = static_cast<float>(NEAR_DEFAULT);
    const double depths[] = {-1,   0,    plane / 2, std::nextafter(plane, 0.0f), plane,
                             0.21, 0.25, 0.3,       std::nextafter(plane, 1.0f), 2};
    for (int i = 0; i < 80; ++i)
        near.add(4 + i * 7 % 88, 4 + i * 11 % 56, 2 + i % 3, 0.5, {shade(i, 2), 0.5f, shade(i, 5)},
                 depths[i % 10]);
    for (size_t a = 0; a < 3; ++a) near.scene.model.position[a] = 0;  // the camera's centre
    add("near_plane", "division by a depth of zero, fans", std::move(near.scene));

    TestScene wide = random(80, 102);
    wide.camera.cx *= 0.3;  // off-centre
    for (size_t i = 0; i < wide.model.position.size(); ++i) wide.model.position[i] *= 3;
    for (float& s : wide.model.log_scale) s += 1.2f;
    add("jacobian_clamp", "backward ignores the clamp; principal point ignored", std::move(wide));

    for (const bool disc : {false, true}) {
        TestScene thin = random(60, 103, 96, 64, 0);
        for (size_t i = 0; i < thin.model.size(); ++i)
            for (size_t a = 0; a < 3; ++a)
                thin.model.log_scale[3 * i + a] =
                    (a == 0) == disc ? (i % 3 == 0 ? -20.0f : -13.8f) : 0.0f;
        add(disc ? "discs" : "needles", "q negative or 5 % wrong", std::move(thin));
    }

    TestScene points = random(80, 104);
    for (size_t i = 0; i < points.model.log_scale.size(); ++i)
        points.model.log_scale[i] = -19.5f + 0.5f * static_cast<float>(i % 3);
    for (float& o : points.model.opacity_logit) o = 3;
    add("tiny_determinant", "infinite conic", std::move(points));

    TestScene far = random(80, 105);
    far.model.origin = {431'000.25, 5'412'000.5, 812.125};
    far.camera.translation -= far.camera.rotation * far.model.origin;
    add("map_coordinates", "float32 loses millimetres at 1e6", std::move(far));

    TestScene off = random(80, 105);  // float32 positions as in a file, seen from aslant
    const glm::dmat3 turn =
        glm::mat3_cast(glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3))));
    const glm::dvec3 centre = off.camera.centre(), away(9'000.3, -7'000.7, 8'000.9);
    for (size_t i = 0; i < off.model.size(); ++i) {
        const glm::dvec3 to_splat = position_of(off.model, i) - centre;
        for (int a = 0; a < 3; ++a)
            off.model.position[3 * i + static_cast<size_t>(a)] =
                static_cast<float>((turn * to_splat + away)[a]);
    }
    off.camera.rotation = off.camera.rotation * glm::transpose(turn);
    off.camera.translation = -(off.camera.rotation * away);
    add("floats_far_off", "the camera's rotation and translation cancel", std::move(off));
}

void Cases::parameters() {
    TestScene turned = random(60, 206);
    for (size_t i = 0; i < turned.model.size(); ++i) {
        const float norms[] = {0.05f, 1, 20};
        for (size_t a = 0; a < 4; ++a) turned.model.rotation[4 * i + a] *= norms[i % 3];
    }
    add("quaternion_norms", "gradient of the normalisation missing", std::move(turned));

    TestScene extreme = random(60, 107);
    for (size_t i = 0; i < extreme.model.size(); ++i) {
        const float factors[] = {0, 1e-15f, 1e-3f, 1e15f};
        if (i % 2 == 0)
            for (size_t a = 0; a < 4; ++a) extreme.model.rotation[4 * i + a] *= factors[i / 2 % 4];
    }
    add("quaternion_extremes", "NaN covariance", std::move(extreme)).gradient = false;

    TestScene limits = random(60, 108);
    for (size_t i = 0; i < limits.model.size(); ++i) {
        if (i % 4 == 0) limits.model.log_scale[3 * i] = -50;
        if (i % 12 == 1)
            for (size_t a = 0; a < 3; ++a) limits.model.log_scale[3 * i + a] = 50;
        if (i % 4 == 2) limits.model.opacity_logit[i] = 1e4f;
        if (i % 4 == 3) limits.model.opacity_logit[i] = -1e4f;
    }
    add("parameter_limits", "overflow of exp", std::move(limits));

    // A needle of ratio 1e9: its picture is right, but its gradients in float32 are not.
    TestScene longest = random(60, 108);
    for (size_t i = 0; i < longest.model.size(); i += 12) longest.model.log_scale[3 * i + 1] = 50;
    add("longest_needle", "overflow of exp", std::move(longest)).gradient = false;
}

void Cases::blending() {
    Stage centres = stage();
    for (int i = 0; i < 12; ++i)
        centres.add(4.5 + 3 * i, 8.5 + i % 4, 0.5 + 0.25 * i, 1, {0.9f, 0.5f, shade(i, 12)});
    add("mean_on_a_pixel_centre", "NaN in the raised cosine, transparent pixel in sinc",
        std::move(centres.scene));

    Stage opaque = stage();
    for (int i = 0; i < 2000; ++i)
        opaque.add(8 + i % 30, 8 + i % 16, 6, i % 2 ? 1e4 : logit(0.985),
                   {shade(i, 2), shade(i + 1, 2), 0.5f}, 2 + 0.001 * i);
    add("opaque_layers", "division by 1 - alpha, underflow of the transmittance",
        std::move(opaque.scene));

    Stage layers = stage(16, 16);
    for (int i = 0; i < 10'000; ++i)
        layers.add(8, 8, 30, logit(3e-4), {shade(i, 7), shade(i, 3), 0.5f}, 2 + 1e-4 * i);
    HardCase& thin =
        add("thin_layers", "prefix sums of the gradient 3 % wrong", std::move(layers.scene));
    thin.settings.alpha_cutoff = 1e-6f;
    thin.image_tolerance = "image_thin_layers";
    thin.gradient_tolerance = "gradient_thin_layers_walk";

    Stage list = stage(16, 16);
    for (int i = 0; i < 20'000; ++i)
        list.add(8, 8, 30, logit(1.5e-4), {shade(i, 7), shade(i, 3), 0.5f}, 2 + 1e-4 * i);
    HardCase& longest =
        add("long_list", "a driver ends long loops, the rest is missing", std::move(list.scene));
    longest.settings.alpha_cutoff = 1e-6f;
    longest.image_tolerance = "image_thin_layers";
    longest.gradient_tolerance = "gradient_thin_layers_walk";

    Stage ties = stage();
    for (int i = 0; i < 200; ++i)
        ties.add(6 + i * 7 % 36, 5 + i * 5 % 24, 3, 0.5, {shade(i, 2), 0.5f, shade(i, 3)});
    add("equal_depths", "image depends on the order in memory", std::move(ties.scene));

    Stage one = stage(700, 500);
    one.add(350, 250, 300, 3, {0.8f, 0.5f, 0.2f});
    one.add(20, 250, 3, 3, {0.1f, 0.9f, 0.2f});
    add("huge_splat", "time-out, overflow", std::move(one.scene));
}

void Cases::frames() {
    add("no_splats", "crash of densifiers", random(0, 109)).expects_splats = false;
    add("one_splat", "crash of densifiers", random(1, 110));
    TestScene away = random(30, 111);
    away.camera.translation.z = -30;
    add("none_visible", "crash of densifiers", std::move(away)).expects_splats = false;
    TestScene faint = random(30, 112);
    for (float& o : faint.model.opacity_logit) o = -8;
    add("all_too_faint", "crash of densifiers", std::move(faint)).expects_splats = false;
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 1024}, {1023, 3}, {17, 5}}) {
        TestScene odd = random(120, 113, 64, 64);
        odd.camera.cx += (width - 64) / 2.0;
        odd.camera.cy += (height - 64) / 2.0;
        odd.camera.width = width;
        odd.camera.height = height;
        add("odd_sizes", "reads and writes out of bounds", std::move(odd)).name +=
            fmt::format(" {}x{}", width, height);
    }
}

}  // namespace

std::vector<HardCase> hard_cases(int kernel, Footprint footprint) {
    return Cases(kernel, footprint).all();
}

// Runs the hard cases on the device and compares them with the reference.

namespace {

bool all_finite(const std::vector<float>& values) {
    for (const float v : values)
        if (!std::isfinite(v)) return false;
    return true;
}

bool all_finite(const DeviceWalk& walk) {
    for (const auto& d : walk.d)
        if (!all_finite(d)) return false;
    return all_finite(walk.image.data);
}

// The row nearest to its tolerance, or the first that failed.
Row worst_of(const std::vector<Row>& rows, const std::string& name) {
    Row worst = rows.front();
    const auto ratio = [](const Row& r) { return r.allowed > 0 ? r.error / r.allowed : 0; };
    for (const Row& row : rows) {
        if (!worst.pass) break;
        if (!row.pass || ratio(row) > ratio(worst)) worst = row;
    }
    worst.name = name + " (" + worst.name + ")";
    return worst;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kPoison[] = {kNan, kInfinity, -kInfinity, 1e38f, -1e38f};

// Adds n splats, each a copy of a healthy one with one poisoned parameter that must cull it.
SplatModel poisoned(const SplatModel& healthy, size_t n, std::uint64_t seed) {
    SplatModel m = healthy;
    m.resize(healthy.size() + n);
    Pcg32 rng(seed);
    for (size_t i = healthy.size(); i < m.size(); ++i) {
        const size_t twin = rng.below(static_cast<std::uint32_t>(healthy.size()));
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float>& values = attribute_values(m, a);
            const size_t stride = values.size() / m.size();
            for (size_t c = 0; c < stride; ++c) values[i * stride + c] = values[twin * stride + c];
        }
        if (!m.shape.empty() && i % 6 == 0) {  // infinite ones are clamped to their bounds
            m.shape[i] = kNan;
            continue;
        }
        const float poison = kPoison[rng.below(5)];
        switch (rng.below(5)) {
            case 0:
                m.position[3 * i + rng.below(3)] = poison;
                break;
            case 1:
                m.rotation[4 * i + rng.below(4)] = poison;
                break;
            case 2:
                m.sh_dc[3 * i + rng.below(3)] = std::isfinite(poison) ? 1e38f : kNan;
                break;
            case 3:
                m.opacity_logit[i] = rng.below(2) ? kNan : -1e38f;
                break;
            default:
                m.log_scale[3 * i + rng.below(3)] = kNan;
                break;
        }
    }
    return m;
}

// One row for each gradient.
std::vector<Row> gradient_rows(const WalkTruth& truth, const auto& got, const HardCase& c,
                               const std::string& group) {
    std::vector<Row> rows;
    for (int a = 0; a < kAttributeCount; ++a)
        if (!truth.d[a].empty())
            rows.push_back(compare_row(group, attribute_name(a), truth.d[a], got.d[a],
                                       c.gradient_tolerance, true));
    return rows;
}

// Where a pixel's transmittance is at the stop, within what float32 loses of it, one walk ends
// there and the other goes on, which moves the gradients of every splat in the pixel. So of the
// gradients between the truths with the stop a little lower and a little higher, the nearest.
WalkTruth nearest_truth(const HardCase& c, const Image<double>& weights, const WalkTruth& truth,
                        const DeviceWalk& walk) {
    constexpr float kStopRounding = 5e-6f;
    WalkTruth nearest = truth, low = truth, high = truth;
    for (const float shift : {-kStopRounding, kStopRounding}) {
        WalkSettings moved = c.settings;
        moved.transmittance_stop *= 1 + shift;
        const WalkTruth other = walk_in_double(c.scene.model, c.scene.camera, weights, moved);
        for (size_t a = 0; a < truth.d.size(); ++a)
            for (size_t i = 0; i < truth.d[a].size(); ++i) {
                low.d[a][i] = std::min(low.d[a][i], other.d[a][i]);
                high.d[a][i] = std::max(high.d[a][i], other.d[a][i]);
                nearest.d[a][i] = std::clamp<double>(walk.d[a][i], low.d[a][i], high.d[a][i]);
            }
    }
    return nearest;
}

}  // namespace

std::vector<Row> check_hard_case(Device& device, const HardCase& c, const std::string& group,
                                 bool float_alone) {
    const Image<double> weights = c.gradient ? random_weights(c.scene.camera) : Image<double>{};
    const DeviceWalk walk =
        walk_on_device(device, c.scene.model, c.scene.camera, weights, c.settings);
    const WalkTruth truth = walk_in_double(c.scene.model, c.scene.camera, weights, c.settings);
    std::vector<Row> rows;
    rows.push_back(
        compare_row(group, c.name + " image", truth.image, walk.image.data, c.image_tolerance));
    WalkTruth in_float;
    if (float_alone) {
        in_float = walk_in_float(c.scene.model, c.scene.camera, weights, c.settings);
        rows[0].float_alone =
            compare_row(group, "", truth.image, in_float.image, c.image_tolerance).error;
    }
    const bool seen = walk.status.visible > 0 && walk.status.intersections > 0;
    if (seen != c.expects_splats)
        rows.push_back(fact_row(group, c.name + " visible splats", false,
                                fmt::format("{} are visible", walk.status.visible)));
    if (!all_finite(walk))
        rows.push_back(fact_row(group, c.name + " finite", false, "values that are not finite"));
    if (!c.gradient || c.scene.model.size() == 0) return rows;
    if (walk.status.bad_gradients > 0)
        rows.push_back(fact_row(group, c.name + " gradients", false,
                                fmt::format("{} not finite", walk.status.bad_gradients)));
    const std::string name = c.name + " gradient";
    rows.push_back(worst_of(gradient_rows(truth, walk, c, group), name));
    if (!rows.back().pass)
        rows.back() =
            worst_of(gradient_rows(nearest_truth(c, weights, truth, walk), walk, c, group), name);
    if (float_alone)
        rows.back().float_alone = worst_of(gradient_rows(truth, in_float, c, group), "").error;
    return rows;
}

std::vector<Row> check_poison(Device& device, int kernel, const std::string& group) {
    const reference::TestScene scene = reference::random_scene(
        {.count = 300, .width = 96, .height = 64, .kernel = kernel, .sh_degree = 1, .seed = 120});
    const Image<double> weights = random_weights(scene.camera);
    const DeviceWalk clean = walk_on_device(device, scene.model, scene.camera, weights, {});
    const SplatModel sick = poisoned(scene.model, 300, 121);
    const DeviceWalk walk = walk_on_device(device, sick, scene.camera, weights, {});
    std::vector<Row> rows;
    rows.push_back(compare_row(group, "poisoned splats: image of the others", clean.image.data,
                               walk.image.data, "exact"));
    std::vector<float> before, after;
    for (int a = 0; a < kAttributeCount; ++a) {
        before.insert(before.end(), clean.d[a].begin(), clean.d[a].end());
        after.insert(after.end(), walk.d[a].begin(),
                     walk.d[a].begin() + static_cast<std::ptrdiff_t>(clean.d[a].size()));
    }
    rows.push_back(
        compare_row(group, "poisoned splats: gradients of the others", before, after, "exact"));

    Image<double> broken = weights;
    broken.data[broken.data.size() / 2] = std::numeric_limits<double>::quiet_NaN();
    const DeviceWalk bad = walk_on_device(device, scene.model, scene.camera, broken, {});
    bool finite = true;
    for (const auto& d : bad.d) finite = finite && all_finite(d);
    rows.push_back(fact_row(
        group, "NaN in the gradient of a pixel",
        finite && bad.status.bad_gradients > 0 && bad.status.bad_gradients < bad.status.visible,
        fmt::format("{} of {} splats counted as bad, gradients {}", bad.status.bad_gradients,
                    bad.status.visible, finite ? "finite" : "not finite")));
    return rows;
}

}  // namespace darb::check
