#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sdmt track on a camera that stalls, dies, comes back and sends garbage. SDMT_BINARY names sdmt,
SDMT_LOSSES how often a camera is lost in a row (5)."""
import json
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

from camera_server import Camera

SDMT = os.environ["SDMT_BINARY"]
LOSSES = int(os.environ.get("SDMT_LOSSES", 5))
UTC = r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z"


class Streams(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name)
        cls.sets = []
        for name, width in ("large", 320), ("small", 240):
            subprocess.run([SDMT, "synth", "scene", "--output", cls.path / name, "--frames", "30",
                            "--walkers", "3", "--width", str(width), "--height",
                            str(width * 9 // 16)], check=True, capture_output=True)
            cls.sets.append([file.read_bytes()
                             for file in sorted((cls.path / name / "img1").iterdir())])

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def camera(self, *script):
        camera = Camera(self.sets, script)
        self.addCleanup(camera.close)
        return camera

    def start(self, camera, *words):
        process = subprocess.Popen(
            [SDMT, "track", camera.url, "--no-appearance", "--json", self.path / "report.json",
             *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        return process

    def until(self, condition, seconds=30):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.02)

    def finish(self, process, code, stop=None):
        if stop:
            process.send_signal(stop)
        start = time.monotonic()
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, messages)
        self.stopped_after = time.monotonic() - start
        return messages, json.loads((self.path / "report.json").read_text())

    def test_a_camera_that_dies_stalls_and_comes_back(self):
        camera = self.camera([("frames", 10, 50), ("end",)], [], [],
                             [("frames", 10, 50), ("stall", 60)], [("frames", 1000, 50)])
        process = self.start(camera, "--timeout", "1")
        self.until(lambda: camera.calls == 5)
        sent = camera.sent
        self.until(lambda: camera.sent > sent + 20)
        messages, report = self.finish(process, 130, signal.SIGINT)
        self.assertLess(self.stopped_after, 2)
        self.assertRegex(messages, "lost after [0-9]+ frames, " + UTC + ": the sender has ended it")
        self.assertRegex(messages, "lost after [0-9]+ frames, " + UTC + ": no frame for 1 s")
        self.assertEqual(len(re.findall("is back, " + UTC, messages)), 2)
        live = report["live"]
        self.assertEqual(live["losses"], 2)
        # One may have come that nobody took any more.
        self.assertIn(live["received"] - report["frames"] - live["dropped"], (0, 1))

    def test_giving_up_is_a_failure_that_keeps_what_came(self):
        for end, reason in (("end",), "the sender has ended it"), (("stall", 60), "no frame for 1"):
            camera = self.camera([("frames", 10, 50), end])
            process = self.start(camera, "--no-reconnect", "--timeout", "1")
            messages, report = self.finish(process, 1)
            self.assertIn(reason, messages)
            self.assertIn("gives no more frames; the ", messages)
            self.assertGreater(report["frames"], 0)
            self.assertEqual(camera.calls, 1)

    def test_a_signal_ends_at_once_what_waits_for_a_silent_server(self):
        camera = self.camera([("frames", 5, 50), ("stall", 60)])
        process = self.start(camera)
        self.until(lambda: camera.sent == 5)
        time.sleep(1)
        self.finish(process, 143, signal.SIGTERM)
        self.assertLess(self.stopped_after, 2)

    def test_garbage_is_counted_and_passed_over(self):
        camera = self.camera([("frames", 5, 50), ("garbage",), ("frames", 5, 50), ("cut",),
                              ("frames", 5, 50), ("size", 1), ("frames", 10, 50),
                              ("noise", 100000), ("end",)])
        process = self.start(camera, "--no-reconnect", "--timeout", "5")
        _, report = self.finish(process, 1)
        self.assertEqual(report["live"]["received"], 25)
        self.assertEqual(report["live"]["garbled"], 2)

    def test_many_losses_leave_nothing_behind(self):
        once = [("frames", 4, 30), ("end",)]
        camera = self.camera(*[once] * (LOSSES + 1), [("frames", 30, 30), ("stall", 60)])
        process = self.start(camera, "--detections", self.path / "large/det/det.txt", "--jsonl",
                             self.path / "losses.jsonl", "--delay", "0")
        held = []
        for calls in 3, LOSSES:
            self.until(lambda: camera.calls > calls, 120)
            held.append(len(os.listdir(f"/proc/{process.pid}/fd")))
        self.until(lambda: camera.sent >= 4 * (LOSSES + 1) + 30, 60)
        time.sleep(0.5)
        messages, report = self.finish(process, 130, signal.SIGINT)
        self.assertLessEqual(held[1], held[0] + 1)  # it may just be opening
        lines = (self.path / "losses.jsonl").read_text().splitlines()
        self.assertEqual([json.loads(line)["frame"] for line in lines],
                         list(range(1, report["frames"] + 1)))
        self.assertEqual(messages.count("is back"), LOSSES + 1)

    def piped(self, *words):
        process = subprocess.Popen(
            [SDMT, "track", "-", "--no-appearance", "--jsonl", "-", *words], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(process.kill)
        return process

    def test_a_video_comes_by_standard_input(self):
        words = ["--detections", self.path / "large/det/det.txt", "--no-appearance"]
        subprocess.run([SDMT, "track", self.path / "large", *words, "--render",
                        self.path / "v.mkv"], check=True, capture_output=True)
        subprocess.run([SDMT, "track", self.path / "v.mkv", *words, "--jsonl",
                        self.path / "file.jsonl"], check=True, capture_output=True)
        process = self.piped(*words)
        lines, messages = process.communicate((self.path / "v.mkv").read_bytes(), timeout=60)
        self.assertEqual(process.returncode, 0, messages)
        piped = [json.loads(line) for line in lines.splitlines()]
        file = [json.loads(line) for line in (self.path / "file.jsonl").read_text().splitlines()]
        self.assertEqual([line["tracks"] for line in piped], [line["tracks"] for line in file])
        for a, b in zip(piped, file):
            self.assertAlmostEqual(a["time"], b["time"], delta=0.002)
        process = self.piped(*words)
        _, messages = process.communicate(b"no video" * 1000, timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertIn(b"standard input: cannot be opened", messages)

    def test_a_signal_ends_what_waits_for_standard_input(self):
        process = self.piped()
        time.sleep(1)
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(30)
        self.assertLess(time.monotonic() - start, 3)

    def test_lag_is_bounded_and_drops_are_told(self):
        for rate in 10, 30:
            camera = self.camera([("frames", 3 * rate, rate), ("end",)])
            process = self.start(camera, "--no-reconnect", "--hog-min-height", "24")
            messages, report = self.finish(process, 1)
            self.assertLess(report["live"]["longest_lag"], 1.5)  # a frame's own time, on any machine
            self.assertEqual(report["frames"] + report["live"]["dropped"], 3 * rate)


if __name__ == "__main__":
    unittest.main()
