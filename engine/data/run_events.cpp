// SPDX-License-Identifier: MIT
#include "engine/data/run_events.h"

#include <fmt/format.h>

#include <limits>
#include <sstream>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace {

using EventJson = nlohmann::json;

constexpr const char* kLogRemedy =
    "Restore the file, or move it away: the run goes on from its checkpoint without it.";
constexpr const char* kMetricsRemedy =
    "Restore the file, or move it away: the run then ends once more from its checkpoint.";

enum class Kind { count, whole, number, truth, text, list, object };

struct Field {
    const char* key;
    Kind kind;
};

// JSON has null in place of NaN and infinity.
bool is_of(Kind kind, const EventJson& value) {
    switch (kind) {
        case Kind::count:
            return value.is_number_unsigned() &&
                   value.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
        case Kind::whole:
            return value.is_number_unsigned()
                       ? value.get<std::uint64_t>() <= std::numeric_limits<int>::max()
                       : value.is_number_integer() &&
                             value.get<std::int64_t>() >= std::numeric_limits<int>::min();
        case Kind::number:
            return value.is_number() || value.is_null();
        case Kind::truth:
            return value.is_boolean();
        case Kind::text:
            return value.is_string();
        case Kind::list:
            return value.is_array();
        case Kind::object:
            return value.is_object();
    }
    return false;
}

const char* name_of(Kind kind) {
    switch (kind) {
        case Kind::count:
            return "no count";
        case Kind::whole:
            return "no whole number";
        case Kind::number:
            return "no number";
        case Kind::truth:
            return "neither true nor false";
        case Kind::text:
            return "no text";
        case Kind::list:
            return "no list";
        case Kind::object:
            return "no object";
    }
    return "";
}

// Keys of all events; where one is missing, its reader takes a default.
constexpr Field kEventFields[] = {{"event", Kind::text},
                                  {"iteration", Kind::whole},
                                  {"seconds", Kind::number},
                                  {"loss", Kind::number},
                                  {"psnr_db", Kind::number},
                                  {"ssim", Kind::number},
                                  {"splats", Kind::count},
                                  {"passes_ms", Kind::object},
                                  {"views", Kind::list},
                                  {"divisor", Kind::whole},
                                  {"after", Kind::whole},
                                  {"degree", Kind::whole},
                                  {"gain_db", Kind::number},
                                  {"admitted", Kind::truth},
                                  {"limit", Kind::text},
                                  {"dataset", Kind::text},
                                  {"device", Kind::text},
                                  {"driver", Kind::text},
                                  {"strategy", Kind::text},
                                  {"settings", Kind::object},
                                  {"notes", Kind::list},
                                  {"effects", Kind::list},
                                  {"held_out_views", Kind::count},
                                  {"copy_bytes_per_s", Kind::number},
                                  {"fma_per_s", Kind::number},
                                  {"hold_out", Kind::text},
                                  {"arc", Kind::object}};
constexpr Field kViewFields[] = {{"name", Kind::text},
                                 {"psnr_db", Kind::number},
                                 {"ssim", Kind::number},
                                 {"in_arc", Kind::truth}};
constexpr Field kArcFields[] = {
    {"views", Kind::count}, {"psnr_db", Kind::number}, {"ssim", Kind::number}};
constexpr Field kEffectFields[] = {
    {"effect", Kind::text}, {"on", Kind::truth}, {"reason", Kind::text}};
constexpr Field kPassFields[] = {
    {"name", Kind::text}, {"ms", Kind::number}, {"roofline", Kind::number}};
constexpr Field kMetricsFields[] = {
    {"iteration", Kind::whole}, {"interrupted", Kind::truth},       {"seconds", Kind::number},
    {"splats", Kind::count},    {"passes_ms", Kind::list},          {"evaluations", Kind::list},
    {"start", Kind::object},    {"peak_device_bytes", Kind::number}};

class Checker {
  public:
    Checker(std::string where, const char* remedy) : where_(std::move(where)), remedy_(remedy) {}

    template <size_t Count>
    void fields(const EventJson& object, const Field (&list)[Count]) const {
        if (!object.is_object()) fail("is no JSON object");
        for (const Field& field : list)
            if (const auto at = object.find(field.key);
                at != object.end() && !is_of(field.kind, *at))
                fail(fmt::format("'{}' is {}: {}", field.key, name_of(field.kind), shown(*at)));
    }
    void event(const EventJson& event) const {
        fields(event, kEventFields);
        if (event.contains("views"))
            for (const EventJson& view : event["views"]) fields(view, kViewFields);
        if (event.contains("arc")) fields(event["arc"], kArcFields);
        if (event.contains("effects"))
            for (const EventJson& effect : event["effects"]) fields(effect, kEffectFields);
        if (event.contains("notes"))
            for (const EventJson& note : event["notes"])
                if (!note.is_string()) fail("'notes' holds " + shown(note) + ", which is no text");
        if (event.contains("passes_ms"))
            for (const auto& [name, ms] : event["passes_ms"].items())
                if (!is_of(Kind::number, ms))
                    fail(fmt::format("'passes_ms': '{}' is no number: {}", name, shown(ms)));
    }
    [[noreturn]] void fail(const std::string& what) const { throw Error(where_, what, remedy_); }

  private:
    static std::string shown(const EventJson& value) {
        std::string text = value.dump(-1, ' ', false, EventJson::error_handler_t::replace);
        constexpr size_t kLongest = 60;
        return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
    }

    std::string where_;
    const char* remedy_;
};

}  // namespace

std::vector<EventJson> read_events(const std::filesystem::path& path) {
    std::vector<EventJson> events;
    std::error_code none;
    if (!std::filesystem::exists(path, none)) return events;
    const std::string text = read_text_file(path);
    std::istringstream lines(text);
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        const Checker checker(fmt::format("{}, line {}", path.string(), number), kLogRemedy);
        EventJson event = EventJson::parse(line, nullptr, false);
        if (event.is_discarded() && lines.eof()) break;  // cut off when the run was killed
        checker.event(event);
        events.push_back(std::move(event));
    }
    return events;
}

EventJson read_metrics(const std::filesystem::path& path) {
    EventJson metrics = EventJson::parse(read_text_file(path), nullptr, false);
    const Checker checker(path.string(), kMetricsRemedy);
    if (metrics.is_discarded()) checker.fail("is no JSON");
    checker.fields(metrics, kMetricsFields);
    if (metrics.contains("evaluations"))
        for (const EventJson& evaluation : metrics["evaluations"]) checker.event(evaluation);
    if (metrics.contains("passes_ms"))
        for (const EventJson& pass : metrics["passes_ms"]) checker.fields(pass, kPassFields);
    if (metrics.contains("start")) checker.event(metrics["start"]);
    return metrics;
}

RunEnd read_run_end(const std::filesystem::path& path) {
    const EventJson metrics = read_metrics(path);
    return {metrics.value("iteration", 0), metrics.value("interrupted", true)};
}

}  // namespace darb
