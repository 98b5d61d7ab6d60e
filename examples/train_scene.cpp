// SPDX-License-Identifier: MIT
// Trains a scene, measures it on photos that were held out, and writes it as a PLY file.
//
//     train_scene DATASET SCENE.ply [ITERATIONS]      default: 300
//
// The loop belongs to the caller here: between two iterations a program may look at the splats,
// draw them, or stop. `darb train` adds a folder with checkpoints, a log and a report around this
// loop.
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/dataset.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_file.h"
#include "trainer/growth/initial_model.h"
#include "trainer/step/trainer.h"

namespace {

/// The mean PSNR of the views that were held out.
double held_out_psnr(darb::Trainer& trainer, const darb::Dataset& dataset,
                     const std::vector<darb::ImageU8>& photos) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < dataset.views.size(); ++i) {
        const darb::View& view = dataset.views[i];
        if (!view.is_test) continue;
        const darb::ImageF image = trainer.render(view.camera);
        sum += darb::compare_view(view.name, image, photos[i], trainer.background()).psnr_db;
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc < 3 || argc > 4) {
        std::fprintf(stderr, "usage: train_scene DATASET SCENE.ply [ITERATIONS]\n");
        return 2;
    }
    // Every 8th photo, or the data set's own choice, is held out; photos are 200 px wide.
    const darb::Dataset dataset =
        darb::load_dataset(argv[1], {.resolution = 200, .hold_out = true});
    const std::vector<darb::ImageU8> photos = darb::load_photos(dataset.views);

    darb::TrainOptions options;
    options.iterations = argc == 4 ? std::atoi(argv[3]) : 300;

    darb::Device device;
    darb::Trainer trainer(device, dataset, photos, darb::initial_model(dataset, options), options);
    trainer.on_result = [](const darb::IterationResult& result) {
        if (result.iteration % 100 == 0)
            std::printf("iteration %d: loss %.4f, %u splats\n", result.iteration, result.loss,
                        result.splats);
    };
    while (trainer.iteration() < options.iterations) trainer.step();

    const darb::SplatModel model = trainer.model();
    darb::save_splats(argv[2], darb::SplatFormat::ply, model);
    std::printf("PSNR %.2f dB on photos that were held out, %zu splats, on %s\n",
                held_out_psnr(trainer, dataset, photos), model.size(), device.info().name.c_str());
} catch (const darb::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
}
