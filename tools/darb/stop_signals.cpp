// SPDX-License-Identifier: MIT
#include "tools/darb/stop_signals.h"

#include <csignal>
#include <cstdlib>

namespace darb {

namespace {

constexpr int kShellBase = 128;  // a shell's exit code is this plus the signal's number

// A signal handler cannot reach anything but globals.
std::atomic<bool> g_stop{false};
std::atomic<int> g_signal{0};  // the first one
std::atomic<bool> g_interrupted{false}, g_terminated{false};

// A user who asks again does not want to wait. Hangups arrive twice anyway, from the terminal and
// from the shell, and a limit of processor time signals every second.
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
