#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills the commands (SIGKILL) at random moments. What bears a result's name afterwards must be
whole, and the same command run again must end with the undisturbed result and nothing left of the
killed run. A training must be able to go on from whatever checkpoint there is."""
import argparse
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from bench import COMMANDS, Bench, Table, unfinished

HIDDEN = ".sdmt-tmp"


def killed(bench, name, out, after):
    """Starts the command and kills it `after` seconds; whether it was still running."""
    bench.prepare(name, out)
    process = subprocess.Popen(bench.line(name, out), stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, env=bench.environment())
    time.sleep(after)
    running = process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    return running


def judge(bench, name, out, good):
    """After a kill: (outcome, the run that came after)."""
    whole = {**bench.before(name)}
    files = bench.files(out)
    if bench.lost(name, files):
        return "WRONG", None
    for file, content in files.items():
        if HIDDEN in file or file.endswith((".checkpoint", ".messages")) or unfinished(file):
            continue
        if content != good.get(file) and content != whole.get(file):
            return "WRONG", None
    if name.startswith("synth"):
        # Made in a folder of their own, which must be new.
        shutil.rmtree(out)
        out.mkdir()
    checkpoint = out / "m.safetensors.checkpoint"
    if name == "train" and checkpoint.exists():
        line = bench.line(name, out) + ["--resume", str(checkpoint)]
        resumed = subprocess.run(line, capture_output=True, text=True, env=bench.environment())
        if resumed.returncode != 0:
            print(resumed.stderr)
            return "ABORT", None
        checkpoint.unlink()
    again = bench.run(name, out=out)
    if again.code != 0:
        return "SILENT" if not again.error else "ABORT", again
    if bench.lost(name, again.files):
        return "WRONG", again
    # Behind the messages of the killed run.
    for file in again.files:
        old = whole.get(file, b"")
        if file.endswith(".messages") and again.files[file].endswith(good[file][len(old):]):
            again.files[file] = good[file]
    if not bench.equal(again.files, good):
        return "LEFTOVER", again
    return "equal", again


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--commands", nargs="*", help="only these")
    parser.add_argument("--count", type=int, default=10, help="kills a command")
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    table = Table()
    with Bench(arguments.sdmt, arguments.limit) as bench:
        for name in arguments.commands or COMMANDS:
            start = time.monotonic()
            good = bench.run(name).files
            length = time.monotonic() - start
            for number in range(arguments.count):
                out = pathlib.Path(tempfile.mkdtemp(dir=bench.root))
                # The first half of a run is start-up.
                after = length * rng.uniform(0.3, 1.05)
                running = killed(bench, name, out, after)
                outcome, again = judge(bench, name, out, good)
                again = again or bench.run(name)
                again = again._replace(files=sorted(os.listdir(out)))
                table.add(name, "kill" if running else "ended", outcome, again, f"{number}")
                shutil.rmtree(out)
    table.print()
    return table.exit_code()


if __name__ == "__main__":
    sys.exit(main())
