// SPDX-License-Identifier: MIT
#include "tools/paper/lpips.h"

#include <fmt/format.h>
#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/reference/parallel.h"

namespace darb {

namespace {

constexpr std::size_t kLengthBytes = 8;
constexpr const char* kWriteAnew =
    "Write the file anew, for example with safetensors.torch.save_file in Python.";

template <class T>
T load(const std::byte* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

float half_to_float(std::uint16_t h) {
    const int exponent = h >> 10 & 31, mantissa = h & 1023;
    const float sign = h >> 15 != 0 ? -1.0f : 1.0f;
    if (exponent == 31)
        return mantissa != 0 ? std::numeric_limits<float>::quiet_NaN()
                             : sign * std::numeric_limits<float>::infinity();
    const int whole = exponent == 0 ? mantissa : mantissa + 1024;
    return sign * std::ldexp(static_cast<float>(whole), std::max(exponent, 1) - 25);
}

/// Bytes of a value of a supported type; 0 for other types.
std::size_t size_of(const std::string& type) {
    if (type == "F32") return 4;
    if (type == "F16" || type == "BF16") return 2;
    return type == "F64" ? 8 : 0;
}

float value_at(const std::string& type, const std::byte* at) {
    if (type == "F32") return load<float>(at);
    if (type == "F16") return half_to_float(load<std::uint16_t>(at));
    if (type == "BF16")
        return std::bit_cast<float>(static_cast<std::uint32_t>(load<std::uint16_t>(at)) << 16);
    return static_cast<float>(load<double>(at));
}

Tensor read_tensor(const nlohmann::json& entry, std::span<const std::byte> bytes,
                   const std::string& where) {
    const auto bad = [&](const std::string& what) { return Error(where, what, kWriteAnew); };
    const std::string type = entry.at("dtype");
    const auto offsets = entry.at("data_offsets").get<std::vector<std::uint64_t>>();
    Tensor tensor{entry.at("shape").get<std::vector<std::size_t>>(), {}};
    if (offsets.size() != 2 || offsets[0] > offsets[1] || offsets[1] > bytes.size())
        throw bad(fmt::format("its offsets lie beyond the {} bytes of data", bytes.size()));
    const std::size_t size = size_of(type), length = offsets[1] - offsets[0];
    std::size_t count = 1;
    for (const std::size_t n : tensor.shape) {
        if (n != 0 && count > length / n) throw bad("its shape needs more bytes than it has");
        count *= n;
    }
    if (count * size != length)
        throw bad(fmt::format("{} values of {} do not fill its {} bytes", count, type, length));
    tensor.data.resize(count);
    for (std::size_t i = 0; i < count; ++i)
        tensor.data[i] = value_at(type, &bytes[offsets[0] + i * size]);
    if (!std::ranges::all_of(tensor.data, [](float value) { return std::isfinite(value); }))
        throw bad("holds NaN or infinity");
    return tensor;
}

}  // namespace

Tensors parse_safetensors(std::span<const std::byte> file, const std::string& where) {
    if (file.size() < kLengthBytes)
        throw Error(where, "is too short for a safetensors file", kWriteAnew);
    const auto length = load<std::uint64_t>(file.data());
    if (length > file.size() - kLengthBytes)
        throw Error(where, "is no safetensors file, or is truncated: its header is longer than it",
                    kWriteAnew);
    const char* text = reinterpret_cast<const char*>(file.data()) + kLengthBytes;
    const auto header = nlohmann::json::parse(text, text + length, nullptr, false);
    if (!header.is_object())
        throw Error(where, "is no safetensors file: its header is no JSON object", kWriteAnew);
    Tensors tensors;
    for (const auto& [name, entry] : header.items()) {
        if (name == "__metadata__") continue;
        const std::string place = where + ", tensor " + name;
        try {
            if (size_of(entry.at("dtype").get<std::string>()) == 0) continue;
            tensors[name] = read_tensor(entry, file.subspan(kLengthBytes + length), place);
        } catch (const nlohmann::json::exception&) {
            throw Error(place, "lacks dtype, shape or data_offsets", kWriteAnew);
        }
    }
    return tensors;
}

Tensors read_safetensors(const std::filesystem::path& path) {
    return parse_safetensors(read_file(path), path.string());
}

namespace {

// Constants of the package's ScalingLayer, for colours in [-1, 1].
constexpr float kShift[3] = {-0.030f, -0.088f, -0.188f}, kScale[3] = {0.458f, 0.448f, 0.450f};
constexpr float kLengthEpsilon = 1e-10f;
constexpr std::size_t kColumnFloats = 1u << 20;  // one block of unfolded patches: 4 MiB

struct Plane {
    int width = 0, height = 0;
    std::size_t channels = 0;
    std::vector<float> data;  // [channels][height][width]
};

struct Row {
    int slice, index, pool, stride, padding;  // index: that of features.N; slice: that of the lpips
                                              // package
    bool kept;
};

constexpr Row kAlexNet[] = {{1, 0, 0, 4, 2, true},
                            {2, 3, 3, 1, 2, true},
                            {3, 6, 3, 1, 1, true},
                            {4, 8, 0, 1, 1, true},
                            {5, 10, 0, 1, 1, true}};
constexpr Row kVgg16[] = {{1, 0, 0, 1, 1, false}, {1, 2, 0, 1, 1, true},   {2, 5, 2, 1, 1, false},
                          {2, 7, 0, 1, 1, true},  {3, 10, 2, 1, 1, false}, {3, 12, 0, 1, 1, false},
                          {3, 14, 0, 1, 1, true}, {4, 17, 2, 1, 1, false}, {4, 19, 0, 1, 1, false},
                          {4, 21, 0, 1, 1, true}, {5, 24, 2, 1, 1, false}, {5, 26, 0, 1, 1, false},
                          {5, 28, 0, 1, 1, true}};

constexpr const char* kSaveWeights =
    "Save the state_dict of lpips.LPIPS, or that of torchvision's net together with the package's "
    "lin layers, as safetensors, each tensor cloned (docs/paper.md has the lines).";

/// The first of these that is there; never null.
const Tensor* tensor_of(const Tensors& tensors, const std::vector<std::string>& names,
                        const std::string& where) {
    for (const std::string& name : names)
        if (const auto found = tensors.find(name); found != tensors.end()) return &found->second;
    throw Error(where, "has no tensor " + names.front(), kSaveWeights);
}

std::vector<std::string> trunk_names(const Row& row, const char* what) {
    return {fmt::format("features.{}.{}", row.index, what),
            fmt::format("net.slice{}.{}.{}", row.slice, row.index, what)};
}

Plane max_pool(const Plane& in, int side) {
    Plane out{(in.width - side) / 2 + 1, (in.height - side) / 2 + 1, in.channels, {}};
    out.data.resize(out.channels * out.width * out.height);
    float* to = out.data.data();
    for (std::size_t c = 0; c < in.channels; ++c) {
        const float* plane = &in.data[c * in.width * in.height];
        for (int y = 0; y < out.height; ++y)
            for (int x = 0; x < out.width; ++x) {
                float largest = -std::numeric_limits<float>::infinity();
                for (int v = 0; v < side; ++v)
                    for (int u = 0; u < side; ++u)
                        largest = std::max(largest, plane[(2 * y + v) * in.width + 2 * x + u]);
                *to++ = largest;
            }
    }
    return out;
}

/// Rows [first, last) of the output.
struct OutputRows {
    int width, first, last;
};

/// Patches of these rows: column[(c k + v) k + u][pixel].
void unfold(const Plane& in, int side, int stride, int padding, const OutputRows& rows,
            float* column) {
    const auto [width, first, last] = rows;
    for (std::size_t c = 0; c < in.channels; ++c) {
        const float* plane = &in.data[c * in.width * in.height];
        for (int v = 0; v < side; ++v)
            for (int u = 0; u < side; ++u)
                for (int y = first; y < last; ++y) {
                    const int from_y = y * stride + v - padding;
                    const bool row_inside = from_y >= 0 && from_y < in.height;
                    for (int x = 0; x < width; ++x) {
                        const int from_x = x * stride + u - padding;
                        *column++ = row_inside && from_x >= 0 && from_x < in.width
                                        ? plane[from_y * in.width + from_x]
                                        : 0.0f;
                    }
                }
    }
}

/// max(0, weight * in + bias), by blocks of output rows: unfolded patches, then a matrix product.
Plane convolve_relu(const Plane& in, const Tensor& weight, const std::vector<float>& bias,
                    int stride, int padding, int threads) {
    using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const int side = static_cast<int>(weight.shape[2]);
    Plane out{(in.width + 2 * padding - side) / stride + 1,
              (in.height + 2 * padding - side) / stride + 1,
              weight.shape[0],
              {}};
    const std::size_t taps = weight.shape[1] * side * side;
    const std::size_t pixels = std::size_t(out.width) * out.height;
    out.data.resize(out.channels * pixels);
    const Eigen::Map<const Matrix> filter(weight.data.data(), Eigen::Index(out.channels),
                                          Eigen::Index(taps));
    const Eigen::Map<const Eigen::VectorXf> offset(bias.data(), Eigen::Index(bias.size()));
    const int rows = std::clamp(int(kColumnFloats / (taps * out.width)), 1, out.height);
    const std::size_t blocks = (out.height + rows - 1) / rows;
    reference::parallel_for(blocks, threads, [&](std::size_t b) {
        const int first = static_cast<int>(b) * rows, last = std::min(first + rows, out.height);
        const Eigen::Index count = Eigen::Index(last - first) * out.width;
        Matrix column(Eigen::Index(taps), count);
        unfold(in, side, stride, padding, {out.width, first, last}, column.data());
        const Matrix product = ((filter * column).colwise() + offset).cwiseMax(0.0f);
        for (std::size_t c = 0; c < out.channels; ++c)
            std::copy_n(product.data() + Eigen::Index(c) * count, count,
                        &out.data[c * pixels + std::size_t(first) * out.width]);
    });
    return out;
}

LpipsFeatures::Map normalised(const Plane& plane) {
    LpipsFeatures::Map map{plane.channels, std::size_t(plane.width) * plane.height, plane.data};
    std::vector<float> length(map.pixels, 0.0f);
    for (std::size_t c = 0; c < map.channels; ++c)
        for (std::size_t p = 0; p < map.pixels; ++p) {
            const float v = map.data[c * map.pixels + p];
            length[p] += v * v;
        }
    for (float& v : length) v = 1 / (std::sqrt(v) + kLengthEpsilon);
    for (std::size_t c = 0; c < map.channels; ++c)
        for (std::size_t p = 0; p < map.pixels; ++p) map.data[c * map.pixels + p] *= length[p];
    return map;
}

Plane scaled(const ImageF& image, bool as_3dgs) {
    Plane plane{image.width, image.height, 3, {}};
    const std::size_t pixels = std::size_t(image.width) * image.height;
    plane.data.resize(3 * pixels);
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t p = 0; p < pixels; ++p) {
            const float v = std::clamp(image.data[p * image.channels + c], 0.0f, 1.0f);
            plane.data[c * pixels + p] = ((as_3dgs ? v : 2 * v - 1) - kShift[c]) / kScale[c];
        }
    return plane;
}

Tensors read_all(const std::vector<std::filesystem::path>& files) {
    Tensors all;
    for (const std::filesystem::path& file : files) {
        Tensors more = read_safetensors(file);
        all.merge(more);
        if (!more.empty())  // names that occurred before are left over
            throw Error(file.string(),
                        "has tensor " + more.begin()->first + ", as a file before it has",
                        "Give the weights of one network: two take two runs of darb compare, the "
                        "second of which trains nothing.");
    }
    return all;
}

std::string names_of(const std::vector<std::filesystem::path>& files) {
    std::string names;
    for (const auto& file : files) names += (names.empty() ? "" : ", ") + file.string();
    return names;
}

}  // namespace

Lpips::Lpips(const std::vector<std::filesystem::path>& files, const LpipsOptions& options)
    : Lpips(read_all(files), names_of(files), options) {}

Lpips::Lpips(const Tensors& tensors, const std::string& where, const LpipsOptions& options)
    : options_(options) {
    const Tensor& first = *tensor_of(tensors, trunk_names(kAlexNet[0], "weight"), where);
    net_ = first.shape.size() == 4 && first.shape[2] == 11 ? LpipsNet::alexnet : LpipsNet::vgg16;
    const bool alexnet = net_ == LpipsNet::alexnet;
    const std::span<const Row> rows = alexnet ? std::span<const Row>(kAlexNet) : kVgg16;
    std::size_t channels = 3;
    for (const Row& row : rows) {
        const Tensor& weight = *tensor_of(tensors, trunk_names(row, "weight"), where);
        const Tensor& bias = *tensor_of(tensors, trunk_names(row, "bias"), where);
        const std::size_t side = !alexnet || row.index > 3 ? 3 : row.index == 0 ? 11 : 5;
        if (weight.shape.size() != 4 || weight.shape[1] != channels || weight.shape[2] != side ||
            weight.shape[3] != side || bias.data.size() != weight.shape[0])
            throw Error(where + ", tensor " + trunk_names(row, "weight").front(),
                        fmt::format("its shape is not [out][{}][{}][{}] of {}", channels, side,
                                    side, net_name()),
                        kSaveWeights);
        layers_.push_back({row.pool, row.stride, row.padding, row.kept, weight, bias.data});
        channels = weight.shape[0];
        if (!row.kept) continue;
        const std::string head = fmt::format("lin{}.model.1.weight", heads_.size());
        const Tensor& lin = *tensor_of(
            tensors, {head, fmt::format("lins.{}.model.1.weight", heads_.size())}, where);
        if (lin.data.size() != channels)
            throw Error(where + ", tensor " + head,
                        fmt::format("it has {} values for {} channels", lin.data.size(), channels),
                        kSaveWeights);
        heads_.push_back(lin.data);
    }
}

std::string_view Lpips::net_name() const {
    return net_ == LpipsNet::alexnet ? "AlexNet" : "VGG16";
}

LpipsFeatures Lpips::features(const ImageF& image) const {
    DARB_CHECK(image.channels >= 3 && std::min(image.width, image.height) >= least_size(),
               "{}x{}x{}", image.width, image.height, image.channels);
    LpipsFeatures features;
    Plane plane = scaled(image, options_.as_3dgs);
    for (const Layer& layer : layers_) {
        if (layer.pool > 0) plane = max_pool(plane, layer.pool);
        plane = convolve_relu(plane, layer.weight, layer.bias, layer.stride, layer.padding,
                              options_.threads);
        if (layer.kept) features.maps.push_back(normalised(plane));
    }
    return features;
}

double Lpips::distance(const LpipsFeatures& a, const LpipsFeatures& b) const {
    double total = 0;
    for (std::size_t l = 0; l < heads_.size(); ++l) {
        const LpipsFeatures::Map &x = a.maps[l], &y = b.maps[l];
        DARB_CHECK(x.data.size() == y.data.size(), "pictures of {} and {} values", x.data.size(),
                   y.data.size());
        double sum = 0;
        for (std::size_t c = 0; c < x.channels; ++c) {
            double squares = 0;
            for (std::size_t p = c * x.pixels; p < (c + 1) * x.pixels; ++p) {
                const double d = double(x.data[p]) - y.data[p];
                squares += d * d;
            }
            sum += heads_[l][c] * squares;
        }
        total += sum / static_cast<double>(x.pixels);
    }
    return total;
}

}  // namespace darb
