#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sdmt track --mqtt with a real mosquitto. SDMT_BINARY names sdmt, SDMT_SCHEMAS the folder of the
descriptions of messages, SDMT_BROKER_KILLS how often the broker is killed (10)."""
import json
import os
import pathlib
import signal
import subprocess
import time
import unittest

from broker import MOSQUITTO, SUBSCRIBE, Broker, Subscriber, once
from ports import free_port
from scene_camera import SDMT, SceneCamera
from schema import fits

KILLS = int(os.environ.get("SDMT_BROKER_KILLS", 10))
SCHEMAS = pathlib.Path(os.environ["SDMT_SCHEMAS"])
ZONES = {"picture": [320, 180],
         "lines": [{"name": "middle", "from": [160, 1], "to": [160, 180]}],
         "areas": [{"name": "left", "corners": [[1, 1], [160, 1], [160, 180], [1, 180]]}]}


@unittest.skipUnless(MOSQUITTO and SUBSCRIBE, "mosquitto and mosquitto-clients are not installed")
class Mqtt(SceneCamera):
    def setUp(self):
        super().setUp()
        (self.path / "zones.json").write_text(json.dumps(ZONES))

    def broker(self, *lines):
        broker = Broker(self.path / "broker", lines)
        self.addCleanup(broker.stop)
        return broker

    def subscriber(self, broker, *words):
        subscriber = Subscriber(broker.port, *words)
        broker.process.send_signal(signal.SIGUSR1)  # keep its session
        self.addCleanup(subscriber.close)
        return subscriber

    def start(self, url, *words, **more):
        process = subprocess.Popen(
            [SDMT, "track", self.camera.url, "--no-appearance", "--detections",
             self.path / "det.txt", "--delay", "0", "--zones", self.path / "zones.json", "--mqtt",
             url, "--mqtt-queue", self.path / "queue", "--jsonl", self.path / "t.jsonl",
             "--events", self.path / "e.jsonl", *words],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **more)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def finish(self, process, code=130, how=signal.SIGINT):
        process.send_signal(how)
        _, messages = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, messages)
        return messages

    def until(self, condition, seconds=90):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.05)

    def lines(self, name):
        file = self.path / name
        return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []

    def without_numbers(self, messages):
        return [{key: value for key, value in message.items() if key not in ("run", "seq")}
                for message in messages]

    def test_frames_events_and_states_are_sent_as_described(self):
        broker = self.broker()
        broker.start()
        looker = self.subscriber(broker)
        process = self.start(f"mqtt://127.0.0.1:{broker.port}/site/hall")
        self.until(lambda: len(looker.of("/frames")) > 60 and looker.of("/events"))
        name = [topic for topic, _ in looker.messages if topic.endswith("/frames")][0].split("/")[2]
        self.finish(process)
        self.until(lambda: looker.of("hall/status")[-1]["status"] == "offline")
        frames, events = looker.of("/frames"), looker.of("/events")
        self.assertEqual(self.without_numbers(frames), self.lines("t.jsonl"))
        self.assertEqual(self.without_numbers(events), self.lines("e.jsonl"))
        self.assertEqual([message["seq"] for message in frames], list(range(1, len(frames) + 1)))
        for topic, messages, file in (
                ("frames", frames, "track-lines"), ("events", events, "zone-events"),
                ("states", looker.of(f"hall/{name}/status"), "camera-state"),
                ("status", looker.of("hall/status"), "broker-status")):
            schema = json.loads((SCHEMAS / f"{file}.schema.json").read_text())
            self.assertTrue(messages, topic)
            for message in messages:
                self.assertIsNone(fits(message, schema))
        self.assertFalse((self.path / "queue").exists())  # nothing waits

    def test_a_last_will_tells_of_a_kill(self):
        broker = self.broker()
        broker.start()
        looker = self.subscriber(broker)
        process = self.start(f"mqtt://127.0.0.1:{broker.port}")
        self.until(lambda: looker.of("sdmt/status"))
        self.assertEqual(looker.of("sdmt/status")[-1]["status"], "online")
        process.kill()
        self.until(lambda: looker.of("sdmt/status")[-1]["status"] == "offline")

    def test_a_broker_that_is_killed_and_comes_back_misses_nothing(self):
        broker = self.broker()
        broker.start()
        looker = self.subscriber(broker)
        process = self.start(f"mqtt://127.0.0.1:{broker.port}")
        # What a broker remembers of its last life comes again, and is no sign of ours.
        newest = lambda: max((message["seq"] for message in looker.of("/frames")), default=0)
        for i in range(KILLS):
            before = newest()
            self.until(lambda: newest() > before + 20)
            broker.stop(signal.SIGKILL if i % 2 else signal.SIGTERM)
            time.sleep(0.2 * i)
            broker.start()
        self.until(lambda: newest() + 5 > len(self.lines("t.jsonl")))
        messages = self.finish(process)
        self.assertIn("is away", messages)
        self.assertIn("0 have been dropped", messages)
        for topic, file in ("/frames", "t.jsonl"), ("/events", "e.jsonl"):
            self.until(lambda: len(once(looker.of(topic))[0]) >= len(self.lines(file)))
            kept, missing = once(looker.of(topic))
            self.assertEqual(missing, 0)
            self.assertEqual(self.without_numbers(kept), self.lines(file))

    def test_what_waits_outlives_a_kill(self):
        broker = self.broker()
        broker.start()
        looker = self.subscriber(broker)  # whose session is kept
        broker.stop(signal.SIGTERM)
        url = f"mqtt://127.0.0.1:{broker.port}"
        for _ in range(3):
            lines = len(self.lines("t.jsonl"))
            process = self.start(url)
            self.until(lambda: len(self.lines("t.jsonl")) > lines + 30)
            process.kill()
            process.wait()
        broker.start()
        process = self.start(url)
        self.until(lambda: len({message["run"] for message in looker.of("/frames")}) == 4)
        self.finish(process)
        self.until(lambda: len(looker.of("/frames")) >= len(self.lines("t.jsonl")))
        kept, missing = once(looker.of("/frames"))
        self.assertEqual(missing, 0)
        # A frame is written to one after the other: a kill between the two leaves one more in one.
        frames = [(message["utc"], message["frame"]) for message in kept]
        lines = [(line["utc"], line["frame"]) for line in self.lines("t.jsonl")]
        self.assertLessEqual(len(set(lines) ^ set(frames)), 3)
        self.assertEqual(frames, [line for line in lines if line in set(frames)])

    def test_what_is_too_much_is_dropped_and_told_and_nobody_waits(self):
        port = free_port()  # nobody is there
        process = self.start(f"mqtt://127.0.0.1:{port}", "--mqtt-queue-size", "1MB", "--rotate",
                             "100MB")
        self.until(lambda: len(self.lines("t.jsonl")) > 40)
        times = [line["time"] for line in self.lines("t.jsonl")]
        self.assertGreater(len(times) / (times[-1] - times[0]), 10)  # of 20 a second
        start = time.monotonic()
        messages = self.finish(process)
        self.assertLess(time.monotonic() - start, 5)
        self.assertIn("is away", messages)
        self.assertRegex(messages, r"\d+ messages wait in ")
        self.assertTrue(list((self.path / "queue/frames").glob("*.messages")))

    def test_a_broker_that_stalls_slows_nobody(self):
        broker = self.broker()
        broker.start()
        process = self.start(f"mqtt://127.0.0.1:{broker.port}")
        self.until(lambda: len(self.lines("t.jsonl")) > 20)
        broker.process.send_signal(signal.SIGSTOP)
        before = len(self.lines("t.jsonl"))
        time.sleep(3)
        self.assertGreater(len(self.lines("t.jsonl")) - before, 30)  # of 60
        start = time.monotonic()
        self.finish(process)
        self.assertLess(time.monotonic() - start, 6)

    def test_passwords_and_certificates(self):
        keys = self.path / "keys"
        keys.mkdir()
        run = lambda *words: subprocess.run(words, check=True, capture_output=True, cwd=keys)
        run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
            "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
        run("openssl", "req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout",
            "server.key", "-out", "server.csr")
        run("openssl", "x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca.key",
            "-CAcreateserial", "-days", "2", "-out", "server.pem")
        run("mosquitto_passwd", "-b", "-c", "passwords", "hall", "open:sesame@1")
        broker = self.broker("allow_anonymous false", f"password_file {keys}/passwords",
                             f"cafile {keys}/ca.pem", f"certfile {keys}/server.pem",
                             f"keyfile {keys}/server.key")
        broker.start()
        looker = self.subscriber(broker, "--cafile", str(keys / "ca.pem"), "-h", "localhost", "-u",
                                 "hall", "-P", "open:sesame@1")
        (keys / "password").write_text("open:sesame@1\n")
        url = f"hall@localhost:{broker.port}"
        ca = ["--mqtt-ca", keys / "ca.pem"]
        for url, words, environment in (
                (f"mqtts://hall:open%3Asesame%401@localhost:{broker.port}", ca, {}),
                (f"mqtts://{url}", [*ca, "--mqtt-password-file", keys / "password"], {}),
                (f"mqtts://{url}", ca, {"SDMT_MQTT_PASSWORD": "open:sesame@1"})):
            before = len(looker.of("/frames"))
            process = self.start(url, *words, env={**os.environ, **environment})
            self.until(lambda: len(looker.of("/frames")) > before)
            self.assertNotIn("sesame", self.finish(process))
        for url, words, reason in (
                (f"mqtts://hall:wrong@localhost:{broker.port}", ca, "not authorised"),
                (f"mqtts://hall:sesame@localhost:{broker.port}", [], "")):  # nobody's certificate
            before, lines = len(looker.of("/frames")), len(self.lines("t.jsonl"))
            process = self.start(url, *words)
            self.until(lambda: len(self.lines("t.jsonl")) > lines + 30)
            messages = self.finish(process)
            self.assertIn("is away", messages)
            self.assertIn(reason, messages)
            self.assertNotIn("wrong", messages)
            self.assertNotIn("sesame", messages)
            self.assertEqual(len(looker.of("/frames")), before)

    def test_what_cannot_be_is_refused(self):
        for url, words, message in (
                ("http://host", [], "expected mqtt://HOST"),
                ("mqtt://a:secret@host:0", [], "expected a port"),
                ("mqtt://host/a/#", [], "expected a topic"),
                ("mqtt://host", ["--mqtt-ca", "none"], "expected a mqtts:// URL"),
                ("mqtts://host", ["--mqtt-ca", "none"], "--mqtt-ca: 'none' cannot be read"),
                ("mqtts://host", ["--mqtt-key", "k"], "expected both"),
                ("mqtt://host", ["--mqtt-queue-size", "1h"], "--mqtt-queue-size is 1h"),
                ("mqtt://host", ["--mqtt-password-file", "none"], "cannot be read")):
            process = self.start(url, *words)
            _, messages = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 2, messages)
            self.assertIn(message, messages)
            self.assertNotIn("secret", messages)


if __name__ == "__main__":
    unittest.main()
