#include "engine/publish/page_shaders.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>

#include "engine/core/check.h"
#include "engine/publish/page_files.h"

namespace darb {

namespace {

constexpr std::string_view kPreamble =
    "#version 300 es\n"
    "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
    "precision highp sampler2DArray;\n"
    "#define precise\n";  // which GLSL ES 3.00 does not know

std::string constant_text(const SpecValue& value) {
    if (const auto* integer = std::get_if<std::int32_t>(&value.value))
        return fmt::format("{}", *integer);
    std::string text = fmt::format("{:.9g}", std::get<float>(value.value));
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text;
}

/// A line without its comment and indentation; of a constant within a function, which may depend on
/// more than constants here but not in ES, the variable.
std::string plain_line(std::string line, bool& in_function) {
    line.erase(std::min(line.find("//"), line.size()));
    line.erase(line.find_last_not_of(" \t") + 1);
    in_function = line.starts_with(' ');
    line.erase(0, line.find_first_not_of(' '));
    if (in_function && line.starts_with("const ")) line.erase(0, 6);
    return line;
}

std::string specialized(const std::string& line, const SpecConstants& constants) {
    static const std::regex declaration(R"(layout\(constant_id = \d+\) const (\w+) (\w+) = (.*);)");
    std::smatch match;
    if (!std::regex_match(line, match, declaration)) return line;
    const auto found = std::find_if(constants.begin(), constants.end(), [&](const auto& given) {
        return given.first.text() == match.str(2);
    });
    std::string value = found == constants.end() ? match.str(3) : constant_text(found->second);
    return fmt::format("const {0} {1} = {0}({2});", match.str(1), match.str(2), value);
}

/// A function, or what stands between functions, which has no name.
struct Piece {
    std::string name, text;
};

/// The name of the function whose definition begins with this line; empty where none does.
std::string function_of(const std::string& line) {
    static const std::regex head(R"(\w+ (\w+)\(.*[^;])");
    std::smatch match;
    return std::regex_match(line, match, head) ? match.str(1) : std::string();
}

struct Source {
    const SpecConstants& constants;
    std::set<std::string> included{};
    std::vector<Piece> pieces{};

    void add_line(const std::string& line, bool in_function, bool& open) {
        const std::string name = in_function || open ? std::string() : function_of(line);
        if (!name.empty() || pieces.empty() || (!open && !pieces.back().name.empty()))
            pieces.push_back({name, {}});
        if (!name.empty()) open = true;
        pieces.back().text += specialized(line, constants) + "\n";
        if (open && !in_function && line.ends_with('}')) open = false;
    }

    void add_file(const std::string& name) {
        if (!included.insert(name).second) return;
        std::string_view rest = page_file(name);
        bool open = false;  // in a function
        while (!rest.empty()) {
            const std::size_t end = rest.find('\n');
            bool in_function = false;
            const std::string line = plain_line(std::string(rest.substr(0, end)), in_function);
            rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
            if (line.empty() || line.starts_with("#version") || line.starts_with("#extension"))
                continue;
            if (!line.starts_with("#include \"")) {
                add_line(line, in_function, open);
                continue;
            }
            const std::string path = line.substr(10, line.rfind('"') - 10);
            const bool beside = path.find('/') == std::string::npos;
            add_file(path == "kernels/shaped.glsl" ? "engine/publish/page/shapeless.glsl"
                     : beside                      ? name.substr(0, name.rfind('/') + 1) + path
                                                   : "shaders/" + path);
        }
    }

    /// Without functions that nothing calls.
    std::string text() const {
        std::set<std::string> words{"main"};
        std::vector<bool> kept(pieces.size(), false);
        for (bool more = true; more;) {
            more = false;
            for (std::size_t i = 0; i < pieces.size(); ++i) {
                if (kept[i] || !(pieces[i].name.empty() || words.contains(pieces[i].name)))
                    continue;
                kept[i] = more = true;
                static const std::regex word(R"(\w+)");
                const std::string& t = pieces[i].text;
                for (std::sregex_iterator w(t.begin(), t.end(), word), end; w != end; ++w)
                    words.insert(w->str());
            }
        }
        std::string out;
        for (std::size_t i = 0; i < pieces.size(); ++i)
            if (kept[i]) out += pieces[i].text;
        return out;
    }
};

}  // namespace

std::string page_shader(std::string_view name, const SpecConstants& constants) {
    Source source{constants};
    source.add_file("engine/publish/page/" + std::string(name));
    return std::string(kPreamble) + source.text();
}

}  // namespace darb
