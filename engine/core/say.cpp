// SPDX-License-Identifier: MIT
#include "engine/core/say.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace darb {

namespace {

bool notes_left_out = false;

// Whether the error means that the reader has gone away, rather than that a disk failed.
bool nobody_reads(int error) {
    struct stat facts {};
    const bool file = ::fstat(STDOUT_FILENO, &facts) == 0 && S_ISREG(facts.st_mode);
    return error == EPIPE || error == EBADF || (error == EIO && !file);
}

}  // namespace

void say_text(std::string_view text) noexcept {
    if (std::fwrite(text.data(), 1, text.size(), stderr) != text.size() || std::fflush(stderr) != 0)
        std::clearerr(stderr);
}

void say_note(std::string_view line) {
    if (!notes_left_out) say("{}\n", line);
}

void say_notes(const std::vector<std::string>& notes) {
    for (const std::string& note : notes) say_note("note: " + note);
}

void leave_out_notes(bool quiet) {
    notes_left_out = quiet;
}

bool write_or_let_go(std::string_view text) {
    errno = 0;
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
        return true;
    if (!nobody_reads(errno)) return false;
    const int nothing = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (nothing < 0) return false;
    ::dup2(nothing, STDOUT_FILENO);
    ::close(nothing);
    std::clearerr(stdout);
    return std::fflush(stdout) == 0;
}

void tell_text(std::string_view text) {
    if (!write_or_let_go(text)) throw std::system_error(errno, std::generic_category());
}

void keep_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
        // Takes the lowest free number, which is this one. Opened for reading only, so that writing
        // to it fails.
        ::open("/dev/null", fd == STDERR_FILENO ? O_WRONLY : O_RDONLY);
    }
}

}  // namespace darb
