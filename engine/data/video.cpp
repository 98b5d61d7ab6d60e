// SPDX-License-Identifier: MIT
#include "engine/data/video.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/process.h"
#include "engine/core/system_files.h"
#include "engine/core/text.h"
#include "engine/data/run_colmap.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kVideoExtensions[] = {".mp4", ".mov",  ".m4v", ".mkv",  ".avi", ".webm",
                                                 ".mpg", ".mpeg", ".mts", ".m2ts", ".3gp", ".wmv"};
constexpr int kProbeWidth = 480, kProbeHeight = 270;  // px
constexpr std::size_t kMostLogChars = 600;

void need_ffmpeg(const fs::path& video) {
    if (!fs::is_regular_file(video))
        throw Error(video.string(), "is no video file", "Check the path.");
    if (!is_installed("ffmpeg"))
        throw Error(video.string(), "is a video, and ffmpeg is not installed",
                    fmt::format("Install it (apt install ffmpeg), or take pictures elsewhere and "
                                "name their folder:\n    ffmpeg -i {} -vf fps=2 -q:v 2 "
                                "FRAMES/%05d.jpg\n    darb train FRAMES --sequential",
                                shell_quoted(video)));
}

// A temporary file for ffmpeg's complaints, deleted with this object.
class LogFile {
  public:
    LogFile() = default;
    LogFile(const LogFile&) = delete;
    LogFile& operator=(const LogFile&) = delete;
    ~LogFile() {
        std::error_code none;
        fs::remove_all(folder_, none);
    }
    fs::path path() const { return folder_ / "errors.txt"; }
    std::string text() const {
        std::error_code none;
        if (!fs::exists(path(), none)) return {};
        std::string text = read_text_file(path());
        if (text.size() > kMostLogChars) text.erase(0, text.size() - kMostLogChars);
        while (text.ends_with('\n') || text.ends_with('\r')) text.pop_back();
        return text;
    }

  private:
    fs::path folder_ = make_scratch_folder("darb_ffmpeg");
};

// An ffmpeg expression that is not 0 for these pictures. It consists of groups, because ffmpeg
// accepts no sum with more than about a hundred terms.
std::string selection(const std::vector<std::size_t>& pictures) {
    constexpr std::size_t kGroup = 50;
    std::string text;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        const char* before = i == 0 ? "(" : i % kGroup == 0 ? ")+(" : "+";
        text += fmt::format("{}eq(n,{})", before, pictures[i]);
    }
    return text + ")";
}

// Throws with what ffmpeg said, and with what to do about the two most common causes.
[[noreturn]] void ffmpeg_failed(const fs::path& video, const LogFile& log) {
    std::string said = "\n" + log.text();
    const auto says = [&](const char* part) { return said.find(part) != std::string::npos; };
    if (says("matches no streams"))
        throw Error(video.string(), "holds no pictures, only sound", "Name a video.");
    const char* hint = says("moov atom not found") || fs::file_size(video) == 0
                           ? "It is incomplete: copy it from the camera again."
                           : "Check that it plays; ffmpeg -i shows what it holds.";
    for (std::size_t at = 0; (at = said.find('\n', at)) != std::string::npos; at += 5)
        said.replace(at, 1, "\n    ");
    throw Error(video.string(), "ffmpeg cannot read it" + (said.size() > 5 ? ":" + said : ""),
                hint);
}

// The option of the installed ffmpeg, as words.
std::vector<std::string> every_picture() {
    std::string help;
    run_process({"ffmpeg", "-hide_banner", "-h", "long"},
                {.errors = ProcessOptions::Output::nowhere}, &help);
    const std::string option = every_picture_option(help);
    const std::size_t space = option.find(' ');
    return {option.substr(0, space), option.substr(space + 1)};
}

// "ffmpeg -nostdin -v error FRONT... (the option above) BACK...".
std::vector<std::string> ffmpeg_words(const std::vector<std::string>& front,
                                      const std::vector<std::string>& back) {
    std::vector<std::string> words{"ffmpeg", "-nostdin", "-v", "error"};
    for (const auto& some : {front, every_picture(), back})
        words.insert(words.end(), some.begin(), some.end());
    return words;
}

}  // namespace

std::string picture_pattern(const fs::path& folder, const std::string& name) {
    std::string pattern;
    for (const char c : fs::absolute(folder).generic_string())
        pattern += c == '%' ? "%%" : std::string(1, c);
    return pattern + (pattern.ends_with('/') ? "" : "/") + name;
}

std::string every_picture_option(std::string_view help) {
    // Must stand at the beginning of a line: the help for -vsync may mention -fps_mode.
    const auto lists = [&](const std::string& option) {
        return help.starts_with(option) || help.find("\n" + option) != std::string_view::npos;
    };
    const bool old_alone = lists("-vsync") && !lists("-fps_mode");
    return old_alone ? "-vsync passthrough" : "-fps_mode passthrough";
}

bool is_video_name(const fs::path& path) {
    const std::string extension = lower(path.extension().string());
    return std::ranges::find(kVideoExtensions, extension) != std::end(kVideoExtensions);
}

std::string video_extensions() {
    return fmt::format("{}", fmt::join(kVideoExtensions, ", "));
}

double laplacian_variance(const unsigned char* grey, int width, int height) {
    double sum = 0, squares = 0;
    for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < width; ++x) {
            const unsigned char* at = grey + static_cast<std::ptrdiff_t>(y) * width + x;
            const double value = 4.0 * at[0] - at[-1] - at[1] - at[-width] - at[width];
            sum += value;
            squares += value * value;
        }
    const double count = std::max(1.0, double(width - 2) * (height - 2));
    return squares / count - (sum / count) * (sum / count);
}

std::vector<double> video_sharpness(const fs::path& video) {
    need_ffmpeg(video);
    const LogFile log;
    ChildProcess ffmpeg(
        ffmpeg_words({"-i", fs::absolute(video).string(), "-map", "0:v:0", "-vf",
                      fmt::format("scale={}:{},format=gray", kProbeWidth, kProbeHeight)},
                     {"-f", "rawvideo", "-"}),
        {.output = ProcessOptions::Output::piped, .errors_file = log.path()});
    std::vector<char> picture(std::size_t{kProbeWidth} * kProbeHeight);
    std::vector<double> sharpness;
    for (std::size_t filled = 0;;) {
        const std::size_t count = ffmpeg.read(std::span(picture).subspan(filled)).value_or(0);
        if (count == 0) break;
        filled += count;
        if (filled < picture.size()) continue;
        filled = 0;
        sharpness.push_back(laplacian_variance(
            reinterpret_cast<const unsigned char*>(picture.data()), kProbeWidth, kProbeHeight));
    }
    if (!ffmpeg.wait().is_good() || sharpness.empty()) ffmpeg_failed(video, log);
    return sharpness;
}

std::vector<std::size_t> sharpest_of_intervals(const std::vector<double>& sharpness,
                                               std::size_t wanted) {
    const std::size_t count = sharpness.size(), intervals = std::min(wanted, count);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < intervals; ++i) {
        const auto begin = sharpness.begin() + static_cast<std::ptrdiff_t>(i * count / intervals);
        const auto end =
            sharpness.begin() + static_cast<std::ptrdiff_t>((i + 1) * count / intervals);
        kept.push_back(static_cast<std::size_t>(std::max_element(begin, end) - sharpness.begin()));
    }
    return kept;
}

void write_video_frames(const fs::path& video, const std::vector<std::size_t>& pictures,
                        const fs::path& folder) {
    need_ffmpeg(video);
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure)
        throw Error(folder.string(), "cannot be made: " + failure.message(),
                    "Choose another output folder with -o.");
    const LogFile log;
    const ProcessEnd ended =
        run_process(ffmpeg_words({"-y", "-i", fs::absolute(video).string(), "-map", "0:v:0", "-vf",
                                  fmt::format("select='{}'", selection(pictures))},
                                 {"-q:v", "2", picture_pattern(folder, "frame_%05d.jpg")}),
                    {.errors_file = log.path()});
    if (!ended.is_good()) ffmpeg_failed(video, log);
}

}  // namespace darb
