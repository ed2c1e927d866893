#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Begins a narrower network with the weights of a wider one.

  sdmt init-model --architecture narrower.json --output begun.safetensors
  narrow-network.py FROM.safetensors begun.safetensors

Both have the same convolutions and fully connected layers in the same order, each followed by a
normalisation or none, and vectors of the same size; the second has fewer channels, other
normalisations, or both. Of a convolution those channels stay that count most for what reads them:
the gain of its normalisation times the length of the weights that read the channel, whose own
choice was made before. Where an instance normalisation becomes a batch normalisation, the running
statistics remain those of `init-model`: train before you use it. Needs python3-numpy.
"""
import argparse
import json
import math

import numpy as np

from tensor_file import read_tensors, write_tensors

NORMS = ("BatchNorm2d", "InstanceNorm2d", "BatchNorm1d")


def read_model(path):
    try:
        metadata, tensors = read_tensors(path)
        return metadata, tensors, stages(metadata)
    except (ValueError, KeyError) as error:
        raise SystemExit(f"{path}: is no model file ({error})")


def stages(metadata):
    """(layer with weights, normalisation after it or None) in order, by stored name."""
    found = []
    for layer in json.loads(metadata["sdmt"])["layers"]:
        name = layer.get("stored_as", layer["name"])
        if layer["type"] in ("Conv2d", "Linear"):
            found.append([name, None])
        elif layer["type"] in NORMS and found and found[-1][1] is None:
            found[-1][1] = name
    return found


def read_by(weight, channels):
    """The weights [out, ..., in, positions] of a layer, by the channel that they read."""
    return weight.reshape(weight.shape[0], channels, -1)


def narrow(wide_stages, wide, into_stages, into):
    out = dict(into)
    before, kept = 0, None  # channels of the layer before, and those of them that stay
    for i, ((name, norm), (to, to_norm)) in enumerate(zip(wide_stages, into_stages)):
        weight = wide[name + ".weight"]
        channels, wanted = weight.shape[0], into[to + ".weight"].shape[0]
        if i + 1 < len(wide_stages):
            readers = read_by(wide[wide_stages[i + 1][0] + ".weight"], channels)
            gain = wide[norm + ".weight"] if norm else np.ones(channels, np.float32)
            worth = np.abs(gain) * np.sqrt((readers ** 2).sum((0, 2)))
            stay = np.sort(np.argsort(-worth, kind="stable")[:wanted])
        else:
            stay = np.arange(channels)
        if len(stay) != wanted:
            raise SystemExit(f"{to} has {wanted} channels, the wider network {channels}")
        rows = weight[stay]
        if kept is not None:
            rows = read_by(rows, before)[:, kept]
        expected = into[to + ".weight"].shape
        if rows.size != math.prod(expected):
            raise SystemExit(f"{to}.weight has shape {list(expected)}, of the wider network "
                             f"{list(weight.shape)}: they are not of the same layers")
        out[to + ".weight"] = np.ascontiguousarray(rows.reshape(expected))
        if f"{to}.bias" in into and f"{name}.bias" in wide:
            out[f"{to}.bias"] = wide[f"{name}.bias"][stay]
        for part in ("weight", "bias", "running_mean", "running_var"):
            if norm and to_norm and f"{norm}.{part}" in wide and f"{to_norm}.{part}" in into:
                out[f"{to_norm}.{part}"] = wide[f"{norm}.{part}"][stay]
        before, kept = channels, stay
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("wide", metavar="FROM")
    parser.add_argument("into", metavar="INTO")
    arguments = parser.parse_args()
    _, wide, wide_stages = read_model(arguments.wide)
    metadata, into, into_stages = read_model(arguments.into)
    if len(wide_stages) != len(into_stages):
        raise SystemExit(f"{arguments.into} has {len(into_stages)} layers with weights, "
                         f"{arguments.wide} {len(wide_stages)}")
    write_tensors(arguments.into, metadata, narrow(wide_stages, wide, into_stages, into))
    print(f"{arguments.into}: {sum(v.size for v in into.values()):,} of "
          f"{sum(v.size for v in wide.values()):,} values")


if __name__ == "__main__":
    main()
