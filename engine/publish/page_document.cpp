// SPDX-License-Identifier: MIT
#include "engine/publish/page_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/pipeline.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/publish/page_files.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/kernel_constants.h"
#include "engine/report/html.h"
#include "engine/report/palette.h"
#include "engine/scene/inflate.h"
#include "engine/scene/subject.h"

namespace darb {

/// name: a file in engine/publish/page, such as "project.frag". Specialization constants in the
/// source become constants, with the values given, or else as declared.
std::string page_shader(std::string_view name, const SpecConstants& constants);

namespace {

constexpr std::size_t kPayloadPart = 3 << 16;  // bytes of the payload in one element
const std::string kFolder = "engine/publish/page/";

using Json = nlohmann::json;
using Texts = std::map<std::string, std::string, std::less<>>;

Json json_of(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

/// Inserted text is not scanned again, whatever it contains.
std::string filled(std::string_view form, const Texts& texts) {
    std::string out;
    for (std::size_t open = 0; (open = form.find("{{")) != std::string_view::npos;) {
        const std::size_t close = form.find("}}", open);
        const auto text = texts.find(form.substr(open + 2, close - open - 2));
        DARB_CHECK(text != texts.end(), "{}", form.substr(open, close - open));
        out += form.substr(0, open);
        out += text->second;
        form.remove_prefix(close + 2);
    }
    out += form;
    return out;
}

std::string joined(std::initializer_list<const char*> names) {
    std::string out;
    for (const char* name : names) out += without_comment_lines(page_file(kFolder + name));
    return out;
}

std::string script() {
    return joined({"1_decode.js", "2_camera.js", "3_renderer.js", "4_viewer.js", "5_controls.js",
                   "6_main.js"});
}

std::string worker() {
    return joined({"merger.js", "sorter.js"});
}

Json shaders_of(const SplatModel& model) {
    SpecConstants constants = kernel_constants(model.kernel, model.footprint);
    constants["SH_DEGREE"] = model.sh_degree;
    ProjectionEffects effects;
    effects.antialias = model.antialias;
    add_constants(effects, constants);
    Json shaders = Json::object();
    for (const char* name :
         {"corner.vert", "project.frag", "splat.vert", "splat.frag", "show.frag"})
        shaders[name] = page_shader(name, constants);
    return shaders;
}

Json camera_json(const View& view, const Subject& subject, const SplatModel& model) {
    const Camera& c = view.camera;
    const glm::dmat3 rows = glm::transpose(c.rotation);
    return {{"name", printable(view.name)},
            {"width", c.width},
            {"height", c.height},
            {"fx", c.fx},
            {"fy", c.fy},
            {"cx", c.cx},
            {"cy", c.cy},
            {"eye", json_of(c.centre() - model.origin)},
            {"axes", {json_of(rows[0]), json_of(rows[1]), json_of(rows[2])}},
            {"pivot", pivot_depth(subject, model, c)}};
}

Json scene_json(const PageDocument& document, const SplatModel& model, const PageSplats& packed,
                std::size_t payload_bytes) {
    const Subject subject = subject_of(model, cameras_of(document.views));
    Json columns = Json::array();
    for (const PageColumn& c : packed.columns) {
        Json column = {{"attribute", attribute_name(c.attribute)},
                       {"component", c.component},
                       {"bytes", c.bytes}};
        if (c.exact)
            column["exact"] = true;
        else
            column.update({{"low", c.low}, {"step", c.step}, {"difference", c.difference}});
        columns.push_back(column);
    }
    Json cameras = Json::array();
    for (const View& view : document.views) cameras.push_back(camera_json(view, subject, model));
    return {{"count", packed.count},
            {"degree", packed.sh_degree},
            {"exact", packed.columns.front().exact},
            {"columns", columns},
            {"bytes", packed.planes.size()},
            {"parts", (payload_bytes + kPayloadPart - 1) / kPayloadPart},
            {"megabytes", std::round(static_cast<double>(payload_bytes) * 4 / 3 / 1e5) / 10},
            {"cameras", cameras},
            {"start", document.start},
            {"poster", document.start},
            {"focus", json_of(subject.centre - model.origin)},
            {"radius", subject.radius},
            {"up", json_of(document.up)},
            {"background", json_of(glm::dvec3(document.background))},
            {"facts", document.facts},
            {"near", NEAR_DEFAULT},
            {"lowPass", LOW_PASS_DEFAULT},
            {"jacobianMargin", JACOBIAN_MARGIN},
            {"logitLimit", OPACITY_LOGIT_LIMIT},
            {"secondMoment", rendered_second_moment(model.kernel, model.footprint)},
            {"shaders", shaders_of(model)}};
}

std::string style(const glm::vec3& background) {
    const glm::ivec3 bytes(glm::round(glm::clamp(background, 0.0f, 1.0f) * 255.0f));
    return filled(page_file(kFolder + "page.css"),
                  {{"background", fmt::format("rgb({},{},{})", bytes.r, bytes.g, bytes.b)},
                   {"ink", css_colour(palette::kDark.ink)},
                   {"soft", css_colour(palette::kDark.soft)},
                   {"line", css_colour(palette::kDark.line)},
                   {"page", css_colour(palette::kDark.page)},
                   {"button", css_colour(palette::kButton)},
                   {"accent", css_colour(palette::kAccent)}});
}

}  // namespace

std::string page_document(const PageDocument& document, const SplatModel& model,
                          const PageSplats& packed) {
    DARB_CHECK(packed.count > 0 && document.start < document.views.size(), "{} splats, camera {}",
               packed.count, document.start);
    const std::vector<std::byte> payload = gzip(packed.planes);
    std::string page =
        filled(page_file(kFolder + "page.html"),
               {{"title", html_escape(printable(document.title))},
                {"style", style(document.background)},
                {"poster", "data:image/jpeg;base64," + base64(document.poster)},
                {"scene", script_json(scene_json(document, model, packed, payload.size()))},
                {"worker", worker()},
                {"script", script()}});
    for (std::size_t at = 0, part = 0; at < payload.size(); at += kPayloadPart, ++part)
        page += fmt::format(
            "<script type=\"text/plain\" id=\"part{}\">{}</script>\n", part,
            base64(std::span(payload).subspan(at, std::min(kPayloadPart, payload.size() - at))));
    return page + "</body>\n</html>\n";
}

std::size_t page_script_bytes() {
    std::size_t bytes = worker().size() + script().size();
    for (const Json& shader : shaders_of(SplatModel{})) bytes += shader.dump().size();
    return bytes;
}

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
            add_file(path == "kernels/shaped.glsl" ? "engine/publish/page/shapeless.glsl"
                     : beside                      ? name.substr(0, name.rfind('/') + 1) + path
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

std::string page_shader(std::string_view name, const SpecConstants& constants) {
    Source source{constants};
    source.add_file("engine/publish/page/" + std::string(name));
    return std::string(kPreamble) + source.text();
}

std::string script_json(const nlohmann::json& value) {
    const std::string json = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    std::string out;
    out.reserve(json.size());
    // Both occur only inside strings, where an escape means the same.
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
