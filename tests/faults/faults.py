#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lets every file call and many allocations of the commands fail, once each, and judges the runs as
bench.py says."""
import argparse
import concurrent.futures
import os
import sys

from bench import COMMANDS, Bench, Table

KINDS = ["ENOSPC", "EIO", "EINTR", "SHORT"]
# Where a kind can happen; the others never give it.
APPLIES = {
    "ENOSPC": {"open", "write", "fwrite", "fsync", "fdatasync", "rename", "mkdir", "ftruncate"},
    "EIO": {"open", "read", "fread", "write", "fwrite", "fsync", "fdatasync", "rename", "stat",
            "mkdir", "opendir", "flock", "fchmod", "ftruncate", "mmap"},
    "EINTR": {"open", "read", "write", "fsync", "flock", "ftruncate"},
    "SHORT": {"read", "write"},
}


def choose(items, most):
    """At most `most` of the items, spread evenly."""
    if not most or len(items) <= most:
        return items
    return [items[i * len(items) // most] for i in range(most)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--injector", required=True)
    parser.add_argument("--commands", nargs="*", help="only these")
    parser.add_argument("--most", type=int, default=0, help="file calls a command and kind; 0: all")
    parser.add_argument("--allocations", type=int, default=60, help="a command; 0: none")
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    table = Table()
    with Bench(arguments.sdmt, arguments.limit) as bench:
        def run(name, kind="EIO", call=0):
            return bench.run(name, LD_PRELOAD=os.path.abspath(arguments.injector),
                             FAULT_ROOT=str(bench.root), FAULT_KIND=kind, FAULT_CALL=str(call))
        for name in arguments.commands or COMMANDS:
            undisturbed = run(name)
            if undisturbed.code != 0:
                table.add(name, "none", "WRONG", undisturbed)
                continue
            jobs = []
            for kind in KINDS:
                of_kind = [c for c in undisturbed.calls if c.split()[1] in APPLIES[kind]]
                jobs += [(kind, int(c.split()[0])) for c in choose(of_kind, arguments.most)]
            if arguments.allocations:
                total = int(run(name, "ALLOC").calls[0].split()[0])
                jobs += [("ALLOC", number)
                         for number in choose(range(1, total + 1), arguments.allocations)]
            with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
                results = pool.map(lambda job: run(name, *job), jobs)
                for (kind, number), result in zip(jobs, results):
                    outcome = bench.judge(name, result, undisturbed.files)
                    # HANG on a machine that is busy elsewhere is tried once more, alone.
                    if outcome == "HANG":
                        result = run(name, kind, number)
                        outcome = bench.judge(name, result, undisturbed.files)
                    table.add(name, kind, outcome, result, f"{number} {result.calls[:1]}")
            print(f"{name}: {len(jobs)} faults", file=sys.stderr, flush=True)
    table.print()
    for fault in table.faults:
        print(fault)
    return table.exit_code()


if __name__ == "__main__":
    sys.exit(main())
