// SPDX-License-Identifier: MIT
// LPIPS, the learned perceptual distance of two pictures (Zhang et al. 2018, version 0.1), on the
// CPU, with weights from files that the user provides.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"

namespace darb {

struct Tensor {
    std::vector<std::size_t> shape;
    std::vector<float> data;  // row-major, the last index fastest
};

using Tensors = std::map<std::string, Tensor>;

/// Throws Error naming the file and the tensor where this is not a safetensors file, is truncated,
/// has inconsistent sizes, or a type other than F32, F16, BF16 and F64 (which become float32;
/// integers are skipped).
Tensors read_safetensors(const std::filesystem::path& path);
Tensors parse_safetensors(std::span<const std::byte> file, const std::string& where);

enum class LpipsNet { alexnet, vgg16 };

struct LpipsOptions {
    /// The lpips package and its paper map colours from [0, 1] to [-1, 1] first. The evaluation
    /// code of 3DGS does not, and numbers published in splat papers are without it.
    bool as_3dgs = false;
    int threads = 0;  // 0: one per core
};

/// The five feature maps of a picture, each normalised over its channels.
struct LpipsFeatures {
    struct Map {
        std::size_t channels = 0, pixels = 0;
        std::vector<float> data;  // [channels][pixels]
    };
    std::vector<Map> maps;

    std::size_t bytes() const {
        std::size_t floats = 0;
        for (const Map& map : maps) floats += map.data.size();
        return floats * sizeof(float);
    }
};

class Lpips {
  public:
    /// The tensors of all files together. Trunk: features.N.weight and .bias as torchvision names
    /// them (AlexNet 0 3 6 8 10; VGG16 0 2 5 7 10 12 14 17 19 21 24 26 28), or net.sliceK.N.* as in
    /// the lpips package. Heads: linK.model.1.weight, K = 0 to 4. The size of the first filter
    /// determines the network. Throws Error naming a tensor that is missing, has a wrong shape, or
    /// is in two files.
    explicit Lpips(const std::vector<std::filesystem::path>& files,
                   const LpipsOptions& options = {});
    Lpips(const Tensors& tensors, const std::string& where, const LpipsOptions& options = {});

    LpipsNet net() const { return net_; }
    std::string_view net_name() const;  // "AlexNet", "VGG16"
    /// The least width and height of pictures, px.
    int least_size() const { return net_ == LpipsNet::alexnet ? 31 : 16; }

    /// image: RGB in [0, 1].
    LpipsFeatures features(const ImageF& image) const;
    double distance(const LpipsFeatures& a, const LpipsFeatures& b) const;
    double distance(const ImageF& a, const ImageF& b) const {
        return distance(features(a), features(b));
    }

  private:
    struct Layer {
        int pool = 0;  // side of the max pooling before it, stride 2; 0: none
        int stride = 1, padding = 0;
        bool kept = false;  // its output is one of the five maps
        Tensor weight;      // [out][in][k][k]
        std::vector<float> bias;
    };

    LpipsNet net_ = LpipsNet::alexnet;
    LpipsOptions options_;
    std::vector<Layer> layers_;
    std::vector<std::vector<float>> heads_;  // [5][channels]
};

}  // namespace darb
