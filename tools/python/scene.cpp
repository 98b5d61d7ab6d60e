// SPDX-License-Identifier: MIT
#include "tools/python/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/kernels/kernel_family.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_model.h"
#include "tools/python/kernel.h"
#include "tools/python/splat_arrays.h"

namespace darb::python {

PyScene::PyScene(SplatModel model) : model_(std::move(model)) {
    check_splat_shapes(model_);
}

void PyScene::set_values(int attribute, const Floats& values) {
    change([&] {
        std::copy_n(values.data, values.size(), attribute_values(model_, attribute).begin());
        ++changes_;
    });
}

void PyScene::set_drawing(int kernel, Footprint footprint, bool antialias) {
    if (footprint == Footprint::exact && !has_exact_footprint(kernel))
        throw Error("footprint exact",
                    fmt::format("is not there for the kernel {}", kernel_name(kernel)),
                    "Use psi, or a kernel of one pulse.");
    change([&] {
        set_kernel(model_, kernel);
        model_.footprint = footprint;
        model_.antialias = antialias;
        ++changes_;
    });
}

PyScene::~PyScene() {
    if (!device_) return;
    const py::gil_scoped_release free;
    device_->let_go([this] { renderers_.clear(); }, [this] { renderers_.leak(); });
}

void PyScene::lie_on(const std::shared_ptr<PyDevice>& device) {
    if (device_ && device_ != device)
        throw Error("scene", "lies on " + device_->info().name + " already",
                    "Read it once for each device.");
    device_ = device;
}

void PyScene::change(const std::function<void()>& change) {
    if (!device_) return change();
    const py::gil_scoped_release free;
    const auto lock = device_->lock();
    change();
}

KeptRenderer& PyScene::renderer(const RendererKey& key) {
    KeptRenderer* kept = renderers_.find(key);
    const bool made = kept == nullptr;
    if (made) kept = &renderers_.make(device_->device(), key, model_);
    for (auto& [drawn_as, changes] : uploaded_) {
        if (drawn_as != key) continue;
        if (changes != changes_ && !made) kept->renderer.replace(model_);
        changes = changes_;
        return *kept;
    }
    uploaded_.emplace_back(key, changes_);
    return *kept;
}

namespace {

// A view of the model's own floats, which live as long as the scene.
py::array view_of(const py::object& scene, const std::vector<float>& values,
                  std::vector<py::ssize_t> shape) {
    py::array_t<float> array(std::move(shape), values.data(), scene);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

PyScene& scene_in(const py::object& self) {
    return self.cast<PyScene&>();
}

template <int Attribute>
void bind_attribute(py::class_<PyScene>& scene, const char* name, const char* doc) {
    const auto shape = [](const SplatModel& model) {
        const auto n = static_cast<py::ssize_t>(model.size());
        const auto floats = static_cast<py::ssize_t>(model.floats(Attribute));
        if constexpr (Attribute == kOpacityLogit || Attribute == kShape)
            return std::vector<py::ssize_t>{n};
        if constexpr (Attribute == ATTRIBUTE_SH_REST)
            return std::vector<py::ssize_t>{n, floats / 3, 3};
        return std::vector<py::ssize_t>{n, floats};
    };
    scene.def_property(
        name,
        [shape](const py::object& self) -> py::object {
            const SplatModel& model = scene_in(self).model();
            if (!kernel_takes(model.kernel, Attribute)) return py::none();
            return view_of(self, attribute_values(model, Attribute), shape(model));
        },
        [shape, name](PyScene& self, const py::object& value) {
            const std::vector<py::ssize_t> wanted = shape(self.model());
            if (!kernel_takes(self.model().kernel, Attribute))
                throw Error(
                    name,
                    fmt::format("has no place in the kernel {}", kernel_name(self.model().kernel)),
                    "Assign one that learns a shape, as kernel = \"beta\", first.");
            const Floats floats = wanted.size() == 1 ? take_floats(value, name, {wanted[0]})
                                  : wanted.size() == 2
                                      ? take_floats(value, name, {wanted[0], wanted[1]})
                                      : take_floats(value, name, {wanted[0], wanted[1], wanted[2]});
            constexpr float most = std::numeric_limits<float>::max();
            check_values(floats, name, -most, most, "Check what it was computed from.");
            self.set_values(Attribute, floats);
        },
        doc);
}

// The smallest values that logarithms and logits can hold.
constexpr double kLeastScale = 1e-8, kLeastOpacity = 1e-6;

PyScene scene_of_arrays(const py::dict& options) {
    SplatModel model;
    const Floats means = take_floats(options["means"], "means", {kAny, 3});
    const py::ssize_t n = means.shape[0];
    const Floats quats = take_floats(options["quats"], "quats", {n, 4});
    const Floats scales = take_floats(options["scales"], "scales", {n, 3});
    const Floats opacities = take_floats(options["opacities"], "opacities", {n});
    const Floats sh = take_floats(options["sh"], "sh", {n, kAny, 3});
    constexpr float most = std::numeric_limits<float>::max();
    for (const auto& [values, name] : {std::pair(&means, "means"), {&quats, "quats"}, {&sh, "sh"}})
        check_values(*values, name, -most, most, "Check what it was computed from.");
    check_values(scales, "scales", 0, most, "Scales are standard deviations, not logarithms.");
    check_values(opacities, "opacities", 0, 1, "Opacities are from 0 to 1, not logits.");
    model.sh_degree = degree_of_coefficients(sh.shape[1]);
    model.position = means.copy();
    model.rotation = quats.copy();
    for (const float s : scales.values())
        model.log_scale.push_back(static_cast<float>(std::log(std::max(double(s), kLeastScale))));
    for (const float given : opacities.values()) {
        const double o = std::clamp(double(given), kLeastOpacity, 1 - kLeastOpacity);
        model.opacity_logit.push_back(static_cast<float>(std::log(o / (1 - o))));
    }
    split_harmonics(sh, model.sh_dc, model.sh_rest);
    const int kernel = take_kernel(options["kernel"], "kernel");
    const Floats shapes = take_shapes(options["shapes"], kernel, n);
    check_values(shapes, "shapes", -most, most, "Check what it was computed from.");
    model.shape = shapes.copy();
    set_kernel(model, kernel);
    model.footprint = take_footprint(options["footprint"]);
    model.antialias = take_flag(options["antialiased"], "antialiased");
    PyScene scene(std::move(model));
    scene.set_drawing(scene.model().kernel, scene.model().footprint, scene.model().antialias);
    return scene;
}

PyScene read_scene(const py::object& value) {
    const std::string path = take_path(value, "path");
    const py::gil_scoped_release free;
    return PyScene(load_splats(path));
}

void write_scene(const PyScene& scene, const py::object& value) {
    const std::string path = take_path(value, "path");
    const auto format = format_to_write(path);
    if (!format)
        throw Error(path, "has the name of no splat file that can be written",
                    "End it in " + endings_to_write() + ".");
    SplatModel model = scene.model();
    const py::gil_scoped_release free;
    drop_unwritable(*format, model);
    save_splats(path, *format, model);
}

}  // namespace

void bind_scene(py::module_& module) {
    py::class_<PyScene> scene(module, "Scene", "A splat scene; see darb.Scene.");
    scene
        .def_static("read", &read_scene, py::arg("path"),
                    "A Scene of a file of any format that `darb` reads.")
        .def_static("from_arrays", &scene_of_arrays)
        .def("write", &write_scene, py::arg("path"),
             "Writes a file of the format that its ending names, as `darb convert` does.")
        .def("__len__", [](const PyScene& s) { return s.model().size(); })
        .def_property_readonly(
            "sh_degree", [](const PyScene& s) { return s.model().sh_degree; },
            "Of the harmonics, 0 to 3: K = (sh_degree + 1)^2 coefficients a colour.")
        .def_property_readonly(
            "origin",
            [](const PyScene& s) {
                const glm::dvec3& o = s.model().origin;
                return py::make_tuple(o.x, o.y, o.z);
            },
            "(x, y, z), world units: what a file adds to means.")
        .def_property(
            "kernel", [](const PyScene& s) { return std::string(kernel_name(s.model().kernel)); },
            [](PyScene& s, const py::object& value) {
                s.set_drawing(take_kernel(value, "kernel"), s.model().footprint,
                              s.model().antialias);
            },
            "The kernel's name; a name of kernel_names() or a Kernel may be assigned.")
        .def_property(
            "footprint",
            [](const PyScene& s) { return std::string(footprint_name(s.model().footprint)); },
            [](PyScene& s, const py::object& value) {
                s.set_drawing(s.model().kernel, take_footprint(value), s.model().antialias);
            },
            "\"psi\" or \"exact\".")
        .def_property(
            "antialiased", [](const PyScene& s) { return s.model().antialias; },
            [](PyScene& s, const py::object& value) {
                s.set_drawing(s.model().kernel, s.model().footprint,
                              take_flag(value, "antialiased"));
            },
            "Whether opacities are compensated for the low-pass of 0.3 px^2.");
    bind_attribute<ATTRIBUTE_POSITION>(scene, "means", "[N, 3] float32, world units.");
    bind_attribute<ATTRIBUTE_LOG_SCALE>(scene, "log_scales",
                                        "[N, 3] float32, natural logarithms of world units.");
    bind_attribute<ATTRIBUTE_ROTATION>(scene, "quats", "[N, 4] float32, w x y z, of any norm.");
    bind_attribute<ATTRIBUTE_OPACITY_LOGIT>(scene, "opacity_logits", "[N] float32.");
    bind_attribute<ATTRIBUTE_SH_DC>(scene, "sh_dc",
                                    "[N, 3] float32: colour = 0.5 + 0.2821 sh_dc + other bands.");
    bind_attribute<ATTRIBUTE_SH_REST>(scene, "sh_rest",
                                      "[N, K - 1, 3] float32, the bands above the first.");
    bind_attribute<ATTRIBUTE_SHAPE>(
        scene, "shapes",
        "[N] float32, of a kernel that learns one: ln(b / 4) of beta; None "
        "with another kernel, and 0 from where one takes such a kernel.");
}

}  // namespace darb::python
