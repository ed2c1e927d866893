#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes tests/train/fixtures/training.safetensors with PyTorch: the whole network (weights and
pictures by a formula, see parity_network.py) trained for ten steps by the batch-hard contrastive loss.

SGD, as Adam would blow the rounding errors of tiny gradients up to whole steps.

It holds the loss of every step, and of the first step the norm of the gradient of every parameter
and its values at 64 places.
"""
import os

import numpy as np
import torch
import torch.nn.functional as F

from parity_network import as_torch, crop, formula_tensors, hashed, to_input, trunk, write_safetensors

FIXTURE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "train", "fixtures", "training.safetensors")
LABELS = [0, 0, 1, 1, 2, 2]
MARGIN = 2.0      # the distances of these random embeddings are about 1.4, so that push and pull both act
LEARNING_RATE, MOMENTUM = 0.0003, 0.9
STEPS = 10


def training_head(features, tensors):
    """The head with batch statistics."""
    x = F.linear(features.flatten(1), tensors["head.fc1.weight"], tensors["head.fc1.bias"])
    x = F.linear(F.relu(x), tensors["head.fc2.weight"], tensors["head.fc2.bias"])
    x = F.batch_norm(x, tensors["head.bn.running_mean"], tensors["head.bn.running_var"], tensors["head.bn.weight"],
                     tensors["head.bn.bias"], training=True, momentum=0.1)
    return F.normalize(x, dim=1)


def batch_hard(embeddings, labels, margin):
    """1/2 d^2 for the farthest positive, 1/2 max(0, margin - d)^2 for the nearest negative."""
    difference = embeddings[:, None] - embeddings[None]
    distance = (difference.pow(2).sum(2) + 1e-12).sqrt()
    same = labels[:, None] == labels[None]
    self = torch.eye(len(labels), dtype=torch.bool)
    positive = distance.masked_fill(~same | self, -1).max(1)[0]
    negative = distance.masked_fill(same, 9).min(1)[0]
    print("hardest positives", positive.detach().numpy().round(3), "negatives", negative.detach().numpy().round(3))
    return 0.5 * (positive.pow(2).sum() + (margin - negative).clamp_min(0).pow(2).sum()) / (2 * len(labels))


def main():
    torch.set_num_threads(2)
    inputs = torch.from_numpy(np.stack([to_input(crop(i)) for i in range(len(LABELS))]))
    labels = torch.tensor(LABELS)
    tensors = as_torch(formula_tensors())
    parameters = {k: v.requires_grad_() for k, v in tensors.items() if "running" not in k}
    optimizer = torch.optim.SGD(parameters.values(), lr=LEARNING_RATE, momentum=MOMENTUM)
    out, losses = {}, []
    for step in range(STEPS):
        embeddings = training_head(trunk(inputs, tensors), tensors)
        loss = batch_hard(embeddings, labels, MARGIN)
        optimizer.zero_grad()
        loss.backward()
        losses.append(loss.item())
        print(step, loss.item(), flush=True)
        if step == 0:
            out["embeddings"] = embeddings.detach().float().numpy()
            for i, (name, parameter) in enumerate(parameters.items()):
                gradient = parameter.grad.flatten()
                places = (hashed(64, 900 + i).astype(np.float64) * gradient.numel()).astype(np.int64)
                out[f"{name}.norm"] = gradient.double().norm().reshape(1).float().numpy()
                out[f"{name}.positions"] = places
                out[f"{name}.gradient"] = gradient[torch.from_numpy(places)].float().numpy()
        optimizer.step()
    out["losses"] = np.array(losses, np.float64)
    out["running_mean"] = tensors["head.bn.running_mean"].float().numpy()
    out["running_var"] = tensors["head.bn.running_var"].float().numpy()
    write_safetensors(FIXTURE, out)


main()
