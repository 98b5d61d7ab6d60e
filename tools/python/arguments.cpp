// SPDX-License-Identifier: MIT
#include "tools/python/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/core/on_threads.h"

namespace darb::python {

namespace {

constexpr long kDlpackCpu = 1;

[[noreturn]] void no_array(const py::object& value, const char* name) {
    throw Error(name, type_text(value) + ", no array",
                "Give a numpy array of float32, or what has DLPack or the buffer protocol.");
}

py::object numpy() {
    return py::module_::import("numpy");
}

// The error of a library about its own array becomes the reason.
template <class Convert>
py::array converted(const char* name, const Convert& convert) {
    try {
        return py::reinterpret_steal<py::array>(convert().release());
    } catch (py::error_already_set& e) {
        if (!e.matches(PyExc_Exception)) throw;
        throw Error(name, std::string(py::str(e.value())),
                    "Give an array whose memory is there, on the host; of torch: "
                    "tensor.detach().cpu(), or call darb.torch.rasterize.");
    }
}

bool has_flag(const py::array& array, int flag) {
    return (array.flags() & flag) == flag;
}

std::string dtype_text(const py::array& array) {
    return std::string(py::str(array.dtype()));
}

std::vector<py::ssize_t> shape_of(const py::array& array) {
    return {array.shape(), array.shape() + array.ndim()};
}

void check_shape(const py::array& array, const char* name,
                 std::initializer_list<py::ssize_t> wanted) {
    const std::vector<py::ssize_t> shape = shape_of(array);
    bool fits = shape.size() == wanted.size();
    for (std::size_t i = 0; fits && i < shape.size(); ++i) {
        const py::ssize_t one = wanted.begin()[i];
        fits = one == kAny || shape[i] == one;
    }
    if (fits) return;
    std::string text;
    for (const py::ssize_t one : wanted)
        text += (text.empty() ? "" : ", ") +
                (one == kAny ? std::string("any") : fmt::format("{}", one));
    throw Error(name,
                fmt::format("has the shape {}, not ({}{})", shape_text(shape), text,
                            wanted.size() == 1 ? "," : ""),
                "Check the order of the arguments, and the arrays' axes.");
}

// The loop has a fixed length and no early exit, so that compilers take several values at once.
constexpr std::size_t kBlock = 128, kFloatsOfPiece = 2048 * kBlock;
bool block_is_within(const float* values, float least, float most) {
    int inside = 1;
    for (std::size_t i = 0; i < kBlock; ++i)
        inside &= int(values[i] >= least) & int(values[i] <= most);
    return inside != 0;
}

// The exponent of infinity and NaN is all ones, and one more reaches the sign.
bool block_is_finite(const float* values) {
    constexpr std::uint32_t kExponent = 0x7f800000, kOne = 0x00800000, kSign = 0x80000000;
    std::uint32_t all = 0;
    for (std::size_t i = 0; i < kBlock; ++i)
        all |= (std::bit_cast<std::uint32_t>(values[i]) & kExponent) + kOne;
    return (all & kSign) == 0;
}

void check_layout(const py::array& array, const char* name) {
    if (!has_flag(array, py::array::c_style) ||
        !has_flag(array, py::detail::npy_api::NPY_ARRAY_ALIGNED_))
        throw Error(
            name, "is not in C order, row by row without gaps",
            fmt::format("Give numpy.ascontiguousarray({}), of torch tensor.contiguous().", name));
}

}  // namespace

py::array take_array(const py::object& value, const char* name) {
    if (py::isinstance<py::array>(value)) return py::reinterpret_borrow<py::array>(value);
    if (py::hasattr(value, "__dlpack__") && py::hasattr(value, "__dlpack_device__"))
        return converted(name, [&] {
            const py::tuple device = value.attr("__dlpack_device__")();
            if (device[0].cast<long>() != kDlpackCpu)
                throw Error(name, "lies on another device, not in memory of the host",
                            "Copy it: tensor.cpu().");
            return py::object(numpy().attr("from_dlpack")(value));
        });
    if (PyObject_CheckBuffer(value.ptr()) != 0)
        return converted(name, [&] {
            const py::object view =
                py::reinterpret_steal<py::object>(PyMemoryView_FromObject(value.ptr()));
            if (!view) throw py::error_already_set();
            return py::object(numpy().attr("asarray")(view));
        });
    no_array(value, name);
}

std::string shape_text(const std::vector<py::ssize_t>& shape) {
    std::string text;
    for (const py::ssize_t one : shape) text += fmt::format("{}{}", text.empty() ? "" : ", ", one);
    return fmt::format("({}{})", text, shape.size() == 1 ? "," : "");
}

std::string type_text(const py::object& value) {
    return value.is_none() ? std::string("is None")
                           : fmt::format("is of the type {}", Py_TYPE(value.ptr())->tp_name);
}

Floats take_floats(const py::object& value, const char* name,
                   std::initializer_list<py::ssize_t> shape) {
    Floats floats;
    floats.holder = take_array(value, name);
    check_shape(floats.holder, name, shape);
    if (!py::isinstance<py::array_t<float>>(floats.holder))
        throw Error(name, "is of " + dtype_text(floats.holder) + ", not float32",
                    fmt::format("Give {}.astype(numpy.float32), of torch tensor.float().", name));
    check_layout(floats.holder, name);
    floats.data = static_cast<const float*>(floats.holder.data());
    floats.shape = shape_of(floats.holder);
    return floats;
}

std::vector<double> take_doubles(const py::object& value, const char* name,
                                 std::initializer_list<py::ssize_t> shape,
                                 std::vector<py::ssize_t>* lengths) {
    const py::array array = take_array(value, name);
    check_shape(array, name, shape);
    if (lengths != nullptr) *lengths = shape_of(array);
    const auto size = static_cast<std::size_t>(array.size());
    std::vector<double> values;
    if (py::isinstance<py::array_t<double>>(array)) {
        check_layout(array, name);
        const auto* data = static_cast<const double*>(array.data());
        values.assign(data, data + size);
    } else if (py::isinstance<py::array_t<float>>(array)) {
        check_layout(array, name);
        const auto* data = static_cast<const float*>(array.data());
        values.assign(data, data + size);
    } else {
        throw Error(name, "is of " + dtype_text(array) + ", not float32 or float64",
                    fmt::format("Give {}.astype(numpy.float32).", name));
    }
    for (std::size_t i = 0; i < size; ++i)
        if (!std::isfinite(values[i]))
            throw Error(name, fmt::format("has {} as value {}", values[i], i),
                        "Check what it was computed from.");
    return values;
}

bool are_within(std::span<const float> values, float least, float most) {
    constexpr float kMost = std::numeric_limits<float>::max();
    const bool any_number = least == -kMost && most == kMost;
    std::size_t i = 0;
    for (; i + kBlock <= values.size(); i += kBlock) {
        const float* const block = values.data() + i;
        if (!(any_number ? block_is_finite(block) : block_is_within(block, least, most)))
            return false;
    }
    return std::all_of(values.begin() + static_cast<std::ptrdiff_t>(i), values.end(),
                       [&](float v) { return v >= least && v <= most; });
}

void check_values(const Floats& values, const char* name, float least, float most,
                  const char* hint) {
    const std::size_t size = values.size();
    std::atomic<bool> all{true};
    in_pieces(size, kFloatsOfPiece, [&](std::size_t first, std::size_t count) {
        if (!are_within(values.values().subspan(first, count), least, most)) all = false;
    });
    if (all) return;
    for (std::size_t i = 0; i < size; ++i) {
        const float v = values.data[i];
        if (v >= least && v <= most) continue;  // false for NaN
        std::string place;
        std::size_t rest = i;
        for (auto n = values.shape.rbegin(); n != values.shape.rend(); ++n) {
            const auto length = static_cast<std::size_t>(*n);
            place = fmt::format("{}{}{}", rest % length, place.empty() ? "" : ", ", place);
            rest /= length;
        }
        throw Error(name, fmt::format("is {} at [{}]", v, place), hint);
    }
}

py::object take_whole_number(const py::object& value, const char* name) {
    if (PyBool_Check(value.ptr()) == 0 && PyIndex_Check(value.ptr()) != 0) {
        // Arrays of several numbers have an __index__, too, but it fails.
        if (auto number = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr())))
            return number;
        PyErr_Clear();
    }
    throw Error(name, type_text(value) + ", no whole number", "Give an int.");
}

long long take_integer(const py::object& value, const char* name, long long least, long long most) {
    const py::object number = take_whole_number(value, name);
    int overflow = 0;
    const long long result = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
    if (overflow != 0 || result < least || result > most)
        throw Error(name, fmt::format("is {}", std::string(py::str(number))),
                    fmt::format("It goes from {} to {}.", least, most));
    return result;
}

double take_number(const py::object& value, const char* name, double least, double most) {
    const bool is_number = PyFloat_Check(value.ptr()) != 0 ||
                           (PyBool_Check(value.ptr()) == 0 && PyIndex_Check(value.ptr()) != 0) ||
                           py::hasattr(value, "__float__");
    if (!is_number || py::isinstance<py::str>(value) || PyBool_Check(value.ptr()) != 0)
        throw Error(name, type_text(value) + ", no number", "Give a float.");
    const double result = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() != nullptr) {
        PyErr_Clear();
        throw Error(name, type_text(value) + ", no number", "Give a float.");
    }
    if (!(result >= least && result <= most))
        throw Error(name, fmt::format("is {}", result),
                    fmt::format("It goes from {} to {}.", least, most));
    return result;
}

bool take_flag(const py::object& value, const char* name) {
    if (PyBool_Check(value.ptr()) == 0)
        throw Error(name, type_text(value) + ", neither True nor False", "Give a bool.");
    return value.ptr() == Py_True;
}

std::string take_text(const py::object& value, const char* name) {
    if (!py::isinstance<py::str>(value))
        throw Error(name, type_text(value) + ", no text", "Give a str.");
    py::ssize_t size = 0;
    const char* text = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
    if (text == nullptr) {
        PyErr_Clear();
        throw Error(name, "is text that UTF-8 does not hold", "Give other text.");
    }
    return {text, static_cast<std::size_t>(size)};
}

std::string take_path(const py::object& value, const char* name) {
    if (!py::isinstance<py::str>(value) && !py::hasattr(value, "__fspath__"))
        throw Error(name, type_text(value) + ", no path", "Give a str or a pathlib.Path.");
    const py::object text = py::module_::import("os").attr("fsdecode")(value);
    // Names that are not UTF-8 come back as the bytes that they are.
    const std::string path = py::bytes(py::module_::import("os").attr("fsencode")(text));
    if (path.empty() || path.find('\0') != std::string::npos)
        throw Error(name, "is no path: empty, or with a zero in it", "Name a file.");
    return path;
}

py::object take_callable(const py::object& value, const char* name) {
    if (!value.is_none() && PyCallable_Check(value.ptr()) == 0)
        throw Error(name, type_text(value) + ", nothing to call", "Give a function, or None.");
    return value;
}

void check_signals() {
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace darb::python
