#include "engine/data/run_colmap.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/core/files.h"
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
                                "echo step $1 $QT_QPA_PLATFORM\n"
                                "if [ $1 = mapper ]; then mkdir -p \"$7/0\"; "
                                "touch \"$7/0/cameras.bin\" \"$7/0/images.bin\"; fi\n");
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    std::vector<std::string> steps;
    const auto result =
        run_colmap({.photos = folder, .workspace = folder / "it's here", .sequential = true},
                   [&](std::string_view line) {
                       if (line.starts_with("step")) steps.emplace_back(line);
                   });
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
        "make \"$7/2\" '\\005\\000'; fi\n");
    const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
    std::string printed;
    run_colmap({.photos = folder, .workspace = folder / "w"},
               [&](std::string_view line) { printed += std::string(line) + "\n"; });
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
                                   "touch \"$7/0/cameras.bin\" \"$7/0/images.bin\"; fi\n");
        const PathVariable path(bin.string() + ":" + std::getenv("PATH"));
        EXPECT_EQ(run_colmap({.photos = folder, .workspace = folder / "w"}, {}),
                  folder / "w" / "dense");
    }
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
