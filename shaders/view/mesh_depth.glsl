// SPDX-License-Identifier: MIT
// The two steps of both rasters of a mesh: first the least depth of each pixel, then the first of the faces that have
// it. Both run in one pipeline, so a face finds the depth that it left, bit by bit. Needs view/mesh_face.glsl.
layout(set = 0, binding = 2, scalar) buffer Depth { uint mesh_depth[]; };  // [H][W] bits of a float; NO_SURFACE
layout(set = 0, binding = 3, scalar) buffer FaceOf { uint mesh_face[]; };  // [H][W] NO_FACE

void draw_pixel(Face f, uint id, uvec2 pixel) {
    vec3 weights;
    const float depth = depth_on(f, ray_of(pixel), weights);
    if (!(depth > 0.0)) return;
    const uint at = pixel.y * args.width + pixel.x, bits = floatBitsToUint(depth);
    if (args.step == 0u)
        atomicMin(mesh_depth[at], bits);
    else if (mesh_depth[at] == bits)
        atomicMin(mesh_face[at], id);
}
