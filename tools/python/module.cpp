// SPDX-License-Identifier: MIT
// _darb: the module that the package darb (tools/python/darb) is built on. Functions take their
// arguments in a dict where the Python side has names and defaults for them; every mistake is a
// darb.Error.
#include <pybind11/pybind11.h>

#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "tools/python/dataset.h"
#include "tools/python/device.h"
#include "tools/python/kernel.h"
#include "tools/python/mesh.h"
#include "tools/python/rasterize.h"
#include "tools/python/reference.h"
#include "tools/python/scene.h"
#include "tools/python/study.h"
#include "tools/python/trainer.h"

namespace darb::python {

namespace {

// A kind of darb.Error that scripts can also catch as one of Python's own exceptions.
PyObject* kind_of(PyObject* error, const char* name, const char* doc, PyObject* pythons) {
    const py::tuple bases = py::make_tuple(py::handle(error), py::handle(pythons));
    return PyErr_NewExceptionWithDoc(name, doc, bases.ptr(), nullptr);
}

// Turns an Error of the engine into the Python exception, with its parts.
void translate_errors(py::module_& module) {
    static PyObject* type = PyErr_NewExceptionWithDoc(
        "darb.Error",
        "What was wrong, where, and what to do: the words of the command. Attributes: where, "
        "reason, hint.",
        PyExc_ValueError, nullptr);
    static PyObject* no_room =
        kind_of(type, "darb.NoRoom", "No memory, of the device, of the host or within a budget.",
                PyExc_MemoryError);
    static PyObject* lost =
        kind_of(type, "darb.DeviceLost", "The device is gone: nothing on it can be used any more.",
                PyExc_RuntimeError);
    module.attr("Error") = py::handle(type);
    module.attr("NoRoom") = py::handle(no_room);
    module.attr("DeviceLost") = py::handle(lost);
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Error& error) {
            const auto text = [](const std::string& s) {
                return py::reinterpret_steal<py::object>(
                    PyUnicode_DecodeUTF8(s.data(), static_cast<py::ssize_t>(s.size()), "replace"));
            };
            PyObject* const kind = dynamic_cast<const NoRoom*>(&error) != nullptr       ? no_room
                                   : dynamic_cast<const DeviceLost*>(&error) != nullptr ? lost
                                                                                        : type;
            const py::object instance = py::handle(kind)(text(error.what()));
            instance.attr("where") = text(error.where);
            instance.attr("reason") = text(error.reason);
            instance.attr("hint") = text(error.hint);
            PyErr_SetObject(kind, instance.ptr());
        }
    });
}

}  // namespace

}  // namespace darb::python

namespace darb::python {

namespace {

ImageU8 take_picture(const py::object& value) {
    const py::array array = py::array::ensure(value);
    if (array && py::isinstance<py::array_t<std::uint8_t>>(array) && array.ndim() == 3 &&
        array.shape(2) == 3 && array.size() > 0) {
        const auto bytes = py::array_t<std::uint8_t, py::array::c_style>::ensure(array);
        ImageU8 image(static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)), 3);
        std::copy_n(bytes.data(), image.data.size(), image.data.begin());
        return image;
    }
    const Floats floats = take_floats(value, "image", {kAny, kAny, 3});
    if (floats.size() == 0) throw Error("image", "has no pixel", "Give [H, W, 3].");
    check_values(floats, "image", -1e30f, 1e30f, "Check what it was computed from.");
    ImageF image(static_cast<int>(floats.shape[1]), static_cast<int>(floats.shape[0]), 3);
    std::copy_n(floats.data, floats.size(), image.data.begin());
    return to_8bit(image);
}

void bind_pictures(py::module_& module) {
    module.def("write_png", [](const py::object& path, const py::object& image) {
        const std::string file = take_path(path, "path");
        const ImageU8 picture = take_picture(image);
        const py::gil_scoped_release free;
        write_png(file, picture);
    });
    module.def("encode_png", [](const py::object& image) {
        const std::vector<std::byte> file = encode_png(take_picture(image));
        return py::bytes(reinterpret_cast<const char*>(file.data()), file.size());
    });
}

}  // namespace

}  // namespace darb::python

PYBIND11_MODULE(_darb, module) {
    using namespace darb::python;
    // This is a function because a second interpreter gets a copy of the module and does not come
    // here.
    module.def("check_interpreter", [] {
        if (PyInterpreterState_Get() != PyInterpreterState_Main())
            throw py::import_error(
                "darb works in the main interpreter alone: import it there, or start a process");
    });
    module.attr("__version__") = DARB_VERSION;
    translate_errors(module);
    bind_device(module);
    bind_kernel(module);
    bind_scene(module);
    bind_rasterize(module);
    bind_mesh(module);
    bind_dataset(module);
    bind_trainer(module);
    bind_study(module);
    bind_reference(module);
    bind_pictures(module);
}
