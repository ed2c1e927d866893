# SPDX-License-Identifier: Apache-2.0
"""Every block of Python in the documentation runs, page by page, each page in one name space."""
import contextlib
import io
import os
import re
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
        blocks = re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(), re.M | re.S)
        self.assertGreater(len(blocks), 0)
        for block in blocks:
            with self.subTest(page=page, block=block), contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, page, "exec"), names)

    def test_pages(self):
        with tempfile.TemporaryDirectory() as folder:
            before = os.getcwd()
            os.chdir(folder)
            try:
                support.write_sequence("scene")
                os.mkdir("results")
                support.sdmt("synth", "reid", "--output", "people", "--identities", "20")
                pages = [p.name for p in sorted(DOCS.glob("*.md")) if "```python" in p.read_text()]
                self.assertIn("python.md", pages)
                for page in pages:
                    self.run_page(page)
            finally:
                os.chdir(before)


if __name__ == "__main__":
    unittest.main()
