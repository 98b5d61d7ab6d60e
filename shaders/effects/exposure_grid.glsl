// SPDX-License-Identifier: MIT
// Finds where a pixel lies in a photo's bilateral grid of colour maps, and the map there: trilinear between the
// vertices, which lie across the picture, down, and along the luminance of what the splats show. Source: Bilateral
// Guided Radiance Field Processing, arXiv 2406.00448. The includer declares args and maps.

const vec3 LUMINANCE = vec3(0.299, 0.587, 0.114);

// The place in units of vertices.
vec3 grid_place(uint p, vec3 colour) {
    const uint height = args.pixels / args.width;
    const float luminance = clamp(dot(colour, LUMINANCE), 0.0, 1.0);
    return vec3((float(p % args.width) + 0.5) / float(args.width) * float(EXPOSURE_GRID_X - 1),
                (float(p / args.width) + 0.5) / float(height) * float(EXPOSURE_GRID_Y - 1),
                luminance * float(EXPOSURE_GRID_L - 1));
}

// The first of the three rows of a vertex's map, in maps[view][l][y][x][3].
uint grid_rows(uint view, uvec3 vertex) {
    const uint plane = (view * EXPOSURE_GRID_L + vertex.z) * EXPOSURE_GRID_Y + vertex.y;
    return (plane * EXPOSURE_GRID_X + vertex.x) * 3u;
}

// The rows of the map, and how they change from this luminance's vertex to the next.
struct GridMap { vec4 row[3]; vec4 slope[3]; };

GridMap grid_map_at(vec3 place) {
    const uvec3 low = min(uvec3(place), uvec3(EXPOSURE_GRID_X - 2, EXPOSURE_GRID_Y - 2, EXPOSURE_GRID_L - 2));
    const vec3 f = place - vec3(low);
    const vec4 weights = vec4(1.0 - f.x, f.x, 1.0 - f.x, f.x) * vec4(1.0 - f.y, 1.0 - f.y, f.y, f.y);
    GridMap map;
    for (uint r = 0u; r < 3u; ++r) {
        map.row[r] = vec4(0.0);
        map.slope[r] = vec4(0.0);
    }
    for (uint corner = 0u; corner < 4u; ++corner) {
        const uvec3 at = low + uvec3(corner & 1u, corner >> 1, 0u);
        const uint dark = grid_rows(args.view, at), bright = grid_rows(args.view, at + uvec3(0u, 0u, 1u));
        for (uint r = 0u; r < 3u; ++r) {
            const vec4 difference = maps[bright + r] - maps[dark + r];
            map.row[r] += weights[corner] * (maps[dark + r] + f.z * difference);
            map.slope[r] += weights[corner] * difference;
        }
    }
    return map;
}
