// darb convert IN OUT: another format, frame, kernel, degree or part of a scene.

#include <fmt/format.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/scene/gaussian_scene.h"
#include "tools/darb/command_list.h"
#include "tools/darb/compare_scenes.h"
#include "tools/darb/convert_levels.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/page_output.h"
#include "tools/darb/palette_device.h"
#include "tools/darb/scene_edits.h"
#include "tools/darb/scene_file.h"

namespace darb {

namespace {

struct ConvertFlags {
    std::filesystem::path input, output, cameras;
    std::string kernel, device;
    SceneEdits edits;
    EncodeOptions encode;
    LevelFlags levels;
    PageFlags page;
    bool compare = false, quiet = false;
};

std::vector<View> views_for(const SplatModel& scene, const ConvertFlags& flags) {
    return flags.cameras.empty() ? views_around(scene) : named_views(flags.cameras);
}

void print_difference(std::FILE* say, const char* what, const SplatModel& scene,
                      const SplatModel& other, const ConvertFlags& flags) {
    const std::vector<View> views = views_for(scene, flags);
    tell(say, "{}: {}\n", what,
         difference_text(compare_scenes(scene, other, views, flags.device), views.size()));
}

EncodedSplats write_scene(const std::filesystem::path& output, SplatFormat format,
                          SplatModel& model, const Paths& inputs, const ConvertFlags& flags,
                          std::vector<SplatModel> coarser = {}) {
    for (const std::string& loss : losses_of(format, model, output.string()))
        darb::say("warning: {}: {}\n", output.string(), loss);
    drop_unwritable(format, model);
    PaletteDevice palettes(flags.device);
    EncodeOptions options = flags.encode;
    options.assign_rows = palettes.assign_rows();
    for (SplatModel& level : coarser) drop_unwritable(format, level);
    options.coarser = std::move(coarser);
    EncodedSplats encoded = encode_scene(format, model, output.string(), options);
    refuse_to_overwrite_inputs(outputs_of(output, encoded), inputs);
    write_encoded(output, encoded);
    return encoded;
}

int convert(const ConvertFlags& flags) {
    check_level_options(flags.levels);
    const Paths inputs =
        together({files_of(flags.input), files_of(flags.cameras), files_of(flags.levels.refine)});
    refuse_to_overwrite_inputs({flags.output}, inputs);
    const std::optional<SplatFormat> format = format_to_write(flags.output);
    if (!format && !is_page(flags.output))
        throw Error(flags.output.string(), "names no format that can be written",
                    "Let it end in .html, " + endings_to_write() + ".");
    check_page_options(flags.page, flags.output);
    if (flags.encode.spz_version != EncodeOptions{}.spz_version && format != SplatFormat::spz)
        throw Error("--spz-version", "is for files that end in .spz", "Leave it out.");
    SplatModel model = load_scene(flags.input);
    std::FILE* const say = flags.quiet ? nullptr : stream_beside(flags.output);
    edit_scene(flags.edits, model, say);
    if (flags.kernel == "gaussian" && model.kernel != KERNEL_GAUSSIAN) {
        GaussianEquivalent fit{};
        const SplatModel gaussians = as_gaussians(model, false, &fit);
        tell(say,
             "kernel {} to gaussian: covariance x {:.4f}, opacity x {:.4f}, profile off by "
             "{:.2f} % (relative L2)\n",
             kernel_name(model.kernel), fit.covariance, fit.opacity, 100 * fit.error);
        print_difference(say, "renders of both kernels", model, gaussians, flags);
        model = gaussians;
    }
    if (is_page(flags.output)) {
        if (flags.levels.asked()) throw Error("web page", "has one level", "See --max-size.");
        return convert_to_page(model, flags.page, flags.input, flags.cameras, flags.output,
                               flags.device, say);
    }
    if (flags.levels.asked()) {
        const auto write = [&](const std::filesystem::path& file, SplatModel& level,
                               std::vector<SplatModel> coarser) {
            return write_scene(file, *format, level, inputs, flags, std::move(coarser));
        };
        const LevelOutput to{flags.output, *format, views_for(model, flags),
                             flags.device, say,     write};
        tell_paths(flags.quiet, write_levels(flags.levels, model, to));
        return 0;
    }
    const auto losses = losses_of(*format, model, flags.output.string());
    const EncodedSplats encoded = write_scene(flags.output, *format, model, inputs, flags);
    tell(say, "{}: {}, {} splats, {} bytes\n", flags.output.string(), format_name(*format),
         model.size(), encoded.bytes());
    // What is lost is said in dB, too.
    if (flags.compare || (say != nullptr && model.size() > 0 && !losses.empty()))
        print_difference(say, "the file against the scene", model,
                         encoded.beside.empty() ? parse_splats(encoded.file, flags.output.string())
                                                : load_splats(flags.output),
                         flags);
    tell_paths(say == nullptr && stream_beside(flags.output) == stdout, {flags.output});
    return 0;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
    auto flags = std::make_shared<ConvertFlags>();
    CLI::App* command = app.add_subcommand(
        "convert", "Write a scene in another format, frame, kernel, degree, or a part of it");
    command->add_option("input", flags->input, "splat file, or the output folder of darb train")
        ->required();
    command->add_option("output", flags->output, "ends in .html, " + endings_to_write())
        ->required();
    command
        ->add_option("--kernel", flags->kernel,
                     "gaussian: the nearest Gaussians; prints how far renders of both differ")
        ->check(CLI::IsMember({"gaussian"}));
    add_edit_options(*command, flags->edits);
    command
        ->add_option("--spz-version", flags->encode.spz_version,
                     "3: one gzip stream, which more programs read")
        ->check(CLI::IsMember({3, 4}))
        ->capture_default_str();
    add_level_options(*command, flags->levels);
    add_page_options(*command, flags->page);
    command->add_flag("--compare", flags->compare, "print how far renders of the file differ");
    command->add_option("--cameras", flags->cameras,
                        "cameras of the comparisons and of a web page, as darb render takes them "
                        "(default: 8 around the scene)");
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_quiet_flag(*command, flags->quiet);
    command->callback([flags, &action] { action = [flags] { return convert(*flags); }; });
}

}  // namespace darb
