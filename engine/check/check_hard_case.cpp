// Runs the hard cases on the device and compares them with the reference.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/check/hard_cases.h"
#include "engine/check/walk_truth.h"
#include "engine/core/rng.h"

namespace darb::check {

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

// Of several rows the one nearest to its tolerance, or the first that failed.
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

// n splats more, each a copy of a healthy one with one poisoned parameter that must cull it.
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
        if (!m.shape.empty() && i % 6 == 0) {  // infinite ones are held at their bounds
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

// Every gradient as a row.
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
