// SPDX-License-Identifier: MIT
// A viewer without a window on a tiny scene.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "engine/data/image_io.h"
#include "engine/render/renderer.h"
#include "engine/scene/ply.h"
#include "tests/support/compare_images.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"
#include "viewer/viewer.h"

namespace darb::test {

namespace fs = std::filesystem;

inline constexpr int kWidth = 96, kHeight = 64;

// Panels hidden, a tiny scene in a file, a data set of two cameras, the first with a photo.
class ViewerTest : public ::testing::Test {
  protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("darb_viewer_" + std::to_string(::getpid()));
        fs::create_directories(folder_);
        SceneOptions options;
        options.count = 60;
        options.width = kWidth;
        options.height = kHeight;
        scene_ = random_scene(options);
        file_ = folder_ / "scene.ply";
        write_ply(file_, scene_.model);
        photo_ = ImageU8(kWidth, kHeight, 3);
        for (size_t i = 0; i < photo_.data.size(); ++i)
            photo_.data[i] = static_cast<std::uint8_t>(i * 7);
        write_png(folder_ / "photo.png", photo_);
        ViewerOptions viewer_options;
        viewer_options.views.resize(2);
        for (View& view : viewer_options.views) {
            view.name = "view";
            view.camera = scene_.camera;
            view.lens.width = kWidth;
            view.lens.height = kHeight;
            view.lens.parameters = {scene_.camera.fx, scene_.camera.fy, scene_.camera.cx,
                                    scene_.camera.cy};
        }
        viewer_options.views[0].photo = folder_ / "photo.png";
        make_viewer(viewer_options);
    }
    void make_viewer(const ViewerOptions& options) {
        options_ = options;
        viewer_.reset();
        viewer_.emplace(shared_device(), options);
        viewer_->session().panels = false;
    }
    void TearDown() override {
        viewer_.reset();
        fs::remove_all(folder_);
    }

    void load(const fs::path& file) {
        viewer_->open(file);
        viewer_->finish_loading();
    }
    ImageU8 shot(bool full = true, const Input& input = {}) {
        viewer_->frame(input, kWidth, kHeight, full);
        viewer_->compose();
        viewer_->canvas().submit_and_wait();
        return viewer_->canvas().read_back();
    }
    // As `darb render` gives it.
    ImageU8 rendered(const SplatModel& model, const Camera& camera, const Accuracy& accuracy = {},
                     const ProjectionEffects& effects = {}) {
        Renderer renderer(shared_device(), model, accuracy, effects);
        const ImageF image = renderer.render(camera, glm::vec3(0.0f), -1, near_plane());
        ImageU8 out(image.width, image.height, 3);
        for (size_t i = 0; i < out.data.size(); ++i)
            out.data[i] = static_cast<std::uint8_t>(
                std::lround(std::clamp(image.data[i], 0.0f, 1.0f) * 255.0f));
        return out;
    }
    float near_plane() { return viewer_->session().display.near_plane; }

    fs::path folder_, file_;
    TestScene scene_;
    ImageU8 photo_;
    ViewerOptions options_;
    std::optional<Viewer> viewer_;
};

}  // namespace darb::test
