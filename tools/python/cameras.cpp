// SPDX-License-Identifier: MIT
#include "tools/python/cameras.h"

#include <fmt/format.h>

#include <cmath>

namespace darb::python {

namespace {

constexpr double kRigid = 1e-3;  // how far R R^T may be from 1, because products of float32 drift

Camera camera_of(const double* m, const double* k, std::size_t index) {
    Camera camera;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            camera.rotation[column][row] = m[4 * row + column];
        camera.translation[row] = m[4 * row + 3];
    }
    const glm::dmat3 product = camera.rotation * glm::transpose(camera.rotation);
    double worst = 0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            worst = std::max(worst, std::abs(product[i][j] - (i == j ? 1.0 : 0.0)));
    const bool last_row = m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1;
    if (!(worst <= kRigid) || !(glm::determinant(camera.rotation) > 0) || !last_row)
        throw Error(fmt::format("viewmats[{}]", index),
                    "is no rotation and translation: a mirror, a scale, or another last row than "
                    "0 0 0 1",
                    "Give world to camera, x right, y down, z forward; a matrix of OpenGL needs "
                    "its y and z negated.");
    camera.fx = k[0];
    camera.fy = k[4];
    camera.cx = k[2];
    camera.cy = k[5];
    if (!(k[0] > 0) || !(k[4] > 0) || k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
        throw Error(fmt::format("Ks[{}]", index), "is no pinhole without skew",
                    "Give [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in px, fx and fy above 0.");
    return camera;
}

}  // namespace

std::vector<Camera> take_cameras(const py::object& viewmats, const py::object& Ks, int width,
                                 int height) {
    std::vector<py::ssize_t> lengths;
    const std::vector<double> m = take_doubles(viewmats, "viewmats", {kAny, 4, 4}, &lengths);
    const std::vector<double> k = take_doubles(Ks, "Ks", {lengths[0], 3, 3});
    if (lengths[0] == 0) throw Error("viewmats", "holds no camera", "Give at least one.");
    std::vector<Camera> cameras;
    for (std::size_t i = 0; i < static_cast<std::size_t>(lengths[0]); ++i) {
        cameras.push_back(camera_of(m.data() + 16 * i, k.data() + 9 * i, i));
        cameras.back().width = width;
        cameras.back().height = height;
    }
    return cameras;
}

std::vector<glm::vec3> take_backgrounds(const py::object& background, std::size_t count) {
    if (background.is_none()) return std::vector(count, glm::vec3(0.0f));
    py::object array = background;
    if (py::isinstance<py::tuple>(array) || py::isinstance<py::list>(array)) {
        const py::sequence colour = array;
        std::vector<double> values;
        for (const py::handle one : colour)
            values.push_back(
                take_number(py::reinterpret_borrow<py::object>(one), "background", -1e30, 1e30));
        array = to_array(values, {static_cast<py::ssize_t>(values.size())});
    }
    const bool one = take_array(array, "background").ndim() == 1;
    const std::vector<double> v =
        one ? take_doubles(array, "background", {3})
            : take_doubles(array, "background", {static_cast<py::ssize_t>(count), 3});
    std::vector<glm::vec3> colours;
    for (std::size_t c = 0; c < count; ++c) {
        const double* from = v.data() + (one ? 0 : 3 * c);
        colours.emplace_back(static_cast<float>(from[0]), static_cast<float>(from[1]),
                             static_cast<float>(from[2]));
    }
    return colours;
}

py::array viewmat_of(const Camera& camera) {
    py::array_t<double> m({4, 4});
    auto at = m.mutable_unchecked<2>();
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
            at(row, column) = row == 3      ? (column == 3 ? 1.0 : 0.0)
                              : column == 3 ? camera.translation[row]
                                            : camera.rotation[column][row];
    return m;
}

py::array intrinsics_of(const Camera& camera) {
    const std::vector<double> k{camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
    return to_array(k, {3, 3});
}

}  // namespace darb::python
