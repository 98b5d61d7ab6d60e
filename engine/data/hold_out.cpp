// SPDX-License-Identifier: MIT
#include "engine/data/hold_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <glm/glm.hpp>
#include <map>
#include <numeric>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/system_files.h"
#include "engine/data/dataset.h"

namespace darb {

namespace {

constexpr int kUsual = 8;
constexpr int kMost = 100'000;
// Where the axes of cameras are parallel, this weight pulls the point that they look at to their
// mean.
constexpr double kPull = 1e-3;
constexpr double kLeastUp = 1e-3;   // length of the mean of the cameras' up vectors: below this,
                                    // they have none in common
constexpr double kOnePlace = 1e-9;  // share of the distance to the origin (at least 1): closer
                                    // cameras stand in one place
constexpr double kTurn = 6.283185307179586;

glm::dvec3 row(const glm::dmat3& m, int r) {
    return {m[0][r], m[1][r], m[2][r]};
}

[[noreturn]] void refuse(std::string_view text, std::string_view word) {
    throw Error(fmt::format("--hold-out {}", text),
                fmt::format("'{}' is neither every:N nor arc:N with N of at least 2", word),
                "Use every:8, arc:8, or both: every:8,arc:8.");
}

/// The point nearest to all viewing axes.
glm::dvec3 looked_at(const std::vector<View>& views, const glm::dvec3& mean) {
    glm::dmat3 sum(kPull * double(views.size()));
    glm::dvec3 right = sum * mean;
    for (const View& view : views) {
        const glm::dvec3 axis = row(view.camera.rotation, 2);
        const glm::dmat3 across = glm::dmat3(1.0) - glm::outerProduct(axis, axis);
        sum += across;
        right += across * view.camera.centre();
    }
    return glm::inverse(sum) * right;
}

struct Ring {  // the frame in which angles are measured
    glm::dvec3 centre, right, ahead;
    bool one_place = false;  // the cameras stand in one place, and their viewing directions tell
                             // them apart
    double angle(const Camera& camera) const {
        const glm::dvec3 at = one_place ? row(camera.rotation, 2) : camera.centre() - centre;
        return std::atan2(glm::dot(at, ahead), glm::dot(at, right));
    }
};

Ring ring_of(const std::vector<View>& views) {
    glm::dvec3 mean(0.0), up(0.0);
    for (const View& view : views) {
        mean += view.camera.centre() / double(views.size());
        up -= row(view.camera.rotation, 1) / double(views.size());
    }
    double widest = 0;
    for (const View& view : views)
        widest = std::max(widest, glm::distance(view.camera.centre(), mean));
    Ring ring;
    ring.one_place = widest < kOnePlace * std::max(1.0, glm::length(mean));
    ring.centre = ring.one_place ? mean : looked_at(views, mean);
    // With cameras rolled to all sides, any axis will do.
    up = glm::length(up) > kLeastUp ? glm::normalize(up) : glm::dvec3(0, 0, 1);
    const glm::dvec3 other = std::abs(up.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    ring.right = glm::normalize(glm::cross(up, other));
    ring.ahead = glm::cross(up, ring.right);
    return ring;
}

}  // namespace

HoldOut parse_hold_out(std::string_view text) {
    HoldOut hold_out{0, 0};
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string_view word = text.substr(at, end - at);
        at = end + 1;
        const std::size_t colon = std::min(word.find(':'), word.size());
        int count = kUsual;
        if (colon < word.size()) {
            const char* const last = word.data() + word.size();
            const auto [stop, error] = std::from_chars(word.data() + colon + 1, last, count);
            if (error != std::errc{} || stop != last) refuse(text, word);
        }
        int* const part = word.substr(0, colon) == "every" ? &hold_out.every
                          : word.substr(0, colon) == "arc" ? &hold_out.arc
                                                           : nullptr;
        if (part == nullptr || *part != 0 || count < 2 || count > kMost) refuse(text, word);
        *part = count;
    }
    return hold_out;
}

std::string hold_out_text(const HoldOut& hold_out) {
    std::string text;
    if (hold_out.every > 0) text = fmt::format("every:{}", hold_out.every);
    if (hold_out.arc > 0) text += fmt::format("{}arc:{}", text.empty() ? "" : ",", hold_out.arc);
    return text;
}

std::vector<std::size_t> way_round(const std::vector<View>& views) {
    std::vector<std::size_t> order(views.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (views.empty()) return order;
    const Ring ring = ring_of(views);
    std::vector<double> angle;
    for (const View& view : views) angle.push_back(ring.angle(view.camera));
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return angle[a] < angle[b]; });
    std::size_t first = 0;
    double widest = kTurn + angle[order.front()] - angle[order.back()];
    for (std::size_t i = 1; i < order.size(); ++i)
        if (const double gap = angle[order[i]] - angle[order[i - 1]]; gap > widest) {
            widest = gap;
            first = i;
        }
    std::rotate(order.begin(), order.begin() + std::ptrdiff_t(first), order.end());
    return order;
}

namespace {

/// FNV-1a of the first `most` bytes of a file; 0 where it cannot be read.
std::uint64_t hash_of_file(const std::filesystem::path& path, std::uint64_t most) {
    std::ifstream file(path, std::ios::binary);
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    std::vector<char> part(1 << 16);
    while (most > 0 && file) {
        file.read(part.data(), std::streamsize(std::min<std::uint64_t>(most, part.size())));
        for (std::streamsize i = 0; i < file.gcount(); ++i)
            hash = (hash ^ static_cast<unsigned char>(part[std::size_t(i)])) * 0x100000001b3ULL;
        most -= std::uint64_t(file.gcount());
    }
    return file.bad() ? 0 : hash;
}

// Splits groups by a key of their members, and keeps those with more than one member.
template <typename Key>
std::vector<std::vector<std::size_t>> split(const std::vector<std::vector<std::size_t>>& groups,
                                            const Key& key_of) {
    std::vector<std::vector<std::size_t>> parts;
    for (const std::vector<std::size_t>& group : groups) {
        std::map<std::uint64_t, std::vector<std::size_t>> by_key;
        for (const std::size_t i : group) by_key[key_of(i)].push_back(i);
        for (auto& [key, part] : by_key)
            if (part.size() > 1) parts.push_back(std::move(part));
    }
    return parts;
}

// Names of the first of several views with one photo, for messages.
std::string some_names(const std::vector<View>& views, const std::vector<std::size_t>& first) {
    constexpr int kNamed = 3;
    std::string list;
    int named = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (first[i] == i) continue;
        if (named++ == kNamed) return list + ", ...";
        list += fmt::format("{}{} repeats {}", list.empty() ? "" : ", ", views[i].name,
                            views[first[i]].name);
    }
    return list;
}

/// Makes all views of a photo test views where one of them is.
std::string keep_together(std::vector<View>& views, const std::vector<std::size_t>& first) {
    std::vector<View> moved = views;
    for (const bool spread :
         {false, true})  // first from all views to the first of each photo, then from that to all
        for (std::size_t i = 0; i < moved.size(); ++i) {
            View& to = moved[spread ? i : first[i]];
            const View& from = moved[spread ? first[i] : i];
            to.in_arc = to.in_arc || from.in_arc;
            to.is_test = to.is_test || from.is_test;
        }
    std::size_t repeats = 0, held_out = 0;
    for (std::size_t i = 0; i < moved.size(); ++i)
        if (first[i] != i) ++repeats, held_out += moved[i].is_test ? 1 : 0;
    if (repeats == 0) return {};
    const std::string found =
        fmt::format("{} the photo of another view ({}).",
                    repeats == 1 ? "1 view repeats" : fmt::format("{} views repeat", repeats),
                    some_names(views, first));
    if (std::ranges::all_of(moved, &View::is_test) && !std::ranges::all_of(views, &View::is_test))
        return found +
               " Every photo that is trained on is held out as well, so what is measured on the "
               "held-out views is no measure of new views.";
    views = std::move(moved);
    return fmt::format(
        "{} Views of one photo stay on one side: {} of the repeats are held out, {} trained on.",
        found, held_out, repeats - held_out);
}

}  // namespace

std::vector<std::size_t> first_of_photo(const std::vector<View>& views) {
    constexpr std::uint64_t kHead = 1 << 16;  // this many bytes tell nearly all files apart
    std::vector<std::size_t> first(views.size());
    std::iota(first.begin(), first.end(), std::size_t{0});
    std::map<FileId, std::size_t> files;
    std::map<std::uint64_t, std::vector<std::size_t>> by_size;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const FileFacts facts = file_facts(views[i].photo);
        if (facts.kind != FileKind::regular) continue;
        const auto [known, is_new] = files.try_emplace(facts.id, i);
        if (is_new)
            by_size[facts.bytes].push_back(i);
        else
            first[i] = known->second;
    }
    std::vector<std::vector<std::size_t>> groups;
    for (auto& [size, group] : by_size)
        if (size > 0) groups.push_back(std::move(group));
    for (const std::uint64_t most : {kHead, ~std::uint64_t{0}})
        groups = split(groups, [&](std::size_t i) { return hash_of_file(views[i].photo, most); });
    for (const std::vector<std::size_t>& group : groups)
        for (const std::size_t i : group) first[i] = group.front();
    for (std::size_t& i : first) i = first[i];  // follow links to another name of a copy
    return first;
}

std::string mark_held_out(std::vector<View>& views, const HoldOut& hold_out) {
    const bool own_test = std::ranges::any_of(views, &View::is_test);
    const std::vector<std::size_t> photo = first_of_photo(views);
    if (hold_out.arc > 0 && views.size() > 1) {
        const std::vector<std::size_t> order = way_round(views);
        const std::size_t count = std::clamp<std::size_t>(
            (order.size() + std::size_t(hold_out.arc) / 2) / std::size_t(hold_out.arc), 1,
            order.size() - 1);
        const std::size_t first = (order.size() - count) / 2;
        for (std::size_t i = first; i < first + count; ++i)
            views[order[i]].is_test = views[order[i]].in_arc = true;
    }
    if (own_test || hold_out.every == 0) return keep_together(views, photo);
    std::size_t place = 0;
    std::vector<bool> in_arc(views.size(), false);
    for (std::size_t i = 0; i < views.size(); ++i)
        if (views[i].in_arc) in_arc[photo[i]] = true;
    for (std::size_t i = 0; i < views.size(); ++i)
        if (photo[i] == i && !in_arc[i] && place++ % std::size_t(hold_out.every) == 0)
            views[i].is_test = true;
    return keep_together(views, photo);
}

}  // namespace darb
