# SPDX-License-Identifier: Apache-2.0
"""The network in libtorch (through PyTorch), asked as peer.h says:  peer_torch.py MODEL THREADS
With --onnx FILE it writes the network for ONNX Runtime instead."""
import json
import os
import struct
import sys
import time

import numpy as np
import torch
from torch import nn

CONVOLUTIONS = [(0, 3, 64), (2, 64, 64), "pool", (5, 64, 128), (7, 128, 128), "pool",
                (10, 128, 256), (12, 256, 256), (14, 256, 256)]


def read_safetensors(path):
    data = open(path, "rb").read()
    (length,) = struct.unpack_from("<Q", data)
    header = json.loads(data[8:8 + length])
    header.pop("__metadata__", None)
    types = {"F32": "<f4", "F16": "<f2"}
    tensors = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        values = np.frombuffer(data[8 + length + begin:8 + length + end], types[entry["dtype"]])
        tensors[name] = torch.from_numpy(values.astype(np.float32).reshape(entry["shape"]))
    return tensors


class Network(nn.Module):
    def __init__(self, tensors):
        super().__init__()
        layers = []
        for item in CONVOLUTIONS:
            if item == "pool":
                layers.append(nn.MaxPool2d(2))
                continue
            index, inputs, outputs = item
            conv = nn.Conv2d(inputs, outputs, 3, padding=1)
            conv.weight.data = tensors[f"features.{index}.weight"]
            conv.bias.data = tensors[f"features.{index}.bias"]
            layers += [conv, nn.ReLU()]
        self.trunk = nn.Sequential(*layers)
        self.fc1, self.fc2 = nn.Linear(131072, 128), nn.Linear(128, 128)
        self.bn = nn.BatchNorm1d(128)
        for name, layer in (("fc1", self.fc1), ("fc2", self.fc2), ("bn", self.bn)):
            layer.weight.data = tensors[f"head.{name}.weight"]
            layer.bias.data = tensors[f"head.{name}.bias"]
        self.bn.running_mean.data = tensors["head.bn.running_mean"]
        self.bn.running_var.data = tensors["head.bn.running_var"]

    def forward(self, x):
        x = torch.flatten(self.trunk(x), 1)
        return nn.functional.normalize(self.bn(self.fc2(torch.relu(self.fc1(x)))))


def patches(batch):
    bits = np.arange(batch * 128 * 64 * 3, dtype=np.uint64) * 2654435761 & 0xFFFFFFFF
    values = ((bits >> 8) & 0xFFFF).astype(np.float32) / 16384.0 - 2.0
    nhwc = torch.from_numpy(values.reshape(batch, 128, 64, 3))
    return nhwc.permute(0, 3, 1, 2).contiguous()


def train_step(net, optimizer, x, frozen):
    optimizer.zero_grad()
    if frozen:
        with torch.no_grad():
            features = torch.flatten(net.trunk(x), 1)
        y = nn.functional.normalize(net.bn(net.fc2(torch.relu(net.fc1(features)))))
    else:
        y = net(x)
    y.backward(y.detach())  # the gradient of the loss is the embedding itself
    optimizer.step()


def main():
    net = Network(read_safetensors(sys.argv[1])).eval()
    if sys.argv[2] == "--onnx":
        torch.onnx.export(net, patches(2), sys.argv[3], input_names=["patches"],
                          output_names=["embeddings"], opset_version=13,
                          dynamic_axes={"patches": {0: "n"}, "embeddings": {0: "n"}})
        return
    torch.set_num_threads(int(sys.argv[2]))
    trained = Network(read_safetensors(sys.argv[1])).train()
    head = [p for n, p in trained.named_parameters() if not n.startswith("trunk")]
    optimizers = {"all": torch.optim.SGD(trained.parameters(), 1e-6, momentum=0.9),
                  "frozen": torch.optim.SGD(head, 1e-6, momentum=0.9)}
    clock = time.process_time if "PEER_CPU_TIME" in os.environ else time.perf_counter
    inputs = {}
    for line in sys.stdin:
        words = line.split()
        batch = int(words[1])
        if batch not in inputs:
            inputs[batch] = patches(batch)
        x = inputs[batch]
        start = clock()
        if words[0] == "train":
            train_step(trained, optimizers[words[2]], x, words[2] == "frozen")
        else:
            with torch.inference_mode():
                y = net(x)
        elapsed = (clock() - start) * 1e3
        if words[0] == "values":
            print(*y[[0, -1]].flatten().tolist(), flush=True)
        else:
            print(f"{elapsed:.4f}", flush=True)


main()
