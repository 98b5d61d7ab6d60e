// SPDX-License-Identifier: MIT
// Signals that ask a run to save its state and end.
#pragma once

#include <atomic>

namespace darb {

/// From now on SIGINT, SIGTERM, SIGHUP and SIGXCPU set this flag. A second SIGINT or a second
/// SIGTERM ends the process at once. A hangup that was ignored from the start (nohup) stays
/// ignored.
std::atomic<bool>& stop_on_signals();

/// SIGPIPE no longer ends the process; the write that caused it fails instead.
void go_on_without_readers();
/// Does the same for SIGXFSZ, the limit of file sizes.
void fail_at_the_file_limit();

/// The exit code for the signal that set the flag: 128 plus its number, as in shells; 0: none.
int stop_exit_code();
/// The name of that signal, such as "SIGTERM"; empty: none.
const char* stop_name();

}  // namespace darb
