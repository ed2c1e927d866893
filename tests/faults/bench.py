# SPDX-License-Identifier: Apache-2.0
"""Small inputs for every command, runs of them, and what is to be said of a run.

A run is fine when it ends within the limit of time with the result of an undisturbed run, or with an
error: one line or more on stderr, exit code 1 or 2, and nothing of its outputs but whole files. A
result that differs is fine only where a warning names what was left out. The rest is a fault:
WRONG (success, but another result; a state from which the same command does not go on; or
messages lost that waited), LEFTOVER (files that should not be there), SILENT (an error
without a word), ABORT (a signal), HANG.
"""
import collections
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import time

BAD = ["WRONG", "LEFTOVER", "SILENT", "ABORT", "HANG"]
OUTCOMES = ["equal", "error", "warned"] + BAD

TINY = """{"name": "tiny", "input": {"height": 64, "width": 32}, "layers": [
  {"name": "conv1", "type": "Conv2d", "out_channels": 8, "kernel_size": 3, "stride": 2,
   "padding": 1, "bias": false},
  {"name": "bn1", "type": "BatchNorm2d"}, {"name": "relu1", "type": "ReLU"},
  {"name": "pool1", "type": "MaxPool2d"},
  {"name": "conv2", "type": "Conv2d", "out_channels": 16, "kernel_size": 3, "padding": 1},
  {"name": "relu2", "type": "ReLU"}, {"name": "pool2", "type": "MaxPool2d"},
  {"name": "fc1", "type": "Linear", "out_features": 32},
  {"name": "bn", "type": "BatchNorm1d", "initial_gamma": 0.15, "initial_beta": 1},
  {"name": "l2", "type": "L2Normalize"}]}"""

ZONES = """{"picture": [160, 120],
  "lines": [{"name": "door", "from": [80, 1], "to": [80, 120]}],
  "areas": [{"name": "hall", "corners": [[1, 1], [160, 1], [160, 120], [1, 120]]}]}"""

DARKNET = """[net]
width=64
height=64
channels=3

[convolutional]
filters=7
size=8
stride=8
pad=0
activation=linear

[yolo]
mask=0
anchors=8,24
classes=2
num=1
"""

TRAIN = ("train-embedder --data IN/reid --model IN/tiny.safetensors --tie none --trunk-lr-scale 1 "
         "--identities 2 --instances 2 --holdout-ids 0 --output OUT/m.safetensors ")

STATE = ("track IN/scene --no-appearance --min-length 2 --output OUT/t.txt --jsonl OUT/t.jsonl "
         "--delay 2 --state OUT/t.state --state-every 1")
TUNE = ("tune --sequences IN/scene IN/square --option lambda=0.3,0.7 --draws 2 --config "
        "IN/config.json --output OUT/c.json --json OUT/t.json")

# Words by command; OUT/NAME is an output, IN/NAME an input.
COMMANDS = {
    "track": "track IN/scene --no-appearance --config IN/config.json --output OUT/t.txt "
             "--jsonl OUT/t.jsonl --explain OUT/t.csv",
    "track-avi": "track IN/scene --no-appearance --min-length 2 --render OUT/t.avi",
    "track-mp4": "track IN/scene --no-appearance --min-length 2 --render OUT/t.mp4",
    "track-mkv": "track IN/scene --no-appearance --min-length 2 --render OUT/t.mkv",
    "track-mov": "track IN/scene --no-appearance --min-length 2 --render OUT/t.mov",
    "track-video": "track IN/clip.avi --no-appearance --detections IN/scene/det/det.txt "
                   "--min-length 2 --output OUT/t.txt",
    "track-histogram": "track IN/scene --appearance histogram --min-length 2 --output OUT/t.txt",
    "track-network": "track IN/scene --model IN/tiny.safetensors --tau-a 0.5 --min-length 2 "
                     "--output OUT/t.txt",
    "track-phone": "track IN/phone.mp4 --no-appearance --detections IN/scene/det/det.txt "
                   "--min-length 2 --output OUT/t.txt --render OUT/t.avi",
    "track-zones": "track IN/scene --no-appearance --min-length 2 --output OUT/t.txt "
                   "--zones IN/zones.json --events OUT/e.jsonl --counts OUT/c.csv "
                   "--heat-map OUT/h.png",
    "track-state": STATE,
    "track-resume": STATE,
    # Nobody listens there: all messages wait.
    "track-mqtt": "track IN/scene --no-appearance --min-length 2 --output OUT/t.txt "
                  "--zones IN/zones.json --mqtt mqtt://127.0.0.1:1 --mqtt-queue OUT/queue",
    "count": "count IN/scene.txt --zones IN/zones.json --gt IN/scene --events OUT/e.jsonl "
             "--counts OUT/c.csv",
    "tune": TUNE,
    "tune-state": TUNE + " --state OUT/runs.state",
    "adapt": "adapt IN/street --model IN/tiny.safetensors --no-appearance --iterations 8 "
             "--lr 0.001 --output OUT/m.safetensors --json OUT/a.json",
    "detect": "detect IN/scene --output OUT/d.txt",
    "detect-network": "detect IN/scene --detector IN/made.cfg --output OUT/d.jsonl",
    "evaluate": "evaluate --gt IN/scene --results IN/scene.txt --explain --json OUT/e.json "
                "--csv OUT/e.csv",
    "evaluate-render": "evaluate --gt IN/scene --results IN/poor.txt --long-miss 2 "
                       "--report OUT/e.html --render OUT/drawn",
    "ablate": "ablate --sequences IN/scene --variants SORT 'tuned, no appearance' --json OUT/a.json",
    "synth-scene": "synth scene --output OUT/made --frames 2 --width 160 --height 120 --walkers 1",
    "synth-reid": "synth reid --output OUT/made --identities 4 --images-per-identity 4",
    "inspect": "inspect IN/tiny.safetensors --json OUT/i.json",
    "init-model": "init-model --architecture IN/tiny.json --output OUT/new.safetensors",
    "embed": "embed --model IN/tiny.safetensors --output OUT/e.safetensors IN/1.jpg IN/2.jpg "
             "IN/3.jpg IN/4.jpg",
    "validate-roc": "validate-roc --data IN/reid --model IN/tiny.safetensors --json OUT/v.json "
                    "--report OUT/v.html --plot OUT/v.svg",
    "write-threshold": "validate-roc --data IN/reid --model OUT/m.safetensors --write-threshold",
    "train": TRAIN + "--iterations 3 --views 0 --checkpoint-every 2",
    "train-resume": TRAIN + "--iterations 3 --views 0 --checkpoint-every 2 --log OUT/l.csv "
                            "--resume IN/half.checkpoint",
    "train-cache": TRAIN + "--iterations 2 --views 2 --freeze-trunk --feature-cache "
                           "OUT/c.safetensors",
}
MESSAGES = "queue/frames/0000000000000000001.messages"
# What lies in the output folder before the run.
BEFORE = {"write-threshold": {"m.safetensors": "tiny.safetensors"},
          "track-resume": {"t.state": "begun.state", "t.state.frames": "begun.state.frames"},
          "train-resume": {"l.csv": "half.csv"},
          "track-mqtt": {MESSAGES: "waiting.messages"}}


def unfinished(file):
    """Whether an unfinished run leaves the file on purpose: from it the same command goes on."""
    return file.endswith((".state", ".state.frames"))


def turn(video):
    """Has players show the .mp4 turned by a quarter, as phones do: the display matrix of its tkhd."""
    content = bytearray(video.read_bytes())
    matrix = content.index(b"tkhd") + 44
    content[matrix:matrix + 20] = struct.pack(">5i", 0, 1 << 16, 0, -1 << 16, 0)
    video.write_bytes(content)


def words_of(text):
    """As a shell splits it, quotes and all."""
    return [plain or quoted for quoted, plain in re.findall(r"'([^']*)'|(\S+)", text)]


def steady(name, content, out):
    """What is the same in each run: without times, and wherever the folder lies."""
    content = content.replace(str(out).encode(), b"OUT")
    if name.endswith(".json"):
        content = re.sub(rb'"(fps|hz|seconds|ms)[a-z_]*": [0-9.e+-]+', b"", content)
    if name == "l.csv":  # images_per_second
        content = re.sub(rb"(?m)^((?:[^,]*,){9})[^,]*", rb"\1", content)
    if name.endswith(".messages"):
        content = re.sub(rb'"run":"[0-9a-f]+"', b'"run":""', content)
    if name.endswith(".mkv"):
        # Checksums, SegmentUID, TrackUID, TagTrackUID
        content = re.sub(rb"\xbf\x84.{4}|\x73\xa4\x90.{16}|[\x63\x73]\xc5\x88.{8}", b"", content,
                         flags=re.DOTALL)
    return content


# again: what there is when the command came to its end in a second, undisturbed run, where the first
# had left a state; else nothing.
Result = collections.namedtuple("Result", "code error said files calls again")


class Bench:
    def __init__(self, sdmt, limit):
        self.sdmt = os.path.abspath(sdmt)
        self.limit = limit
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="sdmt-faults-"))
        self.inputs = self.root / "in"
        self.inputs.mkdir()
        self.make_inputs()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.root, ignore_errors=True)

    def make_inputs(self):
        def run(*words):
            done = subprocess.run([self.sdmt, *map(str, words)], capture_output=True, text=True)
            if done.returncode != 0:
                raise SystemExit(f"sdmt {' '.join(map(str, words))}: {done.stderr}")
        at = self.inputs
        run("synth", "scene", "--output", at / "scene", "--frames", 12, "--width", 160,
            "--height", 120, "--walkers", 2)
        run("track", at / "scene", "--no-appearance", "--min-length", 2,
            "--output", at / "scene.txt", "--render", at / "clip.avi")
        rows = (at / "scene.txt").read_text().splitlines(True)
        (at / "poor.txt").write_text("".join(row for row in rows
                                             if not 4 <= int(row.split(",")[0]) <= 8))
        run("track", at / "scene", "--no-appearance", "--min-length", 2,
            "--render", at / "phone.mp4")
        turn(at / "phone.mp4")
        (at / "zones.json").write_text(ZONES)
        (at / "none.txt").write_text("")
        (at / "config.json").write_text('{"min-length": 2, "min-mean-confidence": 0.1}')
        (at / "tiny.json").write_text(TINY)
        run("init-model", "--architecture", at / "tiny.json", "--output", at / "tiny.safetensors")
        run("synth", "reid", "--output", at / "reid", "--identities", 6,
            "--images-per-identity", 4)
        images = sorted((at / "reid/bounding_box_test").glob("*.jpg"))[:4]
        for number, image in enumerate(images, 1):
            shutil.copy(image, at / f"{number}.jpg")
        (at / "made.cfg").write_text(DARKNET)
        (at / "made.names").write_text("person\ncar\n")
        weights = [0.0] * 5 + [-10.0] * 2 + [0.01] * (7 * 3 * 64)
        (at / "made.weights").write_bytes(struct.pack("<3iQ", 0, 2, 0, 0) +
                                          struct.pack(f"<{len(weights)}f", *weights))
        run(*[word.replace("IN/", f"{at}/").replace("OUT/m.", f"{at}/half.")
              for word in words_of(COMMANDS["train"])], "--log", at / "half.csv")
        (at / "half.safetensors.checkpoint").rename(at / "half.checkpoint")
        run("synth", "scene", "--output", at / "square", "--frames", 12, "--width", 160,
            "--height", 120, "--walkers", 2, "--seed", 7)
        run("synth", "scene", "--output", at / "street", "--frames", 120, "--width", 240,
            "--height", 136, "--walkers", 8, "--frame-rate", 5)
        begun = self.root / "begun"
        begun.mkdir()
        run(*self.line("track-mqtt", begun)[1:])
        (begun / MESSAGES).rename(at / "waiting.messages")
        self.begin_state(begun)

    def begin_state(self, at):
        """What a track leaves that is killed when frames are finished."""
        state = at / "t.state"

        def finished():  # stands in the second line
            return state.exists() and int((state.read_bytes().split(b"\n", 2) + [b"0"])[1]) > 0
        for _ in range(100):
            process = subprocess.Popen(self.line("track-state", at), stderr=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL)
            while process.poll() is None and not finished():
                time.sleep(0.0005)
            process.kill()
            process.wait()
            if finished():
                break
        for file in ("t.state", "t.state.frames"):
            shutil.copy(at / file, self.inputs / file.replace("t.", "begun."))

    def prepare(self, name, out):
        out.mkdir(exist_ok=True)
        for file, source in BEFORE.get(name, {}).items():
            (out / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(self.inputs / source, out / file)

    def line(self, name, out):
        return [self.sdmt] + [word.replace("IN/", f"{self.inputs}/").replace("OUT/", f"{out}/")
                              for word in words_of(COMMANDS[name])]

    def environment(self, **more):
        return dict(os.environ, OMP_NUM_THREADS="2", OMP_WAIT_POLICY="passive",
                    SOURCE_DATE_EPOCH="0", **more)

    def run(self, name, out=None, **environment):
        """Runs the command once, into a new folder unless `out` is given, which is kept."""
        work = pathlib.Path(tempfile.mkdtemp(dir=self.root))
        folder = work / "out" if out is None else out
        self.prepare(name, folder)
        log = work / "log"
        try:
            done = subprocess.run(self.line(name, folder), capture_output=True, timeout=self.limit,
                                  env=self.environment(FAULT_LOG=str(log), **environment))
            code, error, said = done.returncode, done.stderr, done.stdout
        except subprocess.TimeoutExpired as expired:
            code, error, said = None, expired.stderr or b"", b""
        files = self.files(folder)
        again = self.go_on(name, folder) if out is None and any(map(unfinished, files)) else None
        calls = log.read_text(errors="replace").splitlines() if log.exists() else []
        calls = [call.replace(str(work), "").replace(str(self.inputs), "IN") for call in calls]
        shutil.rmtree(work)
        return Result(code, error.decode(errors="replace"), said.decode(errors="replace"), files,
                      calls, again)

    def go_on(self, name, out):
        subprocess.run(self.line(name, out), capture_output=True, env=self.environment())
        return self.files(out)

    @staticmethod
    def files(folder):
        return {str(path.relative_to(folder)): steady(path.name, path.read_bytes(), folder)
                for path in sorted(folder.rglob("*")) if path.is_file()}

    def same_frames(self, files, good):
        """Whether the files are videos of as many frames that look alike, though encoded
        otherwise: written again as pictures they are about as long."""
        if files.keys() != good.keys() or not all(name.startswith("t.m") for name in files):
            return False
        with tempfile.TemporaryDirectory(dir=self.root) as work:
            drawn = []
            for name in files:
                for content in (files[name], good[name]):
                    video = pathlib.Path(work) / name
                    video.write_bytes(content)
                    again = pathlib.Path(work) / "again.avi"
                    subprocess.run([self.sdmt, "track", video, "--no-appearance", "--detections",
                                    self.inputs / "scene/det/det.txt", "--render", again],
                                   capture_output=True)
                    drawn.append(again.stat().st_size if again.exists() else 0)
                    again.unlink(missing_ok=True)
            return 0 not in drawn and all(abs(a - b) < 0.25 * b
                                          for a, b in zip(drawn[::2], drawn[1::2]))

    def plays(self, name, content):
        """Whether it is a video that is whole, of however many frames."""
        if not name.endswith((".avi", ".mp4", ".mkv", ".mov")):
            return False
        with tempfile.TemporaryDirectory(dir=self.root) as work:
            video = pathlib.Path(work) / name
            video.write_bytes(content)
            done = subprocess.run([self.sdmt, "track", video, "--no-appearance", "--detections",
                                   self.inputs / "none.txt", "--output", video.with_suffix(".txt")],
                                  capture_output=True)
            return done.returncode == 0 and b"warning" not in done.stderr

    def grown(self, name, file, content, good):
        """Whether it is what an output has that grows until the input fails."""
        if not name.startswith("track"):
            return file == "l.csv" and good.startswith(content)
        # Boxes are smoothed by what came after them: only who is in which frame is the same.
        who, all_who = ([line.split(b",")[:2] for line in rows.splitlines()]
                        for rows in (content, good))
        grown = good.startswith(content) or file == "t.txt" and who == all_who[:len(who)]
        return grown or self.plays(file, content)

    def before(self, name):
        return {file: steady(file, (self.inputs / source).read_bytes(), self.root / "none")
                for file, source in BEFORE.get(name, {}).items()}

    def equal(self, files, good):
        """Whether the same files are there; states need not be equal."""
        return files.keys() == good.keys() and all(
            unfinished(file) or content == good[file] for file, content in files.items())

    def lost(self, name, files):
        """Whether something is gone that was there before: messages stay, and more may follow."""
        return any(file not in files or
                   file.endswith(".messages") and not files[file].startswith(old)
                   for file, old in self.before(name).items() if not unfinished(file))

    def judge(self, name, result, good):
        if result.code is None:
            return "HANG"
        if result.code < 0 or result.code >= 128:
            return "ABORT"
        if self.lost(name, result.files) or (result.again is not None and
                                             not self.equal(result.again, good)):
            return "WRONG"
        if result.code != 0:
            # What was finished before the fault is whole; what was there before may still be, and
            # what grows keeps what it has.
            old = self.before(name)
            whole = all(unfinished(file) or content in (good.get(file), old.get(file)) or
                        file in good and self.grown(name, file, content, good[file])
                        for file, content in result.files.items())
            return "LEFTOVER" if not whole else "error" if result.error.strip() else "SILENT"
        if self.equal(result.files, good) or self.same_frames(result.files, good):
            return "equal"
        said = re.sub("warning: mqtt://.*( is away| messages wait)", "", result.error + result.said)
        told = re.search("warning|unreadable|left out", said)
        return "warned" if told else "WRONG"


class Table:
    """Outcomes by command and kind; the faults as they are found."""

    def __init__(self):
        self.counts, self.faults = {}, []

    def add(self, name, kind, outcome, result, what=""):
        self.counts.setdefault((name, kind), collections.Counter())[outcome] += 1
        if outcome in BAD:
            last = re.sub(r"\s+", " ", result.error.strip())[-200:]
            self.faults.append(f"{outcome} {name} {kind} {what}: exit {result.code}, "
                               f"{sorted(result.files)}, {last!r}")
            print(self.faults[-1], flush=True)

    def print(self):
        print(f"{'command':<16} {'kind':<9} {'runs':>6} " + " ".join(f"{o:>8}" for o in OUTCOMES))
        sums = collections.defaultdict(collections.Counter)
        for (name, kind), counts in self.counts.items():
            for key in (kind, "all"):
                sums[key] += counts
            self.print_row(name, kind, counts)
        for kind, counts in sums.items():
            self.print_row("all", kind if kind != "all" else "", counts)

    @staticmethod
    def print_row(name, kind, counts):
        print(f"{name:<16} {kind:<9} {sum(counts.values()):>6} " +
              " ".join(f"{counts[o] or '.':>8}" for o in OUTCOMES))

    def exit_code(self):
        return 1 if self.faults or not self.counts else 0
