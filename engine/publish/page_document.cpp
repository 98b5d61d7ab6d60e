// SPDX-License-Identifier: MIT
#include "engine/publish/page_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/gpu/pipeline.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/publish/page_files.h"
#include "engine/publish/page_shader.h"
#include "engine/raster/forward_options.h"
#include "engine/raster/kernel_constants.h"
#include "engine/report/html.h"
#include "engine/report/palette.h"
#include "engine/scene/inflate.h"
#include "engine/scene/subject.h"

namespace darb {

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

/// What a page has beyond the least.
struct PageParts {
    bool streamed = false, notes = false, collider = false, panorama = false;
};

PageParts parts_of(const PageDocument& document, bool streamed) {
    return {streamed, !document.notes.empty(), document.collider.has_value(),
            document.panorama.has_value()};
}

std::string script(const PageParts& parts) {
    return joined({"0_scene.js"}) +
           (parts.streamed ? std::string() : joined({"half.js", "1_decode.js"})) +
           joined({"2_camera.js", "3_renderer.js", "4_viewer.js", "5_controls.js"}) +
           (parts.streamed ? joined({"5_stream.js"}) : "") +
           (parts.notes ? joined({"7_notes.js"}) : "") +
           (parts.collider ? joined({"8_walk.js"}) : "") +
           (parts.panorama ? joined({"9_around.js"}) : "") + joined({"6_main.js"});
}

std::string worker(const PageParts& parts) {
    return (parts.streamed ? "" : joined({"half.js", "merger.js"})) + joined({"sorter.js"});
}

Json shaders_of(const SplatModel& model, std::span<const PageColumn> columns) {
    SpecConstants constants = kernel_constants(model.kernel, model.footprint);
    constants["SH_DEGREE"] = model.sh_degree;
    ProjectionEffects effects;
    effects.antialias = model.antialias;
    add_constants(effects, constants);
    const PageStorage storage{columns, kernel_has_shape(model.kernel) && !columns.empty()};
    Json shaders = Json::object();
    for (const char* name :
         {"corner.vert", "project.frag", "splat.vert", "splat.frag", "show.frag"})
        shaders[name] = page_shader(name, constants, storage);
    return shaders;
}

Json camera_json(const View& view, const Subject& subject, const SplatModel& model,
                 const glm::dvec3& origin) {
    const Camera& c = view.camera;
    const glm::dmat3 rows = glm::transpose(c.rotation);
    return {{"name", printable(view.name)},
            {"width", c.width},
            {"height", c.height},
            {"fx", c.fx},
            {"fy", c.fy},
            {"cx", c.cx},
            {"cy", c.cy},
            {"eye", json_of(c.centre() - origin)},
            {"axes", {json_of(rows[0]), json_of(rows[1]), json_of(rows[2])}},
            {"pivot", pivot_depth(subject, model, c)}};
}

/// origin: of the page's positions.
Json scene_json(const PageDocument& document, const SplatModel& model,
                std::span<const PageColumn> columns, const glm::dvec3& origin) {
    const Subject subject = subject_of(model, cameras_of(document.views));
    Json cameras = Json::array();
    for (const View& view : document.views)
        cameras.push_back(camera_json(view, subject, model, origin));
    return {{"count", model.size()},
            {"degree", model.sh_degree},
            {"cameras", cameras},
            {"start", document.start},
            {"poster", document.start},
            {"focus", json_of(subject.centre - origin)},
            {"radius", subject.radius},
            {"up", json_of(document.up)},
            {"background", json_of(glm::dvec3(document.background))},
            {"facts", document.facts},
            {"near", NEAR_DEFAULT},
            {"lowPass", LOW_PASS_DEFAULT},
            {"jacobianMargin", JACOBIAN_MARGIN},
            {"logitLimit", OPACITY_LOGIT_LIMIT},
            {"secondMoment", rendered_second_moment(model.kernel, model.footprint)},
            {"shaped", kernel_has_shape(model.kernel)},
            {"shaders", shaders_of(model, columns)}};
}

Json collider_json(const PageCollider& collider, const glm::dvec3& origin) {
    glm::dvec3 low(1e300), high(-1e300);
    for (const glm::dvec3& p : collider.position) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::dvec3 step = glm::max((high - low) / 65535.0, glm::dvec3(1e-12));
    std::vector<std::byte> bytes;
    const auto put = [&](std::uint32_t value, int count) {
        for (int b = 0; b < count; ++b) bytes.push_back(std::byte(value >> (8 * b) & 0xffu));
    };
    for (const glm::dvec3& p : collider.position)
        for (int axis = 0; axis < 3; ++axis)
            put(static_cast<std::uint32_t>(std::lround((p[axis] - low[axis]) / step[axis])), 2);
    for (const auto& face : collider.face)
        for (const std::uint32_t i : face) put(i, 4);
    return {{"low", json_of(low - origin)},
            {"step", json_of(step)},
            {"vertices", collider.position.size()},
            {"faces", collider.face.size()},
            {"data", base64(bytes)},
            {"metres", collider.metres_per_unit}};
}

/// What only some pages have: notes, ground to walk on, a picture all around.
void add_extras(const PageDocument& document, const SplatModel& model, const glm::dvec3& origin,
                Json& scene) {
    if (!document.notes.empty()) {
        const Subject subject = subject_of(model, cameras_of(document.views));
        Json notes = Json::array();
        for (const PageNote& note : document.notes) {
            notes.push_back({{"at", json_of(note.at - origin)},
                             {"title", note.title.empty() ? "Note" : note.title},
                             {"text", note.text}});
            if (note.view) {
                Json camera = camera_json(*note.view, subject, model, origin);
                camera["pivot"] = glm::distance(note.at, note.view->camera.centre());
                notes.back()["camera"] = std::move(camera);
            }
        }
        scene["notes"] = std::move(notes);
    }
    if (document.collider) scene["collider"] = collider_json(*document.collider, origin);
    if (document.panorama) {
        const glm::dmat3 rows = glm::transpose(document.panorama->rotation);
        scene["around"] = {{"picture", "data:image/jpeg;base64," + base64(document.panorama->jpeg)},
                           {"axes", {json_of(rows[0]), json_of(rows[1]), json_of(rows[2])}}};
    }
}

void add_payload(const PageSplats& packed, std::size_t payload_bytes, Json& scene) {
    Json columns = Json::array();
    for (const PageColumn& c : packed.columns) {
        Json column = {{"attribute", attribute_name(c.attribute)},
                       {"component", c.component},
                       {"bytes", c.bytes},
                       {"bits", c.bits},
                       {"word", c.word},
                       {"shift", c.shift}};
        if (!c.exact)
            column.update({{"low", c.low}, {"step", c.step}, {"difference", c.difference}});
        columns.push_back(column);
    }
    scene.update(
        {{"count", packed.count},
         {"degree", packed.sh_degree},
         {"exact", packed.columns.front().exact},
         {"columns", columns},
         {"layers", (packed.words + 3) / 4},
         {"parts", (payload_bytes + kPayloadPart - 1) / kPayloadPart},
         {"megabytes", std::round(static_cast<double>(payload_bytes) * 4 / 3 / 1e5) / 10}});
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

namespace {

/// The page up to its splats.
std::string page_head(const PageDocument& document, const PageParts& parts, const Json& scene) {
    DARB_CHECK(document.start < document.views.size(), "camera {}", document.start);
    return filled(page_file(kFolder + "page.html"),
                  {{"title", html_escape(printable(document.title))},
                   {"may", parts.streamed ? "; connect-src 'self'" : ""},
                   {"style", style(document.background)},
                   {"poster", "data:image/jpeg;base64," + base64(document.poster)},
                   {"scene", script_json(scene)},
                   {"worker", worker(parts)},
                   {"script", script(parts)}});
}

constexpr const char* kPageEnd = "</body>\n</html>\n";

}  // namespace

std::string page_document(const PageDocument& document, const SplatModel& model,
                          const PageSplats& packed) {
    DARB_CHECK(packed.count > 0, "{} splats", packed.count);
    const std::vector<std::byte> payload = gzip(packed.planes);
    const PageParts parts = parts_of(document, false);
    Json scene = scene_json(document, model, packed.columns, model.origin);
    add_extras(document, model, model.origin, scene);
    add_payload(packed, payload.size(), scene);
    std::string page = page_head(document, parts, scene);
    for (std::size_t at = 0, part = 0; at < payload.size(); at += kPayloadPart, ++part)
        page += fmt::format(
            "<script type=\"text/plain\" id=\"part{}\">{}</script>\n", part,
            base64(std::span(payload).subspan(at, std::min(kPayloadPart, payload.size() - at))));
    return page + kPageEnd;
}

std::string streamed_page_document(const PageDocument& document, const SplatModel& model) {
    const glm::dvec3 origin(0.0);
    Json scene = scene_json(document, model, {}, origin);
    add_extras(document, model, origin, scene);
    return page_head(document, parts_of(document, true), scene) + kPageEnd;
}

std::size_t page_script_bytes() {
    std::size_t bytes = worker({}).size() + script({}).size();
    for (const Json& shader : shaders_of(SplatModel{}, {})) bytes += shader.dump().size();
    return bytes;
}

std::size_t most_page_script_bytes() {
    std::size_t most = 0;
    for (const bool streamed : {false, true}) {
        const PageParts all{streamed, true, true, true};
        most = std::max(most, worker(all).size() + script(all).size());
    }
    return most;
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
