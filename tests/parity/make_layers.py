#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes tests/nn/fixtures/layers.safetensors and normalized_layers.safetensors: what PyTorch computes
for two small networks that have every layer of the engine, their gradients, and their parameters after
steps of SGD and Adam. The second network normalises after each convolution.

Arrays are stored in the engine's order: images NHWC, convolution weights OHWI, the columns of the
fully connected layer in (h, w, c) order. Run from anywhere:  /usr/bin/python3 make_layers.py
"""
import json
import pathlib
import struct

import numpy as np
import torch
from torch import nn

torch.manual_seed(7)
torch.set_num_threads(1)

class Layers(nn.Module):
    input_size = 10, 7  # odd sizes: pooling drops a column, Winograd tiles are cut
    map_size = 5, 3  # that fc reads

    def __init__(self):
        super().__init__()
        self.conv1 = nn.Conv2d(3, 32, 3, padding=1)
        self.conv2 = nn.Conv2d(32, 20, 3, padding=1)
        self.conv3 = nn.Conv2d(20, 12, 3, padding=1)
        self.fc = nn.Linear(12 * 5 * 3, 16)
        self.bn = nn.BatchNorm1d(16)

    def forward(self, x):
        x = torch.relu(self.conv1(x))
        x = torch.relu(self.conv2(x))
        x = nn.functional.max_pool2d(x, 2)
        x = torch.relu(self.conv3(x))
        x = self.fc(x.flatten(1))
        return nn.functional.normalize(self.bn(x))


class NormalizedLayers(nn.Module):
    input_size = 21, 14
    map_size = 3, 2

    def __init__(self):
        super().__init__()
        self.conv1 = nn.Conv2d(3, 32, 3, stride=2, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(32)
        self.conv2 = nn.Conv2d(32, 20, 3, padding=1, bias=False)
        self.in2 = nn.InstanceNorm2d(20, affine=True)
        self.conv3 = nn.Conv2d(20, 12, 3, stride=2, padding=1)
        self.bn3 = nn.BatchNorm2d(12)
        self.fc = nn.Linear(12 * 3 * 2, 16)
        self.bn = nn.BatchNorm1d(16)
        for norm in (self.bn1, self.in2, self.bn3):
            nn.init.uniform_(norm.weight, 0.5, 1.5)
            nn.init.uniform_(norm.bias, -0.5, 0.5)

    def forward(self, x):
        x = torch.relu(self.bn1(self.conv1(x)))
        x = torch.relu(self.in2(self.conv2(x)))
        x = nn.functional.max_pool2d(x, 2)
        x = torch.relu(self.bn3(self.conv3(x)))
        x = self.fc(x.flatten(1))
        return nn.functional.normalize(self.bn(x))


OPTIMIZERS = {
    "sgd": lambda p: torch.optim.SGD(p, lr=0.05, momentum=0.9, weight_decay=0.01),
    "adam": lambda p: torch.optim.Adam(p, lr=0.01, betas=(0.9, 0.99), eps=1e-2, weight_decay=0.01),
}


def engine_order(net, name, tensor):
    t = tensor.detach()
    if name.endswith("fc.weight"):
        return t.reshape(16, -1, *net.map_size).permute(0, 2, 3, 1).reshape(16, -1)
    return t.permute(0, 2, 3, 1) if t.dim() == 4 else t


def compute(kind):
    """Tensors by name, in the engine's order."""
    out = {}
    start = kind()

    def save(name, tensor):
        out[name] = np.ascontiguousarray(engine_order(start, name, tensor).numpy().astype(np.float32))

    def save_state(prefix, net):
        for name, value in net.state_dict().items():
            if not name.endswith("num_batches_tracked"):
                save(f"{prefix}.{name}", value)

    state = {k: v.clone() for k, v in start.state_dict().items()}
    x = torch.randn(4, 3, *kind.input_size)
    target = torch.randn(4, 16)  # the loss is sum(target * y): its gradient is `target`
    save("x", x)
    save("dy", target)
    save_state("start", start)

    start.eval()
    save("inference", start(x))
    start.train()
    x.requires_grad_()
    y = start(x)
    save("training", y)
    (y * target).sum().backward()
    save("dx", x.grad)
    for name, parameter in start.named_parameters():
        save(f"gradient.{name}", parameter.grad)
    x.requires_grad_(False)
    start.eval()
    save("inference after training", start(x))

    for optimizer_name, make in OPTIMIZERS.items():
        net = kind()
        net.load_state_dict(state)
        net.train()
        optimizer = make(net.parameters())  # weight decay on everything, as PyTorch does unasked
        for _ in range(5):
            optimizer.zero_grad()
            (net(x) * target).sum().backward()
            optimizer.step()
        save_state(optimizer_name, net)
    return out


def write(name, tensors):
    header, blobs, offset = {}, [], 0
    for key, array in sorted(tensors.items()):
        blob = array.astype("<f4").tobytes()
        header[key] = {"dtype": "F32", "shape": list(array.shape), "data_offsets": [offset, offset + len(blob)]}
        blobs.append(blob)
        offset += len(blob)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    path = pathlib.Path(__file__).resolve().parent.parent / "nn" / "fixtures" / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(struct.pack("<Q", len(text)) + text + b"".join(blobs))
    print(f"{path}: {path.stat().st_size} bytes, {len(tensors)} tensors, torch {torch.__version__}")


write("layers.safetensors", compute(Layers))
write("normalized_layers.safetensors", compute(NormalizedLayers))
