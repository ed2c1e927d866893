# SPDX-License-Identifier: Apache-2.0
"""Every block of Python and of shell (```sh) in the documentation runs, page by page."""
import contextlib
import io
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import sdmt
import support

DOCS = Path(__file__).parents[2] / "docs"


def network(image):
    """A detector that gives corners and classes."""
    boxes = support.boxes(network.calls % support.FRAMES)
    network.calls += 1
    corners = boxes - [1, 1, 0, 0]
    corners[:, 2:] += corners[:, :2]
    return SimpleNamespace(xyxy=corners, confidence=np.array([0.9, 0.8]), class_id=np.array([0, 0]))


class Docs(unittest.TestCase):
    def run_page(self, page):
        network.calls = 0
        pictures = list(support.images())
        random = np.random.default_rng(5)
        names = {
            "camera": pictures, "cameras": [pictures, pictures], "image": pictures[0],
            "detect": lambda image: (support.boxes(0), support.scores(0)),
            "network": network, "draw": lambda *drawn: None,
            "crop_vectors": random.normal(size=(20, 8)), "person_ids": np.repeat(range(1, 6), 4),
        }
        blocks = re.findall(r"^```(python|sh)\n(.*?)^```", page.read_text(), re.M | re.S)
        for language, block in blocks:
            with self.subTest(page=page.name, block=block):
                if language == "sh":
                    run = subprocess.run(["bash", "-ec", block], capture_output=True, text=True)
                    self.assertEqual(run.returncode, 0, run.stderr)
                else:
                    with contextlib.redirect_stdout(io.StringIO()):
                        exec(compile(block, page.name, "exec"), names)
        return len(blocks)

    def test_pages(self):
        with tempfile.TemporaryDirectory() as folder:
            before = os.getcwd()
            os.chdir(folder)
            path = os.environ["PATH"]
            os.environ["PATH"] = f"{Path(os.environ['SDMT_BINARY']).parent}:{path}"
            try:
                support.write_sequence("scene")
                support.write_sequence("hall")
                os.mkdir("results")
                support.sdmt("synth", "reid", "--output", "people", "--identities", "20")
                support.sdmt("track", "scene", "--no-appearance", "--render", "video.mp4")
                blocks = sum(self.run_page(page) for page in sorted(DOCS.rglob("*.md")))
                self.assertGreater(blocks, 20)
            finally:
                os.chdir(before)
                os.environ["PATH"] = path


if __name__ == "__main__":
    unittest.main()
