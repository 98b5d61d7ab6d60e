// SPDX-License-Identifier: MIT
// The built darb command as a child that can be signalled and whose descriptors a test prepares.
#pragma once

#include <fcntl.h>

#include <csignal>
#include <functional>

#include "tests/support/run_command.h"

namespace darb::test {

// A child with stdout and stderr in files; prepare runs in it before the command does.
class Child {
  public:
    Child(std::vector<std::string> words, const fs::path& folder,
          const std::function<void()>& prepare = {})
        : out_(folder / "child.out"), err_(folder / "child.err") {
        words.insert(words.begin(), DARB_COMMAND);
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        pid_ = ::fork();
        if (pid_ != 0) return;
        redirect(out_, STDOUT_FILENO);
        redirect(err_, STDERR_FILENO);
        if (prepare) prepare();
        ::execv(argv[0], argv.data());
        ::_exit(127);
    }
    ~Child() {
        if (!running()) return;
        ::kill(pid_, SIGKILL);
        wait();
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    pid_t pid() const { return pid_; }
    bool running() {
        if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = 0;
        return pid_ > 0;
    }
    void send(int signal) const { ::kill(pid_, signal); }
    // Exit code, or minus the signal that ended it.
    int wait() {
        if (pid_ > 0) ::waitpid(pid_, &status_, 0);
        pid_ = 0;
        return WIFEXITED(status_) ? WEXITSTATUS(status_) : -WTERMSIG(status_);
    }
    std::string out() const { return read_text_file(out_); }
    std::string err() const { return read_text_file(err_); }

  private:
    static void redirect(const fs::path& file, int fd) {
        ::dup2(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600), fd);
    }
    fs::path out_, err_;
    pid_t pid_ = 0;
    int status_ = 0;
};

// For Child's prepare: what is written there goes into a pipe whose reader has gone.
inline void write_to_nobody(std::initializer_list<int> descriptors) {
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(126);
    for (const int fd : descriptors) ::dup2(ends[1], fd);
    ::close(ends[0]);
    ::close(ends[1]);
}

}  // namespace darb::test
