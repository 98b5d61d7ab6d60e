// SPDX-License-Identifier: MIT
#include "engine/core/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <new>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/system_files.h"
#include "engine/core/text.h"

namespace darb {

namespace {

constexpr size_t kAll = std::numeric_limits<size_t>::max();

void refuse_others(const std::filesystem::path& path, FileKind kind) {
    if (kind != FileKind::regular)
        throw Error(path.string(), fmt::format("is {}, not a file", kind_name(kind)),
                    "Name a file.");
}

/// Checks the kind of file before opening it, because opening a pipe blocks and a device may react;
/// and again afterwards.
File open_to_read(const std::filesystem::path& path) {
    check_is_file(path);
    File file(path, File::Open::read);
    if (!file.is_open()) throw Error(path.string(), file.error().message(), "Check the path.");
    refuse_others(path, file.facts().kind);
    return file;
}

template <class Container>
Container read_whole(const std::filesystem::path& path, size_t most = kAll) try {
    File file = open_to_read(path);
    Container content;
    size_t used = 0;
    while (used < most) {
        content.resize(std::min(used + (size_t{1} << 20) + used / 2, most));
        const std::ptrdiff_t got =
            file.read(std::as_writable_bytes(std::span(content)).subspan(used));
        if (got < 0) throw Error(path.string(), file.error().message(), "Check the path.");
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
        for (int number = 0; !file.is_open(); ++number) {
            path = target;
            if (number > 0) path += "." + std::to_string(number);
            path += ".tmp";
            file = File(path, File::Open::make);
            if (!file.is_open() && file.error() != std::errc::file_exists) return;
        }
    }
    std::filesystem::path path;
    File file;
};

[[noreturn]] void fail_write(const std::filesystem::path& path, const std::error_code& why) {
    throw Error(path.string(), "cannot be written: " + why.message(),
                "Free space or choose another folder; the previous file, if any, is intact.");
}

[[noreturn]] void fail_write(const std::filesystem::path& path, Temporary& temp,
                             const std::error_code& why) {
    temp.file.close();
    std::error_code ignored;
    std::filesystem::remove(temp.path, ignored);
    fail_write(path, why);
}

bool write_all(File& file, FileParts parts) {
    return std::all_of(parts.begin(), parts.end(),
                       [&](std::span<const std::byte> part) { return file.write(part); });
}

void write_to_stream(const std::filesystem::path& path, FileParts parts) {
    File file(path, File::Open::write);
    if (!file.is_open() || !write_all(file, parts))
        throw Error(path.string(), "cannot be written: " + file.error().message(),
                    "Choose a file.");
}

}  // namespace

const char* kind_name(FileKind kind) {
    switch (kind) {
        case FileKind::folder:
            return "a folder";
        case FileKind::pipe:
            return "a pipe";
        case FileKind::socket:
            return "a socket";
        case FileKind::device:
            return "a device";
        default:
            return "a file";
    }
}

File::File(File&& other) noexcept
    : handle_(std::exchange(other.handle_, kClosed)), error_(other.error_) {}

File& File::operator=(File&& other) noexcept {
    if (this == &other) return *this;
    close();
    handle_ = std::exchange(other.handle_, kClosed);
    error_ = other.error_;
    return *this;
}

bool is_device_name(std::string_view file_name) {
    const std::string name = lower(file_name.substr(0, file_name.find_first_of(".: ")));
    for (const char* const device : {"con", "prn", "aux", "conin$", "conout$"})
        if (name == device) return true;
    return name.size() == 4 && (name.starts_with("com") || name.starts_with("lpt")) &&
           name[3] >= '1' && name[3] <= '9';
}

void check_file_name(const std::filesystem::path& path) {
    if (has_device_name(path))
        throw Error(path.string(), "is a name that Windows keeps for a device",
                    "Choose another name: con, prn, aux, com1 to com9 and lpt1 to lpt9 are no "
                    "names of files, with no extension.");
}

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string own = path.extension().string();
    return std::equal(own.begin(), own.end(), extension.begin(), extension.end(),
                      [](unsigned char a, unsigned char b) { return std::tolower(a) == b; });
}

void check_is_file(const std::filesystem::path& path) {
    const FileKind kind = file_facts(path).kind;
    if (kind != FileKind::none) refuse_others(path, kind);
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
    check_file_name(name);
    std::error_code ignored;
    if (name.has_parent_path()) std::filesystem::create_directories(name.parent_path(), ignored);
    // A pipe or a device is written to directly; of a link, the file that it points to is replaced,
    // not the link.
    const FileKind kind = file_facts(name).kind;
    if (kind == FileKind::pipe || kind == FileKind::device || kind == FileKind::socket)
        return write_to_stream(name, parts);
    const bool link = std::filesystem::is_symlink(name, ignored);
    const std::filesystem::path path = link ? std::filesystem::weakly_canonical(name) : name;
    Temporary temp(path);
    if (!temp.file.is_open()) fail_write(path, temp.file.error());
    if (kind == FileKind::regular) temp.file.take_permissions_of(path);
    if (!write_all(temp.file, parts) || !temp.file.sync())
        fail_write(path, temp, temp.file.error());
    temp.file.close();  // Windows moves no open file
    if (const std::error_code why = replace_file(temp.path, path)) fail_write(path, temp, why);
}

void write_file_atomic(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    write_file_atomic(path, FileParts(&bytes, 1));
}

void write_file_atomic(const std::filesystem::path& path, std::string_view text) {
    write_file_atomic(path, std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace darb
