# SPDX-License-Identifier: Apache-2.0
"""A camera that shows a made scene again and again, and the boxes of the people in it."""
import os
import pathlib
import tempfile
import unittest

from camera_server import Camera
from made_scene import make_scene

SDMT = os.environ["SDMT_BINARY"]


class SceneCamera(unittest.TestCase):
    """`self.camera`, with boxes for 2,000 frames in `self.path / "det.txt"`."""
    size = (320, 180)
    rate = 20  # frames a second

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        pictures = make_scene(SDMT, self.path, frames=50, walkers=4, size=self.size, shown=40)
        self.camera = Camera([pictures], [[("frames", 100000, self.rate)]])
        self.addCleanup(self.camera.close)
