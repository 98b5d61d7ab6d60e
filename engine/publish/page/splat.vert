// A splat as the parallelogram that circumscribes the ellipse of its reach: corners (+-R, +-R) of the whitened plane.
layout(location = 0) in uint splat;

uniform highp usampler2D shapes;
uniform highp usampler2D lights;
uniform vec2 frame;  // px

flat out vec4 shape;
flat out vec4 light;
flat out float l22;

void main() {
    int columns = textureSize(shapes, 0).x;
    ivec2 at = ivec2(int(splat) % columns, int(splat) / columns);
    shape = uintBitsToFloat(texelFetch(shapes, at, 0));
    uvec4 packed_light = texelFetch(lights, at, 0);
    l22 = uintBitsToFloat(packed_light.x);
    vec2 rest = unpackHalf2x16(packed_light.w);
    light = vec4(unpackHalf2x16(packed_light.z), rest.x, uintBitsToFloat(packed_light.y));
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    if (!(shape.z > 0.0)) return;
    vec2 corner = (vec2(ivec2(gl_VertexID & 1, gl_VertexID >> 1)) * 2.0 - 1.0) * rest.y;
    float y = corner.y / l22;
    vec2 pixel = shape.xy + vec2((corner.x - shape.w * y) / shape.z, y);
    gl_Position = vec4(pixel / frame * 2.0 - 1.0, 0.0, 1.0);
}
