// SPDX-License-Identifier: MIT
#include "tools/python/dataset.h"

#include <fmt/format.h>

#include "engine/data/camera_list.h"
#include "tools/python/cameras.h"

namespace darb::python {

namespace {

const View& view_at(const PyDataset& set, const py::object& index) {
    const auto count = static_cast<long long>(set.data.views.size());
    long long i = take_integer(index, "view", -count, count - 1);
    if (i < 0) i += count;
    return set.data.views[static_cast<std::size_t>(i)];
}

// One array for all views: [V, rows, columns] of what `one` makes from a camera.
template <class One>
py::object stacked(const PyDataset& set, const One& one) {
    py::list all;
    for (const View& view : set.data.views) all.append(one(view.camera));
    if (all.empty()) throw Error("cameras", "there are none", "Check what was read.");
    return py::module_::import("numpy").attr("stack")(all);
}

constexpr const char* kView =
    "A view by number, from the end where it is below 0: a dict of name, photo (its path), viewmat "
    "[4, 4], K [3, 3] (px), width, height (px), is_test and has_lens (whether more than a "
    "pinhole).";

py::dict view_dict(const View& view) {
    py::dict d;
    d["name"] = view.name;
    d["photo"] = py::module_::import("os").attr("fsdecode")(py::bytes(view.photo.string()));
    d["viewmat"] = viewmat_of(view.camera);
    d["K"] = intrinsics_of(view.camera);
    d["width"] = view.camera.width;
    d["height"] = view.camera.height;
    d["is_test"] = view.is_test;
    d["has_lens"] = view.camera.lens.active;
    return d;
}

py::array photo_array(const PyDataset& set, const py::object& index) {
    const View& view = view_at(set, index);
    if (view.photo.empty())
        throw Error(view.name, "has no photo", "Its camera is there all the same.");
    ImageU8 photo;
    {
        const py::gil_scoped_release free;
        photo = load_photo(view);
    }
    return to_array(photo.data, {photo.height, photo.width, photo.channels});
}

}  // namespace

PyDataset read_dataset(const py::object& path, const py::dict& options) {
    const std::string folder = take_path(path, "path");
    DatasetOptions o;
    o.resolution = static_cast<int>(take_integer(options["resolution"], "resolution", -1, 1 << 20));
    o.hold_out = take_flag(options["eval"], "eval");
    o.images_folder = take_path(options["images"], "images");
    const std::string lens = take_text(options["lens"], "lens");
    if (lens != "auto" && lens != "undistort" && lens != "original")
        throw Error("lens " + lens, "no such choice", "Use auto, undistort or original.");
    o.original_lens = lens == "original";
    o.original_where_wide = lens == "auto";
    const py::gil_scoped_release free;
    return {load_dataset(folder, o)};
}

void bind_dataset(py::module_& module) {
    module.def("cameras", [](const py::object& path) {
        const std::string file = take_path(path, "path");
        PyDataset list;
        {
            const py::gil_scoped_release free;
            list.data.views = load_cameras(file);
        }
        return list;
    });
    py::class_<PyDataset>(module, "Dataset", "Photos with cameras; see darb.Dataset.")
        .def_static("_read", &read_dataset)
        .def("__len__", [](const PyDataset& s) { return s.data.views.size(); })
        .def(
            "view",
            [](const PyDataset& s, const py::object& i) { return view_dict(view_at(s, i)); },
            py::arg("index"), kView)
        .def("photo", &photo_array, py::arg("index"),
             "uint8 [H, W, 4] of a view: RGB, and alpha, which is 0 where it is masked or empty.")
        .def_property_readonly(
            "source", [](const PyDataset& s) { return s.data.source; }, "What was read, as text.")
        .def_property_readonly(
            "notes", [](const PyDataset& s) { return s.data.notes; },
            "What was found odd while reading: a list of str.")
        .def_property_readonly(
            "alpha_is_mask", [](const PyDataset& s) { return s.data.alpha_is_mask; },
            "Whether pixels of alpha 0 are left out of the loss, and not the background.")
        .def_property_readonly(
            "viewmats", [](const PyDataset& s) { return stacked(s, viewmat_of); },
            "[V, 4, 4] float64, world to camera: x right, y down, z forward.")
        .def_property_readonly(
            "Ks", [](const PyDataset& s) { return stacked(s, intrinsics_of); },
            "[V, 3, 3] float64, px of the photos as they are read.")
        .def_property_readonly(
            "points",
            [](const PyDataset& s) {
                const PointCloud& p = s.data.points;
                return to_array(p.position, {static_cast<py::ssize_t>(p.size()), 3});
            },
            "[P, 3] float64, world units.")
        .def_property_readonly(
            "point_colors",
            [](const PyDataset& s) {
                const PointCloud& p = s.data.points;
                return to_array(p.colour, {static_cast<py::ssize_t>(p.size()), 3});
            },
            "[P, 3] uint8, RGB.");
}

}  // namespace darb::python
