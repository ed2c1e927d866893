#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs of `sdmt track --state` that are killed at random moments and go on, with another number of
threads each time: the same bytes as of a run that nobody disturbed.

    bench/restored_runs.py --sdmt build/sdmt [--kills 50] SEQUENCE [-- more options of sdmt track]

Ends with 1 where a byte differs. Prints the kills, the runs they were spread over, the frames at which
the run went on, and the largest state.
"""
import argparse
import pathlib
import random
import subprocess
import tempfile
import time


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", required=True, type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("words", nargs="*", help="more of sdmt track's options, after --")
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rows, lines, state = (folder / file for file in ("tracks.txt", "tracks.jsonl", "state"))
        command = [arguments.sdmt, "track", arguments.sequence, "--output", rows, "--jsonl", lines,
                   "--state", state, "--state-every", "5", "-q", *arguments.words]
        began = time.monotonic()
        subprocess.run(command, check=True)
        whole = time.monotonic() - began
        expected = rows.read_bytes(), lines.read_bytes()
        kills, runs, places, largest = 0, 0, [], 0
        while kills < arguments.kills:
            rows.unlink(missing_ok=True)
            lines.unlink(missing_ok=True)
            while True:
                threads = str(chance.choice([1, 2]))
                process = subprocess.Popen([*command, "--threads", threads])
                try:
                    process.wait(chance.uniform(0.1, 0.4) * whole)
                except subprocess.TimeoutExpired:
                    process.kill()
                if process.wait() == 0:
                    break
                kills += 1
                if state.exists():
                    largest = max(largest, state.stat().st_size)
                    places.append(int(state.read_bytes().split(b"\n", 2)[1]))
            runs += 1
            if (rows.read_bytes(), lines.read_bytes()) != expected:
                raise SystemExit(f"run {runs} differs after {kills} kills")
    print(f"{kills} kills in {runs} runs, frames finished at each: {sorted(places)}; the largest state "
          f"{largest / 1000:.0f} kB; all bytes equal")


if __name__ == "__main__":
    main()
