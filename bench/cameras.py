#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Four cameras in one process against four processes and against one camera: time, memory, bytes.

    bench/cameras.py --sdmt build/sdmt --model models/sdmt-vgg16.safetensors --sequence PETS09-S2L1

Prints wall seconds, CPU seconds and peak memory (that of four processes summed), and fails when a
camera's rows are not those of a run alone, byte for byte. Smallest of the rounds, which alternate.
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

COPIES = 4


def run(lines):
    """Runs side by side: wall seconds, CPU seconds, peak memory in MB."""
    start = time.monotonic()
    running = [subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
               for line in lines]
    cpu, memory = 0.0, 0.0
    for process in running:
        _, status, used = os.wait4(process.pid, 0)
        if status != 0:
            raise SystemExit(f"{process.args} ended with {status}")
        cpu += used.ru_utime + used.ru_stime
        memory += used.ru_maxrss / 1024
    return time.monotonic() - start, cpu, memory


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", default="build/sdmt")
    parser.add_argument("--model", default="models/sdmt-vgg16.safetensors")
    parser.add_argument("--sequence", required=True, type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("words", nargs="*", help="more of sdmt track's options, after --")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        copies = []
        for i in range(COPIES):
            copies.append(folder / f"copy{i + 1}")
            copies[-1].symlink_to(arguments.sequence.resolve())
        track = lambda inputs, *words: [arguments.sdmt, "track", *inputs, "--model",
                                        arguments.model, *words, *arguments.words]
        ways = {
            "one camera": [track(copies[:1], "--output", folder / "alone.txt")],
            "four in one process": [track(copies, "--output-dir", folder / "many")],
            "four processes": [track([copy], "--output", folder / f"{copy.name}.txt")
                               for copy in copies]}
        best = {}
        for _ in range(arguments.rounds):
            for way, lines in ways.items():
                best[way] = [min(pair) for pair in zip(best.get(way, [1e9] * 3), run(lines))]
        print(f"{'':22} {'wall s':>8} {'CPU s':>8} {'MB':>8}")
        for way, (wall, cpu, memory) in best.items():
            print(f"{way:22} {wall:8.1f} {cpu:8.1f} {memory:8.0f}")
        alone = (folder / "alone.txt").read_bytes()
        equal = all((folder / f"many/{copy.name}/tracks.txt").read_bytes() == alone
                    and (folder / f"{copy.name}.txt").read_bytes() == alone for copy in copies)
        print("all bytes equal" if alone and equal else "bytes differ")
        return 0 if alone and equal else 1


if __name__ == "__main__":
    sys.exit(main())
