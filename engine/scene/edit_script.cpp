// SPDX-License-Identifier: MIT
#include "engine/scene/edit_script.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/core/parse_number.h"
#include "engine/core/text.h"
#include "engine/scene/json_fields.h"

namespace darb {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr int kScriptVersion = 1;
constexpr double kMost = std::numeric_limits<double>::max();
constexpr double kLeastScale = 1e-6, kMostScale = 1e6;
constexpr double kOrthogonal = 1e-6;  // how far a turn may be off one
constexpr const char* kScriptHint =
    "docs/formats.md lists the edits; the window's \"Save edits as script\" writes such a file.";

template <class... Kinds>
struct OfKind : Kinds... {
    using Kinds::operator()...;
};
template <class... Kinds>
OfKind(Kinds...) -> OfKind<Kinds...>;

// Views and outlines of a screen.

json json_of_view(const Camera& c) {
    return {{"fx", c.fx},
            {"fy", c.fy},
            {"cx", c.cx},
            {"cy", c.cy},
            {"rotation", json_of(c.rotation)},
            {"translation", json_of(c.translation)}};
}

glm::dmat3 turn_in(JsonFields& fields, const char* key) {
    const glm::dmat3 turn = fields.matrix(key);
    const glm::dmat3 off = glm::transpose(turn) * turn - glm::dmat3(1.0);
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            if (!(std::abs(off[column][row]) <= kOrthogonal))
                fields.refuse(key,
                              "is no rotation: its rows are not at right angles and of "
                              "length 1");
    return turn;
}

Similarity read_similarity(JsonFields& fields) {
    Similarity s;
    s.scale = fields.number_or("scale", kLeastScale, kMostScale, 1);
    if (fields.has("turn") && fields.has("degrees"))
        fields.refuse("degrees", "says the same as 'turn'; one of them can be");
    if (fields.has("turn")) s.turn = turn_in(fields, "turn");
    if (fields.has("degrees")) s.turn = turn_of_degrees(fields.vector("degrees"));
    if (fields.has("move")) s.translation = fields.vector("move");
    if (fields.has("about")) {
        const glm::dvec3 about = fields.vector("about");
        s.translation += about - s.scale * (s.turn * about);
    }
    return s;
}

Camera view_in(JsonFields& fields) {
    JsonFields view = fields.object("view");
    Camera c;
    c.fx = view.number("fx", kLeastScale, kMost);
    c.fy = view.number("fy", kLeastScale, kMost);
    c.cx = view.number("cx");
    c.cy = view.number("cy");
    c.rotation = turn_in(view, "rotation");
    c.translation = view.vector("translation");
    view.done();
    return c;
}

json json_of_px(const glm::dvec2& px) {
    return {px.x, px.y};
}

json json_of_line(const std::vector<glm::dvec2>& line) {
    json list = json::array();
    for (const glm::dvec2& px : line) list.push_back(json_of_px(px));
    return list;
}

glm::dvec2 px_in(JsonFields& fields, const char* key) {
    const std::vector<double> v = fields.numbers(key, 2);
    return {v[0], v[1]};
}

std::vector<glm::dvec2> line_in(JsonFields& fields, const char* key, std::size_t least) {
    std::vector<glm::dvec2> line;
    for (const std::vector<double>& v : fields.rows(key, 2, least)) line.emplace_back(v[0], v[1]);
    return line;
}

json json_of_ranges(const std::vector<SplatRun>& ranges) {
    json list = json::array();
    for (const SplatRun& range : ranges) list.push_back({range.first, range.count});
    return list;
}

std::vector<SplatRun> ranges_in(JsonFields& fields) {
    constexpr double kMostSplats = std::numeric_limits<std::uint32_t>::max();
    std::vector<SplatRun> ranges;
    for (const std::vector<double>& v : fields.rows("ranges", 2, 0)) {
        for (const double number : v)
            if (!(number >= 0 && number <= kMostSplats && std::floor(number) == number))
                fields.refuse("ranges", fmt::format("{:g} is not the number of a splat", number));
        ranges.push_back({static_cast<std::uint32_t>(v[0]), static_cast<std::uint32_t>(v[1])});
    }
    return ranges;
}

json json_of_region(const Region& r) {
    if (r.shape == Region::Shape::sphere)
        return {{"by", "sphere"}, {"centre", json_of(r.centre)}, {"radius", r.half_size.x}};
    if (r.shape == Region::Shape::box)
        return {{"by", "box"}, {"centre", json_of(r.centre)}, {"half_size", json_of(r.half_size)}};
    const Prism& p = r.prism;
    return {{"by", "prism"},     {"at", json_of(p.at)}, {"u", json_of(p.u)},
            {"v", json_of(p.v)}, {"up", json_of(p.up)}, {"corners", json_of_line(p.corners)},
            {"low", p.low},      {"high", p.high}};
}

json json_of_selector(const Selector& what) {
    return std::visit(
        OfKind{
            [](by::Everything) -> json {
                return {{"by", "everything"}};
            },
            [](by::Nothing) -> json {
                return {{"by", "nothing"}};
            },
            [](const Region& region) { return json_of_region(region); },
            [](const by::Rectangle& r) -> json {
                return {{"by", "rectangle"},
                        {"view", json_of_view(r.view)},
                        {"from", json_of_px(r.from)},
                        {"to", json_of_px(r.to)}};
            },
            [](const by::Polygon& p) -> json {
                return {{"by", "polygon"},
                        {"view", json_of_view(p.view)},
                        {"outline", json_of_line(p.outline)}};
            },
            [](const by::Brush& b) -> json {
                return {{"by", "brush"},
                        {"view", json_of_view(b.view)},
                        {"stroke", json_of_line(b.stroke)},
                        {"radius", b.radius}};
            },
            [](const by::Opacity& o) -> json {
                return {{"by", "opacity"}, {"low", o.low}, {"high", o.high}};
            },
            [](const by::Size& s) -> json {
                return {{"by", "size"}, {"low", s.low}, {"high", s.high}};
            },
            [](const by::Colour& c) -> json {
                return {{"by", "colour"}, {"colour", json_of(c.colour)}, {"within", c.within}};
            },
            [](const by::Isolated& i) -> json {
                return {{"by", "isolated"}, {"share", i.share}};
            },
            [](const by::Haze& h) -> json {
                return {{"by", "haze"}, {"opacity", h.opacity}, {"size", h.size}};
            },
            [](const by::Near& n) -> json {
                return {{"by", "near"}, {"distance", n.distance}};
            },
            [](by::Connected) -> json {
                return {{"by", "connected"}};
            },
            [](const by::Flood& f) -> json {
                return {{"by", "flood"}, {"at", json_of(f.at)}, {"within", f.within}};
            },
            [](const by::Layer& l) -> json {
                return {{"by", "layer"}, {"name", l.name}};
            },
            [](const by::Numbers& n) -> json {
                return {{"by", "numbers"}, {"ranges", json_of_ranges(n.ranges)}};
            },
        },
        what);
}

struct SelectorRow {
    const char* by;
    Selector (*read)(JsonFields& fields);
};

const SelectorRow kSelectors[] = {
    {"everything", [](JsonFields&) -> Selector { return by::Everything{}; }},
    {"nothing", [](JsonFields&) -> Selector { return by::Nothing{}; }},
    {"sphere",
     [](JsonFields& f) -> Selector {
         return Region{Region::Shape::sphere, f.vector("centre"),
                       glm::dvec3(f.number("radius", 0, kMost))};
     }},
    {"box",
     [](JsonFields& f) -> Selector {
         return Region{Region::Shape::box, f.vector("centre"), f.vector("half_size")};
     }},
    {"prism",
     [](JsonFields& f) -> Selector {
         Region region;
         region.shape = Region::Shape::prism;
         region.prism = {f.vector("at"),
                         f.vector("u"),
                         f.vector("v"),
                         f.vector("up"),
                         line_in(f, "corners", 3),
                         f.number("low", -kMost, kMost),
                         f.number("high", -kMost, kMost)};
         return region;
     }},
    {"rectangle",
     [](JsonFields& f) -> Selector {
         return by::Rectangle{view_in(f), px_in(f, "from"), px_in(f, "to")};
     }},
    {"polygon",
     [](JsonFields& f) -> Selector {
         return by::Polygon{view_in(f), line_in(f, "outline", 3)};
     }},
    {"brush",
     [](JsonFields& f) -> Selector {
         return by::Brush{view_in(f), line_in(f, "stroke", 1), f.number("radius", 0, 1e6)};
     }},
    {"opacity",
     [](JsonFields& f) -> Selector {
         return by::Opacity{f.number("low", 0, 1), f.number("high", 0, 1)};
     }},
    {"size",
     [](JsonFields& f) -> Selector {
         return by::Size{f.number("low", 0, kMost), f.number("high", 0, kMost)};
     }},
    {"colour",
     [](JsonFields& f) -> Selector {
         return by::Colour{f.vector("colour"), f.number("within", 0, 1)};
     }},
    {"isolated", [](JsonFields& f) -> Selector { return by::Isolated{f.number("share", 0, 1)}; }},
    {"haze",
     [](JsonFields& f) -> Selector {
         return by::Haze{f.number("opacity", 0, 1), f.number("size", kLeastScale, kMost)};
     }},
    {"near",
     [](JsonFields& f) -> Selector { return by::Near{f.number("distance", kLeastScale, kMost)}; }},
    {"connected", [](JsonFields&) -> Selector { return by::Connected{}; }},
    {"flood",
     [](JsonFields& f) -> Selector {
         return by::Flood{f.vector("at"), f.number("within", 0, 1)};
     }},
    {"layer", [](JsonFields& f) -> Selector { return by::Layer{f.text("name")}; }},
    {"numbers", [](JsonFields& f) -> Selector { return by::Numbers{ranges_in(f)}; }},
};

Selector selector_in(JsonFields& fields) {
    const std::string by = fields.text("by");
    std::string known;
    for (const SelectorRow& row : kSelectors) {
        if (by == row.by) return row.read(fields);
        known += std::string(known.empty() ? "" : ", ") + row.by;
    }
    fields.refuse("by", fmt::format("is '{}', and there are {}", printable(by), known));
}

// Operations.

constexpr const char* kHow[] = {"replace", "add", "subtract"};

json json_of_operation(const EditOperation& operation, const fs::path& folder) {
    const auto named = [](const char* op) { return json{{"op", op}}; };
    return std::visit(
        OfKind{
            [&](const edits::Select& s) {
                json j = json_of_selector(s.what);
                j["op"] = "select";
                if (s.how != Combine::replace) j["how"] = kHow[static_cast<std::size_t>(s.how)];
                return j;
            },
            [&](edits::Invert) { return named("invert"); },
            [&](const edits::Remove& r) {
                json j = r.what ? json_of_selector(*r.what) : json::object();
                j["op"] = r.others ? "keep" : "delete";
                return j;
            },
            [&](edits::Hide) { return named("hide"); },
            [&](edits::Show) { return named("show"); },
            [&](const edits::Transform& t) {
                json j = json_of(t.by);
                j["op"] = "transform";
                if (!t.layer.empty()) j["layer"] = t.layer;
                return j;
            },
            [&](const edits::Add& a) -> json {
                return {{"op", "add"}, {"file", name_from(folder, a.file)}, {"name", a.name}};
            },
            [&](const edits::Duplicate& d) {
                json j = named("duplicate");
                if (!d.layer.empty()) j["layer"] = d.layer;
                if (!d.name.empty()) j["name"] = d.name;
                return j;
            },
            [&](const edits::ShowLayer& s) -> json {
                return {{"op", s.visible ? "show_layer" : "hide_layer"}, {"layer", s.layer}};
            },
            [&](const edits::RenameLayer& r) -> json {
                return {{"op", "rename_layer"}, {"layer", r.layer}, {"name", r.name}};
            },
            [&](const edits::PlaceLayer& p) -> json {
                return {{"op", "place_layer"}, {"layer", p.layer}, {"place", p.place}};
            },
            [&](const edits::RemoveLayer& r) -> json {
                return {{"op", "delete_layer"}, {"layer", r.layer}};
            },
            [&](const edits::MergeLayers& m) -> json {
                return {{"op", "merge_layers"}, {"layer", m.layer}, {"with", m.with}};
            },
            [&](const edits::StateUnit& u) -> json {
                return {{"op", "unit"}, {"metres_per_unit", u.metres_per_unit}};
            },
            [&](const edits::StateGround& g) {
                json j = named("ground");
                if (g.up) j["up"] = json_of(*g.up);
                return j;
            },
        },
        operation);
}

Combine how_in(JsonFields& fields) {
    const std::string how = fields.text_or("how", kHow[0]);
    for (std::size_t i = 0; i < std::size(kHow); ++i)
        if (how == kHow[i]) return static_cast<Combine>(i);
    fields.refuse("how", "is none of replace, add and subtract");
}

EditOperation remove_in(JsonFields& fields, bool others) {
    edits::Remove remove{std::nullopt, others};
    if (fields.has("by")) remove.what = selector_in(fields);
    return remove;
}

EditOperation transform_in(JsonFields& fields) {
    edits::Transform t;
    t.by = read_similarity(fields);
    t.layer = fields.text_or("layer", "");
    return t;
}

EditOperation ground_in(JsonFields& fields) {
    edits::StateGround ground;
    if (!fields.has("up")) return ground;
    const glm::dvec3 up = fields.vector("up");
    if (!(std::abs(glm::length(up) - 1) <= kOrthogonal)) fields.refuse("up", "is not of length 1");
    ground.up = up;
    return ground;
}

std::string some_text(JsonFields& fields, const char* key) {
    std::string text = fields.text(key);
    if (text.empty()) fields.refuse(key, "is empty");
    return text;
}

std::size_t place_in(JsonFields& fields) {
    constexpr double kMostLayers = 1e6;
    const double place = fields.number("place", 0, kMostLayers);
    if (std::floor(place) != place) fields.refuse("place", "is no whole number");
    return static_cast<std::size_t>(place);
}

struct OperationRow {
    const char* op;
    EditOperation (*read)(JsonFields& fields, const fs::path& folder);
};

const OperationRow kOperations[] = {
    {"select",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         Selector what = selector_in(f);
         return edits::Select{std::move(what), how_in(f)};
     }},
    {"invert", [](JsonFields&, const fs::path&) -> EditOperation { return edits::Invert{}; }},
    {"delete", [](JsonFields& f, const fs::path&) { return remove_in(f, false); }},
    {"keep", [](JsonFields& f, const fs::path&) { return remove_in(f, true); }},
    {"hide", [](JsonFields&, const fs::path&) -> EditOperation { return edits::Hide{}; }},
    {"show", [](JsonFields&, const fs::path&) -> EditOperation { return edits::Show{}; }},
    {"transform", [](JsonFields& f, const fs::path&) { return transform_in(f); }},
    {"add",
     [](JsonFields& f, const fs::path& folder) -> EditOperation {
         return edits::Add{file_from(folder, some_text(f, "file")), f.text_or("name", "")};
     }},
    {"duplicate",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::Duplicate{f.text_or("layer", ""), f.text_or("name", "")};
     }},
    {"show_layer",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::ShowLayer{some_text(f, "layer"), true};
     }},
    {"hide_layer",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::ShowLayer{some_text(f, "layer"), false};
     }},
    {"rename_layer",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::RenameLayer{some_text(f, "layer"), some_text(f, "name")};
     }},
    {"place_layer",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::PlaceLayer{some_text(f, "layer"), place_in(f)};
     }},
    {"delete_layer",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::RemoveLayer{some_text(f, "layer")};
     }},
    {"merge_layers",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::MergeLayers{some_text(f, "layer"), some_text(f, "with")};
     }},
    {"unit",
     [](JsonFields& f, const fs::path&) -> EditOperation {
         return edits::StateUnit{f.number("metres_per_unit", 0, kMost)};
     }},
    {"ground", [](JsonFields& f, const fs::path&) { return ground_in(f); }},
};

EditOperation operation_in(JsonFields fields, const fs::path& folder) {
    const std::string op = fields.text("op");
    std::string known;
    for (const OperationRow& row : kOperations) {
        if (op == row.op) {
            EditOperation operation = row.read(fields, folder);
            fields.done();
            return operation;
        }
        known += std::string(known.empty() ? "" : ", ") + row.op;
    }
    fields.refuse("op", fmt::format("is '{}', and there are {}", printable(op), known));
}

}  // namespace

json json_of(const Similarity& s) {
    return {{"scale", s.scale}, {"turn", json_of(s.turn)}, {"move", json_of(s.translation)}};
}

Similarity similarity_in(JsonFields fields) {
    const Similarity s = read_similarity(fields);
    fields.done();
    return s;
}

std::string name_from(const fs::path& folder, const fs::path& file) {
    std::error_code none;
    const fs::path whole = fs::absolute(file, none).lexically_normal();
    const fs::path from = fs::absolute(folder.empty() ? fs::path(".") : folder, none);
    const fs::path relative = whole.lexically_relative(from.lexically_normal());
    return relative.empty() ? whole.generic_string() : relative.generic_string();
}

fs::path file_from(const fs::path& folder, const std::string& name) {
    return (folder / fs::path(name)).lexically_normal();
}

json json_of_edits(const std::vector<EditOperation>& operations, const fs::path& folder) {
    json list = json::array();
    for (const EditOperation& operation : operations)
        list.push_back(json_of_operation(operation, folder));
    return list;
}

std::vector<EditOperation> edits_of_json(const json& list, const std::string& where,
                                         const std::string& hint, const fs::path& folder) {
    std::vector<EditOperation> operations;
    for (const json& entry : list) {
        const std::string place = fmt::format("{}: edits[{}]", where, operations.size());
        operations.push_back(operation_in(JsonFields(entry, place, hint), folder));
    }
    return operations;
}

std::vector<EditOperation> parse_edit_script(std::string_view text, const std::string& where,
                                             const fs::path& folder) {
    const json whole = parse_json_text(text, where, kScriptHint);
    JsonFields fields(whole, where, kScriptHint);
    if (fields.number("darb_edits") != kScriptVersion)
        fields.refuse("darb_edits",
                      fmt::format("is not {}, the version that this darb knows", kScriptVersion));
    std::vector<EditOperation> operations =
        edits_of_json(fields.list("edits"), where, kScriptHint, folder);
    fields.done();
    return operations;
}

std::string format_edit_script(const std::vector<EditOperation>& operations,
                               const fs::path& folder) {
    std::string text = fmt::format("{{\"darb_edits\": {}, \"edits\": [", kScriptVersion);
    for (std::size_t i = 0; i < operations.size(); ++i)
        text += (i > 0 ? ",\n  " : "\n  ") + json_of_operation(operations[i], folder).dump();
    return text + "\n]}\n";
}

std::vector<EditOperation> read_edit_script(const fs::path& file) {
    return parse_edit_script(read_text_file(file), file.string(), file.parent_path());
}

void write_edit_script(const fs::path& file, const std::vector<EditOperation>& operations) {
    try {
        write_file_atomic(file, format_edit_script(operations, file.parent_path()));
    } catch (const json::exception&) {  // the only text that JSON cannot hold
        throw Error(file.string(), "names a file or a layer whose name is not UTF-8", "Rename it.");
    }
}

namespace {

constexpr const char* kSelectorHint =
    "Use all, sphere:X,Y,Z,RADIUS, box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ, opacity:LOW,HIGH, "
    "size:LOW,HIGH, colour:R,G,B,WITHIN, isolated:SHARE, haze:OPACITY,SIZE or layer:NAME.";

json numbers_of_text(const std::string& where, const std::string& text) {
    json list = json::array();
    const char *at = text.data(), *end = at + text.size();
    while (at <= end) {
        double value = 0;
        const auto [rest, error] = parse_number(at, end, value);
        if (error != std::errc{} || !std::isfinite(value) || (rest != end && *rest != ','))
            throw Error(where, "is not a list of numbers", kSelectorHint);
        list.push_back(value);
        at = rest + 1;
    }
    return list;
}

// From the numbers of a word to the keys of a script, so that limits and messages are the same.
json keys_of_word(const std::string& where, const std::string& kind, const json& n) {
    const auto wants = [&](std::size_t count) {
        if (n.size() != count)
            throw Error(where,
                        fmt::format("has {} numbers, and {} takes {}", n.size(), kind, count),
                        kSelectorHint);
    };
    const auto vec = [&](std::size_t at) {
        return glm::dvec3(n[at].get<double>(), n[at + 1].get<double>(), n[at + 2].get<double>());
    };
    json keys{{"by", kind}};
    if (kind == "sphere") {
        wants(4);
        keys["centre"] = json_of(vec(0));
        keys["radius"] = n[3];
    } else if (kind == "box") {
        wants(6);
        keys["centre"] = json_of((vec(0) + vec(3)) / 2.0);
        keys["half_size"] = json_of((vec(3) - vec(0)) / 2.0);
    } else if (kind == "opacity" || kind == "size") {
        wants(2);
        keys["low"] = n[0];
        keys["high"] = n[1];
    } else if (kind == "colour") {
        wants(4);
        keys["colour"] = json_of(vec(0));
        keys["within"] = n[3];
    } else if (kind == "isolated") {
        wants(1);
        keys["share"] = n[0];
    } else if (kind == "haze") {
        wants(2);
        keys["opacity"] = n[0];
        keys["size"] = n[1];
    } else {
        throw Error(where, "names no way to select", kSelectorHint);
    }
    return keys;
}

}  // namespace

Selector selector_from_text(const std::string& option, const std::string& text) {
    const std::string where = option + " " + text;
    if (text == "all") return by::Everything{};
    const std::size_t colon = text.find(':');
    if (colon == text.npos) throw Error(where, "names no way to select", kSelectorHint);
    const std::string kind = text.substr(0, colon), rest = text.substr(colon + 1);
    if (kind == "layer") return by::Layer{rest};
    const json keys = keys_of_word(where, kind, numbers_of_text(where, rest));
    JsonFields fields(keys, where, kSelectorHint);
    return selector_in(fields);
}

}  // namespace darb
