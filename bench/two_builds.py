#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether a change made sdmt slower: one build against another.

    bench/two_builds.py --old OLD/sdmt --new build/sdmt --model models/sdmt-vgg16.safetensors \\
        --sequence .../MOT16-04 --detections .../MOT16-04/det/det-frcnn17.txt

Embedding (batch 1 and 40), training steps (batch 16) and tracking by motion, as the two binaries
report them themselves. They take turns, each round another one first; printed are the medians and
the median of the rounds' ratios: above 1, the new build is faster. One thread unless --threads says
otherwise.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile


def report(binary, arguments, threads, file):
    """The JSON report of a run of sdmt."""
    subprocess.run([str(word) for word in [binary, *arguments, "--json", file]], check=True,
                   capture_output=True, env={**os.environ, "OMP_NUM_THREADS": str(threads)})
    return json.loads(file.read_text())


def bench(binary, arguments, file):
    """Milliseconds of each kind of the network's work."""
    found = report(binary, ["bench", "--model", arguments.model, "--batch", "1,40", "--repeat",
                            arguments.repeat], arguments.threads, file)
    times = {f"embed, batch {run['batch']}": run["ms_median"] for run in found["forward"]}
    found = report(binary, ["bench", "--model", arguments.model, "--batch", "16", "--train",
                            "--repeat", max(2, arguments.repeat // 4)], arguments.threads, file)
    for run in found["train"]:
        times[f"training step, {'trunk frozen' if run['frozen'] else 'all layers'}"] = \
            run["ms_median"]
    return times


def tracking(binary, arguments, file):
    """Milliseconds a frame of tracking by motion, of the fastest of five runs."""
    runs = [report(binary, ["track", arguments.sequence, "--detections", arguments.detections,
                            "--no-appearance", "--output", file.with_suffix(".txt")],
                   arguments.threads, file) for _ in range(5)]
    return {"tracking by motion, a frame": 1000 / max(run["hz"] for run in runs)}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--old", required=True, help="sdmt before the change")
    parser.add_argument("--new", default="build/sdmt")
    parser.add_argument("--model", default="models/sdmt-vgg16.safetensors")
    parser.add_argument("--sequence", required=True)
    parser.add_argument("--detections", required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--repeat", type=int, default=20, help="runs of the network in a round")
    arguments = parser.parse_args()
    rounds = {"old": [], "new": []}
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "report.json"
        for number in range(arguments.rounds):
            for name in ("old", "new") if number % 2 == 0 else ("new", "old"):
                binary = getattr(arguments, name)
                rounds[name].append({**bench(binary, arguments, file),
                                     **tracking(binary, arguments, file)})
    print(f"{arguments.threads} threads, {arguments.rounds} rounds\n"
          f"{'':30} {'old ms':>9} {'new ms':>9} {'old/new':>8}  (lowest to highest)")
    for work in rounds["old"][0]:
        old, new = ([times[work] for times in rounds[name]] for name in ("old", "new"))
        ratios = sorted(a / b for a, b in zip(old, new))
        print(f"{work:30} {statistics.median(old):9.3f} {statistics.median(new):9.3f} "
              f"{statistics.median(ratios):8.3f}  ({ratios[0]:.3f} to {ratios[-1]:.3f})")


if __name__ == "__main__":
    main()
