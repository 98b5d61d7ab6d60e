#include "viewer/export_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <sstream>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kFirstLine =
    "Written by darb view --export, which replaces and deletes these files alone:\n";

// Links are not followed: what they lead to is not in this folder.
bool is_plain_file(const fs::path& path) {
    std::error_code none;
    return fs::symlink_status(path, none).type() == fs::file_type::regular;
}

bool is_missing(const fs::path& path) {
    std::error_code none;
    return fs::symlink_status(path, none).type() == fs::file_type::not_found;
}

bool can_be_listed(const std::string& name) {
    return frame_number(name) >= 0 || name == ExportFolder::kVideo ||
           name == ExportFolder::kUnfinishedVideo;
}

}  // namespace

std::string frame_name(std::int64_t n) {
    return fmt::format("frame_{:05d}.png", n);
}

std::int64_t frame_number(const std::string& name) {
    constexpr std::string_view kStart = "frame_", kEnd = ".png";
    if (name.size() <= kStart.size() + kEnd.size()) return -1;
    std::int64_t number = -1;
    const char* const digits = name.data() + kStart.size();
    const char* const end = name.data() + name.size() - kEnd.size();
    if (std::from_chars(digits, end, number).ptr != end || number < 0) return -1;
    return name == frame_name(number) ? number : -1;
}

ExportFolder::ExportFolder(fs::path folder, std::int64_t frames) : folder_(std::move(folder)) {
    read_list();
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none)) {
        const std::string name = entry.path().filename().string();
        const std::int64_t n = frame_number(name);
        if ((n >= 0 && n < frames) || name == kVideo || name == kUnfinishedVideo) check_free(name);
    }
    if (is_missing(folder_ / kList)) write_list();
}

// Whether there is one.
bool ExportFolder::check_list() const {
    const fs::path file = folder_ / kList;
    if (is_missing(file)) return false;
    if (!is_plain_file(file) || !read_text_file(file).starts_with(kFirstLine))
        throw Error(file.string(), "is not the list of an export's files",
                    "Choose another folder, or move it away.");
    return true;
}

void ExportFolder::read_list() {
    if (!check_list()) return;
    std::istringstream text(read_text_file(folder_ / kList));
    std::string line;
    while (std::getline(text, line))
        if (can_be_listed(line)) listed_.insert(line);
}

bool ExportFolder::is_ours(const std::string& name) const {
    return listed_.contains(name) && is_plain_file(folder_ / name);
}

void ExportFolder::check_free(const std::string& name) const {
    const fs::path file = folder_ / name;
    if (is_missing(file) || is_ours(name)) return;
    throw Error(file.string(),
                is_plain_file(file) ? fmt::format("is there, and {} does not say that an export "
                                                  "wrote it",
                                                  kList)
                                    : "is there, and is not a file that an export wrote",
                "Choose another folder, or move it away: an export replaces its own files alone.");
}

fs::path ExportFolder::claim(const std::string& name) {
    check_free(name);
    const fs::path list = folder_ / kList;
    if (listed_.contains(name)) return folder_ / name;
    // Appended, not rewritten: a line a frame, and all of them are there when the export is killed.
    const int file = ::open(list.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW);
    const std::string line = name + '\n';
    const bool written =
        file >= 0 && ::write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
    const std::string reason = std::strerror(errno);
    if (file >= 0) ::close(file);
    if (!written)
        throw Error(list.string(), "cannot be written: " + reason,
                    "Free space or choose another folder.");
    listed_.insert(name);
    return folder_ / name;
}

void ExportFolder::keep_video() {
    const fs::path video = claim(kVideo);
    fs::rename(folder_ / kUnfinishedVideo, video);
}

void ExportFolder::drop_unfinished_video() const {
    if (is_ours(kUnfinishedVideo)) ::unlink((folder_ / kUnfinishedVideo).c_str());
}

void ExportFolder::finish(std::int64_t frames) {
    check_list();
    for (const std::string& name : listed_)
        if (frame_number(name) >= frames && is_ours(name)) ::unlink((folder_ / name).c_str());
    std::erase_if(listed_, [&](const std::string& name) { return is_missing(folder_ / name); });
    write_list();
}

void ExportFolder::write_list() const {
    std::string text(kFirstLine);
    for (const std::string& name : listed_) text += name + '\n';
    write_file_atomic(folder_ / kList, text);
}

}  // namespace darb
