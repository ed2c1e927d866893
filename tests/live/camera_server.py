# SPDX-License-Identifier: Apache-2.0
"""A camera on this machine: Motion JPEG over HTTP, which does at each call what a script says.

A script is a list with one entry a call, the last one for all that follow; an entry is a list of
steps done in turn:
  ("frames", N, RATE)   N pictures, RATE a second
  ("garbage",)          a picture of noise between a JPEG's first and last bytes
  ("cut",)              half a picture
  ("noise", N)          N bytes that are nothing
  ("stall", SECONDS)    silence
  ("size", N)           go on with pictures of set N
  ("end",)              close the connection
and a call whose list is empty is refused.
"""
import random
import socketserver
import threading
import time


class _Server(socketserver.ThreadingTCPServer):
    allow_reuse_address = True
    daemon_threads = True


class Camera:
    def __init__(self, sets, script):
        self.sets, self.script, self.calls, self.sent = sets, script, 0, 0
        self.closed = threading.Event()
        camera = self

        class Handler(socketserver.BaseRequestHandler):
            def handle(self):
                camera.answer(self.request)

        self.server = _Server(("127.0.0.1", 0), Handler)
        self.url = "http://127.0.0.1:%d/video" % self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, args=(0.05,), daemon=True).start()

    def close(self):
        self.closed.set()
        self.server.shutdown()
        self.server.server_close()

    def answer(self, connection):
        steps = self.script[min(self.calls, len(self.script) - 1)]
        self.calls += 1
        if not steps:
            return
        try:
            connection.recv(4096)
            connection.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: "
                               b"multipart/x-mixed-replace; boundary=frame\r\n\r\n")
            self.play(connection, steps)
        except OSError:
            pass  # who looked has left

    def part(self, connection, picture):
        connection.sendall(b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
                           % len(picture) + picture + b"\r\n")

    def play(self, connection, steps):
        pictures, at = self.sets[0], 0
        dice = random.Random(1)
        for step in steps:
            if step[0] == "size":
                pictures = self.sets[step[1]]
            elif step[0] == "stall":
                self.closed.wait(step[1])
            elif step[0] == "noise":
                connection.sendall(dice.randbytes(step[1]))
            elif step[0] == "garbage":
                self.part(connection, b"\xff\xd8" + dice.randbytes(3000) + b"\xff\xd9")
            elif step[0] == "cut":
                self.part(connection, pictures[0][: len(pictures[0]) // 2])
            elif step[0] == "end":
                return
            else:
                start = time.monotonic()
                for i in range(step[1]):
                    self.part(connection, pictures[at % len(pictures)])
                    at += 1
                    self.sent += 1
                    pause = start + (i + 1) / step[2] - time.monotonic()
                    if pause > 0 and self.closed.wait(pause):
                        return
