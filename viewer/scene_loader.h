// SceneLoader: the one scene that is being loaded in the background, and the loads before it that
// were cancelled and still run.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/scene.h"

namespace darb {

struct LoadedScene {
    Scene scene;
    std::filesystem::path asked_for;  // before it was resolved to a file
    bool dropped = false;             // on the window, rather than named
    bool merges = false;              // into the scene that is there
};

class SceneLoader {
  public:
    using Resolve = std::function<std::filesystem::path(const std::filesystem::path&)>;
    /// resolve: the file that a path means, may be none. wake: called from other threads when there
    /// is something new.
    SceneLoader(Resolve resolve, std::function<void()> wake);

    /// An earlier load is cancelled. Throws Error where the path means no scene.
    void start(const std::filesystem::path& path, bool dropped, bool merges = false,
               const StoredUnits& units = {});
    void cancel();
    bool loading() const { return job_ != nullptr; }
    double share() const { return job_ ? job_->share() : -1; }  // below 0: nothing is loaded
    std::string stage() const;
    /// The scene, once it is there. Throws Error where it could not be loaded.
    std::optional<LoadedScene> poll();
    /// The same after waiting for it.
    std::optional<LoadedScene> wait();

  private:
    Resolve resolve_;
    std::function<void()> wake_;
    std::unique_ptr<LoadJob> job_;
    std::filesystem::path asked_for_;
    bool dropped_ = false, merges_ = false;
    std::vector<std::unique_ptr<LoadJob>> cancelled_;
};

}  // namespace darb
