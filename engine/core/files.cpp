// SPDX-License-Identifier: MIT
#include "engine/core/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include "engine/core/error.h"

namespace darb {

namespace {

struct Descriptor {
    int fd = -1;
    ~Descriptor() {
        if (fd >= 0) ::close(fd);
    }
};

constexpr size_t kAll = std::numeric_limits<size_t>::max();

const char* kind_name(mode_t mode) {
    return S_ISDIR(mode)    ? "a folder"
           : S_ISFIFO(mode) ? "a pipe"
           : S_ISSOCK(mode) ? "a socket"
                            : "a device";
}

void refuse_others(const std::filesystem::path& path, mode_t mode) {
    if (!S_ISREG(mode))
        throw Error(path.string(), fmt::format("is {}, not a file", kind_name(mode)),
                    "Name a file.");
}

/// Checks the kind of file before opening it, because opening a pipe blocks and a device may react;
/// and again afterwards.
int open_to_read(const std::filesystem::path& path) {
    check_is_file(path);
    Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)};
    struct stat facts {};
    if (file.fd < 0 || ::fstat(file.fd, &facts) != 0)
        throw Error(path.string(), std::strerror(errno), "Check the path.");
    refuse_others(path, facts.st_mode);
    return std::exchange(file.fd, -1);
}

template <class Container>
Container read_whole(const std::filesystem::path& path, size_t most = kAll) try {
    const Descriptor file{open_to_read(path)};
    Container content;
    size_t used = 0;
    while (used < most) {
        content.resize(std::min(used + (size_t{1} << 20) + used / 2, most));
        const ssize_t got = ::read(file.fd, content.data() + used, content.size() - used);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw Error(path.string(), std::strerror(errno), "Check the path.");
        if (got == 0) break;
        used += static_cast<size_t>(got);
    }
    content.resize(used);
    return content;
} catch (const std::bad_alloc&) {
    throw NoRoom(path.string(), "is larger than the free memory",
                 "Free memory, or name a smaller file.");
}

/// A temporary file: PATH.tmp, or PATH.1.tmp and so on where that name is taken.
struct Temporary {
    explicit Temporary(const std::filesystem::path& target) {
        for (int number = 0; file.fd < 0; ++number) {
            path = target;
            if (number > 0) path += "." + std::to_string(number);
            path += ".tmp";
            file.fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
            if (file.fd < 0 && errno != EEXIST) return;
        }
    }
    std::filesystem::path path;
    Descriptor file;
};

[[noreturn]] void fail_write(const std::filesystem::path& path, const Temporary& temp) {
    const std::string reason = std::strerror(errno);
    std::error_code ignored;
    if (temp.file.fd >= 0) std::filesystem::remove(temp.path, ignored);
    throw Error(path.string(), "cannot be written: " + reason,
                "Free space or choose another folder; the previous file, if any, is intact.");
}

bool write_all(int file, std::span<const std::byte> bytes) {
    for (size_t done = 0; done < bytes.size();) {
        const ssize_t wrote = ::write(file, bytes.data() + done, bytes.size() - done);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) return false;
        done += static_cast<size_t>(wrote);
    }
    return true;
}

bool write_all(int file, FileParts parts) {
    return std::all_of(parts.begin(), parts.end(),
                       [&](std::span<const std::byte> part) { return write_all(file, part); });
}

void write_to_stream(const std::filesystem::path& path, FileParts parts) {
    const Descriptor file{::open(path.c_str(), O_WRONLY | O_CLOEXEC)};
    if (file.fd < 0 || !write_all(file.fd, parts))
        throw Error(path.string(), std::string("cannot be written: ") + std::strerror(errno),
                    "Choose a file.");
}

}  // namespace

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string own = path.extension().string();
    return std::equal(own.begin(), own.end(), extension.begin(), extension.end(),
                      [](unsigned char a, unsigned char b) { return std::tolower(a) == b; });
}

void check_is_file(const std::filesystem::path& path) {
    struct stat facts {};
    if (::stat(path.c_str(), &facts) == 0) refuse_others(path, facts.st_mode);
}

std::vector<std::byte> read_file(const std::filesystem::path& path) {
    return read_whole<std::vector<std::byte>>(path);
}

std::vector<std::byte> read_file_head(const std::filesystem::path& path, std::size_t most) {
    return read_whole<std::vector<std::byte>>(path, most);
}

std::string read_text_file(const std::filesystem::path& path) {
    return read_whole<std::string>(path);
}

void write_file_atomic(const std::filesystem::path& name, FileParts parts) {
    std::error_code ignored;
    if (name.has_parent_path()) std::filesystem::create_directories(name.parent_path(), ignored);
    // A pipe or a device is written to directly; of a link, the file that it points to is replaced,
    // not the link.
    const auto kind = std::filesystem::status(name, ignored).type();
    using enum std::filesystem::file_type;
    if (kind == fifo || kind == character || kind == block || kind == socket)
        return write_to_stream(name, parts);
    const bool link = std::filesystem::is_symlink(name, ignored);
    const std::filesystem::path path = link ? std::filesystem::weakly_canonical(name) : name;
    const Temporary temp(path);
    if (temp.file.fd < 0) fail_write(path, temp);
    const std::filesystem::file_status old = std::filesystem::status(path, ignored);
    if (std::filesystem::is_regular_file(old))
        ::fchmod(temp.file.fd, static_cast<mode_t>(old.permissions()));
    if (!write_all(temp.file.fd, parts)) fail_write(path, temp);
    if (::fsync(temp.file.fd) != 0 && errno != EINVAL && errno != EROFS) fail_write(path, temp);
    if (::rename(temp.path.c_str(), path.c_str()) != 0) fail_write(path, temp);
}

void write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    write_file_atomic(path, FileParts(&bytes, 1));
}

void write_file_atomic(const std::filesystem::path& path, std::string_view text) {
    write_file_atomic(path, std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace darb
