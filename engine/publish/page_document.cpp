#include "engine/publish/page_document.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "engine/core/check.h"
#include "engine/core/text.h"
#include "engine/data/camera_list.h"
#include "engine/kernels/second_moment.h"
#include "engine/publish/page_files.h"
#include "engine/publish/page_shaders.h"
#include "engine/publish/page_text.h"
#include "engine/raster/effects.h"
#include "engine/raster/kernel_constants.h"
#include "engine/report/html.h"
#include "engine/scene/inflate.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr std::size_t kPayloadPart = 3 << 16;  // of the payload in one element
const std::string kFolder = "engine/publish/page/";

using Json = nlohmann::json;
using Texts = std::map<std::string, std::string, std::less<>>;

Json json_of(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

/// Nothing put in is looked at again, whatever it holds.
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
                  {{"background", fmt::format("rgb({},{},{})", bytes.r, bytes.g, bytes.b)}});
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

}  // namespace darb
