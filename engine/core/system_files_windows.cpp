// SPDX-License-Identifier: MIT
// Paths are UTF-16 for the system. Those of 240 characters and more are given with the prefix that
// lifts the limit of 260.
#include <windows.h>

#include <algorithm>
#include <chrono>
#include <cwchar>
#include <limits>
#include <random>
#include <thread>

#include <fmt/format.h>

#include "engine/core/system_files.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongPath = 240;
constexpr DWORD kShareAll = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

std::wstring system_name(const fs::path& path) {
    std::wstring name = path.native();
    if (name.size() < kLongPath || name.starts_with(L"\\\\?\\")) return name;
    std::error_code none;
    name = fs::absolute(path, none).lexically_normal().make_preferred().native();
    return name.starts_with(L"\\\\") ? L"\\\\?\\UNC" + name.substr(1) : L"\\\\?\\" + name;
}

// In the words of the C library where it has some: those of the system are of its language.
std::error_code error_of(DWORD code) {
    const auto known = [](std::errc error) { return std::make_error_code(error); };
    switch (code) {
        case ERROR_FILE_NOT_FOUND:
        case ERROR_PATH_NOT_FOUND:
        case ERROR_INVALID_NAME:
        case ERROR_BAD_NETPATH:
            return known(std::errc::no_such_file_or_directory);
        case ERROR_ACCESS_DENIED:
        case ERROR_SHARING_VIOLATION:
        case ERROR_LOCK_VIOLATION:
            return known(std::errc::permission_denied);
        case ERROR_WRITE_PROTECT:
            return known(std::errc::read_only_file_system);
        case ERROR_FILE_EXISTS:
        case ERROR_ALREADY_EXISTS:
            return known(std::errc::file_exists);
        case ERROR_DISK_FULL:
        case ERROR_HANDLE_DISK_FULL:
            return known(std::errc::no_space_on_device);
        case ERROR_FILENAME_EXCED_RANGE:
            return known(std::errc::filename_too_long);
        case ERROR_NO_DATA:
        case ERROR_BROKEN_PIPE:
            return known(std::errc::broken_pipe);
        case ERROR_NOT_ENOUGH_MEMORY:
        case ERROR_OUTOFMEMORY:
            return known(std::errc::not_enough_memory);
        default:
            return {int(code), std::system_category()};
    }
}

HANDLE handle_of(std::intptr_t value) {
    return reinterpret_cast<HANDLE>(value);
}

FileFacts facts_of(HANDLE file) {
    FileFacts facts;
    const DWORD type = ::GetFileType(file);
    if (type == FILE_TYPE_PIPE) facts.kind = FileKind::pipe;
    if (type == FILE_TYPE_CHAR) facts.kind = FileKind::device;
    BY_HANDLE_FILE_INFORMATION found{};
    if (type != FILE_TYPE_DISK || !::GetFileInformationByHandle(file, &found)) return facts;
    const bool folder = (found.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
    facts.kind = folder ? FileKind::folder : FileKind::regular;
    const auto whole = [](DWORD high, DWORD low) { return std::uint64_t{high} << 32 | low; };
    facts.bytes = whole(found.nFileSizeHigh, found.nFileSizeLow);
    facts.changed_ns = std::int64_t(whole(found.ftLastWriteTime.dwHighDateTime,
                                          found.ftLastWriteTime.dwLowDateTime)) *
                       100;
    // Numbers of 128 bits, as on ReFS; where a file system has none, those of 64 bits.
    FILE_ID_INFO wide{};
    if (::GetFileInformationByHandleEx(file, FileIdInfo, &wide, sizeof wide)) {
        facts.id[0] = wide.VolumeSerialNumber;
        static_assert(sizeof wide.FileId == 2 * sizeof(std::uint64_t));
        std::copy_n(reinterpret_cast<const std::uint64_t*>(&wide.FileId), 2, &facts.id[1]);
    } else {
        facts.id = {found.dwVolumeSerialNumber, whole(found.nFileIndexHigh, found.nFileIndexLow),
                    0};
    }
    return facts;
}

struct Way {
    DWORD access, creation, flags;
};

Way way_of(File::Open how) {
    // A link itself, and not what it leads to: opened so, a link has no content to append to.
    constexpr DWORD kNoLink = FILE_FLAG_OPEN_REPARSE_POINT;
    switch (how) {
        case File::Open::read:
            return {GENERIC_READ, OPEN_EXISTING, 0};
        case File::Open::make:
            return {GENERIC_WRITE, CREATE_NEW, 0};
        case File::Open::write:
            return {GENERIC_WRITE, OPEN_EXISTING, 0};
        case File::Open::append:
            return {FILE_APPEND_DATA | SYNCHRONIZE, OPEN_ALWAYS, 0};
        case File::Open::append_own:
            return {FILE_APPEND_DATA | SYNCHRONIZE, OPEN_EXISTING, kNoLink};
        case File::Open::lock:
            return {GENERIC_READ | GENERIC_WRITE, OPEN_ALWAYS, kNoLink};
    }
    return {GENERIC_READ, OPEN_EXISTING, 0};
}

std::uint32_t random_number() {
    std::random_device source;
    return source();
}

}  // namespace

FileFacts file_facts(const fs::path& path) {
    if (has_device_name(path)) return {FileKind::device, {}, 0, 0};
    // No access at all: enough to ask, and it works on what others hold open.
    const HANDLE file = ::CreateFileW(system_name(path).c_str(), 0, kShareAll, nullptr,
                                      OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
    if (file == INVALID_HANDLE_VALUE) return {};
    const FileFacts facts = facts_of(file);
    ::CloseHandle(file);
    return facts;
}

File::File(const fs::path& path, Open how) {
    static_assert(kClosed == -1);  // INVALID_HANDLE_VALUE
    const Way way = way_of(how);
    if (has_device_name(path)) {
        error_ = std::make_error_code(std::errc::permission_denied);
        return;
    }
    handle_ = reinterpret_cast<std::intptr_t>(
        ::CreateFileW(system_name(path).c_str(), way.access, kShareAll, nullptr, way.creation,
                      FILE_ATTRIBUTE_NORMAL | way.flags, nullptr));
    if (!is_open()) error_ = error_of(::GetLastError());
}

FileFacts File::facts() const {
    return facts_of(handle_of(handle_));
}

std::ptrdiff_t File::read(std::span<std::byte> to) {
    constexpr std::size_t kMost = 1u << 30;
    DWORD got = 0;
    if (::ReadFile(handle_of(handle_), to.data(), DWORD(std::min(to.size(), kMost)), &got, nullptr))
        return std::ptrdiff_t(got);
    const DWORD code = ::GetLastError();
    if (code == ERROR_BROKEN_PIPE || code == ERROR_HANDLE_EOF) return 0;
    error_ = error_of(code);
    return -1;
}

bool File::write(std::span<const std::byte> bytes) {
    constexpr std::size_t kMost = 1u << 26;
    while (!bytes.empty()) {
        DWORD wrote = 0;
        if (!::WriteFile(handle_of(handle_), bytes.data(), DWORD(std::min(bytes.size(), kMost)),
                         &wrote, nullptr)) {
            error_ = error_of(::GetLastError());
            return false;
        }
        bytes = bytes.subspan(wrote);
    }
    return true;
}

bool File::replace_content(std::string_view text) {
    const HANDLE file = handle_of(handle_);
    if (::SetFilePointer(file, 0, nullptr, FILE_BEGIN) == 0 && ::SetEndOfFile(file))
        return write(std::as_bytes(std::span(text)));
    error_ = error_of(::GetLastError());
    return false;
}

std::string File::head(std::size_t most) {
    std::string text(most, '\0');
    OVERLAPPED from_start{};
    DWORD got = 0;
    if (!::ReadFile(handle_of(handle_), text.data(), DWORD(most), &got, &from_start)) got = 0;
    text.resize(got);
    return text;
}

bool File::sync() {
    if (::FlushFileBuffers(handle_of(handle_))) return true;
    const DWORD code = ::GetLastError();
    if (code == ERROR_INVALID_FUNCTION || code == ERROR_INVALID_HANDLE) return true;
    error_ = error_of(code);
    return false;
}

// Those of a file come with its folder here.
void File::take_permissions_of(const fs::path&) {}

bool File::lock() {
    // Locks are mandatory: the byte lies far behind the text, which others read.
    OVERLAPPED place{};
    place.OffsetHigh = 0x40000000;
    return ::LockFileEx(handle_of(handle_), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0,
                        1, 0, &place) ||
           ::GetLastError() == ERROR_INVALID_FUNCTION || ::GetLastError() == ERROR_NOT_SUPPORTED;
}

void File::close() {
    if (is_open()) ::CloseHandle(handle_of(handle_));
    handle_ = kClosed;
}

std::error_code replace_file(const fs::path& from, const fs::path& to) {
    constexpr int kTries = 10;
    constexpr std::chrono::milliseconds kPause{50};
    DWORD code = 0;
    for (int i = 0; i < kTries; ++i) {
        if (::MoveFileExW(system_name(from).c_str(), system_name(to).c_str(),
                          MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH))
            return {};
        code = ::GetLastError();
        if (code != ERROR_ACCESS_DENIED && code != ERROR_SHARING_VIOLATION) break;
        if (file_facts(to).kind == FileKind::folder) break;
        std::this_thread::sleep_for(kPause);
    }
    return error_of(code);
}

fs::path make_scratch_folder(const std::string& name) {
    constexpr int kTries = 100;
    const fs::path temporary = fs::temp_directory_path();
    for (int i = 0; i < kTries; ++i)
        if (const fs::path folder = temporary / fmt::format("{}_{:08x}", name, random_number());
            ::CreateDirectoryW(system_name(folder).c_str(), nullptr))
            return folder;
    throw fs::filesystem_error("cannot make a folder", temporary, error_of(::GetLastError()));
}

bool has_device_name(const fs::path& path) {
    return std::any_of(path.begin(), path.end(),
                       [](const fs::path& part) { return is_device_name(part.string()); });
}

}  // namespace darb
