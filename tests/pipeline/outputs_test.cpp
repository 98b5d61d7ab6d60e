// No command writes over what it reads, by whatever name; a full disk behind stdout is an error.
#include <map>

#include "tests/support/run_command.h"

namespace darb::test {
namespace {

// A data set with a photo, a scene, and a folder of a run.
class Outputs : public testing::Test {
  protected:
    void SetUp() override {
        const fs::path scene = fs::path(DARB_SOURCE_DIR) / "assets" / "scene";
        fs::create_directories(data_);
        fs::copy(scene / "images", data_ / "images");
        fs::copy(scene / "sparse", data_ / "sparse", fs::copy_options::recursive);
        const Outcome o = darb(fmt::format("train '{}' -o '{}' -r 8 -q --iterations 1 --no-report",
                                           data_.string(), run_.string()));
        ASSERT_EQ(o.code, 0) << o.err;
        fs::copy(run_ / "point_cloud/iteration_1/point_cloud.ply", ply());
        fs::create_symlink(ply(), folder_ / "link.ply");
        fs::create_symlink(photo(), folder_ / "link.png");
        fs::create_directory_symlink(data_, folder_ / "data_link");
        write_file_atomic(folder_ / "path.json", R"({"key_frames": []})");
        for (const auto& entry : fs::recursive_directory_iterator(folder_))
            if (entry.is_regular_file()) before_[entry.path()] = read_file(entry.path());
    }
    void TearDown() override { fs::remove_all(folder_); }

    fs::path ply() const { return folder_ / "scene.ply"; }
    fs::path photo() const { return data_ / "images" / "view_11.png"; }
    std::string link(const char* name) const { return (folder_ / name).string(); }
    void expect_as_before() const {
        size_t files = 0;
        for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
            if (!entry.is_regular_file()) continue;
            ++files;
            const auto at = before_.find(entry.path());
            ASSERT_NE(at, before_.end()) << entry.path() << " is new";
            EXPECT_EQ(read_file(entry.path()), at->second) << entry.path();
        }
        EXPECT_EQ(files, before_.size());
    }

    const fs::path folder_ = scratch() / "outputs", data_ = folder_ / "data",
                   run_ = folder_ / "run";
    std::map<fs::path, std::vector<std::byte>> before_;
};

TEST_F(Outputs, no_command_writes_over_its_input) {
    const std::string data = data_.string(), s = ply().string(), p = photo().string(),
                      run = run_.string(), sparse = data + "/sparse/0/",
                      inner = run + "/point_cloud/iteration_1/point_cloud.ply";
    const std::string model = fs::exists(sparse + "cameras.bin") ? "images.bin" : "images.txt";
    std::vector<BadCommand> commands;
    const auto over = [&](const std::string& command) {
        commands.push_back({command, "is what is read"});
    };
    over("eval " + s + " " + data + " -r 8 --json " + p);
    over("eval " + s + " " + data + " -r 8 --json " + link("link.png"));
    over("eval " + s + " " + data + " -r 8 --json " + s);
    over("eval " + run + " " + data + " -r 8 --json " + run + "/metrics.json");
    over("eval " + s + " " + link("data_link") + " -r 8 --json " + sparse + model);
    over("render " + s + " --cameras " + data + " -r 8 -o " + data + "/images");
    over("info " + s + " --json " + link("link.ply"));
    over("info " + data + " --json " + p);
    over("info " + run + " --json " + inner);
    over("convert " + link("link.ply") + " " + s);
    over("convert " + run + " " + inner);
    over("convert " + s + " " + s + " --cameras " + data);
    over("cost " + s + " " + data + " -r 8 --quick --json " + p);
    over("cost " + s + " --quick --html " + s);
    over("cost --train " + data + " -r 8 --quick --html " + p);
    over("compare " + data + " -r 8 -o " + folder_.string() + "/out --iterations 1 --json " +
         sparse + model);
#ifdef DARB_HAS_VIEWER
    over("view " + s + " --screenshot " + s);
    over("view " + s + " --cameras " + data + " --screenshot " + link("link.png"));
    over("view " + s + " --path " + link("path.json") + " --export " + folder_.string() +
         "/frames --screenshot " + link("path.json"));
    commands.push_back({"view " + s + " --cameras " + data + " --path " + link("path.json") +
                            " --export " + data + "/images",
                        "holds photos that are read"});
#endif
    for (const char* command :
         {"psi --samples 1 --cells 8", "sim1d --steps 1 --seeds 1", "bench --list"})
        commands.push_back(
            {fmt::format("{} --json '{}' --html '{}'", command, link("new.txt"), link("new.txt")),
             std::string(command).starts_with("bench") ? "--growth" : "written twice"});
    expect_refused(commands);
    fs::remove_all(folder_ / "out");
    expect_as_before();
}

TEST_F(Outputs, a_comparison_leaves_photos_alone) {
    const Outcome o = darb(fmt::format("compare '{}' -r 8 -o '{}/out' --iterations 1 --json '{}'",
                                       data_.string(), folder_.string(), photo().string()));
    EXPECT_EQ(o.code, 2) << o.err;
    EXPECT_NE((o.out + o.err).find("is what is read"), std::string::npos) << o.err;
    fs::remove_all(folder_ / "out");
    expect_as_before();
}

TEST_F(Outputs, a_run_does_not_write_among_what_it_reads) {
    const std::string train = "train " + data_.string() + " -r 8 --iterations 1 -o ";
    fs::create_directory_symlink(data_ / "images", folder_ / "images_link");
    fs::create_directories(folder_ / "around");
    fs::create_directory_symlink(data_, folder_ / "around" / "point_cloud");
    expect_refused({{train + data_.string(), "is the folder of the data set"},
                    {train + link("data_link"), "is the folder of the data set"},
                    {train + data_.string() + "/sub/..", "is the folder of the data set"},
                    {train + data_.string() + "/images", "lies among what the run reads"},
                    {train + data_.string() + "/images/new/out", "lies among what the run reads"},
                    {train + link("images_link/out"), "lies among what the run reads"},
                    {train + data_.string() + "/sparse/0", "lies among what the run reads"},
                    {train + link("around"), "is written by a run"}});
    fs::remove_all(folder_ / "around");
    fs::remove(folder_ / "images_link");
    expect_as_before();
    EXPECT_EQ(darb(train + data_.string() + "/out -q").code, 0) << "beside the photos";
}

TEST_F(Outputs, a_full_disk_behind_stdout_is_an_error) {
    for (const std::string& command :
         {"info " + ply().string(), std::string("--help"), std::string("psi --samples 1 --cells 8"),
          fmt::format("train '{}' -o '{}/out' -r 8 --iterations 1 -q", data_.string(),
                      folder_.string())}) {
        const std::string err = folder_ / "err";
        const int status = std::system(
            fmt::format("'{}' {} > /dev/full 2> '{}'", DARB_COMMAND, command, err).c_str());
        EXPECT_EQ(WEXITSTATUS(status), 2) << command;
        EXPECT_NE(read_text_file(err).find("No space left on device"), std::string::npos)
            << command << read_text_file(err);
    }
    EXPECT_TRUE(fs::exists(folder_ / "out" / "metrics.json")) << "the run itself is complete";
}

}  // namespace
}  // namespace darb::test
