#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sdmt track --no-store: no pixel and no vector in a file or on a socket. SDMT_BINARY names sdmt."""
import json
import os
import pathlib
import random
import re
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

SDMT = os.environ["SDMT_BINARY"]
SIZE = 96  # of the pictures, pixels
DIMENSIONS = 16
ENCODED = (b"\xff\xd8\xff", b"RIFF", b"matroska", b"ftyp", b"II*\0", b"GIF8", b"BM")
TEXTS = re.compile(rb"data:image|base64", re.I)


class Sink:
    """Stands for a broker, takes what it is sent and keeps it."""

    def __init__(self):
        self.got, self.server = bytearray(), socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self.take, daemon=True).start()

    def take(self):
        while True:
            try:
                connection, _ = self.server.accept()
            except OSError:
                return
            threading.Thread(target=self.answer, args=(connection,), daemon=True).start()

    # As much of MQTT 3.1.1 as acknowledges everything.
    def answer(self, connection):
        with connection, connection.makefile("rb") as stream:
            while True:
                head = stream.read(1)
                if not head:
                    return
                size, shift = 0, 0
                while True:
                    digit = stream.read(1)[0]
                    size |= (digit & 127) << shift
                    shift += 7
                    if digit < 128:
                        break
                body = stream.read(size)
                self.got += body
                kind = head[0] >> 4
                if kind == 1:
                    connection.sendall(b"\x20\x02\0\0")
                elif kind == 3 and head[0] & 6:
                    at = 2 + struct.unpack(">H", body[:2])[0]
                    connection.sendall(b"\x40\x02" + body[at : at + 2])
                elif kind == 12:
                    connection.sendall(b"\xd0\0")


class NoStore(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        dice = random.Random(5)
        self.pixels = [dice.randbytes(3 * SIZE * SIZE) for _ in range(30)]
        (self.path / "frames/img1").mkdir(parents=True)
        (self.path / "frames/seqinfo.ini").write_text(
            "[Sequence]\nname=frames\nimDir=img1\nframeRate=10\nseqLength=30\n"
            f"imWidth={SIZE}\nimHeight={SIZE}\nimExt=.bmp\n")
        for i, pixels in enumerate(self.pixels):  # as they are
            head = struct.pack("<2sIHHI", b"BM", 54 + len(pixels), 0, 0, 54)
            info = struct.pack("<IiiHHIIiiII", 40, SIZE, SIZE, 1, 24, 0, len(pixels), 0, 0, 0, 0)
            (self.path / "frames/img1" / f"{i + 1:06}.bmp").write_bytes(head + info + pixels)
        self.vector = [dice.uniform(-1, 1) for _ in range(DIMENSIONS)]
        length = sum(x * x for x in self.vector) ** 0.5
        self.vector = [x / length for x in self.vector]
        with (self.path / "boxes.jsonl").open("w") as file:
            for i in range(30):
                file.write(json.dumps({"frame": i + 1, "time": i / 10, "boxes": [[20 + i, 20, 20, 50]],
                                       "scores": [0.9], "embeddings": [self.vector]}) + "\n")
        (self.path / "zones.json").write_text(json.dumps({"picture": [SIZE, SIZE], "lines": [
            {"name": "door", "from": [45, 1], "to": [45, 96]}]}))
        (self.path / "out").mkdir()

    def leaks(self, data):
        """What of pictures and vectors is in it."""
        found = [f"picture {i + 1}" for i, pixels in enumerate(self.pixels)
                 if any(pixels[at : at + 9] in data for at in range(0, len(pixels), 301))]
        if any(mark in data for mark in ENCODED if len(mark) > 2) or data[:2] == b"BM":
            found.append("an encoded picture")
        if TEXTS.search(data):
            found.append("a picture as text")
        for x in self.vector:
            digits = f"{abs(x):.10f}"[:7].encode()  # as text, however many digits it has
            if digits in data:
                found.append("a vector's number as text")
            # But for the last bits.
            if struct.pack("<f", x)[1:] in data:
                found.append("a vector's number")
            if struct.pack("<d", x)[2:] in data:
                found.append("a vector's number, twice as long")
        return found

    def track(self, *words):
        return subprocess.run(
            [SDMT, "track", self.path / "frames", "--detections", self.path / "boxes.jsonl",
             "--tau-a", "0.5", *words], capture_output=True, timeout=120)

    def left(self):
        return {file.name: file.read_bytes() for file in (self.path / "out").rglob("*")
                if file.is_file()}

    def test_the_scan_finds_what_is_there(self):
        out = self.path / "out"
        result = self.track("--render", out / "v.avi", "--delay", "5", "--jsonl", out / "t.jsonl")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("an encoded picture", self.leaks(self.left()["v.avi"]))
        for i in 0, 7:
            self.assertEqual(self.leaks(b"x" + self.pixels[i] + b"y"), [f"picture {i + 1}"])
        self.assertTrue(self.leaks(struct.pack("<16f", *self.vector)))
        self.assertTrue(self.leaks(struct.pack("<16d", *self.vector)))
        self.assertTrue(self.leaks(json.dumps(self.vector).encode()))

    def test_no_output_holds_pixels_or_vectors(self):
        out, sink = self.path / "out", Sink()
        self.addCleanup(sink.server.close)
        result = self.track(
            "--no-store", "--output", out / "t.txt", "--jsonl", out / "t.jsonl", "--json",
            out / "r.json", "--explain", out / "x.csv", "--zones", self.path / "zones.json",
            "--events", out / "e.jsonl", "--counts", out / "c.csv", "--stats", "--mqtt",
            f"mqtt://127.0.0.1:{sink.port}", "--mqtt-queue", out / "queue", "--serve", "0")
        self.assertEqual(result.returncode, 0, result.stderr)
        left = self.left()
        self.assertEqual(set(left), {"t.txt", "t.jsonl", "r.json", "x.csv", "e.jsonl", "c.csv"})
        self.assertIn(b'"tracks"', sink.got)
        for name, data in {**left, "messages": bytes(sink.got), "printed": result.stdout,
                           "said": result.stderr}.items():
            self.assertEqual(self.leaks(data), [], name)

    def test_viewers_get_no_picture(self):
        process = subprocess.Popen(
            [SDMT, "track", self.path / "frames", "--detections", "-", "--tau-a", "0.5",
             "--no-store", "--serve", "0"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        url = process.stdout.readline().decode().strip()
        lines = (self.path / "boxes.jsonl").read_text().splitlines(True)
        process.stdin.write("".join(lines[:20]).encode())
        process.stdin.flush()
        time.sleep(1)
        for path in "", "state", "metrics", "picture/frames", "video/frames", "events":
            try:
                with urllib.request.urlopen(url + path, timeout=20) as answer:
                    data = answer.readline() if path == "events" else answer.read()
                    self.assertNotIn(path, ("picture/frames", "video/frames"))
            except urllib.error.HTTPError as error:
                with error:
                    self.assertEqual((error.code, path.split("/")[0] in ("picture", "video")),
                                     (404, True))
                    data = error.read()
            self.assertEqual(self.leaks(data), [], path)
        limits = pathlib.Path(f"/proc/{process.pid}/limits").read_text()
        self.assertRegex(limits, r"Max core file size +0 +0 ")
        process.stdin.close()

    def test_what_keeps_them_is_refused(self):
        for words in ["--render", "v.avi"], ["--state", "s"]:
            result = self.track("--no-store", words[0], self.path / "out" / words[1], "--output",
                                self.path / "out/t.txt")
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(b"expected none with --no-store", result.stderr)
        self.assertEqual(self.left(), {})


if __name__ == "__main__":
    unittest.main()
