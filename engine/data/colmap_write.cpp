// SPDX-License-Identifier: MIT
#include "engine/data/colmap_write.h"

#include <cstring>
#include <map>
#include <tuple>

#include "engine/core/files.h"
#include "engine/data/pose.h"

namespace darb {

namespace {

constexpr std::int32_t kPinholeId = 1;

class Writer {
  public:
    template <class T>
    void put(T value) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&value);
        bytes_.insert(bytes_.end(), bytes, bytes + sizeof(T));
    }
    void put_string(const std::string& text) {
        for (const char c : text) put(c);
        put('\0');
    }
    std::span<const std::byte> bytes() const { return bytes_; }

  private:
    std::vector<std::byte> bytes_;
};

using Intrinsics = std::tuple<int, int, double, double, double, double>;

Intrinsics intrinsics(const Camera& camera) {
    return {camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy};
}

}  // namespace

void write_colmap_binary(const std::filesystem::path& folder, const std::vector<View>& views,
                         const PointCloud& points) {
    std::map<Intrinsics, std::uint32_t> camera_ids;
    for (const View& view : views)
        camera_ids.try_emplace(intrinsics(view.camera),
                               static_cast<std::uint32_t>(camera_ids.size() + 1));
    Writer cameras;
    cameras.put<std::uint64_t>(camera_ids.size());
    for (const auto& [camera, id] : camera_ids) {
        const auto& [width, height, fx, fy, cx, cy] = camera;
        cameras.put<std::uint32_t>(id);
        cameras.put<std::int32_t>(kPinholeId);
        cameras.put<std::uint64_t>(static_cast<std::uint64_t>(width));
        cameras.put<std::uint64_t>(static_cast<std::uint64_t>(height));
        for (const double value : {fx, fy, cx, cy}) cameras.put(value);
    }

    Writer images;
    images.put<std::uint64_t>(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Camera& camera = views[i].camera;
        const glm::dvec4 wxyz = quaternion_from_rotation(camera.rotation);
        images.put(static_cast<std::uint32_t>(i + 1));
        for (int k = 0; k < 4; ++k) images.put(wxyz[k]);
        for (int k = 0; k < 3; ++k) images.put(camera.translation[k]);
        images.put(camera_ids.at(intrinsics(camera)));
        images.put_string(views[i].name);
        images.put<std::uint64_t>(0);  // observations
    }

    Writer cloud;
    cloud.put<std::uint64_t>(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        cloud.put<std::uint64_t>(i + 1);
        for (std::size_t k = 0; k < 3; ++k) cloud.put(points.position[i * 3 + k]);
        for (std::size_t k = 0; k < 3; ++k) cloud.put(points.colour[i * 3 + k]);
        cloud.put(0.0);               // reprojection error
        cloud.put<std::uint64_t>(0);  // track
    }
    write_file_atomic(folder / "cameras.bin", cameras.bytes());
    write_file_atomic(folder / "images.bin", images.bytes());
    write_file_atomic(folder / "points3D.bin", cloud.bytes());
}

}  // namespace darb
