// SPDX-License-Identifier: MIT
#include "engine/check/dump.h"

#include <fmt/format.h>
#include <bit>
#include <cstring>
#include <numeric>

#include "engine/check/device_walk.h"
#include "engine/core/error.h"
#include "engine/core/files.h"

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

namespace {

static_assert(std::endian::native == std::endian::little, "the header says little-endian");

std::string header(const char* type, const std::vector<size_t>& shape) {
    std::string sides;
    for (const size_t side : shape) sides += fmt::format("{},", side);
    std::string text =
        fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, sides);
    constexpr size_t kMagic = 10, kAlign = 64;  // magic, version, length; then text up to \n
    text.append(kAlign - 1 - (kMagic + text.size()) % kAlign, ' ');
    text += '\n';
    const auto length = static_cast<std::uint16_t>(text.size());
    std::string head("\x93NUMPY\x01\x00", 8);
    head += static_cast<char>(length & 0xFF);
    head += static_cast<char>(length >> 8);
    return head + text;
}

template <class T>
void write(const std::filesystem::path& path, const char* type, const std::vector<size_t>& shape,
           std::span<const T> values) {
    const size_t count =
        std::accumulate(shape.begin(), shape.end(), size_t{1}, std::multiplies<>());
    DARB_CHECK(count == values.size(), "{} values in a shape of {}", values.size(), count);
    const std::string head = header(type, shape);
    std::vector<std::byte> file(head.size() + values.size_bytes());
    std::memcpy(file.data(), head.data(), head.size());
    if (!values.empty()) std::memcpy(file.data() + head.size(), values.data(), values.size_bytes());
    write_file_atomic(path, file);
}

}  // namespace

void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const float> values) {
    write(path, "<f4", shape, values);
}
void write_npy(const std::filesystem::path& path, const std::vector<size_t>& shape,
               std::span<const double> values) {
    write(path, "<f8", shape, values);
}

}  // namespace darb::check
