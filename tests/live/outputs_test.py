#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What sdmt track leaves of a camera that never ends: killed, on a full disk. SDMT_BINARY names sdmt,
SDMT_SCHEMAS the folder of the descriptions of its JSON lines, SDMT_KILLS how often a run is killed (3)."""
import json
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import time
import unittest

from scene_camera import SDMT, SceneCamera
from schema import fits

SCHEMA = json.loads(
    (pathlib.Path(os.environ["SDMT_SCHEMAS"]) / "track-lines.schema.json").read_text())
KILLS = int(os.environ.get("SDMT_KILLS", 3))


class Outputs(SceneCamera):
    size = (240, 136)
    rate = 50

    def start(self, *words, **more):
        process = subprocess.Popen(
            [SDMT, "track", self.camera.url, "--no-appearance", "--detections",
             self.path / "det.txt", "--delay", "10", "--jsonl", self.path / "t.jsonl", *words],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **more)
        self.addCleanup(process.kill)
        self.addCleanup(process.stderr.close)
        return process

    def lines(self, name="t.jsonl"):
        file = self.path / name
        text = file.read_text() if file.exists() else ""
        self.assertTrue(text == "" or text.endswith("\n"), text[-200:])
        return [json.loads(line) for line in text.splitlines()]

    def all_lines(self):
        return sum(piece.read_text().count("\n") for piece in self.path.glob("t*.jsonl"))

    def until_lines(self, count):
        end = time.monotonic() + 60
        while len((self.path / "t.jsonl").read_text().split("\n")
                  if (self.path / "t.jsonl").exists() else []) <= count:
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.02)

    def test_lines_are_as_the_schema_says(self):
        process = self.start()
        self.until_lines(60)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 130)
        lines = self.lines()
        self.assertTrue(any(line["tracks"] for line in lines))
        for line in lines:
            self.assertIsNone(fits(line, SCHEMA))
            self.assertEqual(line["source"], self.camera.url)
        self.assertIsNotNone(fits({**lines[0], "version": 2}, SCHEMA))
        times = [line["time"] for line in lines]
        self.assertEqual(times, sorted(times))
        seconds = [line["utc"][17:-1] for line in lines[:2]]
        self.assertAlmostEqual((float(seconds[1]) - float(seconds[0])) % 60, times[1] - times[0],
                               delta=0.005)
        self.assertEqual([line["frame"] for line in lines], list(range(1, len(lines) + 1)))

    def test_killed_at_any_moment(self):
        dice = random.Random(7)
        for _ in range(KILLS):
            before = self.all_lines()
            process = self.start("--render", self.path / "v.avi", "--rotate", "2s")
            end = time.monotonic() + 60
            while self.all_lines() == before:
                self.assertLess(time.monotonic(), end, "waited in vain")
                time.sleep(0.01)
            time.sleep(dice.uniform(0, 3))
            process.kill()
            process.wait()
        for piece in self.path.glob("t*.jsonl"):
            numbers = [line["frame"] for line in self.lines(piece.name)]
            # Those of a run follow each other; the next begins anew.
            self.assertTrue(all(b in (a + 1, 1) for a, b in zip(numbers, numbers[1:])), numbers)
        pieces = sorted(self.path.glob("v*.avi"))
        self.assertGreaterEqual(len(pieces), KILLS)
        for piece in pieces:
            if piece.stat().st_size == 0:
                continue  # killed within its first pictures
            played = subprocess.run([SDMT, "track", piece, "--no-appearance", "--detections",
                                     self.path / "det.txt", "--json", self.path / "p.json"],
                                    capture_output=True, text=True)
            self.assertEqual(played.returncode, 0, played.stderr)
            self.assertGreater(json.loads((self.path / "p.json").read_text())["frames"], 0)

    def test_a_full_disk_does_not_end_tracking(self):
        process = self.start(preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN),
                             restore_signals=False)
        self.until_lines(20)
        size = (self.path / "t.jsonl").stat().st_size
        limits = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (size + 1000, limits[1]))
        time.sleep(1.5)
        full = self.lines()
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, limits)
        self.until_lines(len(full) + 10)
        process.send_signal(signal.SIGINT)
        _, messages = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 130)
        self.assertIn("t.jsonl: write failed, 20", messages)
        missing = int(re.search("t.jsonl: is written again, .*; ([0-9]+) lines are missing",
                                messages).group(1))
        lines = self.lines()
        self.assertEqual(lines[len(full)]["frame"] - full[-1]["frame"] - 1, missing)


if __name__ == "__main__":
    unittest.main()
