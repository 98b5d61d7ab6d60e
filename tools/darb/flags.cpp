// SPDX-License-Identifier: MIT
#include "tools/darb/flags.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_family.h"
#include "engine/scene/splat_model.h"
#include "trainer/job/request_options.h"

namespace darb {

void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags) {
    command.add_option("--accuracy", flags.preset, request_option("--accuracy").row.help)
        ->group(option_group::kAccuracy);
    for (int s = 0; s < kAccuracyCount; ++s) {
        const AccuracySetting& setting = accuracy_settings()[static_cast<size_t>(s)];
        command
            .add_option(accuracy_flag(setting), flags.choice[static_cast<size_t>(s)],
                        accuracy_help(setting))
            ->group(option_group::kAccuracy);
    }
}

Accuracy chosen_accuracy(const AccuracyFlags& flags) {
    Accuracy accuracy =
        preset_accuracy(flags.preset.empty() ? int{kBalanced} : preset_of_option(flags.preset));
    for (int s = 0; s < kAccuracyCount; ++s) {
        const std::string& name = flags.choice[static_cast<size_t>(s)];
        if (!name.empty()) accuracy.choice[s] = find_choice(s, name);
    }
    return accuracy;
}

void note_unused_choices(const AccuracyFlags& flags, int kernel) {
    if (flags.choice[kEvaluation] == "builtin" && !has_builtin_evaluation(kernel))
        say_note(fmt::format("note: --evaluation builtin is not used: {} has polynomials only",
                             kernel_name(kernel)));
    if (flags.choice[kArithmetic] == "fast16" && !has_half_blend(kernel))
        say_note(
            fmt::format("note: --arithmetic fast16 is not used: {} has no form in half "
                        "precision, only gaussian and ges_published have",
                        kernel_name(kernel)));
}

void add_effects_flag(CLI::App& command, std::string& text) {
    command.add_option("--effects", text, request_option("--effects").row.help)
        ->capture_default_str();
}

void add_lens_flag(CLI::App& command, DatasetOptions& data) {
    const RequestOption& lens = request_option("--lens");
    data.original_where_wide = true;
    command
        .add_option_function<std::string>(
            "--lens",
            [&data](const std::string& text) {
                data.original_lens = text == "original";
                data.original_where_wide = text == "auto";
            },
            lens.row.help)
        ->check(CLI::IsMember({"auto", "undistort", "original"}))
        ->default_str(lens.row.usual);
}

CLI::Option* add_kernel_file_flag(CLI::App& command, std::vector<std::filesystem::path>& files) {
    return command.add_option("--kernel-file", files, request_option("--kernel-file").row.help)
        ->allow_extra_args(false);
}

void add_kernel_flags(CLI::App& command, KernelFlags& flags, const std::string& help,
                      const std::string& group) {
    command.add_option("--kernel", flags.kernel, help)->group(group);
    add_kernel_file_flag(command, flags.files)->group(group);
}

std::vector<int> kernels_of_files(const std::vector<std::filesystem::path>& files) {
    std::vector<int> kernels;
    std::vector<std::string> notes;
    for (const std::filesystem::path& path : files)
        for (const int kernel : kernels_of_file(path, notes)) kernels.push_back(kernel);
    say_notes(notes);
    return kernels;
}

std::optional<int> chosen_kernel(const KernelFlags& flags) {
    const std::vector<int> of_files = kernels_of_files(flags.files);
    if (flags.kernel.empty())
        return of_files.empty() ? std::nullopt : std::optional(of_files.back());
    std::vector<std::string> notes;
    const int kernel = kernel_of_option(flags.kernel, notes);
    say_notes(notes);
    return kernel;
}

SplatModel in_kernel(const KernelFlags& flags, SplatModel model) {
    set_kernel(model, chosen_kernel(flags).value_or(model.kernel));
    if (!has_exact_footprint(model.kernel)) model.footprint = Footprint::psi;
    return model;
}

std::vector<int> kernels_from_list(const std::string& option, const std::string& list,
                                   const std::vector<std::filesystem::path>& files) {
    std::vector<int> kernels;
    const auto add = [&](int kernel) {
        if (std::find(kernels.begin(), kernels.end(), kernel) == kernels.end())
            kernels.push_back(kernel);
    };
    const std::vector<int> of_files = kernels_of_files(files);
    for (const std::string& item : split_kernel_list(list)) {
        const bool whole = item == "all" || item == "paper";
        const int count = item == "all" ? KERNEL_COUNT : KERNEL_INVERSE_QUADRATIC + 1;
        for (int kernel = 0; kernel < count && whole; ++kernel) add(kernel);
        std::vector<std::string> notes;
        if (!whole) add(kernel_of_word(option, item, notes));
        say_notes(notes);
    }
    for (const int kernel : of_files) add(kernel);
    if (kernels.empty()) throw Error(option, "names no kernel", "Write all, or names with commas.");
    return kernels;
}

Dataset off_path_of(const std::filesystem::path& dataset, const DatasetOptions& options) {
    const std::filesystem::path folder = dataset / "off_path";
    if (!std::filesystem::exists(folder / "transforms_test.json")) return {};
    DatasetOptions own = options;
    own.images_folder = DatasetOptions{}.images_folder;  // --images is about the data set's photos
    own.held_out = {};
    return load_dataset(folder, own);
}

CLI::Option* add_hold_out_flag(CLI::App& command, DatasetOptions& data) {
    return command
        .add_option_function<std::string>(
            "--hold-out",
            [&data](const std::string& text) {
                data.held_out = parse_hold_out(text);
                data.hold_out = true;
            },
            request_option("--hold-out").row.help)
        ->default_str(request_option("--hold-out").row.usual);
}

CLI::Option* add_depth_scale_flag(CLI::App& command, DatasetOptions& data) {
    const OptionRow& row = request_option("--depth-scale").row;
    return command.add_option(row.flags, data.depth_scale, row.help)
        ->default_str(row.usual)
        ->check(CLI::Range(row.least, row.most));
}

CLI::Option* add_scales_flag(CLI::App& command, std::vector<double>& scales) {
    return command
        .add_option("--scales", scales,
                    "sizes to measure at, as multiples of the size of -r, with commas: 0.5,1,2,4")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(0.01, 100.0));
}

namespace {

template <class Value>
void add_unit_option(CLI::App& command, const char* name, Value& to,
                     const std::map<std::string, Value>& words, const char* help) {
    std::vector<std::string> known;
    for (const auto& word : words) known.push_back(word.first);
    command
        .add_option_function<std::string>(
            name, [&to, words](const std::string& word) { to = words.at(word); }, help)
        ->check(CLI::IsMember(known))
        ->group("Files that store splats in another way than their format");
}

}  // namespace

void add_unit_options(CLI::App& command, StoredUnits& units, bool with_scales) {
    if (with_scales)
        add_unit_option<StoredScales>(
            command, "--scales", units.scales,
            {{"linear", StoredScales::linear}, {"logarithms", StoredScales::logarithms}},
            "what the file stores as scales: lengths, or their logarithms");
    add_unit_option<StoredOpacities>(
        command, "--opacities", units.opacities,
        {{"linear", StoredOpacities::linear}, {"bytes", StoredOpacities::bytes}},
        "what the file stores as opacities: 0 to 1, or 0 to 255");
    add_unit_option<StoredColours>(
        command, "--colours", units.colours,
        {{"rgb", StoredColours::rgb}, {"bytes", StoredColours::bytes}},
        "what the file stores as f_dc: red, green and blue, 0 to 1 or 0 to 255");
    add_unit_option<StoredRotations>(command, "--rotations", units.rotations,
                                     {{"xyzw", StoredRotations::xyzw}},
                                     "xyzw: the number w of a rotation comes last");
    add_unit_option<StoredOrder>(command, "--harmonics", units.harmonics,
                                 {{"swapped", StoredOrder::swapped}},
                                 "swapped: f_rest has the channels of a coefficient side by side, "
                                 "or, in formats that do so anyway, the coefficients of a channel");
    command
        .add_option("--lod", units.level,
                    "of a streamed SOG or LCC scene: the level of detail to read")
        ->default_str("0, the finest")
        ->check(CLI::Range(0, 63));
}

PixelSize parse_size(const std::string& text) {
    PixelSize size;
    const char* end = text.data() + text.size();
    const auto [x, error] = parse_number(text.data(), end, size.width);
    const bool has_x = error == std::errc() && x != end && *x == 'x';
    const auto last = has_x ? parse_number(x + 1, end, size.height) : std::from_chars_result{};
    const bool whole = has_x && last.ec == std::errc() && last.ptr == end;
    if (!whole || size.width < 16 || size.height < 16 || size.width > 16384 || size.height > 16384)
        throw Error("--size", "'" + text + "' is no size", "Write WIDTHxHEIGHT, 16 to 16384 px.");
    return size;
}

namespace {

// Whether the whole text is a number that becomes infinity in float32.
bool beyond_float(const std::string& value) {
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    return end != value.c_str() && *end == '\0' &&
           std::abs(number) > std::numeric_limits<float>::max();
}

}  // namespace

void refuse_empty_values(const std::vector<std::string>& arguments) {
    for (size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        const bool ends_empty = argument.starts_with("--") && argument.ends_with('=');
        if (ends_empty || (argument.empty() && i > 0 && arguments[i - 1].starts_with('-')))
            throw Error(ends_empty ? argument.substr(0, argument.size() - 1) : arguments[i - 1],
                        "has an empty value", "Give a value, or leave the option out.");
    }
}

namespace {

// Whether CLI11 itself parses the option as a number; options that are text to it parse their own
// numbers.
bool is_number(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    return type.starts_with("FLOAT") || type.starts_with("INT") || type.starts_with("UINT");
}

// Checks that a number is above 0, or with `zero` at least 0.
CLI::Validator number_from(bool zero, const std::string& name) {
    return CLI::Validator(
        [zero](const std::string& given) {
            char* end = nullptr;
            const double number = std::strtod(given.c_str(), &end);
            const bool whole = end != given.c_str() && *end == '\0';
            if (whole && (number > 0 || (zero && number == 0) || std::isnan(number)))
                return std::string();
            return fmt::format("{} is not a number {}", given, zero ? "of at least 0" : "above 0");
        },
        name);
}

}  // namespace

CLI::Validator above_zero() {
    return number_from(false, "POSITIVE");
}

CLI::Validator zero_or_more() {
    return number_from(true, "NONNEGATIVE");
}

void refuse_no_numbers(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
        if (!is_number(*option)) continue;
        for (const std::string& given : option->results()) {
            std::string value = lower(given);
            if (value.starts_with('-') || value.starts_with('+')) value.erase(0, 1);
            if (value == "nan" || value == "inf" || value == "infinity" || beyond_float(value))
                throw Error(option->get_name() + " " + given, "is no number that it can take",
                            "Give a finite number.");
        }
    }
    for (const CLI::App* command : app.get_subcommands()) refuse_no_numbers(*command);
}

}  // namespace darb
