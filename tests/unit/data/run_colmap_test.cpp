// SPDX-License-Identifier: MIT
#include "engine/data/run_colmap.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <sstream>

#include "engine/core/files.h"
#include "engine/data/colmap.h"
#include "tests/unit/data/data_files.h"

namespace darb {
namespace {

/// PATH of this process, changed for one test.
class PathVariable {
  public:
    explicit PathVariable(const std::string& value) : old_(std::getenv("PATH")) {
        setenv("PATH", value.c_str(), 1);
    }
    ~PathVariable() { setenv("PATH", old_.c_str(), 1); }
    const std::string& old() const { return old_; }

  private:
    std::string old_;
};

// The last command of a stand-in: makes the folder that the undistorter makes.
const std::string kUndistorter = "if [ $1 = image_undistorter ]; then mkdir -p \"$7\"; fi\n";

/// A stand-in for colmap that logs its arguments and makes what the mapper makes.
std::filesystem::path write_fake(const std::filesystem::path& folder, const std::string& body) {
    write_file_atomic(folder / "bin/colmap", "#!/bin/sh\n" + body);
    std::filesystem::permissions(folder / "bin/colmap", std::filesystem::perms::owner_all);
    return folder / "bin";
}

TEST(RunColmap, not_installed_prints_the_commands) {
    const auto folder = test_folder();
    const PathVariable path((folder / "empty").string());
    const std::string error =
        error_of([&] { run_colmap({.photos = folder, .workspace = folder / "it's"}, {}); });
    for (const char* step : {"feature_extractor", "exhaustive_matcher", "mapper",
                             "image_undistorter", "use_gpu 0", "apt install colmap", "it'\\''s"})
        EXPECT_NE(error.find(step), std::string::npos) << step;
}

TEST(RunColmap, steps_run_in_order_and_lines_arrive) {
    const auto folder = test_folder();
    const auto bin = write_fake(folder,
                                "[ \"$2\" = -h ] && exit\n"
                                "echo step $1 $QT_QPA_PLATFORM\n"
                                "if [ $1 = mapper ]; then mkdir -p \"$7/0\"; "
                                "touch \"$7/0/cameras.bin\" \"$7/0/images.bin\"; fi\n" +
                                    kUndistorter);
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    std::vector<std::string> steps;
    const auto result =
        run_colmap({.photos = folder, .workspace = folder / "it's here", .sequential = true},
                   {.line = [&](std::string_view line) { steps.emplace_back(line); }});
    EXPECT_EQ(result, folder / "it's here" / "dense");
    EXPECT_EQ(steps, (std::vector<std::string>{
                         "step feature_extractor offscreen", "step sequential_matcher offscreen",
                         "step mapper offscreen", "step image_undistorter offscreen"}));
}

TEST(RunColmap, the_largest_model_is_undistorted_with_a_note) {
    const auto folder = test_folder();
    // The head of images.bin: 3 images in model 0, 260 in 1, 5 in 2.
    const auto bin = write_fake(
        folder,
        "echo step $*\n"
        "make() { mkdir -p \"$1\"; touch \"$1/cameras.bin\"; "
        "printf \"$2\\000\\000\\000\\000\\000\\000\" >\"$1/images.bin\"; }\n"
        "if [ $1 = mapper ]; then make \"$7/0\" '\\003\\000'; make \"$7/1\" '\\004\\001'; "
        "make \"$7/2\" '\\005\\000'; fi\n" +
            kUndistorter);
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    std::string printed;
    const auto print = [&](std::string_view line) { printed += std::string(line) + "\n"; };
    run_colmap({.photos = folder, .workspace = folder / "w"}, {.line = print, .note = print});
    EXPECT_NE(printed.find("3 models"), std::string::npos) << printed;
    EXPECT_NE(printed.find("260 photos"), std::string::npos) << printed;
    EXPECT_NE(printed.find("--input_path " + (folder / "w/sparse/1").string()), std::string::npos)
        << printed;
}

TEST(RunColmap, options_have_the_names_that_the_installed_version_has) {
    for (const bool renamed : {false, true}) {
        const auto folder = test_folder();
        const std::string name = renamed ? "Feature" : "Sift";
        const auto bin =
            write_fake(folder, "if [ \"$2\" = -h ]; then echo '  --" + name +
                                   "Extraction.use_gpu arg'; exit 1; fi\n"
                                   "case \"$*\" in *" +
                                   (renamed ? "Sift" : "Feature") +
                                   "*) echo unrecognised option; exit 1;; esac\n"
                                   "if [ $1 = mapper ]; then mkdir -p \"$7/0\"; "
                                   "touch \"$7/0/cameras.bin\" \"$7/0/images.bin\"; fi\n" +
                                   kUndistorter);
        const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
        EXPECT_EQ(run_colmap({.photos = folder, .workspace = folder / "w"}, {}),
                  folder / "w" / "dense");
    }
}

TEST(RunColmap, options_that_only_help_are_given_where_the_version_lists_them) {
    ColmapRun run{.photos = "/p", .workspace = "/w", .count = 100};
    const auto text = [&](const ColmapHelp& help) {
        std::string all;
        for (const ColmapCommand& command : colmap_commands(run, plain_paths(run), help))
            for (const std::string& word : command) all += word + " ";
        return all;
    };
    const ColmapHelp old{
        "  --SiftExtraction.use_gpu arg\n  --SiftExtraction.max_image_size arg\n"
        "  --SiftExtraction.max_num_features arg\n"
        "  --SiftExtraction.peak_threshold arg\n",
        "  --SiftMatching.guided_matching arg\n"
        "  --SiftMatching.min_num_inliers arg\n"
        "  --ExhaustiveMatching.block_size arg\n",
        "  --Mapper.abs_pose_min_num_inliers arg\n"};
    const ColmapHelp recent{
        "  --FeatureExtraction.use_gpu arg\n"
        "  --FeatureExtraction.max_image_size arg\n",
        "  --FeatureMatching.guided_matching arg\n"
        "  --TwoViewGeometry.min_num_inliers arg\n",
        ""};
    const auto has = [](const std::string& all, const char* part) {
        return all.find(part) != std::string::npos;
    };
    EXPECT_FALSE(has(text({}), "block_size") || has(text(old), "max_num_features"));
    EXPECT_TRUE(has(text(old), "--ExhaustiveMatching.block_size "));
    run.effort = ColmapEffort::quick;
    EXPECT_TRUE(has(text(old), "--SiftExtraction.max_num_features 2048"));
    EXPECT_TRUE(has(text(recent), "--FeatureExtraction.max_image_size 1000"));
    EXPECT_TRUE(has(text(old), "exhaustive_matcher"));
    run.quick_sequential = true;
    EXPECT_TRUE(has(text(old), "sequential_matcher"));
    run.effort = ColmapEffort::thorough;
    EXPECT_TRUE(has(text(old), "exhaustive_matcher"));
    EXPECT_TRUE(has(text(old), "--SiftMatching.guided_matching 1"));
    EXPECT_TRUE(has(text(old), "--Mapper.abs_pose_min_num_inliers 15"));
    EXPECT_TRUE(has(text(recent), "--TwoViewGeometry.min_num_inliers 10"));
    EXPECT_FALSE(has(text(recent), "Sift")) << text(recent);
}

// A stand-in whose mapper finds `first` photos, or `second` where it got an option of the thorough
// effort. It logs its commands.
std::string few_photos(const std::string& calls, const char* first, const char* second) {
    return "if [ \"$2\" = -h ]; then echo '  --Mapper.min_num_matches arg'; exit; fi\n"
           "echo $1 >>'" +
           calls +
           "'\n"
           "if [ $1 = feature_extractor ]; then for i in 1 2 3; do\n"
           "echo \"Processed file [$i/10]\"; echo '  Features:        8'$i; done; fi\n"
           "n='\\0" +
           first + "'; case \"$*\" in *min_num_matches*) n='\\0" + second +
           "';; esac\n"
           "if [ $1 = mapper ]; then mkdir -p \"$7/0\"; touch \"$7/0/cameras.bin\"\n"
           "printf \"$n\\000\\000\\000\\000\\000\\000\\000\" >\"$7/0/images.bin\"; fi\n";
}

TEST(RunColmap, few_cameras_are_tried_again_and_the_better_model_is_kept) {
    // Octal: 7 of 10 photos, then 9; 7, then 4; 8 are enough.
    const struct {
        const char *first, *second;
        std::size_t kept, tries;
    } cases[] = {{"07", "11", 9, 2}, {"07", "04", 7, 2}, {"10", "11", 8, 1}};
    for (const auto& c : cases) {
        const auto folder = test_folder();
        const auto bin = write_fake(
            folder, few_photos((folder / "calls").string(), c.first, c.second) + kUndistorter);
        const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
        std::string told;
        run_colmap({.photos = folder, .workspace = folder / "w", .count = 10},
                   {.note = [&](std::string_view text) { told += std::string(text) + "\n"; }});
        EXPECT_EQ(count_colmap_images(folder / "w/sparse/0"), c.kept);
        EXPECT_EQ(effort_of_colmap(folder / "w"),
                  c.kept == 9 ? ColmapEffort::thorough : ColmapEffort::usual);
        const std::string calls = read_text_file(folder / "calls");
        std::size_t mappers = 0;
        for (std::size_t at = 0; (at = calls.find("mapper", at)) != std::string::npos; ++at)
            ++mappers;
        EXPECT_EQ(mappers, c.tries);
        EXPECT_EQ(told.find("cameras of 7 of 10 photos") != std::string::npos, c.tries == 2)
            << told;
        EXPECT_EQ(told.find("fewer than 83 features") != std::string::npos, c.tries == 2) << told;
        EXPECT_FALSE(std::filesystem::exists(folder / "w/attempt_1"));
    }
}

TEST(RunColmap, a_stopped_run_ends_colmap_and_goes_on_from_there) {
    const auto folder = test_folder();
    const std::string calls = (folder / "calls").string(), pid = (folder / "pid").string();
    const auto slow = [&](const char* step) {
        return "[ \"$2\" = -h ] && exit\necho $1 >>'" + calls +
               "'\n"
               "[ $1 = mapper ] && mkdir -p \"$7/0\" && touch \"$7/0/cameras.bin\"\n"
               "if [ $1 = " +
               step + " ]; then echo $$ >'" + pid +
               "'; exec sleep 100; fi\n"
               "[ $1 = mapper ] && touch \"$7/0/images.bin\"\n" +
               kUndistorter;
    };
    for (const char* step : {"mapper", "image_undistorter", "none"}) {
        const PathVariable path(write_fake(folder, slow(step)).string() + ":" +
                                std::getenv("PATH"));
        std::atomic<bool> stop = false;
        const auto run = [&] {
            run_colmap({.photos = folder, .workspace = folder / "w", .stop = &stop},
                       {.progress = [&](std::size_t, const ColmapOutput&, double, double) {
                           stop = std::filesystem::exists(pid);
                       }});
        };
        if (step == std::string("none")) {
            run();
            break;
        }
        EXPECT_THROW(run(), ColmapStopped) << step;
        EXPECT_NE(std::system(("kill -0 $(cat '" + pid + "') 2>/dev/null").c_str()), 0) << step;
        EXPECT_FALSE(std::filesystem::exists(folder / "w/dense")) << step;
        EXPECT_EQ(std::filesystem::exists(folder / "w/sparse"), step[0] == 'i') << step;
        std::filesystem::remove(pid);
    }
    EXPECT_TRUE(std::filesystem::exists(folder / "w/dense"));
    EXPECT_EQ(read_text_file(calls),
              "feature_extractor\nexhaustive_matcher\nmapper\n"  // stopped
              "feature_extractor\nexhaustive_matcher\nmapper\nimage_undistorter\n"
              "image_undistorter\n");
}

std::vector<std::string> progress_of(ColmapStep step, std::size_t photos, std::size_t pairs,
                                     const std::string& text) {
    ColmapOutput output(step, photos, pairs);
    std::vector<std::string> told;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const bool partial = line.ends_with('~');  // what is there before the line ends
        if (partial) line.pop_back();
        if (output.read(line))
            told.push_back(std::to_string(output.done()) + "/" + std::to_string(output.total()) +
                           (output.model() > 1 ? " " + std::to_string(output.model()) : ""));
    }
    return told;
}

using Told = std::vector<std::string>;

TEST(ColmapOutput, features_are_followed_in_every_version) {
    ColmapOutput output(ColmapStep::extract, 0, 0);
    for (const char* line : {"Processed file [1/25]", "  Name:            Processed file [9/9].jpg",
                             "  Dimensions:      200 x 356", "  Features:        844"})
        output.read(line);
    EXPECT_EQ(output.done(), 1u);
    EXPECT_EQ(output.total(), 25u);
    EXPECT_EQ(output.features(), (std::vector<std::size_t>{844}));
    EXPECT_EQ(
        progress_of(ColmapStep::extract, 0, 0,
                    "I0425 18:00:26.120632 29918 feature_extraction.cc:255] Processed file "
                    "[22/23]\n"
                    "I0425 18:00:26.120666 29918 feature_extraction.cc:258]   Name:     a b.png\n"
                    "I20260109 23:29:28.872276 126938100692800 feature_extraction.cc:300] "
                    "Processed file [23/23]\n"),
        (Told{"22/23", "23/23"}));
    EXPECT_EQ(progress_of(ColmapStep::extract, 0, 0,
                          "Processed file [/25]\nProcessed file [3/\nProcessed file [4/3]\n"
                          "Processed file [99999999999999999999/3]\nProcessed file [0/3]\n"),
              Told{});
}

TEST(ColmapOutput, pairs_are_followed_in_every_version) {
    // 3.8: when the block is done, the time follows on the same line.
    EXPECT_EQ(progress_of(ColmapStep::match, 25, 300,
                          "Matching block [1/2, 1/2]~\nMatching block [1/2, 1/2] in 4.332s\n"
                          "Matching block [1/2, 2/2]~\nMatching block [1/2, 2/2] in 5.1s\n"
                          "Matching block [2/2, 1/2]~\nMatching block [2/2, 1/2] in 5s\n"
                          "Matching block [2/2, 2/2]~\nMatching block [2/2, 2/2] in 0.2s\n"
                          "Elapsed time: 0.756 [minutes]\n"),
              (Told{"0/300", "75/300", "150/300", "225/300", "300/300"}));
    // From 3.9 on, on a line of its own.
    EXPECT_EQ(
        progress_of(ColmapStep::match, 25, 300,
                    "I0425 18:00:26.5 29931 feature_matching.cc:234] Matching block [1/1, 1/1]\n"
                    "I0425 18:00:33.6 29931 feature_matching.cc:47]  in 7.127s\n"
                    "I0425 18:00:33.7 29931 timer.cc:91] Elapsed time: 0.122 [minutes]\n"),
        (Told{"0/300", "300/300"}));
    // Neighbours: photos, begun and then done; "Processing" in 3.12 and later.
    EXPECT_EQ(progress_of(ColmapStep::match, 3, 0,
                          "Matching image [1/3]~\nMatching image [1/3] in 1.0s\n"
                          "I20260109 23:29:28.8 12 pairing.cc:9] Processing image [2/3]\n"
                          "I20260109 23:29:29.8 12 feature_matching.cc:47] in 0.91s\n"
                          "I20260109 23:29:29.9 12 pairing.cc:9] Processing image [3/3]\n"),
              (Told{"0/3", "1/3", "2/3"}));
    EXPECT_EQ(progress_of(ColmapStep::match, 3, 0, "in 3s\nMatching block [2/1]\nMatching image\n"),
              Told{});
}

TEST(ColmapOutput, cameras_are_followed_in_every_version_and_from_model_to_model) {
    EXPECT_EQ(progress_of(ColmapStep::map, 25, 0,
                          "Initializing with image pair #11 and #7\nRegistering image #9 (3)\n"
                          "  => Image sees 247 / 646 points\nRegistering image #10 (4)\n"
                          "Initializing with image pair #1 and #2\nRegistering image #5 (3)\n"),
              (Told{"2/25", "3/25", "4/25", "2/25 2", "3/25 2"}));
    EXPECT_EQ(
        progress_of(ColmapStep::map, 800, 0,
                    "I20250412 20:08:49.215745 96464 incremental_pipeline.cc:390] Registering "
                    "image #537 (702)\n"),
        (Told{"702/800"}));
    EXPECT_EQ(
        progress_of(ColmapStep::map, 20, 0,
                    "I20260109 23:29:28.9 12 incremental_pipeline.cc:300] Registering initial "
                    "image pair #4 and #9\n"
                    "I20260109 23:29:28.9 126938100692800 incremental_pipeline.cc:439] "
                    "Registering image #15 (num_reg_frames=3)\n"
                    "I20260109 23:29:28.9 12 incremental_pipeline.cc:449] => Could not "
                    "register, trying another image.\n"
                    "I20260109 23:29:29.0 12 incremental_pipeline.cc:439] Registering image #11 "
                    "(num_reg_frames=3)\n"
                    "I20260109 23:29:29.0 12 x.cc:1] Registering image #11 (num_reg_frames=)\n"),
        (Told{"2/20", "3/20"}));
}

TEST(ColmapOutput, straightened_photos_are_followed_and_time_left_falls) {
    EXPECT_EQ(progress_of(ColmapStep::undistort, 0, 0,
                          "Undistorting image [1/25]\nI0425 1 2 undistorters.cc:1] Undistorting "
                          "image [2/25]\n"),
              (Told{"1/25", "2/25"}));
    EXPECT_LT(colmap_seconds_left(ColmapStep::match, 10, 0, 300), 0);
    EXPECT_EQ(colmap_seconds_left(ColmapStep::match, 10, 100, 300), 20);
    EXPECT_GT(colmap_seconds_left(ColmapStep::map, 10, 10, 30), 20) << "each takes longer";
    EXPECT_EQ(colmap_seconds_left(ColmapStep::map, 10, 30, 30), 0);
}

TEST(RunColmap, failure_shows_the_last_lines) {
    const auto folder = test_folder();
    const auto bin = write_fake(folder, "echo first; echo no good image pair >&2; exit 1\n");
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    const std::string error =
        error_of([&] { run_colmap({.photos = folder, .workspace = folder / "w"}, {}); });
    EXPECT_NE(error.find("no good image pair"), std::string::npos);
    EXPECT_NE(error.find("feature_extractor"), std::string::npos);
}

TEST(RunColmap, photos_without_motion_are_named_with_the_remedy) {
    const auto folder = test_folder();
    const auto bin = write_fake(folder, "[ $1 != mapper ]\n");
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    const std::string error =
        error_of([&] { run_colmap({.photos = folder, .workspace = folder / "w"}, {}); });
    EXPECT_NE(error.find("The camera must move between photos"), std::string::npos) << error;
}

}  // namespace
}  // namespace darb
