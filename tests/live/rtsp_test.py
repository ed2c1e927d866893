#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sdmt track on a camera that speaks RTSP, stalls, dies, comes back, with pictures of another size,
over a bad wire. SDMT_BINARY names sdmt, SDMT_LOSSES how often the camera is lost in a row (3)."""
import json
import os
import pathlib
import random
import re
import signal
import subprocess
import tempfile
import time
import unittest

from ports import free_port
from rtsp_camera import BadWire, RtspCamera, missing

SDMT = os.environ["SDMT_BINARY"]
LOSSES = int(os.environ.get("SDMT_LOSSES", 3))
UTC = r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z"
RATE = 20
ABSENT = missing()


@unittest.skipIf(ABSENT, "no RTSP server: " + ABSENT)
class Rtsp(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        for name, width in ("large", 320), ("small", 240):
            subprocess.run([SDMT, "synth", "scene", "--output", self.path / name, "--frames", "30",
                            "--walkers", "3", "--width", str(width), "--height", "160"],
                           check=True, capture_output=True)
        # Three people who stand.
        (self.path / "det.txt").write_text("".join(
            f"{frame},-1,{40 + 80 * who},40,30,90,1\n" for frame in range(1, 6000)
            for who in range(3)))
        self.camera = RtspCamera(free_port(), self.path / "large/img1", RATE)
        self.addCleanup(self.camera.die)
        self.camera.start()

    def start(self, url, *words):
        process = subprocess.Popen(
            [SDMT, "track", url, "--no-appearance", "--detections", self.path / "det.txt", "--delay",
             "0", "--jsonl", self.path / "t.jsonl", "--json", self.path / "report.json", *words],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def lines(self):
        file = self.path / "t.jsonl"
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []

    def frames(self, more):
        """Waits for so many more of them."""
        wanted, end = len(self.lines()) + more, time.monotonic() + 60
        while len(self.lines()) < wanted:
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.05)

    def finish(self, process):
        process.send_signal(signal.SIGINT)
        start = time.monotonic()
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, messages)
        self.assertLess(time.monotonic() - start, 2)
        lines, report = self.lines(), json.loads((self.path / "report.json").read_text())
        self.assertEqual([line["frame"] for line in lines], list(range(1, report["frames"] + 1)))
        return messages, report, lines

    def test_it_stalls_dies_and_comes_back_with_another_size(self):
        process = self.start(self.camera.url, "--timeout", "1")
        self.frames(20)
        self.camera.stall()
        time.sleep(2)
        self.camera.go_on()
        self.frames(20)
        self.camera.die()
        time.sleep(1)
        self.camera.start(self.path / "small/img1")
        self.frames(20)
        messages, report, _ = self.finish(process)
        self.assertRegex(messages, "lost after [0-9]+ frames, " + UTC + ": no frame for 1 s")
        self.assertRegex(messages, "lost after [0-9]+ frames, " + UTC + ": the sender has ended it")
        self.assertEqual(len(re.findall("is back, " + UTC, messages)), 2)
        self.assertEqual(report["live"]["losses"], 2)

    def test_ids_live_on_while_it_is_away_for_five_seconds(self):
        process = self.start(self.camera.url)
        self.frames(20)
        self.camera.die()
        time.sleep(5)
        self.camera.start()
        self.frames(40)
        messages, _, lines = self.finish(process)
        self.assertRegex(messages, r"is back, .* after ([5-9]|1\d)\.\d s")
        before, after = ({track["id"] for track in line["tracks"]} for line in
                         (lines[15], lines[-1]))
        self.assertEqual(len(before), 3)
        self.assertEqual(after, before)

    def test_a_signal_ends_at_once_what_waits_for_a_silent_camera(self):
        process = self.start(self.camera.url)
        self.frames(10)
        self.camera.stall()
        time.sleep(1)
        self.finish(process)

    def test_many_losses_leave_nothing_behind(self):
        process = self.start(self.camera.url)
        held = []
        for _ in range(LOSSES):
            self.frames(5)
            status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
            held.append((len(os.listdir(f"/proc/{process.pid}/fd")),
                         int(re.search(r"RssAnon:\s+(\d+)", status)[1])))
            self.camera.die()
            self.camera.start()
        self.frames(5)
        messages, report, _ = self.finish(process)
        self.assertEqual(messages.count("is back"), LOSSES)
        self.assertEqual(report["live"]["losses"], LOSSES)
        early = held[:max(1, LOSSES // 5)]
        for which, slack in (0, 1), (1, 4096):
            most = max(one[which] for one in early)
            self.assertLessEqual(held[-1][which], most + slack, held)
        print(f"{LOSSES} losses: descriptors and kB of memory from {held[0]} to {held[-1]}")

    def test_a_bad_wire_garbles_pictures_and_no_more(self):
        wire = BadWire(self.camera.port, random.Random(1))
        self.addCleanup(wire.close)
        process = self.start(self.camera.url.replace(str(self.camera.port), str(wire.port)))
        self.frames(20)
        wire.spoilt = 0.05
        time.sleep(5)
        self.assertIsNone(process.poll())
        wire.spoilt = 0
        self.frames(20)
        _, report, _ = self.finish(process)
        self.assertGreater(report["live"]["garbled"], 0)


if __name__ == "__main__":
    unittest.main()
