#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What Python adds to Tracker.update(): the module beside the same calls in C++.

    cmake --build build --target _sdmt update_time     (with -DSDMT_BUILD_BENCH=ON)
    python3 bench/python_overhead.py build [--runs 15] [--people 15] [--frames 2000]

Processor time, which a busy machine disturbs less. Runs of both alternate; each line is a median
over the runs. In Python the ids and boxes of every
finished frame are read.
"""
import statistics
import subprocess
import tempfile
import time

import numpy as np

from built_module import built_module


def walk(people, frames):
    """Boxes and scores a frame: people who walk to and fro in lanes of their own."""
    noise = np.random.default_rng(1)
    lane = np.arange(people)
    for t in range(frames):
        left = 100 + 60 * lane + 40 * np.sin(t / 50 + lane) + noise.normal(0, 1, people)
        top = 100 + 20 * (lane % 5) + noise.normal(0, 1, people)
        boxes = np.stack([left, top, np.full(people, 40.0), np.full(people, 100.0)], 1)
        yield np.round(boxes, 2), np.round(noise.uniform(0.7, 1, people), 3)


def by_module(sdmt, scene):
    tracker = sdmt.Tracker()
    people = 0
    start = time.process_time()
    for boxes, scores in scene:
        for frame in tracker.update(boxes, scores):
            people += len(frame.ids) if frame.boxes is not None else 0
    for frame in tracker.finish():
        people += len(frame.ids) if frame.boxes is not None else 0
    return (time.process_time() - start) * 1e6 / len(scene), people


def main():
    sdmt, options = built_module(runs=15, people=15, frames=2000)
    scene = list(walk(options.people, options.frames))
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        for t, (boxes, scores) in enumerate(scene, 1):
            for box, score in zip(boxes, scores):
                print(t, -1, *box, score, -1, -1, -1, sep=",", file=file)
        file.flush()
        ours, theirs = [], []
        for _ in range(options.runs):
            microseconds, people = by_module(sdmt, scene)
            ours.append(microseconds)
            output = subprocess.run([f"{options.build}/update_time", file.name], check=True,
                                    capture_output=True, text=True).stdout.split()
            theirs.append(float(output[0]))
            assert int(output[1]) == people, "Python and C++ tracked differently"
    difference = statistics.median(a - b for a, b in zip(ours, theirs))
    print(f"{options.people} boxes, {options.frames} frames, {options.runs} runs each")
    print(f"C++      {statistics.median(theirs):8.2f} microseconds an update")
    print(f"Python   {statistics.median(ours):8.2f}")
    print(f"added    {difference:8.2f}")


if __name__ == "__main__":
    main()
