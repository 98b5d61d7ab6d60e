// alpha of shaders/forward/blend.comp. The target holds the sum of light and, in alpha, the transmittance: blending is
// from front to back.
#include "kernels/kernel.glsl"

flat in vec4 shape;
flat in vec4 light;
flat in float l22;
#if PAGE_SHAPED
flat in float exponent;
#else
const float exponent = 0.0;
#endif

out vec4 colour;

void main() {
    vec2 to_mean = shape.xy - gl_FragCoord.xy;
    float x = shape.z * to_mean.x + shape.w * to_mean.y, y = l22 * to_mean.y;
    float alpha = min(light.w * kernel_value(x * x + y * y, exponent), ALPHA_MAX);
    if (!(alpha >= ALPHA_CUTOFF)) discard;
    colour = vec4(alpha * light.rgb, alpha);
}
