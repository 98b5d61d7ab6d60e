#include "viewer/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/point_cloud_ply.h"
#include "engine/scene/splat_file.h"
#include "viewer/importance.h"

namespace darb {

namespace {

struct Cancelled {};

constexpr std::size_t kReadBlock = 8 << 20;             // bytes between two reports
constexpr double kReadShare = 0.4, kDecodeShare = 0.5;  // of the time, by experience

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

}  // namespace

// A pipe would be waited for until somebody writes to it, which nobody can cancel.
void check_scene_file(const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::file_type kind = std::filesystem::status(file, error).type();
    using enum std::filesystem::file_type;
    if (kind == regular || scene_file_in(file)) return;
    const char* const what = kind == not_found   ? "is not there"
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

Scene load_scene_file(const std::filesystem::path& file, const LoadProgress& progress,
                      const StoredUnits& units) {
    const auto start = std::chrono::steady_clock::now();
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
    scene.model = parse_splats(bytes, inner.string(), &facts, decoding, folder, read_points, units);
    scene.format = scene.is_points ? "point cloud" : std::string(format_name(facts.format));
    scene.notes = facts.notes;
    scene.up = facts.up;
    if (facts.dropped > 0)
        scene.notes.push_back(
            fmt::format("{} splats with NaN or infinity were dropped.", facts.dropped));
    if (scene.is_points) scene.notes.emplace_back("Points are shown as opaque balls.");
    if (progress) progress(0.95, "measuring");
    measure_scene(scene);
    scene.load_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return scene;
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

}  // namespace darb
