// SPDX-License-Identifier: MIT
#include "engine/data/gps.h"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/parse_number.h"
#include "engine/core/quantile.h"
#include "engine/core/rng.h"
#include "engine/data/image_io.h"

namespace darb {

namespace {

using glm::dmat3;
using glm::dvec3;

constexpr double kEarthRadius = 6378137.0;              // WGS 84: of the equator, metres
constexpr double kEccentricity2 = 6.69437999014132e-3;  // squared
constexpr std::size_t kFewestPositions = 4;
constexpr double kInliers = 3;           // times the median distance
constexpr double kLeastWidth = 0.02;     // of the length of a path: narrower is a line
constexpr double kTooCoarse = 0.2;       // of the reach
constexpr double kContradiction = 0.15;  // of two scales, in natural logarithms
constexpr std::size_t kPhotoHead = 1 << 17;
constexpr double kDroneApart = 10;  // metres on the ground, between EXIF and XMP

// Earth-centred, earth-fixed, metres.
dvec3 on_earth(const GeoPosition& p) {
    const double latitude = glm::radians(p.latitude), longitude = glm::radians(p.longitude);
    const double s = std::sin(latitude), c = std::cos(latitude);
    const double normal = kEarthRadius / std::sqrt(1 - kEccentricity2 * s * s);
    return {(normal + p.altitude) * c * std::cos(longitude),
            (normal + p.altitude) * c * std::sin(longitude),
            (normal * (1 - kEccentricity2) + p.altitude) * s};
}

/// to = scale * rotation * from + offset.
struct Fit {
    double scale = 0;
    dmat3 rotation{1.0};
    dvec3 offset{0.0};
    dvec3 operator()(const dvec3& from) const { return scale * (rotation * from) + offset; }
};

// Least squares (Umeyama 1991).
Fit fit_similarity(const std::vector<dvec3>& from, const std::vector<dvec3>& to) {
    const auto matrix = [](const std::vector<dvec3>& points) {
        return Eigen::Map<const Eigen::Matrix3Xd>(&points[0].x, 3,
                                                  static_cast<Eigen::Index>(points.size()));
    };
    const Eigen::Matrix4d best = Eigen::umeyama(matrix(from), matrix(to));
    Fit fit;
    fit.scale = best.block<3, 1>(0, 0).norm();
    if (!(fit.scale > 0)) return {};  // all points are one
    for (glm::length_t c = 0; c < 3; ++c)
        for (glm::length_t r = 0; r < 3; ++r) fit.rotation[c][r] = best(r, c) / fit.scale;
    fit.offset = {best(0, 3), best(1, 3), best(2, 3)};
    return fit;
}

double median_off(const Fit& fit, std::span<const dvec3> from, const std::vector<dvec3>& to) {
    std::vector<double> off;
    for (std::size_t i = 0; i < to.size(); ++i) off.push_back(glm::distance(fit(from[i]), to[i]));
    return nearest_rank(off, 0.5);
}

/// How wide points are across the line through them, as a share of how long they are.
double width_of(const std::vector<dvec3>& points) {
    dvec3 middle(0.0), along(0.0);
    for (const dvec3& p : points) middle += p / double(points.size());
    for (const dvec3& p : points)
        if (glm::length(p - middle) > glm::length(along)) along = p - middle;
    const double length = glm::length(along);
    if (!(length > 0)) return 0;
    double width = 0;
    for (const dvec3& p : points)
        width = std::max(width, glm::length(glm::cross(p - middle, along / length)));
    return width / length;
}

Fit robust_fit(std::span<const dvec3> centres, const std::vector<dvec3>& metres) {
    constexpr int kTries = 200;
    Fit best = fit_similarity({centres.begin(), centres.end()}, metres);
    double least = median_off(best, centres, metres);
    Pcg32 rng(1);
    for (int t = 0; t < kTries && centres.size() > kFewestPositions; ++t) {
        std::vector<dvec3> from, to;
        for (int k = 0; k < 4; ++k) {
            const std::size_t i = rng.below(static_cast<std::uint32_t>(centres.size()));
            from.push_back(centres[i]);
            to.push_back(metres[i]);
        }
        const Fit fit = fit_similarity(from, to);
        const double off = median_off(fit, centres, metres);
        if (fit.scale > 0 && off < least) {
            least = off;
            best = fit;
        }
    }
    return best;
}

/// The number of an attribute or element of the drone's XMP.
std::optional<double> drone_number(std::string_view file, std::string_view name) {
    const std::string whole = fmt::format("drone-dji:{}", name);
    for (std::size_t at = file.find(whole); at != std::string_view::npos;
         at = file.find(whole, at + 1)) {
        std::string_view rest = file.substr(at + whole.size());
        if (rest.starts_with("=\"") || rest.starts_with("='"))
            rest.remove_prefix(2);
        else if (rest.starts_with('>'))
            rest.remove_prefix(1);
        else
            continue;  // the end of an element, or a longer name
        if (rest.starts_with('+')) rest.remove_prefix(1);
        double value = 0;
        const auto [end, error] = parse_number(rest.data(), rest.data() + rest.size(), value);
        const bool ends =
            end != rest.data() + rest.size() && (*end == '"' || *end == '\'' || *end == '<');
        if (error == std::errc() && ends && std::isfinite(value)) return value;
    }
    return std::nullopt;
}

/// The positions of a data set's photos, and how many of them have two that disagree.
struct PhotoPositions {
    std::vector<dvec3> centres;
    std::vector<GeoPosition> positions;
    std::size_t apart = 0;
};

PhotoPositions photo_positions(const Dataset& dataset) {
    PhotoPositions found;
    std::filesystem::path last;
    for (const View& view : dataset.views) {
        if (view.photo == last || view.photo.empty()) continue;  // faces of one panorama
        last = view.photo;
        std::error_code none;
        if (!std::filesystem::is_regular_file(view.photo, none)) continue;
        const auto head = read_file_head(view.photo, kPhotoHead);
        const auto exif = exif_position(head), drone = drone_position(head);
        if (!exif && !drone) continue;
        found.centres.push_back(view.camera.centre());
        found.positions.push_back(exif ? *exif : *drone);
        if (!exif || !drone) continue;
        const dvec3 between = east_north_up(*drone, *exif);
        if (std::hypot(between.x, between.y) > kDroneApart) ++found.apart;
    }
    return found;
}

}  // namespace

std::optional<GeoPosition> drone_position(std::span<const std::byte> file) {
    const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
    if (text.find("drone-dji:") == std::string_view::npos) return std::nullopt;
    const auto latitude = drone_number(text, "GpsLatitude");
    auto longitude = drone_number(text, "GpsLongitude");
    if (!longitude) longitude = drone_number(text, "GpsLongtitude");
    auto altitude = drone_number(text, "AbsoluteAltitude");
    if (!altitude) altitude = drone_number(text, "RelativeAltitude");
    if (!latitude || !longitude || !altitude) return std::nullopt;
    if (std::abs(*latitude) > 90 || std::abs(*longitude) > 180) return std::nullopt;
    if (*latitude == 0 && *longitude == 0) return std::nullopt;  // no fix
    return GeoPosition{*latitude, *longitude, *altitude};
}

dvec3 east_north_up(const GeoPosition& position, const GeoPosition& origin) {
    const dvec3 d = on_earth(position) - on_earth(origin);
    const double latitude = glm::radians(origin.latitude),
                 longitude = glm::radians(origin.longitude);
    const double sa = std::sin(latitude), ca = std::cos(latitude);
    const double so = std::sin(longitude), co = std::cos(longitude);
    return {-so * d.x + co * d.y, -sa * co * d.x - sa * so * d.y + ca * d.z,
            ca * co * d.x + ca * so * d.y + sa * d.z};
}

std::optional<FoundPlace> place_by_positions(std::span<const dvec3> centres,
                                             std::span<const GeoPosition> positions) {
    if (centres.size() != positions.size())
        throw Error("positions", "there are not as many as cameras", "Give one for each camera.");
    if (centres.size() < kFewestPositions) return std::nullopt;
    GeoPosition origin;
    std::vector<double> latitudes, longitudes, altitudes;
    for (const GeoPosition& p : positions) {
        latitudes.push_back(p.latitude);
        longitudes.push_back(p.longitude);
        altitudes.push_back(p.altitude);
    }
    origin = {nearest_rank(latitudes, 0.5), nearest_rank(longitudes, 0.5),
              nearest_rank(altitudes, 0.5)};
    std::vector<dvec3> metres;
    for (const GeoPosition& p : positions) metres.push_back(east_north_up(p, origin));
    Fit fit = robust_fit(centres, metres);
    FoundPlace found;
    for (int round = 0; round < 3; ++round) {  // again with those that fit
        const double limit = kInliers * median_off(fit, centres, metres);
        std::vector<dvec3> from, to;
        for (std::size_t i = 0; i < metres.size(); ++i)
            if (glm::distance(fit(centres[i]), metres[i]) <= limit) {
                from.push_back(centres[i]);
                to.push_back(metres[i]);
            }
        if (from.size() < kFewestPositions || width_of(from) < kLeastWidth) return std::nullopt;
        fit = fit_similarity(from, to);
        found.used = from.size();
    }
    if (!(fit.scale > 0) || !std::isfinite(fit.scale)) return std::nullopt;
    found.metres_per_unit = fit.scale;
    found.off = median_off(fit, centres, metres);
    std::vector<double> reach;
    for (const dvec3& p : metres) reach.push_back(glm::length(p));
    found.reach = nearest_rank(reach, 0.5);
    found.place = {origin.latitude, origin.longitude, origin.altitude, fit.rotation, fit.offset};
    return found;
}

void find_place(Dataset& dataset) {
    const auto [centres, positions, apart] = photo_positions(dataset);
    if (positions.empty()) return;
    if (apart > 0)
        dataset.notes.push_back(fmt::format(
            "Warning: in {} photos the positions in EXIF and in the drone's XMP lie more "
            "than {} m apart. The EXIF counts.",
            apart, kDroneApart));
    if (positions.size() < kFewestPositions) {
        dataset.notes.push_back(
            fmt::format("The GPS positions of {} photos are too few to tell the scene's scale; {} "
                        "with altitudes are needed.",
                        positions.size(), kFewestPositions));
        return;
    }
    const std::optional<FoundPlace> found = place_by_positions(centres, positions);
    if (!found) {
        dataset.notes.push_back(
            "The photos' GPS positions do not tell the scene's scale: they lie on one line, or "
            "contradict each other.");
        return;
    }
    if (found->off > kTooCoarse * found->reach) {
        dataset.notes.push_back(fmt::format(
            "The photos' GPS positions are too coarse to tell the scene's scale: cameras are off "
            "by {:.1f} m, where they are spread over {:.1f} m.",
            found->off, found->reach));
        return;
    }
    dataset.place = found->place;
    std::string scale = "Scale, north";
    if (dataset.metres_per_unit > 0) {  // measured depths are more exact
        dvec3 middle(0.0);
        for (const dvec3& centre : centres) middle += centre / double(centres.size());
        dataset.place.offset +=
            (found->metres_per_unit - dataset.metres_per_unit) * (dataset.place.rotation * middle);
        scale = fmt::format("By the measured depths it is {:.4g} m, which counts. North",
                            dataset.metres_per_unit);
    } else {
        dataset.metres_per_unit = found->metres_per_unit;
    }
    const double ratio = found->metres_per_unit / dataset.metres_per_unit;
    dataset.notes.push_back(fmt::format(
        "{}By the GPS of {} photos a world unit is {:.4g} m; cameras are off by {:.2g} m (median). "
        "{} and place are saved with the scene.",
        std::abs(std::log(ratio)) > kContradiction ? "Warning: GPS and depths contradict. " : "",
        found->used, found->metres_per_unit, found->off, scale));
}

}  // namespace darb
