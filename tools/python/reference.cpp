// SPDX-License-Identifier: MIT
// darb.reference: the same pictures and gradients in double precision, by the code that darb's own
// tests take as the truth (engine/reference). It runs on the host and is slow.
#include "tools/python/reference.h"

#include <cmath>

#include "engine/reference/reference_render.h"
#include "shaders/shared/attribute_list.h"
#include "tools/python/rasterize.h"
#include "tools/python/splat_arrays.h"

namespace darb::python {

namespace {

double logit(double opacity) {
    return std::log(opacity / (1 - opacity));
}

reference::Splats<double> splats_of(const SplatArraysGiven& given) {
    reference::Splats<double> splats = reference::make_splats<double>(given.model());
    for (double& s : splats.log_scale) s = std::log(s);
    for (double& o : attribute_values(splats, ATTRIBUTE_OPACITY_LOGIT)) o = logit(o);
    if (!given.direct_colour) return splats;
    for (double& c : splats.sh_dc) {
        if (c < 0)
            throw Error("colors", "are below 0, which the reference clamps",
                        "Give colours of 0 and more.");
        c = (c - 0.5) / SH_C0;
    }
    return splats;
}

// Turns gradients for logits, logarithms and harmonics into gradients for what was given.
void to_given(const SplatArraysGiven& given, reference::SplatGradients<double>& d) {
    auto& d_opacity = attribute_values(d, ATTRIBUTE_OPACITY_LOGIT);
    const std::span<const float> opacities = given.opacities.values();
    for (std::size_t i = 0; i < opacities.size(); ++i)
        d_opacity[i] /= double(opacities[i]) * (1 - double(opacities[i]));
    for (std::size_t i = 0; i < d.log_scale.size(); ++i)
        d.log_scale[i] /= double(given.scales.data[i]);
    if (given.direct_colour)
        for (double& c : d.sh_dc) c /= SH_C0;
}

Image<double> image_of(const Floats& all, std::size_t camera, const Pictures& p, int channels) {
    Image<double> image(p.width(), p.height(), channels);
    const float* from = all.data + camera * image.data.size();
    image.data.assign(from, from + image.data.size());
    return image;
}

py::tuple reference_pictures(const py::dict& options, const py::object& d_image,
                             const py::object& d_alpha) {
    const Pictures pictures = take_pictures(options);
    const SplatArraysGiven given = take_splats(options);
    const auto count = static_cast<py::ssize_t>(pictures.cameras.size());
    const Floats of_image =
        take_floats(d_image, "d_image", {count, pictures.height(), pictures.width(), 3});
    const Floats of_alpha =
        take_floats(d_alpha, "d_alpha", {count, pictures.height(), pictures.width()});
    const reference::Splats<double> splats = splats_of(given);
    std::vector<double> image, alpha, backgrounds;
    SplatArrays<double> sum;
    for (std::size_t c = 0; c < pictures.cameras.size(); ++c) {
        reference::RenderSettings settings;
        settings.near_z = static_cast<double>(pictures.near_plane);
        for (int k = 0; k < 3; ++k) settings.background[k] = double(pictures.backgrounds[c][k]);
        if (pictures.sh_degree >= 0) settings.sh_degree = pictures.sh_degree;
        const Camera& camera = pictures.cameras[c];
        const auto result = reference::render(splats, camera, settings);
        const std::vector<double>& rgb = result.images.colour.data;
        image.insert(image.end(), rgb.begin(), rgb.end());
        for (const double t : result.images.transmittance.data) alpha.push_back(1 - t);
        auto d = reference::backward(splats, camera, settings, result,
                                     image_of(of_image, c, pictures, 3),
                                     image_of(of_alpha, c, pictures, 1));
        to_given(given, d.splats);
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<double>& to = attribute_values(sum, a);
            const std::vector<double>& from = attribute_values(d.splats, a);
            to.resize(from.size());
            for (std::size_t i = 0; i < from.size(); ++i) to[i] += from[i];
        }
        for (int k = 0; k < 3; ++k) backgrounds.push_back(d.background[k]);
    }
    const auto n = static_cast<py::ssize_t>(given.count());
    const py::ssize_t h = pictures.height(), w = pictures.width();
    py::dict d;
    d["means"] = to_array(sum.position, {n, 3});
    d["quats"] = to_array(sum.rotation, {n, 4});
    d["scales"] = to_array(sum.log_scale, {n, 3});
    d["opacities"] = to_array(attribute_values(sum, ATTRIBUTE_OPACITY_LOGIT), {n});
    d[given.direct_colour ? "colors" : "sh_dc"] = to_array(sum.sh_dc, {n, 3});
    if (!sum.shape.empty()) d["shapes"] = to_array(sum.shape, {n});
    d["backgrounds"] = to_array(backgrounds, {count, 3});
    return py::make_tuple(to_array(image, {count, h, w, 3}), to_array(alpha, {count, h, w}), d);
}

}  // namespace

void bind_reference(py::module_& module) {
    module.def("reference", &reference_pictures);
}

}  // namespace darb::python
