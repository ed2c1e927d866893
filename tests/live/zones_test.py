#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Zones of a camera: on the page, in the metrics, and changed while it runs. SDMT_BINARY names sdmt."""
import json
import re
import unittest

from served import Served

PLAN = {"picture": [320, 180],
        "lines": [{"name": "the \"middle\"", "from": [160, 1], "to": [160, 180]}],
        "areas": [{"name": "left", "corners": [[1, 1], [160, 1], [160, 180], [1, 180]]}]}


class Zones(Served):
    def setUp(self):
        super().setUp()
        self.plan(json.dumps(PLAN))
        self.start("--zones", self.path / "zones.json", "--events", self.path / "events.jsonl",
                   "--counts", self.path / "counts.csv")

    def plan(self, text):
        """In place of the old one, as editors and deployments do it."""
        (self.path / "new.json").write_text(text)
        (self.path / "new.json").rename(self.path / "zones.json")

    def names(self):
        return [zone["zone"] for zone in self.one().get("zones", [])]

    def test_counts_and_events_are_shown(self):
        self.until(lambda: self.one().get("event_count", 0) > 2)
        state = self.one()
        lines = [json.loads(line) for line in (self.path / "events.jsonl").read_text().splitlines()]
        self.assertEqual(state["events"], lines[: state["event_count"]][-20:])
        area = state["zones"][1]
        self.assertEqual(area["zone"], "left")
        self.assertEqual(area["stays"] > 0, any(line["event"] == "enter" for line in lines))
        metrics = self.get("metrics")
        self.assertRegex(metrics, r'sdmt_zone_crossings_total{camera="[^"]*",zone="the \\"middle\\"",'
                                  r'direction="in"} \d+\n')
        self.assertRegex(metrics, r'sdmt_zone_people{camera="[^"]*",zone="left"} \d+\n')
        stages = dict(re.findall(r'stage_seconds_total{camera="[^"]*",stage="(\w+)"} (\S+)\n', metrics))
        self.assertEqual(set(stages), {"detect", "predict", "embed", "assign", "boost", "associate",
                                       "emit"})
        self.assertGreater(float(stages["assign"]), 0)

    def test_a_plan_is_for_the_picture_in_which_it_was_drawn(self):
        # In pixels of the camera the area would lie outside of its picture.
        self.plan(json.dumps({"picture": [1280, 720], "areas": [
            {"name": "right", "corners": [[641, 1], [1280, 1], [1280, 720], [641, 720]]}]}))
        self.until(lambda: self.names() == ["right"])
        self.until(lambda: self.one()["zones"][0]["stays"] > 0)

    def test_a_plan_that_changes_is_read_again_and_a_bad_one_refused(self):
        self.until(lambda: self.one().get("event_count", 0) > 0)
        self.plan('{"lines": []')
        seen = self.one()["frame"]
        self.until(lambda: self.one()["frame"] > seen + 60)
        self.assertEqual(self.names(), ['the "middle"', "left"])
        self.plan(json.dumps({"picture": [320, 180], "lines": [
            {"name": "door", "from": [100, 1], "to": [100, 180]}]}))
        self.until(lambda: self.names() == ["door"])
        aside = list(self.path.glob("counts.2*Z.csv"))
        self.assertEqual(len(aside), 1)
        self.assertIn("left,area,all", aside[0].read_text())
        self.process.terminate()
        _, messages = self.process.communicate(timeout=30)
        refused = [line for line in messages.splitlines() if "zones stay as they were" in line]
        self.assertEqual(len(refused), 1, messages)
        self.assertIn("zones.json", refused[0])
        self.assertIn("is read again", messages)
        self.assertIn("door,line,all", (self.path / "counts.csv").read_text())


if __name__ == "__main__":
    unittest.main()
