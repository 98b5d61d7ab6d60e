// SPDX-License-Identifier: MIT
// Checks what Python passes to a function: each wrong type, shape, order, device or number becomes
// an Error that names the argument and says what it takes. Arrays are views: the floats stay where
// they are and are read while the holder lives.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/core/error.h"

namespace darb::python {

namespace py = pybind11;

constexpr py::ssize_t kAny = -1;  // a length that may be anything

/// float32 in C order, aligned, in host memory.
struct Floats {
    py::array holder;
    const float* data = nullptr;
    std::vector<py::ssize_t> shape;

    std::size_t size() const {
        return data == nullptr ? 0 : static_cast<std::size_t>(holder.size());
    }
    std::span<const float> values() const { return {data, size()}; }
    std::vector<float> copy() const { return {data, data + size()}; }
};

/// Takes any array on the host: numpy's, or one that supports DLPack or the buffer protocol.
py::array take_array(const py::object& value, const char* name);
/// shape: lengths, with kAny for any. Takes numpy arrays, and those that support DLPack or the
/// buffer protocol.
Floats take_floats(const py::object& value, const char* name,
                   std::initializer_list<py::ssize_t> shape);
/// Does the same in float64, from float32 or float64, for small arrays such as cameras.
std::vector<double> take_doubles(const py::object& value, const char* name,
                                 std::initializer_list<py::ssize_t> shape,
                                 std::vector<py::ssize_t>* lengths = nullptr);
/// Whether no value is NaN, infinite, below least or above most. Does not need the GIL.
bool are_within(std::span<const float> values, float least, float most);
/// Throws an Error with the place of the first value that is NaN, infinite, below least or above
/// most.
void check_values(const Floats& values, const char* name, float least, float most,
                  const char* hint);

/// An int, or one of numpy's integers.
py::object take_whole_number(const py::object& value, const char* name);
long long take_integer(const py::object& value, const char* name, long long least, long long most);
double take_number(const py::object& value, const char* name, double least, double most);
bool take_flag(const py::object& value, const char* name);
std::string take_text(const py::object& value, const char* name);
/// str or os.PathLike.
std::string take_path(const py::object& value, const char* name);
py::object take_callable(const py::object& value, const char* name);

/// For example "(10, 4)".
std::string shape_text(const std::vector<py::ssize_t>& shape);
/// For messages, for example "is a list".
std::string type_text(const py::object& value);

/// Calls the handlers of Python's signals, such as that of Ctrl-C, and throws what they raise.
/// Works with or without the GIL.
void check_signals();

/// A new array with a copy of the values.
template <class T>
py::array_t<T> to_array(const std::vector<T>& values, std::vector<py::ssize_t> shape) {
    py::array_t<T> array(std::move(shape));
    DARB_CHECK(static_cast<std::size_t>(array.size()) == values.size(), "{} values for {}",
               values.size(), array.size());
    std::copy(values.begin(), values.end(), array.mutable_data());
    return array;
}

/// Does the same without a copy: the array owns the values.
template <class T>
py::array_t<T> into_array(std::vector<T> values, std::vector<py::ssize_t> shape) {
    auto owned = std::make_unique<std::vector<T>>(std::move(values));
    T* const data = owned->data();
    const py::capsule owner(owned.get(),
                            [](void* held) { delete static_cast<std::vector<T>*>(held); });
    const std::size_t size = owned.release()->size();
    py::array_t<T> array(std::move(shape), data, owner);
    DARB_CHECK(static_cast<std::size_t>(array.size()) == size, "{} values for {}", size,
               array.size());
    return array;
}

}  // namespace darb::python
