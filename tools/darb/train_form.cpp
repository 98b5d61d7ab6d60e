// SPDX-License-Identifier: MIT
#include "tools/darb/train_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/kernels/kernel_registry.h"
#include "trainer/job/request_options.h"
#include "trainer/options/presets.h"
#include "trainer/options/strategy.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

// What everybody sees, in this order, in words for people.
struct FirstField {
    const char *name, *label;
    const char* typed = "";  // to begin with
    const char* usual = "";  // in place of the table's
};
constexpr FirstField kFirstFields[] = {
    {kDatasetField, "photos"},
    {kOutputField, "output folder"},
    {"--preset", "length", "good"},
    {"--iterations", "iterations"},
    {"--kernel", "kernel"},
    {"--max-splats", "most splats", "", "as many as the scene asks for"},
    {"--max-memory", "most memory", "", "what the device has; such as 800MB or 1.5GB"},
    {"--roi", "region"},
    {"--eval", "hold photos out", "on"},
};

// What a run in a window cannot have, or the form has in another way.
constexpr const char* kNoFields[] = {"--blocks", "--resume", "--allow-mixed", "--start-checkpoint"};

const FirstField* first_field(const std::string& name) {
    const auto at =
        std::ranges::find_if(kFirstFields, [&](const FirstField& f) { return name == f.name; });
    return at == std::end(kFirstFields) ? nullptr : &*at;
}

std::string plain_label(const std::string& name) {
    std::string label = name.substr(name.find_first_not_of('-'));
    std::ranges::replace(label, '-', ' ');
    return label;
}

void add_choices(const RequestOption& option, TrainField& field) {
    if (option.row.is_switch) {
        field.choices = {"on", "off"};
    } else if (field.name == "--preset") {
        field.usual = kRunPresets.back().name;
        for (const RunPreset& preset : kRunPresets) {
            field.choices.emplace_back(preset.name);
            field.notes.push_back(
                fmt::format("{}: {} iterations, photos of {} px at most", preset.summary,
                            count_text(std::uint64_t(preset.iterations)), preset.width));
        }
    } else if (field.name == "--kernel") {
        for (const int kernel : known_kernels()) field.choices.emplace_back(kernel_name(kernel));
    } else if (field.name == "--strategy") {
        for (const Strategy strategy : all_strategies())
            field.choices.emplace_back(strategy_name(strategy));
    } else if (field.name == "--roi") {
        field.choices = {"subject"};
        field.notes = {"what the cameras look at"};
    } else {
        const std::string_view words = option.words;
        for (std::size_t at = 0; at < words.size();) {
            const std::size_t end = std::min(words.find(',', at), words.size());
            field.choices.emplace_back(words.substr(at, end - at));
            at = end + 1;
        }
    }
    if (!field.choices.empty()) field.kind = TrainField::Kind::choice;
}

}  // namespace

std::vector<TrainField> train_fields() {
    std::vector<TrainField> first(std::size(kFirstFields)), fields;
    for (const RequestOption& option : request_options()) {
        if (*option.row.flags == '\0') continue;
        TrainField field;
        field.name = option_name(option.row);
        if (std::ranges::find(kNoFields, field.name) != std::end(kNoFields)) continue;
        field.label = plain_label(field.name);
        field.heading = option.row.group;
        field.help = option.row.help;
        field.usual = default_text(option.row);
        add_choices(option, field);
        const FirstField* const f = first_field(field.name);
        if (f == nullptr) {
            fields.push_back(std::move(field));
            continue;
        }
        field.label = f->label;
        field.heading.clear();
        field.typed = f->typed;
        if (*f->usual != '\0') field.usual = f->usual;
        if (field.name == kDatasetField) field.kind = TrainField::Kind::place;
        first[static_cast<std::size_t>(f - kFirstFields)] = std::move(field);
    }
    fields.insert(fields.begin(), std::make_move_iterator(first.begin()),
                  std::make_move_iterator(first.end()));
    return fields;
}

// Most reasons go on after what is wrong, such as "--iterations many": "is no number".
std::string complaint(const Error& e) {
    std::string text = e.reason;
    constexpr std::array kVerbs{"is ",    "has ",   "names ", "does ",
                                "holds ", "takes ", "lies ",  "cannot "};
    if (std::ranges::any_of(kVerbs, [&](const char* verb) { return text.starts_with(verb); }))
        text.insert(0, "This ");
    else if (!text.empty() && text[0] >= 'a' && text[0] <= 'z')
        text[0] = static_cast<char>(text[0] - 'a' + 'A');
    return text + "." + (e.hint.empty() ? "" : " " + e.hint);
}

void blame_field(const Error& e, TrainForm& form) {
    const TrainField *const photos = form.field(kDatasetField), *const output =
                                                                    form.field(kOutputField);
    TrainField* blamed = nullptr;
    for (TrainField& field :
         form.fields) {  // "--roi subject", "darb train --roi": the longest name
        const std::size_t at = e.where.find(field.name);
        const std::size_t end = at + field.name.size();
        if (at == std::string::npos || (end < e.where.size() && e.where[end] != ' ')) continue;
        if (blamed == nullptr || field.name.size() > blamed->name.size()) blamed = &field;
    }
    const auto lies_in = [&](const TrainField* place) {
        const std::string path = place->typed.empty() ? place->usual : place->typed;
        return !path.empty() && e.where.starts_with(path);
    };
    if (blamed == nullptr && lies_in(output)) blamed = form.field(kOutputField);
    if (blamed == nullptr && lies_in(photos)) blamed = form.field(kDatasetField);
    if (blamed != nullptr)
        blamed->error = complaint(e);
    else
        form.error = e.where + ": " + e.reason + "." + (e.hint.empty() ? "" : " " + e.hint);
}

TrainRequest judge_form(TrainForm& form) {
    TrainRequest request;
    form.error.clear();
    for (TrainField& field : form.fields) field.error.clear();
    for (const bool before_others : {true, false})
        for (const RequestOption& option : request_options()) {
            TrainField* const field =
                *option.row.flags == '\0' ? nullptr : form.field(option_name(option.row));
            if (field == nullptr || field->typed.empty() || option.before_others != before_others)
                continue;
            try {
                set_request_option(request, field->name, field->typed);
            } catch (const Error& e) {
                field->error = complaint(e);
            }
        }
    if (TrainField* const iterations = form.field("--iterations"))
        iterations->usual = count_text(static_cast<std::uint64_t>(request.train.iterations)) +
                            ", by the length above";
    if (form.has_error() || request.dataset.empty()) return request;
    try {
        complete_request(request);
        if (TrainField* const output = form.field(kOutputField))
            output->usual = request.output.string();
        require_places(request);
        if (!fs::exists(request.dataset))
            throw Error(request.dataset, "does not exist", "Check the path.");
    } catch (const Error& e) {
        blame_field(e, form);
    }
    return request;
}

}  // namespace darb
