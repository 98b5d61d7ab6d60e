#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""LPIPS in PyTorch on random weights, as the truth of lpips_test.

    lpips_torch.py alexnet|vgg16 CHANNEL_DIVISOR OUT

Writes OUT/weights.safetensors (torchvision's names for the trunk, the lpips package's for the heads),
OUT/a.bin and OUT/b.bin (float32 pictures [H][W][3] in [0, 1], OUT/size.txt has W and H) and prints
the distance with colours in [-1, 1] and with colours in [0, 1]. Exit code 77: no PyTorch.
"""

import json
import struct
import sys

try:
    import torch
    import torch.nn.functional as F
except ImportError:
    sys.exit(77)

NETS = {  # (index of features.N, channels, side, stride, padding, max pooling before, kept)
    "alexnet": [(0, 64, 11, 4, 2, 0, True), (3, 192, 5, 1, 2, 3, True), (6, 384, 3, 1, 1, 3, True),
                (8, 256, 3, 1, 1, 0, True), (10, 256, 3, 1, 1, 0, True)],
    "vgg16": [(0, 64, 3, 1, 1, 0, False), (2, 64, 3, 1, 1, 0, True), (5, 128, 3, 1, 1, 2, False),
              (7, 128, 3, 1, 1, 0, True), (10, 256, 3, 1, 1, 2, False),
              (12, 256, 3, 1, 1, 0, False), (14, 256, 3, 1, 1, 0, True),
              (17, 512, 3, 1, 1, 2, False), (19, 512, 3, 1, 1, 0, False),
              (21, 512, 3, 1, 1, 0, True), (24, 512, 3, 1, 1, 2, False),
              (26, 512, 3, 1, 1, 0, False), (28, 512, 3, 1, 1, 0, True)],
}
SHIFT = torch.tensor([-0.030, -0.088, -0.188]).view(1, 3, 1, 1)
SCALE = torch.tensor([0.458, 0.448, 0.450]).view(1, 3, 1, 1)


def random_weights(net, divisor):
    tensors, channels, kept = {}, 3, 0
    for index, out, side, _, _, _, keep in NETS[net]:
        out //= divisor
        deviation = (2 / (channels * side * side)) ** 0.5
        tensors[f"features.{index}.weight"] = torch.randn(out, channels, side, side) * deviation
        tensors[f"features.{index}.bias"] = torch.randn(out) * 0.1
        if keep:
            tensors[f"lin{kept}.model.1.weight"] = torch.rand(1, out, 1, 1)
            kept += 1
        channels = out
    return tensors


def features(net, tensors, image):
    maps, x = [], (image - SHIFT) / SCALE
    for index, _, _, stride, padding, pool, keep in NETS[net]:
        if pool:
            x = F.max_pool2d(x, pool, 2)
        x = F.relu(F.conv2d(x, tensors[f"features.{index}.weight"],
                            tensors[f"features.{index}.bias"], stride, padding))
        if keep:
            maps.append(x / (x.pow(2).sum(1, keepdim=True).sqrt() + 1e-10))
    return maps


def distance(net, tensors, a, b):
    total = 0.0
    for k, (x, y) in enumerate(zip(features(net, tensors, a), features(net, tensors, b))):
        total += F.conv2d((x - y) ** 2, tensors[f"lin{k}.model.1.weight"]).mean().item()
    return total


def write_safetensors(path, tensors):
    header, data = {"__metadata__": {"format": "pt"}}, b""
    for name, tensor in tensors.items():
        values = tensor.contiguous().numpy().astype("<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape),
                        "data_offsets": [len(data), len(data) + len(values)]}
        data += values
    text = json.dumps(header).encode()
    with open(path, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + data)


def main():
    net, divisor, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    torch.manual_seed(7)
    torch.set_num_threads(2)
    tensors = random_weights(net, divisor)
    a = torch.rand(1, 3, 61, 83)
    b = (a + 0.2 * torch.randn(1, 3, 61, 83)).clamp(0, 1)
    write_safetensors(f"{out}/weights.safetensors", tensors)
    for name, image in (("a", a), ("b", b)):
        with open(f"{out}/{name}.bin", "wb") as file:
            file.write(image[0].permute(1, 2, 0).contiguous().numpy().astype("<f4").tobytes())
    with open(f"{out}/size.txt", "w", encoding="utf-8") as file:
        file.write("83 61\n")
    with torch.no_grad():
        print(distance(net, tensors, 2 * a - 1, 2 * b - 1), distance(net, tensors, a, b))


main()
