#include "tools/darb/unit_flags.h"

#include <map>
#include <string>
#include <vector>

namespace darb {

namespace {

template <class Value>
void add_unit_option(CLI::App& command, const char* name, Value& to,
                     const std::map<std::string, Value>& words, const char* help) {
    std::vector<std::string> known;
    for (const auto& word : words) known.push_back(word.first);
    command
        .add_option_function<std::string>(
            name, [&to, words](const std::string& word) { to = words.at(word); }, help)
        ->check(CLI::IsMember(known))
        ->group("Files that store splats in another way than their format");
}

}  // namespace

void add_unit_options(CLI::App& command, StoredUnits& units, bool with_scales) {
    if (with_scales)
        add_unit_option<StoredScales>(
            command, "--scales", units.scales,
            {{"linear", StoredScales::linear}, {"logarithms", StoredScales::logarithms}},
            "what stands in the place of scales: lengths, or their logarithms");
    add_unit_option<StoredOpacities>(
        command, "--opacities", units.opacities,
        {{"linear", StoredOpacities::linear}, {"bytes", StoredOpacities::bytes}},
        "what stands in the place of logits: 0 to 1, or 0 to 255");
    add_unit_option<StoredColours>(command, "--colours", units.colours,
                                   {{"rgb", StoredColours::rgb}, {"bytes", StoredColours::bytes}},
                                   "what stands in the place of f_dc: red, green and blue, 0 to 1 "
                                   "or 0 to 255");
    add_unit_option<StoredRotations>(command, "--rotations", units.rotations,
                                     {{"xyzw", StoredRotations::xyzw}},
                                     "the last of the four numbers of a rotation comes first");
    add_unit_option<StoredOrder>(command, "--harmonics", units.harmonics,
                                 {{"swapped", StoredOrder::swapped}},
                                 "f_rest: the channels of a coefficient side by side; in formats "
                                 "that have them so, those of a channel");
}

}  // namespace darb
