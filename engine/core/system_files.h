// SPDX-License-Identifier: MIT
// Files as the system has them: what std::filesystem does not tell or do. system_files_posix.cpp
// and system_files_windows.cpp implement it. Errors come back as std::error_code, whose message is
// for people; files.h turns them into an Error.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

namespace darb {

enum class FileKind { none, regular, folder, pipe, socket, device };

/// "a folder", "a pipe" and so on, as a sentence has it.
const char* kind_name(FileKind kind);

/// Volume and number of a file: equal for two names of one file, links or not.
using FileId = std::array<std::uint64_t, 3>;

struct FileFacts {
    FileKind kind = FileKind::none;  // none: there is no such file, or it cannot be seen
    FileId id{};
    std::uint64_t bytes = 0;
    std::int64_t changed_ns = 0;  // time of the last change; the epoch is the system's
};

/// Follows links.
FileFacts file_facts(const std::filesystem::path& path);

/// An open file, which is closed with this object. Child processes do not inherit it, and on
/// Windows others may rename or remove it meanwhile, as they may elsewhere.
class File {
  public:
    enum class Open {
        read,        // does not wait for the other end of a pipe
        make,        // to write; it must not be there
        write,       // what is there: a pipe or a device
        append,      // follows a link; made where missing
        append_own,  // what is there, and no link
        lock,        // to read and write, and no link; made where missing
    };
    File() = default;
    /// Where it cannot be opened, is_open() is false and error() says why.
    File(const std::filesystem::path& path, Open how);
    ~File() { close(); }
    File(File&& other) noexcept;
    File& operator=(File&& other) noexcept;

    bool is_open() const { return handle_ != kClosed; }
    /// Of the last call that failed.
    const std::error_code& error() const { return error_; }
    FileFacts facts() const;

    /// Bytes read, 0 at the end, -1 where reading fails.
    std::ptrdiff_t read(std::span<std::byte> to);
    /// All of them, in as many calls as it takes.
    bool write(std::span<const std::byte> bytes);
    /// What the file holds from now on.
    bool replace_content(std::string_view text);
    /// The first bytes, wherever reading is; "" where there are none.
    std::string head(std::size_t most);
    /// Brings what was written to the disk. True for what cannot be synced, such as a pipe.
    bool sync();
    /// Gives it the permissions of that file.
    void take_permissions_of(const std::filesystem::path& path);
    /// False where another process holds the lock. True without a lock on file systems that have
    /// none. The system lets go of it when the file is closed, however the process ends. Others can
    /// read what it holds.
    bool lock();
    void close();

  private:
    static constexpr std::intptr_t kClosed = -1;
    std::intptr_t handle_ = kClosed;
    std::error_code error_;
};

/// Puts a file in the place of another in one step. Where a program holds that one open, Windows
/// refuses for as long; this tries for half a second, as virus scanners let go soon.
std::error_code replace_file(const std::filesystem::path& from, const std::filesystem::path& to);

/// A new folder of that name and some letters, for this user alone, in the folder of temporary
/// files. Throws std::filesystem::filesystem_error.
std::filesystem::path make_scratch_folder(const std::string& name);

/// Whether the system takes a part of the name for a device, wherever it stands: con, aux, com1 and
/// so on, with any extension. On Windows alone; `nul` is none of them, as it can be written to.
bool has_device_name(const std::filesystem::path& path);

/// Whether Windows takes a file name for a device: that part of has_device_name() which is the same
/// everywhere.
bool is_device_name(std::string_view file_name);

}  // namespace darb
