// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

#include "engine/core/system_files.h"

namespace darb {

namespace {

std::error_code last_error() {
    return {errno, std::generic_category()};
}

FileFacts facts_of(const struct stat& found) {
    const mode_t mode = found.st_mode;
    FileFacts facts;
    facts.kind = S_ISREG(mode)    ? FileKind::regular
                 : S_ISDIR(mode)  ? FileKind::folder
                 : S_ISFIFO(mode) ? FileKind::pipe
                 : S_ISSOCK(mode) ? FileKind::socket
                                  : FileKind::device;
    facts.id = {std::uint64_t(found.st_dev), std::uint64_t(found.st_ino), 0};
    facts.bytes = std::uint64_t(found.st_size);
#ifdef __APPLE__
    const timespec& changed = found.st_mtimespec;
#else
    const timespec& changed = found.st_mtim;
#endif
    facts.changed_ns = std::int64_t{changed.tv_sec} * 1'000'000'000 + changed.tv_nsec;
    return facts;
}

int flags_of(File::Open how) {
    switch (how) {
        case File::Open::read:
            return O_RDONLY | O_NONBLOCK | O_NOCTTY;
        case File::Open::make:
            return O_WRONLY | O_CREAT | O_EXCL;
        case File::Open::write:
            return O_WRONLY;
        case File::Open::append:
            return O_WRONLY | O_CREAT | O_APPEND;
        case File::Open::append_own:
            return O_WRONLY | O_APPEND | O_NOFOLLOW;
        case File::Open::lock:
            return O_RDWR | O_CREAT | O_NOFOLLOW;
    }
    return O_RDONLY;
}

}  // namespace

FileFacts file_facts(const std::filesystem::path& path) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 ? facts_of(found) : FileFacts{};
}

File::File(const std::filesystem::path& path, Open how)
    : handle_(::open(path.c_str(), flags_of(how) | O_CLOEXEC, 0666)) {
    if (!is_open()) error_ = last_error();
}

FileFacts File::facts() const {
    struct stat found {};
    return ::fstat(int(handle_), &found) == 0 ? facts_of(found) : FileFacts{};
}

std::ptrdiff_t File::read(std::span<std::byte> to) {
    for (;;) {
        const ssize_t got = ::read(int(handle_), to.data(), to.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) error_ = last_error();
        return got;
    }
}

bool File::write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t wrote = ::write(int(handle_), bytes.data(), bytes.size());
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) {
            error_ = last_error();
            return false;
        }
        bytes = bytes.subspan(std::size_t(wrote));
    }
    return true;
}

bool File::replace_content(std::string_view text) {
    const bool done = ::ftruncate(int(handle_), 0) == 0 &&
                      ::pwrite(int(handle_), text.data(), text.size(), 0) == ssize_t(text.size());
    if (!done) error_ = last_error();
    return done;
}

std::string File::head(std::size_t most) {
    std::string text(most, '\0');
    const ssize_t got = ::pread(int(handle_), text.data(), text.size(), 0);
    text.resize(got > 0 ? std::size_t(got) : 0);
    return text;
}

bool File::sync() {
    if (::fsync(int(handle_)) == 0 || errno == EINVAL || errno == EROFS) return true;
    error_ = last_error();
    return false;
}

void File::take_permissions_of(const std::filesystem::path& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) == 0) ::fchmod(int(handle_), found.st_mode & 07777);
}

bool File::lock() {
    return ::flock(int(handle_), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void File::close() {
    if (is_open()) ::close(int(handle_));
    handle_ = kClosed;
}

std::error_code replace_file(const std::filesystem::path& from, const std::filesystem::path& to) {
    return ::rename(from.c_str(), to.c_str()) == 0 ? std::error_code() : last_error();
}

std::filesystem::path make_scratch_folder(const std::string& name) {
    std::string folder = std::filesystem::temp_directory_path() / (name + "_XXXXXX");
    if (::mkdtemp(folder.data()) == nullptr)
        throw std::filesystem::filesystem_error("cannot make a folder", folder, last_error());
    return folder;
}

bool has_device_name(const std::filesystem::path&) {
    return false;
}

}  // namespace darb
