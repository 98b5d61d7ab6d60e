// SPDX-License-Identifier: MIT
#include "engine/core/system.h"

#include <windows.h>
// after windows.h, whose types they use
#include <fcntl.h>
#include <io.h>
#include <psapi.h>
#include <shellapi.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cwchar>
#include <limits>

#include "engine/core/memory.h"

namespace darb {

namespace {

std::string narrow(std::wstring_view text) {
    const int size = ::WideCharToMultiByte(CP_UTF8, 0, text.data(), int(text.size()), nullptr, 0,
                                           nullptr, nullptr);
    std::string utf8(std::size_t(size), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, text.data(), int(text.size()), utf8.data(), size, nullptr,
                          nullptr);
    return utf8;
}

std::wstring widened(std::string_view text) {
    const int size = ::MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), nullptr, 0);
    std::wstring wide(std::size_t(size), L'\0');
    ::MultiByteToWideChar(CP_UTF8, 0, text.data(), int(text.size()), wide.data(), size);
    return wide;
}

}  // namespace

// The words of main are in a code page that has not every letter.
std::vector<std::string> command_words(int, char**) {
    int count = 0;
    wchar_t** const words = ::CommandLineToArgvW(::GetCommandLineW(), &count);
    std::vector<std::string> all;
    for (int i = 0; words != nullptr && i < count; ++i) all.push_back(narrow(words[i]));
    ::LocalFree(words);
    return all;
}

std::optional<std::string> environment(const char* name) {
    const std::wstring wide = widened(name);
    std::wstring value(32'768, L'\0');
    ::SetLastError(ERROR_SUCCESS);
    const DWORD size = ::GetEnvironmentVariableW(wide.c_str(), value.data(), DWORD(value.size()));
    if (size == 0 && ::GetLastError() == ERROR_ENVVAR_NOT_FOUND) return std::nullopt;
    return narrow(std::wstring_view(value).substr(0, size));
}

void set_missing_environment(const char* name, const std::string& value) {
    if (!environment(name)) ::_wputenv_s(widened(name).c_str(), widened(value).c_str());
}

int process_id() {
    return int(::GetCurrentProcessId());
}

std::string host_name() {
    std::array<wchar_t, 256> name{};
    DWORD size = DWORD(name.size());
    if (!::GetComputerNameExW(ComputerNameDnsHostname, name.data(), &size)) return "unknown";
    return narrow({name.data(), size});
}

std::filesystem::path program_file() {
    std::wstring name(32'768, L'\0');
    name.resize(::GetModuleFileNameW(nullptr, name.data(), DWORD(name.size())));
    return name;
}

double peak_memory_bytes() {
    PROCESS_MEMORY_COUNTERS counters{};
    ::GetProcessMemoryInfo(::GetCurrentProcess(), &counters, sizeof counters);
    return double(counters.PeakWorkingSetSize);
}

// A limit of a job, where it has one, shows in what can be allocated (free_memory).
std::uint64_t address_space_left() {
    return std::numeric_limits<std::uint64_t>::max();
}

namespace {

double seconds_of(const FILETIME& time) {
    return 1e-7 * double(std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime);
}

}  // namespace

// Children count for themselves here.
double processor_seconds() {
    FILETIME begun{}, ended{}, kernel{}, user{};
    ::GetProcessTimes(::GetCurrentProcess(), &begun, &ended, &kernel, &user);
    return seconds_of(kernel) + seconds_of(user);
}

void lower_thread_priority(int nice) {
    constexpr int kMuch = 10;
    ::SetThreadPriority(::GetCurrentThread(),
                        nice > kMuch ? THREAD_PRIORITY_LOWEST : THREAD_PRIORITY_BELOW_NORMAL);
}

void* loaded_function(const char* library, const char* name) {
    const HMODULE loaded = ::GetModuleHandleA(library);
    return loaded != nullptr ? reinterpret_cast<void*>(::GetProcAddress(loaded, name)) : nullptr;
}

bool can_load_library(const char* library) {
    return ::LoadLibraryA(library) != nullptr;
}

double machine_busy_seconds() {
    FILETIME idle{}, kernel{}, user{};
    if (!::GetSystemTimes(&idle, &kernel, &user)) return 0;
    return seconds_of(kernel) + seconds_of(user) - seconds_of(idle);  // the kernel's holds the idle
}

std::string processor_name() {
    std::array<wchar_t, 256> name{};
    DWORD bytes = sizeof name;
    constexpr const wchar_t* kPlace = L"HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0";
    if (::RegGetValueW(HKEY_LOCAL_MACHINE, kPlace, L"ProcessorNameString", RRF_RT_REG_SZ, nullptr,
                       name.data(), &bytes) != ERROR_SUCCESS)
        return "unknown";
    return narrow(name.data());
}

std::vector<double> load_averages() {
    return {};
}

std::string process_counts() {
    return {};
}

std::string scheduling() {
    return "priority class " + std::to_string(::GetPriorityClass(::GetCurrentProcess()));
}

std::uint64_t free_memory(const std::filesystem::path&) {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    if (!::GlobalMemoryStatusEx(&status)) return std::numeric_limits<std::uint64_t>::max();
    return status.ullAvailPageFile;  // memory and paging file, less what is promised to others
}

void give_back_freed_memory() {
    ::HeapCompact(::GetProcessHeap(), 0);
}

void keep_standard_descriptors() {
    for (std::FILE* const stream : {stdin, stdout, stderr}) {
        if (::_fileno(stream) < 0)  // a program without a console
            static_cast<void>(std::freopen("NUL", stream == stdin ? "rb" : "wb", stream));
        else
            ::_setmode(::_fileno(stream), _O_BINARY);
    }
    // Of files that are opened without a word on it.
#ifdef __MINGW32__
    _fmode = _O_BINARY;
#else
    ::_set_fmode(_O_BINARY);
#endif
    for (const DWORD which : {STD_OUTPUT_HANDLE, STD_ERROR_HANDLE}) {
        const HANDLE console = ::GetStdHandle(which);
        DWORD mode = 0;
        if (!::GetConsoleMode(console, &mode)) continue;
        ::SetConsoleMode(console, mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING);
        ::SetConsoleOutputCP(CP_UTF8);
    }
}

// A console of before Windows 10 takes no escape sequences: it gets plain lines.
bool is_terminal(std::FILE* stream) {
    DWORD mode = 0;
    return ::GetConsoleMode(reinterpret_cast<HANDLE>(::_get_osfhandle(::_fileno(stream))), &mode) &&
           (stream == stdin || (mode & ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0);
}

int terminal_columns() {
    CONSOLE_SCREEN_BUFFER_INFO info{};
    if (!::GetConsoleScreenBufferInfo(::GetStdHandle(STD_OUTPUT_HANDLE), &info)) return 0;
    return info.srWindow.Right - info.srWindow.Left + 1;
}

// The C library has no word for a pipe that is being closed, and says "invalid".
bool reader_has_gone(int error) {
    const HANDLE out = reinterpret_cast<HANDLE>(::_get_osfhandle(::_fileno(stdout)));
    const bool pipe = ::GetFileType(out) == FILE_TYPE_PIPE;
    return error == EPIPE || error == EBADF || (error == EINVAL && pipe);
}

bool let_go_of_stdout() {
    const int nothing = ::_open("NUL", _O_WRONLY | _O_BINARY);
    if (nothing < 0) return false;
    ::_dup2(nothing, ::_fileno(stdout));
    ::_close(nothing);
    return true;
}

namespace {

constexpr int kShellBase = 128;  // plus the signal's number, as elsewhere
constexpr int kHangup = 1;       // SIGHUP, which Windows has not

std::atomic<bool> g_stop{false};
std::atomic<int> g_signal{0};  // the first one
std::atomic<bool> g_interrupted{false};

// Runs on a thread of its own.
BOOL WINAPI on_console(DWORD event) {
    const bool interrupt = event == CTRL_C_EVENT;
    if (interrupt && g_interrupted.exchange(true)) std::_Exit(kShellBase + SIGINT);
    int none = 0;
    g_signal.compare_exchange_strong(none, interrupt                   ? SIGINT
                                           : event == CTRL_BREAK_EVENT ? SIGTERM
                                                                       : kHangup);
    g_stop = true;
    // Of a window that is closed, or a user who logs off, the process ends when this returns, and
    // after some seconds even if it does not: the run saves meanwhile, and ends by itself.
    if (!interrupt && event != CTRL_BREAK_EVENT) ::Sleep(INFINITE);
    return TRUE;
}

}  // namespace

std::atomic<bool>& stop_on_signals() {
    ::SetConsoleCtrlHandler(on_console, TRUE);
    return g_stop;
}

void go_on_without_readers() {}

void fail_at_the_file_limit() {}

int stop_exit_code() {
    return g_signal == 0 ? 0 : kShellBase + g_signal;
}

const char* stop_name() {
    switch (g_signal) {
        case SIGINT:
            return "SIGINT";
        case SIGTERM:
            return "SIGTERM";
        case kHangup:
            return "SIGHUP";
        default:
            return "";
    }
}

}  // namespace darb

#if defined(__MINGW32__) && !defined(_UCRT)
// libstdc++ makes a path of narrow text by the C library's conversion, and msvcrt.dll has no locale
// with UTF-8. These take the place of those in libmingwex: text is UTF-8, whatever the locale. A
// character beyond 16 bits is two units: the first three of its four bytes give one, the last byte
// the other.

namespace {

// Bytes of the character that begins so; 0: none begins so.
std::size_t bytes_of(unsigned char lead) {
    return lead < 0x80   ? 1
           : lead < 0xc2 ? 0
           : lead < 0xe0 ? 2
           : lead < 0xf0 ? 3
           : lead < 0xf5 ? 4
                         : 0;
}

constexpr std::size_t kInvalid = std::size_t(-1), kUnfinished = std::size_t(-2);

// state: 0, or the second unit of a character, of which the last byte is still to come.
std::size_t one_unit(wchar_t* to, const char* from, std::size_t most, mbstate_t& state) {
    if (most == 0) return kUnfinished;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(from[i]); };
    if (state != 0) {
        if ((byte(0) & 0xc0) != 0x80) return errno = EILSEQ, kInvalid;
        if (to != nullptr) *to = wchar_t(state | (byte(0) & 0x3f));
        state = 0;
        return 1;
    }
    const std::size_t count = bytes_of(byte(0)), needed = std::min<std::size_t>(count, 3);
    if (count == 0) return errno = EILSEQ, kInvalid;
    std::uint32_t code = count == 1 ? byte(0) : byte(0) & (0x7fu >> count);
    for (std::size_t i = 1; i < needed; ++i) {
        if (i == most) return kUnfinished;
        if ((byte(i) & 0xc0) != 0x80) return errno = EILSEQ, kInvalid;
        code = code << 6 | (byte(i) & 0x3fu);
    }
    if (count == 4) {
        const std::uint32_t high = code - (0x10000u >> 6);  // without the last six bits
        state = mbstate_t(0xdc00u | (high << 6 & 0x3c0u));
        code = 0xd800u | high >> 4;
    }
    if (to != nullptr) *to = wchar_t(code);
    return code == 0 ? 0 : needed;
}

mbstate_t g_conversion = 0;

}  // namespace

extern "C" {

size_t mbrtowc(wchar_t* __restrict to, const char* __restrict from, size_t most,
               mbstate_t* __restrict state) {
    if (from == nullptr) return 0;
    return one_unit(to, from, most, state != nullptr ? *state : g_conversion);
}

size_t mbrlen(const char* __restrict from, size_t most, mbstate_t* __restrict state) {
    return mbrtowc(nullptr, from, most, state);
}

size_t mbsrtowcs(wchar_t* __restrict to, const char** __restrict from, size_t most,
                 mbstate_t* __restrict state) {
    size_t units = 0;
    for (const char* at = *from; to == nullptr || units < most; ++units) {
        wchar_t unit = 0;
        const size_t used = mbrtowc(&unit, at, 4, state);
        if (used >= kUnfinished) return kInvalid;
        if (to != nullptr) to[units] = unit;
        if (used == 0) {
            if (to != nullptr) *from = nullptr;
            return units;
        }
        at += used;
        if (to != nullptr) *from = at;
    }
    return units;
}

}  // extern "C"
#endif
