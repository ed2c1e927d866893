#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lets every file call and many allocations of the commands fail, once each, and judges the runs.

A run is fine when it ends within the limit of time with the result of an undisturbed run, or with an
error: one line or more on stderr, exit code 1 or 2, and nothing of its outputs but whole files. A
result that differs is fine only where a warning names what was left out. The rest is a fault:
WRONG (success, but another result), LEFTOVER (files that should not be there), SILENT (an error
without a word), ABORT (a signal), HANG.
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

KINDS = ["ENOSPC", "EIO", "EINTR", "SHORT"]
# Where a kind can happen; the others never give it.
APPLIES = {
    "ENOSPC": {"open", "write", "fwrite", "fsync", "fdatasync", "rename", "mkdir", "ftruncate"},
    "EIO": {"open", "read", "fread", "write", "fwrite", "fsync", "fdatasync", "rename", "stat",
            "mkdir", "opendir", "flock", "fchmod", "ftruncate", "mmap"},
    "EINTR": {"open", "read", "write", "fsync", "flock", "ftruncate"},
    "SHORT": {"read", "write"},
}
BAD = ["WRONG", "LEFTOVER", "SILENT", "ABORT", "HANG"]
OUTCOMES = ["equal", "error", "warned"] + BAD


class Bench:
    def __init__(self, arguments):
        self.sdmt = os.path.abspath(arguments.sdmt)
        self.injector = os.path.abspath(arguments.injector)
        self.limit = arguments.limit
        self.model = os.path.abspath(arguments.model) if arguments.model else None
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="sdmt-faults-"))
        self.inputs = self.root / "in"
        self.inputs.mkdir()
        self.make_inputs()

    def make_inputs(self):
        def run(*words):
            subprocess.run([self.sdmt, *map(str, words)], check=True, stdout=subprocess.DEVNULL)
        scene = self.inputs / "scene"
        run("synth", "scene", "--output", scene, "--frames", 12, "--width", 160, "--height", 120,
            "--walkers", 2)
        run("track", scene, "--no-appearance", "--min-length", 2, "--output",
            self.inputs / "scene.txt")
        config = self.inputs / "config.json"
        config.write_text('{"min-length": 2, "min-mean-confidence": 0.1}')
        if self.model:
            shutil.copy(self.model, self.inputs / "model.safetensors")
            run("synth", "reid", "--output", self.inputs / "reid", "--identities", 4,
                "--images-per-identity", 4)

    # Words by command; OUT/NAME is an output, IN/NAME an input.
    def commands(self):
        commands = {
            "track": "track IN/scene --no-appearance --config IN/config.json --output OUT/t.txt "
                     "--jsonl OUT/t.jsonl --explain OUT/t.csv",
            "track-render": "track IN/scene --no-appearance --min-length 2 --render OUT/t.avi",
            "track-histogram": "track IN/scene --appearance histogram --min-length 2 "
                               "--output OUT/t.txt",
            "evaluate": "evaluate --gt IN/scene --results IN/scene.txt --explain --json OUT/e.json "
                        "--csv OUT/e.csv",
            "evaluate-render": "evaluate --gt IN/scene --results IN/scene.txt --long-miss 2 "
                               "--report OUT/e.html --render OUT/drawn",
            "synth-scene": "synth scene --output OUT/made --frames 2 --width 160 --height 120 "
                           "--walkers 1",
        }
        if self.model:
            images = sorted((self.inputs / "reid/bounding_box_test").glob("*.jpg"))
            commands |= {
                "inspect": "inspect IN/model.safetensors --json OUT/i.json",
                "embed": "embed --model IN/model.safetensors --output OUT/e.safetensors "
                         + " ".join(f"IN/{image.relative_to(self.inputs)}" for image in images[:4]),
                "track-network": "track IN/scene --model IN/model.safetensors --min-length 2 "
                                 "--output OUT/t.txt",
                "init-model": "init-model --output OUT/new.safetensors",
            }
        return {name: words.split() for name, words in commands.items()}

    def run(self, words, kind="EIO", call=0):
        """(outcome, line of the log, stderr) of a run whose `call`-th call fails."""
        work = pathlib.Path(tempfile.mkdtemp(dir=self.root))
        out, log = work / "out", work / "log"
        out.mkdir()
        line = [word.replace("IN/", f"{self.inputs}/").replace("OUT/", f"{out}/") for word in words]
        environment = dict(os.environ, LD_PRELOAD=self.injector, FAULT_ROOT=str(self.root),
                           FAULT_KIND=kind, FAULT_CALL=str(call), FAULT_LOG=str(work / "log"),
                           OMP_NUM_THREADS="2", OMP_WAIT_POLICY="passive")
        try:
            done = subprocess.run([self.sdmt, *line], env=environment, capture_output=True,
                                  timeout=self.limit)
            code, error = done.returncode, done.stderr.decode(errors="replace")
        except subprocess.TimeoutExpired as expired:
            code, error = None, (expired.stderr or b"").decode(errors="replace")
        files = {}
        for path in sorted(out.rglob("*")):
            if path.is_file():
                content = path.read_bytes().replace(str(out).encode(), b"OUT")
                files[str(path.relative_to(out))] = content
        calls = log.read_text().splitlines() if log.exists() else []
        calls = [call.replace(str(work), "").replace(str(self.inputs), "IN") for call in calls]
        shutil.rmtree(work)
        return code, error, files, calls

    @staticmethod
    def judge(code, error, files, good):
        if code is None:
            return "HANG"
        if code < 0 or code >= 128:
            return "ABORT"
        if code != 0:
            # Pictures drawn into a folder of the user's own are whole files each.
            whole = all(files[name] == good.get(name) for name in files)
            return "LEFTOVER" if not whole else "error" if error.strip() else "SILENT"
        if files == good:
            return "equal"
        return "warned" if "warning" in error or "unreadable" in error else "WRONG"


def choose(items, most):
    """At most `most` of the items, spread evenly."""
    if not most or len(items) <= most:
        return items
    return [items[i * len(items) // most] for i in range(most)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--injector", required=True)
    parser.add_argument("--model", help="model file for the commands that need one")
    parser.add_argument("--commands", nargs="*", help="only these")
    parser.add_argument("--most", type=int, default=0, help="file calls a command and kind; 0: all")
    parser.add_argument("--allocations", type=int, default=60, help="a command; 0: none")
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    bench = Bench(arguments)
    table, faults = {}, []
    try:
        for name, words in bench.commands().items():
            if arguments.commands and name not in arguments.commands:
                continue
            code, error, good, calls = bench.run(words)
            if code != 0:
                faults.append(f"{name}: the undisturbed run ends with {code}: {error}")
                continue
            jobs = []
            for kind in KINDS:
                of_kind = [call for call in calls if call.split()[1] in APPLIES[kind]]
                jobs += [(kind, int(call.split()[0])) for call in choose(of_kind, arguments.most)]
            if arguments.allocations:
                total = int(bench.run(words, "ALLOC")[3][0].split()[0])
                jobs += [("ALLOC", number)
                         for number in choose(range(1, total + 1), arguments.allocations)]
            with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
                runs = list(pool.map(lambda job: bench.run(words, *job), jobs))
            for (kind, number), (code, error, files, hit) in zip(jobs, runs):
                outcome = bench.judge(code, error, files, good)
                table.setdefault((name, kind), collections.Counter())[outcome] += 1
                if outcome in BAD:
                    last = re.sub(r"\s+", " ", error.strip())[-200:]
                    faults.append(f"{outcome} {name} {kind} {hit[:1]}: exit {code}, {sorted(files)}, "
                                  f"{last!r}")
                    print(faults[-1], file=sys.stderr)
            print(f"{name}: {len(jobs)} faults", file=sys.stderr)
    finally:
        shutil.rmtree(bench.root, ignore_errors=True)

    print(f"{'command':<16} {'kind':<7} {'faults':>6} " + " ".join(f"{o:>8}" for o in OUTCOMES))
    sums = collections.Counter()
    for (name, kind), counts in table.items():
        sums += counts
        print(f"{name:<16} {kind:<7} {sum(counts.values()):>6} " +
              " ".join(f"{counts[o] or '.':>8}" for o in OUTCOMES))
    print(f"{'all':<16} {'':<7} {sum(sums.values()):>6} " +
          " ".join(f"{sums[o] or '.':>8}" for o in OUTCOMES))
    for fault in faults:
        print(fault)
    return 1 if faults or not sums else 0


if __name__ == "__main__":
    sys.exit(main())
