#include "tools/paper/safetensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"

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

/// Bytes of one value of a type that is read; 0 for others.
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

}  // namespace darb
