#include "tools/darb/scene_edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/scene/edit_splats.h"
#include "tools/darb/numbers.h"
#include "tools/darb/outputs.h"

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

void edit_views(const SceneEdits& edits, std::vector<View>& views) {
    const Similarity similarity = similarity_of(edits);
    for (View& view : views) {
        Camera& camera = view.camera;  // distances grow with the scene: pictures stay the same
        camera.rotation = camera.rotation * glm::transpose(similarity.turn);
        camera.translation =
            similarity.scale * camera.translation - camera.rotation * similarity.translation;
    }
}

glm::dvec3 edited_axis(const SceneEdits& edits, const std::string& axis) {
    return similarity_of(edits).turn * glm::transpose(turn_of_up_axis(axis)) * glm::dvec3(0, -1, 0);
}

namespace {

void check_alike(const SplatModel& first, const SplatModel& other, const std::string& first_name,
                 const std::string& name) {
    if (other.kernel != first.kernel || other.footprint != first.footprint)
        throw Error(
            name,
            fmt::format("has the kernel {} ({}), and {} has {} ({}): one scene has one",
                        kernel_name(other.kernel), footprint_name(other.footprint), first_name,
                        kernel_name(first.kernel), footprint_name(first.footprint)),
            "Add --kernel gaussian, which turns each of them into its nearest Gaussians.");
    if (other.antialias != first.antialias)
        throw Error(
            name,
            fmt::format("has {}anti-aliasing (render mode mip), and {} has {}",
                        other.antialias ? "" : "no ", first_name, other.antialias ? "none" : "it"),
            "Merge scenes that were trained with the same render mode.");
}

/// The scene with harmonics of this degree, zeros above its own.
void raise_degree(int degree, SplatModel& model) {
    const auto from = static_cast<std::size_t>(model.rest_count());
    const std::size_t count = model.size();
    model.sh_degree = degree;
    const auto to = static_cast<std::size_t>(model.rest_count());
    std::vector<float> rest(count * to, 0);
    for (std::size_t i = 0; i < count; ++i)
        std::copy_n(model.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * from), from,
                    rest.begin() + static_cast<std::ptrdiff_t>(i * to));
    model.sh_rest = std::move(rest);
}

void append_positions(const SplatModel& model, std::vector<double>& to) {
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 p = position_of(model, i);
        to.insert(to.end(), {p.x, p.y, p.z});
    }
}

/// The largest distance on an axis between these positions and those of the model.
double most_rounded(const std::vector<double>& positions, const SplatModel& model) {
    double most = 0;
    for (std::size_t i = 0; i < model.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            most = std::max(most, std::abs(positions[3 * i + static_cast<std::size_t>(axis)] -
                                           position_of(model, i)[axis]));
    return most;
}

}  // namespace

SplatModel join_scenes(std::vector<SplatModel> scenes,
                       const std::vector<std::filesystem::path>& names) {
    DARB_CHECK(!scenes.empty() && scenes.size() == names.size(), "{} scenes, {} names",
               scenes.size(), names.size());
    int degree = 0;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        check_alike(scenes[0], scenes[i], names[0].string(), names[i].string());
        degree = std::max(degree, scenes[i].sh_degree);
    }
    std::vector<double> positions;
    bool one_origin = true;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
        if (scenes[i].sh_degree < degree) {
            say_note(fmt::format("note: {}: has harmonics of degree {}; those up to {} are zero",
                                 names[i].string(), scenes[i].sh_degree, degree));
            raise_degree(degree, scenes[i]);
        }
        append_positions(scenes[i], positions);
        one_origin = one_origin && scenes[i].origin == scenes[0].origin;
    }
    SplatModel joined = std::move(scenes[0]);
    for (std::size_t i = 1; i < scenes.size(); ++i)
        for (int a = 0; a < kAttributeCount; ++a) {
            std::vector<float>& to = attribute_values(joined, a);
            const std::vector<float>& from = attribute_values(scenes[i], a);
            to.insert(to.end(), from.begin(), from.end());
        }
    if (one_origin) return joined;
    set_positions(positions, joined);
    if (const double most = most_rounded(positions, joined); most > 0)
        say_note(
            fmt::format("note: the scenes lie far apart: positions are rounded by {:.2g} at "
                        "most, world units",
                        most));
    return joined;
}

void add_edit_options(CLI::App& app, SceneEdits& edits) {
    app.add_option("--up", edits.up,
                   "axis of the input that points up: x y z -x -y -z; turned to -y")
        ->capture_default_str();
    app.add_option("--rotate", edits.rotate, "X,Y,Z degrees, about x, then y, then z");
    app.add_option("--scale", edits.scale, "factor")->check(above_zero());
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
