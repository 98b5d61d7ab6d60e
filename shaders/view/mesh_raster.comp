// SPDX-License-Identifier: MIT
// Draws the faces of a mesh that cover few pixels, and lists the others for mesh_raster_large.comp.
// Place: in the viewer, where a mesh is shown. Work: a thread a face, over the pixels of its bounding box. Shared
// memory: none. Reads the mesh; writes depths and faces by atomic minima, which have no order, and the list of large
// faces, whose order does not matter.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "shared/view_args.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint THREADS = 64;

layout(push_constant, scalar) uniform Push { MeshDrawArgs args; };
layout(set = 0, binding = 4, scalar) buffer Large { uint large[]; };  // count, then faces

#include "lib/linear_id.glsl"
#include "view/mesh_face.glsl"
#include "view/mesh_depth.glsl"

void main() {
    const uint id = linear_id();
    if (id >= args.faces) return;
    const Face f = load_face(id);
    uvec2 first, end;
    if (!pixels_of(f, first, end)) return;
    const uvec2 size = end - first;
    const uint count = size.x * size.y;
    if (count > MESH_SMALL) {
        if (args.step == 0u) large[1u + atomicAdd(large[0], 1u)] = id;
        return;
    }
    for (uint i = 0u; i < count; ++i) draw_pixel(f, id, first + uvec2(i % size.x, i / size.x));
}
