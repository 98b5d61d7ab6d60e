#include "engine/check/dump.h"

#include "engine/check/npy.h"
#include "engine/check/walk_truth.h"

namespace darb::check {

namespace {

Image<double> linear_weights(const Camera& camera) {
    Image<double> w(camera.width, camera.height, 3);
    const auto last = static_cast<double>(w.data.size() - 1);
    for (size_t i = 0; i < w.data.size(); ++i) w.data[i] = static_cast<double>(i) / last;
    return w;
}

// [N][C-1][3] to [N][3][C-1].
template <class T>
std::vector<T> channel_major(const std::vector<T>& rest, size_t per_splat) {
    std::vector<T> out(rest.size());
    const size_t coefficients = per_splat / 3;
    for (size_t i = 0; i < rest.size(); ++i) {
        const size_t splat = i / per_splat, at = i % per_splat;
        out[splat * per_splat + at % 3 * coefficients + at / 3] = rest[i];
    }
    return out;
}

template <class T>
void write(const std::filesystem::path& folder, const SplatModel& model, const Camera& camera,
           const std::vector<T>& image, const std::array<std::vector<T>, kAttributeCount>& d) {
    const size_t n = model.size(), rest = static_cast<size_t>(model.rest_count());
    const auto put = [&](const char* name, const std::vector<size_t>& shape,
                         const std::vector<T>& values) {
        write_npy(folder / (std::string(name) + ".npy"), shape, std::span<const T>(values));
    };
    put("image", {size_t(camera.height), size_t(camera.width), 3}, image);
    put("d_xyz", {n, 3}, d[kPosition]);
    put("d_f_dc", {n, 3}, d[kShDc]);
    put("d_f_rest", {n, rest}, rest > 0 ? channel_major(d[kShRest], rest) : std::vector<T>{});
    put("d_opacity", {n}, d[kOpacity]);
    put("d_scale", {n, 3}, d[kLogScale]);
    put("d_rot", {n, 4}, d[kRotation]);
}

}  // namespace

void dump_from_device(Device& device, const SplatModel& model, const Camera& camera,
                      const std::filesystem::path& folder) {
    const DeviceWalk walk = walk_on_device(device, model, camera, linear_weights(camera), {});
    write<float>(folder, model, camera, walk.image.data, walk.d);
}

void dump_from_reference(const SplatModel& model, const Camera& camera,
                         const std::filesystem::path& folder) {
    const WalkTruth truth = walk_in_double(model, camera, linear_weights(camera), {});
    write<double>(folder, model, camera, truth.image, truth.d);
}

}  // namespace darb::check
