// SPDX-License-Identifier: MIT
#include "engine/scene/region.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/parse_number.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/subject.h"

namespace darb {

namespace {

constexpr double kRoomAroundSubject = 1.25;
constexpr double kUpright = 0.1;  // cosine between a polygon's normal and up: it stands upright

struct RegionWords {
    std::string kind;
    std::vector<double> numbers;
};

RegionWords words_of(const std::string& option, const std::string& text) {
    const std::string::size_type colon = text.find(':');
    RegionWords words{text.substr(0, colon), {}};
    const std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    const std::string place = option + " " + words.kind;
    if (words.kind == "subject") {
        words.numbers = {kRoomAroundSubject};
        if (colon != std::string::npos) words.numbers = numbers_from(place, rest, 1);
    } else if (words.kind == "sphere") {
        words.numbers = numbers_from(place, rest, 4);
    } else if (words.kind == "box") {
        words.numbers = numbers_from(place, rest, 6);
    } else if (words.kind == "polygon") {
        const std::optional<std::vector<double>> list = number_list(rest);
        if (!list || list->size() < 11 || (list->size() - 2) % 3 != 0)
            throw Error(place, fmt::format("'{}' is not two heights and three corners", rest),
                        "Give LOW,HIGH and X,Y,Z of at least three corners, with commas and "
                        "without spaces.");
        words.numbers = *list;
    } else {
        throw Error(option + " " + text, "is no region",
                    "Give subject, subject:1.5 (times its radius), sphere:X,Y,Z,RADIUS, "
                    "box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ or "
                    "polygon:LOW,HIGH,X,Y,Z,X,Y,Z,X,Y,Z.");
    }
    return words;
}

void refuse_empty(const std::string& option, const std::string& text, const RegionWords& words) {
    const std::vector<double>& n = words.numbers;
    bool holds = true;
    if (words.kind == "box") holds = n[0] < n[3] && n[1] < n[4] && n[2] < n[5];
    if (words.kind == "sphere" || words.kind == "subject") holds = n.back() > 0;
    if (words.kind == "polygon") holds = n[0] < n[1];
    if (!holds)
        throw Error(option + " " + text, "holds nothing",
                    "Sizes must be above 0, and each least number below its largest.");
}

/// Twice the area of a polygon of the ground, along its normal: Newell's method.
glm::dvec3 area_of(const std::vector<glm::dvec3>& corners) {
    glm::dvec3 area(0.0);
    for (std::size_t i = 0; i < corners.size(); ++i)
        area += glm::cross(corners[i] - corners[0], corners[(i + 1) % corners.size()] - corners[0]);
    return area;
}

Prism prism_from(const std::string& place, const std::vector<double>& n, const glm::dvec3& up) {
    Prism prism;
    prism.low = n[0];
    prism.high = n[1];
    std::vector<glm::dvec3> corners;
    double around2 = 0;
    for (std::size_t i = 2; i < n.size(); i += 3) {
        corners.emplace_back(n[i], n[i + 1], n[i + 2]);
        prism.at += corners.back();
        const glm::dvec3 d = corners.back() - corners[0];
        around2 = std::max(around2, glm::dot(d, d));
    }
    prism.at /= static_cast<double>(corners.size());
    const glm::dvec3 area = area_of(corners);
    if (!(glm::length(area) > 1e-9 * around2))
        throw Error(place, "its corners lie on one line", "Name corners around an area.");
    prism.up = glm::normalize(area);
    const double leans = glm::dot(prism.up, up);
    if (std::abs(leans) < kUpright)
        throw Error(place,
                    fmt::format("its corners stand upright, as up is {:.3f},{:.3f},{:.3f}", up.x,
                                up.y, up.z),
                    "Name corners on the ground, or give a box.");
    if (leans < 0) prism.up = -prism.up;
    const glm::dvec3 side = corners[1] - corners[0];
    const glm::dvec3 level = side - glm::dot(side, prism.up) * prism.up;
    prism.u = glm::normalize(glm::length(level) > 0 ? level : corners[2] - corners[0]);
    prism.v = glm::cross(prism.up, prism.u);
    for (const glm::dvec3& corner : corners)
        prism.corners.emplace_back(glm::dot(corner - prism.at, prism.u),
                                   glm::dot(corner - prism.at, prism.v));
    return prism;
}

}  // namespace

bool Prism::contains(const glm::dvec3& p) const {
    const glm::dvec3 d = p - at;
    const double height = glm::dot(d, up), x = glm::dot(d, u), y = glm::dot(d, v);
    if (!(height >= low && height <= high)) return false;
    bool inside = false;
    for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
        const glm::dvec2 &a = corners[i], &b = corners[j];
        if ((a.y > y) != (b.y > y) && x < a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y))
            inside = !inside;
    }
    return inside;
}

bool Region::contains(const glm::dvec3& p) const {
    if (shape == Shape::prism) return prism.contains(p);
    const glm::dvec3 d = p - centre;
    if (shape == Shape::sphere) return glm::dot(d, d) <= half_size.x * half_size.x;
    return std::abs(d.x) <= half_size.x && std::abs(d.y) <= half_size.y &&
           std::abs(d.z) <= half_size.z;
}

std::vector<std::uint8_t> splats_outside(const Region& region, const SplatModel& model) {
    std::vector<std::uint8_t> outside(model.size());
    for (std::size_t i = 0; i < outside.size(); ++i)
        outside[i] = region.contains(position_of(model, i)) ? 0 : 1;
    return outside;
}

void check_region(const std::string& option, const std::string& text) {
    refuse_empty(option, text, words_of(option, text));
}

Region region_from(const std::string& option, const std::string& text, const SplatModel& model,
                   std::span<const Camera> cameras) {
    const RegionWords words = words_of(option, text);
    refuse_empty(option, text, words);
    const std::vector<double>& n = words.numbers;
    if (words.kind == "sphere")
        return {Region::Shape::sphere, {n[0], n[1], n[2]}, glm::dvec3(n[3])};
    if (words.kind == "box") {
        const glm::dvec3 low(n[0], n[1], n[2]), high(n[3], n[4], n[5]);
        return {Region::Shape::box, (low + high) / 2.0, (high - low) / 2.0};
    }
    if (words.kind == "polygon") {
        Region region;
        region.shape = Region::Shape::prism;
        const std::optional<glm::dvec3> up = up_of_cameras(cameras);
        region.prism = prism_from(option + " polygon", n, up ? *up : guess_up(model));
        return region;
    }
    const Subject subject = subject_of(model, cameras);
    if (subject.around)
        throw Error(option + " " + text, "the cameras look outwards, at no subject",
                    "Give a box, a sphere or a polygon.");
    return {Region::Shape::sphere, subject.centre, glm::dvec3(n[0] * subject.radius)};
}

std::string region_text(const Region& region) {
    const auto list = [](const glm::dvec3& p) { return fmt::format("{},{},{}", p.x, p.y, p.z); };
    const glm::dvec3 &c = region.centre, &h = region.half_size;
    if (region.shape == Region::Shape::sphere) return fmt::format("sphere:{},{}", list(c), h.x);
    if (region.shape == Region::Shape::box)
        return fmt::format("box:{},{}", list(c - h), list(c + h));
    const Prism& prism = region.prism;
    std::string text = fmt::format("polygon:{},{}", prism.low, prism.high);
    for (const glm::dvec2& corner : prism.corners)
        text += "," + list(prism.at + corner.x * prism.u + corner.y * prism.v);
    return text + " up:" + list(prism.up);
}

}  // namespace darb
