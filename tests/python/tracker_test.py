# SPDX-License-Identifier: Apache-2.0
import subprocess
import sys
import threading
import unittest
from pathlib import Path

import numpy as np

import sdmt
import support

# Rows 40..79 of a 1080p picture can be read; whoever touches another one dies.
UNREADABLE = """
import ctypes, mmap
import numpy as np
import sdmt
WIDTH, HEIGHT, PAGE = 1920, 1080, mmap.PAGESIZE
stride = -(-3 * WIDTH // PAGE) * PAGE
memory = mmap.mmap(-1, stride * HEIGHT)
pixels = np.frombuffer(memory, np.uint8).reshape(HEIGHT, stride)
pixels[:] = 90
image = np.lib.stride_tricks.as_strided(pixels, (HEIGHT, WIDTH, 3), (stride, 3, 1))
protect = ctypes.CDLL(None, use_errno=True).mprotect
protect.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
address = pixels.ctypes.data
assert protect(address, 40 * stride, 0) == 0
assert protect(address + 80 * stride, (HEIGHT - 80) * stride, 0) == 0
tracker = sdmt.Tracker(model="sdmt-lite", min_length=1, delay=0)
for t in range(3):
    frame, = tracker.update([[101 + t, 41, 16, 40]], [0.9], image)
assert len(frame) == 1 and tracker.state()["embedded"] == 3
print("not copied")
"""


def track(tracker):
    frames = []
    for t, image in enumerate(support.images()):
        frames += tracker.update(support.boxes(t), support.scores(t), image)
    return frames + tracker.finish()


def rows(frames):
    return [(f.frame, f.ids.tolist(), f.boxes.tolist(), f.scores.tolist()) for f in frames]


class SameBytes(support.InAFolder):
    def expect_same(self, tracker, *arguments):
        sequence = support.write_sequence(self.path / "scene")
        support.sdmt("track", sequence, "--output", self.path / "command.txt", *arguments)
        sdmt.write_results(self.path / "module.txt", track(tracker))
        expected = (self.path / "command.txt").read_bytes()
        self.assertGreater(len(expected), 500)
        self.assertEqual((self.path / "module.txt").read_bytes(), expected)

    def test_with_a_network(self):
        model = Path(sdmt.Model("sdmt-lite").path)
        self.expect_same(sdmt.Tracker(model, order="rgb"), "--model", model)

    def test_by_motion(self):
        self.expect_same(sdmt.Tracker(), "--no-appearance")

    def test_with_a_preset_and_options(self):
        self.expect_same(sdmt.Tracker(config="track-paper", min_length=2, lambda_=0.3),
                         "--no-appearance", "--config", "track-paper", "--min-length", "2",
                         "--lambda", "0.3")


class Images(unittest.TestCase):
    def test_a_frame_is_not_copied(self):
        run = subprocess.run([sys.executable, "-c", UNREADABLE], capture_output=True, text=True)
        self.assertEqual((run.returncode, run.stdout), (0, "not copied\n"), run.stderr)

    def test_every_layout_gives_the_same(self):
        embedder = sdmt.Embedder("sdmt-lite", order="rgb")
        image = next(support.images())
        vectors, valid = embedder.embed(image, support.boxes(0))
        self.assertEqual(valid.tolist(), [True, True])
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-5)
        larger = np.zeros((support.HEIGHT + 9, support.WIDTH + 5, 3), np.uint8)
        larger[4:-5, 2:-3] = image
        mirrored = np.ascontiguousarray(image[:, ::-1])
        planes = np.ascontiguousarray(image.transpose(2, 0, 1))
        for view in (larger[4:-5, 2:-3], mirrored[:, ::-1], planes.transpose(1, 2, 0)):
            np.testing.assert_array_equal(embedder.embed(view, support.boxes(0))[0], vectors)
        turned = sdmt.Embedder("sdmt-lite", order="bgr").embed(image[:, :, ::-1], support.boxes(0))
        np.testing.assert_array_equal(turned[0], vectors)


class Frames(unittest.TestCase):
    def test_arrays_are_views_that_live_on(self):
        frames = track(sdmt.Tracker())
        self.assertEqual([f.frame for f in frames], list(range(1, support.FRAMES + 1)))
        frame = frames[10]
        self.assertEqual(len(frame), 2)
        for array in (frame.ids, frame.boxes, frame.scores, frame.sources):
            self.assertFalse(array.flags.owndata or array.flags.writeable)
        self.assertTrue(np.shares_memory(frame.boxes, frame.boxes))
        corners = frame.boxes - [1, 1, 0, 0]
        corners[:, 2:] += corners[:, :2]
        np.testing.assert_array_equal(frame.xyxy, corners)
        self.assertEqual(frame.merges.shape, (0, 2))
        boxes, expected = frame.boxes, frame.boxes.tolist()
        del frame, frames
        self.assertEqual(boxes.tolist(), expected)

    def test_corners_are_the_same_boxes(self):
        by_corners, by_sizes = sdmt.Tracker(), sdmt.Tracker()
        ours, theirs = [], []
        for t in range(support.FRAMES):
            boxes = support.boxes(t)
            theirs += by_sizes.update(boxes, support.scores(t))
            corners = boxes - [1, 1, 0, 0]
            corners[:, 2:] += corners[:, :2]
            car = [[0.0, 0, 90, 90]]
            ours += by_corners.update_xyxy(np.concatenate([corners, car]),
                                           np.append(support.scores(t), 0.99), [0, 0, 2])
        self.assertEqual(rows(ours + by_corners.finish()), rows(theirs + by_sizes.finish()))

    def test_embeddings_of_somebody_else(self):
        def run(swapped):
            tracker = sdmt.Tracker(embeddings=True, tau_a=0.5)
            frames = []
            for t in range(support.FRAMES):
                vectors = np.array([[0.0, 5], [2, 0]])
                late = swapped and t >= support.FRAMES // 2
                frames += tracker.update(support.boxes(t), support.scores(t),
                                         embeddings=vectors[::-1] if late else vectors)
            return frames + tracker.finish()

        alike, exchanged = run(False), run(True)
        self.assertEqual({i for f in alike for i in f.ids.tolist()}, {1, 2})
        self.assertNotEqual(rows(alike), rows(exchanged))


class Times(unittest.TestCase):
    def run_scene(self, hand_over):
        tracker = sdmt.Tracker(frame_rate=10)
        frames = []
        for t in range(support.FRAMES):
            if t == hand_over:
                snapshot = tracker.save()
                tracker = sdmt.Tracker(frame_rate=10)
                with self.assertRaisesRegex(ValueError, "snapshot"):
                    tracker.restore(snapshot[:-1])
                tracker.restore(snapshot)
            if t % 3 == 1:
                continue  # lost
            if t % 3 == 2:
                frames += tracker.skip(time=t / 10)
            else:
                frames += tracker.update(support.boxes(t), support.scores(t), time=t / 10)
        return frames + tracker.finish()

    def test_a_snapshot_goes_on_alike(self):
        whole = self.run_scene(None)
        self.assertEqual({i for f in whole for i in f.ids.tolist()}, {1, 2})
        self.assertEqual(rows(self.run_scene(13)), rows(whole))

    def test_any_score_goes_into_a_snapshot(self):
        tracker = sdmt.Tracker()
        tracker.update([[1, 2, 30, 40]], [1e300])
        sdmt.Tracker().restore(tracker.save())

    def test_time_rises(self):
        tracker = sdmt.Tracker(frame_rate=10)
        tracker.update([], time=1)
        with self.assertRaisesRegex(ValueError, "time"):
            tracker.update([], time=1)


class Camera(unittest.TestCase):
    def run_scene(self, told):
        """Somebody walks while the picture jumps to and fro; every seventh frame is not looked at."""
        tracker, frames = sdmt.Tracker(), []
        for t in range(40):
            jump = 0 if t == 0 else 90 if t % 2 == 0 else -90
            camera = [[1, 0, jump], [0, 1, 0]] if told else None
            box = [[100 + t + (90 if t % 2 == 0 else 0), 50, 30, 80]]
            frames += (tracker.skip(camera=camera) if t % 7 == 6 else
                       tracker.update(box, [0.9], camera=camera))
        return frames + tracker.finish()

    def test_what_is_tracked_moves_along(self):
        for t, frame in enumerate(self.run_scene(True)):
            self.assertEqual(frame.ids.tolist(), [1])
            self.assertAlmostEqual(frame.boxes[0, 0], 100 + t + (90 if t % 2 == 0 else 0), delta=1.5)
        self.assertNotEqual({i for f in self.run_scene(False) for i in f.ids.tolist()}, {1})

    def test_its_motion_is_found(self):
        grain = np.random.default_rng(3).normal(size=(300, 420))
        for axis in (0, 1):
            grain = sum(np.roll(grain, shift, axis) for shift in range(8))
        grain = 127 + 40 * grain / grain.std()
        world = np.repeat(grain.clip(0, 255).astype(np.uint8)[..., None], 3, 2)
        motion = sdmt.CameraMotionEstimator()
        still = [[1, 0, 0], [0, 1, 0]]
        for _ in range(2):
            np.testing.assert_array_equal(motion.next(world[40:240, 40:360]), still)
        found = motion.next(world[43:243, 35:355], [[10, 10, 20, 40]])
        np.testing.assert_allclose(found, [[1, 0, 5], [0, 1, -3]], atol=0.3)
        self.assertIsNone(motion.next(world[:100, :100]))


class Errors(unittest.TestCase):
    def expect(self, kind, text, call, *arguments, **named):
        with self.assertRaises(kind) as raised:
            call(*arguments, **named)
        self.assertIn(text, str(raised.exception))

    def test_texts(self):
        tracker = sdmt.Tracker()
        image = np.zeros((4, 4, 3), np.uint8)
        for text, *arguments in (
                ("boxes has shape (1, 3), expected (n, 4)", [[1, 2, 3]]),
                ("boxes is a str, expected an array of numbers", "here"),
                ("scores has shape (2,), expected (1,)", [[1, 2, 3, 4]], [1, 2]),
                ("width is -3, expected > 0", [[1, 2, -3, 4]]),
                ("image is float64 (4, 4, 3), expected uint8", [], [], image.astype(float)),
                ("image is uint8 (4, 4), expected uint8 (height, width, 3)", [], [], image[..., 0]),
                ("make the tracker with embeddings=True", [[1, 2, 3, 4]], [1], None, None, [[1]]),
                ("camera has shape (2, 2), expected (2, 3)", [], [], None, None, None, np.eye(2)),
                ("camera is no shift, zoom and roll, expected ((a, -b, tx), (b, a, ty))", [], [],
                 None, None, None, [[1, 0.1, 0], [0.1, 1, 0]]),
                ("camera motion: zoom is 0, expected 0.1..10", [], [], None, None, None,
                 np.zeros((2, 3)))):
            self.expect(ValueError, text, tracker.update, *arguments)
        self.expect(ValueError, "has no option 'min-io'", sdmt.Tracker, min_io=0.3)
        self.expect(ValueError, "min_iou is 2, expected", sdmt.Tracker, min_iou=2)
        self.expect(ValueError, "/no/model: cannot be opened", sdmt.Tracker, "/no/model")
        self.expect(ValueError, "order is 'grb', expected bgr or rgb", sdmt.Tracker, order="grb")
        given = sdmt.Tracker(embeddings=True, tau_a=0.5)
        self.expect(ValueError, "embeddings are None", given.update, [[1, 2, 3, 4]])
        self.expect(ValueError, "vector 0 has length 0", given.update, [[1, 2, 3, 4]],
                    embeddings=[[0, 0]])
        tracker.finish()
        self.expect(RuntimeError, "finish() was called", tracker.update, [])

    def test_a_refused_call_changes_nothing(self):
        disturbed = sdmt.Tracker()
        frames = []
        for t in range(support.FRAMES):
            self.expect(ValueError, "detection 0", disturbed.update, [[0, 0, 0, 9]])
            frames += disturbed.update(support.boxes(t), support.scores(t))
        calm = sdmt.Tracker()
        expected = [f for t in range(support.FRAMES)
                    for f in calm.update(support.boxes(t), support.scores(t))]
        self.assertEqual(rows(frames + disturbed.finish()), rows(expected + calm.finish()))


class Threads(unittest.TestCase):
    def in_threads(self, *works):
        threads = [threading.Thread(target=work) for work in works]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def test_eight_share_a_model(self):
        model = sdmt.Model("sdmt-lite")
        expected = rows(track(sdmt.Tracker(model)))
        results = []
        self.in_threads(*8 * [lambda: results.append(rows(track(sdmt.Tracker(model))))])
        self.assertEqual(results, 8 * [expected])

    def test_one_tracker_takes_turns(self):
        tracker = sdmt.Tracker("sdmt-lite", delay=0, min_length=1)
        numbers = []

        def work():
            for t, image in enumerate(support.images()):
                numbers.extend(f.frame for f in tracker.update(support.boxes(t), None, image))

        self.in_threads(work, work, work)
        self.assertEqual(sorted(numbers), list(range(1, 3 * support.FRAMES + 1)))


if __name__ == "__main__":
    unittest.main()
