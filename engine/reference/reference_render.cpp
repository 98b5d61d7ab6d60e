// SPDX-License-Identifier: MIT
#include "engine/reference/reference_render.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/core/error.h"
#include "engine/reference/parallel.h"

namespace darb::reference {
namespace {

constexpr size_t kSplatsPerBlock = 1024;

/// Calls body(i) for every splat, in blocks over the threads.
template <class Body>
void for_each_splat(size_t count, int threads, const Body& body) {
    parallel_for((count + kSplatsPerBlock - 1) / kSplatsPerBlock, threads, [&](size_t block) {
        const size_t end = std::min(count, (block + 1) * kSplatsPerBlock);
        for (size_t i = block * kSplatsPerBlock; i < end; ++i) {
            body(i);
        }
    });
}

template <class T>
void check_shapes(const Splats<T>& splats, const Camera& camera) {
    const size_t n = splats.size();
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t held = attribute_values(splats, a).size();
        if (held != n * attribute_floats(a, splats.sh_degree) &&
            (held != 0 || !kSplatAttributes[static_cast<size_t>(a)].optional))
            throw Error(
                "splats",
                fmt::format("{} holds {} values for {} splats", attribute_name(a), held, n),
                "Each array holds the values of all splats: see engine/scene/splat_model.h.");
    }
    if (camera.width < 1 || camera.height < 1)
        throw Error("camera", fmt::format("has {} x {} pixels", camera.width, camera.height),
                    "Give it at least one each way.");
}

template <class T>
void add(ProjectedGradient<T>& sum, const ProjectedGradient<T>& term) {
    sum.d_mean_px += term.d_mean_px;
    sum.d_l11 += term.d_l11;
    sum.d_l21 += term.d_l21;
    sum.d_l22 += term.d_l22;
    sum.d_opacity += term.d_opacity;
    sum.d_exponent += term.d_exponent;
    sum.d_depth += term.d_depth;
    sum.d_colour += term.d_colour;
}

}  // namespace

template <class T>
BasicRenderResult<T> render(const Splats<T>& splats, const Camera& camera,
                            const RenderSettings& settings) {
    check_shapes(splats, camera);
    const KernelTable& kernel =
        kernel_table(splats.kernel, splats.footprint, settings.polynomial_degree);
    BasicRenderResult<T> result;
    result.projected.resize(splats.size());
    for_each_splat(splats.size(), settings.threads, [&](size_t i) {
        result.projected[i] = project(splats, i, camera, settings, kernel);
    });
    result.tiles = make_tile_lists(camera.width, camera.height, result.projected, settings);
    for (const ProjectedSplat<T>& splat : result.projected) {
        ++result.culled[static_cast<size_t>(splat.cull)];
    }
    result.images = {Image<T>(camera.width, camera.height, 3),
                     Image<T>(camera.width, camera.height, 1),
                     Image<T>(camera.width, camera.height, 1),
                     Image<std::int32_t>(camera.width, camera.height, 1),
                     Image<T>(camera.width, camera.height, 1)};
    parallel_for(result.tiles.tile_count(), settings.threads, [&](size_t tile) {
        blend_tile(result.tiles, tile, result.projected, kernel, settings, result.images);
    });
    return result;
}

template <class T>
BasicGradients<T> backward(const Splats<T>& splats, const Camera& camera,
                           const RenderSettings& settings, const BasicRenderResult<T>& result,
                           const Image<T>& d_image, const Image<T>& d_alpha,
                           const Image<T>& d_depth) {
    check_shapes(splats, camera);
    if (d_image.width != camera.width || d_image.height != camera.height || d_image.channels != 3 ||
        result.projected.size() != splats.size())
        throw Error(
            "reference",
            fmt::format("got a gradient of {}x{}x{} for a picture of {}x{}, and {} splats for {}",
                        d_image.width, d_image.height, d_image.channels, camera.width,
                        camera.height, result.projected.size(), splats.size()),
            "Pass the result of render() for the same splats and camera.");
    for (const Image<T>* d : {&d_alpha, &d_depth})
        if (!d->data.empty() && (d->width != camera.width || d->height != camera.height))
            throw Error("reference",
                        fmt::format("got a gradient of {}x{} pixels", d->width, d->height),
                        "It is of the camera's size, or empty.");
    const KernelTable& kernel =
        kernel_table(splats.kernel, splats.footprint, settings.polynomial_degree);
    const TileLists& tiles = result.tiles;
    // Every intersection has its own slot, and sums run in list order, so that the result does not
    // depend on the threads.
    std::vector<ProjectedGradient<T>> intersections(tiles.intersection_count());
    std::vector<Vec3<T>> d_background(tiles.tile_count());
    parallel_for(tiles.tile_count(), settings.threads, [&](size_t tile) {
        d_background[tile] = blend_tile_backward(tiles, tile, result.projected, kernel, settings,
                                                 {d_image, d_alpha, d_depth},
                                                 intersections.data() + tiles.begin[tile]);
    });

    BasicGradients<T> gradients;
    gradients.projected.resize(splats.size());
    gradients.mean_gradient_ndc.resize(splats.size());
    gradients.splats.resize_like(splats);
    for (size_t k = 0; k < intersections.size(); ++k) {
        add(gradients.projected[tiles.splats[k]], intersections[k]);
    }
    for (const Vec3<T>& d : d_background) {
        gradients.background += d;
    }
    const T half_width = T(0.5) * T(camera.width), half_height = T(0.5) * T(camera.height);
    std::vector<CameraGradients<T>> d_camera(splats.size());
    for_each_splat(splats.size(), settings.threads, [&](size_t i) {
        const Vec2<T> d = gradients.projected[i].d_mean_px;
        gradients.mean_gradient_ndc[i] = std::hypot(d.x * half_width, d.y * half_height);
        project_backward(splats, i, camera, settings, kernel,
                         {result.projected[i], gradients.projected[i]}, gradients.splats,
                         &d_camera[i]);
    });
    for (const CameraGradients<T>& d : d_camera) gradients.camera += d;
    return gradients;
}

RenderResult render(const SplatModel& model, const Camera& camera, const RenderSettings& settings) {
    return render(make_splats<double>(model), camera, settings);
}

Gradients backward(const SplatModel& model, const Camera& camera, const RenderSettings& settings,
                   const RenderResult& result, const Image<double>& d_image,
                   const Image<double>& d_alpha, const Image<double>& d_depth) {
    return backward(make_splats<double>(model), camera, settings, result, d_image, d_alpha,
                    d_depth);
}

#define DARB_INSTANTIATE(T)                                                                       \
    template BasicRenderResult<T> render(const Splats<T>&, const Camera&, const RenderSettings&); \
    template BasicGradients<T> backward(const Splats<T>&, const Camera&, const RenderSettings&,   \
                                        const BasicRenderResult<T>&, const Image<T>&,             \
                                        const Image<T>&, const Image<T>&);
DARB_INSTANTIATE(double)
DARB_INSTANTIATE(float)
#undef DARB_INSTANTIATE

}  // namespace darb::reference
