#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the fixtures of the network's parity tests with PyTorch and OpenCV.

  make_network.py [TRUNK.safetensors]

Writes tests/reid/fixtures/network.safetensors: for each layer the sum of every picture's values and
values sampled over the batch; the inputs and the embeddings. With TRUNK (the VGG-16 convolutions,
torchvision names) also fixtures/vgg16_conv3_3.safetensors: its features of one picture, sampled.
"""
import os
import sys

import numpy as np
import torch

from parity_network import (CROPS, as_torch, crop, formula_tensors, hashed, head, read_safetensors, resized, to_input,
                            trunk, write_safetensors)

FIXTURES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "reid", "fixtures")


def sampled(value, count, stream):
    """-> positions in the flattened NCHW array, values there"""
    positions = (hashed(count, stream).astype(np.float64) * value.numel()).astype(np.int64)
    return positions, value.flatten()[torch.from_numpy(positions)].numpy()


def cut_out(out, count=150):
    """Rectangles of the largest picture, stretched by OpenCV: a checksum of each, to the bit."""
    picture = crop(CROPS - 1)
    height, width = picture.shape[:2]
    h = hashed(4 * count, 400).reshape(count, 4)
    w = 2 + (h[:, 0] * (width - 2)).astype(np.int64)
    t = 2 + (h[:, 1] * (height - 2)).astype(np.int64)
    x, y = (h[:, 2] * (width - w + 1)).astype(np.int64), (h[:, 3] * (height - t + 1)).astype(np.int64)
    w[:3], t[:3], x[:3], y[:3] = (64, 128, 2), (128, 256, 2), 0, 0     # no change, exactly half, smallest
    out["patches.rects"] = np.stack([x, y, w, t], 1)
    weights = (hashed(128 * 64 * 3, 401) * 2 ** 24).astype(np.int64)
    out["patches.checksums"] = np.array([np.sum(resized(picture[b:b + d, a:a + c])[:, :, ::-1].ravel() * weights)
                                         for a, b, c, d in out["patches.rects"]])


def main():
    torch.set_num_threads(2)
    out = {}

    def keep(name, value, samples=128):
        out[f"{name}.sums"] = value.double().flatten(1).sum(1).numpy()
        out[f"{name}.largest"] = value.abs().max().reshape(1).numpy()
        out[f"{name}.positions"], out[f"{name}.values"] = sampled(value, samples, 500 + len(out))

    inputs = torch.from_numpy(np.stack([to_input(crop(i)) for i in range(CROPS)]))
    tensors = as_torch(formula_tensors())
    cut_out(out)
    with torch.no_grad():
        keep("input", inputs, 1024)
        features = trunk(inputs, tensors, keep)
        keep("features", features, 8192)
        out["embeddings"] = head(features, tensors, keep).numpy()
    write_safetensors(os.path.join(FIXTURES, "network.safetensors"), out)
    e = out["embeddings"]
    print("mean distance of the embeddings", np.mean([np.linalg.norm(a - b) for a in e for b in e]))

    if len(sys.argv) > 1:
        out = {}
        with torch.no_grad():
            keep("features", trunk(inputs[:1], as_torch(read_safetensors(sys.argv[1])[0])), 2048)
        write_safetensors(os.path.join(FIXTURES, "vgg16_conv3_3.safetensors"), out)


main()
