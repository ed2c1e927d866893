#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes tests/nn/fixtures/layers.safetensors: what PyTorch computes for a small network with every
layer of the engine, its gradients, and its parameters after steps of SGD and Adam.

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

H, W = 10, 7  # odd sizes: pooling drops a column, Winograd tiles are cut
POOLED_H, POOLED_W = H // 2, W // 2


class Net(nn.Module):
    def __init__(self):
        super().__init__()
        self.conv1 = nn.Conv2d(3, 32, 3, padding=1)
        self.conv2 = nn.Conv2d(32, 20, 3, padding=1)
        self.conv3 = nn.Conv2d(20, 12, 3, padding=1)
        self.fc = nn.Linear(12 * POOLED_H * POOLED_W, 16)
        self.bn = nn.BatchNorm1d(16)

    def forward(self, x):
        x = torch.relu(self.conv1(x))
        x = torch.relu(self.conv2(x))
        x = nn.functional.max_pool2d(x, 2)
        x = torch.relu(self.conv3(x))
        x = self.fc(x.flatten(1))
        return nn.functional.normalize(self.bn(x))


def engine_order(name, tensor):
    t = tensor.detach()
    if name.endswith("conv1.weight") or name.endswith("conv2.weight") or name.endswith("conv3.weight"):
        return t.permute(0, 2, 3, 1)
    if name.endswith("fc.weight"):
        return t.reshape(16, 12, POOLED_H, POOLED_W).permute(0, 2, 3, 1).reshape(16, -1)
    if t.dim() == 4:
        return t.permute(0, 2, 3, 1)
    return t


out = {}


def save(name, tensor):
    out[name] = np.ascontiguousarray(engine_order(name, tensor).numpy().astype(np.float32))


def save_parameters(prefix, net):
    for name, parameter in net.named_parameters():
        save(f"{prefix}.{name}", parameter)
    save(f"{prefix}.bn.running_mean", net.bn.running_mean)
    save(f"{prefix}.bn.running_var", net.bn.running_var)


start = Net()
state = {k: v.clone() for k, v in start.state_dict().items()}
x = torch.randn(4, 3, H, W)
target = torch.randn(4, 16)  # the loss is sum(target * y): its gradient is `target`
save("x", x)
save("dy", target)
save_parameters("start", start)

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

optimizers = {
    "sgd": lambda p: torch.optim.SGD(p, lr=0.05, momentum=0.9, weight_decay=0.01),
    "adam": lambda p: torch.optim.Adam(p, lr=0.01, betas=(0.9, 0.99), eps=1e-2, weight_decay=0.01),
}
for kind, make in optimizers.items():
    net = Net()
    net.load_state_dict(state)
    net.train()
    optimizer = make(net.parameters())  # weight decay on everything, as PyTorch does unasked
    for _ in range(5):
        optimizer.zero_grad()
        (net(x) * target).sum().backward()
        optimizer.step()
    save_parameters(kind, net)

header, blobs, offset = {}, [], 0
for name, array in sorted(out.items()):
    blob = array.astype("<f4").tobytes()
    header[name] = {"dtype": "F32", "shape": list(array.shape), "data_offsets": [offset, offset + len(blob)]}
    blobs.append(blob)
    offset += len(blob)
text = json.dumps(header, separators=(",", ":")).encode()
text += b" " * (-len(text) % 8)
path = pathlib.Path(__file__).resolve().parent.parent / "nn" / "fixtures" / "layers.safetensors"
path.parent.mkdir(exist_ok=True)
path.write_bytes(struct.pack("<Q", len(text)) + text + b"".join(blobs))
print(f"{path}: {path.stat().st_size} bytes, {len(out)} tensors, torch {torch.__version__}")
