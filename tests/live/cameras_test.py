#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Several inputs in one sdmt track. SDMT_BINARY names sdmt."""
import os
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest

from camera_server import Camera

SDMT = os.environ["SDMT_BINARY"]


class Cameras(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)

    def scene(self, name, seed, frames=40):
        subprocess.run([SDMT, "synth", "scene", "--output", self.path / name, "--frames",
                        str(frames), "--walkers", "4", "--width", "240", "--height", "136",
                        "--seed", str(seed)], check=True, capture_output=True)
        return self.path / name

    def track(self, *words):
        return subprocess.run([SDMT, "track", *words], capture_output=True, text=True, timeout=120)

    def test_each_is_as_if_it_were_alone(self):
        scenes = [self.scene(f"scene{i}", i) for i in range(1, 5)]
        # The same place twice: its folders are told apart.
        many = self.track(*scenes, scenes[0], "--output-dir", self.path / "out", "--appearance",
                          "histogram", "--output", "t.txt", "--jsonl", "t.jsonl")
        self.assertEqual(many.returncode, 0, many.stderr)
        for scene, name in zip([*scenes, scenes[0]],
                               ["scene1", "scene2", "scene3", "scene4", "scene1-2"]):
            alone = self.track(scene, "--appearance", "histogram", "--output",
                               self.path / "t.txt", "--jsonl", self.path / "t.jsonl")
            self.assertEqual(alone.returncode, 0, alone.stderr)
            self.assertGreater((self.path / "t.txt").stat().st_size, 0)
            for file in "t.txt", "t.jsonl":
                self.assertEqual((self.path / "out" / name / file).read_bytes(),
                                 (self.path / file).read_bytes())

    def test_one_that_fails_touches_no_other(self):
        good = self.scene("good", 1)
        other = self.path / "none.mp4"
        result = self.track(good, other, "--no-appearance", "--output-dir", self.path / "out")
        self.assertEqual(result.returncode, 1)
        self.assertIn("sdmt track: none: ", result.stderr)
        self.assertIn("does not exist", result.stderr)
        self.assertIn("1 of 2 inputs failed", result.stderr)
        alone = self.track(good, "--no-appearance", "--output", self.path / "t.txt")
        self.assertEqual(alone.returncode, 0)
        self.assertEqual((self.path / "out/good/tracks.txt").read_bytes(),
                         (self.path / "t.txt").read_bytes())

    def test_a_signal_ends_all(self):
        pictures = [file.read_bytes()
                    for file in sorted((self.scene("s", 1) / "img1").iterdir())]
        cameras = [Camera([pictures], [[("frames", 100000, 20)]]),
                   Camera([pictures], [[("frames", 5, 20), ("stall", 600)]])]
        for camera in cameras:
            self.addCleanup(camera.close)
        process = subprocess.Popen(
            [SDMT, "track", *[camera.url for camera in cameras], "--no-appearance", "--delay", "0",
             "--output-dir", self.path / "out", "--jsonl", "t.jsonl"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        end = time.monotonic() + 60
        lines = lambda: [file.read_text().count("\n")
                         for file in self.path.glob("out/*/t.jsonl")]
        while not (len(lines()) == 2 and min(lines()) > 0 and max(lines()) > 5):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        start = time.monotonic()
        _, messages = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 143, messages)
        self.assertLess(time.monotonic() - start, 3)

    def test_what_cannot_be_is_refused(self):
        scene = self.scene("s", 1, 5)
        for words, message in (
                ([scene, scene], "expected --output-dir"),
                ([scene, scene, "--output-dir", self.path / "o", "--detections", "-"],
                 "one stream of boxes"),
                ([scene, "--output-dir", self.path / "o", "--jsonl", "-"], "--jsonl is '-'"),
                ([scene, "--output-dir", self.path / "o", "--output", "../t.txt"],
                 "--output is '../t.txt'")):
            result = self.track(*words, "--no-appearance")
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    unittest.main()
