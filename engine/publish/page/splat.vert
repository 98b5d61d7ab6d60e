// A splat as the parallelogram that circumscribes the ellipse of its reach: corners (+-R, +-R) of the whitened plane.
// An instance is a batch of splats, four vertices each: software renderers take as long for an instance as for a thousand
// pixels.
uniform highp usampler2D order;  // of splats, front to back
uniform highp usampler2D shapes;
uniform highp usampler2D lights;
#if PAGE_SHAPED
uniform highp usampler2D exponents;
flat out float exponent;
#endif
uniform int batch;
uniform int count;   // of the order
uniform vec2 frame;  // px

flat out vec4 shape;
flat out vec4 light;
flat out float l22;

ivec2 texel(int i, int columns) {
    return ivec2(i % columns, i / columns);
}

void main() {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    int place = gl_InstanceID * batch + (gl_VertexID >> 2);
    if (place >= count) return;
    int columns = textureSize(shapes, 0).x;
    ivec2 at = texel(int(texelFetch(order, texel(place, columns), 0).x), columns);
    shape = uintBitsToFloat(texelFetch(shapes, at, 0));
    if (!(shape.z > 0.0)) return;
    uvec4 packed_light = texelFetch(lights, at, 0);
    l22 = uintBitsToFloat(packed_light.x);
    vec2 rest = unpackHalf2x16(packed_light.w);
    light = vec4(unpackHalf2x16(packed_light.z), rest.x, uintBitsToFloat(packed_light.y));
#if PAGE_SHAPED
    exponent = uintBitsToFloat(texelFetch(exponents, at, 0).x);
#endif
    vec2 corner = (vec2(ivec2(gl_VertexID & 1, gl_VertexID >> 1 & 1)) * 2.0 - 1.0) * rest.y;
    float y = corner.y / l22;
    vec2 pixel = shape.xy + vec2((corner.x - shape.w * y) / shape.z, y);
    gl_Position = vec4(pixel / frame * 2.0 - 1.0, 0.0, 1.0);
}
