#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sdmt track --serve. SDMT_BINARY names sdmt, SDMT_VIEWERS how many look at once (50)."""
import json
import os
import re
import signal
import time
import unittest
import urllib.request

from served import Served

VIEWERS = int(os.environ.get("SDMT_VIEWERS", 50))


class Serve(Served):
    def test_state_metrics_page_and_pictures(self):
        self.start()
        self.until(lambda: self.one()["people"])
        state = self.one()
        self.assertTrue(state["running"])
        self.assertRegex(state["utc"], r"^20.*Z$")
        self.assertEqual(state["camera"], self.camera.url[len("http://"):].replace(":", "-")
                         .replace("/", "-"))
        frames = re.search(r'sdmt_frames_total{camera="[^"]*"} (\d+)\n', self.get("metrics"))
        self.assertGreater(int(frames.group(1)), 0)
        for line in self.get("metrics").splitlines():
            self.assertRegex(line, r'^sdmt_[a-z_]+({(,?[a-z]+="[^"]*")+})? [0-9.e+-]+$')
        self.assertEqual(self.get("healthz"), "ok\n")
        page = self.get("")
        self.assertIn("<!DOCTYPE html>", page)
        self.assertNotIn("http://", page)  # nothing from elsewhere
        self.assertEqual(self.status("video/none"), 404)
        self.picture(self.look("video/" + state["camera"]))
        with urllib.request.urlopen(self.url + "picture/" + state["camera"], timeout=20) as answer:
            picture = answer.read()
        self.assertTrue(picture.startswith(b"\xff\xd8") and picture.endswith(b"\xff\xd9"))
        with urllib.request.urlopen(self.url + "events", timeout=20) as events:
            line = events.readline().decode()
            self.assertEqual(json.loads(line[len("data: "):])["version"], 1)
        self.process.send_signal(signal.SIGINT)
        start = time.monotonic()
        self.assertEqual(self.process.wait(30), 130)
        self.assertNotIn("lost after", self.process.stderr.read())
        self.assertLess(time.monotonic() - start, 5)

    def test_a_token_keeps_others_out(self):
        self.start("--serve-token", "open sesame")
        for path in "", "state", "metrics", "events", "video/x":
            self.assertEqual(self.status(path), 401)
            self.assertEqual(self.status(path + "?token=other"), 401)
        self.assertEqual(self.status("healthz"), 200)
        self.assertEqual(self.status("state?token=open%20sesame"), 200)
        self.assertEqual(self.status("state", Authorization="Bearer open sesame"), 200)

    def test_viewers_are_bounded_and_slow_ones_do_not_slow_the_tracker(self):
        self.start()
        self.until(lambda: self.one()["frame"] > 5)
        path = "video/" + self.one()["camera"]
        # None of them reads but one.
        viewers = [self.look(path) for _ in range(VIEWERS)]
        self.picture(viewers[0])
        if VIEWERS >= 50:
            self.until(lambda: self.status("picture/" + self.one()["camera"]) == 503)
        before, start = self.one(), time.monotonic()
        time.sleep(3)
        after, seconds = self.one(), time.monotonic() - start
        self.assertGreater((after["frame"] - before["frame"]) / seconds, 10)  # of 20 a second
        self.assertLess(after["lag"], 1)
        for viewer in viewers:
            viewer.close()
        self.until(lambda: "sdmt_viewers 0\n" in self.get("metrics"))


if __name__ == "__main__":
    unittest.main()
