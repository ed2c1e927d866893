#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Gives the commands files that were damaged or made up with ill will, from a seeded generator, and
judges the runs: within the limit of time and MEMORY, exit code 0, or 1 or 2 with one line on stderr.
Whatever else happens is a fault: a signal, a hang, a number that is not finite in what was written.
"""
import argparse
import collections
import json
import math
import os
import pathlib
import random
import resource
import struct
import subprocess
import sys
import tempfile

MEMORY = 4 << 30


def safetensors(header, data):
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def mutate_bytes(content, rng):
    """A file with bytes changed, cut off, doubled or left out, mostly near its beginning."""
    content = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 8])):
        reach = min(len(content), rng.choice([8, 200, 4096, 20000, len(content)]))
        at = rng.randrange(max(1, reach))
        match rng.randrange(5):
            case 0:
                content[at:at + 1] = bytes([rng.randrange(256)])
            case 1:
                del content[at:]
            case 2:
                content[at:at] = content[at:at + rng.randrange(1, 5000)]
            case 3:
                del content[at:at + rng.randrange(1, 100)]
            case 4:
                content[at:at] = rng.choice([b"[" * 60000, b'{"a":' * 20000, b"\x00" * 5000,
                                             b"-1", b"1e999", b"18446744073709551615", b"\xff" * 9])
    return bytes(content)


def mutate_model(content, rng):
    """A model whose header or metadata is changed in one sensible-looking way."""
    length = struct.unpack("<Q", content[:8])[0]
    header, data = json.loads(content[8:8 + length]), content[8 + length:]
    odd = [-1, 0, 1, 2**31, 2**63, 1e999, -0.0, 1e38, "x", "\x1b]0;x\x07", None, [], {},
           [[[[1]]]], True]
    names = [name for name in header if name != "__metadata__"]
    match rng.randrange(6):
        case 0:
            header[rng.choice(names)][rng.choice(["dtype", "shape", "data_offsets"])] = rng.choice(odd)
        case 1:
            header[rng.choice(names)]["shape"] = [rng.choice(odd) for _ in range(rng.randrange(6))]
        case 2:
            del header[rng.choice(names)]
        case 3:
            tensor = header[rng.choice(names)]
            begin, end = tensor["data_offsets"]
            value = rng.choice([b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff\xff\x7f\x7f"])
            data = data[:begin] + (value * ((end - begin) // 4 + 1))[:end - begin] + data[end:]
        case _:
            key = rng.choice(list(header.get("__metadata__", {"none": "{}"})))
            try:
                value = json.loads(header["__metadata__"][key])
                target = value
                while True:
                    inner = rng.choice(list(target))
                    if not isinstance(target[inner], dict) or not target[inner] or rng.random() < 0.3:
                        break
                    target = target[inner]
                target[inner] = rng.choice(odd)
                header["__metadata__"][key] = json.dumps(value)
            except (ValueError, KeyError, TypeError, IndexError):
                header["__metadata__"] = {key: rng.choice(["", "{", "[" * 60000, "null", "0"])}
    return safetensors(header, data)


def mutate_rows(content, rng):
    lines = content.decode().splitlines()
    odd = ["nan", "inf", "-inf", "1e308", "-1e308", "1e12", "0", "-1", "2147483647", "2147483648",
           "1e-320", "", " ", "x", "\x1b[2J", "1,2", "1.5"]
    for _ in range(rng.choice([1, 3, 50])):
        at = rng.randrange(len(lines))
        cells = lines[at].split(",")
        cells[rng.randrange(len(cells))] = rng.choice(odd)
        lines[at] = ",".join(cells)
    return "\n".join(lines).encode()


def finite(path):
    content = path.read_bytes()
    length = struct.unpack("<Q", content[:8])[0]
    header = json.loads(content[8:8 + length])
    for name, tensor in header.items():
        if name == "__metadata__" or tensor["dtype"] != "F32":
            continue
        begin, end = tensor["data_offsets"]
        values = content[8 + length + begin:8 + length + end]
        if not all(math.isfinite(v[0]) for v in struct.iter_unpack("<f", values)):
            return False
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--model", help="model file; without it, only texts")
    parser.add_argument("--count", type=int, default=40, help="files of a kind")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the files that made faults")
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    sdmt = os.path.abspath(arguments.sdmt)
    rng = random.Random(arguments.seed)
    faults, table = [], collections.defaultdict(collections.Counter)
    with tempfile.TemporaryDirectory(prefix="sdmt-hostile-") as name:
        work = pathlib.Path(name)
        scene, out, bad = work / "scene", work / "out", work / "bad"

        environment = dict(os.environ, OMP_NUM_THREADS="2", OMP_WAIT_POLICY="passive")

        def run(*words):
            return subprocess.run([sdmt, *map(str, words)], capture_output=True, env=environment,
                                  timeout=arguments.limit,
                                  preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS,
                                                                        (MEMORY, MEMORY)))

        run("synth", "scene", "--output", scene, "--frames", 30, "--width", 160, "--height", 120)
        detections = (scene / "det/det.txt").read_bytes()
        truth = (scene / "gt/gt.txt").read_bytes()
        config = json.dumps({"min-length": 2, "lambda": 0.5, "appearance": "none",
                             "calibration": "frcnn", "boosting": True}).encode()
        track = ["track", scene, "--no-appearance", "--output", out, "--detections"]
        kinds = {
            "detections, bytes": (mutate_bytes, detections, [*track, bad]),
            "detections, cells": (mutate_rows, detections, [*track, bad]),
            "results, cells": (mutate_rows, truth,
                               ["evaluate", "--gt", scene, "--benchmark", "MOT15", "--results", bad]),
            "config, bytes": (mutate_bytes, config,
                              ["track", scene, "--output", out, "--config", bad]),
        }
        if arguments.model:
            model = pathlib.Path(arguments.model).read_bytes()
            kinds |= {
                "model, bytes": (mutate_bytes, model, ["inspect", bad]),
                "model, header": (mutate_model, model, ["inspect", bad]),
                "model, used": (mutate_model, model,
                                ["embed", "--model", bad, "--output", out,
                                 scene / "img1/000001.jpg"]),
            }
        for kind, (mutate, content, words) in kinds.items():
            bad.write_bytes(content)
            good = run(*words)
            if good.returncode != 0:
                sys.exit(f"{kind}: the good file is refused: {good.stderr.decode()}")
            for number in range(arguments.count):
                bad.write_bytes(mutate(content, rng))
                out.unlink(missing_ok=True)
                try:
                    done = run(*words)
                except subprocess.TimeoutExpired:
                    outcome, error = "HANG", ""
                else:
                    error = done.stderr.decode(errors="replace")
                    lines = [line for line in error.splitlines() if "warning" not in line]
                    outcome = "refused" if done.returncode in (1, 2) and len(lines) == 1 else "ABORT"
                    if done.returncode in (1, 2) and len(lines) != 1:
                        outcome = "LINES"
                    if done.returncode == 0:
                        wrong = words[0] == "embed" and not finite(out)
                        outcome = "WRONG" if wrong else "accepted"
                    if any(ord(c) < 32 and c not in "\n\r\t" for c in error + done.stdout.decode(errors="replace")):
                        outcome = "TERMINAL"
                    if done.returncode != 0 and out.exists():
                        outcome = "LEFTOVER"
                table[kind][outcome] += 1
                if outcome.isupper():
                    if arguments.keep:
                        (arguments.keep / f"{kind} {number}").write_bytes(bad.read_bytes())
                    faults.append(f"{outcome} {kind}, file {number}: {error[-200:]!r}")
    for kind, counts in table.items():
        print(f"{kind:<20} " + ", ".join(f"{n} {o}" for o, n in sorted(counts.items())))
    for fault in faults:
        print(fault)
    return 1 if faults or not table else 0


if __name__ == "__main__":
    sys.exit(main())
