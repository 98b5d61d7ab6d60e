// SPDX-License-Identifier: MIT
#include "viewer/scene.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <numeric>
#include <utility>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/las_points.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/mesh/mesh_file.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

struct Cancelled {};

constexpr std::size_t kReadBlock = 8 << 20;             // bytes between two reports
constexpr double kReadShare = 0.4, kDecodeShare = 0.5;  // shares of the loading time, by experience

std::vector<std::byte> read_in_blocks(const std::filesystem::path& file,
                                      const LoadProgress& progress) {
    check_is_file(file);
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    std::ifstream in(file, std::ios::binary);
    if (error || !in)
        throw Error(file.string(), "cannot be read", "Name a splat file, for example a .ply.");
    std::vector<std::byte> bytes(size);
    for (std::uintmax_t at = 0; at < size; at += kReadBlock) {
        const std::uintmax_t count = std::min<std::uintmax_t>(kReadBlock, size - at);
        in.read(reinterpret_cast<char*>(bytes.data() + at), static_cast<std::streamsize>(count));
        if (!in) throw Error(file.string(), "cannot be read to its end");
        if (progress)
            progress(kReadShare * (static_cast<double>(at + count) / static_cast<double>(size)),
                     "reading");
    }
    return bytes;
}

constexpr std::size_t kMostVertices = 100'000;  // that stand for a mesh

// A mesh's vertices, evenly chosen, are what is framed and orbited.
PointCloud vertices_of(const TriangleMesh& mesh) {
    PointCloud points;
    const std::size_t step = (mesh.vertex_count() + kMostVertices - 1) / kMostVertices;
    for (std::size_t v = 0; v < mesh.vertex_count(); v += step) {
        for (int c = 0; c < 3; ++c) {
            points.position.push_back(mesh.origin[static_cast<std::size_t>(c)] +
                                      double{mesh.position[v][c]});
            points.colour.push_back(mesh.colour.empty() ? 128 : mesh.colour[v][c]);
        }
    }
    return points;
}

Scene mesh_scene_of(std::span<const std::byte> bytes, const std::filesystem::path& folder,
                    Scene scene, const LoadProgress& progress) {
    const auto start = std::chrono::steady_clock::now();
    if (progress) progress(kReadShare, "decoding");
    std::vector<std::string> notes;
    TriangleMesh mesh =
        parse_mesh(bytes, scene.file.string(), folder, &notes, {.colours_of_textures = true});
    const bool holds_faces = mesh.face_count() > 0;
    if (progress) progress(kReadShare + kDecodeShare, "measuring");
    scene.model = points_as_splats(vertices_of(mesh));
    scene.is_points = true;
    scene.format = holds_faces ? fmt::format("mesh of {} faces", count_text(mesh.face_count()))
                               : "point cloud";
    scene.notes = notes;
    if (holds_faces) {
        scene.mesh = shown_mesh_of(std::move(mesh), scene.file, {});
        for (const std::string& note : scene.mesh->notes) scene.notes.push_back(note);
    } else {
        scene.notes.emplace_back("It has no faces. Points are shown as opaque balls.");
    }
    measure_scene(scene);
    scene.load_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return scene;
}

}  // namespace

// Reading a pipe would wait until somebody writes to it, which nobody could cancel.
void check_scene_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_type kind = std::filesystem::status(file, error).type();
    using enum std::filesystem::file_type;
    if (kind == regular || scene_file_in(file)) return;
    const char* const what = kind == not_found   ? "does not exist"
                             : kind == directory ? "is a folder without a scene"
                             : kind == fifo      ? "is a pipe"
                             : kind == socket    ? "is a socket"
                             : kind == character ? "is a device"
                             : kind == block     ? "is a device"
                                                 : "cannot be read";
    throw Error(file.string(), what, "Name a splat file, for example a .ply.");
}

void measure_scene(Scene& scene) {
    scene.bounds = scene_bounds(scene.model);
    scene.subject = subject_of(scene.model);
    scene.important =
        most_important(scene.model, scene.bounds, std::min(scene.model.size() / 2, kMostMoving));
}

namespace {

using LoadClock = std::chrono::steady_clock;

Scene finished_scene(Scene scene, const SplatFile& facts, const LoadProgress& progress,
                     LoadClock::time_point start) {
    scene.format = scene.is_points ? "point cloud" : std::string(format_name(facts.format));
    scene.notes = facts.notes;
    scene.up = facts.up;
    if (facts.dropped > 0)
        scene.notes.push_back(
            scene.is_points
                ? fmt::format("{} points with NaN, infinity or marked as withheld were dropped.",
                              facts.dropped)
                : fmt::format("{} splats with NaN or infinity were dropped.", facts.dropped));
    if (scene.is_points) scene.notes.emplace_back("Points are shown as opaque balls.");
    if (progress) progress(0.95, "measuring");
    measure_scene(scene);
    scene.load_s = std::chrono::duration<double>(LoadClock::now() - start).count();
    return scene;
}

// Each scene of the project takes its share of the progress.
Scene load_project_scene(const std::filesystem::path& file, const LoadProgress& progress,
                         const StoredUnits& units) {
    const LoadClock::time_point start = LoadClock::now();
    Scene scene;
    scene.file = file;
    scene.format = "project";
    scene.project = std::make_unique<OpenedProject>();
    Project& project = scene.project->project;
    project = read_project(file);
    scene.notes = changed_files(project, file.string());
    const double count = static_cast<double>(files_of_project(project).size());
    double read = 0;
    const ReadScene read_scene = [&](const std::filesystem::path& part) {
        if (is_project_file(part))
            throw Error(part.string(), "is a project, and a project cannot be a layer of another",
                        "Save its layers together as one file, and name that.");
        const auto share = [&](double done, const char* stage) {
            if (progress) progress((read + done) / (count + 1), stage);
        };
        Scene loaded = load_scene_file(part, share, units);
        if (read == 0) scene.up = loaded.up;
        scene.notes.insert(scene.notes.end(), loaded.notes.begin(), loaded.notes.end());
        ++read;
        return std::move(loaded.model);
    };
    EditedScene edited = perform_project(project, file.string(), read_scene);
    scene.model = std::move(edited.model);
    scene.project->edit = std::move(edited.edit);
    scene.drawn = scene.project->edit.drawn_otherwise(scene.model);
    if (progress) progress(0.95, "measuring");
    measure_scene(scene);
    scene.load_s = std::chrono::duration<double>(LoadClock::now() - start).count();
    return scene;
}

}  // namespace

Scene load_scene_file(const std::filesystem::path& file, const LoadProgress& progress,
                      const StoredUnits& units) {
    if (is_project_file(file)) {
        check_scene_file(file);
        return load_project_scene(file, progress, units);
    }
    const LoadClock::time_point start = LoadClock::now();
    Scene scene;
    scene.file = file;
    check_scene_file(file);
    SplatFile facts;
    const std::filesystem::path inner = scene_file_in(file).value_or(file);
    const std::vector<std::byte> bytes = read_in_blocks(inner, progress);
    const ReadProgress decoding = [&](double share) {
        if (progress) progress(kReadShare + kDecodeShare * share, "decoding");
    };
    decoding(0);
    const auto read_points = [&](const PlyHeader& header) {
        scene.is_points = true;
        return points_as_splats(
            parse_point_cloud_ply(bytes, header, file.string(), facts.dropped, &facts.notes));
    };
    const std::filesystem::path folder = inner.has_parent_path() ? inner.parent_path() : ".";
    if (looks_like_las(bytes)) {
        scene.is_points = true;
        scene.model =
            points_as_splats(parse_las(bytes, file.string(), facts.dropped, &facts.notes));
        facts.up = "z";
        return finished_scene(std::move(scene), facts, progress, start);
    }
    if (holds_mesh(bytes, inner)) return mesh_scene_of(bytes, folder, std::move(scene), progress);
    scene.model = parse_splats(bytes, inner.string(), &facts, decoding, folder, read_points, units);
    return finished_scene(std::move(scene), facts, progress, start);
}

LoadJob::LoadJob(std::filesystem::path file, std::function<void()> wake, const StoredUnits& units)
    : file_(std::move(file)), wake_(std::move(wake)), units_(units), thread_([this] { run(); }) {}

LoadJob::~LoadJob() {
    cancel();
    wait();
}

void LoadJob::run() {
    try {
        const auto report = [this](double share, const char* stage) {
            if (cancelled_) throw Cancelled();
            share_ = share;
            {
                const std::lock_guard lock(mutex_);
                stage_ = stage;
            }
            if (wake_) wake_();
        };
        scene_ = load_scene_file(file_, report, units_);
    } catch (const Cancelled&) {
    } catch (const std::bad_alloc&) {
        error_ = std::make_exception_ptr(
            NoRoom(file_.string(), "does not fit into memory", "Prune the scene first."));
    } catch (...) {
        error_ = std::current_exception();
    }
    done_ = true;
    if (wake_) wake_();
}

std::string LoadJob::stage() const {
    const std::lock_guard lock(mutex_);
    return stage_;
}

void LoadJob::wait() {
    if (thread_.joinable()) thread_.join();
}

std::optional<Scene> LoadJob::take() {
    wait();
    if (cancelled_) return {};
    if (error_) std::rethrow_exception(error_);
    return std::move(scene_);
}

SceneLoader::SceneLoader(Resolve resolve, std::function<void()> wake)
    : resolve_(std::move(resolve)), wake_(std::move(wake)) {}

void SceneLoader::start(const std::filesystem::path& path, bool dropped, bool merges,
                        const StoredUnits& units) {
    const std::filesystem::path file = resolve_ ? resolve_(path) : path;
    cancel();
    asked_for_ = path;
    dropped_ = dropped;
    merges_ = merges;
    job_ = std::make_unique<LoadJob>(file, wake_, units);
}

// The thread ends at its next report of progress; nobody waits for that.
void SceneLoader::cancel() {
    if (!job_) return;
    job_->cancel();
    cancelled_.push_back(std::move(job_));
}

std::string SceneLoader::stage() const {
    return job_ ? fmt::format("{}: {}", job_->file().filename().string(), job_->stage()) : "";
}

std::optional<LoadedScene> SceneLoader::poll() {
    std::erase_if(cancelled_, [](const auto& job) { return job->done(); });
    if (!job_ || !job_->done()) return {};
    return wait();
}

std::optional<LoadedScene> SceneLoader::wait() {
    if (!job_) return {};
    std::optional<Scene> scene = std::exchange(job_, nullptr)->take();
    if (!scene) return {};
    return LoadedScene{std::move(*scene), asked_for_, dropped_, merges_};
}

namespace {

std::vector<float> importance(const SplatModel& m, const Bounds& bounds) {
    std::vector<float> value(m.size());
    const glm::dvec3 middle = bounds.centre - m.origin;
    for (std::size_t i = 0; i < m.size(); ++i) {
        const float* s = &m.log_scale[3 * i];
        const double log_area = double{s[0]} + s[1] + s[2] - std::min({s[0], s[1], s[2]});
        const glm::dvec3 p(m.position[3 * i], m.position[3 * i + 1], m.position[3 * i + 2]);
        const double distance = std::max(glm::distance(p, middle) / bounds.radius, 1.0);
        // Logarithms keep a huge splat from becoming infinite. This is ln sigmoid, for any logit.
        const double x = m.opacity_logit[i];
        const double log_opacity = x < 0 ? x - std::log1p(std::exp(x)) : -std::log1p(std::exp(-x));
        value[i] = static_cast<float>(log_opacity + log_area - 2 * std::log(distance));
    }
    return value;
}

}  // namespace

std::vector<std::uint32_t> most_important(const SplatModel& model, const Bounds& bounds,
                                          std::size_t count) {
    const std::vector<float> value = importance(model, bounds);
    std::vector<std::uint32_t> order(model.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto first = [&](std::uint32_t a, std::uint32_t b) {
        return value[a] != value[b] ? value[a] > value[b] : a < b;
    };
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
    if (end != order.end()) std::nth_element(order.begin(), end, order.end(), first);
    std::sort(order.begin(), end, first);
    order.erase(end, order.end());
    order.shrink_to_fit();
    return order;
}

}  // namespace darb
