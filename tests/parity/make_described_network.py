#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes tests/reid/fixtures/described_network.safetensors with PyTorch: a model file of a small network that is
described in its metadata, PyTorch's own state_dict as its weights, and beside them patches and their embeddings."""
import json
import os

import numpy as np
import torch
from torch import nn

from parity_network import MODEL_METADATA, write_safetensors

FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "reid", "fixtures",
                    "described_network.safetensors")
HEIGHT, WIDTH, PATCHES = 32, 16, 5

# Strides, kernels and biases of every kind; a pooling; blocks of a map of 4 x 2, a Linear on the 2 x 2; a normalised end.
LAYERS = [
    {"name": "conv1", "type": "Conv2d", "out_channels": 8, "kernel_size": 3, "stride": 2, "padding": 1, "bias": False},
    {"name": "bn1", "type": "BatchNorm2d"},
    {"name": "relu1", "type": "ReLU"},
    {"name": "conv2", "type": "Conv2d", "out_channels": 16, "kernel_size": 3, "padding": 1},
    {"name": "in2", "type": "InstanceNorm2d"},
    {"name": "relu2", "type": "ReLU"},
    {"name": "pool", "type": "MaxPool2d", "kernel_size": 2},
    {"name": "conv3", "type": "Conv2d", "out_channels": 24, "kernel_size": 5, "stride": 2, "padding": 2, "bias": False},
    {"name": "bn3", "type": "BatchNorm2d"},
    {"name": "conv4", "type": "Conv2d", "out_channels": 12, "kernel_size": 1},
    {"name": "relu4", "type": "ReLU"},
    {"name": "blocks", "type": "AvgPool2d", "kernel_size": [2, 1]},
    {"name": "fc1", "type": "Linear", "out_features": 20},
    {"name": "relu5", "type": "ReLU"},
    {"name": "fc2", "type": "Linear", "out_features": 10, "bias": False},
    {"name": "bn", "type": "BatchNorm1d"},
    {"name": "l2", "type": "L2Normalize"},
]


def build():
    """-> modules by name, in order, as the description says"""
    modules, channels = nn.ModuleDict(), 3
    for layer in LAYERS:
        options = {key: value for key, value in layer.items() if key not in ("name", "type")}
        if layer["type"] == "Conv2d":
            module = nn.Conv2d(channels, **options)
            channels = module.out_channels
        elif layer["type"] == "Linear":
            module = nn.Linear(channels * (4 if layer["name"] == "fc1" else 1), **options)
            channels = module.out_features
        elif layer["type"].startswith("BatchNorm"):
            module = getattr(nn, layer["type"])(channels)
        elif layer["type"] == "InstanceNorm2d":
            module = nn.InstanceNorm2d(channels, affine=True)
        elif layer["type"] == "L2Normalize":
            continue
        else:
            module = getattr(nn, layer["type"])(**options)
        modules[layer["name"]] = module
    return modules


def main():
    torch.manual_seed(1)
    modules = build()
    x = torch.randn(PATCHES, 3, HEIGHT, WIDTH)
    state = modules.state_dict()
    for name, value in state.items():
        if name.endswith("running_var") or name[:2] in ("bn", "in") and name.endswith("weight"):
            value.uniform_(0.5, 1.5)
        elif name.endswith("weight"):
            nn.init.kaiming_normal_(value)
        elif name.endswith("running_mean") or name[:2] in ("bn", "in") and name.endswith("bias"):
            value.uniform_(-0.5, 0.5)
    modules.eval()
    with torch.no_grad():
        y = x
        for name, module in modules.items():
            y = module(y.flatten(1) if name == "fc1" else y)
        y = nn.functional.normalize(y)
    tensors = {name: value.numpy() for name, value in state.items() if not name.endswith("num_batches_tracked")}
    tensors["test.patches"] = x.permute(0, 2, 3, 1).numpy()    # channels last, as we have them
    tensors["test.embeddings"] = y.numpy()
    metadata = dict(MODEL_METADATA, architecture="small", layers=LAYERS)
    metadata["preprocessing"] = dict(MODEL_METADATA["preprocessing"], height=HEIGHT, width=WIDTH)
    write_safetensors(FILE, {name: value.astype(np.float32) for name, value in tensors.items()},
                      {"sdmt": json.dumps(metadata)})
    print(len(tensors), "tensors,", os.path.getsize(FILE), "bytes; mean distance of the embeddings",
          torch.cdist(y, y).mean().item())


main()
