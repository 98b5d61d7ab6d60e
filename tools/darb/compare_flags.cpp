// The command line of `darb compare`, and that of each of its runs.
#include "tools/darb/compare_flags.h"
#include "tools/darb/evaluation_flags.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "tools/darb/kernel_flags.h"
#include "tools/darb/numbers.h"
#include "tools/darb/outputs.h"
#include "tools/darb/train_flags.h"
#include "trainer/options/strategy.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

/// An option that goes to `darb train` as it is.
void forward(CLI::App& command, CompareFlags& flags, const std::string& names,
             const std::string& word, const std::string& help) {
    command.add_option_function<std::string>(
        names,
        [&flags, word](const std::string& value) { flags.forwarded.push_back(word + "=" + value); },
        help);
}

}  // namespace

void add_compare_flags(CLI::App& command, CompareFlags& flags) {
    command.add_option("datasets", flags.datasets,
                       "as darb train takes them; PATH@images_4 for its own photo folder");
    command.add_option("-o,--output", flags.output,
                       "folder of the runs, OUT/DATASET/KERNEL/seedN: finished ones are kept");
    command
        .add_option("--kernels", flags.kernels,
                    "paper (its five), all (nine), or names and expressions with commas")
        ->capture_default_str();
    add_kernel_file_flag(command, flags.kernel_files);
    command
        .add_option("--pulses", flags.pulses,
                    "of raised_cosine and sinc, with commas: 1,2,3 tests what rings cost and gain")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(1, KERNEL_MAX_PULSES));
    command.add_option("--iterations", flags.iterations, "evaluate after these, with commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000'000));
    command.add_option("--seeds", flags.seeds, "runs of each")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    command.add_option("--max-splats", flags.max_splats, "growth stops there: equal count")
        ->check(above_zero());
    forward(command, flags, "-r,--resolution", "--resolution", "as in darb train");
    add_scales_flag(command, flags.scales);
    forward(command, flags, "--hold-out", "--hold-out", "as in darb train");
    forward(command, flags, "-i,--images", "--images", "as in darb train");
    forward(command, flags, "--effects", "--effects", "as in darb train");
    forward(command, flags, "--footprint", "--footprint", "psi or exact");
    forward(command, flags, "--strategy", "--strategy", strategy_names());
    command.add_option("--train-options", flags.train_options,
                       "more options of darb train, as one word in quotes");
    command
        .add_option("--lpips", flags.lpips,
                    "safetensors with the weights of AlexNet or VGG16 and of LPIPS's layers; once "
                    "for each file")
        ->allow_extra_args(false);
    command.add_flag("--lpips-as-3dgs", flags.lpips_as_3dgs,
                     "colours from 0 to 1 into LPIPS, as published numbers of splats have it");
    command.add_option("--blending-views", flags.blending_views, "to count and time; 0: none")
        ->capture_default_str()
        ->check(zero_or_more());
    command.add_option("--html", flags.html, "default OUT/compare.html");
    command.add_option("--json", flags.json, "default OUT/compare.json; - is stdout");
    command.add_option("--device", flags.device, "number or part of a name, see `darb devices`");
    add_quiet_flag(command, flags.quiet);
}

std::vector<int> kernels_of(const CompareFlags& flags) {
    std::vector<int> rows;
    for (const int kernel : kernels_from_list("--kernels", flags.kernels, flags.kernel_files))
        for (const int pulses : flags.pulses)
            if (const auto row = kernel_with_pulses(kernel, pulses);
                row && std::find(rows.begin(), rows.end(), *row) == rows.end())
                rows.push_back(*row);
    if (rows.empty())
        throw Error("--pulses", "none of the kernels has so many",
                    "raised_cosine and sinc have 1 to 3 pulses, the others one.");
    return rows;
}

std::string dataset_path(const std::string& dataset) {
    return fs::exists(dataset) ? dataset : dataset.substr(0, dataset.rfind('@'));
}

std::string dataset_name(const std::string& dataset) {
    const auto path = fs::absolute(dataset_path(dataset)).lexically_normal();
    return (path.has_filename() ? path : path.parent_path()).filename().string();
}

TrainRequest train_request_of(const CompareFlags& flags, const std::string& dataset, int kernel,
                              std::uint64_t seed) {
    const std::string name(kernel_name(kernel)), path = dataset_path(dataset);
    const auto folder = flags.output / dataset_name(dataset) / name / fmt::format("seed{}", seed);
    std::vector<std::string> words{path, "-o", folder.string(), "--eval"};
    words.push_back("--kernel=" + std::string(kernel_name(*kernel_with_pulses(kernel, 1))));
    words.push_back(fmt::format("--pulses={}", kernel_pulses(kernel)));
    words.push_back(fmt::format("--seed={}", seed));
    words.push_back(fmt::format("--iterations={}", flags.iterations.back()));
    for (const char* list : {"--test-iterations", "--save-iterations"}) {
        words.push_back(list);
        for (const int i : flags.iterations) words.push_back(std::to_string(i));
    }
    const bool own_images = path.size() < dataset.size();
    if (own_images) words.push_back("--images=" + dataset.substr(path.size() + 1));
    for (const std::string& word : flags.forwarded)
        if (!own_images || !word.starts_with("--images=")) words.push_back(word);
    return parse_train_words(std::move(words), flags.train_options, "darb compare");
}

}  // namespace darb
