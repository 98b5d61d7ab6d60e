// SPDX-License-Identifier: MIT
#include "engine/data/run_colmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <optional>
#include <system_error>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/process.h"
#include "engine/data/colmap.h"

namespace darb {

namespace {

// The mapper's time grows with this power of the number of photos, measured on recorded runs.
constexpr double kMapperPower = 1.5;

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/// Takes off the number that `text` begins with; returns false where there is none.
bool take_number(std::string_view& text, std::size_t& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return true;
}

bool take(std::string_view& text, char c) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    while (text.starts_with(' ')) text.remove_prefix(1);
    return true;
}

/// Finds what follows the first of these words that occurs; returns false where none does.
bool find_behind(std::string_view text, std::initializer_list<std::string_view> words,
                 std::string_view& behind) {
    for (const std::string_view word : words)
        if (const std::size_t at = text.find(word); at != std::string_view::npos) {
            behind = text.substr(at + word.size());
            return true;
        }
    return false;
}

struct Counts {
    std::size_t a = 0, of_a = 0, b = 1, of_b = 1;
};

/// Takes off "3/60]" or "1/4, 2/4]".
bool take_counts(std::string_view& text, Counts& counts) {
    if (!take_number(text, counts.a) || !take(text, '/') || !take_number(text, counts.of_a))
        return false;
    if (take(text, ',') &&
        (!take_number(text, counts.b) || !take(text, '/') || !take_number(text, counts.of_b)))
        return false;
    return take(text, ']') && counts.a >= 1 && counts.a <= counts.of_a && counts.b >= 1 &&
           counts.b <= counts.of_b && counts.of_a <= 10'000'000 && counts.of_b <= 10'000'000;
}

/// The line without the head that glog writes, "I20250412 20:08:49.215745 96464 file.cc:390] ".
std::string_view without_head(std::string_view line) {
    if (line.size() > 2 && std::string_view("IWEF").find(line[0]) != std::string_view::npos &&
        is_digit(line[1]))
        if (const std::size_t at = line.find("] "); at != std::string_view::npos)
            line.remove_prefix(at + 2);
    while (line.starts_with(' ')) line.remove_prefix(1);
    return line;
}

/// Whether the text is " in 45.332s" or "in 7.1s": the time of a part that is done.
bool is_duration(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ') || text.ends_with('\r')) text.remove_suffix(1);
    return text.size() > 4 && text.starts_with("in ") && is_digit(text[3]) && text.ends_with('s');
}

}  // namespace

bool ColmapOutput::set(std::size_t done, std::size_t total) {
    const bool changed = done != done_ || total != total_;
    done_ = done;
    total_ = total;
    return changed;
}

bool ColmapOutput::read_match(std::string_view text) {
    std::string_view behind;
    Counts counts;
    bool ended = false;
    if (find_behind(text,
                    {"Matching block [", "Processing block [", "Matching image [",
                     "Processing image [", "Matching batch [", "Processing batch ["},
                    behind) &&
        take_counts(behind, counts)) {
        parts_ = counts.of_a * counts.of_b;
        parts_begun_ = (counts.a - 1) * counts.of_b + counts.b;
        ended = is_duration(behind);
    } else if (parts_begun_ > 0 && is_duration(text)) {
        ended = true;
    } else {
        return false;
    }
    const std::size_t parts_done = parts_begun_ - (ended ? 0 : 1);
    if (pairs_ == 0) return set(std::max(done_, parts_done), parts_);
    // The blocks hold roughly equal numbers of pairs.
    const double share = double(parts_done) / double(parts_);
    return set(std::max(done_, std::size_t(std::llround(share * double(pairs_)))), pairs_);
}

bool ColmapOutput::read_map(std::string_view text) {
    std::string_view behind;
    std::size_t number = 0;
    if (find_behind(text, {"Initializing with image pair #", "Registering initial image pair #"},
                    behind)) {
        if (done_ > 2) ++model_;  // a model of two photos was given up
        return set(2, photos_);
    }
    if (!find_behind(text, {"Registering image #"}, behind) || !take_number(behind, number) ||
        !take(behind, '('))
        return false;
    if (behind.starts_with("num_reg_"))
        behind.remove_prefix(std::min(behind.find('='), behind.size()));
    if (behind.starts_with('=')) behind.remove_prefix(1);
    if (!take_number(behind, number) || !behind.starts_with(')')) return false;
    return set(photos_ > 0 ? std::min(number, photos_) : number, photos_);
}

bool ColmapOutput::read(std::string_view line) {
    const std::string_view text = without_head(line);
    std::string_view behind;
    Counts counts;
    switch (step_) {
        case ColmapStep::extract: {
            std::size_t number = 0;
            if (text.starts_with("Features:")) {
                behind = text.substr(9);
                while (behind.starts_with(' ')) behind.remove_prefix(1);
                if (take_number(behind, number)) features_.push_back(number);
                return false;
            }
            return text.starts_with("Processed file [") &&
                   take_counts(behind = text.substr(16), counts) && set(counts.a, counts.of_a);
        }
        case ColmapStep::match:
            return read_match(text);
        case ColmapStep::map:
            return read_map(text);
        case ColmapStep::undistort:
            return find_behind(text, {"Undistorting image ["}, behind) &&
                   take_counts(behind, counts) && set(counts.a, counts.of_a);
    }
    return false;
}

double colmap_seconds_left(ColmapStep step, double seconds, std::size_t done, std::size_t total) {
    if (done == 0 || total == 0 || seconds <= 0) return -1;
    const double ratio = double(total) / double(std::min(done, total));
    const double power = step == ColmapStep::map ? kMapperPower : 1.0;
    return seconds * (std::pow(ratio, power) - 1);
}

namespace fs = std::filesystem;

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kKeptLines = 8;  // printed lines shown when a command fails
constexpr int kTick_ms = 500;  // between checks of the stop flag; every second one also reports
constexpr const char* kOptionsFile = "options.txt";

std::string joined(const auto& lines) {
    std::string text;
    for (const std::string& line : lines) text += "\n    " + line;
    return text;
}

constexpr const char* kPhotosHint =
    "Photos need 60 % overlap and texture; see what colmap says above.";
// A camera that stands still, or only turns, shows no depth.
constexpr const char* kMotionHint =
    "The camera must move between photos, around the scene; they need 60 % overlap, texture, and "
    "no blur.";

// The command as a user would type it in a shell.
std::string shell_text(const ColmapCommand& command) {
    std::string text = "QT_QPA_PLATFORM=offscreen";
    for (const std::string& word : command) {
        const bool plain = std::ranges::all_of(word, [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                   c == '_' || c == '-' || c == '.';
        });
        text += " " + (plain && !word.empty() ? word : shell_quoted(word));
    }
    return text;
}

bool is_stopped(const std::atomic<bool>* stop) {
    return stop != nullptr && stop->load();
}

/// Passes on each line and, with whole = false, the beginning of a line that has not ended; calls
/// on_tick twice a second. Throws ColmapStopped.
ProcessEnd run_to_end(const ColmapCommand& command, const std::atomic<bool>* stop,
                      const std::function<void(std::string_view line, bool whole)>& on_line,
                      const std::function<void()>& on_tick) {
    using enum ProcessOptions::Output;
    ChildProcess process(command, {.variables = {{"QT_QPA_PLATFORM", "offscreen"}},
                                   .output = piped,
                                   .errors = piped,
                                   .no_input = true,
                                   .ends_with_this = true});
    std::string rest;
    std::array<char, 4096> part;
    for (;;) {
        if (is_stopped(stop)) throw ColmapStopped{};
        const std::optional<std::size_t> bytes = process.read(part, kTick_ms);
        if (on_tick) on_tick();
        if (!bytes) continue;
        if (*bytes == 0) break;
        rest.append(part.data(), *bytes);
        std::size_t begin = 0;
        for (std::size_t end; (end = rest.find_first_of("\r\n", begin)) != std::string::npos;
             begin = end + 1)
            if (end > begin) on_line(std::string_view(rest).substr(begin, end - begin), true);
        rest.erase(0, begin);
        if (!rest.empty()) on_line(rest, false);
    }
    if (!rest.empty()) on_line(rest, true);
    const ProcessEnd ended = process.wait();
    // A Ctrl-C in the terminal reaches COLMAP as well, and maybe earlier than this process.
    for (int i = 0; i < 5 && ended.was_killed && stop != nullptr && !is_stopped(stop); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (is_stopped(stop)) throw ColmapStopped{};
    return ended;
}

/// What a command prints, whatever its exit status: some versions report their help as a failure.
std::string colmap_output_of(const ColmapCommand& command, const std::atomic<bool>* stop) {
    std::string text;
    run_to_end(command, stop,
               [&](std::string_view line, bool whole) {
                   if (whole) text += std::string(line) + "\n";
               },
               {});
    return text;
}

std::map<std::string, std::size_t> models_below(const fs::path& sparse) {
    std::map<std::string, std::size_t> models;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(sparse, ignored))
        if (is_colmap_model(entry.path()))
            models[entry.path().filename().string()] = count_colmap_images(entry.path());
    return models;
}

std::size_t photos_of_largest(const fs::path& sparse) {
    const std::string model = largest_colmap_model(sparse);
    return model.empty() ? 0 : std::max<std::size_t>(1, count_colmap_images(sparse / model));
}

bool lists(const std::string& help, const std::string& option) {
    const std::string word = "--" + option;
    for (std::size_t at = 0; (at = help.find(word, at)) != std::string::npos; ++at) {
        const std::size_t end = at + word.size();
        if (end == help.size() || help[end] == ' ' || help[end] == '\n') return true;
    }
    return false;
}

// Adds the first of these names that the version knows; where it knows none, the option is left
// out.
void add_option(ColmapCommand& command, const std::string& help,
                std::initializer_list<const char*> names, const std::string& value) {
    for (const char* name : names) {
        if (!lists(help, name)) continue;
        command.push_back(std::string("--") + name);
        command.push_back(value);
        return;
    }
}

// Small enough to show progress while blocks are matched, and to lose little when COLMAP is ended,
// as a block is saved as a whole. Large enough to keep the cores busy.
std::size_t block_size(std::size_t photos) {
    const double cores = std::max(1u, std::thread::hardware_concurrency());
    const auto busy = static_cast<std::size_t>(std::ceil(std::sqrt(8 * cores)));
    return std::clamp<std::size_t>(std::max((photos + 4) / 5, busy), 2, 50);
}

bool matches_neighbours(const ColmapRun& run) {
    return run.sequential || (run.effort == ColmapEffort::quick && run.quick_sequential);
}

const char* matcher_name(const ColmapRun& run) {
    if (!run.pairs.empty()) return "matches_importer";
    return matches_neighbours(run) ? "sequential_matcher" : "exhaustive_matcher";
}

ColmapCommand extractor(const ColmapRun& run, const ColmapPaths& paths, const ColmapHelp& help) {
    const std::string part = help.has_new_names() ? "Feature" : "Sift";
    // OPENCV suits phones and consumer cameras; the undistorter turns it into a pinhole.
    ColmapCommand command{"colmap",
                          "feature_extractor",
                          "--database_path",
                          paths.database.string(),
                          "--image_path",
                          run.photos.string(),
                          "--ImageReader.single_camera",
                          run.single_camera ? "1" : "0",
                          "--ImageReader.camera_model",
                          run.pinhole > 0 ? "PINHOLE" : "OPENCV",
                          "--" + part + "Extraction.use_gpu",
                          "0"};
    if (run.pinhole > 0)
        command.insert(command.end(), {"--ImageReader.camera_params",
                                       fmt::format("{0},{0},{0},{0}", 0.5 * run.pinhole)});
    if (!run.masks.empty())
        command.insert(command.end(), {"--ImageReader.mask_path", run.masks.string()});
    const auto add = [&](std::initializer_list<const char*> names, const char* value) {
        add_option(command, help.extractor, names, value);
    };
    if (run.effort == ColmapEffort::quick) {
        add({"FeatureExtraction.max_image_size", "SiftExtraction.max_image_size"}, "1000");
        add({"SiftExtraction.max_num_features"}, "2048");
    } else if (run.effort == ColmapEffort::thorough) {
        add({"SiftExtraction.max_num_features"}, "16384");
        add({"SiftExtraction.peak_threshold"}, "0.002");
    }
    return command;
}

ColmapCommand matcher(const ColmapRun& run, const ColmapPaths& paths, const ColmapHelp& help) {
    const std::string part = help.has_new_names() ? "Feature" : "Sift";
    const bool neighbours = matches_neighbours(run), hard = run.effort == ColmapEffort::thorough;
    ColmapCommand command{"colmap",
                          matcher_name(run),
                          "--database_path",
                          paths.database.string(),
                          "--" + part + "Matching.use_gpu",
                          "0"};
    const auto add = [&](std::initializer_list<const char*> names, const std::string& value) {
        add_option(command, help.matcher, names, value);
    };
    if (!run.pairs.empty())
        command.insert(command.end(),
                       {"--match_list_path", run.pairs.string(), "--match_type", "pairs"});
    else if (!neighbours && run.count > 0)
        add({"ExhaustiveMatching.block_size"}, std::to_string(block_size(run.count)));
    if (!hard) return command;
    if (neighbours && run.pairs.empty()) add({"SequentialMatching.overlap"}, "20");
    add({"FeatureMatching.guided_matching", "SiftMatching.guided_matching"}, "1");
    add({"SiftMatching.max_ratio"}, "0.85");
    add({"TwoViewGeometry.min_num_inliers", "SiftMatching.min_num_inliers"}, "10");
    return command;
}

ColmapCommand mapper(const ColmapRun& run, const ColmapPaths& paths, const ColmapHelp& help) {
    ColmapCommand command{"colmap",          "mapper",
                          "--database_path", paths.database.string(),
                          "--image_path",    run.photos.string(),
                          "--output_path",   paths.models.string()};
    if (run.pinhole > 0)
        for (const char* part : {"focal_length", "principal_point", "extra_params"})
            command.insert(command.end(), {fmt::format("--Mapper.ba_refine_{}", part), "0"});
    if (run.effort != ColmapEffort::thorough) return command;
    const auto add = [&](const char* name, const char* value) {
        add_option(command, help.mapper, {name}, value);
    };
    add("Mapper.min_num_matches", "10");
    add("Mapper.init_min_num_inliers", "50");
    add("Mapper.init_min_tri_angle", "8");
    add("Mapper.abs_pose_min_num_inliers", "15");
    add("Mapper.abs_pose_min_inlier_ratio", "0.15");
    return command;
}

}  // namespace

// The mapper's largest model need not have the number 0.
std::string largest_colmap_model(const fs::path& sparse) {
    const std::map<std::string, std::size_t> models = models_below(sparse);
    if (models.empty()) return {};
    return std::max_element(models.begin(), models.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
}

std::string shell_quoted(const fs::path& path) {
    std::string text = "'";
    for (const char c : path.string()) {
        if (c == '\'')
            text += "'\\''";
        else
            text += c;
    }
    return text + "'";
}

bool ColmapHelp::has_new_names() const {
    return lists(extractor, "FeatureExtraction.use_gpu");
}

ColmapPaths plain_paths(const ColmapRun& run) {
    return {run.workspace / "database.db", run.workspace / "sparse", run.workspace / "sparse" / "0",
            run.workspace / "dense"};
}

std::vector<ColmapCommand> colmap_commands(const ColmapRun& run, const ColmapPaths& paths,
                                           const ColmapHelp& help) {
    return {extractor(run, paths, help),
            matcher(run, paths, help),
            mapper(run, paths, help),
            {"colmap", "image_undistorter", "--image_path", run.photos.string(), "--input_path",
             paths.model.string(), "--output_path", paths.dense.string(), "--output_type", "COLMAP",
             "--max_image_size", std::to_string(run.max_image_size)}};
}

namespace {

constexpr const char* effort_name(ColmapEffort effort) {
    return effort == ColmapEffort::quick      ? "quick"
           : effort == ColmapEffort::thorough ? "thorough"
                                              : "usual";
}

/// The state of one call of run_colmap.
class ColmapRunner {
  public:
    ColmapRunner(const ColmapRun& run, const ColmapReports& reports)
        : run_(run), reports_(reports) {}
    fs::path data_set();

  private:
    struct Attempt {
        fs::path folder;
        ColmapEffort effort;
        std::size_t found;  // photos in the largest model
    };
    void note(const std::string& text) const {
        if (reports_.note) reports_.note(text);
    }
    void ask_for_help();
    std::size_t pairs_of(const ColmapCommand& command) const;
    /// Throws Error where the command fails, unless may_fail.
    void step(ColmapStep step, const ColmapCommand& command, bool may_fail = false);
    Attempt attempt(std::size_t number, ColmapEffort effort);
    void find_cameras();
    void keep(const Attempt& best) const;
    void tell_next(std::size_t found, ColmapEffort next) const;
    void tell_models() const;
    void undistort();

    ColmapRun run_;
    const ColmapReports& reports_;
    ColmapHelp help_;
    std::size_t photos_ = 0, features_ = 0;  // features: of most photos; 0: not known
    std::string failure_;                    // what the last mapper failed with
};

void remove_folder(const fs::path& path) {
    std::error_code failure;
    fs::remove_all(path, failure);
    if (failure)
        throw Error(path.string(), "cannot be removed: " + failure.message(), "Remove it by hand.");
}

void make_folder(const fs::path& path) {
    std::error_code failure;
    fs::create_directories(path, failure);
    if (failure)
        throw Error(path.string(), "cannot be made: " + failure.message(),
                    "Choose another workspace folder.");
}

void move_over(const fs::path& from, const fs::path& to) {
    std::error_code failure;
    if (!fs::exists(from)) return;
    remove_folder(to);
    fs::rename(from, to, failure);
    if (failure)
        throw Error(to.string(), "cannot be made: " + failure.message(), "Remove what is there.");
}

void ColmapRunner::ask_for_help() {
    if (!help_.extractor.empty()) return;
    const auto ask = [&](const char* command) {
        return colmap_output_of({"colmap", command, "-h"}, run_.stop);
    };
    help_.extractor = ask("feature_extractor") + "\n";  // not empty, to show that it was asked
    help_.matcher = ask(matcher_name(run_));
    if (run_.effort == ColmapEffort::thorough) help_.mapper = ask("mapper");
}

// The number of pairs that a matcher compares; 0: not known.
std::size_t ColmapRunner::pairs_of(const ColmapCommand& command) const {
    if (command[1] == "exhaustive_matcher") return photos_ * (photos_ - 1) / 2;
    if (command[1] != "matches_importer") return 0;
    const std::string list = read_text_file(run_.pairs);
    return static_cast<std::size_t>(std::ranges::count(list, '\n'));
}

void ColmapRunner::step(ColmapStep step, const ColmapCommand& command, bool may_fail) {
    const std::size_t number = static_cast<std::size_t>(step) + 1;
    ColmapOutput output(step, photos_, pairs_of(command));
    note(fmt::format("[{}/{}] {}", number, kColmapSteps, shell_text(command)));
    std::ofstream log(run_.workspace / "colmap.log", std::ios::app);
    log << shell_text(command) << "\n";
    std::deque<std::string> last;
    const Clock::time_point start = Clock::now();
    Clock::time_point told = start;
    const auto since_start = [&] {
        return std::chrono::duration<double>(Clock::now() - start).count();
    };
    double seconds_at_change = 0;
    const auto tell = [&] {
        told = Clock::now();
        if (!reports_.progress) return;
        const double left =
            colmap_seconds_left(step, seconds_at_change, output.done(), output.total());
        // Counts down between two changes; once a step takes longer than estimated, the time left
        // is unknown.
        const double now = since_start(), rest = left + seconds_at_change - now;
        reports_.progress(number, output, now, rest > 0 ? rest : -1);
    };
    const auto on_line = [&](std::string_view line, bool whole) {
        if (whole) {
            log << line << "\n" << std::flush;
            last.emplace_back(line);
            if (last.size() > kKeptLines) last.pop_front();
            if (reports_.line) reports_.line(line);
        } else if (step != ColmapStep::match) {
            return;
        }
        if (!output.read(line)) return;
        seconds_at_change = since_start();
        tell();
    };
    const auto on_tick = [&] {
        if (Clock::now() - told >= std::chrono::seconds(1)) tell();
    };
    const ProcessEnd ended = run_to_end(command, run_.stop, on_line, on_tick);
    if (step == ColmapStep::extract) {
        if (photos_ == 0) photos_ = output.total();
        std::vector<std::size_t> counts = output.features();
        const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
        std::nth_element(counts.begin(), middle, counts.end());
        if (!counts.empty()) features_ = *middle;
    }
    if (ended.is_good()) return;
    const std::string failure =
        fmt::format("failed:\n    {}\n  It printed last:{}", shell_text(command), joined(last));
    if (!may_fail || ended.was_killed)
        throw Error("colmap", failure, step == ColmapStep::map ? kMotionHint : kPhotosHint);
    failure_ = failure;
}

ColmapRunner::Attempt ColmapRunner::attempt(std::size_t number, ColmapEffort effort) {
    run_.effort = effort;
    help_.extractor.clear();
    ask_for_help();
    const fs::path folder = run_.workspace / fmt::format("attempt_{}", number),
                   unfinished = folder / "sparse.unfinished", sparse = folder / "sparse";
    const std::vector<ColmapCommand> commands =
        colmap_commands(run_, {folder / "database.db", unfinished, {}, {}}, help_);
    // The block size does not affect the result, and depends on the machine.
    std::string options = std::string(effort_name(effort)) + "\n";
    for (const ColmapStep i : {ColmapStep::extract, ColmapStep::match, ColmapStep::map})
        for (std::size_t w = 1; w < commands[std::size_t(i)].size(); ++w) {
            const std::string& word = commands[std::size_t(i)][w];
            if (word.find_first_of("/\\") == std::string::npos) options += word + "\n";
        }
    const fs::path options_file = folder / kOptionsFile;
    if (!fs::exists(options_file) || read_text_file(options_file) != options) {
        remove_folder(folder);  // it was made with other options
        write_file_atomic(options_file, options);
    }
    if (!fs::exists(sparse)) {
        step(ColmapStep::extract, commands[0]);
        step(ColmapStep::match, commands[1]);
        remove_folder(unfinished);
        make_folder(unfinished);
        step(ColmapStep::map, commands[2], true);
        move_over(unfinished, sparse);
    }
    return {folder, effort, photos_of_largest(sparse)};
}

void ColmapRunner::tell_next(std::size_t found, ColmapEffort next) const {
    const std::string features =
        features_ == 0
            ? ""
            : fmt::format(" Half of the photos have fewer than {} features.", features_ + 1);
    const char* way = next == ColmapEffort::usual ? "with the usual number of features, and "
                                                  : "with more and fainter features, ";
    note(fmt::format(
        "COLMAP found the cameras of {} of {} photos.{} It tries again {}comparing {}.", found,
        photos_, features, way, run_.sequential ? "more neighbours" : "all pairs"));
}

void ColmapRunner::find_cameras() {
    std::vector<ColmapEffort> efforts{ColmapEffort::thorough};
    if (run_.effort != ColmapEffort::thorough) efforts.insert(efforts.begin(), ColmapEffort::usual);
    if (run_.effort == ColmapEffort::quick) efforts.insert(efforts.begin(), ColmapEffort::quick);
    std::optional<Attempt> best;
    for (std::size_t i = 0; i < efforts.size(); ++i) {
        const Attempt now = attempt(i + 1, efforts[i]);
        if (i > 0)
            note(fmt::format("Try {} found {}, {} is kept.", i + 1, now.found,
                             now.found > best->found ? "which" : "the one before"));
        if (!best || now.found > best->found) best = now;
        const bool enough =
            photos_ > 0 ? double(best->found) >= run_.enough * double(photos_) : best->found > 0;
        if (enough) break;
        if (i + 1 < efforts.size()) tell_next(best->found, efforts[i + 1]);
    }
    if (best->found == 0)
        throw failure_.empty()
            ? Error(run_.photos.string(), "colmap found no common view of the photos", kMotionHint)
            : Error("colmap", failure_, kMotionHint);
    keep(*best);
}

// sparse is moved last, so that everything is complete where it exists.
void ColmapRunner::keep(const Attempt& best) const {
    for (const char* part : {"database.db", kOptionsFile, "sparse"})
        move_over(best.folder / part, run_.workspace / part);
}

void ColmapRunner::tell_models() const {
    const fs::path sparse = run_.workspace / "sparse";
    std::string rest;
    std::size_t others = 0;
    for (const auto& [name, count] : models_below(sparse)) {
        if (name == largest_colmap_model(sparse)) continue;
        rest += fmt::format("{}{} of {}", rest.empty() ? "" : ", ", name, count);
        ++others;
    }
    if (others > 0)
        note(fmt::format(
            "{} models: {}, of {} photos, is the largest and is used. The others ({}) do not "
            "hang together with it.",
            others + 1, (sparse / largest_colmap_model(sparse)).string(), photos_of_largest(sparse),
            rest));
}

void ColmapRunner::undistort() {
    const fs::path dense = run_.workspace / "dense",
                   unfinished = run_.workspace / "dense.unfinished",
                   sparse = run_.workspace / "sparse";
    remove_folder(unfinished);
    const std::vector<ColmapCommand> commands =
        colmap_commands(run_, {{}, {}, sparse / largest_colmap_model(sparse), unfinished});
    step(ColmapStep::undistort, commands[3]);
    move_over(unfinished, dense);
}

fs::path ColmapRunner::data_set() {
    if (!fs::is_directory(run_.photos))
        throw Error(run_.photos.string(), "is no folder of photos", "Check the path.");
    if (!is_installed("colmap")) {
        std::vector<std::string> commands;
        for (const ColmapCommand& command : colmap_commands(run_, plain_paths(run_)))
            commands.push_back(shell_text(command));
        throw Error(
            run_.photos.string(), "holds photos without cameras, and colmap is not installed",
            fmt::format("Install it (apt install colmap), or run elsewhere:\n    mkdir -p {}{}",
                        shell_quoted(run_.workspace / "sparse"), joined(commands)));
    }
    make_folder(run_.workspace);
    photos_ = run_.count;
    if (largest_colmap_model(run_.workspace / "sparse").empty()) find_cameras();
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(run_.workspace, none))
        if (entry.path().filename().string().starts_with("attempt_")) remove_folder(entry.path());
    tell_models();
    if (run_.pinhole > 0)
        return run_.workspace / "sparse" / largest_colmap_model(run_.workspace / "sparse");
    undistort();
    return run_.workspace / "dense";
}

}  // namespace

ColmapEffort effort_of_colmap(const fs::path& workspace) {
    if (!fs::exists(workspace / kOptionsFile)) return ColmapEffort::usual;
    const std::string text = read_text_file(workspace / kOptionsFile);
    for (const ColmapEffort effort : {ColmapEffort::quick, ColmapEffort::thorough})
        if (text.starts_with(std::string(effort_name(effort)) + "\n")) return effort;
    return ColmapEffort::usual;
}

fs::path run_colmap(const ColmapRun& run, const ColmapReports& reports) {
    return ColmapRunner(run, reports).data_set();
}

}  // namespace darb
