// SPDX-License-Identifier: MIT
#include "viewer/mesh_picture.h"

#include <fmt/format.h>

#include <vector>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/raster/forward.h"

namespace darb {

namespace {

constexpr std::uint32_t kNothing = 0xFFFFFFFFu, kInfinity = 0x7F800000u;  // mesh_face.glsl

gpu::MeshDrawArgs draw_args(const Camera& camera, const glm::dvec3& origin,
                            const DisplaySettings& display) {
    gpu::MeshDrawArgs args{};
    const glm::dmat3 rows = glm::transpose(camera.rotation);
    args.row0 = rows[0];
    args.row1 = rows[1];
    args.row2 = rows[2];
    args.shift = camera.rotation * origin + camera.translation;
    args.focal = {camera.fx, camera.fy};
    args.principal = {camera.cx, camera.cy};
    args.width = static_cast<std::uint32_t>(camera.width);
    args.height = static_cast<std::uint32_t>(camera.height);
    args.near_plane = display.near_plane;
    args.look = static_cast<std::uint32_t>(display.mesh_look);
    args.background_r = display.background.r;
    args.background_g = display.background.g;
    args.background_b = display.background.b;
    return args;
}

}  // namespace

MeshPicture::MeshPicture(Device& device, const TriangleMesh& mesh)
    : device_(&device),
      raster_(device, "mesh_raster", {{"THREADS", VIEW_GROUP}}),
      raster_large_(device, "mesh_raster_large", {{"THREADS", VIEW_GROUP}}),
      shade_(device, "mesh_shade", {{"THREADS", VIEW_GROUP}}),
      origin_(mesh.origin[0], mesh.origin[1], mesh.origin[2]),
      faces_(static_cast<std::uint32_t>(mesh.face_count())),
      has_colours_(!mesh.colour.empty()) {
    const std::uint64_t most = device.info().max_storage_buffer_bytes / sizeof(glm::uvec3);
    if (mesh.face.empty()) throw Error("the mesh", "has no faces", "Open a file with triangles.");
    if (mesh.face_count() > most || mesh.vertex_count() > most)
        throw Error("the mesh",
                    fmt::format("has {} faces and {} vertices, {} shows {} at most",
                                mesh.face_count(), mesh.vertex_count(), device.info().name, most),
                    "Simplify it: darb mesh --faces N.");
    position_ = Buffer(device, "mesh vertices", mesh.vertex_count() * sizeof(glm::vec3));
    position_.upload(mesh.position);
    face_ = Buffer(device, "mesh faces", mesh.face_count() * sizeof(glm::uvec3));
    face_.upload(mesh.face);
    std::vector<std::uint32_t> colours;
    for (const glm::u8vec3& c : mesh.colour)
        colours.push_back(c.r | std::uint32_t{c.g} << 8 | std::uint32_t{c.b} << 16 | 0xFF000000u);
    colour_ = Buffer(device, "mesh colours", colours.size() * 4);
    if (!colours.empty()) colour_.upload(colours);
    large_ = Buffer(device, "large faces", (mesh.face_count() + 1) * 4);
}

bool MeshPicture::has_room(int width, int height) const {
    return depth_.bytes() >= std::uint64_t(width) * std::uint64_t(height) * 4 && depth_;
}

void MeshPicture::reserve(int width, int height) {
    if (has_room(width, height)) return;
    const std::uint64_t bytes = std::uint64_t(width) * std::uint64_t(height) * 4;
    depth_ = Buffer(*device_, "mesh depths", bytes);
    face_of_ = Buffer(*device_, "faces of pixels", bytes);
    pixels_ = Buffer(*device_, "mesh pixels", bytes);
}

void MeshPicture::record(Commands& commands, const Camera& camera, const DisplaySettings& display) {
    record(commands, camera, display, pixels_);
}

void MeshPicture::record(Commands& commands, const Camera& camera, const DisplaySettings& display,
                         const Buffer& to) {
    gpu::MeshDrawArgs args = draw_args(camera, origin_, display);
    args.faces = faces_;
    args.has_colours = has_colours_ ? 1 : 0;
    commands.pass("mesh");
    const std::uint64_t pixels = std::uint64_t(args.width) * args.height;
    commands.fill(BufferRange(depth_, 0, pixels * 4), kInfinity);
    commands.fill(BufferRange(face_of_, 0, pixels * 4), kNothing);
    commands.fill(BufferRange(large_, 0, 4), 0);
    const Groups of_faces = groups_for(faces_, VIEW_GROUP),
                 of_pixels = groups_for(pixels, VIEW_GROUP);
    for (args.step = 0; args.step < 2; ++args.step) {
        commands.dispatch(raster_, args, {position_, face_, depth_, face_of_, large_}, of_faces.x,
                          of_faces.y);
        commands.dispatch(raster_large_, args, {position_, face_, depth_, face_of_, large_},
                          MESH_LARGE_GROUPS, MESH_PARTS);
    }
    commands.dispatch(shade_, args, {position_, face_, face_of_, colour_, to}, of_pixels.x,
                      of_pixels.y);
}

void MeshBlend::record(Commands& commands, const Camera& camera, const MeshPicture& mesh,
                       float nearer, Frame& frame) {
    const bool parts = frame.size.list_segments > 1;
    Pipeline& pipeline = pipelines_[parts ? 1 : 0];
    if (!pipeline) {
        SpecConstants constants = kernel_constants(*device_, options_);
        constants["MIN_TRANSMITTANCE"] = least_transmittance(options_.transmittance_stop);
        const std::uint32_t subgroup = add_block_constants(*device_, constants);
        constants["THREADS"] = static_cast<std::int32_t>(TILE_SIZE * TILE_SIZE / (64 / subgroup));
        constants["SEGMENT"] = parts ? static_cast<std::int32_t>(LIST_SEGMENT) : 0;
        pipeline = Pipeline(*device_, "mesh_blend", constants, true, subgroup);
    }
    const auto tiles = [](int pixels) {
        return static_cast<std::uint32_t>((pixels + TILE_SIZE - 1) / TILE_SIZE);
    };
    const ProjectedSplats& s = frame.splats;
    const TileIntersections& t = frame.intersections;
    commands.pass("blend");
    for (std::uint32_t segment = 0; segment < frame.size.list_segments; ++segment) {
        const gpu::MeshBlendArgs args{static_cast<std::uint32_t>(camera.width),
                                      static_cast<std::uint32_t>(camera.height),
                                      tiles(camera.width),
                                      nearer,
                                      segment,
                                      frame.size.list_segments};
        commands.dispatch(pipeline, args,
                          {t.tile_range, t.intersection_from_sorted, t.splat_from_intersection,
                           s.shape, s.light, s.bound, s.exponent, mesh.depth(), mesh.pixels(),
                           frame.images.image, frame.images.final_transmittance},
                          tiles(camera.width), tiles(camera.height));
    }
}

}  // namespace darb
