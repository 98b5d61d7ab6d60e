// The blended light over the background, scaled to the window and turned right side up.
uniform highp sampler2D blended;
uniform vec3 background;
uniform vec2 window;  // px

out vec4 colour;

void main() {
    vec2 at = vec2(gl_FragCoord.x, window.y - gl_FragCoord.y) / window;
    vec4 light = texture(blended, at);
    colour = vec4(light.rgb + light.a * background, 1.0);
}
