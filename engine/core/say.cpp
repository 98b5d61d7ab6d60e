// SPDX-License-Identifier: MIT
#include "engine/core/say.h"

#include <cerrno>
#include <system_error>

#include "engine/core/system.h"

namespace darb {

namespace {

bool notes_left_out = false;

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
    if (!reader_has_gone(errno) || !let_go_of_stdout()) return false;
    std::clearerr(stdout);
    return std::fflush(stdout) == 0;
}

void tell_text(std::string_view text) {
    if (!write_or_let_go(text)) throw std::system_error(errno, std::generic_category());
}

}  // namespace darb
