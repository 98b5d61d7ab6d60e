// SPDX-License-Identifier: MIT
#include "engine/plan/accuracy.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb {

namespace {

// Values of the evaluation; any other is the degree of the polynomial.
constexpr double kBuiltin = 0, kOfDevice = -1;
constexpr double kOfFile = -1;

constexpr AccuracyChoice kEvaluations[] = {{"auto", kOfDevice}, {"polynomial", kFullDegree},
                                           {"polynomial4", 4},  {"polynomial3", 3},
                                           {"polynomial2", 2},  {"builtin", kBuiltin}};
constexpr AccuracyChoice kFootprints[] = {
    {"file", kOfFile}, {"psi", FOOTPRINT_PSI}, {"exact", FOOTPRINT_EXACT}};
constexpr AccuracyChoice kCutoffs[] = {
    {"1/255", ALPHA_CUTOFF_DEFAULT}, {"1/1024", 1.0 / 1024}, {"1/64", 1.0 / 64}};
constexpr AccuracyChoice kStops[] = {{"1e-4", TRANSMITTANCE_STOP}, {"1e-6", 1e-6}, {"1e-2", 1e-2}};
constexpr AccuracyChoice kStorages[] = {{"float32", STORAGE_FLOAT32}, {"float16", STORAGE_FLOAT16}};
constexpr AccuracyChoice kDegrees[] = {{"file", kOfFile}, {"2", 2}, {"1", 1}, {"0", 0}, {"3", 3}};
constexpr AccuracyChoice kOrders[] = {{"centre", DEPTH_ORDER_CENTRE},
                                      {"centre16", DEPTH_ORDER_CENTRE16},
                                      {"pixel", DEPTH_ORDER_PIXEL, false}};
constexpr AccuracyChoice kProjections[] = {{"jacobian", PROJECTION_JACOBIAN},
                                           {"unscented", PROJECTION_UNSCENTED},
                                           {"auto", PROJECTION_AUTO}};
constexpr AccuracyChoice kArithmetics[] = {{"float32", ARITHMETIC_FLOAT32},
                                           {"fast16", ARITHMETIC_FAST16}};
constexpr AccuracyChoice kScales[] = {{"1", 1}, {"1/2", 0.5, false}};

// The presets are choices of index: {fast, balanced, exact}.
constexpr AccuracySetting kSettings[kAccuracyCount] = {
    {"evaluation",
     "how w(q) is computed: polynomials of falling degree, or exp, sin and cos; auto: the "
     "polynomial, or exp where this device's is accurate and faster",
     kEvaluations,
     {3, 0, 1},
     ""},
    {"footprint",
     "psi: the paper's; exact: the kernel's true projection; file: as it was trained",
     kFootprints,
     {0, 0, 0},
     ""},
    {"alpha_cutoff", "alpha below it is dropped", kCutoffs, {2, 0, 1}, ""},
    {"transmittance_stop",
     "a pixel ends before its transmittance falls below it",
     kStops,
     {0, 0, 1},
     ""},
    {"storage", "of the projected splats' colour, opacity and shape", kStorages, {1, 0, 0}, ""},
    {"sh_degree", "highest degree of view-dependent colour", kDegrees, {0, 0, 0}, ""},
    {"depth_order",
     "centre: 32-bit depth of the centres; centre16: 16-bit keys; pixel: resorted at each pixel",
     kOrders,
     {1, 0, 0},
     "Pictures of the result can be resorted: darb render --depth-order pixel."},
    {"render_scale",
     "1/2: rendered at half the size and upsampled",
     kScales,
     {0, 0, 0},
     "Train on smaller photos: -r 2."},
    {"splat_projection",
     "jacobian: a splat's shape by the camera's slope at its centre; unscented: by sigma points; "
     "auto: by these where the slope changes within the splat",
     kProjections,
     {0, 0, 0},
     ""},
    {"arithmetic",
     "of both blends; fast16: a splat's alpha in half precision, sums in float32",
     kArithmetics,
     {0, 0, 0},
     ""},
};
constexpr std::string_view kPresets[kPresetCount] = {"fast", "balanced", "exact"};

}  // namespace

std::span<const AccuracySetting> accuracy_settings() {
    return kSettings;
}

std::string_view preset_name(int preset) {
    return kPresets[preset];
}

std::optional<int> preset_from_name(std::string_view name) {
    const auto found = std::find(std::begin(kPresets), std::end(kPresets), name);
    if (found == std::end(kPresets)) return std::nullopt;
    return static_cast<int>(found - std::begin(kPresets));
}

int preset_of_option(std::string_view name) {
    const auto preset = preset_from_name(name);
    if (!preset)
        throw Error(fmt::format("--accuracy {}", name), "no such preset",
                    "Use fast, balanced or exact.");
    return *preset;
}

std::string accuracy_help(const AccuracySetting& setting) {
    std::string names;
    for (const AccuracyChoice& choice : setting.choices)
        names += fmt::format("{}{}", names.empty() ? "" : ", ", choice.name);
    return fmt::format("{} [{}]", setting.what, names);
}

std::string accuracy_flag(const AccuracySetting& setting) {
    std::string flag = "--" + std::string(setting.name);
    std::replace(flag.begin(), flag.end(), '_', '-');
    return flag;
}

const AccuracyChoice& Accuracy::of(int setting) const {
    if (setting < 0 || setting >= kAccuracyCount)
        throw Error("accuracy", fmt::format("no setting {}", setting), "See AccuracySettingId.");
    return kSettings[setting].choices[static_cast<size_t>(choice[setting])];
}

Accuracy preset_accuracy(int preset, bool training) {
    Accuracy accuracy;
    for (int s = 0; s < kAccuracyCount; ++s) {
        accuracy.choice[s] = kSettings[s].preset[preset];
        if (training && !accuracy.of(s).in_training) accuracy.choice[s] = 0;
    }
    return accuracy;
}

int find_choice(int setting, std::string_view name, bool training) {
    const AccuracySetting& row = kSettings[setting];
    const std::string where = fmt::format("{} {}", accuracy_flag(row), name);
    std::string names;
    for (size_t i = 0; i < row.choices.size(); ++i) {
        const AccuracyChoice& choice = row.choices[i];
        if (choice.name == name) {
            if (training && !choice.in_training)
                throw Error(where, "has no backward pass: it is for pictures only",
                            std::string(row.training_remedy));
            return static_cast<int>(i);
        }
        if (training && !choice.in_training) continue;
        names += fmt::format("{}{}", names.empty() ? "" : ", ", choice.name);
    }
    throw Error(where, "no such choice", "Use one of: " + names + ".");
}

std::string accuracy_text(const Accuracy& accuracy) {
    std::string best;
    size_t fewest = kAccuracyCount + 1;
    for (const int preset : {int(kBalanced), int(kFast), int(kExact)}) {
        const Accuracy base = preset_accuracy(preset);
        std::string text = preset == kBalanced ? "" : std::string(kPresets[preset]);
        size_t differences = preset == kBalanced ? 0 : 1;
        for (int s = 0; s < kAccuracyCount; ++s) {
            if (base.choice[s] == accuracy.choice[s]) continue;
            ++differences;
            text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kSettings[s].name,
                                accuracy.of(s).name);
        }
        if (differences >= fewest) continue;
        fewest = differences;
        best = text;
    }
    return best.empty() ? std::string(kPresets[kBalanced]) : best;
}

bool has_builtin_evaluation(int kernel) {
    if (blend_parts(kernel)) return false;
    if (kernel_profile(kernel).form != KERNEL_FORM_COMPACT) return true;
    return kernel < KERNEL_COUNT && kernel != KERNEL_PARABOLIC;
}

bool changes_evaluation(const Device& device, const Accuracy& accuracy, int kernel) {
    ForwardOptions own, usual;
    own.kernel = usual.kernel = kernel;
    set_options(accuracy, own);
    set_options({}, usual);
    return own.polynomial_degree != usual.polynomial_degree ||
           evaluation_on(device, own) != evaluation_on(device, usual);
}

void set_options(const Accuracy& accuracy, ForwardOptions& options) {
    const double evaluation = accuracy.value(kEvaluation);
    options.evaluation = evaluation == kBuiltin    ? EVALUATION_BUILTIN
                         : evaluation == kOfDevice ? kEvaluationOfDevice
                                                   : EVALUATION_POLYNOMIAL;
    options.polynomial_degree = evaluation > kBuiltin ? static_cast<int>(evaluation) : kFullDegree;
    options.alpha_cutoff = static_cast<float>(accuracy.value(kAlphaCutoff));
    options.transmittance_stop = static_cast<float>(accuracy.value(kTransmittanceStop));
    options.storage = static_cast<int>(accuracy.value(kStorage));
    options.depth_order = static_cast<int>(accuracy.value(kDepthOrder));
    options.projection = static_cast<int>(accuracy.value(kSplatProjection));
    options.arithmetic = static_cast<int>(accuracy.value(kArithmetic));
}

FrameAccuracy frame_accuracy(const Accuracy& accuracy, const SplatModel& model) {
    FrameAccuracy frame;
    set_options(accuracy, frame.options);
    const double footprint = accuracy.value(kFootprint), degree = accuracy.value(kShDegree);
    frame.footprint = footprint == kOfFile ? model.footprint : static_cast<Footprint>(footprint);
    frame.sh_degree =
        degree == kOfFile ? model.sh_degree : std::min(static_cast<int>(degree), model.sh_degree);
    frame.halved = accuracy.value(kRenderScale) < 1;
    frame.options.kernel = model.kernel;
    frame.options.footprint = frame.footprint;
    frame.options.effects.antialias = model.antialias;
    return frame;
}

}  // namespace darb
