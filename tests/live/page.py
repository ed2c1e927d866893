#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of sdmt track --serve in Chromium, as wide as a desk's screen and as a telephone's: leaves
page-1280.png and page-390.png in a folder, and fails when a picture does not come, the connection is
lost, or the page is wider than the screen."""
import argparse
import base64
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from camera_server import Camera


class Browser:
    """Chromium, told what to do by the pipes that it reads as descriptors 3 and 4."""

    def __init__(self, folder):
        ours, theirs = os.pipe(), os.pipe()

        self.process = subprocess.Popen(
            ["sh", "-c", f'exec "$@" 3<&{ours[0]} 4>&{theirs[1]}', "sh", shutil.which("chromium"),
             "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-sync",
             f"--user-data-dir={folder}", "--remote-debugging-pipe", "about:blank"],
            pass_fds=(ours[0], theirs[1]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(ours[0])
        os.close(theirs[1])
        self.words, self.answers = ours[1], os.fdopen(theirs[0], "rb")
        self.number, self.session, self.rest = 0, {}, b""
        target = self.tell("Target.createTarget", url="about:blank")["targetId"]
        self.session = {"sessionId": self.tell("Target.attachToTarget", targetId=target,
                                               flatten=True)["sessionId"]}

    def tell(self, method, **words):
        self.number += 1
        message = {"id": self.number, "method": method, "params": words, **self.session}
        os.write(self.words, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.rest:
                more = self.answers.read1(65536)
                assert more, "Chromium has ended"
                self.rest += more
            answer, self.rest = self.rest.split(b"\0", 1)
            answer = json.loads(answer)
            if answer.get("id") == self.number:
                assert "result" in answer, answer
                return answer["result"]

    def value(self, expression):
        """None where it fails, as long as a page is not there."""
        return self.tell("Runtime.evaluate", expression=expression,
                         returnByValue=True)["result"].get("value")

    def close(self):
        self.process.kill()
        self.process.wait()


SEEN = """({wide: document.documentElement.scrollWidth, pictures:
  [...document.images].filter(image => image.naturalWidth > 0).length,
  lost: document.querySelector("#lost").textContent,
  rows: document.querySelectorAll("table tr").length,
  events: document.querySelectorAll("#log li").length})"""


def look(url, folder, profile, cameras):
    browser, well = Browser(profile), True
    try:
        for width, height in (1280, 900), (390, 1400):
            browser.tell("Emulation.setDeviceMetricsOverride", width=width, height=height,
                         deviceScaleFactor=1, mobile=width < 500)
            browser.tell("Page.navigate", url=url)
            end, seen = time.monotonic() + 30, {}
            while time.monotonic() < end:
                time.sleep(1)
                seen = browser.value(SEEN)
                if seen and seen["pictures"] == cameras and seen["rows"] and seen["events"] > 5:
                    break
            picture = browser.tell("Page.captureScreenshot")["data"]
            (folder / f"page-{width}.png").write_bytes(base64.b64decode(picture))
            print(f"{width} wide: {seen}")
            well = (well and seen and seen["pictures"] == cameras and seen["rows"] == 2 * cameras
                    and seen["events"] > 5 and not seen["lost"] and seen["wide"] <= width)
    finally:
        browser.close()
    return well


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sdmt", required=True)
    parser.add_argument("--folder", required=True, type=pathlib.Path)
    parser.add_argument("--sequence", type=pathlib.Path, help="what two cameras show [a made scene]")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        path = pathlib.Path(name)
        sequence = arguments.sequence or path / "scene"
        if not arguments.sequence:
            subprocess.run([arguments.sdmt, "synth", "scene", "--output", sequence, "--frames", "300",
                            "--walkers", "6", "--width", "480", "--height", "270"], check=True,
                           capture_output=True)
        pictures = [file.read_bytes() for file in sorted((sequence / "img1").iterdir())]
        width, height = (int(re.search(rf"im{side}=(\d+)", (sequence / "seqinfo.ini").read_text())[1])
                         for side in ("Width", "Height"))
        middle = width // 2
        (path / "zones.json").write_text(json.dumps({
            "picture": [width, height],
            "lines": [{"name": "middle", "from": [middle, 1], "to": [middle, height]}],
            "areas": [{"name": "left",
                       "corners": [[1, 1], [middle, 1], [middle, height], [1, height]]}]}))
        cameras = [Camera([pictures], [[("frames", 100000, 10)]]) for _ in range(2)]
        process = subprocess.Popen(
            [arguments.sdmt, "track", *[camera.url for camera in cameras], "--no-appearance",
             "--detections", sequence / "det/det.txt", "--delay", "0", "--zones",
             path / "zones.json", "--jsonl", "t.jsonl", "--output-dir", path, "--serve", "0"],
            stdout=subprocess.PIPE, text=True)
        try:
            url = process.stdout.readline().strip()
            return 0 if look(url, arguments.folder, path / "profile", len(cameras)) else 1
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait()
            for camera in cameras:
                camera.close()


if __name__ == "__main__":
    sys.exit(main())
