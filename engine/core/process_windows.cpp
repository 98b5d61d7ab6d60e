// SPDX-License-Identifier: MIT
#include <windows.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/process.h"
#include "engine/core/text.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

HANDLE as_handle(std::intptr_t value) {
    return reinterpret_cast<HANDLE>(value);
}

std::intptr_t as_number(HANDLE handle) {
    return reinterpret_cast<std::intptr_t>(handle);
}

std::wstring wide(const std::string& text) {
    return fs::path(std::u8string(text.begin(), text.end())).native();
}

// The file that is started for the name: CreateProcess looks for .exe alone, and first beside this
// program and in the working folder, where nobody expects it.
fs::path find_program(const std::string& program) {
    const wchar_t* const endings[] = {L".exe", L".bat", L".cmd", L""};
    std::wstring found(32'768, L'\0');
    const bool has_folder = program.find_first_of("/\\") != std::string::npos;
    std::wstring folders(32'768, L'\0');
    folders.resize(::GetEnvironmentVariableW(L"PATH", folders.data(), DWORD(folders.size())));
    for (const wchar_t* const ending : endings) {
        const DWORD size =
            ::SearchPathW(has_folder ? nullptr : folders.c_str(), wide(program).c_str(), ending,
                          DWORD(found.size()), found.data(), nullptr);
        if (size == 0 || size >= found.size()) continue;
        const fs::path file = found.substr(0, size);
        if (*ending == L'\0' && !file.has_extension()) continue;
        std::error_code none;
        if (fs::is_regular_file(file, none)) return file;
    }
    return {};
}

// NAME=VALUE texts, each with a zero, and one more at the end. Names differ without case.
std::wstring environment_block(const ProcessOptions& options) {
    std::vector<std::wstring> own;
    for (const auto& [name, value] : options.variables) own.push_back(wide(name + "=" + value));
    const auto same_name = [](std::wstring_view a, std::wstring_view b) {
        const std::size_t end = a.find(L'='), other = b.find(L'=');
        return end == other && end != std::wstring_view::npos &&
               ::CompareStringOrdinal(a.data(), int(end), b.data(), int(end), TRUE) == CSTR_EQUAL;
    };
    std::wstring block;
    wchar_t* const all = ::GetEnvironmentStringsW();
    for (const wchar_t* one = all; *one != 0; one += std::wcslen(one) + 1)
        if (std::none_of(own.begin(), own.end(), [&](const auto& o) { return same_name(o, one); }))
            block.append(one, std::wcslen(one) + 1);
    ::FreeEnvironmentStringsW(all);
    for (const std::wstring& one : own) block.append(one.c_str(), one.size() + 1);
    return block + L'\0';
}

// A handle that a child inherits.
class Inherited {
  public:
    explicit Inherited(HANDLE handle) : handle_(handle) {}
    Inherited(const wchar_t* file, DWORD access, DWORD creation) {
        SECURITY_ATTRIBUTES security{sizeof security, nullptr, TRUE};
        handle_ = ::CreateFileW(file, access, FILE_SHARE_READ | FILE_SHARE_WRITE, &security,
                                creation, FILE_ATTRIBUTE_NORMAL, nullptr);
    }
    ~Inherited() {
        if (handle_ != INVALID_HANDLE_VALUE && handle_ != nullptr) ::CloseHandle(handle_);
    }
    Inherited(const Inherited&) = delete;
    Inherited& operator=(const Inherited&) = delete;
    HANDLE get() const { return handle_; }

  private:
    HANDLE handle_ = nullptr;
};

// This process's own standard handle, as one that a child inherits.
HANDLE duplicate_of(HANDLE handle) {
    HANDLE copy = nullptr;
    const HANDLE self = ::GetCurrentProcess();
    if (handle == nullptr || handle == INVALID_HANDLE_VALUE ||
        !::DuplicateHandle(self, handle, self, &copy, 0, TRUE, DUPLICATE_SAME_ACCESS))
        return nullptr;
    return copy;
}

struct Started {
    HANDLE process = nullptr, group = nullptr;
    DWORD failure = 0;
};

// streams: stdin, stdout and stderr of the child, which inherits nothing else.
Started start(const fs::path& file, std::wstring line, std::wstring block, HANDLE (&streams)[3],
              bool ends_with_this) {
    std::vector<HANDLE> passed;
    for (const HANDLE one : streams)
        if (one != nullptr && std::find(passed.begin(), passed.end(), one) == passed.end())
            passed.push_back(one);
    SIZE_T size = 0;
    ::InitializeProcThreadAttributeList(nullptr, 1, 0, &size);
    std::vector<std::byte> room(size);
    const auto list = reinterpret_cast<LPPROC_THREAD_ATTRIBUTE_LIST>(room.data());
    ::InitializeProcThreadAttributeList(list, 1, 0, &size);
    if (!passed.empty())
        ::UpdateProcThreadAttribute(list, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, passed.data(),
                                    passed.size() * sizeof(HANDLE), nullptr, nullptr);
    STARTUPINFOEXW info{};
    info.StartupInfo.cb = sizeof info;
    info.StartupInfo.dwFlags = STARTF_USESTDHANDLES;
    info.StartupInfo.hStdInput = streams[0];
    info.StartupInfo.hStdOutput = streams[1];
    info.StartupInfo.hStdError = streams[2];
    info.lpAttributeList = list;
    const DWORD flags = CREATE_UNICODE_ENVIRONMENT | EXTENDED_STARTUPINFO_PRESENT |
                        (ends_with_this ? CREATE_SUSPENDED : 0);
    PROCESS_INFORMATION made{};
    Started started;
    if (!::CreateProcessW(file.c_str(), line.data(), nullptr, nullptr, !passed.empty(), flags,
                          block.data(), nullptr, &info.StartupInfo, &made))
        started.failure = ::GetLastError();
    ::DeleteProcThreadAttributeList(list);
    if (started.failure != 0) return started;
    started.process = made.hProcess;
    if (ends_with_this) {  // the system closes the job with this process, and it takes all with it
        started.group = ::CreateJobObjectW(nullptr, nullptr);
        JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
        limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
        ::SetInformationJobObject(started.group, JobObjectExtendedLimitInformation, &limits,
                                  sizeof limits);
        ::AssignProcessToJobObject(started.group, made.hProcess);
        ::ResumeThread(made.hThread);
    }
    ::CloseHandle(made.hThread);
    return started;
}

constexpr UINT kKilled = 0xC000013A;  // as a console's Ctrl-C ends a program

}  // namespace

bool is_installed(const std::string& program) {
    return !find_program(program).empty();
}

ChildProcess::ChildProcess(const std::vector<std::string>& words, const ProcessOptions& options) {
    using enum ProcessOptions::Output;
    const fs::path file = find_program(words.at(0));
    if (file.empty())
        throw Error(words[0], "cannot be started: there is no such program",
                    "Install it, or check PATH.");
    HANDLE read_end = nullptr, write_end = nullptr;
    if (options.output == piped || options.errors == piped) {
        SECURITY_ATTRIBUTES security{sizeof security, nullptr, TRUE};
        if (!::CreatePipe(&read_end, &write_end, &security, 0))
            throw Error(words[0], "cannot be started", "Free memory or processes.");
        ::SetHandleInformation(read_end, HANDLE_FLAG_INHERIT, 0);
        output_ = as_number(read_end);
    }
    const Inherited pipe(write_end), null(L"NUL", GENERIC_READ | GENERIC_WRITE, OPEN_EXISTING);
    const Inherited input(duplicate_of(::GetStdHandle(STD_INPUT_HANDLE))),
        output(duplicate_of(::GetStdHandle(STD_OUTPUT_HANDLE))),
        errors(options.errors_file.empty() ? duplicate_of(::GetStdHandle(STD_ERROR_HANDLE))
                                           : nullptr);
    const Inherited errors_file(options.errors_file.empty() ? L"NUL" : options.errors_file.c_str(),
                                GENERIC_WRITE,
                                options.errors_file.empty() ? OPEN_EXISTING : CREATE_NEW);
    const auto chosen = [&](ProcessOptions::Output to, const Inherited& own) {
        return to == piped ? pipe.get() : to == nowhere ? null.get() : own.get();
    };
    HANDLE streams[3] = {
        options.no_input ? null.get() : input.get(), chosen(options.output, output),
        options.errors_file.empty() ? chosen(options.errors, errors) : errors_file.get()};
    const Started started = start(file, wide(windows_command_line(words)),
                                  environment_block(options), streams, options.ends_with_this);
    if (started.failure != 0) {
        close_output();
        throw Error(words[0], fmt::format("cannot be started: Windows says {}", started.failure),
                    "Free memory or processes.");
    }
    process_ = as_number(started.process);
    if (started.group != nullptr) group_ = as_number(started.group);
}

ChildProcess::~ChildProcess() {
    if (process_ != kNone) end();
    close_output();
}

void ChildProcess::close_output() {
    if (output_ != kNone) ::CloseHandle(as_handle(output_));
    output_ = kNone;
}

std::optional<std::size_t> ChildProcess::read(std::span<char> to, int wait_ms) {
    constexpr int kPause_ms = 10;  // a pipe cannot be waited for
    for (int waited = 0; wait_ms >= 0; waited += kPause_ms) {
        DWORD there = 0;
        if (!::PeekNamedPipe(as_handle(output_), nullptr, 0, nullptr, &there, nullptr)) return 0;
        if (there > 0) break;
        if (waited >= wait_ms) return std::nullopt;
        std::this_thread::sleep_for(std::chrono::milliseconds(kPause_ms));
    }
    DWORD got = 0;
    if (!::ReadFile(as_handle(output_), to.data(), DWORD(to.size()), &got, nullptr)) return 0;
    return got;
}

ProcessEnd ChildProcess::wait() {
    if (process_ == kNone) return ended_;
    ::WaitForSingleObject(as_handle(process_), INFINITE);
    return look().value_or(ProcessEnd{});
}

std::optional<ProcessEnd> ChildProcess::look() {
    if (process_ == kNone) return ended_;
    if (::WaitForSingleObject(as_handle(process_), 0) != WAIT_OBJECT_0) return std::nullopt;
    DWORD code = 0;
    ::GetExitCodeProcess(as_handle(process_), &code);
    ::CloseHandle(as_handle(process_));
    if (group_ != kNone) ::CloseHandle(as_handle(group_));
    process_ = group_ = kNone;
    return ended_ = code == kKilled ? ProcessEnd{-1, true} : ProcessEnd{int(code), false};
}

void ChildProcess::end() {
    if (group_ != kNone)
        ::TerminateJobObject(as_handle(group_), kKilled);
    else
        ::TerminateProcess(as_handle(process_), kKilled);
    wait();
}

}  // namespace darb
