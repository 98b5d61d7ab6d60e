// SPDX-License-Identifier: MIT
// darb render SCENE.ply --cameras X -o DIR: a PNG for each camera, or without cameras a film of a
// path or a turn.
#include "tools/darb/render.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/check/dump.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/quantile.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/data/panorama_files.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/raster/frame_view.h"
#include "engine/render/camera_blur.h"
#include "engine/render/orthophoto.h"
#include "engine/render/renderer.h"
#include "engine/scene/panorama.h"
#include "engine/scene/stored_units.h"
#include "engine/scene/subject.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"
#include "trainer/run/run_report.h"
#include "viewer/bounds.h"
#include "viewer/camera_path.h"
#include "viewer/path_export.h"

namespace darb {

struct FilmFlags {
    std::filesystem::path path, around;
    std::string size, up;  // size: empty where not given
    int fps = 0;           // 0: not given
    double seconds = 6;    // time of one turn
};

constexpr const char *kPerspective = "perspective", *kEquirectangular = "equirectangular",
                     *kCubemap = "cubemap", *kOrthographic = "orthographic";

struct BlurFlags {
    double aperture = 0, shutter = 0;  // world units; degrees of a turn of a film's shutter
    std::optional<double> focus;       // world units; absent: what is in the middle
    std::optional<int> samples;        // absent: as CameraBlur has them
};

struct OrthophotoFlags {
    std::string from = "above";
    double pixel = 0;  // world units; 0: as --size says
};

struct RenderFlags {
    std::filesystem::path scene, cameras, output;
    std::string device;
    bool white_background = false, quiet = false, force = false;
    std::optional<float> near_plane;  // world units
    std::string effects = "auto", projection = kPerspective;
    FilmFlags film;
    BlurFlags blur;
    OrthophotoFlags orthophoto;
    DepthFlags depth;
    DatasetOptions data;
    KernelFlags kernel;
    AccuracyFlags accuracy;
    TuneFlags tune;
    StoredUnits units;
};

/// cameras: the option that excludes these.
void add_film_flags(CLI::App& command, FilmFlags& flags, CLI::Option* cameras);
void add_blur_flags(CLI::App& command, BlurFlags& flags);
void add_orthophoto_flags(CLI::App& command, OrthophotoFlags& flags);
/// Return the exit code. Throw Error.
int render_orthophoto(const RenderFlags& flags, const Accuracy& accuracy,
                      const EffectChoice& choice);
int render_film(const RenderFlags& flags, const Accuracy& accuracy, const EffectChoice& choice);

namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

constexpr const char *kPanoramaSize = "2048x1024", *kFaceSize = "1024x1024";

bool shows_all_around(const RenderFlags& flags) {
    return flags.projection == kEquirectangular || flags.projection == kCubemap;
}

// Of a panorama, or of a face of a cube map.
PixelSize size_around(const RenderFlags& flags) {
    const bool cube = flags.projection == kCubemap;
    const PixelSize size = parse_size(!flags.film.size.empty() ? flags.film.size
                                      : cube                   ? kFaceSize
                                                               : kPanoramaSize);
    if (size.width != (cube ? 1 : 2) * size.height)
        throw Error(fmt::format("--size {}", flags.film.size),
                    cube ? "a face of a cube map is as wide as high"
                         : "a panorama is twice as wide as high",
                    fmt::format("Give --size {}x{}.", (cube ? 1 : 2) * size.height, size.height));
    return size;
}

void check_projection(const RenderFlags& flags) {
    const bool around = shows_all_around(flags);
    if (!around && !flags.cameras.empty() && !flags.film.size.empty())
        throw Error("--size", "the cameras have sizes of their own",
                    "Use -r, or leave --cameras out.");
    const std::string what = "--projection " + flags.projection;
    if (flags.projection == kOrthographic && !(flags.cameras.empty() && flags.film.path.empty()))
        throw Error(what, "is one picture of the whole scene", "Leave --cameras and --path out.");
    if (flags.projection != kOrthographic &&
        (flags.orthophoto.pixel > 0 || flags.orthophoto.from != "above"))
        throw Error("--from, --pixel", "are of a picture without perspective",
                    "Add --projection orthographic.");
    if (flags.projection == kOrthographic && !flags.depth.format.empty())
        throw Error(what, "has no depth beside it", "Leave --depth out.");
    if (!around) return;
    if (flags.projection == kCubemap && flags.cameras.empty())
        throw Error(what, "is for single pictures", "Name --cameras, or take equirectangular.");
    if (!flags.depth.format.empty())
        throw Error(what, "has no depth beside it", "Leave --depth out.");
    if (flags.data.resolution != -1)
        throw Error(what, "shows all directions, whatever size the cameras have",
                    "Use --size in place of -r.");
    if (flags.data.original_lens) throw Error(what, "knows no lens", "Leave --lens out.");
    size_around(flags);
}

// What the lens and the shutter blur in a picture of this camera.
CameraBlur blur_of(const RenderFlags& flags, const SplatModel& model, const Camera& camera,
                   const std::string& where) {
    CameraBlur blur{.aperture = flags.blur.aperture};
    if (flags.blur.samples) blur.samples = *flags.blur.samples;
    if (!(blur.aperture > 0)) return blur;
    if (camera.lens.active)
        throw Error(where, "its lens is kept, and --aperture works on straight pictures only",
                    "Use --lens undistort.");
    const std::optional<double> focus =
        flags.blur.focus ? flags.blur.focus : seen_depth(model, camera);
    if (!focus)
        throw Error(where, "there is nothing in the middle to focus on",
                    "Give --focus a distance.");
    blur.focus = *focus;
    return blur;
}

void check_blur(const RenderFlags& flags) {
    const bool film = flags.cameras.empty();
    if (flags.blur.shutter > 0 && !film)
        throw Error("--shutter", "blurs what moves, and single pictures of --cameras stand still",
                    "Use it with --path or a turn.");
    if (!(flags.blur.aperture > 0) && flags.blur.focus)
        throw Error("--focus", "changes nothing, as everything is sharp", "Add --aperture.");
    if (!(flags.blur.aperture > 0) && !(flags.blur.shutter > 0) && flags.blur.samples)
        throw Error("--samples", "changes nothing, as everything is sharp",
                    "Add --aperture or --shutter.");
    if (flags.blur.aperture > 0 && !flags.depth.format.empty())
        throw Error("--depth", "would be that of one point of the lens", "Leave --aperture out.");
    if ((flags.blur.aperture > 0 || flags.blur.shutter > 0) && flags.projection != kPerspective)
        throw Error("--projection " + flags.projection, "is of a camera without lens and shutter",
                    "Leave --aperture and --shutter out.");
}

/// Draws what a camera's place sees in all directions; how the camera is turned decides what is in
/// the middle.
class AllAround {
  public:
    AllAround(Renderer& renderer, EffectPlan& plan, const RenderFlags& flags, float near_plane)
        : renderer_(renderer),
          plan_(plan),
          background_(flags.white_background ? 1.0f : 0.0f),
          near_plane_(near_plane) {}

    ImageF face(const Camera& pose, const CubeFace& face, int size, int margin) {
        const ImageF image =
            renderer_.render(face_camera(pose, face, size, margin), background_, -1, near_plane_);
        plan_.note_frame(renderer_.status().huge_splats, renderer_.status().longest_list);
        return image;
    }
    ImageU8 panorama(const Camera& pose, const PixelSize& size) {
        std::array<ImageF, kCubeFaces> faces;
        for (std::size_t f = 0; f < faces.size(); ++f)
            faces[f] = face(pose, cube_faces()[f], face_size(size.width), kJoinMargin);
        return to_8bit(join_faces(faces, size.width, size.height));
    }

  private:
    Renderer& renderer_;
    EffectPlan& plan_;
    glm::vec3 background_;
    float near_plane_;
};

// The pinholes that are drawn of these places, for the effects to be planned by.
std::vector<View> faces_of(const std::vector<View>& views, const RenderFlags& flags) {
    const PixelSize size = size_around(flags);
    std::vector<View> faces;
    for (const View& view : views)
        for (const CubeFace& face : cube_faces()) {
            View& of_face = faces.emplace_back(view);
            of_face.camera =
                face_camera(view.camera, face,
                            flags.projection == kCubemap ? size.width : face_size(size.width));
        }
    return faces;
}

// room.png and a face to room_front.png.
std::filesystem::path face_file(const std::filesystem::path& file, const CubeFace& face) {
    std::filesystem::path of_face = file;
    return of_face.replace_filename(fmt::format("{}_{}.png", file.stem().string(), face.name));
}

Paths files_around(const RenderFlags& flags, const std::vector<std::filesystem::path>& files) {
    if (flags.projection != kCubemap) return files;
    Paths all;
    for (const auto& file : files)
        for (const CubeFace& face : cube_faces()) all.push_back(face_file(file, face));
    return all;
}

void draw_around(AllAround& around, const RenderFlags& flags, const Camera& pose,
                 const std::filesystem::path& file) {
    const PixelSize size = size_around(flags);
    if (flags.projection != kCubemap) {
        write_panorama_png(file, around.panorama(pose, size));
        return;
    }
    for (const CubeFace& face : cube_faces())
        write_png(face_file(file, face), to_8bit(around.face(pose, face, size.width, 0)));
}

// Applies -r to a camera list, which states sizes rather than photos: up to 8 is a divisor, above
// it a width.
void scale_camera(Camera& camera, int resolution) {
    if (resolution == -1) return;
    if (resolution < 1)
        throw Error("-r", fmt::format("{} is no valid value", resolution),
                    "Use 1, 2, 4 or 8 (a divisor), or a width in pixels above 8.");
    const double scale = resolution <= 8 ? 1.0 / resolution : double(resolution) / camera.width;
    const int width = std::max(1, static_cast<int>(std::lround(camera.width * scale)));
    const int height = std::max(1, static_cast<int>(std::lround(camera.height * scale)));
    camera = resized(camera, width, height);
}

std::vector<View> views_to_draw(const RenderFlags& flags) {
    std::vector<View> views = open_cameras(flags.cameras, flags.data);
    const bool is_list = !views.empty() && views[0].photo.empty();
    if (is_list)
        for (View& view : views) scale_camera(view.camera, flags.data.resolution);
    return views;
}

std::vector<std::filesystem::path> files_of_views(const std::vector<View>& views,
                                                  const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::set<std::string> used;
    for (const View& view : views) files.push_back(folder / picture_name(view.name, used));
    return files;
}

// The pinholes that are drawn, for the effects to be planned by.
std::vector<View> views_to_plan(const std::vector<View>& views, const RenderFlags& flags,
                                const SplatModel& model) {
    if (shows_all_around(flags)) return faces_of(views, flags);
    std::vector<View> drawn = views;
    if (flags.blur.aperture > 0)
        for (View& view : drawn)
            view.camera =
                through_lens(view.camera, blur_of(flags, model, view.camera, view.name), 0);
    return drawn;
}

int render(RenderFlags flags) {
    const Accuracy accuracy = chosen_accuracy(flags.accuracy);
    const EffectChoice choice = choose_effects(flags.effects, EffectUse::pictures, flags.data);
    check_depth(flags.depth, accuracy, choice);
    check_projection(flags);
    check_blur(flags);
    if (flags.projection == kOrthographic) return render_orthophoto(flags, accuracy, choice);
    flags.data.whole_panoramas = shows_all_around(flags);
    if (flags.cameras.empty()) return render_film(flags, accuracy, choice);
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, nullptr, flags.units));
    note_unused_choices(flags.accuracy, model.kernel);
    std::vector<View> views = views_to_draw(flags);
    const std::vector<std::filesystem::path> files = files_of_views(views, flags.output);
    Paths outputs = files_around(flags, files);
    add_depth_files(flags.depth, files, outputs);
    refuse_to_overwrite_inputs(
        outputs, together({files_of(flags.scene), files_of(flags.cameras), files_of(views)}));
    const WrittenFiles written({}, flags.force);
    written.check(outputs);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    const float near_plane = flags.near_plane.value_or(static_cast<float>(NEAR_DEFAULT));
    EffectPlan plan =
        plan_rendering(model, views_to_plan(views, flags, model),
                       {.depth = !flags.depth.format.empty(), .near_plane = near_plane}, choice);
    apply_plan(plan, model);
    apply_plan(plan, views);
    for (const View& view : views)
        if (!shows_all_around(flags))
            check_frame(device, view.camera.width, view.camera.height, view.name);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    AllAround around(renderer, plan, flags, near_plane);
    const DepthReading reading =
        depth_reading_from_name(flags.depth.reading).value_or(usual_reading(model.kernel));
    DepthFiles depths(flags.depth);
    std::vector<double> frame_ms;
    for (const View& view : views) {
        const auto start = std::chrono::steady_clock::now();
        if (shows_all_around(flags)) {
            draw_around(around, flags, view.camera, files[frame_ms.size()]);
            frame_ms.push_back(milliseconds_since(start));
            continue;
        }
        const CameraBlur blur = blur_of(flags, model, view.camera, view.name);
        const auto draw = [&](const Camera& camera) {
            const ImageF image = renderer.render(camera, background, -1, near_plane);
            plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
            return to_8bit(image);
        };
        const ImageU8 picture =
            blurred(blur, [&](int i) { return draw(through_lens(view.camera, blur, i)); });
        frame_ms.push_back(milliseconds_since(start));
        const auto& file = files[frame_ms.size() - 1];
        write_png(file, picture);
        if (plan.on(EFFECT_DEPTH)) depths.write(file, renderer.render_depth(reading));
    }
    written.wrote(outputs);
    depths.print_clipped();
    std::FILE* const out = flags.quiet ? nullptr : stdout;
    tell(out, "effects: {}\n", plan_line(plan));
    tell_paths(flags.quiet, {flags.output});
    tell(out, "{} frames in {}, median {:.2f} ms a frame on {}\n", views.size(),
         flags.output.string(), median(frame_ms), device.info().name);
    return 0;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
    auto flags = std::make_shared<RenderFlags>();
    CLI::App* command = app.add_subcommand(
        "render",
        "Render a scene to PNG files: from cameras, along a path, once around it, or without "
        "perspective");
    command->add_option("scene", flags->scene, "splat file, or the output folder of darb train")
        ->required();
    CLI::Option* const cameras =
        command->add_option("--cameras", flags->cameras,
                            "a cameras.json, a transforms.json, a camera_path.json of nerfstudio, "
                            "or a data set; photos are not needed");
    command
        ->add_option("--projection", flags->projection,
                     "perspective: what the camera sees; equirectangular: all directions, as 360 "
                     "viewers and players show them, 2048x1024 px without --size; cubemap: six "
                     "pictures of 90 degrees, NAME_front and so on, 1024x1024 px; orthographic: an "
                     "orthophoto of the scene without perspective")
        ->check(CLI::IsMember({kPerspective, kEquirectangular, kCubemap, kOrthographic}))
        ->capture_default_str();
    add_film_flags(*command, flags->film, cameras);
    add_blur_flags(*command, flags->blur);
    add_orthophoto_flags(*command, flags->orthophoto);
    command->add_option("-o,--output", flags->output, "folder of the frames; it is made if missing")
        ->required();
    command->add_flag("--force", flags->force,
                      "replace pictures of cameras, or an orthophoto, that darb did not write");
    command->add_option("-r,--resolution", flags->data.resolution,
                        "1, 2, 4, 8: divide the cameras' size; above 8: width in px; default: as "
                        "they are, those of a data set at most 1,600 px wide");
    command->add_flag("-w,--white-background", flags->white_background, "white, not black");
    command
        ->add_option(
            "--near", flags->near_plane,
            "nearest distance drawn, world units [0.2; without --cameras less for a small scene]")
        ->check(above_zero());
    add_kernel_flags(*command, flags->kernel, "draw with this kernel instead of the scene's own");
    add_accuracy_flags(*command, flags->accuracy);
    add_effects_flag(*command, flags->effects);
    add_lens_flag(*command, flags->data);
    command->get_option("--lens")->needs(cameras);
    command
        ->add_option("--depth", flags->depth.format,
                     "write depth beside the frames, NAME_depth: png (16 bits, 0 = nothing seen) "
                     "or npy (float32, world units); NAME_depth_colours.png is for people")
        ->check(CLI::IsMember({"png", "npy"}));
    command
        ->add_option("--depth-reading", flags->depth.reading,
                     "where the surface of a pixel is: the depth at which half of its light is "
                     "left, by how a splat takes it (front, solid, plane), or the mean of the "
                     "centres (expected)")
        ->check(CLI::IsMember(
            std::vector<std::string>(std::begin(kDepthReadings), std::end(kDepthReadings))))
        ->default_str("front; of kernels with rings plane");
    command->add_option("--depth-unit", flags->depth.unit, "world units of one step of a depth PNG")
        ->capture_default_str()
        ->check(above_zero());
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return render(*flags); }; });
}

namespace {

// Five colours of Viridis, from its near end.
constexpr std::array<std::array<float, 3>, 5> kDepthColours{
    {{253, 231, 37}, {93, 201, 99}, {33, 144, 141}, {59, 82, 139}, {68, 1, 84}}};

/// Rounds up to two digits.
double unit_for(double farthest) {
    const double unit = farthest / kDepthSteps;
    const double digit = std::pow(10.0, std::floor(std::log10(unit)) - 1);
    return std::ceil(unit / digit) * digit;
}

}  // namespace

void check_depth(const DepthFlags& flags, const Accuracy& accuracy, const EffectChoice& effects) {
    const bool asked = !flags.format.empty();
    const bool on = plan_rendering({}, {}, {.depth = asked}, effects).on(EFFECT_DEPTH);
    if (asked && !on)
        throw Error("--depth", "the effects leave depth out",
                    "Add +depth to --effects, or leave --depth out.");
    if (on && accuracy.value(kStorage) != STORAGE_FLOAT32)
        throw Error("--depth", "depths do not fit the float16 storage that was chosen",
                    "Add --storage float32.");
    if (on && accuracy.value(kRenderScale) != 1)
        throw Error("--depth", "depths would be of the render scale, half the size of the frames",
                    "Add --render-scale 1.");
}

std::vector<std::filesystem::path> depth_files(const DepthFlags& flags,
                                               const std::filesystem::path& frame) {
    const std::string stem = frame.stem().string() + "_depth";
    std::filesystem::path numbers = frame, picture = frame;
    return {numbers.replace_filename(stem + (flags.format == "npy" ? ".npy" : ".png")),
            picture.replace_filename(stem + "_colours.png")};
}

void add_depth_files(const DepthFlags& flags, const std::vector<std::filesystem::path>& frames,
                     std::vector<std::filesystem::path>& files) {
    for (const auto& frame : frames)
        for (auto& file : depth_files(flags, frame)) files.push_back(std::move(file));
}

ImageU8 depth_picture(const ImageF& depth) {
    const auto channels = static_cast<size_t>(depth.channels);
    std::vector<float> seen;
    for (size_t p = 0; p < depth.data.size(); p += channels)
        if (depth.data[p] > 0) seen.push_back(depth.data[p]);
    std::ranges::sort(seen);
    const float near = seen.empty() ? 0 : seen[seen.size() / 100];
    const float far = seen.empty() ? 1 : seen[seen.size() - 1 - seen.size() / 100];
    ImageU8 picture(depth.width, depth.height, 3);
    for (size_t p = 0; p < depth.data.size() / channels; ++p) {
        const float value = depth.data[p * channels];
        if (value <= 0) continue;
        const float share = std::clamp((value - near) / std::max(far - near, 1e-9f), 0.0f, 1.0f);
        const float at = share * (std::size(kDepthColours) - 1);
        const size_t low = std::min(static_cast<size_t>(at), std::size(kDepthColours) - 2);
        for (size_t c = 0; c < 3; ++c)
            picture.data[3 * p + c] = static_cast<std::uint8_t>(std::lround(std::lerp(
                kDepthColours[low][c], kDepthColours[low + 1][c], at - static_cast<float>(low))));
    }
    return picture;
}

void DepthFiles::write(const std::filesystem::path& frame, const ImageF& depth) {
    const std::vector<std::filesystem::path> files = depth_files(flags_, frame);
    const std::filesystem::path& file = files.front();
    write_png(files.back(), depth_picture(depth));
    if (flags_.format != "npy") {
        const DepthRange range = write_depth_png(file, depth, flags_.unit);
        range_.clipped += range.clipped;
        range_.farthest = std::max(range_.farthest, range.farthest);
        return;
    }
    const auto channels = static_cast<size_t>(depth.channels);
    std::vector<float> values;
    for (size_t p = 0; p < depth.data.size(); p += channels) values.push_back(depth.data[p]);
    check::write_npy(file, {size_t(depth.height), size_t(depth.width)},
                     std::span<const float>(values));
}

void DepthFiles::print_clipped() const {
    if (range_.clipped == 0) return;
    say("warning: {} pixels of the depth PNGs lie beyond their last step at {:g} world units, up "
        "to {:g}: --depth-unit {:g} holds all, as does --depth npy\n",
        range_.clipped, kDepthSteps * flags_.unit, range_.farthest, unit_for(range_.farthest));
}

namespace {

constexpr const char* kUsualSize = "1280x720";
constexpr int kUsualFps = 30;

// The size that was given, otherwise the path's.
PixelSize film_size(const FilmFlags& flags, const CameraPath& path) {
    if (!flags.size.empty()) return parse_size(flags.size);
    return path.width > 0 ? PixelSize{path.width, path.height} : parse_size(kUsualSize);
}

int film_fps(const FilmFlags& flags, const CameraPath& path) {
    if (flags.fps > 0) return flags.fps;
    return path.fps > 0 ? std::clamp(static_cast<int>(std::lround(path.fps)), 1, 240) : kUsualFps;
}

/// The cameras whose subject the turn circles; those beside the scene may be unreadable.
std::vector<Camera> cameras_of_turn(const RenderFlags& flags) {
    if (!flags.film.around.empty()) return cameras_of(open_cameras(flags.film.around));
    try {
        return cameras_of(cameras_beside(flags.scene));
    } catch (const Error& e) {
        say("warning: {}\n", e.what());
        return {};
    }
}

glm::dvec3 up_of_scene(const RenderFlags& flags, const SplatModel& model,
                       const std::vector<Camera>& cameras, const std::string& stated_up) {
    if (!flags.film.up.empty()) return up_from_name(flags.film.up);
    if (const std::optional<glm::dvec3> held = up_of_cameras(cameras)) return *held;
    return stated_up.empty() ? guess_up(model) : up_from_name(stated_up);
}

CameraPath turn_around(const RenderFlags& render, const PixelSize& size, const SplatModel& model,
                       const std::string& stated_up) {
    const FilmFlags& flags = render.film;
    TurntableOptions options;
    options.seconds = flags.seconds;
    options.fps = film_fps(flags, {});
    options.width = size.width;
    options.height = size.height;
    options.cameras = cameras_of_turn(render);
    options.up = up_of_scene(render, model, options.cameras, stated_up);
    return turntable(model, options);
}

}  // namespace

void add_blur_flags(CLI::App& c, BlurFlags& flags) {
    c.add_option("--aperture", flags.aperture,
                 "depth of field: the radius of the aperture, world units; 0: everything is sharp")
        ->capture_default_str()
        ->check(zero_or_more());
    c.add_option("--focus", flags.focus, "the distance that is sharp, world units")
        ->default_str("that of what is in the middle; in a film, of its first frame")
        ->check(above_zero());
    c.add_option("--shutter", flags.shutter,
                 "motion blur of a film: the shutter is open for DEGREES/360 of a frame's time; "
                 "180 is usual")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 360.0));
    c.add_option("--samples", flags.samples, "how many sharp pictures a blurred one is the mean of")
        ->default_str(std::to_string(CameraBlur().samples))
        ->check(CLI::Range(2, 4096));
}

void add_orthophoto_flags(CLI::App& c, OrthophotoFlags& flags) {
    c.add_option("--from", flags.from,
                 "the side that an orthophoto is seen from: above, or x, -x, y, -y, z or -z")
        ->check(CLI::IsMember({"above", "x", "-x", "y", "-y", "z", "-z"}))
        ->capture_default_str();
    c.add_option("--pixel", flags.pixel, "side of an orthophoto's pixel, world units")
        ->default_str("so large that the longer side has 2048 px")
        ->check(above_zero());
}

void add_film_flags(CLI::App& c, FilmFlags& flags, CLI::Option* cameras) {
    CLI::Option* const path =
        c.add_option("--path", flags.path,
                     "a camera path that the viewer saved, or a camera_path.json of nerfstudio; "
                     "without it and --cameras the camera goes once around what the scene's "
                     "cameras look at. Both also make a video if ffmpeg is installed");
    path->excludes(cameras);
    c.add_option(
         "--size", flags.size,
         "size of the frames of a path or a turn, of panoramas, or of the faces of a cubemap, "
         "WIDTHxHEIGHT px")
        ->default_str("what nerfstudio's path says, else 1280x720");
    c.add_option("--fps", flags.fps, "frames a second of a path or a turn")
        ->check(CLI::Range(1, 240))
        ->default_str("what nerfstudio's path says, else 30")
        ->excludes(cameras);
    c.add_option("--seconds", flags.seconds, "duration of the turn")
        ->check(CLI::Range(0.1, 600.0))
        ->capture_default_str()
        ->excludes(cameras)
        ->excludes(path);
    c.add_option("--up", flags.up,
                 "up axis of the turn or of an orthophoto: x, -x, y, -y, z or -z (default: as the "
                 "cameras were held, else what the file says, else a guess)")
        ->excludes(cameras)
        ->excludes(path);
    c.add_option("--around", flags.around,
                 "a cameras.json, a transforms.json or a data set: the turn goes around what these "
                 "cameras look at (default: the cameras.json of the scene's run)")
        ->excludes(cameras)
        ->excludes(path);
}

namespace {

Camera first_camera(const CameraPath& path, const PixelSize& size) {
    Navigation view;
    apply(path.sample(0), view);
    return view.camera(size.width, size.height);
}

// Where the orthophoto lies, for programs: in the scene's world.
nlohmann::json orthophoto_json(const Orthophoto& photo, const SplatModel& model, bool on_earth) {
    const glm::dmat3 rows = glm::transpose(photo.axes);
    const auto list = [](const glm::dvec3& v) { return nlohmann::json{v.x, v.y, v.z}; };
    nlohmann::json facts{{"width", photo.width},           {"height", photo.height},
                         {"pixel", photo.pixel},           {"right", list(rows[0])},
                         {"down", list(rows[1])},          {"forward", list(rows[2])},
                         {"top_left", list(photo.corner)}, {"depth", photo.depth}};
    if (model.metres_per_unit > 0) facts["metres_per_unit"] = model.metres_per_unit;
    if (on_earth)
        facts["anchor"] = {{"latitude", model.place.latitude},
                           {"longitude", model.place.longitude},
                           {"altitude", model.place.altitude}};
    return facts;
}

}  // namespace

int render_orthophoto(const RenderFlags& flags, const Accuracy& accuracy,
                      const EffectChoice& choice) {
    if (flags.data.resolution != -1)
        throw Error("-r", "divides the size of cameras, and there are none", "Use --pixel.");
    if (!flags.film.size.empty())
        throw Error("--size", "an orthophoto is as large as the scene", "Use --pixel.");
    SplatFile facts;
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, &facts, flags.units));
    note_unused_choices(flags.accuracy, model.kernel);
    // A scene whose place on earth is known has a map of its own.
    const bool on_earth = model.place.known() && flags.film.up.empty();
    const glm::dmat3 to_world = glm::transpose(model.place.rotation);
    const glm::dvec3 up =
        on_earth ? to_world[2] : up_of_scene(flags, model, cameras_of_turn(flags), facts.up);
    const bool above = flags.orthophoto.from == "above";
    const Orthophoto photo =
        orthophoto_of(model, {.from = above ? up : up_from_name(flags.orthophoto.from),
                              .up = up,
                              .north = on_earth ? to_world[1] : glm::dvec3(0.0),
                              .pixel = flags.orthophoto.pixel});
    const std::optional<std::string> map = world_file(photo, on_earth ? map_of(model) : MapFrame());
    const Paths outputs{flags.output / "orthophoto.png", flags.output / "orthophoto.json",
                        map ? flags.output / "orthophoto.pgw" : std::filesystem::path()};
    refuse_to_overwrite_inputs(outputs, files_of(flags.scene));
    const WrittenFiles written({}, flags.force);
    written.check(outputs);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    std::vector<View> views;
    for (const OrthophotoTile& tile : tiles_of(photo)) views.emplace_back().camera = tile.camera;
    EffectPlan plan =
        plan_rendering(model, views, {.near_plane = tiles_of(photo).front().near_plane}, choice);
    apply_plan(plan, model);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    write_png(outputs[0], draw_orthophoto(photo, [&](const OrthophotoTile& tile) {
                  const ImageF image =
                      renderer.render(tile.camera, background, -1, tile.near_plane);
                  plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
                  return to_8bit(image);
              }));
    write_file_atomic(outputs[1], orthophoto_json(photo, model, on_earth).dump(1) + "\n");
    if (map) write_file_atomic(outputs[2], *map);
    written.wrote(outputs);
    std::FILE* const out = flags.quiet ? nullptr : stdout;
    tell(out, "effects: {}\n", plan_line(plan));
    tell_paths(flags.quiet, outputs);
    tell(out, "{}: {} x {} px of {:g} world units each{}\n", outputs[0].string(), photo.width,
         photo.height, photo.pixel,
         map ? "" : "; no world file, as the picture's sides are no axes of the world");
    return 0;
}

int render_film(const RenderFlags& flags, const Accuracy& accuracy, const EffectChoice& choice) {
    if (!flags.depth.format.empty())
        throw Error("--depth", "goes with --cameras alone", "Name the cameras, or leave it out.");
    if (flags.data.resolution != -1)
        throw Error("-r", "divides the size of cameras, and there are none", "Use --size.");
    if (flags.force)
        throw Error("--force", "does not go with films, which replace only frames of theirs",
                    "Name another folder, or delete the frames.");
    CameraPath path;
    if (!flags.film.path.empty()) path = read_camera_path(flags.film.path);
    say_notes(path.notes);
    const bool all_around = shows_all_around(flags);
    const PixelSize size = all_around ? size_around(flags) : film_size(flags.film, path);
    SplatFile facts;
    SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, &facts, flags.units));
    note_unused_choices(flags.accuracy, model.kernel);
    if (flags.film.path.empty()) path = turn_around(flags, size, model, facts.up);
    DeviceOptions device_options = command_device(flags.device);
    Device device(device_options);
    settle_tuning(device, flags.tune);
    if (!all_around) check_frame(device, size.width, size.height, "--size");
    const float near_plane =
        flags.near_plane ? *flags.near_plane : near_plane_for(scene_bounds(model));
    EffectPlan plan =
        plan_rendering(model, {}, {.near_plane = near_plane, .free_camera = true}, choice);
    apply_plan(plan, model);
    Renderer renderer(device, model, accuracy, plan.projection(), plan.huge_splat_path());
    const glm::vec3 background(flags.white_background ? 1.0f : 0.0f);
    AllAround around(renderer, plan, flags, near_plane);
    ExportOptions options{.folder = flags.output,
                          .fps = film_fps(flags.film, path),
                          .width = size.width,
                          .height = size.height,
                          .panorama = all_around};
    options.blur = blur_of(flags, model, first_camera(path, size), "the film");
    options.blur.shutter = flags.blur.shutter / 360 / options.fps;
    PathExport film(path, options);
    while (!film.done())
        film.step(
            [&](const Camera& camera, const DisplaySettings&) {
                if (all_around) return around.panorama(camera, size);
                const ImageF image = renderer.render(camera, background, -1, near_plane);
                plan.note_frame(renderer.status().huge_splats, renderer.status().longest_list);
                return to_8bit(image);
            },
            true);
    tell(flags.quiet ? nullptr : stdout, "effects: {}\n{}\n", plan_line(plan), film.summary());
    tell_paths(flags.quiet, {flags.output});
    return 0;
}

}  // namespace darb
