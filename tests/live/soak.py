#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A camera for a long time: frames without an end through the live path, with zones, a broker and the
page open. Fails when memory or descriptors grow, or a line or a message is missing."""
import argparse
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

PERIOD = 400  # frames after which the boxes are the same again
WARM = 0.2    # of the frames, until whose end memory may grow
SLACK = 4096  # kB that it may grow later

ZONES = {"picture": [160, 120],
         "lines": [{"name": "middle", "from": [80, 1], "to": [80, 120]}],
         "areas": [{"name": "left", "corners": [[1, 1], [80, 1], [80, 120], [1, 120]]}]}


def boxes(frame):
    """Five people who walk through the picture one after the other, each time as somebody new."""
    return [[round(x, 1), 10 + 15 * who, 12, 30] for who in range(5)
            if (x := ((frame + 70 * who) % PERIOD) * 0.6) < 140]


def feed(pipe, frames, rate):
    rows, start = [json.dumps(boxes(frame)) for frame in range(PERIOD)], time.monotonic()
    try:
        for first in range(1, frames + 1, 100):
            pipe.write("".join('{"frame": %d, "boxes": %s}\n' % (frame, rows[frame % PERIOD])
                               for frame in range(first, min(first + 100, frames + 1))))
            pipe.flush()
            time.sleep(max(0, start + first / rate - time.monotonic()))
        pipe.close()
    except BrokenPipeError:
        pass


class Tally:
    """Who listens at the broker."""

    def __init__(self, port, command):
        self.last, self.count, self.missing, self.events = 0, 0, 0, 0
        self.process = subprocess.Popen(
            [command, "-h", "127.0.0.1", "-p", str(port), "-t", "sdmt/+/+", "-q", "1", "-i", "tally",
             "-c", "-F", "%t\t%p"], stdout=subprocess.PIPE, text=True)
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            topic, payload = line.split("\t", 1)
            if topic.endswith("/events"):
                self.events += 1
            elif topic.endswith("/frames"):
                number = int(re.search(r'"seq":(\d+)', payload)[1])
                self.missing += number - self.last - 1
                self.last = number
                self.count += 1


def look(url, name, closing):
    """What the page asks for: the state as it changes, and one picture after the other."""
    def states():
        with urllib.request.urlopen(url + "events", timeout=30) as events:
            while not closing.is_set() and events.readline():
                pass

    def pictures():
        while not closing.wait(0.1):
            try:
                urllib.request.urlopen(url + "picture/" + name, timeout=30).read()
            except OSError:
                pass

    for work in states, pictures:
        threading.Thread(target=work, daemon=True).start()


def held(process):
    """Memory of its own in kB, and descriptors."""
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    return (int(re.search(r"RssAnon:\s+(\d+)", status)[1]),
            len(os.listdir(f"/proc/{process.pid}/fd")))


def soak(arguments, path):
    os.environ["SDMT_BINARY"] = arguments.sdmt
    from broker import SUBSCRIBE, Broker
    from camera_server import Camera
    subprocess.run([arguments.sdmt, "synth", "scene", "--output", path / "scene", "--frames", "50",
                    "--walkers", "2", "--width", "160", "--height", "120"], check=True,
                   capture_output=True)
    pictures = [file.read_bytes() for file in sorted((path / "scene/img1").iterdir())]
    (path / "zones.json").write_text(json.dumps(ZONES))
    camera = Camera([pictures], [[("frames", arguments.frames + 1000, 1e9), ("stall", 3600)]])
    broker = Broker(path / "broker")
    broker.start()
    tally = Tally(broker.port, SUBSCRIBE)
    process = subprocess.Popen(
        [arguments.sdmt, "track", camera.url, "--no-appearance", "--detections", "-", "--jsonl",
         path / "t.jsonl", "--zones", path / "zones.json", "--events", path / "e.jsonl", "--rotate",
         "5MB", "--keep", "60s", "--mqtt", f"mqtt://127.0.0.1:{broker.port}", "--mqtt-queue",
         path / "queue", "--serve", "0", "--json", path / "report.json"], stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        url = process.stdout.readline().strip()
        errors = []
        threading.Thread(target=lambda: errors.extend(process.stderr), daemon=True).start()
        threading.Thread(target=feed, args=(process.stdin, arguments.frames, arguments.rate),
                         daemon=True).start()
        state = lambda: json.load(urllib.request.urlopen(url + "state", timeout=30))["cameras"][0]
        closing = threading.Event()
        look(url, state()["camera"], closing)
        start, samples = time.monotonic(), []
        print("seconds    frames  people   kB anon  descriptors", flush=True)
        while process.poll() is None:
            try:
                now = state()
                samples.append((now["frame"], *held(process)))
            except (OSError, TypeError):
                break  # it has just ended
            print(f"{time.monotonic() - start:7.0f} {now['frame']:9} {now['people_so_far']:7} "
                  f"{samples[-1][1]:9} {samples[-1][2]:12}", flush=True)
            for _ in range(arguments.every):
                if process.poll() is None:
                    time.sleep(1)
        closing.set()
        process.wait(60)
        end = time.monotonic() + 60
        while tally.count < arguments.frames and time.monotonic() < end:
            time.sleep(0.2)
        frames = json.loads((path / "report.json").read_text())["frames"]
        early = [row for row in samples if row[0] <= WARM * arguments.frames] or samples[:1]
        late = [row for row in samples if row[0] > WARM * arguments.frames]
        grown = max(row[1] for row in late) - max(row[1] for row in early)
        more = max(row[2] for row in late) - max(row[2] for row in early)
        print(f"{frames} frames, exit code {process.returncode}; {tally.count} messages of frames, "
              f"{tally.missing} missing, {tally.events} of events; grown by {grown} kB and {more} "
              f"descriptors after the first {WARM:.0%}")
        print("".join(line for line in errors if "warning" in line), end="")
        return (frames == tally.count == arguments.frames and tally.missing == 0 and grown <= SLACK
                and more <= 2)
    finally:
        process.kill()
        process.wait()
        tally.process.kill()
        broker.stop(signal.SIGKILL)
        camera.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--rate", type=float, default=3000, help="frames a second, at most")
    parser.add_argument("--every", type=int, default=10, help="seconds between looks at memory")
    with tempfile.TemporaryDirectory() as folder:
        return 0 if soak(parser.parse_args(), pathlib.Path(folder)) else 1


if __name__ == "__main__":
    sys.exit(main())
