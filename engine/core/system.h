// SPDX-License-Identifier: MIT
// This process and the machine that it runs on: command line, environment, terminal, signals,
// priorities and what it has used. system_posix.cpp and system_windows.cpp implement it.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace darb {

// Command line and environment, as UTF-8.

/// The words of the command line, the program's name first.
std::vector<std::string> command_words(int argc, char** argv);
/// Nothing where the variable is not set.
std::optional<std::string> environment(const char* name);
/// For this process and its children, where the variable is not set yet.
void set_missing_environment(const char* name, const std::string& value);

// This process.

int process_id();
/// Of the machine; "unknown" where it has none.
std::string host_name();
/// The file of this program.
std::filesystem::path program_file();
/// Bytes of memory that it has had at most.
double peak_memory_bytes();
/// Bytes of addresses that its limit (ulimit -v) leaves it; the largest number without one.
std::uint64_t address_space_left();
/// Processor time of it and of the children that it has waited for, s.
double processor_seconds();
/// The calling thread gives way to others from now on: nice is 1 to 19, as Unix has it.
void lower_thread_priority(int nice);
/// A function of a shared library that is loaded already (null: of any that is); null where there
/// is none.
void* loaded_function(const char* library, const char* name);
/// Whether the system finds this shared library.
bool can_load_library(const char* library);

// The machine.

/// Busy time of all processors since it started, s; 0 where it is not known.
double machine_busy_seconds();
std::string processor_name();
/// Of the last 1, 5 and 15 minutes; empty where there are none.
std::vector<double> load_averages();
/// How the system counts its processes, "0.52 0.58 0.59 3/512 12345" on Linux; else empty.
std::string process_counts();
/// How this process is scheduled, as "SCHED_OTHER".
std::string scheduling();

// Terminal: stdin, stdout and stderr.

/// Makes them fit to be used; to be called first in main. Opens /dev/null in place of one that is
/// closed: otherwise the next file to be opened would take its number and receive what is printed.
/// Writing to a stdout opened in this way fails. On Windows, bytes are written as they are, and a
/// console shows UTF-8 and takes escape sequences.
void keep_standard_descriptors();
/// Whether it shows text to a person and takes escape sequences.
bool is_terminal(std::FILE* stream);
/// Columns of the terminal behind stdout; 0 where there is none.
int terminal_columns();
/// Whether this error of writing to stdout, as errno has it, means that the reader has gone away,
/// rather than that a disk failed.
bool reader_has_gone(int error);
/// Lets stdout write to nowhere. False where that cannot be had.
bool let_go_of_stdout();

// Signals that ask a run to save and end.

/// Set by SIGINT, SIGTERM, SIGHUP and SIGXCPU from now on, and on Windows by Ctrl-C, Ctrl-Break and
/// a window that is closed. A second SIGINT, or a second SIGTERM, ends the process at once; a
/// hangup that was ignored from the start (nohup) stays so.
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
