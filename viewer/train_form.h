// SPDX-License-Identifier: MIT
// TrainForm: what a user types to train a scene in the window, and what is known of that run before
// it begins. The viewer draws it and knows no option of training: whoever owns the window makes the
// fields from the table of options, judges what was typed, and runs it (tools/darb/train_window.h).
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct TrainField {
    enum class Kind { text, choice, place };  // place: a file or a folder
    std::string name;                         // of the option: "--iterations"
    std::string label;                        // for people
    std::string heading;  // under which experts find it; empty: everybody sees it
    std::string help;
    std::string usual;  // what holds where nothing is typed; may be empty
    Kind kind = Kind::text;
    std::vector<std::string> choices;  // of Kind::choice, where other words may be taken, too
    std::vector<std::string> notes;    // what each choice means; may be empty
    std::string typed;                 // empty: as usual
    std::string error;                 // why that is not taken; empty: it is

    bool operator==(const TrainField&) const = default;
};

/// What is known of a run before it begins; empty: not yet.
struct TrainOutlook {
    std::vector<std::string> holds;     // what the data set has, line by line
    std::vector<std::string> forecast;  // splats, time and memory, likewise
    std::string looking;                // what is being found out; empty: nothing
};

struct TrainForm {
    std::vector<TrainField> fields;  // those for everybody first; empty: this window cannot train
    bool shown = false;
    int version = 0;    // grows with whatever is typed
    std::string error;  // that belongs to no field
    TrainOutlook outlook;
    bool starts = false;   // the user wants the run to begin
    bool cancels = false;  // the user wants to end it while it is prepared
    std::string stage;     // what a run does before its first iteration; empty: there is none
    bool runs = false;     // a run that this window began goes on; it ends with the window

    bool offered() const { return !fields.empty(); }
    bool has_error() const {
        return !error.empty() ||
               std::ranges::any_of(fields, [](const TrainField& f) { return !f.error.empty(); });
    }
    /// nullptr: there is none of that name.
    TrainField* field(std::string_view name) {
        const auto at = std::ranges::find(fields, name, &TrainField::name);
        return at == fields.end() ? nullptr : &*at;
    }
};

/// The names of the two fields that the viewer itself fills in.
inline constexpr const char *kDatasetField = "--source-path", *kOutputField = "--output";

}  // namespace darb
