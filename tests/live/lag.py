#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How late sdmt track is on a camera that is too fast for it: a sequence's pictures as Motion JPEG at 10,
15 and 30 frames a second, HOG finds the people and the network describes each of them. Fails when a
frame was more than a second late, or one is neither tracked nor told as dropped."""
import argparse
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from camera_server import Camera


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--sequence", required=True, type=pathlib.Path)
    parser.add_argument("--model", required=True)
    parser.add_argument("--seconds", type=int, default=30)
    arguments = parser.parse_args()
    pictures = [file.read_bytes() for file in sorted((arguments.sequence / "img1").iterdir())]
    well = True
    print("frames/s  received  tracked  dropped  longest lag, s")
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        for rate in 10, 15, 30:
            camera = Camera([pictures], [[("frames", rate * arguments.seconds, rate),
                                          ("stall", 3600)]])
            process = subprocess.Popen(
                [arguments.sdmt, "track", camera.url, "--detector", "hog", "--model",
                 arguments.model, "--embed", "always", "--jsonl", f"{folder}/t.jsonl", "--json",
                 report], stderr=subprocess.PIPE, text=True, stdout=subprocess.DEVNULL)
            while process.poll() is None and camera.sent < rate * arguments.seconds:
                time.sleep(0.1)
            time.sleep(1)
            process.send_signal(signal.SIGINT)
            messages = process.communicate(timeout=60)[1]
            camera.close()
            result = json.loads(report.read_text())
            live = result["live"]
            print(f"{rate:8} {live['received']:9} {result['frames']:8} {live['dropped']:8} "
                  f"{live['longest_lag']:15.2f}", flush=True)
            well = (well and live["longest_lag"] <= 1 and f"{live['dropped']} of them" in messages
                    and live["received"] - result["frames"] - live["dropped"] in (0, 1))
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
