# SPDX-License-Identifier: Apache-2.0
"""An sdmt track --serve on a made scene, and what its viewers do."""
import json
import re
import socket
import subprocess
import time
import urllib.error
import urllib.request

from scene_camera import SDMT, SceneCamera


class Served(SceneCamera):
    def start(self, *words):
        self.process = subprocess.Popen(
            [SDMT, "track", self.camera.url, "--no-appearance", "--detections",
             self.path / "det.txt", "--delay", "0", "--serve", "0", *words],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.process.stdout.close)
        self.addCleanup(self.process.stderr.close)
        self.addCleanup(self.process.wait)
        self.addCleanup(self.process.kill)
        self.url = self.process.stdout.readline().strip()
        self.assertRegex(self.url, r"^http://127\.0\.0\.1:\d+/$")

    def get(self, path, **headers):
        request = urllib.request.Request(self.url + path, headers=headers)
        with urllib.request.urlopen(request, timeout=20) as answer:
            return answer.read().decode()

    def status(self, path, **headers):
        try:
            self.get(path, **headers)
        except urllib.error.HTTPError as error:
            with error:
                return error.code
        return 200

    def one(self):
        return json.loads(self.get("state"))["cameras"][0]

    def until(self, condition):
        end = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.1)

    def look(self, path):
        host, port = re.match(r"http://(.*):(\d+)/", self.url).groups()
        viewer = socket.create_connection((host, int(port)), timeout=20)
        self.addCleanup(viewer.close)
        viewer.sendall(f"GET /{path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        return viewer

    def picture(self, viewer):
        got = b""
        while not re.search(rb"\xff\xd8.*\xff\xd9\r\n", got, re.S):
            more = viewer.recv(65536)
            self.assertTrue(more, got[:300])
            got += more
        return got
