// SPDX-License-Identifier: MIT
// Draws a splat file from one side and writes a PNG.
//
//     render_scene SCENE PICTURE.png [DEVICE]
//
// SCENE is any splat file that darb reads. DEVICE is a number or a part of a name, as `darb
// devices` lists them; without it the library takes the best device that is there.
#include <cstdio>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device.h"
#include "engine/render/renderer.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/subject.h"

int main(int argc, char** argv) try {
    if (argc < 3 || argc > 4) {
        std::fprintf(stderr, "usage: render_scene SCENE PICTURE.png [DEVICE]\n");
        return 2;
    }
    const darb::SplatModel model = darb::load_splats(argv[1]);

    darb::DeviceOptions options;
    if (argc == 4) options.select = argv[3];
    darb::Device device(options);

    // The renderer keeps the splats on the device, so that more pictures cost only their frames.
    darb::Renderer renderer(device, model);
    const darb::Camera camera = darb::orbit_cameras(model, 8, 960, 720).front();
    const darb::ImageF image = renderer.render(camera, glm::vec3(1.0f));  // over white
    darb::write_png(argv[2], darb::to_8bit(image));
    std::printf("%zu splats on %s, %u of them in the picture\n", model.size(),
                device.info().name.c_str(), renderer.status().visible);
} catch (const darb::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
}
