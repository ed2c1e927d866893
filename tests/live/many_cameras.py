#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sixteen cameras with small pictures in one process for ten minutes. Fails when memory or descriptors
grow after the first fifth of it, or a camera stands still."""
import argparse
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

from camera_server import Camera
from made_scene import make_scene
from soak import SLACK, held

RATE = 10  # frames a second


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--cameras", type=int, default=16)
    parser.add_argument("--seconds", type=int, default=600)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        path = pathlib.Path(name)
        pictures = make_scene(arguments.sdmt, path, frames=100, walkers=3, size=(160, 120),
                              shown=arguments.seconds * RATE // 100 + 1)
        cameras = [Camera([pictures], [[("frames", 10 ** 9, RATE)]])
                   for _ in range(arguments.cameras)]
        process = subprocess.Popen(
            [arguments.sdmt, "track", *[camera.url for camera in cameras], "--detections",
             path / "det.txt", "--appearance", "histogram", "--output-dir", path / "out", "--jsonl",
             "t.jsonl", "--rotate", "1MB", "--keep", "60s", "--serve", "0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            url = process.stdout.readline().strip()
            start, samples, frames = time.monotonic(), [], []
            print("seconds  least frames  most frames  kB anon  descriptors", flush=True)
            while time.monotonic() - start < arguments.seconds:
                time.sleep(arguments.seconds / 40)
                state = json.load(urllib.request.urlopen(url + "state", timeout=30))["cameras"]
                frames = [camera["frame"] for camera in state]
                samples.append(held(process))
                print(f"{time.monotonic() - start:7.0f} {min(frames):13} {max(frames):12} "
                      f"{samples[-1][0]:8} {samples[-1][1]:12}", flush=True)
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait()
            for camera in cameras:
                camera.close()
        early, late = samples[:8], samples[8:]
        grown, more = (max(row[i] for row in late) - max(row[i] for row in early) for i in (0, 1))
        print(f"grown by {grown} kB and {more} descriptors after the first fifth")
        return 0 if grown <= SLACK and more <= 2 and min(frames) > max(frames) / 2 > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
