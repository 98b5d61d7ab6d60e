// SPDX-License-Identifier: MIT
#include "engine/data/lens_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/data/image_io.h"
#include "engine/scene/panorama.h"

namespace darb {

namespace {

struct ModelRow {
    std::string_view name;
    int parameters;
    bool one_focal;  // f, cx, cy rather than fx, fy, cx, cy
};

// Indexed by COLMAP's model id.
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
    {"RAD_TAN_THIN_PRISM_FISHEYE", 16, false},
    {"SIMPLE_DIVISION", 4, true},
    {"DIVISION", 5, false},
    {"SIMPLE_FISHEYE", 3, true},
    {"FISHEYE", 4, false},
    {"EUCM", 6, false},
    {kPanorama, 2, false},
    {kFourRadial, 10, false},  // has no COLMAP id
};

constexpr double kHalfPi = 1.5707963267948966;
constexpr int kMaxSize = 100000;      // px
constexpr double kSmallOmega = 1e-6;  // below this, FOV is a pinhole

const ModelRow* find_model(std::string_view name) {
    for (const ModelRow& row : kModels)
        if (row.name == name) return &row;
    return nullptr;
}

const ModelRow& model_of(const LensModel& lens) {
    const ModelRow* row = find_model(lens.model);
    if (!row || static_cast<int>(lens.parameters.size()) != row->parameters)
        throw Error("lens",
                    fmt::format("there is no model {} with {} parameters", lens.model,
                                lens.parameters.size()),
                    "check_lens tells what is wrong with it.");
    return *row;
}

/// A panorama shows the whole sphere, so that it is twice as wide as high.
void check_panorama(const LensModel& lens, const std::string& where) {
    constexpr double kMostOff = 0.01;
    const double width = lens.parameters[0], height = lens.parameters[1];
    if (width != lens.width || height != lens.height)
        throw Error(where,
                    fmt::format("the panorama is {} x {} px, but its parameters say {:g} x {:g}",
                                lens.width, lens.height, width, height),
                    "Export the cameras again.");
    if (std::abs(width / height - 2) > 2 * kMostOff)
        throw Error(where,
                    fmt::format("the panorama is {} x {} px, and one of all directions is twice as "
                                "wide as high",
                                lens.width, lens.height),
                    "Use whole panoramas; mask what they do not show.");
}

std::string_view parameter_name(const ModelRow& row, std::size_t i) {
    if (row.name == kPanorama) return i == 0 ? "w" : "h";
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

bool LensModel::panorama() const {
    return model == kPanorama;
}

bool LensModel::distorted() const {
    if (model == LensModel().model && parameters.empty()) return false;
    const ModelRow& row = model_of(*this);
    if (panorama()) return true;
    if (model.ends_with("FISHEYE")) return true;
    if (model == "FOV") return std::abs(parameters[4]) > kSmallOmega;
    if (model == "EUCM") return parameters[4] != 0;  // alpha; without it beta means nothing
    const auto first = parameters.begin() + (row.one_focal ? 3 : 4);
    return std::any_of(first, parameters.end(), [](double value) { return value != 0; });
}

void check_lens(const LensModel& lens, const std::string& where) {
    const ModelRow* row = find_model(lens.model);
    if (!row)
        throw Error(where, fmt::format("the camera model {} is unknown", lens.model),
                    "Export the cameras with one of COLMAP's models.");
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
    for (int i = 0; i < (row->one_focal ? 1 : 2) && !lens.panorama(); ++i)
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
    if (lens.panorama()) check_panorama(lens, where);
    if (lens.model == "EUCM" &&
        !(lens.parameters[4] >= 0 && lens.parameters[4] <= 1 && lens.parameters[5] > 0))
        throw Error(where,
                    fmt::format("alpha {:g} and beta {:g} of EUCM are not between 0 and 1, and "
                                "positive",
                                lens.parameters[4], lens.parameters[5]),
                    "Calibrate the cameras again.");
}

LensModel scale_lens(const LensModel& lens, int width, int height) {
    if (width == lens.width && height == lens.height) return lens;
    const ModelRow& row = model_of(lens);
    if (lens.width <= 0 || lens.height <= 0)
        throw Error("lens " + lens.model,
                    fmt::format("has a size of {}x{} px", lens.width, lens.height),
                    "Name the size of its photo.");
    const double sx = static_cast<double>(width) / lens.width;
    const double sy = static_cast<double>(height) / lens.height;
    LensModel scaled = lens;
    scaled.width = width;
    scaled.height = height;
    if (scaled.panorama()) {
        scaled.parameters = {double(width), double(height)};
    } else if (row.one_focal) {  // sx and sy differ only by the rounding of the size
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
    if (model.panorama())
        throw Error("lens", "a panorama is not one flat picture", "Use a face of it: cut_face.");
    const double* p = model.parameters.data();
    focal = row.one_focal ? glm::dvec2(p[0], p[0]) : glm::dvec2(p[0], p[1]);
    p += row.one_focal ? 1 : 2;
    principal = {p[0], p[1]};
    p += 2;
    if (model.model.ends_with("FISHEYE")) front_ = Front::equidistant;
    if (model.model == "SIMPLE_RADIAL" || model.model == "SIMPLE_RADIAL_FISHEYE") {
        k_[0] = p[0];
    } else if (model.model == "RADIAL" || model.model == "RADIAL_FISHEYE") {
        k_ = {p[0], p[1]};
    } else if (model.model == "OPENCV_FISHEYE") {
        k_ = {p[0], p[1], p[2], p[3]};
    } else if (model.model == "FOV") {
        omega_ = std::abs(p[0]);
        if (omega_ > kSmallOmega) front_ = Front::fov;
    } else if (model.model == "SIMPLE_DIVISION" || model.model == "DIVISION") {
        alpha_ = 0.5;
        beta_ = -4 * p[0];
        if (beta_ != 0) front_ = Front::unified;
    } else if (model.model == "EUCM") {
        alpha_ = p[0];
        beta_ = p[1];
        if (alpha_ != 0) front_ = Front::unified;
    } else if (model.model == "RAD_TAN_THIN_PRISM_FISHEYE") {
        std::copy_n(p, k_.size(), k_.begin());
        after_ = true;
        p2_ = p[6];  // its p0 goes with x
        p1_ = p[7];
        s1_ = p[8], high1_ = p[9], s2_ = p[10], high2_ = p[11];
    } else if (row.parameters >= 8) {  // OPENCV, FULL_OPENCV, THIN_PRISM_FISHEYE, FOUR_RADIAL
        k_ = {p[0], p[1]};
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

/// Adds the tangential and prism terms at v.
void Lens::add_bend(glm::dvec2 v, Distorted& to) const {
    const double x = v.x, y = v.y, r2 = x * x + y * y;
    const double prism1 = s1_ + 2 * r2 * high1_, prism2 = s2_ + 2 * r2 * high2_;
    to.value = {to.value.x + 2 * p1_ * x * y + p2_ * (r2 + 2 * x * x) + (s1_ + high1_ * r2) * r2,
                to.value.y + 2 * p2_ * x * y + p1_ * (r2 + 2 * y * y) + (s2_ + high2_ * r2) * r2};
    const double cross0 = to.jacobian[0].y + 2 * p1_ * x + 2 * p2_ * y;
    const double cross1 = to.jacobian[1].x + 2 * p1_ * x + 2 * p2_ * y;
    to.jacobian[0] = {to.jacobian[0].x + 2 * p1_ * y + 6 * p2_ * x + 2 * prism1 * x,
                      cross0 + 2 * prism2 * x};
    to.jacobian[1] = {cross1 + 2 * prism1 * y,
                      to.jacobian[1].y + 2 * p2_ * x + 6 * p1_ * y + 2 * prism2 * y};
}

Lens::Distorted Lens::distort(glm::dvec2 w) const {
    const double x = w.x, y = w.y, r2 = x * x + y * y;
    double top = 0, top_slope = 0;
    for (std::size_t i = k_.size(); i-- > 0;) {
        top_slope = top_slope * r2 + double(i + 1) * k_[i];
        top = (top + k_[i]) * r2;
    }
    top += 1;
    const double bottom = 1 + r2 * (d_[0] + r2 * (d_[1] + r2 * d_[2]));
    const double bottom_slope = d_[0] + r2 * (2 * d_[1] + r2 * 3 * d_[2]);
    const double g = top / bottom;
    const double slope = (top_slope - g * bottom_slope) / bottom;  // dg / d(r^2)
    Distorted out;
    out.value = {x * g, y * g};
    out.jacobian[0] = {g + 2 * x * x * slope, 2 * x * y * slope};
    out.jacobian[1] = {2 * x * y * slope, g + 2 * y * y * slope};
    if (!after_) {
        add_bend(w, out);
        return out;
    }
    Distorted after{out.value, glm::dmat2(1.0)};
    add_bend(out.value, after);
    return {after.value, after.jacobian * out.jacobian};
}

double Lens::find_fold() const {
    constexpr int kDirections = 16;
    constexpr double kStep = 0.01;
    // 84 degrees off the axis in the plane, 180 in theta.
    const double limit = front_ == Front::equidistant ? 2 * kHalfPi : 10.0;
    if (front_ == Front::fov) return limit;
    // With beta below 0 the root ends at r = 1 / sqrt(-beta), where w = 2 r.
    if (front_ == Front::unified && beta_ < 0) return std::min(limit, 1.998 / std::sqrt(-beta_));
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

double Lens::unified_factor(double square) const {
    return 1 / (alpha_ * std::sqrt(std::max(0.0, 1 + beta_ * square)) + 1 - alpha_);
}

glm::dvec2 Lens::project(glm::dvec2 ray) const {
    const double r = std::hypot(ray.x, ray.y);
    if (front_ == Front::fov) {
        const double factor = r < 1e-12 ? 2 * std::tan(0.5 * omega_) / omega_
                                        : std::atan(r * 2 * std::tan(0.5 * omega_)) / (r * omega_);
        return focal * ray * factor + principal;
    }
    if (front_ == Front::equidistant && r > 1e-12) ray *= std::atan(r) / r;
    if (front_ == Front::unified) ray *= unified_factor(r * r);
    return focal * distort(ray).value + principal;
}

LensTerms Lens::terms(glm::dvec2 size) const {
    constexpr int kBorderSamples = 64;    // per side
    constexpr double kMaxTangent = 10.0;  // 84 degrees
    LensTerms terms;
    terms.active = true;
    if (front_ == Front::equidistant) terms.front_tan = terms.front_scale = 1;
    if (front_ == Front::fov) {
        terms.front_tan = 2 * std::tan(0.5 * omega_);
        terms.front_scale = omega_;
    }
    if (front_ == Front::unified) {
        terms.front_tan = beta_;
        terms.front_scale = -alpha_;
    }
    terms.k = k_;
    terms.d = d_;
    terms.tangential = {p1_, p2_};
    terms.prism = {s1_, s2_};
    terms.prism_high = {high1_, high2_};
    terms.after = after_;
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
    if (front_ == Front::unified)
        return 1 + beta_ * r * r > 0 && r * unified_factor(r * r) <= fold_;
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
    if (front_ == Front::unified) {
        const double square = glm::dot(target, target);
        const double root = 1 - (2 * alpha_ - 1) * beta_ * square;
        if (!(root >= 0) || !(square <= fold_ * fold_)) return std::nullopt;
        const double z =
            (1 - alpha_ * alpha_ * beta_ * square) / (alpha_ * std::sqrt(root) + 1 - alpha_);
        if (!(z > 1e-6)) return std::nullopt;
        return target / z;
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

namespace {

constexpr double kMaxTangent = 1.7320508075688772;  // 60 degrees to each side
constexpr int kBorderSamples = 128;                 // per side
constexpr double kMaxGrowth = 2.0;  // limit on the size, as a multiple, against extreme
                                    // magnification

/// Bounds of the frame on the plane z = 1.
struct Bounds {
    double left = -kMaxTangent, right = kMaxTangent, top = -kMaxTangent, bottom = kMaxTangent;
};

/// The largest rectangle whose sides lie inside the four undistorted borders. Border points without
/// an inverse (beyond 90 degrees or the fold) leave the cap in place.
Bounds inner_bounds(const Lens& lens, const LensModel& model) {
    Bounds bounds;
    const double right = model.width - 0.5, bottom = model.height - 0.5;
    for (int i = 0; i <= kBorderSamples; ++i) {
        const double along = static_cast<double>(i) / kBorderSamples;
        const double x = 0.5 + along * (right - 0.5), y = 0.5 + along * (bottom - 0.5);
        if (const auto ray = lens.unproject({0.5, y})) bounds.left = std::max(bounds.left, ray->x);
        if (const auto ray = lens.unproject({right, y}))
            bounds.right = std::min(bounds.right, ray->x);
        if (const auto ray = lens.unproject({x, 0.5})) bounds.top = std::max(bounds.top, ray->y);
        if (const auto ray = lens.unproject({x, bottom}))
            bounds.bottom = std::min(bounds.bottom, ray->y);
    }
    return bounds;
}

glm::dvec2 ray_of(const Camera& camera, double x, double y) {
    return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

/// Allows half a pixel of tolerance, because the outermost pixels of the photo repeat outwards.
bool inside(const LensModel& model, glm::dvec2 pixel) {
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x <= model.width && pixel.y <= model.height;
}

bool has_gaps(const Lens& lens, const LensModel& model, const Camera& camera) {
    const auto gap = [&](double x, double y) {
        const glm::dvec2 ray = ray_of(camera, x, y);
        return !lens.valid(ray) || !inside(model, lens.project(ray));
    };
    const double right = camera.width - 0.5, bottom = camera.height - 0.5;
    for (int i = 0; i <= kBorderSamples; ++i) {
        const double along = static_cast<double>(i) / kBorderSamples;
        const double x = 0.5 + along * (right - 0.5), y = 0.5 + along * (bottom - 0.5);
        if (gap(0.5, y) || gap(right, y) || gap(x, 0.5) || gap(x, bottom)) return true;
    }
    return false;
}

struct Sample {
    float rgb[3] = {0, 0, 0};  // premultiplied by alpha
    float alpha = 0;           // 0 to 255
};

/// Samples bilinearly; the outermost pixels repeat outwards.
Sample sample(const ImageU8& rgba, glm::dvec2 pixel) {
    const double x = std::clamp(pixel.x - 0.5, 0.0, rgba.width - 1.0);
    const double y = std::clamp(pixel.y - 0.5, 0.0, rgba.height - 1.0);
    const auto x0 = static_cast<std::size_t>(x), y0 = static_cast<std::size_t>(y);
    const std::size_t x1 = std::min(x0 + 1, static_cast<std::size_t>(rgba.width) - 1);
    const std::size_t y1 = std::min(y0 + 1, static_cast<std::size_t>(rgba.height) - 1);
    const auto u = static_cast<float>(x - static_cast<double>(x0));
    const auto v = static_cast<float>(y - static_cast<double>(y0));
    const auto stride = static_cast<std::size_t>(rgba.width);
    const std::size_t corners[4] = {y0 * stride + x0, y0 * stride + x1, y1 * stride + x0,
                                    y1 * stride + x1};
    const float weights[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    Sample sum;
    for (int i = 0; i < 4; ++i) {
        const std::uint8_t* from = &rgba.data[corners[i] * 4];
        const float alpha = weights[i] * static_cast<float>(from[3]);
        for (int c = 0; c < 3; ++c) sum.rgb[c] += alpha * static_cast<float>(from[c]);
        sum.alpha += alpha;
    }
    return sum;
}

}  // namespace

bool too_wide_to_undistort(const LensModel& model) {
    if (!model.distorted() || !(model.model.ends_with("FISHEYE") || model.model == "FOV" ||
                                model.model == "EUCM" || model.model.ends_with("DIVISION")))
        return false;
    const Lens lens(model);
    const glm::dvec2 middle = glm::clamp(lens.principal, glm::dvec2(0.5),
                                         glm::dvec2(model.width - 0.5, model.height - 0.5));
    for (const glm::dvec2 border :
         {glm::dvec2(0.5, middle.y), glm::dvec2(model.width - 0.5, middle.y),
          glm::dvec2(middle.x, 0.5), glm::dvec2(middle.x, model.height - 0.5)}) {
        const auto ray = lens.unproject(border);
        if (!ray || std::max(std::abs(ray->x), std::abs(ray->y)) > kMaxTangent) return true;
    }
    return false;
}

UndistortedFrame undistorted_frame(const LensModel& model, const std::string& where) {
    UndistortedFrame frame;
    Camera& camera = frame.camera;
    if (model.panorama()) {
        camera = face_camera({}, cube_faces()[0], face_size(model.width));
        return frame;
    }
    camera = pinhole_camera(model);
    if (!model.distorted()) return frame;

    const Lens lens(model);
    const Bounds bounds = inner_bounds(lens, model);
    const double width = bounds.right - bounds.left, height = bounds.bottom - bounds.top;
    if (!(width > 0) || !(height > 0))
        throw Error(where, "the lens distortion leaves no rectangle of the photo",
                    "Check the distortion coefficients, or undistort with colmap.");
    const double shrink = std::min({1.0, kMaxGrowth * model.width / (width * camera.fx),
                                    kMaxGrowth * model.height / (height * camera.fy)});
    camera.fx *= shrink;
    camera.fy *= shrink;
    // The centres of the outermost pixels lie on the bounds.
    camera.width = std::max(1, static_cast<int>(width * camera.fx + 1 + 1e-6));
    camera.height = std::max(1, static_cast<int>(height * camera.fy + 1 + 1e-6));
    camera.cx = 0.5 - bounds.left * camera.fx;
    camera.cy = 0.5 - bounds.top * camera.fy;
    frame.has_gaps = has_gaps(lens, model, camera);
    return frame;
}

ImageU8 undistort(const ImageU8& rgba, const LensModel& model, const Camera& camera) {
    if (rgba.channels != 4 || rgba.width != model.width || rgba.height != model.height)
        throw Error("undistort",
                    fmt::format("a photo of {}x{}x{} and a lens for {}x{}", rgba.width, rgba.height,
                                rgba.channels, model.width, model.height),
                    "Use RGBA, and scale_lens for the size of the photo.");
    const Lens lens(model);
    ImageU8 out(camera.width, camera.height, 4);
    std::uint8_t* to = out.data.data();
    for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x, to += 4) {
            const glm::dvec2 ray = ray_of(camera, x + 0.5, y + 0.5);
            if (!lens.valid(ray)) continue;
            const glm::dvec2 pixel = lens.project(ray);
            if (!inside(model, pixel)) continue;
            const Sample at = sample(rgba, pixel);
            if (!(at.alpha > 0)) continue;
            for (int c = 0; c < 3; ++c)
                to[c] = static_cast<std::uint8_t>(std::min(at.rgb[c] / at.alpha + 0.5f, 255.0f));
            to[3] = static_cast<std::uint8_t>(std::min(at.alpha + 0.5f, 255.0f));
        }
    return out;
}

}  // namespace darb
