// SPDX-License-Identifier: MIT
// No command overwrites what it reads, whatever the name; a full disk behind stdout is an error.
#include <sys/stat.h>

#include <map>

#include "tests/support/child.h"
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

// Files that no command reads: numbers and frames replace only their own kind.
TEST_F(Outputs, scenes_and_photos_of_others_are_left_alone) {
    const std::string s = ply().string(), other = link("other.ply"), photo = link("other.png"),
                      cameras = link("cameras.json"), frames = link("frames");
    fs::copy_file(ply(), other);
    fs::copy_file(this->photo(), photo);
    fs::create_symlink(photo, folder_ / "photo_link.json");
    write_file_atomic(fs::path(cameras), R"([{"id": 0, "img_name": "mine", "width": 32,
        "height": 32, "position": [0,0,-5], "rotation": [[1,0,0],[0,1,0],[0,0,1]],
        "fx": 30, "fy": 30}])");
    fs::create_directories(frames);
    fs::copy_file(this->photo(), frames + "/mine.png");
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
        if (entry.is_regular_file()) before_[entry.path()] = read_file(entry.path());
    const std::string render = "render " + s + " --cameras " + cameras + " -o " + frames;
    expect_refused({{"info " + s + " --json " + other, "is a scene"},
                    {"info " + s + " --json " + link("photo_link.json"), "is a picture"},
                    {"plan " + s + " --no-price --json " + other, "is a scene"},
                    {"psi --samples 1 --cells 8 --html " + other, "is a scene"},
                    {render, "was not written by darb"}});
    expect_as_before();
    EXPECT_EQ(darb(render + " --force -q").code, 0);
    EXPECT_EQ(darb(render + " -q").code, 0) << "its own by now";
    EXPECT_EQ(darb("info " + s + " --json " + link("facts.json")).code, 0);
    EXPECT_EQ(darb("info " + s + " --json " + link("facts.json")).code, 0) << "its own kind";
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

// What was asked for besides is still written.
TEST_F(Outputs, a_reader_that_is_gone_ends_no_command) {
    const std::string data = data_.string(), s = ply().string(), out = folder_.string() + "/out";
    const std::vector<std::vector<std::string>> commands{
        {"--help"},
        {"train", "--help-all"},
        {"devices"},
        {"info", s},
        {"info", s, "--json", "-"},
        {"plan", s, "--no-price", "--json", out + ".plan"},
        {"psi", "--samples", "1", "--cells", "8", "--json", out + ".psi"},
        {"convert", s, out + ".splat"},
        {"eval", s, data, "-r", "8", "--json", out + ".eval"},
        {"render", s, "--cameras", data, "-r", "8", "-o", out}};
    for (const auto& words : commands) {
        Child child(words, folder_, [] { write_to_nobody({STDOUT_FILENO}); });
        EXPECT_EQ(child.wait(), 0) << words[0] << ": " << child.err();
        EXPECT_EQ(child.err().find("rror"), std::string::npos) << words[0] << ": " << child.err();
    }
    Child mute({"info", s}, folder_, [] { write_to_nobody({STDOUT_FILENO, STDERR_FILENO}); });
    EXPECT_EQ(mute.wait(), 0);
    for (const char* name : {"out.plan", "out.psi", "out.splat", "out.eval", "out/view_11.png"})
        EXPECT_TRUE(fs::exists(folder_ / name)) << name;
    Child bad({"info", "nothing"}, folder_, [] { write_to_nobody({STDERR_FILENO}); });
    EXPECT_EQ(bad.wait(), 2);
}

TEST_F(Outputs, quiet_commands_print_paths_alone) {
    const std::string data = data_.string(), s = ply().string(), out = folder_.string() + "/o";
    write_file_atomic(data_ / "transforms.json", "{}");  // a note names what is read instead
    ASSERT_NE(darb("plan " + data + " --no-price -r 8").err.find("note: "), std::string::npos);
    const std::vector<std::pair<std::string, std::string>> commands{
        {"plan " + data + " --no-price -r 8", ""},
        {"convert " + s + " " + out + ".ply --levels 2", out + ".1.ply\n" + out + ".2.ply"},
        {"info " + s + " --json " + out, out},
        {"info " + s, ""},
        {"plan " + s + " --no-price --json " + out, out},
        {"devices", ""},
        {"convert " + s + " " + out + ".spz", out + ".spz"},
        {"eval " + s + " " + data + " -r 8 --json " + out, out},
        {"render " + s + " --cameras " + data + " -r 8 -o " + out + "_frames", out + "_frames"},
        {"psi --kernels sinc --samples 1 --cells 8 --json " + out + " --html " + out + ".html",
         out + "\n" + out + ".html"},
        {"sim1d --signals square --kernels sinc -N 1 --seeds 1 --steps 2 --json " + out, out},
#ifdef DARB_HAS_VIEWER
        {"view " + s + " --size 32x32 --screenshot " + out + ".png", out + ".png"},
#endif
        {"train " + data + " -o " + out + "_run -r 8 --iterations 1 --no-report",
         out + "_run/point_cloud/iteration_1/point_cloud.ply"}};
    for (const auto& [command, paths] : commands) {
        const Outcome o = darb(command + " -q");
        EXPECT_EQ(o.code, 0) << command;
        EXPECT_EQ(o.out, paths.empty() ? "" : paths + "\n") << command;
        EXPECT_EQ(o.err, "") << command;
    }
}

TEST_F(Outputs, a_pipe_that_nobody_reads_any_more_is_an_error_of_its_name) {
    const fs::path pipe = folder_ / "pipe.ply";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    Child child({"convert", ply().string(), pipe.string()}, folder_);
    const int reader = ::open(pipe.c_str(), O_RDONLY);  // waits until the command has opened it
    char first = 0;
    EXPECT_EQ(::read(reader, &first, 1), 1);
    ::close(reader);  // before all of the scene has gone through
    EXPECT_EQ(child.wait(), 2) << child.err();
    EXPECT_NE(child.err().find("pipe.ply: cannot be written: Broken pipe"), std::string::npos)
        << child.err();
}

TEST_F(Outputs, names_of_files_do_not_steer_the_terminal) {
    const fs::path odd = folder_ /
                         "a\x1b]0;b\x07\x7f\xc2\x9b\xe2\x80\xae"
                         "c";
    fs::create_directories(odd);
    const std::string s = odd / "s.ply", data = odd / "data", run = odd / "run",
                      numbers = odd / "j";
    fs::copy(ply(), s);
    fs::copy(run_, run, fs::copy_options::recursive);
    fs::copy(data_, data, fs::copy_options::recursive);
    std::vector<std::vector<std::string>> commands{
        {"info", s},
        {"info", data, "--json", "-", "-r", "8"},
        {"info", odd},
        {"plan", s, "--no-price", "--json", "-"},
        {"plan", run, "--no-price", "--json", numbers},
        {"convert", s, odd / "o.spz"},
        {"convert", s, odd / "o.none"},
        {"convert", s, odd / "no" / "\x1b[m.ply"},
        {"eval", s, data, "-r", "8", "--json", numbers},
        {"eval", s, odd},
        {"render", s, "--cameras", data, "-r", "8", "-o", odd / "frames"},
        {"render", s, "--cameras", s, "-o", odd / "frames"},
        {"cost", s, "--device", odd},
        {"cost", data},
        {"check", "--scene", s, "--cameras", data, "--dump", odd / "dump"},
        {"train", data, "-o", odd / "out", "-r", "8", "--iterations", "1", "--no-report"},
        {"train", odd, "-o", odd / "out"},
        {"train", "--resume", "-o", odd},
        {"compare", odd, "-o", odd / "out"},
        {"bench", odd},
        {"devices", "--device", odd},
        {odd},
        {"info", s, odd},
        {"info", s, "-" + odd.filename().string()},
        {"psi", "--samples", odd},
        {"psi", "--kernel", odd},
        {"sim1d", "--signals", odd},
        {"train", data, "--strategy", odd}};
#ifdef DARB_HAS_VIEWER
    commands.push_back({"view", s, "--screenshot", odd / "s.png", "--size", "64x48"});
    commands.push_back({"view", odd, "--screenshot", odd / "s.png"});
    commands.push_back({"view", s, "--screenshot", odd / "s.odd"});
    commands.push_back({"view", s, "--show", odd});
#endif
    for (const auto& words : commands) {
        Child child(words, folder_);
        EXPECT_GE(child.wait(), 0);
        for (const std::string& text : {child.out(), child.err()})
            for (const std::string& steers :
                 {std::string("\x1b"), std::string("\x07"), std::string("\x7f"),
                  std::string("\xc2\x9b"), std::string("\xe2\x80\xae")})
                EXPECT_EQ(text.find(steers), std::string::npos) << words[0] << ": " << text;
    }
}

// Neither what was named by its whole path nor what a message says of it.
TEST_F(Outputs, numbers_name_no_folder_of_the_machine_long) {
    const fs::path far = folder_ / "far", numbers = far / "n.json";
    fs::create_directories(far);
    const std::string data = data_.string(), s = ply().string(), of_far = scratch().string();
    write_file_atomic(data_ / "transforms.json", "{}");  // a note names what is read instead
    for (const std::string& command :
         {"info " + s, "info " + data + " -r 8", "info " + run_.string(),
          "plan " + s + " --no-price", "plan " + data + " --no-price -r 8",
          "cost " + s + " --quick --size 32x32 -q"}) {
        const Outcome o = darb(command + " --json " + numbers.string());
        EXPECT_EQ(o.code, 0) << command << o.err;
        if (command.ends_with("-q")) {
            EXPECT_EQ(o.out + o.err, numbers.string() + "\n");
        }
        const std::string text = read_text_file(numbers);
        EXPECT_EQ(text.find(of_far), std::string::npos) << command << text;
    }
    const std::string shown = darb("info " + s + " --json -").out;
    EXPECT_EQ(shown.find(fs::current_path().string() + "/"), std::string::npos) << shown;
}

}  // namespace
}  // namespace darb::test
