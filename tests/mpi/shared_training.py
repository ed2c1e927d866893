#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Trainings that mpirun shares among processes, against those of one process.

  shared_training.py --sdmt build/sdmt --mpirun mpirun PART...

bytes   models, checkpoints and logs of 1 to 4 processes are those of one without MPI
ranks   the same for 8 and 16 processes
faults  a killed process, a failing one, a full disk, a signal; another number goes on
kills   30 kills of random processes at random times, gone on with by other numbers
races   two processes under valgrind's helgrind; noise of MPI is named in open_mpi.supp
launch  unlike machines, a batch too small, too many processes: refused once, in a sentence
"""
import argparse
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

NETWORK = {
    "name": "tiny", "input": {"height": 32, "width": 16}, "layers": [
        {"name": "conv1", "type": "Conv2d", "out_channels": 16, "kernel_size": 3, "padding": 1},
        {"name": "in1", "type": "InstanceNorm2d"},
        {"name": "relu1", "type": "ReLU"},
        {"name": "conv2", "type": "Conv2d", "out_channels": 24, "kernel_size": 3, "padding": 1,
         "bias": False},
        {"name": "bn2", "type": "BatchNorm2d"}, {"name": "relu2", "type": "ReLU"},
        {"name": "pool2", "type": "MaxPool2d"},
        {"name": "fc1", "type": "Linear", "out_features": 32},
        {"name": "relu3", "type": "ReLU"},
        {"name": "fc2", "type": "Linear", "out_features": 32},
        {"name": "bn", "type": "BatchNorm1d", "initial_gamma": 0.15, "initial_beta": 1},
        {"name": "l2", "type": "L2Normalize"}]}


class Bench:
    def __init__(self, sdmt, mpirun, work):
        self.sdmt, self.mpirun, self.work = sdmt, mpirun, work
        run([sdmt, "synth", "reid", "--output", work / "people", "--identities", "18"])
        (work / "tiny.json").write_text(json.dumps(NETWORK))
        run([sdmt, "init-model", "--architecture", work / "tiny.json", "--output", work / "tiny"])
        run([sdmt, "init-model", "--architecture", "vgg16", "--output", work / "vgg"])
        images = sorted((work / "people" / "bounding_box_train").iterdir())
        run([sdmt, "embed", "--model", work / "tiny", "--output", work / "teacher", *images])
        self.images = len(images)

    def words(self, name, *more):
        return ["train-embedder", "--data", self.work / "people", "--output", self.work / name,
                "--holdout-ids", "2", "--identities", "5", "--instances", "4", "--iterations", "8",
                "--warmup", "0", "--validate-every", "4", "--checkpoint-every", "3", *more]

    def launcher(self, size, *options):
        return [self.mpirun, "--allow-run-as-root", "--oversubscribe", *options, "-n", str(size)]

    def launch(self, size, words, threads="1", options=(), environment=None):
        """`size` 0: without mpirun."""
        before = [] if size == 0 else self.launcher(size, *options)
        return subprocess.Popen(
            [str(w) for w in [*before, self.sdmt, *words, "--threads", threads]],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, **(environment or {})}, start_new_session=True)

    def train(self, size, words, **more):
        process = self.launch(size, words, **more)
        out, err = process.communicate(timeout=300)
        return process.returncode, out, err

    def result(self, name):
        """The bytes of the files that a training leaves; its log without the measured speed."""
        files = [(self.work / name).read_bytes()]
        for extra in (".checkpoint", ".csv"):
            path = pathlib.Path(str(self.work / name) + extra)
            if not path.exists():
                continue
            data = path.read_bytes()
            if extra == ".csv":
                rows = [row.split(b",") for row in data.splitlines()]
                data = b"\n".join(b",".join(row[:9] + row[10:]) for row in rows)
            files.append(data)
        return files


def run(words):
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    assert result.returncode == 0, (words, result.stderr)


def expect(condition, what):
    if not condition:
        raise SystemExit(f"FAILED: {what}")


def configurations(work):
    tiny = ["--model", work / "tiny"]
    return {
        "full": [*tiny, "--tie", "none", "--views", "0", "--log", "full.csv"],
        "triplet": [*tiny, "--tie", "4x2", "--views", "0", "--loss", "triplet"],
        "frozen": ["--model", work / "tiny", "--freeze-trunk", "--tie", "none", "--views", "2"],
        "unfrozen": [*tiny, "--unfreeze", "conv2", "--tie", "4x1", "--views", "2",
                     "--feature-cache", "unfrozen.features"],
        "taught": [*tiny, "--tie", "none", "--views", "0", "--teacher", work / "teacher",
                   "--average", "0.9", "--optimizer", "sgd"],
        "vgg": ["--model", work / "vgg", "--freeze-trunk", "--views", "1"],
        "pair": ["--model", work / "vgg", "--head", "pair-classifier", "--views", "1"],
    }


def named(bench, name, options):
    """Files of their own for each run."""
    options = [f"{bench.work / name}.csv" if o == "full.csv" else
               f"{bench.work / name}.features" if o == "unfrozen.features" else o for o in options]
    return bench.words(name, *options)


def bytes_of(bench, sizes, threads="1"):
    for name, options in configurations(bench.work).items():
        code, _, err = bench.train(0, named(bench, f"{name}0", options))
        expect(code == 0, f"{name}: {err}")
        alone = bench.result(f"{name}0")
        # The paper's network takes long on one core: two of its processes tell enough.
        for size in sizes if name not in ("vgg", "pair") else sizes[1:2]:
            start = time.time()
            code, out, err = bench.train(size, named(bench, f"{name}{size}", options),
                                         threads=threads if size < 4 else "1")
            expect(code == 0, f"{name}, {size} processes: {err}")
            expect(bench.result(f"{name}{size}") == alone, f"{name}: {size} processes, other bytes")
            expect(out.count("wrote") == 1, f"{name}: told {out.count('wrote')} times")
            print(f"{name}: {size} processes, the same {len(alone)} files, "
                  f"{time.time() - start:.1f} s", flush=True)


def part_bytes(bench):
    bytes_of(bench, (1, 2, 3, 4), threads="2")


def part_ranks(bench):
    bytes_of(bench, (8, 16))


def processes_of(parent, name="sdmt"):
    """Those of sdmt under a launcher."""
    found, queue = [], [parent]
    while queue:
        pid = queue.pop()
        try:
            children = pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        except OSError:
            continue
        for child in map(int, children):
            queue.append(child)
            try:
                if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == name:
                    found.append(child)
            except OSError:
                pass
    return sorted(found)


def long_words(bench, name, *more):
    words = bench.words(name, "--model", bench.work / "tiny", "--tie", "none", "--views", "0", *more)
    return [*words[:words.index("--iterations") + 1], "60",
            *words[words.index("--iterations") + 2:]]


def wait_for(path, seconds=300):
    end = time.time() + seconds
    while not path.exists() and time.time() < end:
        time.sleep(0.02)
    return path.exists()


def kill_one(bench, name, size, rank, delay, chosen, more=()):
    """Returns False when the training ended before the kill."""
    process = bench.launch(size, long_words(bench, name, *more))
    checkpoint = pathlib.Path(str(bench.work / name) + ".checkpoint")
    wait_for(checkpoint)
    time.sleep(delay)
    victims = processes_of(process.pid)
    if process.poll() is not None or rank >= len(victims):
        process.communicate(timeout=300)
        return process.returncode != 0
    os.kill(victims[rank], chosen)
    start = time.time()
    out, err = process.communicate(timeout=60)
    seconds = time.time() - start
    if process.returncode == 0:  # killed when all was written
        expect(out.count("wrote") == 1, f"a killed process: exit code 0 and no model: {out}")
        return False
    expect(seconds < 30, f"a killed process: {seconds:.0f} s until all had ended")
    expect("Traceback" not in err and err.count("train-embedder:") <= 1, err)
    while alive := [pid for pid in victims if pathlib.Path(f"/proc/{pid}").exists()]:
        expect(time.time() - start < 30, f"still there after 30 s: {alive}")
        time.sleep(0.05)
    print(f"  ended {time.time() - start:.1f} s after the kill", flush=True)
    return True


def part_faults(bench):
    bench.train(0, long_words(bench, "whole"))
    whole = bench.result("whole")[0]
    expect(kill_one(bench, "killed", 3, 1, 0.1, signal.SIGKILL), "ended before the kill")
    checkpoint = bench.work / "killed.checkpoint"
    code, _, err = bench.train(2, long_words(bench, "killed", "--resume", checkpoint))
    expect(code == 0 and bench.result("killed")[0] == whole, f"gone on with by two: {err}")
    print("a kill of one of 3, gone on with by 2: the same bytes", flush=True)

    process = bench.launch(2, long_words(bench, "stopped"))
    wait_for(bench.work / "stopped.checkpoint")
    os.kill(processes_of(process.pid)[1], signal.SIGTERM)
    out, err = process.communicate(timeout=60)
    expect(process.returncode == 128 + signal.SIGTERM, f"SIGTERM: {process.returncode} {err}")
    expect("go on with --resume" in out, out)
    code, _, err = bench.train(
        3, long_words(bench, "stopped", "--resume", bench.work / "stopped.checkpoint"))
    expect(code == 0 and bench.result("stopped")[0] == whole, f"gone on with by three: {err}")
    print("SIGTERM to one of 2, gone on with by 3: the same bytes", flush=True)

    # A data folder that only the second process does not see.
    gone = bench.work / "gone"
    words = bench.words("failed", "--model", bench.work / "tiny", "--tie", "none", "--views", "0")
    words[words.index("--data") + 1] = gone
    broken = [str(w) for w in [bench.sdmt, *words]]
    seen = f'[ "$OMPI_COMM_WORLD_RANK" = 1 ] || D={bench.work}/people; ' \
           f'exec "$@" --data ${{D:-{gone}}}'
    place = broken.index("--data")
    del broken[place:place + 2]
    result = subprocess.run([str(w) for w in [*bench.launcher(2), "sh", "-c", seen, "sh", *broken]],
                            capture_output=True, text=True, timeout=120)
    expect(result.returncode != 0, "a failing process: exit code 0")
    said = [line for line in result.stderr.splitlines() if line.startswith("sdmt train-embedder")]
    expect(len(said) == 1 and "process 1 on " in said[0] and "gone" in said[0], result.stderr)
    print("one that fails alone is named by the first:", said[0], flush=True)

    # No file may grow beyond a few hundred kB: a checkpoint is larger.
    limited = ["sh", "-c", 'trap "" XFSZ; ulimit -f 100; exec "$@"', "sh"]
    words = [str(w) for w in [*bench.launcher(2), *limited, bench.sdmt,
                              *bench.words("full-disk", "--model", bench.work / "tiny", "--tie",
                                           "none", "--views", "0"), "--threads", "1"]]
    result = subprocess.run(words, capture_output=True, text=True, timeout=120)
    expect(result.returncode == 1, f"full disk: {result.returncode}")
    expect("full-disk.checkpoint: write failed" in result.stderr, result.stderr)
    left = [p.name for p in bench.work.glob("full-disk*")]
    expect(not left, f"full disk: left {left}")
    print("a full disk of the first: exit code 1, nothing left", flush=True)


def part_kills(bench):
    chance = random.Random(0)
    bench.train(0, long_words(bench, "whole"))
    whole = bench.result("whole")[0]
    kills = 0
    while kills < 30:
        name = f"kill{kills}"
        checkpoint = bench.work / f"{name}.checkpoint"
        size = chance.choice((2, 3, 4, 8))
        if kill_one(bench, name, size, chance.randrange(size), chance.random() * 2,
                    signal.SIGKILL):
            kills += 1
        other = chance.choice([s for s in (1, 2, 3, 4, 5, 8, 16) if s != size])
        resume = ("--resume", checkpoint) if checkpoint.exists() else ()
        code, _, err = bench.train(other, long_words(bench, name, *resume))
        expect(code == 0 and bench.result(name)[0] == whole, f"{size} then {other}: {err}")
        print(f"{kills}: a kill of one of {size}, gone on with by {other}: the same bytes",
              flush=True)


def part_races(bench):
    logs = bench.work / "races"
    words = ["valgrind", "--tool=helgrind", "--error-exitcode=9",
             f"--suppressions={pathlib.Path(__file__).parent / 'open_mpi.supp'}",
             f"--log-file={logs}.%p", bench.sdmt,
             *bench.words("races-model", "--model", bench.work / "tiny", "--tie", "none", "--views",
                          "0"), "--threads", "1"]
    place = words.index("--iterations") + 1
    words[place] = "2"
    result = subprocess.run([str(w) for w in [*bench.launcher(2), *words]], capture_output=True,
                            text=True, timeout=600)
    reports = [path.read_text() for path in bench.work.glob("races.*")]
    expect(result.returncode == 0, "".join(reports)[:4000])
    for report in reports:
        print("helgrind:", report.strip().splitlines()[-1], flush=True)


def refused(bench, words, sentence, code):
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=120)
    said = [line for line in result.stderr.splitlines() if line.startswith("sdmt train-embedder")]
    expect(result.returncode == code and len(said) == 1 and sentence in said[0],
           f"expected '{sentence}' once and {code}, got {result.returncode}: {result.stderr}")
    print("refused:", said[0], flush=True)


def part_launch(bench):
    tiny = ["--model", bench.work / "tiny", "--tie", "none", "--views", "0"]
    words = [bench.sdmt, *bench.words("launch", *tiny), "--threads", "1"]
    refused(bench, [*bench.launcher(1), "-x", "SDMT_SIMD=SSE4", *words, ":", "-n", "1", "env",
                    "-u", "SDMT_SIMD", *words], "SDMT_SIMD", 2)
    small = list(words)
    small[small.index("--identities") + 1] = "3"
    refused(bench, [*bench.launcher(2), *small], "a batch of 12 images", 2)
    refused(bench, [*bench.launcher(17), *words], "expected 1 to 16 processes", 2)
    missing = list(words)
    missing[missing.index("--data") + 1] = bench.work / "missing"
    refused(bench, [*bench.launcher(3), *missing], "missing", 2)
    code, out, err = bench.train(4, bench.words("one", *tiny), options=("-x", "SDMT_SIMD=SSE4"),
                                 environment={"SDMT_SIMD": "SSE4"})
    expect(code == 0, err)
    code, out, err = bench.train(0, bench.words("other", *tiny), environment={"SDMT_SIMD": "SSE4"})
    expect(code == 0 and bench.result("one") == bench.result("other"), "SSE4: other bytes")
    print("SSE4 on all: the bytes of one process with SSE4", flush=True)


def without_mpi(sdmt, work):
    """What a binary that was built without MPI says under a launcher."""
    result = subprocess.run(
        [sdmt, "train-embedder", "--data", work, "--output", work / "model"], capture_output=True,
        text=True, env={**os.environ, "OMPI_COMM_WORLD_SIZE": "2", "OMPI_COMM_WORLD_RANK": "0"})
    expect(result.returncode == 1 and "without MPI" in result.stderr, result.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", required=True, type=pathlib.Path)
    parser.add_argument("--mpirun", default="mpirun")
    parser.add_argument("parts", nargs="+")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="sdmt-mpi-") as folder:
        work = pathlib.Path(folder)
        if not arguments.mpirun:
            without_mpi(arguments.sdmt, work)
            print("skipped: this build is without MPI, or there is no mpirun")
            sys.exit(77)
        bench = Bench(arguments.sdmt.resolve(), arguments.mpirun, work)
        for part in arguments.parts:
            globals()[f"part_{part}"](bench)


if __name__ == "__main__":
    main()
