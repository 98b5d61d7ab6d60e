#include "tools/darb/scene_edits.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/scene/edit_splats.h"

namespace darb {

namespace {

/// "1,2,3" with exactly that many numbers.
std::vector<double> numbers(const std::string& option, const std::string& text, size_t count) {
    std::vector<double> values;
    const char *at = text.data(), *end = at + text.size();
    while (at <= end && values.size() <= count) {
        double value = 0;
        const auto [rest, error] = std::from_chars(at, end, value);
        if (error != std::errc{} || !std::isfinite(value) || (rest != end && *rest != ',')) break;
        values.push_back(value);
        at = rest + 1;
    }
    if (values.size() != count || at != end + 1)
        throw Error(option, fmt::format("'{}' is not {} numbers", text, count),
                    "Write them with commas and without spaces.");
    return values;
}

glm::dvec3 vector_of(const std::string& option, const std::string& text) {
    const std::vector<double> v = numbers(option, text, 3);
    return {v[0], v[1], v[2]};
}

/// up, then rotate, then scale, then translate.
Similarity similarity_of(const SceneEdits& edits) {
    Similarity similarity;
    similarity.scale = edits.scale;
    similarity.turn = turn_of_up_axis(edits.up);
    if (!edits.rotate.empty())
        similarity.turn = turn_of_degrees(vector_of("--rotate", edits.rotate)) * similarity.turn;
    if (!edits.translate.empty())
        similarity.translation = vector_of("--translate", edits.translate);
    return similarity;
}

// Whoever leaves out everything meant something else.
void report_dropped(std::FILE* say, const std::string& option, size_t count, size_t left) {
    if (count > 0 && left == 0)
        throw Error(option, fmt::format("keeps none of {} splats", count),
                    "`darb info` prints where the splats are and how opaque.");
    if (count > 0) tell(say, "{}: {} splats left out\n", option, count);
}

}  // namespace

void edit_scene(const SceneEdits& edits, SplatModel& model, std::FILE* say) {
    const Similarity similarity = similarity_of(edits);
    if (similarity.scale != 1 || similarity.turn != glm::dmat3(1.0) ||
        similarity.translation != glm::dvec3(0.0))
        transform_splats(similarity, model);
    if (!edits.crop.empty()) {
        const std::vector<double> v = numbers("--crop", edits.crop, 6);
        const size_t lost = crop_splats({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, model);
        report_dropped(say, "--crop " + edits.crop, lost, model.size());
    }
    if (edits.prune_opacity > 0) {
        const size_t lost = prune_opacity(edits.prune_opacity, model);
        report_dropped(say, fmt::format("--prune-opacity {}", edits.prune_opacity), lost,
                       model.size());
    }
    limit_sh_degree(edits.max_sh, model);
}

void add_edit_options(CLI::App& app, SceneEdits& edits) {
    app.add_option("--up", edits.up,
                   "axis of the input that points up: x y z -x -y -z; turned to -y")
        ->capture_default_str();
    app.add_option("--rotate", edits.rotate, "X,Y,Z degrees, about x, then y, then z");
    app.add_option("--scale", edits.scale, "factor")->check(CLI::PositiveNumber);
    app.add_option("--translate", edits.translate,
                   "X,Y,Z, after --up, --rotate and --scale, in this order");
    app.add_option("--crop", edits.crop,
                   "MINX,MINY,MINZ,MAXX,MAXY,MAXZ after all of these: centres to keep");
    app.add_option("--prune-opacity", edits.prune_opacity, "leave out splats below, 0 to 1")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--max-sh", edits.max_sh, "highest degree of view-dependent colour to keep")
        ->check(CLI::Range(0, 3));
}

}  // namespace darb
