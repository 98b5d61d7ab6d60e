#include "engine/check/dump.h"

#include <fmt/format.h>

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

// In the order of the file's columns: harmonics channel by channel.
template <class T>
std::vector<T> as_in_files(const std::vector<T>& values, int attribute, int sh_degree) {
    const size_t floats = attribute_floats(attribute, sh_degree);
    std::vector<T> out(values.size());
    for (size_t i = 0; i < values.size(); ++i)
        out[i / floats * floats + file_column(attribute, sh_degree, i % floats)] = values[i];
    return out;
}

template <class T>
void write(const std::filesystem::path& folder, const SplatModel& model, const Camera& camera,
           const std::vector<T>& image, const std::array<std::vector<T>, kAttributeCount>& d) {
    const auto put = [&](const std::string& name, const std::vector<size_t>& shape,
                         const std::vector<T>& values) {
        write_npy(folder / (name + ".npy"), shape, std::span<const T>(values));
    };
    put("image", {size_t(camera.height), size_t(camera.width), 3}, image);
    for (int a = 0; a < kAttributeCount; ++a) {
        const size_t floats = model.floats(a);
        std::vector<size_t> shape{model.size()};
        if (floats != 1) shape.push_back(floats);
        put(std::string("d_") + kSplatAttributes[static_cast<size_t>(a)].file_name, shape,
            as_in_files(d[static_cast<size_t>(a)], a, model.sh_degree));
    }
}

}  // namespace

std::vector<std::filesystem::path> dump_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files{folder / "image.npy"};
    for (const SplatAttribute& attribute : kSplatAttributes)
        files.push_back(folder / fmt::format("d_{}.npy", attribute.file_name));
    return files;
}

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
