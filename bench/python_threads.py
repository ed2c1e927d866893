#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Threads of Python with a tracker each and one model: frames a second together, beside one thread.

    python3 bench/python_threads.py build [--threads 8] [--seconds 20] [--people 6]

One thread and all of them take turns, three times each; every tracker must find the same people.
"""
import statistics
import threading
import time

import numpy as np

from built_module import built_module


def main():
    sdmt, options = built_module(threads=8, seconds=20.0, people=6)
    model = sdmt.Model("sdmt-lite")
    image = np.random.default_rng(1).integers(0, 255, (1080, 1920, 3), np.uint8)
    left = 100.0 + 250 * np.arange(options.people)
    scores = np.full(options.people, 0.9)

    def track(end, done):
        sdmt.set_num_threads(1)
        tracker = sdmt.Tracker(model, delay=0)
        t = 0
        while time.monotonic() < end:
            boxes = np.stack([left + 100 * np.sin(t / 40), np.full_like(left, 300), np.full_like(left, 60),
                              np.full_like(left, 150)], 1)
            frame, = tracker.update(boxes, scores, image)
            assert t < 10 or len(frame) == options.people
            t += 1
        done.append(t)

    def rate(threads):
        done, start = [], time.monotonic()
        workers = [threading.Thread(target=track, args=(start + options.seconds, done))
                   for _ in range(threads)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        assert len(done) == threads, "a thread failed"
        return sum(done) / (time.monotonic() - start)

    pairs = [(rate(1), rate(options.threads)) for _ in range(3)]
    one, all_of_them = (statistics.median(values) for values in zip(*pairs))
    print(f"1 thread: {one:.1f} frames/s; {options.threads} threads: {all_of_them:.1f} frames/s "
          f"together, {all_of_them / one:.2f} times")


if __name__ == "__main__":
    main()
