// SPDX-License-Identifier: MIT
#include "engine/core/process.h"

#include <array>

namespace darb {

ProcessEnd run_process(const std::vector<std::string>& words, ProcessOptions options,
                       std::string* printed) {
    if (printed != nullptr) options.output = ProcessOptions::Output::piped;
    ChildProcess process(words, options);
    std::array<char, 4096> part;
    while (printed != nullptr) {
        const std::size_t count = process.read(part).value_or(0);
        if (count == 0) break;
        printed->append(part.data(), count);
    }
    return process.wait();
}

std::string windows_command_line(const std::vector<std::string>& words) {
    std::string line;
    for (const std::string& word : words) {
        if (!line.empty()) line += ' ';
        const bool plain = !word.empty() && word.find_first_of(" \t\n\v\"") == std::string::npos;
        if (plain) {
            line += word;
            continue;
        }
        // Backslashes count for themselves, but before a quote they escape: twice as many then.
        line += '"';
        std::size_t slashes = 0;
        for (const char c : word) {
            if (c == '"') line.append(slashes + 1, '\\');
            slashes = c == '\\' ? slashes + 1 : 0;
            line += c;
        }
        line.append(slashes, '\\');
        line += '"';
    }
    return line;
}

}  // namespace darb
