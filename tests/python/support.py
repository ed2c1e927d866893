# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python module share. Environment: SDMT_BINARY, SDMT_SHARE_DIR."""
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, FRAMES = 160, 120, 25


def sdmt(*arguments):
    """Runs the command line."""
    return subprocess.run([os.environ["SDMT_BINARY"], *map(str, arguments)], check=True,
                          capture_output=True, text=True).stdout


class InAFolder(unittest.TestCase):
    """Has a folder of its own, self.path."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name)


def images():
    """A person in red and one in blue, who cross, before noise; RGB."""
    noise = np.random.default_rng(1)
    for t in range(FRAMES):
        image = noise.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
        for (left, top, width, height), colour in zip(boxes(t), ((200, 30, 30), (30, 30, 200))):
            image[int(top) - 1:int(top + height) - 1, int(left) - 1:int(left + width) - 1] = colour
        yield image


def boxes(t):
    return np.array([[10.0 + 4 * t, 31, 20, 50], [130.0 - 4 * t, 41, 20, 50]])


def scores(t):
    return np.array([0.9, 0.7 + 0.01 * t])


def write_sequence(folder):
    """The same as a MOTChallenge sequence whose images lose nothing."""
    folder = Path(folder)
    for part in ("img1", "det", "gt"):
        (folder / part).mkdir(parents=True)
    (folder / "seqinfo.ini").write_text(
        f"[Sequence]\nname={folder.name}\nimDir=img1\nframeRate=10\nseqLength={FRAMES}\n"
        f"imWidth={WIDTH}\nimHeight={HEIGHT}\nimExt=.ppm\n")
    detections, truth = "", ""
    for t, image in enumerate(images()):
        header = f"P6 {WIDTH} {HEIGHT} 255\n".encode()
        (folder / "img1" / f"{t + 1:06}.ppm").write_bytes(header + image.tobytes())
        for person, (box, score) in enumerate(zip(boxes(t), scores(t)), 1):
            row = ",".join(map(str, box))
            detections += f"{t + 1},-1,{row},{score},-1,-1,-1\n"
            truth += f"{t + 1},{person},{row},1,1,1\n"
    (folder / "det" / "det.txt").write_text(detections)
    (folder / "gt" / "gt.txt").write_text(truth)
    return folder
