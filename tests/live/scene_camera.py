# SPDX-License-Identifier: Apache-2.0
"""A camera that shows a made scene again and again, and the boxes of the people in it."""
import os
import pathlib
import subprocess
import tempfile
import unittest

from camera_server import Camera

SDMT = os.environ["SDMT_BINARY"]


class SceneCamera(unittest.TestCase):
    """`self.camera`, with boxes for 2,000 frames in `self.path / "det.txt"`."""
    size = (320, 180)
    rate = 20  # frames a second

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        scene = self.path / "scene"
        width, height = map(str, self.size)
        subprocess.run([SDMT, "synth", "scene", "--output", scene, "--frames", "50", "--walkers",
                        "4", "--width", width, "--height", height], check=True, capture_output=True)
        pictures = [file.read_bytes() for file in sorted((scene / "img1").iterdir())]
        self.camera = Camera([pictures], [[("frames", 100000, self.rate)]])
        self.addCleanup(self.camera.close)
        rows = (scene / "det/det.txt").read_text().split("\n")
        boxes = [row.split(",", 1) for row in rows if row]
        (self.path / "det.txt").write_text("".join(
            f"{int(frame) + 50 * turn},{rest}\n" for turn in range(40) for frame, rest in boxes))
