// SPDX-License-Identifier: MIT
// darb convert IN OUT: writes a scene, or several, in another format, frame, kernel or degree, or a
// part of it.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/core/say.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/publish/device_clusters.h"
#include "engine/publish/fit_pictures.h"
#include "engine/scene/dot_splat.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/levels.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/page_output.h"
#include "trainer/job/scene_file.h"

namespace darb {

/// Applied in this order: up, rotate, scale, translate, crop, prune_opacity, max_sh.
struct SceneEdits {
    std::string up = "-y";                // the axis of the scene that is turned to -y
    std::string rotate, translate, crop;  // numbers with commas; empty: no change
    double scale = 1, prune_opacity = 0;
    int max_sh = 3;
};

void add_edit_options(CLI::App& app, SceneEdits& edits);

/// Prints to `say` how many splats are dropped. Throws an Error that names an unreadable option.
void edit_scene(const SceneEdits& edits, SplatModel& model, std::FILE* say);
/// Moves the cameras so that they see the edited scene as before: up, rotate, scale, translate.
void edit_views(const SceneEdits& edits, std::vector<View>& views);
/// What happens to the scene: up, rotate, scale, translate.
Similarity similarity_of(const SceneEdits& edits);
/// Where an axis of the original scene, named as for --up, points in the edited one. Unit vector.
glm::dvec3 edited_axis(const SceneEdits& edits, const std::string& axis);

/// The splats of all scenes, in order, in the world frame of their files. Harmonics get the highest
/// degree among them, with zeros where a scene has fewer. Positions are counted from the origin of
/// the first scene. Where float32 cannot hold another scene's positions that way, all are counted
/// anew, and a note says by how much they are rounded. names: of the files, for errors and notes.
/// Throws Error where kernels, footprints or render modes differ.
SplatModel join_scenes(std::vector<SplatModel> scenes,
                       const std::vector<std::filesystem::path>& names);

// The device that makes SOG's palettes of harmonics. It is opened when the first one is needed; the
// host makes them where there is no device.

class PaletteDevice {
  public:
    explicit PaletteDevice(std::string select) : select_(std::move(select)) {}
    /// The function for EncodeOptions, which this object must outlive.
    AssignRows assign_rows();

  private:
    void open();

    std::string select_;
    bool tried_ = false;
    std::unique_ptr<Device> device_;
    std::unique_ptr<DeviceClusters> clusters_;
};

namespace {

struct OutputChoices {
    EncodeOptions encode;
    std::uint64_t max_bytes = 0;  // 0: no limit
    bool measure = true;
    std::string device;
};

/// The device that makes pictures. It is opened when the first one is needed.
class PictureDevice {
  public:
    explicit PictureDevice(const OutputChoices& choices) : choices_(choices) {}
    /// Null where there is no device or none is wanted, which is reported once. An Error where
    /// --device names one that does not exist.
    Device* get();

  private:
    const OutputChoices& choices_;
    bool tried_ = false;
    std::optional<Device> device_;
};

struct WrittenScene {
    EncodedSplats encoded;
    PictureFit fit;
    std::size_t splats = 0;
    int levels = 1;  // the number of levels from which fit.level was chosen
};

class SceneOutput : public PictureOutput {
  public:
    SceneOutput(const std::filesystem::path& output, SplatFormat format, EncodeOptions options,
                bool read_back)
        : output_(output), format_(format), options_(std::move(options)), read_back_(read_back) {}

    SplatModel pack(const SplatModel& splats, int level) override {
        options_.precision = level;
        encoded_ = encode_scene(format_, splats, output_.string(), options_);
        splats_ = splats.size();
        return read_back_ ? parse_splats(encoded_.file, output_.string()) : SplatModel();
    }
    std::size_t finish(const PictureFit&) override { return encoded_.bytes(); }
    EncodedSplats take() { return std::move(encoded_); }
    std::size_t splats() const { return splats_; }

  private:
    std::filesystem::path output_;
    SplatFormat format_;
    EncodeOptions options_;
    bool read_back_;
    EncodedSplats encoded_;
    std::size_t splats_ = 0;
};

bool same_values(const SplatModel& a, const SplatModel& b) {
    if (a.sh_degree != b.sh_degree || a.kernel != b.kernel || a.footprint != b.footprint ||
        a.antialias != b.antialias || a.origin != b.origin)
        return false;
    for (int attribute = 0; attribute < kAttributeCount; ++attribute)
        if (attribute_values(a, attribute) != attribute_values(b, attribute)) return false;
    return true;
}

Device* PictureDevice::get() {
    if (!choices_.measure) return nullptr;
    if (!tried_) {
        tried_ = true;
        try {
            device_.emplace(command_device(choices_.device));
        } catch (const Error& error) {
            if (!choices_.device.empty()) throw;
            say("warning: the loss in dB is not measured: {}\n", error.what());
        }
    }
    return device_ ? &*device_ : nullptr;
}

/// What all scenes that a command writes have in common.
struct SceneWriter {
    SplatFormat format;
    const std::vector<View>& views;  // the views for measuring
    PictureDevice& device;
    const WrittenFiles& files;
    const Paths& inputs;
};

/// Reports what the format loses of the scene, then chooses, checks and writes. Throws Error.
WrittenScene write_scene(const std::filesystem::path& output, SplatModel& model,
                         const OutputChoices& choices, const SceneWriter& writer) {
    const SplatFormat format = writer.format;
    PictureDevice& device = writer.device;
    for (const std::string& loss : losses_of(format, model, output.string()))
        say("warning: {}: {}\n", output.string(), loss);
    drop_unwritable(format, model);
    PaletteDevice palettes(choices.device);
    EncodeOptions options = choices.encode;
    options.assign_rows = palettes.assign_rows();
    SlowProgress palette("palette of harmonics"), pictures("measuring");
    options.progress = [&](double share) { palette.at(share); };
    for (SplatModel& level : options.coarser) drop_unwritable(format, level);
    WrittenScene written;
    written.levels = precisions_of(format, model);
    std::optional<PictureMeasure> measure;
    if (written.levels > 1 && model.size() > 0 && device.get())
        measure.emplace(*device.get(), model, writer.views, glm::vec3(0.0f),
                        [&](std::size_t count) { pictures.at(count, "pictures"); });
    SceneOutput splats(output, format, std::move(options), measure.has_value());
    written.fit = fit_pictures(model, measure ? &*measure : nullptr,
                               {written.levels, 0, choices.max_bytes}, splats);
    written.encoded = splats.take();
    written.splats = splats.splats();
    const Paths outputs = outputs_of(output, written.encoded);
    refuse_to_overwrite_inputs(outputs, writer.inputs, Replaces::all);
    writer.files.check(outputs);
    write_encoded(output, written.encoded);
    writer.files.wrote(outputs);
    return written;
}

SplatModel read_again(const WrittenScene& written, const std::filesystem::path& output) {
    return written.encoded.beside.empty() ? parse_splats(written.encoded.file, output.string())
                                          : load_splats(output);
}

void print_loss(std::FILE* say, const std::filesystem::path& output, const WrittenScene& written,
                const SplatModel& scene, const std::vector<View>& views, PictureDevice& device) {
    if (say == nullptr || scene.size() == 0) return;
    PictureLoss loss = written.fit.loss;
    if (loss.views == 0) {
        const SplatModel read = read_again(written, output);
        if (same_values(read, scene)) return tell(say, "the file has the values of the scene\n");
        Device* const chosen = device.get();
        if (!chosen) return tell(say, "the file against the scene: not measured\n");
        SlowProgress pictures("measuring");
        const PictureMeasure measure(*chosen, scene, views, glm::vec3(0.0f),
                                     [&](std::size_t count) { pictures.at(count, "pictures"); });
        loss = measure.compare(read);
    }
    tell(say, "the file against the scene: {}\n", loss_text(loss));
}

struct ConvertFlags {
    Paths files;  // the inputs and, without -o, the output
    std::filesystem::path output, cameras;
    std::string kernel;
    SceneEdits edits;
    OutputChoices choices;
    LevelFlags levels;
    PageFlags page;
    bool compare = false, quiet = false, no_measure = false, force = false;
    StoredUnits units;
};

/// Without -o, the last of the names is the output.
void sort_names(ConvertFlags& flags) {
    if (flags.output.empty()) {
        if (flags.files.size() < 2)
            throw Error("convert", "names no output",
                        "Add it, as darb convert IN.ply OUT.spz, or with -o.");
        if (flags.files.size() > 2)
            throw Error("convert", fmt::format("{} files and no -o", flags.files.size()),
                        "To write several scenes as one: darb convert A.ply B.ply -o OUT.ply.");
        flags.output = flags.files.back();
        flags.files.pop_back();
    }
    std::error_code none;
    for (std::size_t i = 0; i < flags.files.size(); ++i)
        for (std::size_t k = 0; k < i; ++k)
            if (std::filesystem::equivalent(flags.files[i], flags.files[k], none))
                throw Error(flags.files[i].string(), "is named twice", "Name each scene once.");
}

SplatFormat checked_format(const ConvertFlags& flags) {
    const std::optional<SplatFormat> format = format_to_write(flags.output);
    if (flags.page.web &&
        (format || is_page(flags.output) || std::filesystem::is_regular_file(flags.output)))
        throw Error(flags.output.string(), "is a file, and --web writes a folder",
                    "Name a folder: darb convert SCENE out/ --web.");
    if (flags.page.web && (!flags.levels.refine.empty() || flags.choices.max_bytes > 0))
        throw Error(flags.choices.max_bytes > 0 ? "--max-size" : "--refine", "is not for --web",
                    "Leave it out.");
    if (!flags.page.web && !format && !is_page(flags.output))
        throw Error(flags.output.string(), "names no format that can be written",
                    "Let it end in .html, " + endings_to_write() + ".");
    check_page_options(flags.page, flags.output);
    if (flags.choices.encode.spz_version != EncodeOptions{}.spz_version &&
        format != SplatFormat::spz)
        throw Error("--spz-version", "is for files that end in .spz", "Leave it out.");
    if (flags.choices.max_bytes > 0 && flags.levels.asked())
        throw Error("--max-size", "and --splats, --share or --levels all say how small",
                    "Leave out one of them.");
    if (is_page(flags.output) && flags.levels.asked())
        throw Error("web page", "has one level", "See --max-size.");
    return flags.page.web ? SplatFormat::streamed_sog : format.value_or(SplatFormat::ply);
}

/// The cameras that are named, or some of those that the run left beside the scene, turned with it,
/// or else eight around the scene.
std::vector<View> views_for(const SplatModel& scene, const ConvertFlags& flags) {
    constexpr std::size_t kOfRun = 8;
    std::vector<View> views;
    if (!flags.cameras.empty()) {
        views = named_views(flags.cameras);
    } else if (flags.files.size() == 1) {
        try {
            const std::vector<View> all = cameras_beside(flags.files[0]);
            const std::size_t count = std::min(kOfRun, all.size());
            for (std::size_t i = 0; i < count; ++i) views.push_back(all[i * all.size() / count]);
        } catch (const Error&) {  // not a list of cameras
        }
    }
    edit_views(flags.edits, views);
    return views.empty() && scene.size() > 0 ? views_around(scene) : views;
}

void print_difference(std::FILE* say, const char* what, const SplatModel& scene,
                      const SplatModel& other, const ConvertFlags& flags) {
    const std::vector<View> views = views_for(scene, flags);
    tell(say, "{}: {}\n", what,
         difference_text(compare_scenes(scene, other, views, flags.choices.device), views.size()));
}

void turn_to_gaussians(SplatModel& model, const ConvertFlags& flags, PictureDevice& device,
                       std::FILE* say) {
    if (flags.kernel != "gaussian" || model.kernel == KERNEL_GAUSSIAN) return;
    GaussianEquivalent fit{};
    const SplatModel gaussians = as_gaussians(model, false, &fit);
    tell(say,
         "kernel {} to gaussian: covariance x {:.4f}, opacity x {:.4f}, profile off by "
         "{:.2f} % (relative L2)\n",
         kernel_name(model.kernel), fit.covariance, fit.opacity, 100 * fit.error);
    if (say != nullptr && device.get())
        print_difference(say, "renders of both kernels", model, gaussians, flags);
    model = gaussians;
}

/// stated_up: what the file of a single scene says; otherwise empty.
SplatModel load_all(const ConvertFlags& flags, PictureDevice& device, std::FILE* say,
                    std::string& stated_up) {
    std::vector<SplatModel> scenes;
    for (const std::filesystem::path& file : flags.files) {
        SplatFile facts;
        scenes.push_back(load_scene(file, &facts, flags.units));
        if (flags.files.size() == 1) stated_up = facts.up;
        edit_scene(flags.edits, scenes.back(), say);
        turn_to_gaussians(scenes.back(), flags, device, say);
    }
    return scenes.size() == 1 ? std::move(scenes[0]) : join_scenes(std::move(scenes), flags.files);
}

/// The cameras that are named, else all that the run left beside the scene, turned with it, as in
/// the pages of darb train and of the viewer. They tell what the scene is about.
std::vector<View> bookmarks_for(const ConvertFlags& flags) {
    std::vector<View> views = named_views(flags.cameras);
    if (flags.cameras.empty() && flags.files.size() == 1) {
        try {
            views = cameras_beside(flags.files[0]);
        } catch (const Error& e) {
            say_note(fmt::format("warning: {}", e.what()));
        }
    }
    edit_views(flags.edits, views);
    return views;
}

/// The options of a page, with the up axis where it is known.
PageFlags page_flags(const ConvertFlags& flags, const std::vector<View>& views,
                     const std::string& stated_up) {
    PageFlags page = flags.page;
    page.max_bytes = flags.choices.max_bytes;
    page.moved = similarity_of(flags.edits);
    const bool up_given = flags.edits.up != SceneEdits{}.up;
    if (up_given || (views.empty() && !stated_up.empty()))
        page.up = edited_axis(flags.edits, up_given ? flags.edits.up : stated_up);
    return page;
}

int convert_to_web_folder(SplatModel& model, const ConvertFlags& flags,
                          const std::string& stated_up, const Paths& inputs,
                          const WrittenFiles& files, std::FILE* say) {
    Device device(command_device(flags.choices.device));
    std::vector<View> views = bookmarks_for(flags);
    const PageFlags page = page_flags(flags, views, stated_up);
    PaletteDevice palettes(flags.choices.device);
    const WebFolder to{
        flags.output,
        flags.levels.asked() ? level_counts(flags.levels, model.size()) : web_levels(model.size()),
        palettes.assign_rows(), [&](const Paths& outputs) {
            refuse_to_overwrite_inputs(outputs, inputs, Replaces::all);
            files.check(outputs);
        }};
    Paths written;
    tell(say, "{}",
         write_web_folder(device, model, page, scene_name(flags.files[0]), std::move(views), to,
                          written));
    files.wrote(written);
    tell_paths(say == nullptr, {flags.output / "index.html"});
    return 0;
}

int convert_to_page(const SplatModel& model, const ConvertFlags& flags,
                    const std::string& stated_up, const WrittenFiles& files, std::FILE* say) {
    Device device(command_device(flags.choices.device));
    std::vector<View> views = bookmarks_for(flags);
    const PageFlags page = page_flags(flags, views, stated_up);
    tell(say, "{}",
         write_page(device, model, page, scene_name(flags.files[0]), std::move(views),
                    flags.output));
    files.wrote({flags.output});
    tell_paths(say == nullptr && stream_beside(flags.output) == stdout, {flags.output});
    return 0;
}

/// Writes one file, or the files of a folder.
int convert_to_scene(SplatModel& model, SplatFormat format, const ConvertFlags& flags,
                     const Paths& inputs, const WrittenFiles& files, PictureDevice& device,
                     std::FILE* say) {
    const std::vector<View> views = views_for(model, flags);
    const SceneWriter writer{format, views, device, files, inputs};
    if (flags.levels.asked()) {
        const auto write = [&](const std::filesystem::path& file, SplatModel& level,
                               std::vector<SplatModel> coarser) {
            OutputChoices choices = flags.choices;
            choices.encode.coarser = std::move(coarser);
            return write_scene(file, level, choices, writer).encoded;
        };
        const LevelOutput to{
            flags.output, format, views, flags.choices.device, device.get() != nullptr, say, write};
        tell_paths(flags.quiet, write_levels(flags.levels, model, to));
        return 0;
    }
    const WrittenScene written = write_scene(flags.output, model, flags.choices, writer);
    const PictureFit& fit = written.fit;
    tell(say, "{}: {}, {} splats{}, {} bytes{}\n", flags.output.string(), format_name(format),
         count_text(written.splats),
         fit.merged_from > 0 ? " merged from " + count_text(fit.merged_from) : "",
         count_text(written.encoded.bytes()),
         written.levels > 1
             ? fmt::format(", harmonics rounded at level {} of {}", fit.level, written.levels - 1)
             : "");
    if (flags.compare)
        print_difference(say, "the file against the scene", model,
                         read_again(written, flags.output), flags);
    else if (!flags.no_measure)
        print_loss(say, flags.output, written, model, views, device);
    tell_paths(say == nullptr && stream_beside(flags.output) == stdout, {flags.output});
    return 0;
}

int convert(ConvertFlags flags) {
    sort_names(flags);
    check_level_options(flags.levels);
    Paths sources;  // the files that decide whether an output is darb's to replace
    for (const std::filesystem::path& file : flags.files) sources.push_back(file);
    Paths inputs = together({files_of(flags.cameras), files_of(flags.levels.refine),
                             Paths{flags.page.notes, flags.page.collider}});
    for (const std::filesystem::path& file : flags.files)
        inputs = together({inputs, files_of(file)});
    const SplatFormat format = checked_format(flags);
    if (!flags.page.web) refuse_to_overwrite_inputs({flags.output}, inputs, Replaces::all);
    const WrittenFiles files(sources, flags.force);
    const bool several = flags.levels.levels > 0 && format != SplatFormat::streamed_sog;
    Paths first{flags.page.web ? flags.output / "index.html" : flags.output};  // known already
    if (several) first.clear();
    for (int level = 1; several && level <= flags.levels.levels; ++level)
        first.push_back(level_file(flags.output, format, level));
    files.check(first);
    flags.choices.measure = !flags.no_measure;
    PictureDevice device(flags.choices);
    std::FILE* const say = flags.quiet ? nullptr : stream_beside(flags.output);
    std::string stated_up;
    SplatModel model = load_all(flags, device, say, stated_up);
    if (flags.page.web) return convert_to_web_folder(model, flags, stated_up, inputs, files, say);
    if (is_page(flags.output)) return convert_to_page(model, flags, stated_up, files, say);
    return convert_to_scene(model, format, flags, inputs, files, device, say);
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
    auto flags = std::make_shared<ConvertFlags>();
    CLI::App* command = app.add_subcommand(
        "convert", "Write a scene in another format, frame, kernel, degree, or a part of it");
    command
        ->add_option("files", flags->files,
                     "IN OUT, or several scenes, which become one, and -o: splat files, or output "
                     "folders of darb train")
        ->required();
    command->add_option("-o,--output", flags->output,
                        "ends in .html, " + endings_to_write() + "; with --web a folder");
    command->add_flag("--force", flags->force,
                      "replace a file that darb did not write from the same scene");
    command
        ->add_option("--kernel", flags->kernel,
                     "gaussian: turn splats into the nearest Gaussians and print how far renders "
                     "of both differ")
        ->check(CLI::IsMember({"gaussian"}));
    add_edit_options(*command, flags->edits);
    command
        ->add_option("--spz-version", flags->choices.encode.spz_version,
                     "3: one gzip stream, which more programs read")
        ->check(CLI::IsMember({3, 4}))
        ->capture_default_str();
    add_level_options(*command, flags->levels);
    command
        ->add_option("--max-size", flags->choices.max_bytes,
                     "largest size of the output, such as 10MB (a MB is 1,000,000 bytes): values "
                     "are rounded and splats merged to fit, and the loss is printed")
        ->transform(CLI::AsSizeValue(true))
        ->check(above_zero());
    add_page_options(*command, flags->page);
    command->add_flag("--no-measure", flags->no_measure,
                      "do not render: the loss is not printed, and SPZ keeps all its bits");
    command
        ->add_flag("--compare", flags->compare,
                   "measure the loss in all views at full size, not in 8 smaller ones")
        ->excludes("--no-measure");
    command->add_option("--cameras", flags->cameras,
                        "cameras of the input, as for darb render, to measure losses and for a web "
                        "page (default: those of the run, else 8 around the scene)");
    command->add_option("--device", flags->choices.device,
                        "number or part of a name, see `darb devices`");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return convert(*flags); }; });
}

namespace {

glm::dvec3 vector_of(const std::string& option, const std::string& text) {
    const std::vector<double> v = numbers_from(option, text, 3);
    return {v[0], v[1], v[2]};
}

// A user who drops everything meant something else.
void report_dropped(std::FILE* say, const std::string& option, size_t count, size_t left) {
    if (count > 0 && left == 0)
        throw Error(option, fmt::format("keeps none of {} splats", count),
                    "`darb info` prints where the splats are and how opaque.");
    if (count > 0) tell(say, "{}: {} splats left out\n", option, count_text(count));
}

}  // namespace

Similarity similarity_of(const SceneEdits& edits) {
    Similarity similarity;
    similarity.scale = edits.scale;
    similarity.turn = turn_of_up_axis(edits.up);
    if (!edits.rotate.empty())
        similarity.turn = turn_of_degrees(vector_of("--rotate", edits.rotate)) * similarity.turn;
    if (!edits.translate.empty())
        similarity.translation = vector_of("--translate", edits.translate);
    return similarity;
}

void edit_scene(const SceneEdits& edits, SplatModel& model, std::FILE* say) {
    const Similarity similarity = similarity_of(edits);
    if (similarity.scale != 1 || similarity.turn != glm::dmat3(1.0) ||
        similarity.translation != glm::dvec3(0.0))
        transform_splats(similarity, model);
    if (!edits.crop.empty()) {
        const std::vector<double> v = numbers_from("--crop", edits.crop, 6);
        const size_t lost = crop_splats({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, model);
        report_dropped(say, "--crop " + edits.crop, lost, model.size());
    }
    if (edits.prune_opacity > 0) {
        const size_t lost = prune_opacity(edits.prune_opacity, model);
        report_dropped(say, fmt::format("--prune-opacity {}", edits.prune_opacity), lost,
                       model.size());
    }
    limit_sh_degree(edits.max_sh, model);
}

void edit_views(const SceneEdits& edits, std::vector<View>& views) {
    const Similarity similarity = similarity_of(edits);
    for (View& view : views) move_camera(similarity, view.camera);
}

glm::dvec3 edited_axis(const SceneEdits& edits, const std::string& axis) {
    return similarity_of(edits).turn * glm::transpose(turn_of_up_axis(axis)) * glm::dvec3(0, -1, 0);
}

namespace {

void check_alike(const SplatModel& first, const SplatModel& other, const std::string& first_name,
                 const std::string& name) {
    if (other.kernel != first.kernel || other.footprint != first.footprint)
        throw Error(
            name,
            fmt::format("has the kernel {} ({}), and {} has {} ({}): one scene has one",
                        kernel_name(other.kernel), footprint_name(other.footprint), first_name,
                        kernel_name(first.kernel), footprint_name(first.footprint)),
            "Add --kernel gaussian, which turns each of them into its nearest Gaussians.");
    if (other.antialias != first.antialias)
        throw Error(
            name,
            fmt::format("has {}anti-aliasing (render mode mip), and {} has {}",
                        other.antialias ? "" : "no ", first_name, other.antialias ? "none" : "it"),
            "Merge scenes that were trained with the same render mode.");
}

/// Gives the scene harmonics of this degree, with zeros above its own.
void raise_degree(int degree, SplatModel& model) {
    const auto from = static_cast<std::size_t>(model.rest_count());
    const std::size_t count = model.size();
    model.sh_degree = degree;
    const auto to = static_cast<std::size_t>(model.rest_count());
    std::vector<float> rest(count * to, 0);
    for (std::size_t i = 0; i < count; ++i)
        std::copy_n(model.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * from), from,
                    rest.begin() + static_cast<std::ptrdiff_t>(i * to));
    model.sh_rest = std::move(rest);
}

void append_positions(const SplatModel& model, std::vector<double>& to) {
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 p = position_of(model, i);
        to.insert(to.end(), {p.x, p.y, p.z});
    }
}

/// The largest distance along an axis between these positions and those of the model.
double most_rounded(const std::vector<double>& positions, const SplatModel& model) {
    double most = 0;
    for (std::size_t i = 0; i < model.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            most = std::max(most, std::abs(positions[3 * i + static_cast<std::size_t>(axis)] -
                                           position_of(model, i)[axis]));
    return most;
}

}  // namespace

SplatModel join_scenes(std::vector<SplatModel> scenes,
                       const std::vector<std::filesystem::path>& names) {
    DARB_CHECK(!scenes.empty() && scenes.size() == names.size(), "{} scenes, {} names",
               scenes.size(), names.size());
    int degree = 0;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        check_alike(scenes[0], scenes[i], names[0].string(), names[i].string());
        degree = std::max(degree, scenes[i].sh_degree);
    }
    std::vector<double> positions;
    bool one_origin = true;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        if (scenes[i].sh_degree < degree) {
            say_note(fmt::format("note: {}: has harmonics of degree {}; those up to {} are zero",
                                 names[i].string(), scenes[i].sh_degree, degree));
            raise_degree(degree, scenes[i]);
        }
        append_positions(scenes[i], positions);
        one_origin = one_origin && scenes[i].origin == scenes[0].origin;
    }
    SplatModel joined = std::move(scenes[0]);
    for (std::size_t i = 1; i < scenes.size(); ++i)
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float>& to = attribute_values(joined, a);
            const std::vector<float>& from = attribute_values(scenes[i], a);
            to.insert(to.end(), from.begin(), from.end());
        }
    if (one_origin) return joined;
    set_positions(positions, joined);
    if (const double most = most_rounded(positions, joined); most > 0)
        say_note(
            fmt::format("note: the scenes lie far apart: positions are rounded by {:.2g} at "
                        "most, world units",
                        most));
    return joined;
}

void add_edit_options(CLI::App& app, SceneEdits& edits) {
    app.add_option("--up", edits.up,
                   "axis of the input that points up (x y z -x -y -z); it is turned to -y")
        ->capture_default_str();
    app.add_option("--rotate", edits.rotate, "X,Y,Z degrees, about x, then y, then z");
    app.add_option("--scale", edits.scale, "scale by this factor")->check(above_zero());
    app.add_option("--translate", edits.translate,
                   "X,Y,Z, after --up, --rotate and --scale, in this order");
    app.add_option("--crop", edits.crop,
                   "MINX,MINY,MINZ,MAXX,MAXY,MAXZ after all of these: centres to keep");
    app.add_option("--prune-opacity", edits.prune_opacity,
                   "leave out splats with a lower opacity, 0 to 1")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--max-sh", edits.max_sh, "highest degree of view-dependent colour to keep")
        ->check(CLI::Range(0, 3));
}

namespace {

constexpr auto* assign_rows_on_host = &darb::assign_rows;

}  // namespace

void PaletteDevice::open() {
    tried_ = true;
    try {
        device_ = std::make_unique<Device>(command_device(select_));
        clusters_ = std::make_unique<DeviceClusters>(*device_);
    } catch (const Error&) {
        if (!select_.empty()) throw;  // where nobody asked for a device, the host does the work
    }
}

AssignRows PaletteDevice::assign_rows() {
    return
        [this](const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
               const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels) {
            if (!tried_) open();
            if (clusters_)
                clusters_->assign(rows, dims, centres, batches, labels);
            else
                assign_rows_on_host(rows, dims, centres, batches, labels);
        };
}

}  // namespace darb
