// The viewer without a window: pictures, loading, editing, comparison, on a device.
#include "viewer/viewer.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/data/metrics.h"
#include "engine/render/renderer.h"
#include "engine/scene/ply.h"
#include "tests/support/random_scene.h"
#include "tests/support/shared_device.h"
#include "viewer/importance.h"
#include "viewer/switches.h"

namespace darb::test {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 96, kHeight = 64;

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
        viewer_.emplace(shared_device(), viewer_options);
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
    ImageU8 rendered(const SplatModel& model, const Camera& camera) {
        Renderer renderer(shared_device(), model);
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
    std::optional<Viewer> viewer_;
};

int largest_difference(const ImageU8& a, const ImageU8& b) {
    if (a.data.size() != b.data.size()) return 256;
    int largest = 0;
    for (size_t i = 0; i < a.data.size(); ++i)
        largest = std::max(largest, std::abs(int(a.data[i]) - int(b.data[i])));
    return largest;
}

TEST_F(ViewerTest, Screenshot_at_a_camera_is_what_the_renderer_gives) {
    load(file_);
    viewer_->choose_camera(0);
    // One level: rounding of halves differs between the shader and the host.
    EXPECT_LE(largest_difference(shot(), rendered(scene_.model, scene_.camera)), 1);
}

TEST_F(ViewerTest, Panels_cover_a_part_of_the_picture) {
    load(file_);
    const ImageU8 without = shot();
    viewer_->session().panels = true;
    shot();  // panels find their size in their first frame
    EXPECT_GT(largest_difference(shot(), without), 50);
}

TEST_F(ViewerTest, Corrupt_dropped_file_says_why_and_keeps_the_scene) {
    load(file_);
    const ImageU8 before = shot();
    const fs::path bad = folder_ / "bad.ply";
    std::ofstream(bad) << "ply\nformat binary_little_endian 1.0\nelement vertex 5\nend_header\n";
    Input input;
    input.dropped = {bad};
    shot(true, input);
    while (viewer_->loading()) shot();
    EXPECT_NE(viewer_->session().error.find("bad.ply"), std::string::npos)
        << viewer_->session().error;
    EXPECT_EQ(viewer_->session().scene->file, file_);
    EXPECT_GT(largest_difference(shot(), before), 50);  // the message
    input = {};
    input.pressed = {Key::escape};
    EXPECT_EQ(largest_difference(shot(true, input), before), 0);
}

TEST_F(ViewerTest, Missing_file_without_a_window_is_an_error) {
    viewer_->open(folder_ / "none.ply");
    EXPECT_THROW(viewer_->finish_loading(), Error);
}

TEST_F(ViewerTest, Cancelled_load_keeps_the_scene) {
    load(file_);
    viewer_->open(file_);
    viewer_->session().requests.cancel_load = true;
    shot();
    EXPECT_FALSE(viewer_->loading());
    EXPECT_TRUE(viewer_->session().scene);
    EXPECT_TRUE(viewer_->session().error.empty());
}

TEST_F(ViewerTest, Point_cloud_opens_as_points) {
    const fs::path cloud = folder_ / "cloud.ply";
    std::ofstream out(cloud);
    out << "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
           "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
           "end_header\n";
    for (int i = 0; i < 8; ++i)
        out << (i & 1) << ' ' << (i >> 1 & 1) << ' ' << (i >> 2) << " 255 0 0\n";
    out.close();
    load(cloud);
    EXPECT_TRUE(viewer_->session().scene->is_points);
    EXPECT_EQ(viewer_->session().scene->model.size(), 8u);
    const ImageU8 image = shot();
    int reddest = 0;
    for (size_t p = 0; p < image.data.size(); p += 3)
        reddest = std::max(reddest, image.data[p] - image.data[p + 1]);
    EXPECT_GT(reddest, 200);
}

TEST_F(ViewerTest, A_hundred_scenes_opened_and_closed_leave_no_memory_behind) {
    std::uint64_t device_bytes = 0;
    size_t heap_bytes = 0;
    for (int cycle = 0; cycle < 100; ++cycle) {
        load(file_);
        shot();
        if (cycle != 9) continue;
        device_bytes = shared_device().allocated_bytes();
        heap_bytes = ::mallinfo2().uordblks;
    }
    EXPECT_EQ(shared_device().allocated_bytes(), device_bytes);
    // The scene alone is 60 splats of 236 bytes; a leak of it would be 1.2 MB.
    EXPECT_LT(::mallinfo2().uordblks, heap_bytes + 300'000);
}

TEST_F(ViewerTest, Display_modes_differ_from_the_picture_and_from_each_other) {
    load(file_);
    std::vector<ImageU8> shots;
    DisplaySettings& d = viewer_->session().display;
    const DisplaySettings plain = d;
    shots.push_back(shot());
    d.mode = VIEW_DEPTH;
    shots.push_back(shot());
    d.mode = VIEW_COUNT;
    d.count_max = 30;
    shots.push_back(shot());
    d = plain;
    d.style = SplatStyle::points;
    shots.push_back(shot());
    d.style = SplatStyle::ellipsoids;
    shots.push_back(shot());
    for (size_t a = 0; a < shots.size(); ++a)
        for (size_t b = a + 1; b < shots.size(); ++b)
            EXPECT_GT(largest_difference(shots[a], shots[b]), 60) << a << " and " << b;
    d = plain;
    EXPECT_EQ(largest_difference(shot(), shots[0]), 0);
}

// Two opaque splats side by side, one nearer: the nearer is the lighter.
TEST_F(ViewerTest, Depth_near_is_lighter_than_far) {
    SplatModel m;
    m.resize(2);
    for (size_t i = 0; i < 2; ++i) {
        m.position[3 * i] = i == 0 ? -0.5f : 0.5f;
        m.position[3 * i + 2] = i == 0 ? -0.3f : 0.3f;
        m.rotation[4 * i] = 1;
        m.opacity[i] = 6;
        for (size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = -1.5f;
    }
    write_ply(file_, m);
    load(file_);
    viewer_->session().display.mode = VIEW_DEPTH;
    const ImageU8 image = shot();
    const Camera camera = viewer_->session().navigation.camera(kWidth, kHeight);
    int light[2];
    for (int i = 0; i < 2; ++i) {
        const glm::dvec3 p = camera.rotation * glm::dvec3(m.position[3 * i], m.position[3 * i + 1],
                                                          m.position[3 * i + 2]) +
                             camera.translation;
        const int x = static_cast<int>(camera.fx * p.x / p.z + camera.cx);
        const int y = static_cast<int>(camera.fy * p.y / p.z + camera.cy);
        light[i] = image.at(x, y, 0) + image.at(x, y, 1) + image.at(x, y, 2);
    }
    EXPECT_GT(light[0], light[1] + 30);
}

TEST_F(ViewerTest, Kernel_switch_shows_a_difference_and_goes_back) {
    load(file_);
    const ImageU8 own = shot();
    viewer_->session().display.kernel = KERNEL_RAISED_COSINE;
    EXPECT_GT(largest_difference(shot(), own), 3);
    viewer_->session().display.kernel = KERNEL_GAUSSIAN;
    EXPECT_EQ(largest_difference(shot(), own), 0);
}

TEST_F(ViewerTest, Delete_undo_and_save) {
    load(file_);
    Session& s = viewer_->session();
    const ImageU8 before = shot();
    s.region = {Region::Shape::sphere, {0, 0, 0}, glm::dvec3(0.8)};
    s.show_region = true;
    Input input;
    input.pressed = {Key::remove};
    const ImageU8 after = shot(true, input);
    EXPECT_GT(s.edit.removed_count(), 0u);
    EXPECT_GT(largest_difference(after, before), 20);
    s.save_file = folder_ / "edited.ply";
    s.requests.save = true;
    shot();
    const SplatModel saved = read_ply(s.save_file);
    EXPECT_EQ(saved.size(), scene_.model.size() - s.edit.removed_count());
    input.pressed = {Key::undo};
    EXPECT_EQ(largest_difference(shot(true, input), before), 0);
    load(s.save_file);
    viewer_->choose_camera(1);
    EXPECT_LE(largest_difference(shot(), rendered(saved, scene_.camera)), 1);
}

TEST_F(ViewerTest, Photo_is_left_of_the_split) {
    load(file_);
    viewer_->choose_camera(0);
    const ImageU8 picture = shot();
    Photos& p = viewer_->session().photos;
    p.compare = true;
    p.split = 0.5f;
    const ImageU8 both = shot();
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(both.at(x, y, c),
                          x < kWidth / 2 ? photo_.at(x, y, c) : picture.at(x, y, c))
                    << x << ", " << y << ", channel " << c;
}

TEST_F(ViewerTest, Error_map_is_dark_where_the_photo_is_the_picture) {
    load(file_);
    viewer_->choose_camera(0);
    write_png(folder_ / "photo.png", shot());
    viewer_->session().display.mode = VIEW_ERROR;
    const ImageU8 map = shot();
    EXPECT_LE(*std::max_element(map.data.begin(), map.data.end()), 12);
}

TEST_F(ViewerTest, Camera_without_photo_says_so) {
    load(file_);
    viewer_->choose_camera(1);
    viewer_->session().photos.compare = true;
    shot();
    EXPECT_NE(viewer_->session().error.find("no photo"), std::string::npos);
    EXPECT_THROW(viewer_->choose_camera(2), Error);
}

TEST_F(ViewerTest, Picture_is_coarse_in_motion_and_refined_at_rest) {
    load(file_);
    const ImageU8 at_rest = shot();
    EXPECT_EQ(viewer_->session().times.quality, MotionQuality());
    Session& s = viewer_->session();
    s.navigation.orbit(0.3, 0);
    shot(false);
    viewer_->presented();
    EXPECT_LT(s.times.quality.scale, 1);
    EXPECT_LT(s.times.quality.splats, 1);
    double next = 0;
    for (int i = 0; i < 1'000'000 && !(s.times.quality == MotionQuality()); ++i)
        next = viewer_->frame({}, kWidth, kHeight, false);
    EXPECT_EQ(s.times.quality, MotionQuality());
    EXPECT_EQ(next, 0);  // the panels show the times of the refined picture
    next = viewer_->frame({}, kWidth, kHeight, false);
    EXPECT_EQ(next, std::numeric_limits<double>::infinity());  // then nothing is drawn any more
    EXPECT_TRUE(viewer_->at_rest());
    s.navigation.orbit(-0.3, 0);
    EXPECT_LE(largest_difference(shot(), at_rest), 2);  // the turns cancel up to rounding
}

// What a first frame in motion needs is made while nothing moves; the picture does not change by
// it.
TEST_F(ViewerTest, The_first_frame_in_motion_has_nothing_to_wait_for) {
    load(file_);
    DisplaySettings& d = viewer_->session().display;
    for (const SplatStyle style : {SplatStyle::splats, SplatStyle::points}) {
        d.style = style;
        const ImageU8 at_rest = shot();
        EXPECT_FALSE(viewer_->picture().ready_to_move(d));
        EXPECT_EQ(largest_difference(shot(false), at_rest), 0);
        EXPECT_TRUE(viewer_->at_rest());
        viewer_->session().navigation.orbit(0.01, 0);
        shot(false);
        EXPECT_FALSE(viewer_->picture().compiled());
        EXPECT_LT(viewer_->session().times.quality.splats, 1.01);
    }
}

// Half of the splats, the larger ones, are much of the picture; and the deleted ones stay away.
TEST_F(ViewerTest, Motion_shows_the_important_splats_and_no_deleted_ones) {
    for (size_t i = 0; i < scene_.model.size(); ++i) scene_.model.opacity[i] = 4;
    write_ply(file_, scene_.model);
    load(file_);
    viewer_->choose_camera(0);
    const ImageU8 whole = shot();
    SplatPicture picture(shared_device());
    const Scene& s = *viewer_->session().scene;
    picture.set_scene(s.model, s.bounds, most_important(s.model, s.bounds, s.model.size() / 2));
    EXPECT_DOUBLE_EQ(picture.most_moving(), 0.5);
    const auto light = [&](std::optional<double> moving) {
        picture.render(scene_.camera, viewer_->session().display, {}, moving);
        double sum = 0;
        for (const std::uint32_t p : picture.pixels().download<std::uint32_t>(kWidth * kHeight))
            sum += (p & 255) + (p >> 8 & 255) + (p >> 16 & 255);
        return sum;
    };
    const double all = light({}), half = light(0.5), few = light(0.1);
    EXPECT_NEAR(light(1.0), all, 0.02 * all);  // fast accuracy settings
    EXPECT_LT(half, 0.99 * all);
    EXPECT_GT(half, 0.5 * all);
    EXPECT_LT(few, half);
    EXPECT_GT(few, 0);
    picture.set_removed(std::vector<std::uint8_t>(s.model.size(), 1));
    EXPECT_EQ(light(0.5), 0);
}

TEST_F(ViewerTest, Degree_of_colour_follows_the_scene) {
    for (const int degree : {1, 3, 0}) {
        SceneOptions options;
        options.count = 20;
        options.sh_degree = degree;
        write_ply(file_, random_scene(options).model);
        load(file_);
        EXPECT_EQ(viewer_->session().shown_sh_degree, degree);
        EXPECT_EQ(viewer_->session().display.sh_degree, degree);
    }
}

TEST_F(ViewerTest, Load_reports_progress_and_is_cancelled_while_it_decodes) {
    SceneOptions options;
    options.count = 200'000;
    options.sh_degree = 0;
    write_ply(file_, random_scene(options).model);
    std::vector<double> shares;
    load_scene_file(file_, [&](double share, const char*) { shares.push_back(share); });
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
    EXPECT_GE(
        std::count_if(shares.begin(), shares.end(), [](double s) { return s > 0.41 && s < 0.94; }),
        2);
    struct Stop {};
    EXPECT_THROW(load_scene_file(file_,
                                 [](double share, const char*) {
                                     if (share > 0.41) throw Stop();
                                 }),
                 Stop);
}

TEST_F(ViewerTest, Accuracy_switch_changes_the_picture_and_its_measure_says_how_much) {
    load(file_);
    Session& s = viewer_->session();
    const ImageU8 before = shot();
    s.requests.measure = true;
    do shot();
    while (s.measure_share >= 0);
    size_t choices = 0;
    for (const int row : kAccuracyRows) choices += row_choices(row, 3).size();
    for (const int row : kEffectRows) choices += row_choices(row, s.shown_sh_degree).size();
    ASSERT_EQ(s.measured.size(), choices);
    const DisplaySettings as_is = s.display;
    for (const MeasuredChoice& m : s.measured) {
        const std::string name = row_name(m.row) + " " + row_choices(m.row, 3)[m.choice];
        EXPECT_GT(m.psnr_db, 15) << name;
        s.display = as_is;
        choose(m.row, m.choice, s.display);
        EXPECT_EQ(chosen(m.row, s.display), m.choice) << name;
        const ImageU8 picture = shot();
        s.display = as_is;
        s.display.accuracy = preset_accuracy(kExact);
        const double expected = psnr(to_float(picture), to_float(shot()));
        if (std::isinf(expected))
            EXPECT_TRUE(std::isinf(m.psnr_db)) << name;
        else
            EXPECT_NEAR(m.psnr_db, expected, 1e-6) << name;
    }
    s.display = as_is;
    EXPECT_EQ(largest_difference(shot(), before), 0);
    s.display.accuracy = preset_accuracy(kFast);
    EXPECT_GT(largest_difference(shot(), before), 0);
    s.display.mode = VIEW_COUNT;  // modes that need float32 and centre order go on working
    s.display.accuracy.choice[kDepthOrder] = 2;
    shot();
    s.display.mode = VIEW_DEPTH;
    shot();
    EXPECT_TRUE(s.error.empty()) << s.error;
}

TEST_F(ViewerTest, Antialiasing_is_taken_from_the_file) {
    scene_.model.antialias = true;
    write_ply(file_, scene_.model);
    load(file_);
    EXPECT_TRUE(viewer_->session().display.antialias);
    viewer_->choose_camera(0);
    const ImageU8 with = shot();
    EXPECT_LE(largest_difference(with, rendered(scene_.model, scene_.camera)), 1);
    viewer_->session().display.antialias = false;
    EXPECT_GT(largest_difference(with, shot()), 0);
}

TEST_F(ViewerTest, Path_export_writes_a_frame_for_each_time_step) {
    load(file_);
    shot();
    Session& s = viewer_->session();
    s.path.path.add(s.navigation);
    s.navigation.orbit(0.5, 0);
    s.path.path.add(s.navigation, 0.5);
    s.path.folder = folder_ / "frames";
    s.path.fps = 4;
    s.path.export_width = kWidth;
    s.path.export_height = kHeight;
    viewer_->export_path_now();
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00000.png"));
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00002.png"));
    EXPECT_FALSE(fs::exists(s.path.folder / "frame_00003.png"));
    const ImageU8 last = read_image(s.path.folder / "frame_00002.png");
    EXPECT_EQ(largest_difference(last, shot()), 0);  // the camera is at the last key
    const bool has_ffmpeg = std::system("command -v ffmpeg > /dev/null") == 0;
    const fs::path video = s.path.folder / "video.mp4";
    EXPECT_EQ(fs::exists(video) && fs::file_size(video) > 0, has_ffmpeg) << s.note;

    s.path.folder = folder_ / "no_ffmpeg";
    const std::string programs = std::getenv("PATH");
    ::setenv("PATH", folder_.c_str(), 1);
    viewer_->export_path_now();
    ::setenv("PATH", programs.c_str(), 1);
    EXPECT_TRUE(fs::exists(s.path.folder / "frame_00002.png"));
    EXPECT_NE(s.note.find("no video, ffmpeg is not installed"), std::string::npos) << s.note;
}

}  // namespace
}  // namespace darb::test
