// SPDX-License-Identifier: MIT
// project.comp alone on a model: its outputs read back, guard words checked, and the cover of each
// splat as a list of tiles.
#pragma once

#include <optional>

#include "engine/gpu/commands.h"
#include "engine/primitives/groups.h"
#include "engine/raster/forward.h"
#include "engine/raster/kernel_constants.h"
#include "tests/support/guarded_buffer.h"
#include "tests/support/shared_device.h"

namespace darb::test {

struct ProjectedFrame {
    std::vector<glm::vec4> shape, light, bound;  // as blend.comp reads them
    std::vector<glm::uvec4> cover;
    std::vector<float> exponent;
    std::vector<std::uint32_t> intersection_count, visible;
    gpu::FrameStatus status;
};

inline ProjectedFrame project_on_device(const SplatModel& model, const Camera& camera,
                                        int sh_degree = 3, int evaluation = EVALUATION_POLYNOMIAL,
                                        const ProjectionEffects& effects = {},
                                        const std::vector<float>& filters = {0.0f},
                                        double low_pass = LOW_PASS_DEFAULT,
                                        int projection = PROJECTION_JACOBIAN) {
    Device& device = shared_device();
    const auto n = static_cast<std::uint32_t>(model.size());
    SpecConstants constants = kernel_constants(model.kernel, model.footprint, evaluation, 5,
                                               static_cast<float>(ALPHA_CUTOFF_DEFAULT));
    constants["THREADS"] = SPLAT_GROUP;
    constants["SH_DEGREE"] = std::min(sh_degree, model.sh_degree);
    constants["SH_STORED"] = model.sh_degree;
    constants["PROJECTION"] = projection;
    add_constants(effects, constants);
    const Pipeline pipeline(device, "project", constants);
    const GuardedBuffer cameras(device, "cameras", std::vector{camera_data(camera, model.origin)});
    const GuardedBuffer position(device, "position", model.position),
        log_scale(device, "log_scale", model.log_scale),
        rotation(device, "rotation", model.rotation),
        opacity(device, "opacity", model.opacity_logit), sh_dc(device, "sh_dc", model.sh_dc),
        sh_rest(device, "sh_rest",
                held_rows(attribute_rows(kShRest, model.floats(kShRest)), model.sh_rest)),
        shapes(device, "shapes", model.shape), smoothing(device, "smoothing", filters);
    const GuardedBuffer shape(device, "shape", n * 16), light(device, "light", n * 16),
        bound(device, "bound", n * 16), cover(device, "cover", n * 16),
        intersection_count(device, "intersection count", n * 4), visible(device, "visible", n * 4),
        status(device, "status", std::vector<gpu::FrameStatus>(1)),
        exponent(device, "exponent", n * 4);
    Commands commands(device);
    commands.begin();
    const Groups g = groups_for(n);
    commands.dispatch(
        pipeline, gpu::ProjectArgs{0, n, 0, static_cast<float>(low_pass)},
        {cameras, position, log_scale, rotation, opacity, sh_dc, sh_rest, shapes, shape, light,
         bound, cover, intersection_count, visible, status, smoothing, exponent},
        g.x, g.y);
    commands.submit_and_wait();
    for (const GuardedBuffer* b :
         {&cameras, &position, &log_scale, &rotation, &opacity, &sh_dc, &sh_rest, &shape, &light,
          &bound, &cover, &intersection_count, &visible, &status, &smoothing, &exponent})
        EXPECT_TRUE(b->intact());
    return {shape.read<glm::vec4>(),       light.read<glm::vec4>(),
            bound.read<glm::vec4>(),       cover.read<glm::uvec4>(),
            exponent.read<float>(),        intersection_count.read<std::uint32_t>(),
            visible.read<std::uint32_t>(), status.read<gpu::FrameStatus>()[0]};
}

/// A rectangle of tiles that one bit of a cover stands for; ends exclusive.
struct CoverCell {
    std::uint32_t x0, y0, x1, y1;
};

/// The cells of a cover that are set, as shaders/lib/tile.glsl describes the format.
inline std::vector<CoverCell> cover_cells(const glm::uvec4& cover) {
    const std::uint32_t x = cover.x & 0xffff, y = cover.x >> 16;
    const std::uint32_t columns = cover.y & 0xffff, rows = cover.y >> 16;
    const std::uint32_t wide = (columns + 7) / 8, high = (rows + 7) / 8;
    std::vector<CoverCell> cells;
    for (std::uint32_t bit = 0; bit < 64; ++bit) {
        if ((cover[bit < 32 ? 2 : 3] >> (bit % 32) & 1) == 0) continue;
        const std::uint32_t cx = bit % 8 * wide, cy = bit / 8 * high;
        EXPECT_LT(cx, columns);
        EXPECT_LT(cy, rows);
        cells.push_back(
            {x + cx, y + cy, x + std::min(cx + wide, columns), y + std::min(cy + high, rows)});
    }
    return cells;
}

/// The tiles of a cover, as indices in an image tiles_x wide, in the order of emission.
inline std::vector<std::uint32_t> cover_tiles(const glm::uvec4& cover, std::uint32_t tiles_x) {
    std::vector<std::uint32_t> tiles;
    for (const CoverCell& cell : cover_cells(cover))
        for (std::uint32_t y = cell.y0; y < cell.y1; ++y)
            for (std::uint32_t x = cell.x0; x < cell.x1; ++x) tiles.push_back(y * tiles_x + x);
    return tiles;
}

}  // namespace darb::test
