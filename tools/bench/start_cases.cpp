// From starting the command to the first picture on disk: darb render of one view of biker, as a
// process of its own, with shader caches in a folder of their own.
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/data/camera_list.h"
#include "engine/plan/tuning_names.h"
#include "tools/bench/cases.h"
#include "tools/bench/scenes.h"

extern char** environ;

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr int kStarts = 5;

// Removed with everything in it at the end.
class ScratchFolder {
  public:
    ScratchFolder() {
        std::string name = (fs::temp_directory_path() / "darb_bench_XXXXXX").string();
        if (!mkdtemp(name.data()))
            throw Error(name, std::strerror(errno), "Set TMPDIR to a folder that can be written.");
        path_ = name;
    }
    ~ScratchFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

// The caches of Mesa, of NVIDIA's driver and of darb itself go to `caches`.
std::vector<std::string> environment(const fs::path& caches) {
    const std::vector<std::string> names = {"XDG_CACHE_HOME", "MESA_SHADER_CACHE_DIR",
                                            "__GL_SHADER_DISK_CACHE_PATH"};
    std::vector<std::string> all;
    for (char** one = environ; *one; ++one) {
        const std::string text = *one;
        const std::string name = text.substr(0, text.find('='));
        if (std::find(names.begin(), names.end(), name) == names.end()) all.push_back(text);
    }
    for (const std::string& name : names) all.push_back(name + "=" + caches.string());
    return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

void run_process(std::vector<std::string> arguments, std::vector<std::string> variables) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t process = 0;
    const int failure = posix_spawn(&process, arguments[0].c_str(), &actions, nullptr,
                                    pointers(arguments).data(), pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    if (failure != 0 || waitpid(process, &status, 0) != process || status != 0)
        throw Error(arguments[0] + " " + arguments[1],
                    failure != 0 ? std::strerror(failure) : "did not draw its picture",
                    "Run the command by hand; see what it says above.");
}

BenchResult measure(const Device& device, const BenchOptions& options, const fs::path& scene,
                    bool cold) {
    const ScratchFolder scratch;
    const View view = bench_view(bench_camera({-0.06, -1.6, 4}, false, 1280, 720), "first.png");
    const fs::path cameras = scratch.path() / "cameras.json", caches = scratch.path() / "caches",
                   pictures = scratch.path() / "pictures";
    write_camera_list(cameras, {view});
    std::vector<std::string> command = {
        options.program.string(),
        "render",
        scene.string(),
        "--cameras",
        cameras.string(),
        "-o",
        pictures.string(),
        "--tune",
        names_text(tuning_names(device.tuning()))};  // nothing to measure
    if (!options.device.empty()) {
        command.push_back("--device");
        command.push_back(options.device);
    }
    Sampling sampling = options.sampling;
    sampling.least = std::min(sampling.least, kStarts);
    sampling.seconds = 0;
    sampling.warm_up = cold ? 0 : 1;
    BenchResult result;
    take_samples(
        sampling, 1,
        [&] {
            run_process(command, environment(caches));
            return std::vector<PassTime>{};
        },
        result,
        [&] {
            if (cold) fs::remove_all(caches);
            fs::create_directories(caches);
            fs::remove_all(pictures);
        });
    if (fs::is_empty(pictures)) throw Error(pictures.string(), "holds no picture");
    result.note = fmt::format("process start to PNG at 1280x720, shader cache {}",
                              cold ? "empty" : "filled by the start before");
    return result;
}

}  // namespace

std::vector<BenchCase> start_cases() {
    std::vector<BenchCase> cases;
    const fs::path scene = "splats/biker.compressed.ply";
    for (const bool cold : {false, true})
        cases.push_back({fmt::format("start/biker/{}", cold ? "cold" : "warm"), scene,
                         [=](Device& device, const DeviceRates&, const BenchOptions& options) {
                             return measure(device, options, *options.data / scene, cold);
                         }});
    return cases;
}

std::vector<BenchCase> bench_cases(bool full) {
    std::vector<BenchCase> all;
    for (const auto& some : {render_cases(), train_cases(full), step_cases(), sort_cases(),
                             tuning_cases(), start_cases()})
        all.insert(all.end(), some.begin(), some.end());
    return all;
}

}  // namespace darb
