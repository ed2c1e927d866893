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
import pathlib
import random
import resource
import shutil
import struct
import subprocess
import sys

from bench import COMMANDS, MESSAGES, Bench, words_of

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
    lines = content.decode(errors="replace").splitlines()
    odd = ["nan", "inf", "-inf", "1e308", "-1e308", "1e12", "0", "-1", "2147483647", "2147483648",
           "1e-320", "", " ", "x", "\x1b[2J", "1,2", "1.5"]
    for _ in range(rng.choice([1, 3, 50])):
        at = rng.randrange(len(lines))
        cells = lines[at].split(",")
        cells[rng.randrange(len(cells))] = rng.choice(odd)
        lines[at] = ",".join(cells)
    return "\n".join(lines).encode()


def mutate_json(content, rng):
    """Lines of JSON in which one value is another, or bytes are changed."""
    if rng.random() < 0.4:
        return mutate_bytes(content, rng)
    odd = [-1, 0, 2**31, 2**63, 1e999, float("nan"), 1e38, "x", "\x1b]0;x\x07", None, [], {}, True,
           [[[[1]]]], "\ud800"]
    lines = content.decode().splitlines() if b"\n{" in content else [content.decode()]
    at = rng.randrange(len(lines))
    value = json.loads(lines[at])
    target = value
    while True:
        keys = list(range(len(target))) if isinstance(target, list) else list(target)
        inner = rng.choice(keys)
        if not isinstance(target[inner], (dict, list)) or not target[inner] or rng.random() < 0.3:
            break
        target = target[inner]
    target[inner] = rng.choice(odd)
    lines[at] = json.dumps(value)
    return "\n".join(lines).encode()


def mutate_words(content, rng):
    """key=value lines, one of them odd."""
    lines = content.decode().splitlines()
    at = rng.randrange(len(lines))
    key = lines[at].split("=")[0]
    lines[at] = rng.choice([key, f"{key}=", f"{key}=-1", f"{key}=0", f"{key}=1e9", f"{key}=nan",
                            f"{key}=99999999999999", f"{key}=../../x", f"{key}=\x1b[2J", "[", "",
                            key + "=" + "9" * 5000, f"{key}=1\n{key}=2"])
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


def kinds_of(bench, bad):
    """Name: (how it is damaged, the good file, where the bad one lies, the command)."""
    at, out = bench.inputs, bad / "out"
    detections = (at / "scene/det/det.txt").read_bytes()
    rows = [line.split(",") for line in detections.decode().split()]
    csv = "frame,x,y,width,height,score\n" + "\n".join(",".join([r[0], *r[2:7]]) for r in rows)
    jsonl = "\n".join(json.dumps({"frame": frame, "boxes": [
        [float(v) for v in r[2:6]] for r in rows if int(r[0]) == frame]}) for frame in range(1, 13))
    coco = json.dumps([{"image_id": int(r[0]), "category_id": 1, "score": float(r[6]),
                        "bbox": [float(v) for v in r[2:6]]} for r in rows])
    kitti = "\n".join(f"{int(r[0]) - 1} -1 Pedestrian 0 0 -10 {float(r[2]):.1f} {float(r[3]):.1f} "
                      f"{float(r[2]) + float(r[4]):.1f} {float(r[3]) + float(r[5]):.1f} "
                      f"-1 -1 -1 -1000 -1000 -1000 -10 {r[6]}" for r in rows)
    scene = bad / "scene"
    shutil.copytree(at / "scene", scene)
    shutil.copy(at / "made.weights", bad / "net.weights")
    shutil.copy(at / "made.names", bad / "net.names")
    shutil.copy(at / "made.cfg", bad / "net.cfg")
    shutil.copytree(at / "reid", bad / "reid")
    photo = next((bad / "reid/bounding_box_train").glob("*.jpg"))
    frame = scene / "img1/000003.jpg"
    subprocess.run([bench.sdmt, "track", scene, "--no-appearance", "--min-length", "2", "--render",
                    bad / "good.mp4"], check=True, capture_output=True)
    resumed = ["track", at / "scene", "--no-appearance", "--min-length", "2", "--delay", "2",
               "--output", out, "--state", bad / "t.state"]
    shutil.copytree(at / "square", bad / "square")
    tune = ["tune", "--sequences", at / "scene", bad / "square", "--option", "lambda=0.3,0.7",
            "--draws", "2", "--output", out]
    subprocess.run([bench.sdmt, *tune, "--state", bad / "runs"], check=True, capture_output=True)
    queue = bad / MESSAGES
    queue.parent.mkdir(parents=True)
    file = bad / "file"
    track = ["track", scene, "--no-appearance", "--output", out, "--detections", file]
    train = [word.replace("IN/", f"{at}/").replace("OUT/m.safetensors", str(out))
             for word in words_of(COMMANDS["train"])]
    model = (at / "tiny.safetensors").read_bytes()
    checkpoint = (at / "half.checkpoint").read_bytes()
    cache = bad / "cache"
    cached = [word.replace("IN/", f"{at}/").replace("OUT/m.safetensors", str(out))
              .replace("OUT/c.safetensors", str(cache))
              for word in words_of(COMMANDS["train-cache"])]
    subprocess.run([bench.sdmt, *cached], check=True, capture_output=True)
    subprocess.run([bench.sdmt, "embed", "--model", at / "tiny.safetensors", "--output",
                    bad / "vectors", *sorted((at / "reid").glob("*/*.jpg"))], check=True,
                   capture_output=True)
    return {
        "boxes, bytes": (mutate_bytes, detections, file, track),
        "boxes, cells": (mutate_rows, detections, file, track),
        "boxes, csv": (mutate_rows, csv.encode(), file, track),
        "boxes, json lines": (mutate_json, jsonl.encode(), file, track),
        "boxes, coco": (mutate_json, coco.encode(), file, track),
        "boxes, kitti": (mutate_bytes, kitti.encode(), file, track),
        "boxes, live": (mutate_json, jsonl.encode(), file,
                        ["track", "-", "--no-appearance", "--output", out, "--detections", "-"]),
        "results, cells": (mutate_rows, (scene / "gt/gt.txt").read_bytes(), file,
                           ["evaluate", "--gt", at / "scene", "--benchmark", "MOT15", "--results",
                            file]),
        "truth, cells": (mutate_rows, (scene / "gt/gt.txt").read_bytes(), scene / "gt/gt.txt",
                         ["evaluate", "--gt", scene, "--results", at / "scene.txt"]),
        "seqinfo": (mutate_words, (scene / "seqinfo.ini").read_bytes(), scene / "seqinfo.ini",
                    ["track", scene, "--no-appearance", "--output", out]),
        "zones": (mutate_json, (at / "zones.json").read_bytes().replace(b"\n", b""), file,
                  ["count", at / "scene.txt", "--gt", at / "scene", "--zones", file, "--counts",
                   out]),
        "results, counted": (mutate_rows, (at / "scene.txt").read_bytes(), file,
                             ["count", file, "--gt", at / "scene", "--zones", at / "zones.json",
                              "--counts", out]),
        "state of a track": (mutate_bytes, (at / "begun.state").read_bytes(), bad / "t.state",
                             resumed),
        "frames of a state": (mutate_bytes, (at / "begun.state.frames").read_bytes(),
                              bad / "t.state.frames", resumed),
        "state of a tune": (mutate_bytes, (bad / "runs").read_bytes(), bad / "runs",
                            [*tune, "--state", bad / "runs"]),
        "truth, tuned on": (mutate_rows, (bad / "square/gt/gt.txt").read_bytes(),
                            bad / "square/gt/gt.txt", tune),
        "messages": (mutate_bytes, (at / "waiting.messages").read_bytes(), queue,
                     ["track", at / "scene", "--no-appearance", "--output", out, "--mqtt",
                      "mqtt://127.0.0.1:1", "--mqtt-queue", bad / "queue"]),
        "config": (mutate_json, b'{"min-length": 2, "lambda": 0.5, "boosting": true}', file,
                   ["track", scene, "--no-appearance", "--output", out, "--config", file]),
        "image, tracked": (mutate_bytes, frame.read_bytes(), frame,
                           ["track", scene, "--appearance", "histogram", "--output", out]),
        "image, embedded": (mutate_bytes, (at / "1.jpg").read_bytes(), file,
                            ["embed", "--model", at / "tiny.safetensors", "--output", out, file]),
        "image, trained on": (mutate_bytes, photo.read_bytes(), photo,
                              [word.replace(f"{at}/reid", f"{bad}/reid") for word in train]),
        "video, avi": (mutate_bytes, (at / "clip.avi").read_bytes(), bad / "v.avi",
                       ["track", bad / "v.avi", "--no-appearance", "--output", out,
                        "--detections", at / "scene/det/det.txt"]),
        "video, mp4": (mutate_bytes, (bad / "good.mp4").read_bytes(), bad / "v.mp4",
                       ["track", bad / "v.mp4", "--no-appearance", "--output", out,
                        "--detections", at / "scene/det/det.txt"]),
        "model, bytes": (mutate_bytes, model, file, ["inspect", file]),
        "model, header": (mutate_model, model, file, ["inspect", file]),
        "model, used": (mutate_model, model, file,
                        ["embed", "--model", file, "--output", out, at / "1.jpg"]),
        "checkpoint, bytes": (mutate_bytes, checkpoint, file, [*train, "--resume", file]),
        "checkpoint, header": (mutate_model, checkpoint, file, [*train, "--resume", file]),
        "feature cache": (mutate_bytes, cache.read_bytes(), cache, cached),
        "vectors": (mutate_model, (bad / "vectors").read_bytes(), file,
                    ["validate-roc", "--data", at / "reid", "--model", at / "tiny.safetensors",
                     "--embeddings", f"other={file}"]),
        "description": (mutate_json, (at / "tiny.json").read_bytes(), file,
                        ["init-model", "--architecture", file, "--output", out]),
        "detector, cfg": (mutate_words, (at / "made.cfg").read_bytes(), bad / "net.cfg",
                          ["detect", scene, "--detector", bad / "net.cfg", "--output", out]),
        "detector, weights": (mutate_bytes, (at / "made.weights").read_bytes(),
                              bad / "net.weights",
                              ["detect", scene, "--detector", bad / "net.cfg", "--output", out]),
    }


def judge(words, done, out):
    error = done.stderr.decode(errors="replace")
    lines = [line for line in error.splitlines() if "warning" not in line]
    text = error + done.stdout.decode(errors="replace")
    if done.returncode not in (0, 1, 2):
        return "ABORT"
    if any(ord(c) < 32 and c not in "\n\r\t" for c in text):
        return "TERMINAL"
    if done.returncode == 0:
        return "WRONG" if words[0] == "embed" and not finite(out) else "accepted"
    if len(lines) != 1:
        return "LINES"
    live = "-" in words  # what came before a bad line is kept
    return "LEFTOVER" if out.exists() and not live else "refused"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--kinds", nargs="*", help="only these")
    parser.add_argument("--count", type=int, default=20, help="files of a kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=10, help="seconds for a run")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the files that did harm")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    faults, table = [], collections.defaultdict(collections.Counter)
    with Bench(arguments.sdmt, arguments.limit) as bench:
        bad = bench.root / "bad"
        bad.mkdir()

        def run(words, content):
            return subprocess.run(
                [bench.sdmt, *map(str, words)], capture_output=True, input=content,
                env=bench.environment(), timeout=arguments.limit,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)))

        out = bad / "out"
        # What a run that ends well removes.
        beside = {bad / f"t.{end}": (bench.inputs / f"begun.{end}").read_bytes()
                  for end in ("state", "state.frames")}

        def lay(path, content):
            for other, good in beside.items():
                other.write_bytes(good)
            path.write_bytes(content)

        for kind, (mutate, content, path, words) in kinds_of(bench, bad).items():
            if arguments.kinds and kind not in arguments.kinds:
                continue
            old = path.read_bytes() if path.exists() else None
            lay(path, content)
            good = run(words, content)
            if good.returncode != 0:
                sys.exit(f"{kind}: the good file is refused: {good.stderr.decode()}")
            for number in range(arguments.count):
                damaged = mutate(content, rng)
                lay(path, damaged)
                for left in bad.glob("out*"):
                    left.unlink()
                try:
                    done = run(words, damaged)
                    outcome, error = judge(words, done, out), done.stderr.decode(errors="replace")
                except subprocess.TimeoutExpired:
                    outcome, error = "HANG", ""
                table[kind][outcome] += 1
                if outcome.isupper():
                    if arguments.keep:
                        (arguments.keep / f"{kind} {number}").write_bytes(damaged)
                    faults.append(f"{outcome} {kind}, file {number}: {error[-300:]!r}")
                    print(faults[-1], flush=True)
            path.unlink(missing_ok=True) if old is None else path.write_bytes(old)
    for kind, counts in table.items():
        print(f"{kind:<20} " + ", ".join(f"{n} {o}" for o, n in sorted(counts.items())))
    total = sum(table.values(), collections.Counter())
    print(f"{'all':<20} " + ", ".join(f"{n} {o}" for o, n in sorted(total.items())))
    for fault in faults:
        print(fault)
    return 1 if faults or not table else 0


if __name__ == "__main__":
    sys.exit(main())
