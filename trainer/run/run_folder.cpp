// SPDX-License-Identifier: MIT
#include "trainer/run/run_folder.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <regex>
#include <set>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/system.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLockFile = "run.lock";
constexpr const char* kOtherFolder = "Name another output folder with -o.";
constexpr const char* kHolder = "process ";
constexpr const char* kNobody = "another process";
constexpr size_t kLongestHolder = 512;  // bytes of the lock file that are shown
constexpr std::array<std::string_view, 15> kRunNames{
    "checkpoint.darb", "metrics.json", "exposure.json", "report.html",  "run.jsonl",
    "cameras.json",    "kernel.json",  "cfg_args",      "command.json", "request.json",
    "point_cloud",     "held_out",     "scene.html",    "dense_start",  "blocks"};

bool is_numbered(const std::string& name, std::string_view before, std::string_view behind) {
    if (name.size() <= before.size() + behind.size() || !name.starts_with(before) ||
        !name.ends_with(behind))
        return false;
    return std::all_of(name.begin() + std::ptrdiff_t(before.size()),
                       name.end() - std::ptrdiff_t(behind.size()),
                       [](unsigned char c) { return c >= '0' && c <= '9'; });
}

// What the holder wrote, or how to find out.
std::string holder_of(File& file) {
    std::string text = file.head(kLongestHolder);
    text.resize(std::min(text.find('\n'), text.size()));
    return text.empty() ? kNobody : text;
}

bool is_still_there(const File& file, const fs::path& path) {
    const FileFacts own = file.facts(), named = file_facts(path);
    return own.kind != FileKind::none && named.kind != FileKind::none && own.id == named.id;
}

}  // namespace

RunLock::RunLock(const fs::path& folder) : path_(folder / kLockFile) {
    check_file_name(folder);
    std::error_code ignored;  // opening says why
    fs::create_directories(folder, ignored);
    do {
        file_ = File(path_, File::Open::lock);
        if (!file_.is_open())
            throw Error(path_.string(), "cannot be written: " + file_.error().message(),
                        "Choose another output folder with -o.");
        if (!file_.lock())
            throw Error(folder.string(), "another run writes there: " + holder_of(file_),
                        "Wait until it has ended, or name another output folder with -o.");
    } while (!is_still_there(file_, path_));  // the last holder has just removed it
    if (const std::string before = holder_of(file_);
        !before.starts_with(kHolder) && before != kNobody)
        throw Error(path_.string(), "is no lock of this program, which would remove it",
                    "Move it, or name another output folder with -o.");
    // It only tells people.
    file_.replace_content(fmt::format("{}{} on {}\n", kHolder, process_id(), host_name()));
}

RunLock::~RunLock() {
    std::error_code none;
    fs::remove(path_, none);
}

bool is_of_run(const fs::path& path) {
    const std::string name = path.filename().string();
    return std::find(kRunNames.begin(), kRunNames.end(), name) != kRunNames.end() ||
           is_numbered(name, "chkpnt", ".darb");
}

void set_aside(const fs::path& output) {
    std::error_code none;  // there is no such folder
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::directory_iterator(output, none))
        if (is_of_run(entry.path())) found.push_back(entry.path());
    if (found.empty()) return;
    fs::path earlier;
    for (int number = 1;; ++number) {
        earlier = output / fmt::format("earlier.{}", number);
        std::error_code failed;
        if (fs::create_directory(earlier, failed)) break;
        if (failed && !fs::exists(fs::symlink_status(earlier, none)))
            throw Error(earlier.string(), "cannot be made: " + failed.message(), kOtherFolder);
    }
    for (const fs::path& path : found) {
        std::error_code failed;  // the folder is new: nothing is replaced
        fs::rename(path, earlier / path.filename(), failed);
        if (failed)
            throw Error(path.string(),
                        "cannot be moved to " + earlier.string() + ": " + failed.message(),
                        kOtherFolder);
    }
}

namespace {

// The NAME that a temporary file of write_file_atomic (NAME.tmp or NAME.N.tmp) is for, or nothing.
std::string target_of(const fs::path& temporary) {
    const std::regex pattern(R"((.+?)(\.[0-9]+)?\.tmp)");
    const std::string name = temporary.filename().string();
    std::smatch parts;
    return std::regex_match(name, parts, pattern) ? parts[1].str() : "";
}

template <class IsTarget>
void remove_temporaries(const fs::path& folder, IsTarget is_target) {
    std::error_code none;
    std::vector<fs::path> found;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
        if (entry.symlink_status(none).type() == fs::file_type::regular)
            if (const std::string name = target_of(entry.path()); !name.empty() && is_target(name))
                found.push_back(entry.path());
    for (const fs::path& path : found) fs::remove(path, none);
}

// In each folder of `parent` that is no link and whose name has a number behind `before`.
template <class IsTarget>
void remove_temporaries_in(const fs::path& parent, std::string_view before, IsTarget is_target) {
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(parent, none))
        if (entry.symlink_status(none).type() == fs::file_type::directory &&
            is_numbered(entry.path().filename().string(), before, ""))
            remove_temporaries(entry.path(), is_target);
}

}  // namespace

void remove_leftovers(const fs::path& output) {
    remove_temporaries(output, [](const std::string& name) {
        return is_of_run(name) && name != "point_cloud" && name != "held_out" &&
               name != "dense_start" && name != "blocks";
    });
    remove_temporaries_in(output / "point_cloud", "iteration_",
                          [](const std::string& name) { return name == "point_cloud.ply"; });
    remove_temporaries(output / "dense_start", [](const std::string& name) {
        return has_extension(name, ".png") || name == "points.ply";
    });
    remove_temporaries_in(output / "held_out", "",
                          [](const std::string& name) { return has_extension(name, ".png"); });
}

namespace {

// Whether `path`, which need not be there, is `folder` or lies in it, links or not.
bool lies_in(const fs::path& path, const fs::path& folder) {
    std::error_code none;
    for (fs::path at = fs::weakly_canonical(fs::absolute(path), none);;) {
        if (fs::equivalent(at, folder, none)) return true;
        const fs::path above = at.parent_path();
        if (above == at || at.empty()) return false;
        at = above;
    }
}

[[noreturn]] void refuse(const fs::path& output, const fs::path& input, const char* what) {
    throw Error(output.string(), fmt::format("{} {}", what, input.string()), kOtherFolder);
}

}  // namespace

void check_run_folder(const fs::path& output, const Dataset& dataset) {
    std::error_code none;
    const bool file = fs::is_regular_file(dataset.root, none);
    const fs::path root = file ? dataset.root.parent_path() : dataset.root;
    if (fs::equivalent(output, root, none))
        refuse(output, dataset.root, "is the folder of the data set");
    std::set<fs::path> folders{root / "sparse"};
    for (const View& view : dataset.views)
        for (const fs::path& photo : {view.photo, view.mask})
            if (!photo.empty()) folders.insert(photo.parent_path());
    for (const fs::path& folder : folders)
        if (lies_in(output, folder)) refuse(output, folder, "lies among what the run reads, in");
    folders.insert(dataset.root);
    for (const fs::directory_entry& entry : fs::directory_iterator(output, none)) {
        if (!is_of_run(entry.path())) continue;
        for (const fs::path& input : folders)
            if (lies_in(input, entry.path()))
                refuse(entry.path(), input, "is written by a run, and holds");
    }
}

namespace fs = std::filesystem;

namespace {

// Absolute, without a slash at the end.
fs::path whole(const fs::path& path) {
    std::error_code none;
    fs::path absolute = fs::absolute(path, none).lexically_normal();
    return absolute.has_filename() || absolute == absolute.root_path() ? absolute
                                                                       : absolute.parent_path();
}

fs::path place_of(const fs::path& path) {
    std::error_code none;
    const fs::path place = fs::weakly_canonical(path, none);
    return none ? path : place;
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
    if (from.size() < 2) return;  // "/" or "."
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
}

}  // namespace

fs::path seen_from(const fs::path& folder, const fs::path& path) {
    const fs::path absolute = whole(path), from = place_of(whole(folder));
    if (place_of(absolute) == from) return ".";
    const fs::path place = place_of(absolute.parent_path()) / absolute.filename();
    const fs::path relative = place.lexically_relative(from);
    return relative.empty() ? absolute : relative;
}

std::string shared_name(const fs::path& folder, const fs::path& path) {
    const fs::path seen = seen_from(folder, path), from = place_of(whole(folder));
    const auto up = std::count(seen.begin(), seen.end(), fs::path(".."));
    const auto depth = std::distance(from.begin(), from.end()) - 1;  // without the root
    return seen.is_absolute() || up >= depth ? whole(path).filename().string()
                                             : seen.generic_string();
}

namespace {

bool is_slash(char c) {
    return c == '/' || c == fs::path::preferred_separator;
}

// A path as the system writes it, and with slashes where that is something else.
std::vector<std::string> spellings(const fs::path& path) {
    std::vector<std::string> all{path.string()};
    if (path.generic_string() != all[0]) all.push_back(path.generic_string());
    return all;
}

}  // namespace

std::string without_folders(std::string text, const fs::path& path) {
    const std::string name = whole(path).filename().string();
    if (name.empty()) return text;
    for (const fs::path& one : {whole(path), path})
        for (std::string typed : spellings(one)) {
            while (typed.size() > 1 && is_slash(typed.back())) typed.pop_back();
            if (std::any_of(typed.begin(), typed.end(), is_slash)) replace_all(text, typed, name);
        }
    return text;
}

}  // namespace darb
