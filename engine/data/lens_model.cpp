#include "engine/data/lens_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr std::string_view kPanorama = "EQUIRECTANGULAR";

struct ModelRow {
    std::string_view name;
    int parameters;  // 0: the model is not read
    bool one_focal;  // f, cx, cy rather than fx, fy, cx, cy
};

// By COLMAP's id.
constexpr ModelRow kModels[] = {
    {"SIMPLE_PINHOLE", 3, true},
    {"PINHOLE", 4, false},
    {"SIMPLE_RADIAL", 4, true},
    {"RADIAL", 5, true},
    {"OPENCV", 8, false},
    {"OPENCV_FISHEYE", 8, false},
    {"FULL_OPENCV", 12, false},
    {"FOV", 5, false},
    {"SIMPLE_RADIAL_FISHEYE", 4, true},
    {"RADIAL_FISHEYE", 5, true},
    {"THIN_PRISM_FISHEYE", 12, false},
    {"RAD_TAN_THIN_PRISM_FISHEYE", 0, false},
    {"SIMPLE_DIVISION", 0, true},
    {"DIVISION", 0, false},
    {"SIMPLE_FISHEYE", 3, true},
    {"FISHEYE", 4, false},
    {"EUCM", 0, false},
    {kPanorama, 0, false},
    {kFourRadial, 10, false},  // no id of COLMAP's
};

constexpr double kHalfPi = 1.5707963267948966;
constexpr int kMaxSize = 100000;      // px
constexpr double kSmallOmega = 1e-6;  // FOV is a pinhole below it

const ModelRow* find_model(std::string_view name) {
    for (const ModelRow& row : kModels)
        if (row.name == name) return &row;
    return nullptr;
}

const ModelRow& model_of(const LensModel& lens) {
    const ModelRow* row = find_model(lens.model);
    if (!row || static_cast<int>(lens.parameters.size()) != row->parameters)
        throw Error(
            "lens",
            fmt::format("{} with {} parameters is no model", lens.model, lens.parameters.size()),
            "check_lens tells what is wrong with it.");
    return *row;
}

std::string_view parameter_name(const ModelRow& row, std::size_t i) {
    constexpr std::string_view kOne[] = {"f", "cx", "cy"}, kTwo[] = {"fx", "fy", "cx", "cy"};
    if (i >= (row.one_focal ? 3 : 4)) return "of the distortion";
    return row.one_focal ? kOne[i] : kTwo[i];
}

}  // namespace

std::string_view lens_model_name(int id) {
    constexpr int kCount = std::size(kModels) - 1;  // without kFourRadial
    return id >= 0 && id < kCount ? kModels[id].name : std::string_view{};
}

int lens_parameter_count(std::string_view model) {
    const ModelRow* row = find_model(model);
    return row ? row->parameters : -1;
}

bool LensModel::distorted() const {
    const ModelRow& row = model_of(*this);
    if (model.ends_with("FISHEYE")) return true;
    if (model == "FOV") return std::abs(parameters[4]) > kSmallOmega;
    const auto first = parameters.begin() + (row.one_focal ? 3 : 4);
    return std::any_of(first, parameters.end(), [](double value) { return value != 0; });
}

void check_lens(const LensModel& lens, const std::string& where) {
    const ModelRow* row = find_model(lens.model);
    if (!row)
        throw Error(where, fmt::format("the camera model {} is unknown", lens.model),
                    "Export the cameras with one of COLMAP's models.");
    if (row->parameters == 0)
        throw Error(where, fmt::format("the camera model {} is not read", lens.model),
                    lens.model == kPanorama
                        ? "Cut the panoramas into perspective photos and run colmap on those."
                        : "Undistort with `colmap image_undistorter`, which writes PINHOLE.");
    if (static_cast<int>(lens.parameters.size()) != row->parameters)
        throw Error(where,
                    fmt::format("{} has {} parameters, not {}", lens.model, row->parameters,
                                lens.parameters.size()),
                    "Export the cameras again.");
    for (std::size_t i = 0; i < lens.parameters.size(); ++i)
        if (!std::isfinite(lens.parameters[i]))
            throw Error(where,
                        fmt::format("parameter {} of {} of the camera, {}, is not finite", i + 1,
                                    lens.parameters.size(), parameter_name(*row, i)),
                        "Calibrate the cameras again.");
    for (int i = 0; i < (row->one_focal ? 1 : 2); ++i)
        if (!(lens.parameters[static_cast<std::size_t>(i)] > 0))
            throw Error(where,
                        fmt::format("the focal length {} is not positive",
                                    lens.parameters[static_cast<std::size_t>(i)]),
                        "Calibrate the cameras again.");
    if (lens.width < 1 || lens.height < 1 || lens.width > kMaxSize || lens.height > kMaxSize)
        throw Error(where,
                    fmt::format("the photo size {} x {} is not between 1 and {}", lens.width,
                                lens.height, kMaxSize),
                    "Correct the size, or export the cameras again.");
}

LensModel scale_lens(const LensModel& lens, int width, int height) {
    if (width == lens.width && height == lens.height) return lens;
    const ModelRow& row = model_of(lens);
    if (lens.width <= 0 || lens.height <= 0)
        throw Error("lens " + lens.model, fmt::format("is of {}x{} px", lens.width, lens.height),
                    "Name the size of its photo.");
    const double sx = static_cast<double>(width) / lens.width;
    const double sy = static_cast<double>(height) / lens.height;
    LensModel scaled = lens;
    scaled.width = width;
    scaled.height = height;
    if (row.one_focal) {  // one focal length: sx and sy differ by rounding of the size at most
        scaled.parameters[0] *= 0.5 * (sx + sy);
        scaled.parameters[1] *= sx;
        scaled.parameters[2] *= sy;
    } else {
        scaled.parameters[0] *= sx;
        scaled.parameters[1] *= sy;
        scaled.parameters[2] *= sx;
        scaled.parameters[3] *= sy;
    }
    return scaled;
}

Camera pinhole_camera(const LensModel& model) {
    const Lens lens(model);
    Camera camera;
    camera.width = model.width;
    camera.height = model.height;
    camera.fx = lens.focal.x;
    camera.fy = lens.focal.y;
    camera.cx = lens.principal.x;
    camera.cy = lens.principal.y;
    return camera;
}

Lens::Lens(const LensModel& model) {
    const ModelRow& row = model_of(model);
    const double* p = model.parameters.data();
    focal = row.one_focal ? glm::dvec2(p[0], p[0]) : glm::dvec2(p[0], p[1]);
    p += row.one_focal ? 1 : 2;
    principal = {p[0], p[1]};
    p += 2;
    if (model.model.ends_with("FISHEYE")) front_ = Front::equidistant;
    if (model.model == "SIMPLE_RADIAL" || model.model == "SIMPLE_RADIAL_FISHEYE") {
        k_[0] = p[0];
    } else if (model.model == "RADIAL" || model.model == "RADIAL_FISHEYE") {
        k_ = {p[0], p[1], 0, 0};
    } else if (model.model == "OPENCV_FISHEYE") {
        k_ = {p[0], p[1], p[2], p[3]};
    } else if (model.model == "FOV") {
        omega_ = p[0];
        if (std::abs(omega_) > kSmallOmega) front_ = Front::fov;
    } else if (row.parameters >= 8) {  // OPENCV, FULL_OPENCV, THIN_PRISM_FISHEYE, FOUR_RADIAL
        k_ = {p[0], p[1], 0, 0};
        p1_ = p[2];
        p2_ = p[3];
        if (model.model == "FULL_OPENCV") {
            k_[2] = p[4];
            d_ = {p[5], p[6], p[7]};
        } else if (model.model == kFourRadial) {
            k_[2] = p[4];
            k_[3] = p[5];
        } else if (model.model == "THIN_PRISM_FISHEYE") {
            k_[2] = p[4];
            k_[3] = p[5];
            s1_ = p[6];
            s2_ = p[7];
        }
    }
    fold_ = find_fold();
}

Lens::Distorted Lens::distort(glm::dvec2 w) const {
    const double x = w.x, y = w.y, r2 = x * x + y * y;
    const double top = 1 + r2 * (k_[0] + r2 * (k_[1] + r2 * (k_[2] + r2 * k_[3])));
    const double top_slope = k_[0] + r2 * (2 * k_[1] + r2 * (3 * k_[2] + r2 * 4 * k_[3]));
    const double bottom = 1 + r2 * (d_[0] + r2 * (d_[1] + r2 * d_[2]));
    const double bottom_slope = d_[0] + r2 * (2 * d_[1] + r2 * 3 * d_[2]);
    const double g = top / bottom;
    const double slope = (top_slope - g * bottom_slope) / bottom;  // dg / d(r^2)
    Distorted out;
    out.value = {x * g + 2 * p1_ * x * y + p2_ * (r2 + 2 * x * x) + s1_ * r2,
                 y * g + 2 * p2_ * x * y + p1_ * (r2 + 2 * y * y) + s2_ * r2};
    const double cross = 2 * x * y * slope + 2 * p1_ * x + 2 * p2_ * y;
    out.jacobian[0] = {g + 2 * x * x * slope + 2 * p1_ * y + 6 * p2_ * x + 2 * s1_ * x,
                       cross + 2 * s2_ * x};
    out.jacobian[1] = {cross + 2 * s1_ * y,
                       g + 2 * y * y * slope + 2 * p2_ * x + 6 * p1_ * y + 2 * s2_ * y};
    return out;
}

double Lens::find_fold() const {
    constexpr int kDirections = 16;
    constexpr double kStep = 0.01;
    // 84 degrees off the axis in the plane, 180 in theta.
    const double limit = front_ == Front::equidistant ? 2 * kHalfPi : 10.0;
    if (front_ == Front::fov) return limit;
    for (double r = 0; r < limit; r += kStep)
        for (int i = 0; i < kDirections; ++i) {
            const double angle = 4 * kHalfPi * i / kDirections;
            const Distorted at = distort(r * glm::dvec2(std::cos(angle), std::sin(angle)));
            const bool rational = 1 + r * r * (d_[0] + r * r * (d_[1] + r * r * d_[2])) > 0;
            if (!rational || !(glm::determinant(at.jacobian) > 0) ||
                !(at.jacobian[0][0] + at.jacobian[1][1] > 0))
                return std::max(0.0, r - kStep);
        }
    return limit;
}

glm::dvec2 Lens::project(glm::dvec2 ray) const {
    const double r = std::hypot(ray.x, ray.y);
    if (front_ == Front::fov) {
        const double factor = r < 1e-12 ? 2 * std::tan(0.5 * omega_) / omega_
                                        : std::atan(r * 2 * std::tan(0.5 * omega_)) / (r * omega_);
        return focal * ray * factor + principal;
    }
    if (front_ == Front::equidistant && r > 1e-12) ray *= std::atan(r) / r;
    return focal * distort(ray).value + principal;
}

LensTerms Lens::terms(glm::dvec2 size) const {
    constexpr int kBorderSamples = 64;    // a side
    constexpr double kMaxTangent = 10.0;  // 84 degrees
    LensTerms terms;
    terms.active = true;
    if (front_ == Front::equidistant) terms.front_tan = terms.front_scale = 1;
    if (front_ == Front::fov) {
        terms.front_tan = 2 * std::tan(0.5 * omega_);
        terms.front_scale = omega_;
    }
    terms.k = k_;
    terms.d = d_;
    terms.tangential = {p1_, p2_};
    terms.prism = {s1_, s2_};
    terms.fold = fold_;
    terms.ray_min = terms.ray_max = glm::dvec2(0.0);
    const auto see = [&](double x, double y) {
        const glm::dvec2 ray = unproject({x, y}).value_or(glm::dvec2(0.0));
        terms.ray_min = glm::max(glm::min(terms.ray_min, ray), glm::dvec2(-kMaxTangent));
        terms.ray_max = glm::min(glm::max(terms.ray_max, ray), glm::dvec2(kMaxTangent));
    };
    for (int i = 0; i <= kBorderSamples; ++i) {
        const double x = size.x * i / kBorderSamples, y = size.y * i / kBorderSamples;
        see(x, 0);
        see(x, size.y);
        see(0, y);
        see(size.x, y);
    }
    return terms;
}

bool Lens::valid(glm::dvec2 ray) const {
    const double r = std::hypot(ray.x, ray.y);
    return (front_ == Front::equidistant ? std::atan(r) : r) <= fold_;
}

std::optional<glm::dvec2> Lens::unproject(glm::dvec2 pixel) const {
    constexpr int kMaxIterations = 100;
    constexpr double kTolerance = 1e-9;
    const glm::dvec2 target = (pixel - principal) / focal;
    if (front_ == Front::fov) {
        const double r = std::hypot(target.x, target.y);
        if (r < 1e-12) return target * (omega_ / (2 * std::tan(0.5 * omega_)));
        if (!(r * std::abs(omega_) < kHalfPi - 1e-9)) return std::nullopt;
        return target * (std::tan(r * omega_) / (2 * std::tan(0.5 * omega_) * r));
    }
    glm::dvec2 w = target * std::min(1.0, fold_ / std::max(1e-12, glm::length(target)));
    Distorted at = distort(w);
    double error = glm::length(at.value - target);
    for (int i = 0; i < kMaxIterations && error > 1e-15; ++i) {
        const double determinant = glm::determinant(at.jacobian);
        if (!(std::abs(determinant) > 1e-14)) break;
        const glm::dvec2 step = glm::inverse(at.jacobian) * (at.value - target);
        double scale = 1, next = error;
        for (; scale > 1e-6; scale *= 0.5) {
            next = glm::length(distort(w - scale * step).value - target);
            if (next < error) break;
        }
        if (!(next < error)) break;
        w -= scale * step;
        at = distort(w);
        error = next;
    }
    const double r = glm::length(w);
    if (!(error < kTolerance) || !(r <= fold_) || !(glm::determinant(at.jacobian) > 0))
        return std::nullopt;
    if (front_ == Front::plane || r < 1e-12) return w;
    if (!(r < kHalfPi - 1e-6)) return std::nullopt;
    return w * (std::tan(r) / r);
}

}  // namespace darb
