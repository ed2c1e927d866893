# SPDX-License-Identifier: Apache-2.0
"""The embedding network in PyTorch, with weights and pictures made by a formula.

The C++ tests compute the same formula (tests/nn/formula_network.h), so that only results have to be
stored. Everything here follows PyTorch and OpenCV, nothing follows our code.
"""
import json
import struct

import cv2
import numpy as np
import torch
import torch.nn.functional as F

MEAN = np.array([0.485, 0.456, 0.406], np.float32)
STD = np.array([0.229, 0.224, 0.225], np.float32)
CONVOLUTIONS = [("conv1_1", 0, 3, 64), ("conv1_2", 2, 64, 64), ("conv2_1", 5, 64, 128), ("conv2_2", 7, 128, 128),
                ("conv3_1", 10, 128, 256), ("conv3_2", 12, 256, 256), ("conv3_3", 14, 256, 256)]
POOL_BEFORE = {"conv2_1": "pool1", "conv3_1": "pool2"}
EMBEDDING = 128
CROPS = 16


def hashed(count, stream):
    """`count` numbers in [0, 1), multiples of 2^-24: exact in float32."""
    x = np.arange(count, dtype=np.uint32) + np.uint32(stream * 0x9E3779B9 & 0xFFFFFFFF)
    x ^= x >> np.uint32(16)
    x *= np.uint32(0x7FEB352D)
    x ^= x >> np.uint32(15)
    x *= np.uint32(0x846CA68B)
    x ^= x >> np.uint32(16)
    return (x >> np.uint32(8)).astype(np.float32) * np.float32(2.0 ** -24)


def uniform(shape, stream, low, high):
    low, high = np.float32(low), np.float32(high)
    return (low + (high - low) * hashed(int(np.prod(shape)), stream)).reshape(shape)


def formula_tensors():
    """name in the file -> array in PyTorch's order. Streams count up in this order."""
    tensors, stream = {}, 1

    def add(name, shape, low, high):
        nonlocal stream
        tensors[name] = uniform(shape, stream, low, high)
        stream += 1

    def add_matrix(name, shape):
        bound = np.float32(np.sqrt(6.0 / np.prod(shape[1:])))      # He: variance 2 / inputs
        add(name + ".weight", shape, -bound, bound)
        add(name + ".bias", (shape[0],), -0.1, 0.1)

    for _, index, inputs, outputs in CONVOLUTIONS:
        add_matrix(f"features.{index}", (outputs, inputs, 3, 3))
    add_matrix("head.fc1", (EMBEDDING, 256 * 32 * 16))
    add_matrix("head.fc2", (EMBEDDING, EMBEDDING))
    add("head.bn.weight", (EMBEDDING,), 0.5, 1.5)
    add("head.bn.bias", (EMBEDDING,), -0.5, 0.5)
    add("head.bn.running_mean", (EMBEDDING,), -0.5, 0.5)
    add("head.bn.running_var", (EMBEDDING,), 0.5, 1.5)
    return tensors


def crop(i):
    """Picture i, 8-bit BGR: patches of colour under noise, from smaller to larger than the input."""
    height, width = 40 + 17 * i, 20 + 9 * i
    blocks = hashed(((height + 7) // 8) * ((width + 7) // 8) * 3, 1000 + 2 * i)
    blocks = blocks.reshape((height + 7) // 8, (width + 7) // 8, 3)
    blocks = blocks.repeat(8, 0).repeat(8, 1)[:height, :width]
    noise = hashed(height * width * 3, 1001 + 2 * i).reshape(height, width, 3)
    return (blocks * np.float32(192) + noise * np.float32(63)).astype(np.uint8)


def normalized(rgb):
    return (rgb.astype(np.float32) / np.float32(255) - MEAN) / STD


def resized(bgr):
    return cv2.resize(bgr, (64, 128), interpolation=cv2.INTER_LINEAR)


def to_input(bgr):
    """[3,128,64] float32"""
    return normalized(resized(bgr)[:, :, ::-1]).transpose(2, 0, 1)


def trunk(x, tensors, keep=lambda name, value: None):
    for name, index, _, _ in CONVOLUTIONS:
        if name in POOL_BEFORE:
            x = F.max_pool2d(x, 2)
            keep(POOL_BEFORE[name], x)
        x = F.conv2d(x, tensors[f"features.{index}.weight"], tensors[f"features.{index}.bias"], padding=1)
        keep(name, x)
        x = F.relu(x)
    return x


def head(x, tensors, keep=lambda name, value: None):
    x = F.linear(x.flatten(1), tensors["head.fc1.weight"], tensors["head.fc1.bias"])
    keep("fc1", x)
    x = F.linear(F.relu(x), tensors["head.fc2.weight"], tensors["head.fc2.bias"])
    keep("fc2", x)
    x = F.batch_norm(x, tensors["head.bn.running_mean"], tensors["head.bn.running_var"],
                     tensors["head.bn.weight"], tensors["head.bn.bias"], training=False)
    keep("bn", x)
    return F.normalize(x, dim=1)


DTYPES = {"F64": "<f8", "F32": "<f4", "F16": "<f2", "I64": "<i8", "U8": "u1", "I8": "i1"}


def write_safetensors(path, tensors, metadata=None):
    header, offset, parts = {}, 0, []
    if metadata:
        header["__metadata__"] = metadata
    for name, value in tensors.items():
        value = np.ascontiguousarray(value)
        dtype = next(k for k, v in DTYPES.items() if np.dtype(v) == value.dtype)
        header[name] = {"dtype": dtype, "shape": list(value.shape), "data_offsets": [offset, offset + value.nbytes]}
        offset += value.nbytes
        parts.append(value.tobytes())
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with open(path, "wb") as f:
        f.write(struct.pack("<Q", len(text)) + text + b"".join(parts))


def read_safetensors(path):
    with open(path, "rb") as f:
        (length,) = struct.unpack("<Q", f.read(8))
        header = json.loads(f.read(length))
        data = f.read()
    metadata = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        tensors[name] = np.frombuffer(data[begin:end], DTYPES[entry["dtype"]]).reshape(entry["shape"])
    return tensors, metadata


MODEL_METADATA = {
    "format_version": 1,
    "architecture": "vgg16-conv3_3-fc128-fc128",
    "preprocessing": {"height": 128, "width": 64, "channel_order": "rgb", "mean": [0.485, 0.456, 0.406],
                      "std": [0.229, 0.224, 0.225]},
    "flatten_order": "CHW",
    "margin": 0.2,
    "provenance": "made by a formula for tests",
}


def as_torch(tensors):
    return {name: torch.from_numpy(np.array(value, np.float32)) for name, value in tensors.items()}
