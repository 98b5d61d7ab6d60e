// SPDX-License-Identifier: MIT
// What the splats alone leave at a pixel, without the background that is seen through them. The includer declares args,
// image and final_transmittance.
// image and final_transmittance.

vec3 background() {
    return vec3(args.background_r, args.background_g, args.background_b);
}

// Colour, and the share of the pixel that the splats cover.
vec4 covered_colour(uint p) {
    const float open = final_transmittance[p];
    const vec3 colour = vec3(image[p], image[args.pixels + p], image[2u * args.pixels + p]);
    return vec4(colour - open * background(), 1.0 - open);
}
