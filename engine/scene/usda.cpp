// SPDX-License-Identifier: MIT
// USD as text (.usda): a prim of the schema ParticleField3DGaussianSplat of UsdVol, which OpenUSD
// has from 26.03 on. Scales are lengths, opacities 0 to 1, rotations w x y z; harmonics are grouped
// by splat. Source: openusd.org, "ParticleField3DGaussianSplat", and pxr/usd/usdVol/schema.usda.
// A stage has y or z up, so scenes are given a half turn about x where y is up, as in glTF.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <iterator>
#include <map>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/core/text.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr const char* kUsdPrim = "ParticleField3DGaussianSplat";
constexpr const char* kUsdHarmonics = "radiance:sphericalHarmonicsCoefficients";
constexpr const char* kUsdDegree = "radiance:sphericalHarmonicsDegree";
constexpr double kUsdReach = 3;  // standard deviations that an extent takes in
constexpr std::size_t kMostUsdNesting = 256;

const glm::dmat3 kHalfTurnAboutX(1, 0, 0, 0, -1, 0, 0, 0, -1);

/// Half of the box that holds a splat, along the axes.
glm::dvec3 half_box(const SplatModel& model, std::size_t i) {
    const float *q = &model.rotation[4 * i], *s = &model.log_scale[3 * i];
    const double w = q[0], x = q[1], y = q[2], z = q[3], n = w * w + x * x + y * y + z * z;
    const glm::dmat3 axes(
        (w * w + x * x - y * y - z * z) / n, 2 * (x * y + w * z) / n, 2 * (x * z - w * y) / n,
        2 * (x * y - w * z) / n, (w * w - x * x + y * y - z * z) / n, 2 * (y * z + w * x) / n,
        2 * (x * z + w * y) / n, 2 * (y * z - w * x) / n, (w * w - x * x - y * y + z * z) / n);
    glm::dvec3 square(0.0);
    for (int k = 0; k < 3; ++k) {
        const glm::dvec3 axis = std::exp(double{drawn_log_scale(s[k])}) * axes[k];
        square += axis * axis;
    }
    return kUsdReach * glm::sqrt(square);
}

class UsdWriter {
  public:
    explicit UsdWriter(const SplatModel& model) : model_(model) {}

    std::string text() {
        put("#usda 1.0\n(\n    defaultPrim = \"Splats\"\n    doc = \"written by darb " DARB_VERSION
            "\"\n");
        if (model_.metres_per_unit > 0) put("    metersPerUnit = {}\n", model_.metres_per_unit);
        put("    upAxis = \"Y\"\n)\n\ndef {} \"Splats\"\n{{\n", kUsdPrim);
        put_extent();
        tuples("point3f[] positions", model_.size(), [&](std::size_t i) {
            const glm::dvec3 p = position_of(model_, i);
            tuple({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        });
        tuples("quatf[] orientations", model_.size(), [&](std::size_t i) {
            const float* q = &model_.rotation[4 * i];
            const float n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
            tuple({q[0] / n, q[1] / n, q[2] / n, q[3] / n});
        });
        tuples("float3[] scales", model_.size(), [&](std::size_t i) {
            const float* s = &model_.log_scale[3 * i];
            tuple({std::exp(drawn_log_scale(s[0])), std::exp(drawn_log_scale(s[1])),
                   std::exp(drawn_log_scale(s[2]))});
        });
        tuples("float[] opacities", model_.size(), [&](std::size_t i) {
            put("{}", static_cast<float>(sigmoid(double{model_.opacity_logit[i]})));
        });
        put("    uniform int {} = {}\n", kUsdDegree, model_.sh_degree);
        put_harmonics();
        put("}}\n");
        return std::move(text_);
    }

  private:
    template <class... Values>
    void put(fmt::format_string<Values...> format, Values&&... values) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
    }
    void tuple(std::initializer_list<float> values) {
        const char* before = "(";
        for (const float value : values) {
            put("{}{}", before, value);
            before = ", ";
        }
        text_ += ')';
    }
    template <class Put>
    void tuples(const char* name, std::size_t count, const Put& put_one) {
        put("    {} = [", name);
        for (std::size_t i = 0; i < count; ++i) {
            if (i > 0) text_ += ", ";
            put_one(i);
        }
        text_ += "]\n";
    }
    void put_extent() {
        if (model_.size() == 0) return;
        glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
        for (std::size_t i = 0; i < model_.size(); ++i) {
            low = glm::min(low, position_of(model_, i) - half_box(model_, i));
            high = glm::max(high, position_of(model_, i) + half_box(model_, i));
        }
        tuples("float3[] extent", 2, [&](std::size_t i) {
            const glm::dvec3& p = i == 0 ? low : high;
            tuple({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        });
    }
    void put_harmonics() {
        const auto rest = static_cast<std::size_t>(model_.rest_count()) / 3;
        tuples(fmt::format("float3[] {}", kUsdHarmonics).c_str(), model_.size() * (rest + 1),
               [&](std::size_t k) {
                   const std::size_t i = k / (rest + 1), c = k % (rest + 1);
                   const float* at =
                       c == 0 ? &model_.sh_dc[3 * i] : &model_.sh_rest[3 * (i * rest + c - 1)];
                   tuple({at[0], at[1], at[2]});
               });
    }

    const SplatModel& model_;
    std::string text_;
};

EncodedSplats encode_usda(const SplatModel& model, const std::string&, const EncodeOptions&) {
    check_splat_shapes(model);
    SplatModel turned = model;
    transform_splats({1, kHalfTurnAboutX, glm::dvec3(0.0)}, turned);
    const std::string text = UsdWriter(turned).text();
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return EncodedSplats{{bytes.begin(), bytes.end()}};
}

/// The words of a .usda file: names, punctuation, numbers and strings; comments are passed over.
class UsdReader {
  public:
    UsdReader(std::string_view text, const std::string& where) : text_(text), where_(where) {}

    bool at_end() {
        skip_blanks();
        return at_ >= text_.size();
    }
    /// "" at the end. A string comes with its quotes.
    std::string_view word() {
        skip_blanks();
        const std::size_t begin = at_;
        if (at_ >= text_.size()) return {};
        const char c = text_[at_];
        if (c == '"' || c == '\'') return string(c);
        if (c == '@' || c == '<') {
            const std::size_t end = text_.find(c == '@' ? '@' : '>', at_ + 1);
            if (end == std::string_view::npos) fail("has a path without an end");
            at_ = end + 1;
        } else if (is_name(c)) {
            while (at_ < text_.size() && is_name(text_[at_])) ++at_;
            if (text_.substr(at_, 2) == "[]") at_ += 2;
        } else {
            ++at_;
        }
        return text_.substr(begin, at_ - begin);
    }
    std::string_view peek() {
        const std::size_t before = at_;
        const std::string_view next = word();
        at_ = before;
        return next;
    }
    bool take(std::string_view wanted) {
        const std::size_t before = at_;
        if (word() == wanted) return true;
        at_ = before;
        return false;
    }
    void need(std::string_view wanted) {
        if (!take(wanted)) fail(fmt::format("has no {} there", wanted));
    }
    /// Passes over a value in brackets, or a single word.
    void skip_value() {
        std::size_t depth = 0;
        do {
            const std::string_view next = word();
            if (next.empty()) fail("ends within a value");
            if (next == "(" || next == "[" || next == "{") ++depth;
            if (next == ")" || next == "]" || next == "}") {
                if (depth == 0) fail("closes a bracket that is not open");
                --depth;
            }
        } while (depth > 0);
    }
    /// Numbers of an array whose elements have so many in round brackets; 1: none.
    std::vector<float> array(std::size_t width) {
        std::vector<float> values;
        need("[");
        while (!take("]")) {
            if (width > 1) need("(");
            for (std::size_t k = 0; k < width; ++k) {
                if (k > 0) need(",");
                values.push_back(static_cast<float>(number()));
            }
            if (width > 1) need(")");
            if (!take(",") && peek() != "]") fail("has no , between two values");
        }
        return values;
    }
    double number() {
        skip_blanks();
        double value = 0;
        const char* const begin = text_.data() + at_;
        const auto [end, error] = parse_number(begin, text_.data() + text_.size(), value);
        if (error != std::errc()) fail("has no number there");
        at_ += static_cast<std::size_t>(end - begin);
        return value;
    }
    [[noreturn]] void fail(const std::string& reason) const {
        const auto line =
            1 + std::count(text_.begin(),
                           text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())),
                           '\n');
        throw Error(fmt::format("{}, line {}", where_, line), reason, kCopyAgain);
    }

  private:
    static bool is_name(char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_' || c == ':' || c == '.' || c == '-' || c == '+';
    }
    void skip_blanks() {
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '#')
                at_ = std::min(text_.find('\n', at_), text_.size());
            else if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ';')
                ++at_;
            else
                return;
        }
    }
    std::string_view string(char quote) {
        const std::size_t begin = at_;
        const std::string three(3, quote);
        const bool is_long = text_.substr(at_, 3) == three;
        at_ += is_long ? 3 : 1;
        const std::string_view closing = is_long ? std::string_view(three) : text_.substr(begin, 1);
        while (at_ < text_.size() && text_.substr(at_, closing.size()) != closing)
            at_ += text_[at_] == '\\' ? 2 : 1;
        if (at_ >= text_.size()) fail("has a string without an end");
        at_ += closing.size();
        return text_.substr(begin, at_ - begin);
    }

    std::string_view text_;
    const std::string& where_;
    std::size_t at_ = 0;
};

/// What a stage says of its splats.
struct UsdStage {
    std::map<std::string, std::vector<float>> arrays;  // by attribute, of the one prim of splats
    int degree = 3;                                    // as the schema has it
    std::size_t prims = 0;                             // of splats
    std::string up = "Y";                              // as USD has it
    double metres_per_unit = 0;
    bool transforms = false;  // some prim is moved, turned or scaled
};

/// How many numbers an element has; 0: not an attribute of splats. The half-precision ones of the
/// same names end in h.
std::size_t usd_width(std::string_view attribute) {
    if (attribute.ends_with('h')) attribute.remove_suffix(1);
    if (attribute == "positions" || attribute == "scales" || attribute == kUsdHarmonics) return 3;
    if (attribute == "orientations") return 4;
    return attribute == "opacities" ? 1 : 0;
}

void read_usd_metadata(UsdReader& reader, UsdStage& stage) {
    reader.need("(");
    while (!reader.take(")")) {
        const std::string name(reader.word());
        if (name.empty()) reader.fail("ends within its metadata");
        if (!reader.take("=")) continue;  // a doc string
        if (name == "upAxis") {
            const std::string_view up = reader.word();
            if (up != "\"Y\"" && up != "\"Z\"")
                reader.fail("has an upAxis that is neither Y nor Z");
            stage.up = up.substr(1, 1);
        } else if (name == "metersPerUnit") {
            stage.metres_per_unit = reader.number();
        } else {
            reader.skip_value();
        }
    }
}

/// An attribute or a relationship, from the first of its words: qualifiers, type, name, value.
void read_usd_property(UsdReader& reader, bool of_splats, UsdStage& stage) {
    std::string name;
    while (reader.peek() != "=" && reader.peek() != "(" && reader.peek() != "}" &&
           !reader.at_end()) {
        name = reader.word();
        const std::string next(reader.peek());
        // The next property begins where a value is missing: a name is behind one type.
        if (usd_width(name) > 0 || name == kUsdDegree || next.empty()) break;
    }
    if (name == "xformOpOrder") stage.transforms = true;
    if (reader.take("=")) {
        const std::size_t width = of_splats ? usd_width(name) : 0;
        if (of_splats && name == kUsdDegree)
            stage.degree = static_cast<int>(std::clamp(reader.number(), -1.0, 100.0));
        else if (width > 0 && reader.peek() == "[")
            stage.arrays[name] = reader.array(width);
        else
            reader.skip_value();
    }
    if (reader.peek() == "(") reader.skip_value();
}

/// The prims and properties up to the closing bracket.
void read_usd_body(UsdReader& reader, bool of_splats, std::size_t depth, UsdStage& stage) {
    if (depth > kMostUsdNesting) reader.fail("is nested too deep");
    while (!reader.at_end()) {
        if (depth > 0 && reader.take("}")) return;
        const std::string_view next = reader.peek();
        if (next != "def" && next != "over" && next != "class") {
            read_usd_property(reader, of_splats, stage);
            if (depth == 0 && reader.peek() == "}")
                reader.fail("closes a bracket that is not open");
            continue;
        }
        reader.word();
        std::string type;
        while (!reader.peek().starts_with('"')) {
            type = reader.word();
            if (type.empty()) reader.fail("has a prim without a name");
        }
        reader.word();
        if (reader.peek() == "(") reader.skip_value();
        reader.need("{");
        const bool splats = type == kUsdPrim;
        if (splats) ++stage.prims;
        read_usd_body(reader, splats, depth + 1, stage);
    }
    if (depth > 0) reader.fail("ends before its last }");
}

/// The array of this attribute, else that of half precision, else `usual` for each of its splats.
std::vector<float> usd_values(const UsdStage& stage, const std::string& name, std::size_t count,
                              const std::vector<float>& usual) {
    const std::size_t width = usd_width(name);
    for (const std::string& one : {name, name + "h"})
        if (const auto found = stage.arrays.find(one);
            found != stage.arrays.end() && found->second.size() >= count * width) {
            std::vector<float> values = found->second;
            values.resize(count * width);
            return values;
        }
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) values.insert(values.end(), usual.begin(), usual.end());
    return values;
}

SplatModel model_of_stage(const UsdStage& stage) {
    const auto floats = stage.arrays.find("positions"), halves = stage.arrays.find("positionsh");
    const std::size_t count = (floats != stage.arrays.end() ? floats : halves)->second.size() / 3;
    SplatModel model;
    const auto coefficients = static_cast<std::size_t>((stage.degree + 1) * (stage.degree + 1));
    // As many as a degree has; without them a splat is grey.
    const std::vector<float> harmonics = usd_values(stage, kUsdHarmonics, count * coefficients, {});
    model.sh_degree = harmonics.empty() ? 0 : stage.degree;
    model.resize(count);
    model.position = usd_values(stage, "positions", count, {0, 0, 0});
    model.rotation = usd_values(stage, "orientations", count, {1, 0, 0, 0});
    const std::vector<float> scales = usd_values(stage, "scales", count, {1, 1, 1});
    const std::vector<float> opacities = usd_values(stage, "opacities", count, {1});
    const auto rest = static_cast<std::size_t>(model.rest_count()) / 3;
    for (std::size_t i = 0; i < count; ++i) {
        const double opacity = std::clamp(double{opacities[i]}, 0.0, 1.0);
        model.opacity_logit[i] =
            limit_infinite_logit(static_cast<float>(std::log(opacity) - std::log1p(-opacity)));
        for (std::size_t k = 0; k < 3; ++k) {
            const float scale = scales[3 * i + k];
            model.log_scale[3 * i + k] =
                scale == 0 ? -static_cast<float>(LOG_SCALE_LIMIT) : std::log(scale);
            if (harmonics.empty()) continue;
            model.sh_dc[3 * i + k] = harmonics[3 * i * (rest + 1) + k];
            for (std::size_t c = 0; c < rest; ++c)
                model.sh_rest[3 * (i * rest + c) + k] = harmonics[3 * (i * (rest + 1) + c + 1) + k];
        }
    }
    return model;
}

SplatModel load_usda(const SplatSource& source, SplatFile& file) {
    const std::string_view text(reinterpret_cast<const char*>(source.bytes.data()),
                                source.bytes.size());
    UsdReader reader(text, source.where);
    UsdStage stage;
    if (reader.peek() == "(") read_usd_metadata(reader, stage);
    read_usd_body(reader, false, 0, stage);
    if (stage.prims != 1)
        throw Error(source.where, fmt::format("has {} prims of the type {}", stage.prims, kUsdPrim),
                    "Name a layer with one; what it refers to in other files is not read.");
    if (stage.transforms)
        throw Error(source.where,
                    "moves, turns or scales its prims by xformOps, which are not read",
                    "Flatten the transforms into the positions, or export another format.");
    if (stage.degree < 0 || stage.degree > kMaxShDegree)
        throw Error(source.where,
                    fmt::format("has harmonics of degree {}; 0 to 3 are known", stage.degree),
                    "Export it with fewer harmonics.");
    if (!stage.arrays.contains("positions") && !stage.arrays.contains("positionsh"))
        throw Error(source.where, fmt::format("its {} has no positions", kUsdPrim),
                    "Export one moment of it: values by time (timeSamples) are not read.");
    file.details = "text, " + std::string(kUsdPrim);
    SplatModel model = model_of_stage(stage);
    if (stage.metres_per_unit > 0 && std::isfinite(stage.metres_per_unit))
        model.metres_per_unit = stage.metres_per_unit;
    file.dropped = drop_non_finite(model);
    if (stage.up == "Y")
        transform_splats({1, kHalfTurnAboutX, glm::dvec3(0.0)}, model);
    else
        file.up = "z";
    return model;
}

}  // namespace

const SplatFormatRow& usda_format() {
    static const SplatFormatRow row{
        .name = "USD text",
        .endings = {".usda"},
        .recognise = [](const SplatSource& source) { return starts_with(source.bytes, "#usda "); },
        .parse = load_usda,
        .encode = encode_usda,
        .keeps = kKeepsHarmonics | kKeepsUnit};
    return row;
}

}  // namespace darb
