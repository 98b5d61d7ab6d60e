// SPDX-License-Identifier: MIT
#include "engine/publish/page_shader.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/publish/page_files.h"
#include "engine/scene/splat_model.h"

namespace darb {

namespace {

const std::string kPages = "engine/publish/page/";
constexpr std::string_view kPreamble =
    "#version 300 es\n"
    "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
    "precision highp sampler2DArray;\nprecision highp usampler2D;\n"
    "precision highp usampler2DArray;\n"
    "#define precise\n";  // which GLSL ES 3.00 does not know

std::string constant_text(const SpecValue& value) {
    if (const auto* integer = std::get_if<std::int32_t>(&value.value))
        return fmt::format("{}", *integer);
    std::string text = fmt::format("{:.9g}", std::get<float>(value.value));
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text;
}

/// A line without its comment and indentation. A constant inside a function becomes a variable,
/// because in GLSL it may depend on more than constants, but not in ES.
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

/// The text of "stored.glsl" for splats in columns, which a texel of `words` holds layer by layer.
struct Columns {
    std::span<const PageColumn> columns;

    const PageColumn* find(int attribute, int component) const {
        for (const PageColumn& c : columns)
            if (c.attribute == attribute && c.component == component) return &c;
        return nullptr;
    }

    static std::string word(const PageColumn& c) {
        return fmt::format("w{}.{}", c.word / 4, "xyzw"[c.word % 4]);
    }

    std::string value(int attribute, int component) const {
        const PageColumn* c = find(attribute, component);
        DARB_CHECK(c != nullptr, "{} {}", attribute, component);
        if (c->bits == 32 && c->exact) return fmt::format("uintBitsToFloat({})", word(*c));
        if (c->exact)
            return fmt::format("unpackHalf2x16({}).{}", word(*c), c->shift == 0 ? "x" : "y");
        const std::string shifted =
            c->shift > 0 ? fmt::format("({} >> {})", word(*c), c->shift) : word(*c);
        const std::string integer =
            c->bits < 32 ? fmt::format("({} & {}u)", shifted, (1u << c->bits) - 1) : shifted;
        return fmt::format("({} + {} * float({}))", float_text(c->low), float_text(c->step),
                           integer);
    }

    std::string vector(int attribute, int first, int count) const {
        std::string text = fmt::format("vec{}(", count);
        for (int k = 0; k < count; ++k) text += (k > 0 ? ", " : "") + value(attribute, first + k);
        return text + ")";
    }

    /// A function; it fetches the texels that its body names.
    static std::string function(const std::string& head, const std::string& body) {
        std::string text = head + " {\n";
        for (int layer = 0; layer < 256; ++layer)
            if (body.find(fmt::format("w{}.", layer)) != std::string::npos)
                text +=
                    fmt::format("    uvec4 w{0} = texelFetch(words, ivec3(at, {0}), 0);\n", layer);
        return text + "    " + body + "\n}\n";
    }

    static std::string float_text(double value) {
        std::string text = fmt::format("{:.9g}", value);
        if (text.find_first_of(".e") == std::string::npos) text += ".0";
        return text;
    }
};

std::string stored_columns(std::span<const PageColumn> columns) {
    const Columns from{columns};
    std::string text(page_file(kPages + "words.glsl"));
    text += Columns::function(
        "vec4 stored_place(ivec2 at)",
        fmt::format("return vec4(uintBitsToFloat(w0.xyz), {});", from.value(kOpacityLogit, 0)));
    text += Columns::function("vec3 stored_size(ivec2 at)",
                              fmt::format("return {};", from.vector(kLogScale, 0, 3)));
    const std::string turn = from.vector(kRotation, 0, 4);
    text += Columns::function(
        "vec4 stored_turn(ivec2 at)",
        fmt::format("return {};", columns.front().exact ? turn : "whole_turn(" + turn + ")"));
    text += Columns::function("vec3 stored_dc(ivec2 at)",
                              fmt::format("return {};", from.vector(kShDc, 0, 3)));
    std::string rest = "vec3 sum = vec3(0.0);";
    for (int k = 0; from.find(kShRest, 3 * k); ++k)
        rest += fmt::format("\n    sum += basis[{}] * {};", k, from.vector(kShRest, 3 * k, 3));
    text += Columns::function("vec3 stored_rest(ivec2 at, float basis[SH_REST_MAX])",
                              rest + "\n    return sum;");
    if (from.find(kShape, 0))
        text += Columns::function("float stored_shape(ivec2 at)",
                                  fmt::format("return {};", from.value(kShape, 0)));
    return text;
}

/// A function, or the text between functions, which has no name.
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
    const PageStorage& storage;
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
        if (included.insert(name).second) add_text(name, page_file(name));
    }

    void add_text(const std::string& name, std::string_view rest) {
        bool open = false;  // inside a function
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
            if (path == "stored.glsl" && !storage.columns.empty())
                add_text(path, stored_columns(storage.columns));
            else
                add_file(path == "stored.glsl" ? kPages + "sog.glsl"
                         : path == "kernels/shaped.glsl" && !storage.shaped
                             ? kPages + "shapeless.glsl"
                         : beside ? name.substr(0, name.rfind('/') + 1) + path
                                  : "shaders/" + path);
        }
    }

    /// The text without functions that are never called.
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

std::string page_shader(std::string_view name, const SpecConstants& constants,
                        const PageStorage& storage) {
    Source source{constants, storage};
    source.add_file(kPages + std::string(name));
    return std::string(kPreamble) +
           fmt::format("#define PAGE_SHAPED {}\n", storage.shaped ? 1 : 0) + source.text();
}

}  // namespace darb
