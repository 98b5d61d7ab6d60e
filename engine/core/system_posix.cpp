// SPDX-License-Identifier: MIT
#include "engine/core/system.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __APPLE__
#include <mach-o/dyld.h>
#endif

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>

namespace darb {

std::vector<std::string> command_words(int argc, char** argv) {
    return {argv, argv + argc};
}

std::optional<std::string> environment(const char* name) {
    const char* const value = std::getenv(name);
    return value != nullptr ? std::optional<std::string>(value) : std::nullopt;
}

void set_missing_environment(const char* name, const std::string& value) {
    ::setenv(name, value.c_str(), 0);
}

int process_id() {
    return ::getpid();
}

std::string host_name() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

std::filesystem::path program_file() {
#ifdef __APPLE__
    std::uint32_t size = 4096;
    std::string name(size, '\0');
    return ::_NSGetExecutablePath(name.data(), &size) == 0 ? name.c_str() : "";
#else
    return std::filesystem::read_symlink("/proc/self/exe");
#endif
}

double peak_memory_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
#ifdef __APPLE__
    return static_cast<double>(usage.ru_maxrss);
#else
    return static_cast<double>(usage.ru_maxrss) * 1024.0;
#endif
}

namespace {

// Bytes; the most there is where the system does not say.
std::uint64_t address_space() {
    std::ifstream lines("/proc/self/status");
    for (std::string key; lines >> key; lines.ignore(1'000, '\n')) {
        std::uint64_t kilobytes = 0;
        if (key == "VmSize:" && lines >> kilobytes) return kilobytes * 1024;
    }
    return std::numeric_limits<std::uint64_t>::max();
}

}  // namespace

std::uint64_t address_space_left() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return std::numeric_limits<std::uint64_t>::max();
    const std::uint64_t used = address_space();
    return limit.rlim_cur > used ? limit.rlim_cur - used : 0;
}

double processor_seconds() {
    timespec own{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &own);
    rusage children{};
    ::getrusage(RUSAGE_CHILDREN, &children);
    const auto of = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return static_cast<double>(own.tv_sec) + 1e-9 * static_cast<double>(own.tv_nsec) +
           of(children.ru_utime) + of(children.ru_stime);
}

void lower_thread_priority(int nice) {
#ifdef __linux__  // elsewhere this would be the whole process
    ::setpriority(PRIO_PROCESS, 0, nice);
#else
    static_cast<void>(nice);
#endif
}

void* loaded_function(const char* library, const char* name) {
    if (library == nullptr) return ::dlsym(RTLD_DEFAULT, name);
    void* const loaded = ::dlopen(library, RTLD_LAZY | RTLD_NOLOAD);  // kept until the end
    return loaded != nullptr ? ::dlsym(loaded, name) : nullptr;
}

bool can_load_library(const char* library) {
    return ::dlopen(library, RTLD_LAZY | RTLD_LOCAL) != nullptr;
}

// User, nice, system, irq, softirq, steal.
double machine_busy_seconds() {
    std::ifstream stat("/proc/stat");
    std::string cpu;
    double v[8] = {};
    stat >> cpu;
    for (double& one : v) stat >> one;
    if (!stat) return 0;
    return (v[0] + v[1] + v[2] + v[5] + v[6] + v[7]) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

std::string processor_name() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
            return line.substr(line.find(": ") + 2);
    return "unknown";
}

std::vector<double> load_averages() {
    double average[3] = {};
    if (::getloadavg(average, 3) != 3) return {};
    return {average, average + 3};
}

std::string process_counts() {
    std::ifstream file("/proc/loadavg");
    std::string line;
    std::getline(file, line);
    return line;
}

std::string scheduling() {
#ifdef __linux__
    const int policy = ::sched_getscheduler(0);
    sched_param param{};
    ::sched_getparam(0, &param);
    if (policy == SCHED_RR) return fmt::format("SCHED_RR {}", param.sched_priority);
    if (policy == SCHED_FIFO) return fmt::format("SCHED_FIFO {}", param.sched_priority);
    return policy == SCHED_OTHER ? "SCHED_OTHER" : fmt::format("policy {}", policy);
#else
    return "unknown";
#endif
}

void keep_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
        // Takes the lowest free number, which is this one. Opened for reading only, so that writing
        // to it fails.
        ::open("/dev/null", fd == STDERR_FILENO ? O_WRONLY : O_RDONLY);
    }
}

bool is_terminal(std::FILE* stream) {
    return ::isatty(::fileno(stream)) == 1;
}

int terminal_columns() {
    winsize size{};
    return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

bool reader_has_gone(int error) {
    struct stat facts {};
    const bool file = ::fstat(STDOUT_FILENO, &facts) == 0 && S_ISREG(facts.st_mode);
    return error == EPIPE || error == EBADF || (error == EIO && !file);
}

bool let_go_of_stdout() {
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nothing < 0) return false;
    ::dup2(nothing, STDOUT_FILENO);
    ::close(nothing);
    return true;
}

namespace {

constexpr int kShellBase = 128;  // plus the signal's number: a shell's exit code

// A signal handler can reach nothing else.
std::atomic<bool> g_stop{false};
std::atomic<int> g_signal{0};  // the first one
std::atomic<bool> g_interrupted{false}, g_terminated{false};

// Somebody who asks again does not want to wait. Hangups come twice by themselves, from the
// terminal and from the shell, and a limit of processor time every second.
void on_stop(int signal) {
    const bool again = (signal == SIGINT && g_interrupted.exchange(true)) ||
                       (signal == SIGTERM && g_terminated.exchange(true));
    if (again) std::_Exit(kShellBase + signal);
    int none = 0;
    g_signal.compare_exchange_strong(none, signal);
    g_stop = true;
}

void handle(int signal, void (*handler)(int), bool also_where_ignored) {
    struct sigaction old {};
    ::sigaction(signal, nullptr, &old);
    if (old.sa_handler == SIG_IGN && !also_where_ignored) return;
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(signal, &action, nullptr);
}

}  // namespace

std::atomic<bool>& stop_on_signals() {
    handle(SIGINT, on_stop, true);
    handle(SIGTERM, on_stop, true);
    handle(SIGHUP, on_stop, false);
    handle(SIGXCPU, on_stop, false);
    return g_stop;
}

void go_on_without_readers() {
    handle(SIGPIPE, SIG_IGN, true);
}

void fail_at_the_file_limit() {
    handle(SIGXFSZ, SIG_IGN, true);
}

int stop_exit_code() {
    return g_signal == 0 ? 0 : kShellBase + g_signal;
}

const char* stop_name() {
    switch (g_signal) {
        case SIGINT:
            return "SIGINT";
        case SIGTERM:
            return "SIGTERM";
        case SIGHUP:
            return "SIGHUP";
        case SIGXCPU:
            return "SIGXCPU";
        default:
            return "";
    }
}

}  // namespace darb
