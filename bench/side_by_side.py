#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How runs of sdmt share a machine: wall time of 1, 2 and 4 side by side, and of one beside a busy
loop on each core, each against its fair share.

    bench/side_by_side.py --sdmt build/sdmt --model models/sdmt-vgg16.safetensors

A run tracks a drawn scene with the network. With n runs on c cores the fair share of one is n times
its time alone where a run alone fills all cores; half of the cores' time beside busy loops doubles
it. Run on an otherwise idle machine; the smallest of several rounds counts.
"""
import argparse
import multiprocessing
import os
import pathlib
import subprocess
import tempfile
import time


def busy():
    while True:
        pass


class Runs:
    def __init__(self, arguments, folder):
        self.sdmt = os.path.abspath(arguments.sdmt)
        self.model = os.path.abspath(arguments.model)
        self.scene = folder / "scene"
        subprocess.run([self.sdmt, "synth", "scene", "--output", self.scene, "--frames",
                        str(arguments.frames), "--width", "480", "--height", "270"],
                       check=True, stdout=subprocess.DEVNULL)

    def together(self, count, environment):
        """Seconds until the last of `count` runs has ended, each with the default threads."""
        words = [self.sdmt, "track", self.scene, "--model", self.model, "--output", "/dev/null"]
        start = time.monotonic()
        runs = [subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL) for _ in range(count)]
        for run in runs:
            if run.wait() != 0:
                raise SystemExit("a run failed")
        return time.monotonic() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", default="build/sdmt")
    parser.add_argument("--model", default="models/sdmt-vgg16.safetensors")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    policies = {"sdmt's default": {}, "threads that spin": {"OMP_WAIT_POLICY": "active"}}
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(arguments, pathlib.Path(folder))
        print(f"{os.cpu_count()} cores, {arguments.frames} frames, smallest of {arguments.rounds}")
        print(f"{'':20} {'1':>8} {'2':>8} {'4':>8} {'beside busy loops':>18}  seconds")
        for name, extra in policies.items():
            environment = dict(os.environ, **extra)
            measured = [min(runs.together(count, environment) for _ in range(arguments.rounds))
                        for count in (1, 2, 4)]
            loops = [multiprocessing.Process(target=busy, daemon=True)
                     for _ in range(os.cpu_count())]
            for loop in loops:
                loop.start()
            measured.append(min(runs.together(1, environment) for _ in range(arguments.rounds)))
            for loop in loops:
                loop.terminate()
            alone = measured[0]
            print(f"{name:20} " + " ".join(f"{seconds:8.2f}" for seconds in measured[:3]) +
                  f" {measured[3]:18.2f}")
            fair = [count * alone for count in (1, 2, 4)] + [2 * alone]
            print(f"{'  of the fair share':20} " +
                  " ".join(f"{s / f:8.2f}" for s, f in zip(measured[:3], fair)) +
                  f" {measured[3] / fair[3]:18.2f}")


if __name__ == "__main__":
    main()
