// SPDX-License-Identifier: MIT
#include "tools/python/rasterize.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <type_traits>
#include <utility>

#include "engine/kernels/kernel_family.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/raster/frame_view.h"
#include "tools/python/cameras.h"
#include "tools/python/kernel.h"
#include "tools/python/scene.h"
#include "tools/python/splat_arrays.h"

namespace darb::python {

namespace {

constexpr float kMostFloat = std::numeric_limits<float>::max();

int take_preset(const py::object& value) {
    const std::string name = take_text(value, "accuracy");
    if (const auto preset = preset_from_name(name)) return *preset;
    throw Error("accuracy " + name, "no such preset", "Use fast, balanced or exact.");
}

RendererKey key_of(const SplatModel& header, const Pictures& pictures,
                   const SplatArraysGiven* given, bool camera) {
    RendererKey key;
    key.kernel = header.kernel;
    key.footprint = header.footprint;
    key.antialias = header.antialias;
    key.linear = given != nullptr;
    key.direct_colour = given != nullptr && given->direct_colour;
    key.camera = camera;
    key.preset = pictures.preset;
    return key;
}

// Copies the caller's arrays into the buffers of an earlier call, if that had as many splats.
void put(KeptRenderer& kept, const SplatArraysGiven& given) {
    GradientRenderer& renderer = kept.renderer;
    if (!renderer.holds(given.count(), given.header.sh_degree))
        return renderer.replace(given.model());
    if (renderer.set_values(given.values(), SplatArraysGiven::accepts)) return;
    given.check_values();
    throw Error("splats", "changed while they were read", "Do not write to them during a call.");
}

// The renderer with the splats of a call on the device. drawn: the number of a picture of these
// splats. If it is the last one drawn, the splats are there already.
KeptRenderer& ready(PyDevice& device, const RendererKey& key, const SplatArraysGiven* given,
                    PyScene* scene, std::uint64_t drawn = 0) {
    if (scene != nullptr) return scene->renderer(key);
    KeptRenderer* const kept = device.renderers().find(key);
    if (kept == nullptr) return device.renderers().make(device.device(), key, given->model());
    if (drawn != 0 && kept->picture == drawn) {
        given->check_values();
        return *kept;
    }
    kept->picture = 0;
    put(*kept, *given);
    return *kept;
}

PyScene* scene_of(const std::shared_ptr<PyDevice>& device, const py::dict& options) {
    const py::object first = options["means"];
    if (!py::isinstance<PyScene>(first)) return nullptr;
    for (const char* other : {"quats", "scales", "opacities", "colors", "sh", "shapes", "kernel",
                              "footprint", "antialiased"})
        if (!options[other].is_none())
            throw Error(other, "is given beside a Scene, which has its own",
                        "Leave it out, or change the Scene.");
    auto* const scene = first.cast<PyScene*>();
    scene->lie_on(device);
    return scene;
}

// The images of all cameras one after another; a single one is not copied.
py::array image_array(std::vector<ImageF> images, bool with_channels) {
    const ImageF& first = images.front();
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(images.size()), first.height,
                                   first.width};
    if (with_channels) shape.push_back(first.channels);
    if (images.size() == 1) return into_array(std::move(images.front().data), std::move(shape));
    py::array_t<float> array(std::move(shape));
    float* to = array.mutable_data();
    for (ImageF& one : images) {
        const ImageF image = std::exchange(one, {});
        to = std::copy(image.data.begin(), image.data.end(), to);
    }
    return array;
}

// The first channel of [H][W][2].
ImageF depth_alone(const ImageF& both) {
    ImageF depth(both.width, both.height, 1);
    for (std::size_t i = 0; i < depth.data.size(); ++i) depth.data[i] = both.data[2 * i];
    return depth;
}

ImageF one_image(const Floats& all, std::size_t camera, const Pictures& p, int channels) {
    ImageF image(p.width(), p.height(), channels);
    const std::size_t size = image.data.size();
    std::copy_n(all.data + camera * size, size, image.data.begin());
    return image;
}

py::tuple rasterize(const std::shared_ptr<PyDevice>& device, const py::dict& options) {
    const Pictures pictures = take_pictures(options);
    PyScene* const scene = scene_of(device, options);
    std::optional<SplatArraysGiven> given;
    if (scene == nullptr) given = take_splats(options);
    std::unique_lock<std::recursive_timed_mutex> lock;
    KeptRenderer* kept = nullptr;
    {
        const py::gil_scoped_release free;
        lock = device->lock();
        check_frame(device->device(), pictures.width(), pictures.height());
        const SplatModel& header = scene != nullptr ? scene->model() : given->header;
        const SplatArraysGiven* const arrays = given ? &*given : nullptr;
        kept = &ready(*device, key_of(header, pictures, arrays, false), arrays, scene);
    }
    return draw(*device, *kept, pictures);
}

struct Sums {
    SplatArrays<float> d;
    std::vector<double> viewmats, intrinsics, backgrounds;
    std::vector<float> means2d;  // [C][N][2]
    std::vector<float> mean_ndc;
    std::vector<std::uint32_t> shown;
    std::uint64_t bad = 0;
};

template <class T, class More>
void add_into(std::vector<T>& sum, std::vector<More>& more) {
    if constexpr (std::is_same_v<T, More>) {
        if (sum.empty()) return sum.swap(more);
    }
    sum.resize(more.size());
    for (std::size_t i = 0; i < more.size(); ++i) sum[i] += more[i];
}

void add_camera(Sums& sums, const ViewGradients& view) {
    for (int c = 0; c < 3; ++c) sums.backgrounds.push_back(view.d_background[c]);
    if (!view.d_camera) return;
    const CameraGradient& d = *view.d_camera;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            sums.viewmats.push_back(d.d_rotation[column][row]);
        sums.viewmats.push_back(d.d_translation[row]);
    }
    sums.viewmats.insert(sums.viewmats.end(), 4, 0.0);
    for (const double value : {d.d_fx, 0.0, d.d_cx, 0.0, d.d_fy, d.d_cy, 0.0, 0.0, 0.0})
        sums.intrinsics.push_back(value);
}

void add_view(Sums& sums, ViewGradients view) {
    for (int a = 0; a < kAttributeCount; ++a)
        add_into(attribute_values(sums.d, a), attribute_values(view.d, a));
    add_into(sums.mean_ndc, view.mean_gradient_ndc);
    add_into(sums.shown, view.shown);
    sums.bad += view.status.bad_gradients;
    sums.means2d.insert(sums.means2d.end(), view.d_mean.begin(), view.d_mean.end());
    add_camera(sums, view);
}

std::vector<float> harmonics(const SplatArrays<float>& d, int degree) {
    const auto bands = static_cast<std::size_t>((degree + 1) * (degree + 1));
    std::vector<float> all;
    all.reserve(d.sh_dc.size() * bands);
    const std::size_t rest = 3 * (bands - 1);
    for (std::size_t i = 0; i < d.sh_dc.size() / 3; ++i) {
        all.insert(all.end(), d.sh_dc.begin() + static_cast<std::ptrdiff_t>(3 * i),
                   d.sh_dc.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
        all.insert(all.end(), d.sh_rest.begin() + static_cast<std::ptrdiff_t>(rest * i),
                   d.sh_rest.begin() + static_cast<std::ptrdiff_t>(rest * (i + 1)));
    }
    return all;
}

std::vector<float> narrowed(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

py::dict gradients_dict(const Sums& sums, int kernel, int sh_degree, const Pictures& pictures,
                        const SplatArraysGiven* given) {
    const auto n = static_cast<py::ssize_t>(sums.mean_ndc.size());
    const auto c = static_cast<py::ssize_t>(pictures.cameras.size());
    const py::ssize_t bands = (sh_degree + 1) * (sh_degree + 1);
    py::dict d;
    d["means"] = to_array(sums.d.position, {n, 3});
    d["quats"] = to_array(sums.d.rotation, {n, 4});
    d[given ? "scales" : "log_scales"] = to_array(sums.d.log_scale, {n, 3});
    d[given ? "opacities" : "opacity_logits"] =
        to_array(attribute_values(sums.d, ATTRIBUTE_OPACITY_LOGIT), {n});
    if (given && given->direct_colour)
        d["colors"] = to_array(sums.d.sh_dc, {n, 3});
    else
        d["sh"] = to_array(harmonics(sums.d, sh_degree), {n, bands, 3});
    if (kernel_has_shape(kernel)) d["shapes"] = to_array(sums.d.shape, {n});
    d["backgrounds"] = to_array(narrowed(sums.backgrounds), {c, 3});
    if (!sums.viewmats.empty()) {
        d["viewmats"] = to_array(narrowed(sums.viewmats), {c, 4, 4});
        d["Ks"] = to_array(narrowed(sums.intrinsics), {c, 3, 3});
        d["means2d"] = to_array(sums.means2d, {c, n, 2});
    }
    d["means_ndc_norm"] = to_array(sums.mean_ndc, {n});
    d["shown"] = to_array(sums.shown, {n});
    d["not_finite"] = sums.bad;
    return d;
}

// Handles the cameras one after another. A picture that is still there is not drawn again.
py::dict rasterize_backward(const std::shared_ptr<PyDevice>& device, const py::dict& options,
                            const py::object& d_image, const py::object& d_alpha,
                            const py::object& picture, const py::object& with_camera) {
    const Pictures pictures = take_pictures(options);
    PyScene* const scene = scene_of(device, options);
    std::optional<SplatArraysGiven> given;
    if (scene == nullptr) given = take_splats(options);
    const auto count = static_cast<py::ssize_t>(pictures.cameras.size());
    const Floats of_image =
        take_floats(d_image, "d_image", {count, pictures.height(), pictures.width(), 3});
    std::optional<Floats> of_alpha;
    if (!d_alpha.is_none())
        of_alpha = take_floats(d_alpha, "d_alpha", {count, pictures.height(), pictures.width()});
    const auto drawn = static_cast<std::uint64_t>(take_integer(picture, "picture", 0, 1LL << 62));
    const bool camera = take_flag(with_camera, "camera");
    Sums sums;
    const SplatArraysGiven* const arrays = given ? &*given : nullptr;
    int sh_degree = 0, kernel = 0;
    {
        const py::gil_scoped_release free;
        const auto lock = device->lock();
        const SplatModel& header = scene != nullptr ? scene->model() : given->header;
        sh_degree = header.sh_degree;
        kernel = header.kernel;
        KeptRenderer& kept =
            ready(*device, key_of(header, pictures, arrays, camera), arrays, scene, drawn);
        const bool there = scene == nullptr && drawn != 0 && kept.picture == drawn && count == 1;
        kept.renderer.set_view(pictures.sh_degree, pictures.near_plane);
        for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
            check_signals();
            kept.picture = 0;
            if (!there) kept.renderer.render(pictures.cameras[c], pictures.backgrounds[c]);
            add_view(sums, kept.renderer.backward(
                               one_image(of_image, c, pictures, 3),
                               of_alpha ? one_image(*of_alpha, c, pictures, 1) : ImageF()));
        }
    }
    return gradients_dict(sums, kernel, sh_degree, pictures, arrays);
}

}  // namespace

Pictures take_pictures(const py::dict& options) {
    Pictures p;
    const auto width = static_cast<int>(take_integer(options["width"], "width", 1, 1 << 20));
    const auto height = static_cast<int>(take_integer(options["height"], "height", 1, 1 << 20));
    p.cameras = take_cameras(options["viewmats"], options["Ks"], width, height);
    p.backgrounds = take_backgrounds(options["background"], p.cameras.size());
    if (!options["sh_degree"].is_none())
        p.sh_degree = static_cast<int>(take_integer(options["sh_degree"], "sh_degree", 0, 3));
    p.near_plane = static_cast<float>(take_number(options["near"], "near", 1e-6, kMostFloat));
    p.preset = take_preset(options["accuracy"]);
    p.depth = take_flag(options["depth"], "depth");
    if (p.depth && preset_accuracy(p.preset).value(kStorage) != STORAGE_FLOAT32)
        throw Error("depth", "is not there with accuracy fast, whose 16-bit storage holds none",
                    "Use balanced or exact.");
    return p;
}

py::tuple draw(PyDevice& device, KeptRenderer& kept, const Pictures& pictures) {
    std::vector<ImageF> images, alphas, depths;
    std::vector<std::uint32_t> visible, intersections;
    double device_ms = 0, frame_ms = 0;
    const std::uint64_t number = device.next_picture();
    {
        const py::gil_scoped_release free;
        GradientRenderer& renderer = kept.renderer;
        renderer.set_view(pictures.sh_degree, pictures.near_plane);
        for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
            if (c > 0) check_signals();
            kept.picture = 0;
            const auto begin = std::chrono::steady_clock::now();
            renderer.render(pictures.cameras[c], pictures.backgrounds[c]);
            frame_ms +=
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
                    .count();
            images.push_back(renderer.release_image());
            alphas.push_back(renderer.release_alpha());
            visible.push_back(renderer.status().visible);
            intersections.push_back(renderer.status().intersections);
            for (const PassTime& pass : renderer.pass_times()) device_ms += pass.ms;
            if (pictures.depth)
                depths.push_back(depth_alone(renderer.depth()));
            else
                kept.picture = number;
        }
    }
    const auto count = static_cast<py::ssize_t>(pictures.cameras.size());
    py::dict info;
    info["visible"] = to_array(visible, {count});
    info["intersections"] = to_array(intersections, {count});
    info["device_ms"] = device_ms;
    info["frame_ms"] = frame_ms;
    info["picture"] = number;
    if (pictures.depth) info["depth"] = image_array(std::move(depths), false);
    return py::make_tuple(image_array(std::move(images), true),
                          image_array(std::move(alphas), false), info);
}

void bind_rasterize(py::module_& module) {
    module.def("rasterize", &rasterize);
    module.def("rasterize_backward", &rasterize_backward);
}

}  // namespace darb::python
