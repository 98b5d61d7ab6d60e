// SPDX-License-Identifier: MIT
#include "engine/check/run_checks.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "engine/check/device_walk.h"
#include "engine/check/hard_cases.h"
#include "engine/core/rng.h"
#include "engine/gpu/commands.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "engine/raster/kernel_constants.h"
#include "engine/raster/loss.h"
#include "engine/reference/reference_loss.h"
#include "engine/reference/splats.h"

namespace darb::check {

Row compare_row(const std::string& group, const std::string& name, std::span<const double> expected,
                std::span<const double> got, const reference::Tolerance& tolerance, bool scaled) {
    Row row;
    row.group = group;
    row.name = name;
    row.count = expected.size();
    if (expected.size() != got.size()) {
        row.detail = fmt::format("{} values expected, {} got", expected.size(), got.size());
        return row;
    }
    const reference::Tolerance allowed =
        scaled ? reference::scaled_tolerance(tolerance, expected) : tolerance;
    const reference::ComparisonStats stats = reference::comparison_stats(expected, got, allowed);
    row.detail = reference::comparison_failures(stats, allowed);
    row.pass = row.detail.empty();
    if (!row.pass && row.count > 0)
        row.detail +=
            fmt::format("\n  the worst is value {}: {} expected, {} got", stats.worst_index,
                        expected[stats.worst_index], got[stats.worst_index]);
    row.outside = stats.failures;
    row.band = reference::values_in_band(allowed, row.count);
    if (row.count == 0) return row;
    const double rms = scaled ? reference::root_mean_square(expected) : 0;
    const double unit = rms > 0 ? rms : 1;
    row.error = std::abs(got[stats.worst_index] - expected[stats.worst_index]) / unit;
    row.allowed = reference::allowed_error(expected[stats.worst_index], allowed) / unit;
    return row;
}

Row fact_row(const std::string& group, const std::string& name, bool holds,
             const std::string& detail) {
    Row row;
    row.group = group;
    row.name = name;
    row.count = 1;
    row.pass = holds;
    row.outside = holds ? 0 : 1;
    if (!holds) row.detail = "\n  " + detail;
    return row;
}

namespace {

struct Variant {
    int kernel;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
    int arithmetic = ARITHMETIC_FLOAT32;
};

// What a device can blend in half precision, of these kernels.
void add_half_variants(const Device& device, std::vector<Variant>& all) {
    if (!device.info().half_arithmetic) return;
    std::vector<Variant> halves;
    for (const Variant& v : all)
        if (has_half_blend(v.kernel) && v.footprint == Footprint::psi &&
            v.evaluation == EVALUATION_POLYNOMIAL)
            halves.push_back({v.kernel, v.footprint, v.evaluation, ARITHMETIC_FAST16});
    all.insert(all.end(), halves.begin(), halves.end());
}

std::vector<Variant> variants(bool every, std::optional<int> one = std::nullopt) {
    if (one) {
        std::vector<Variant> footprints{{*one}};
        if (has_exact_footprint(*one)) footprints.push_back({*one, Footprint::exact});
        return footprints;
    }
    if (!every)  // the paper's kernels, an exact footprint, the built-in exp, shapes
        return {{KERNEL_GAUSSIAN},
                {KERNEL_RAISED_COSINE},
                {KERNEL_HALF_COSINE_SQUARED},
                {KERNEL_SINC},
                {KERNEL_INVERSE_QUADRATIC},
                {KERNEL_RAISED_COSINE, Footprint::exact},
                {KERNEL_GAUSSIAN, Footprint::psi, EVALUATION_BUILTIN},
                {KERNEL_BETA},
                {KERNEL_GENERALIZED_EXPONENTIAL},
                {KERNEL_GES_PUBLISHED},
                {blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE)}};
    std::vector<Variant> all;
    std::vector<int> shaped = shaped_kernels();  // plus two blends: a smooth one, and one with a
                                                 // jump and a kink
    shaped.push_back(blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE));
    shaped.push_back(blend_of(KERNEL_SINC, KERNEL_INVERSE_QUADRATIC));
    for (const int kernel : shaped)
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            if (f == Footprint::psi || has_exact_footprint(kernel)) all.push_back({kernel, f});
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            for (const int e : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN})
                all.push_back({kernel, f, e});
    return all;
}

class Checks {
  public:
    explicit Checks(const OnRow& on_row) : on_row_(on_row) {}

    template <class Check>
    void run(const Check& check) {
        const auto start = std::chrono::steady_clock::now();
        std::vector<Row> rows = check();
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        for (Row& row : rows) {
            row.seconds = taken.count() / static_cast<double>(rows.size());
            if (on_row_) on_row_(row);
            rows_.push_back(std::move(row));
        }
    }
    std::vector<Row> take() { return std::move(rows_); }

  private:
    const OnRow& on_row_;
    std::vector<Row> rows_;
};

}  // namespace

std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row) {
    Checks checks(on_row);
    checks.run([&] { return check_kernels(device, options.kernel); });
    if (!options.kernel) {
        checks.run([&] { return check_scan_and_sort(device); });
        checks.run([&] { return check_loss(device); });
    }
    std::vector<Variant> walks = variants(options.every_kernel, options.kernel);
    add_half_variants(device, walks);
    for (const Variant& v : walks)
        checks.run([&] {
            return check_walk(device, v.kernel, v.footprint, v.evaluation, options.every_kernel,
                              v.arithmetic);
        });
    for (const Variant& v : options.every_kernel || options.kernel
                                ? variants(true, options.kernel)
                                : std::vector<Variant>{{KERNEL_RAISED_COSINE}}) {
        if (v.evaluation != EVALUATION_POLYNOMIAL) continue;
        const std::string group =
            fmt::format("hard cases, {} {}", kernel_name(v.kernel), footprint_name(v.footprint));
        for (const HardCase& c : hard_cases(v.kernel, v.footprint))
            checks.run([&] { return check_hard_case(device, c, group, options.every_kernel); });
        if (v.footprint == Footprint::psi)
            checks.run([&] { return check_poison(device, v.kernel, group); });
    }
    return checks.take();
}

// The parts of run_checks that are not whole walks: kernels, scan and sort, loss.

namespace {

constexpr double kCutoff = 1 / 255.0;
constexpr double kSlopeRounding = 2e-6;
// Rounding of shaders/kernels/sine.glsl, which rings use, and of the root of q before it.
constexpr double kRingRounding = 2e-6, kRingSlopeRounding = 1e-5;

// q over the support and just around its edge.
std::vector<KernelProbe> ramp(int kernel) {
    const double support = kernel_support(kernel);
    const double extent = std::isfinite(support) ? support : 20;
    std::vector<KernelProbe> probes;
    for (int i = 0; i < 4000; ++i) probes.push_back({static_cast<float>(extent * i / 4000), 1});
    for (const double off : {-1e-6, -1e-7, 0.0, 1e-7, 1e-6})
        probes.push_back({static_cast<float>(extent * (1 + off)), 1});
    return probes;
}

Row value_row(Device& device, int kernel, Footprint footprint, Row& slope_row) {
    const std::string name = fmt::format("{} {}", kernel_name(kernel), footprint_name(footprint));
    const KernelCoefficients& k = kernel_coefficients(kernel, footprint, kFullDegree);
    const std::vector<KernelProbe> probes = ramp(kernel);
    const auto answers = probe_kernel(device, kernel_constants(kernel, footprint), probes);
    const double support = std::isfinite(kernel_support(kernel)) ? kernel_support(kernel) : 1;
    std::vector<double> value, slope, got_value, got_slope;
    for (size_t i = 0; i < probes.size(); ++i) {
        const double q = probes[i].q, w = kernel_value(kernel, footprint, q);
        // A kernel with a jump may be on either side of its edge within the rounding of q.
        if (kernel_profile(kernel).edge_order != 0 || std::abs(q / support - 1) > 2e-7) {
            value.push_back(w);
            got_value.push_back(answers[i].value);
        }
        // Slopes that grow without bound at the edge matter only above the cut-off.
        if (w < kCutoff || (k.line_integral && 1 - q / support < 1e-3)) continue;
        if (std::abs(q / support - 1) < 2e-6) continue;
        slope.push_back(kernel_slope(kernel, footprint, q) * support);
        got_slope.push_back(answers[i].slope * support);
    }
    reference::Tolerance allowed;
    allowed.name = "kernel";
    const bool rings = k.form == KERNEL_FORM_RINGS;
    allowed.abs = 1.1 * k.value_error + (rings ? kRingRounding : float_rounding(k));
    const Row row = compare_row("kernels", name + " value", value, got_value, allowed);
    allowed.rel = rings ? kRingSlopeRounding : kSlopeRounding;
    allowed.abs = 1.2 * k.slope_error + allowed.rel;
    slope_row = compare_row("kernels", name + " slope", slope, got_slope, allowed);
    return row;
}

// Whether q is within rounding of an edge, or of a jump, of the kernel or the kernels it blends.
// There, and within a thousandth before the edge of a footprint that falls like a root, slopes are
// not compared.
bool near_edge(int kernel, double q, bool jumps) {
    const auto parts = blend_parts(kernel);
    for (const int k :
         parts ? std::vector<int>(parts->begin(), parts->end()) : std::vector{kernel}) {
        const double off = q / kernel_support(k) - 1;
        if (jumps ? ends_with_a_jump(k) && std::abs(off) < 2e-6
                  : std::abs(off) < 2e-6 || (ends_with_a_jump(k) && off < 2e-6 && off > -1e-3))
            return true;
    }
    return false;
}

// Checks a kernel with shapes at one exponent; the probes include the centre, the edge and both
// sides of it.
Row shaped_row(Device& device, int kernel, Footprint footprint, double exponent, Row& slope_row) {
    const std::vector<KernelProbe> probes = ramp(kernel);
    const auto answers = probe_kernel(device, kernel_constants(kernel, footprint), probes,
                                      static_cast<float>(exponent));
    const ShapedKernel& shaped = shaped_kernel(kernel);
    const double support = kernel_support(kernel), scale = std::isfinite(support) ? support : 1;
    std::vector<double> value, slope, got_value, got_slope;
    for (size_t i = 0; i < probes.size(); ++i) {
        const double q = probes[i].q;
        const ShapedValue truth = shaped.value(footprint, exponent, q);
        if (!near_edge(kernel, q, true)) {
            value.push_back(truth.w);
            got_value.push_back(answers[i].value);
        }
        if (near_edge(kernel, q, false)) continue;
        slope.push_back(truth.slope * scale);
        got_slope.push_back(answers[i].slope * scale);
    }
    reference::Tolerance allowed;
    allowed.name = "kernel";
    allowed.abs = shaped.rounding(exponent);
    if (!blend_parts(kernel))
        allowed.abs += 1.1 * kernel_coefficients(kernel, footprint, kFullDegree).value_error;
    const std::string name =
        fmt::format("{} {}, exponent {}", kernel_name(kernel), footprint_name(footprint), exponent);
    const Row row = compare_row("kernels", name + " value", value, got_value, allowed);
    allowed.rel = kSlopeRounding;
    allowed.abs *= std::max(exponent, 4.0);
    slope_row = compare_row("kernels", name + " slope", slope, got_slope, allowed);
    return row;
}

Row scan_row(Device& device, std::uint32_t n) {
    Pcg32 rng(n);
    std::vector<std::uint32_t> counts(n), expected(n);
    for (std::uint32_t& c : counts) c = rng.below(1000);
    std::exclusive_scan(counts.begin(), counts.end(), expected.begin(), 0u);
    Buffer in(device, "counts", n * 4u), out(device, "offsets", n * 4u), count(device, "n", 4),
        total(device, "total", 4);
    in.upload(counts);
    count.upload(std::vector<std::uint32_t>{n});
    Scan scan(device, n);
    Commands commands(device);
    commands.begin();
    scan.record(commands, in, out, count, 0, total);
    commands.submit_and_wait();
    return compare_row("scan and sort", fmt::format("scan of {}", n), expected,
                       out.download<std::uint32_t>(n), "exact");
}

Row sort_row(Device& device, std::uint32_t n, SortScatter scatter) {
    Pcg32 rng(n + 1);
    std::vector<std::uint32_t> keys(n), order(n);
    for (std::uint32_t& k : keys) k = rng.next() & 0xFF00FFu;  // many are equal
    std::iota(order.begin(), order.end(), 0u);
    Buffer key(device, "keys", n * 4u), value(device, "values", n * 4u), count(device, "n", 4);
    key.upload(keys);
    value.upload(order);
    count.upload(std::vector<std::uint32_t>{n});
    RadixSort sort(device, n, scatter);
    Commands commands(device);
    commands.begin();
    sort.record(commands, key, value, count, 0, 32);
    commands.submit_and_wait();
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    return compare_row(
        "scan and sort",
        fmt::format("stable sort of {}, {}", n, kSortScatters[static_cast<std::size_t>(scatter)]),
        order, value.download<std::uint32_t>(n), "exact");
}

}  // namespace

std::vector<Row> check_kernels(Device& device, std::optional<int> kernel) {
    std::vector<Row> rows;
    for (int k = kernel.value_or(0); k < (kernel ? *kernel + 1 : KERNEL_ROWS); ++k)
        for (const Footprint footprint : {Footprint::psi, Footprint::exact}) {
            if (footprint == Footprint::exact && !has_exact_footprint(k)) continue;
            Row slope;
            if (kernel_has_shape(k)) {
                for (const double exponent : shaped_kernel(k).exponents_to_check()) {
                    rows.push_back(shaped_row(device, k, footprint, exponent, slope));
                    rows.push_back(slope);
                }
                continue;
            }
            rows.push_back(value_row(device, k, footprint, slope));
            rows.push_back(slope);
        }
    return rows;
}

std::vector<Row> check_scan_and_sort(Device& device) {
    std::vector<Row> rows;
    for (const std::uint32_t n : {1u, 257u, 100'003u}) rows.push_back(scan_row(device, n));
    for (const std::uint32_t n : {1u, 4097u, 100'003u}) {
        for (std::size_t s = std::size(kSortScatters); s-- > 0;)
            rows.push_back(sort_row(device, n, static_cast<SortScatter>(s)));
    }
    return rows;
}

std::vector<Row> check_loss(Device& device) {
    constexpr int kWidth = 67, kHeight = 43;
    constexpr size_t kPixels = size_t{kWidth} * kHeight;
    Pcg32 rng(5);
    Image<double> image(kWidth, kHeight, 3), photo(kWidth, kHeight, 3);
    std::vector<float> planes(kPixels * 3);
    std::vector<std::uint32_t> packed(kPixels, 0xFF000000u);
    for (size_t p = 0; p < kPixels; ++p)
        for (size_t c = 0; c < 3; ++c) {
            const double wave = 0.5 + 0.4 * std::sin(0.21 * double(p % kWidth) + double(c));
            const std::uint32_t byte = static_cast<std::uint32_t>(
                std::lround(255 * std::clamp(wave + 0.1 * rng.normal(), 0.0, 1.0)));
            packed[p] |= byte << (8 * c);
            photo.data[p * 3 + c] = byte / 255.0;
            const auto x = static_cast<float>(wave + 0.15 * rng.normal());
            image.data[p * 3 + c] = x;
            planes[c * kPixels + p] = x;
        }
    const auto truth = reference::loss(image, photo);
    Buffer rendered(device, "image", kPixels * 12), ground(device, "photo", kPixels * 4),
        d_image(device, "d_image", kPixels * 12), result(device, "loss", sizeof(gpu::LossResult));
    rendered.upload(planes);
    ground.upload(packed);
    Loss loss(device, kWidth, kHeight);
    Commands commands(device);
    commands.begin();
    loss.record(commands, {rendered, ground, d_image, result}, kWidth, kHeight, glm::vec3(0));
    commands.submit_and_wait();
    const auto got = result.download<gpu::LossResult>(1)[0];
    const auto d = d_image.download<float>(kPixels * 3);
    std::vector<double> expected(kPixels * 3);
    for (size_t p = 0; p < kPixels; ++p)
        for (size_t c = 0; c < 3; ++c) expected[c * kPixels + p] = truth.d_image.data[p * 3 + c];
    return {compare_row("loss", "L1 and SSIM", std::vector<double>{truth.l1, truth.ssim},
                        std::vector<double>{got.l1, got.ssim}, "loss_float32"),
            compare_row("loss", "gradient", expected, d, "loss_gradient_float32")};
}

// The whole walk of a random scene, image and every gradient, against the reference.

namespace {

// A dense scene, but a sparse one where the kernel jumps at its edge, because there every pixel
// that rounding moves across the edge changes by a tenth of the opacity.
reference::TestScene walk_scene(int kernel, Footprint footprint) {
    if (footprint == Footprint::psi && kernel_profile(kernel).edge_order == 0)
        return reference::random_scene(
            {.count = 60, .width = 53, .height = 37, .kernel = kernel, .seed = 7});
    return reference::random_scene({.count = 300,
                                    .width = 121,
                                    .height = 83,
                                    .kernel = kernel,
                                    .footprint = footprint,
                                    .min_log_scale = -4,
                                    .max_log_scale = -1,
                                    .min_logit = -4,
                                    .max_logit = 5,
                                    .seed = 21});
}

}  // namespace

std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone, int arithmetic) {
    const reference::TestScene scene = walk_scene(kernel, footprint);
    WalkSettings settings;
    settings.evaluation = evaluation;
    settings.arithmetic = arithmetic;
    settings.background = {0.2f, 0.4f, 0.7f};
    const Image<double> weights = random_weights(scene.camera);
    const DeviceWalk walk = walk_on_device(device, scene.model, scene.camera, weights, settings);
    const WalkTruth truth = walk_in_double(scene.model, scene.camera, weights, settings);
    const std::string group =
        fmt::format("walk, {} {}{}{}", kernel_name(kernel), footprint_name(footprint),
                    evaluation == EVALUATION_BUILTIN ? ", built-in" : "",
                    arithmetic == ARITHMETIC_FAST16 ? ", fast16" : "");
    const bool steep = footprint == Footprint::exact && ends_with_a_jump(kernel);
    const bool half = arithmetic == ARITHMETIC_FAST16;
    const char* allowed = half    ? "gradient_scaled_fast16"
                          : steep ? "gradient_steep_float32"
                                  : "gradient_scaled_float32";
    const char* image_allowed = half ? "image_fast16" : "image_float32";
    // Rows for image, every gradient and the mean gradient, of the device or of the reference in
    // float.
    const auto compared = [&](const auto& image, const auto& got) {
        std::vector<Row> rows{compare_row(group, "image", truth.image, image, image_allowed)};
        for (int a = 0; a < kAttributeCount; ++a)
            if (!truth.d[static_cast<size_t>(a)].empty())
                rows.push_back(compare_row(group, std::string("d_") + attribute_name(a), truth.d[a],
                                           got.d[a], allowed, true));
        rows.push_back(compare_row(group, "mean gradient", truth.mean_gradient_ndc,
                                   got.mean_gradient_ndc, allowed, true));
        return rows;
    };
    std::vector<Row> rows = compared(walk.image.data, walk);
    if (float_alone) {
        const WalkTruth in_float = walk_in_float(scene.model, scene.camera, weights, settings);
        const std::vector<Row> alone = compared(in_float.image, in_float);
        for (size_t r = 0; r < rows.size(); ++r) rows[r].float_alone = alone[r].error;
    }
    const bool whole = walk.status.visible > scene.model.size() / 2 &&
                       walk.status.bad_gradients == 0 && walk.status.visible >= truth.visible &&
                       walk.status.visible <= truth.visible + 3;
    rows.push_back(
        fact_row(group, "visible splats", whole,
                 fmt::format("{} on the device with {} bad gradients, {} in double",
                             walk.status.visible, walk.status.bad_gradients, truth.visible)));
    return rows;
}

}  // namespace darb::check
