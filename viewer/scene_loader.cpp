#include "viewer/scene_loader.h"

#include <fmt/format.h>

#include <utility>

namespace darb {

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

// Its thread ends at its next report of progress; nobody waits for that.
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

}  // namespace darb
