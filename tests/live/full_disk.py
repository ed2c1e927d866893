#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A camera whose disk is full for a minute: tracking goes on, what was written is whole, and writing goes
on when there is room. To be run where one may mount: unshare --mount --map-root-user ..."""
import argparse
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

from camera_server import Camera
from made_scene import make_scene

RATE = 20  # frames a second


def play(sdmt, segment, path):
    """Frames of a piece of video."""
    subprocess.run([sdmt, "track", segment, "--no-appearance", "--detections", path / "det.txt",
                    "--json", path / "played.json"], check=True, capture_output=True)
    return json.loads((path / "played.json").read_text())["frames"]


def fill(disk):
    """Takes all the room there is, to the last byte, and again while somebody finds some."""
    with (disk / "filler").open("ab", buffering=0) as filler:
        for size in 1 << 20, 4096, 1:
            try:
                while filler.write(b"x" * size):
                    pass
            except OSError:
                pass


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--seconds", type=int, default=60)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        path = pathlib.Path(name)
        disk = path / "disk"
        disk.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=96m", "tmpfs", disk], check=True)
        pictures = make_scene(arguments.sdmt, path, frames=50, walkers=4, size=(320, 180),
                              shown=(arguments.seconds + 60) * RATE // 50)
        camera = Camera([pictures], [[("frames", 10 ** 9, RATE)]])
        process = subprocess.Popen(
            [arguments.sdmt, "track", camera.url, "--no-appearance", "--detections",
             path / "det.txt", "--delay", "10", "--jsonl", disk / "t.jsonl", "--output",
             disk / "t.txt", "--render", disk / "v.avi", "--rotate", "20s", "--serve", "0"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            url = process.stdout.readline().strip()
            frame = lambda: json.load(urllib.request.urlopen(url + "state"))["cameras"][0]["frame"]
            time.sleep(10)
            before = frame()
            end = time.monotonic() + arguments.seconds
            while time.monotonic() < end:
                fill(disk)
                time.sleep(0.05)
            tracked = frame() - before
            os.remove(disk / "filler")
            time.sleep(10)
        finally:
            process.send_signal(signal.SIGINT)
            messages = process.communicate(timeout=60)[1]
            camera.close()
        print("".join(line + "\n" for line in messages.splitlines() if "warning" in line), end="")
        numbers = [json.loads(line)["frame"] for piece in sorted(
            disk.glob("t*.jsonl"), key=lambda piece: (piece.name == "t.jsonl", piece.name))
            for line in piece.read_text().splitlines()]
        rows = [row for piece in disk.glob("t*.txt") for row in piece.read_text().splitlines()]
        missing = int(re.search(r"t\.jsonl: is written again, .*; (\d+) lines", messages)[1])
        played = [play(arguments.sdmt, piece, path) for piece in sorted(disk.glob("v*.avi"))
                  if piece.stat().st_size]
        print(f"full for {arguments.seconds} s: {tracked} frames were tracked in it; "
              f"{len(numbers)} lines are whole, {missing} missing; pieces of video with {played} "
              "frames play")
        subprocess.run(["umount", disk], check=True)
        holes = sum(b - a - 1 for a, b in zip(numbers, numbers[1:]))
        well = (process.returncode == 130 and tracked > arguments.seconds * RATE / 2
                and holes == missing and len(played) > 1
                and all(re.fullmatch(r"\d+,\d+(,-?[\d.]+){8}", row) for row in rows))
        return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
