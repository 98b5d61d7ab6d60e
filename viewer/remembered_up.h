// What a user turned a scene's up to, remembered by its file.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>

namespace darb {

class RememberedUp {
  public:
    /// list: a JSON file that this class reads and writes; empty: nothing is remembered.
    explicit RememberedUp(std::filesystem::path list = {}) : list_(std::move(list)) {}

    /// Unit length; nothing where nothing is known or the list cannot be read.
    std::optional<glm::dvec3> find(const std::filesystem::path& scene) const;
    /// Keeps the latest 500 scenes. Throws Error where the list cannot be written; one that is no
    /// list of this kind stays as it is.
    void keep(const std::filesystem::path& scene, const glm::dvec3& up) const;

  private:
    std::filesystem::path list_;
};

}  // namespace darb
