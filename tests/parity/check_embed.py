#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares `sdmt embed` on image files with the same pipeline in PyTorch and OpenCV.

  check_embed.py SDMT [MODEL IMAGE...]

Without MODEL, weights and pictures are those of the formula. Fails when an embedding differs by more
than 1e-3; exits with 77 (skipped) where PyTorch or OpenCV cannot be imported.
"""
import os
import subprocess
import sys
import tempfile

try:
    import cv2
    import numpy as np
    import torch

    import parity_network as parity
except ImportError as error:
    print("skipped:", error)
    sys.exit(77)


def main():
    sdmt, model, images = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None, sys.argv[3:]
    with tempfile.TemporaryDirectory() as folder:
        if model is None:
            model = os.path.join(folder, "model.safetensors")
            parity.write_safetensors(model, parity.formula_tensors(),
                                     {"sdmt": parity.json.dumps(parity.MODEL_METADATA)})
            for i in range(parity.CROPS):
                images.append(os.path.join(folder, f"{i}.png"))
                cv2.imwrite(images[-1], parity.crop(i))
        output = os.path.join(folder, "embeddings.safetensors")
        subprocess.run([sdmt, "embed", "--model", model, "--output", output, *images], check=True)
        ours = parity.read_safetensors(output)[0]["embeddings"]
        tensors = parity.as_torch(parity.read_safetensors(model)[0])
        inputs = torch.from_numpy(np.stack([parity.to_input(cv2.imread(name)) for name in images]))
        with torch.no_grad():
            theirs = torch.cat([parity.head(parity.trunk(x, tensors), tensors) for x in inputs.split(32)]).numpy()
    worst = np.abs(ours - theirs).max()
    print(f"{len(images)} images, largest difference {worst:.2e}")
    return 0 if ours.shape == theirs.shape and worst <= 1e-3 else 1


sys.exit(main())
