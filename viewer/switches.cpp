#include "viewer/switches.h"

namespace darb {

std::string row_name(int row) {
    if (row == kAntialiasRow) return "anti-aliasing";
    return std::string(accuracy_settings()[static_cast<size_t>(row)].name);
}

std::vector<std::string> row_choices(int row, int sh_degree) {
    if (row == kAntialiasRow) return {"off", "on"};
    std::vector<std::string> names;
    if (row == kShDegree) {
        for (int degree = 0; degree <= sh_degree; ++degree) names.push_back(std::to_string(degree));
        return names;
    }
    if (row == kFootprint)
        return {std::string(footprint_name(Footprint::psi)),
                std::string(footprint_name(Footprint::exact))};
    for (const AccuracyChoice& choice : accuracy_settings()[static_cast<size_t>(row)].choices)
        names.emplace_back(choice.name);
    return names;
}

int chosen(int row, const DisplaySettings& display) {
    if (row == kAntialiasRow) return display.antialias ? 1 : 0;
    if (row == kShDegree) return display.sh_degree;
    if (row == kFootprint) return display.footprint == Footprint::exact ? 1 : 0;
    return display.accuracy.choice[static_cast<size_t>(row)];
}

void choose(int row, int choice, DisplaySettings& display) {
    if (row == kAntialiasRow)
        display.antialias = choice == 1;
    else if (row == kShDegree)
        display.sh_degree = choice;
    else if (row == kFootprint)
        display.footprint = choice == 1 ? Footprint::exact : Footprint::psi;
    else
        display.accuracy.choice[static_cast<size_t>(row)] = choice;
}

}  // namespace darb
