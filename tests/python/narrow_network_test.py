# SPDX-License-Identifier: Apache-2.0
"""scripts/narrow-network.py: channels that say nothing can go, and the vectors stay."""
import json
import pathlib
import subprocess
import sys
import unittest

import numpy as np

from support import InAFolder, sdmt

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "narrow-network.py"
sys.path.insert(0, str(SCRIPT.parent))

from embeddings import read_embeddings  # noqa: E402
from tensor_file import read_tensors, write_tensors  # noqa: E402

DEAD = {"norm1": [1, 5, 6, 14], "norm2": [0, 8, 9, 20, 23]}


def description(first, second, norm="BatchNorm2d"):
    return {"name": "test", "input": {"height": 32, "width": 16}, "layers": [
        {"name": "conv1", "type": "Conv2d", "out_channels": first, "kernel_size": 3, "stride": 2,
         "padding": 1, "bias": False},
        {"name": "norm1", "type": norm}, {"name": "relu1", "type": "ReLU"},
        {"name": "conv2", "type": "Conv2d", "out_channels": second, "kernel_size": 3, "padding": 1},
        {"name": "norm2", "type": "BatchNorm2d"}, {"name": "relu2", "type": "ReLU"},
        {"name": "stripes", "type": "AvgPool2d", "kernel_size": [4, 8]},
        {"name": "fc", "type": "Linear", "out_features": 12, "bias": False},
        {"name": "bn", "type": "BatchNorm1d", "initial_gamma": 0.1, "initial_beta": 0},
        {"name": "l2", "type": "L2Normalize"}]}


class NarrowNetwork(InAFolder):
    def setUp(self):
        super().setUp()
        rng = np.random.default_rng(4)
        for i in range(5):
            pixels = rng.integers(0, 256, (32, 16, 3), np.uint8)
            (self.path / f"{i}.ppm").write_bytes(b"P6 16 32 255\n" + pixels.tobytes())
        self.begin("wide", description(16, 24), 1)
        metadata, tensors = read_tensors(self.path / "wide")
        for name, values in tensors.items():
            layer, part = name.split(".")
            if layer in DEAD or layer == "bn":
                spread = values + rng.uniform(0.05, 0.4, values.shape).astype(np.float32)
                tensors[name] = spread
            if layer in DEAD and part in ("weight", "bias"):
                tensors[name][DEAD[layer]] = 0
        write_tensors(self.path / "wide", metadata, tensors)

    def begin(self, name, layers, seed):
        (self.path / "layers.json").write_text(json.dumps(layers))
        sdmt("init-model", "--architecture", self.path / "layers.json", "--output",
             self.path / name, "--seed", seed)

    def narrow(self):
        return subprocess.run([sys.executable, "-B", SCRIPT, "wide", "narrow"], cwd=self.path,
                              capture_output=True, text=True)

    def vectors(self, model):
        images = sorted(self.path.glob("*.ppm"))
        sdmt("embed", "--model", self.path / model, "--output", self.path / "vectors", "-q", *images)
        return read_embeddings(self.path / "vectors")[1]

    def test_without_dead_channels_the_vectors_stay(self):
        self.begin("narrow", description(12, 19), 2)
        self.assertGreater(np.abs(self.vectors("narrow") - self.vectors("wide")).max(), 0.1)
        self.assertEqual(self.narrow().returncode, 0)
        np.testing.assert_allclose(self.vectors("narrow"), self.vectors("wide"), atol=2e-6)

    def test_of_those_that_live_the_weakest_go(self):
        self.begin("narrow", description(12, 18), 2)
        self.assertEqual(self.narrow().returncode, 0)
        wide = read_tensors(self.path / "wide")[1]
        readers = wide["fc.weight"].reshape(12, 24, 4)
        worth = [abs(wide["norm2.weight"][c]) * np.sqrt((readers[:, c] ** 2).sum())
                 for c in range(24)]
        stay = sorted(sorted(range(24), key=lambda c: -worth[c])[:18])
        narrow = read_tensors(self.path / "narrow")[1]
        np.testing.assert_array_equal(narrow["norm2.weight"], wide["norm2.weight"][stay])
        np.testing.assert_array_equal(narrow["conv2.bias"], wide["conv2.bias"][stay])

    def test_another_normalisation_keeps_gain_and_shift(self):
        self.begin("narrow", description(16, 24, "InstanceNorm2d"), 2)
        self.assertEqual(self.narrow().returncode, 0)
        wide = read_tensors(self.path / "wide")[1]
        narrow = read_tensors(self.path / "narrow")[1]
        np.testing.assert_array_equal(narrow["norm1.bias"], wide["norm1.bias"])
        self.assertNotIn("norm1.running_mean", narrow)

    def test_networks_of_other_layers_are_refused(self):
        wider, shorter, larger = description(20, 24), description(16, 24), description(16, 24)
        del shorter["layers"][3:6]
        shorter["layers"][3]["kernel_size"] = [4, 8]
        larger["layers"][3].update(kernel_size=5, padding=2)
        for layers, text in ((wider, "conv1 has 20 channels, the wider network 16"),
                             (shorter, "narrow has 2 layers with weights, wide 3"),
                             (larger, "conv2.weight has shape [24, 16, 5, 5], of the wider network "
                                      "[24, 16, 3, 3]: they are not of the same layers")):
            self.begin("narrow", layers, 2)
            before = (self.path / "narrow").read_bytes()
            done = self.narrow()
            self.assertEqual(done.returncode, 1, text)
            self.assertEqual(done.stderr, text + "\n")
            self.assertEqual((self.path / "narrow").read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
