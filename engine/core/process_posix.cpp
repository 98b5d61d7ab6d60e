// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/process.h"

extern char** environ;

namespace darb {

namespace {

bool can_run(const std::filesystem::path& file) {
    std::error_code none;
    return std::filesystem::is_regular_file(file, none) && ::access(file.c_str(), X_OK) == 0;
}

std::vector<std::string> environment_of(const ProcessOptions& options) {
    std::vector<std::string> all;
    for (char** one = environ; *one != nullptr; ++one) {
        const std::string_view text = *one;
        const auto is_named = [&](const auto& variable) {
            return text.starts_with(variable.first + "=");
        };
        if (std::none_of(options.variables.begin(), options.variables.end(), is_named))
            all.emplace_back(text);
    }
    for (const auto& [name, value] : options.variables) all.push_back(name + "=" + value);
    return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (std::string& text : texts) all.push_back(text.data());
    all.push_back(nullptr);
    return all;
}

// What the child opens in place of its standard descriptors.
struct Redirection {
    int fd = -1;            // of the child
    int from = -1;          // a descriptor that is open already, else
    const char* file = "";  // this one, with these flags
    int flags = 0;
};

std::vector<Redirection> redirections(const ProcessOptions& options, int pipe) {
    using enum ProcessOptions::Output;
    std::vector<Redirection> all;
    if (options.no_input) all.push_back({STDIN_FILENO, -1, "/dev/null", O_RDONLY});
    const auto redirect = [&](int fd, ProcessOptions::Output to) {
        if (to == piped) all.push_back({fd, pipe, "", 0});
        if (to == nowhere) all.push_back({fd, -1, "/dev/null", O_WRONLY});
    };
    redirect(STDOUT_FILENO, options.output);
    if (options.errors_file.empty())
        redirect(STDERR_FILENO, options.errors);
    else
        all.push_back(
            {STDERR_FILENO, -1, options.errors_file.c_str(), O_WRONLY | O_CREAT | O_EXCL});
    return all;
}

// posix_spawn cannot ask the system to end the child with this process. Between fork and exec only
// calls that a signal handler may make: there may be other threads.
int fork_tied(char** argv, char** environment, const std::vector<Redirection>& streams,
              pid_t& child) {
    const pid_t parent = ::getpid();
    child = ::fork();
    if (child != 0) return child < 0 ? errno : 0;
#ifdef __linux__
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
    if (::getppid() != parent) ::_exit(127);
    for (const Redirection& stream : streams) {
        const int from = stream.from >= 0 ? stream.from : ::open(stream.file, stream.flags, 0600);
        ::dup2(from, stream.fd);
    }
    environ = environment;
    ::execvp(argv[0], argv);
    ::_exit(127);
}

int spawn(char** argv, char** environment, const std::vector<Redirection>& streams, pid_t& child) {
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    for (const Redirection& stream : streams)
        if (stream.from >= 0)
            ::posix_spawn_file_actions_adddup2(&actions, stream.from, stream.fd);
        else
            ::posix_spawn_file_actions_addopen(&actions, stream.fd, stream.file, stream.flags,
                                               0600);
    const int failure = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv, environment);
    ::posix_spawn_file_actions_destroy(&actions);
    return failure;
}

// Two ends that a child does not inherit.
bool open_pipe(int (&ends)[2]) {
#ifdef __linux__
    return ::pipe2(ends, O_CLOEXEC) == 0;
#else
    if (::pipe(ends) != 0) return false;
    for (const int end : ends) ::fcntl(end, F_SETFD, FD_CLOEXEC);
    return true;
#endif
}

ProcessEnd end_of(int status) {
    if (WIFEXITED(status)) return {WEXITSTATUS(status), false};
    return {-1, true};
}

}  // namespace

bool is_installed(const std::string& program) {
    if (program.find('/') != std::string::npos) return can_run(program);
    const char* const path = std::getenv("PATH");
    std::string_view folders = path != nullptr ? path : "/bin:/usr/bin";
    for (;;) {
        const std::size_t end = std::min(folders.find(':'), folders.size());
        const std::string_view folder = end == 0 ? "." : folders.substr(0, end);
        if (can_run(std::filesystem::path(folder) / program)) return true;
        if (end == folders.size()) return false;
        folders.remove_prefix(end + 1);
    }
}

ChildProcess::ChildProcess(const std::vector<std::string>& words, const ProcessOptions& options) {
    constexpr const char* kMore = "Free memory or processes.";
    using enum ProcessOptions::Output;
    std::vector<std::string> own_words = words, variables = environment_of(options);
    int ends[2] = {-1, -1};
    const bool reads = options.output == piped || options.errors == piped;
    if (reads && !open_pipe(ends)) throw Error(words.at(0), "cannot be started", kMore);
    const std::vector<Redirection> streams = redirections(options, ends[1]);
    pid_t child = -1;
    const int failure = (options.ends_with_this ? fork_tied : spawn)(
        pointers(own_words).data(), pointers(variables).data(), streams, child);
    if (reads) ::close(ends[1]);
    output_ = ends[0];
    if (failure == 0) {
        process_ = child;
        return;
    }
    close_output();
    throw Error(words.at(0),
                "cannot be started: " + std::error_code(failure, std::generic_category()).message(),
                failure == ENOENT ? "Install it, or check PATH." : kMore);
}

ChildProcess::~ChildProcess() {
    if (process_ != kNone) end();
    close_output();
}

void ChildProcess::close_output() {
    if (output_ != kNone) ::close(int(output_));
    output_ = kNone;
}

std::optional<std::size_t> ChildProcess::read(std::span<char> to, int wait_ms) {
    for (;;) {
        pollfd ready{int(output_), POLLIN, 0};
        const int count = ::poll(&ready, 1, wait_ms);
        if (count == 0 || (count < 0 && errno == EINTR && wait_ms >= 0)) return std::nullopt;
        if (count < 0 && errno == EINTR) continue;
        const ssize_t bytes = ::read(int(output_), to.data(), to.size());
        if (bytes < 0 && errno == EINTR) continue;
        return bytes > 0 ? std::size_t(bytes) : 0;
    }
}

ProcessEnd ChildProcess::wait() {
    if (process_ == kNone) return ended_;
    int status = -1;
    while (::waitpid(pid_t(process_), &status, 0) < 0 && errno == EINTR) {
    }
    process_ = kNone;
    return ended_ = end_of(status);
}

std::optional<ProcessEnd> ChildProcess::look() {
    if (process_ == kNone) return ended_;
    int status = -1;
    pid_t found = -1;
    do found = ::waitpid(pid_t(process_), &status, WNOHANG);
    while (found < 0 && errno == EINTR);
    if (found == 0) return std::nullopt;
    process_ = kNone;
    return ended_ = found < 0 ? ProcessEnd{} : end_of(status);
}

void ChildProcess::end() {
    constexpr int kPatience = 20;  // it has 2 s to end by itself
    constexpr std::chrono::milliseconds kPause{100};
    ::kill(pid_t(process_), SIGTERM);
    for (int i = 0; i < kPatience; ++i) {
        if (look()) return;
        std::this_thread::sleep_for(kPause);
    }
    ::kill(pid_t(process_), SIGKILL);
    wait();
}

}  // namespace darb
