// SPDX-License-Identifier: MIT
// Other programs, started without a shell: words go to them as they are, whatever they hold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace darb {

/// Whether a program with this name can be started: in a folder of PATH, or the file itself.
bool is_installed(const std::string& program);

struct ProcessOptions {
    /// Variables of its environment, in place of or beside this process's own.
    std::vector<std::pair<std::string, std::string>> variables = {};
    enum class Output { inherited, nowhere, piped };
    Output output = Output::inherited;
    /// Where it says what is wrong; piped: into the same pipe as the output.
    Output errors = Output::inherited;
    /// When set: its errors go to this file, which must not be there.
    std::filesystem::path errors_file = {};
    /// Its input ends at once. Else it is this process's own.
    bool no_input = false;
    /// It is ended when this process ends, however that happens.
    bool ends_with_this = false;
};

/// How a program ended.
struct ProcessEnd {
    int code = -1;            // its exit code; -1: it was killed
    bool was_killed = false;  // by a signal, or by end() below
    bool is_good() const { return code == 0 && !was_killed; }
};

/// A running program. It is ended where it still runs when this object is destroyed.
class ChildProcess {
  public:
    /// words: the program, which is looked for in PATH, and its arguments. Throws Error with the
    /// program's name where it cannot be started.
    explicit ChildProcess(const std::vector<std::string>& words,
                          const ProcessOptions& options = {});
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    /// Bytes of what it prints, 0 at the end; nothing where none came in that time. wait_ms below
    /// 0: as long as it takes.
    std::optional<std::size_t> read(std::span<char> to, int wait_ms = -1);
    ProcessEnd wait();
    /// Nothing while it runs.
    std::optional<ProcessEnd> look();
    /// Asks it to end, and ends it after two seconds. Windows has no way to ask.
    void end();

  private:
    void close_output();
    static constexpr std::intptr_t kNone = -1;
    std::intptr_t process_ = kNone, output_ = kNone;
    [[maybe_unused]] std::intptr_t group_ = kNone;  // its job, on Windows
    ProcessEnd ended_;
};

/// Runs it to its end. printed: when set, takes what it prints.
ProcessEnd run_process(const std::vector<std::string>& words, ProcessOptions options = {},
                       std::string* printed = nullptr);

/// The words as one line, quoted as programs on Windows take them apart (CommandLineToArgvW).
std::string windows_command_line(const std::vector<std::string>& words);

}  // namespace darb
