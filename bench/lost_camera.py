#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How many people keep their ids while a camera is away and they walk on.

    bench/lost_camera.py --sdmt build/sdmt --sequence PETS09-S2L1 [-- more options of sdmt track]

A sequence's pictures come as from a camera, at its own rate; at four places the camera is silent for 5
seconds, and at the same four it ends the connection and is back when it is asked the fourth time, after
7.5 seconds. Counted are people of the ground truth seen in the last 10 frames before and the first 30
after whose boxes have the same id.
"""
import argparse
import collections
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "tests/live"))
from camera_server import Camera  # noqa: E402

SHOWN = 60  # frames before the loss, and after
PLACES = 100, 250, 400, 550
AWAY = {"silent for 5 s": 5.0, "lost for 7.5 s": 7.5}


def read(file):
    return [[float(value) for value in row.split(",")] for row in file.read_text().split()]


def overlap(a, b):
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    if width <= 0 or height <= 0:
        return 0
    return width * height / (a[2] * a[3] + b[2] * b[3] - width * height)


class Place:
    """One loss: the frames that the camera shows, and what became of the people in them."""

    def __init__(self, arguments, seconds, last):
        self.arguments, self.seconds = arguments, seconds
        gap = round(seconds * arguments.rate)
        self.before = range(last - SHOWN + 1, last + 1)
        self.after = range(last + gap + 1, last + gap + 1 + SHOWN)
        self.both = self.same = 0

    def run(self, folder):
        shown = [*self.before, *self.after]
        pictures = sorted((self.arguments.sequence / "img1").iterdir())
        sets = [[pictures[frame - 1].read_bytes() for frame in part]
                for part in (self.before, self.after)]
        first, second = ("frames", SHOWN, self.arguments.rate), [
            ("size", 1), ("frames", SHOWN, self.arguments.rate), ("end",)]
        camera = Camera(sets, [[first, ("stall", self.seconds), *second]] if self.seconds == 5 else
                        [[first, ("end",)], [], [], [], second])
        number = {frame: i + 1 for i, frame in enumerate(shown)}
        (folder / "det.txt").write_text("".join(
            f"{number[int(row[0])]},-1,{','.join(map(str, row[2:7]))}\n"
            for row in read(self.arguments.sequence / "det/det.txt") if int(row[0]) in number))
        process = subprocess.Popen(
            [self.arguments.sdmt, "track", camera.url, "--detections", folder / "det.txt",
             "--output", folder / "tracks.txt", *self.arguments.words],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and camera.sent < 2 * SHOWN:
            time.sleep(0.1)
        time.sleep(1)
        process.send_signal(signal.SIGTERM)
        process.wait()
        camera.close()
        self.compare(read(folder / "tracks.txt"), number)

    def compare(self, tracks, number):
        truth = read(self.arguments.sequence / "gt/gt.txt")

        def ids(frames):
            votes = collections.defaultdict(collections.Counter)
            for frame in frames:
                for person in (row for row in truth if int(row[0]) == frame):
                    for track in (row for row in tracks if int(row[0]) == number[frame]):
                        if overlap(person[2:6], track[2:6]) > 0.5:
                            votes[person[1]][track[1]] += 1
            return {person: vote.most_common(1)[0][0] for person, vote in votes.items()}

        before, after = ids(self.before[-10:]), ids(self.after[:30])
        people = before.keys() & after.keys()
        self.both = len(people)
        self.same = sum(before[person] == after[person] for person in people)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", default="build/sdmt")
    parser.add_argument("--sequence", required=True, type=pathlib.Path)
    parser.add_argument("--rate", type=float, default=7, help="frames a second of the sequence")
    parser.add_argument("words", nargs="*")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for way, seconds in AWAY.items():
            places = [Place(arguments, seconds, last) for last in PLACES]
            folders = [pathlib.Path(name) / f"{seconds}-{place.before[0]}" for place in places]
            threads = [threading.Thread(target=place.run, args=(folder,))
                       for place, folder in zip(places, folders)]
            for folder, thread in zip(folders, threads):
                folder.mkdir()
                thread.start()
            for thread in threads:
                thread.join()
            print(f"{way}: {sum(place.same for place in places)} of "
                  f"{sum(place.both for place in places)} people keep their ids", flush=True)


if __name__ == "__main__":
    main()
