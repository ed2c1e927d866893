# SPDX-License-Identifier: Apache-2.0
import json
import os
import signal
import tempfile
import threading
import time
import unittest
from pathlib import Path

import sdmt
import support

OPTIONS = {"min_length": [2, 4, 6], "max_fill": [5, 60]}
TYPED = ("--option", "min-length=2,4,6", "max-fill=5,60", "--draws", 2)
RUNS = (3 * 2 + 1) * 3 * 2  # settings and ByteTrack, sequences, draws


class Enough(Exception):
    pass


class Tune(support.InAFolder):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.scenes = [Path(folder.name) / f"s{seed}" for seed in (1, 2, 3)]
        for seed, scene in enumerate(cls.scenes, 1):
            support.sdmt("synth", "scene", "--output", scene, "--frames", 40, "--walkers", 5,
                         "--width", 240, "--height", 180, "--seed", seed)

    def setUp(self):
        super().setUp()
        self.addCleanup(sdmt.set_num_threads, os.cpu_count())

    def tune(self, **more):
        return sdmt.tune(self.scenes, OPTIONS, draws=2, **more)

    def expect_as_the_command(self, found, output, *arguments):
        support.sdmt("tune", *arguments, "--json", self.path / "command.json", "--output",
                     self.path / "command.config")
        expected = json.loads((self.path / "command.json").read_text())
        self.assertEqual(list(found), [*expected, "preset"])
        self.assertEqual(found, {**expected, "preset": json.loads(output.read_text())})
        self.assertEqual(output.read_bytes(), (self.path / "command.config").read_bytes())

    def test_as_the_command_does(self):
        calls = []
        found = self.tune(output=self.path / "module.config", state=self.path / "module.state",
                          progress=lambda *call: calls.append(call))
        self.expect_as_the_command(found, self.path / "module.config", "--sequences", *self.scenes,
                                   *TYPED, "--threads", 1, "--state", self.path / "command.state")
        ours, theirs = ((self.path / name).read_text().splitlines()
                        for name in ("module.state", "command.state"))
        self.assertEqual(ours[0], theirs[0])
        self.assertEqual(sorted(ours), sorted(theirs))
        self.assertEqual(calls, [(done, RUNS) for done in range(1, RUNS + 1)])

    def test_with_a_model_a_base_and_calibrations(self):
        model = sdmt.Model("sdmt-lite")
        scenes = [f"{self.scenes[0]}=det.txt@0.3,0.5", f"{self.scenes[1]}=det.txt"]
        found = sdmt.tune(scenes, {"lambda_": [0.2, 0.9], "association": [False, True]},
                          settings=3, draws=2, drop=0.2, seed=7, model=model, config="track-paper",
                          min_length=2, output=self.path / "module.config")
        self.expect_as_the_command(
            found, self.path / "module.config", "--sequences", *scenes, "--option",
            "lambda=0.2,0.9", "association=off,on", "--settings", 3, "--draws", 2, "--drop", 0.2,
            "--seed", 7, "--appearance", "network", "--model", model.path, "--config",
            "track-paper", "--min-length", 2)
        self.assertEqual(found["preset"]["min-length"], 2)
        sdmt.Tracker(config=found["preset"])

    def test_an_error_of_progress_keeps_the_state(self):
        expected = self.tune()
        for threads in (1, 3):
            sdmt.set_num_threads(threads)
            state = self.path / f"state{threads}"
            calls = []

            def stop(done, total):
                calls.append(done)
                if done == 5:
                    raise Enough

            with self.assertRaises(Enough):
                self.tune(state=state, progress=stop)
            self.assertLess(len(calls), 5 + threads)
            first = []
            self.assertEqual(self.tune(state=state, progress=lambda *call: first.append(call)),
                             expected)
            self.assertIn(first[0][0], range(6, 6 + threads))

    def test_control_c(self):
        state = self.path / "state"

        def interrupt():
            while not state.exists():
                time.sleep(0.01)
            os.kill(os.getpid(), signal.SIGINT)

        sdmt.set_num_threads(3)
        presser = threading.Thread(target=interrupt)
        presser.start()
        with self.assertRaises(KeyboardInterrupt):
            sdmt.tune(self.scenes, OPTIONS, draws=500, state=state)
        presser.join()
        self.assertLess(len(state.read_text().splitlines()), 500 * RUNS // 2)

    def test_other_threads_run_meanwhile(self):
        results = []
        works = [threading.Thread(target=lambda: results.append(self.tune())) for _ in range(3)]
        for work in works:
            work.start()
        for work in works:
            work.join()
        self.assertEqual(results, 3 * [self.tune()])

    def test_refusals(self):
        def refused(text, sequences=self.scenes, options=OPTIONS, **more):
            with self.assertRaises(ValueError) as raised:
                sdmt.tune(sequences, options, **more)
            self.assertIn(text, str(raised.exception))

        refused("the tracker has no option 'speed'", options={"speed": [1]})
        refused("min_iou is 2, expected >= 0 and < 1", options={"min_iou": [2]})
        refused("option nms has no values", options={"nms": []})
        refused("options is none, expected one at least", options={})
        refused("one is left out", sequences=[])
        refused("one is left out", sequences=self.scenes[0])
        refused("no such folder", sequences="nowhere")
        refused("sequence s1 is given twice", sequences=2 * self.scenes[:1])
        refused("draws is -1, expected 1..1000", draws=-1)
        refused("settings is 0, expected 1..100000", settings=0)
        refused("drop is 1, expected 0..0.9", drop=1)
        refused("the tracker has no option 'min-io'", min_io=0.3)
        refused("boosting is on, expected off", model="sdmt-lite", boosting=True)
        (self.path / "state").write_text("of something else\n")
        refused("is the state of another search", state=self.path / "state")
        refused("no/folder", output=self.path / "no/folder/file")


if __name__ == "__main__":
    unittest.main()
