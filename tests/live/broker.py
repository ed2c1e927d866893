# SPDX-License-Identifier: Apache-2.0
"""A mosquitto of our own, which may be killed and started again, and what it hands on."""
import json
import pathlib
import shutil
import signal
import subprocess
import threading
import time

from ports import free_port, wait_for_port

MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
SUBSCRIBE, PUBLISH = shutil.which("mosquitto_sub"), shutil.which("mosquitto_pub")


class Broker:
    """Keeps sessions on the disk, and hands on at once what it acknowledges: when it is killed, it has
    nothing that others have not."""

    def __init__(self, folder, lines=()):
        self.folder, self.port, self.process = pathlib.Path(folder), free_port(), None
        self.folder.mkdir(exist_ok=True)
        (self.folder / "mosquitto.conf").write_text("\n".join([
            f"listener {self.port} 127.0.0.1", "persistence true",
            f"persistence_location {self.folder}/", "user root", "max_queued_messages 0",
            "max_inflight_messages 0",
            *(lines or ["allow_anonymous true"])]) + "\n")

    def start(self):
        with (self.folder / "log").open("a") as log:
            self.process = subprocess.Popen([MOSQUITTO, "-c", self.folder / "mosquitto.conf"],
                                            stdout=subprocess.DEVNULL, stderr=log)
        wait_for_port(self.port, self.process)

    def stop(self, how=signal.SIGKILL):
        if self.process is not None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(how)
            self.process.wait()
            self.process = None


class Subscriber:
    """Takes everything from its construction on; comes back with its session when the broker does."""

    def __init__(self, port, *words):
        self.messages = []  # (topic, object), as they come
        where = ["-h", "127.0.0.1", "-p", str(port), *words]
        subprocess.run([PUBLISH, *where, "-t", "ready", "-r", "-q", "1", "-m", "{}"], check=True)
        self.process = subprocess.Popen(
            [SUBSCRIBE, *where, "-t", "#", "-q", "1", "-i", "looker", "-c", "-F", "%t\t%p"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()
        end = time.monotonic() + 30
        while not self.messages:
            assert time.monotonic() < end, "it does not subscribe"
            time.sleep(0.05)

    def read(self):
        for line in self.process.stdout:
            topic, payload = line.rstrip("\n").split("\t", 1)
            self.messages.append((topic, json.loads(payload)))

    def close(self):
        self.process.kill()
        self.process.wait()
        self.thread.join()
        self.process.stdout.close()

    def of(self, end):
        return [body for topic, body in list(self.messages) if topic.endswith(end)]


def once(messages):
    """Those that are not there for a second time, as docs/mqtt.md tells to find them, and how many
    are missing between the first and the last of each run."""
    last, kept, missing = {}, [], 0
    for message in messages:
        before = last.get(message["run"])
        if before is not None and message["seq"] <= before:
            continue
        missing += message["seq"] - (before or 0) - 1
        last[message["run"]] = message["seq"]
        kept.append(message)
    return kept, missing
