// SPDX-License-Identifier: MIT
// Signals that ask a run to save and end.
#pragma once

#include <atomic>

namespace darb {

/// Set by SIGINT, SIGTERM, SIGHUP and SIGXCPU from now on. A second SIGINT, or a second SIGTERM,
/// ends the process at once; a hangup that was ignored from the start (nohup) stays so.
std::atomic<bool>& stop_on_signals();

/// SIGPIPE no longer ends the process: the write that it is about fails instead.
void go_on_without_readers();
/// The same for SIGXFSZ, a limit of the size of files.
void fail_at_the_file_limit();

/// Exit code for the signal that set it: 128 and its number, as shells have it; 0: none.
int stop_exit_code();
/// Name of that signal, as "SIGTERM"; empty: none.
const char* stop_name();

}  // namespace darb
