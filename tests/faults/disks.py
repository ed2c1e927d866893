#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes every kind of output to a file system that is full before it is whole. To be run where one
may mount: unshare --mount --map-root-user tests/faults/disks.py ..."""
import argparse
import pathlib
import shutil
import subprocess
import sys

from bench import COMMANDS, Bench, Table

PAGE = 4096
# Written a little at a time, so that many places can be the one at which it is full.
SHARES = [0.0, 0.3, 0.6, 0.9]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--commands", nargs="*", help="only these")
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    arguments = parser.parse_args()
    table = Table()
    with Bench(arguments.sdmt, arguments.limit) as bench:
        disk = bench.root / "disk"
        disk.mkdir()
        for name in arguments.commands or COMMANDS:
            good = bench.run(name).files
            # A tmpfs gives whole pages; the folder itself takes none.
            pages = sum(-(-len(content) // PAGE) for content in good.values())
            for share in SHARES:
                most = max(1, int(share * pages))
                if most >= pages and share > 0:
                    continue
                subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={most * PAGE}", "tmpfs",
                                disk], check=True)
                try:
                    # One page is the least there is: nothing is left of it.
                    if share == 0:
                        pathlib.Path(disk / "full").write_bytes(b"x" * PAGE)
                    bench.prepare(name, disk)
                    result = bench.run(name, out=disk)
                except OSError:
                    continue  # what lies there before has no room
                finally:
                    subprocess.run(["umount", disk], check=True)
                result.files.pop("full", None)
                outcome = bench.judge(name, result, good)
                table.add(name, f"{share:.0%} disk", outcome, result, f"{most} of {pages} pages")
        shutil.rmtree(disk)
    table.print()
    return table.exit_code()


if __name__ == "__main__":
    sys.exit(main())
