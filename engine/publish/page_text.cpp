#include "engine/publish/page_text.h"

#include <nlohmann/json.hpp>

namespace darb {

std::string script_json(const nlohmann::json& value) {
    const std::string json = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    std::string out;
    out.reserve(json.size());
    // Both stand in strings alone, where an escape is the same text.
    for (const char c : json) {
        if (c == '<')
            out += "\\u003c";
        else if (c == '>')
            out += "\\u003e";
        else
            out += c;
    }
    return out;
}

std::string without_comment_lines(std::string_view source) {
    std::string out;
    out.reserve(source.size());
    while (!source.empty()) {
        const std::size_t end = source.find('\n');
        std::string_view line = source.substr(0, end);
        source.remove_prefix(end == std::string_view::npos ? source.size() : end + 1);
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        if (line.empty() || line.starts_with("//")) continue;
        out += line;
        out += '\n';
    }
    return out;
}

}  // namespace darb
