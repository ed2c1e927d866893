# SPDX-License-Identifier: Apache-2.0
import ast
import inspect
import json
import os
import unittest
from pathlib import Path

import numpy as np

import sdmt
import support


class Evaluate(support.InAFolder):
    def test_as_the_command_does(self):
        for name in ("first", "second"):
            sequence = support.write_sequence(self.path / "gt" / name)
            support.sdmt("track", sequence, "--no-appearance", "--output",
                         self.path / f"{name}.txt", *(("--delay", "0") if name == "first" else ()))
        support.sdmt("evaluate", "--gt", self.path / "gt", "--results", self.path, "--json",
                     self.path / "scores.json")
        expected = json.loads((self.path / "scores.json").read_text())
        found = sdmt.evaluate(self.path / "gt", self.path)
        self.assertEqual(found["sequences"].keys(), expected["sequences"].keys())
        pairs = [(found["combined"], expected["combined"])]
        pairs += [(found["sequences"][name], expected["sequences"][name])
                  for name in expected["sequences"]]
        for ours, theirs in pairs:
            for name, value in ours.items():
                if name == "per_alpha":
                    for score, values in value.items():
                        self.assertEqual(values.tolist(), theirs["per_alpha"][score])
                else:
                    self.assertEqual(value, theirs[name], name)
            self.assertGreater(ours["MOTA"], 0.5)
            self.assertIn("IDF1", ours)

    def test_missing_results(self):
        support.write_sequence(self.path / "gt" / "first")
        with self.assertRaisesRegex(ValueError, "sequence first has no results"):
            sdmt.evaluate(self.path / "gt", self.path)
        empty = sdmt.evaluate(self.path / "gt", self.path, allow_missing=True)
        self.assertEqual(empty["combined"]["CLR_FN"], 2 * support.FRAMES)


class Readers(support.InAFolder):
    def test_detections(self):
        file = support.write_sequence(self.path / "s") / "det" / "det.txt"
        detections = sdmt.read_detections(file)
        self.assertEqual((len(detections), detections.last_frame), (2 * support.FRAMES,
                                                                    support.FRAMES))
        self.assertTrue(detections.has_scores)
        self.assertIsNone(detections.embeddings(1))
        boxes, scores = detections.frame(7)
        np.testing.assert_array_equal(boxes, support.boxes(6))
        np.testing.assert_allclose(scores, support.scores(6))
        self.assertFalse(boxes.flags.owndata)
        del detections
        np.testing.assert_array_equal(boxes, support.boxes(6))
        lines = self.path / "boxes.jsonl"
        lines.write_text('{"boxes": [[1, 2, 30, 40]], "scores": [0.5], "embeddings": [[3, 4]]}\n')
        np.testing.assert_allclose(sdmt.read_detections(lines).embeddings(1), [[0.6, 0.8]])
        with self.assertRaisesRegex(ValueError, "format is 'xml', expected mot, csv"):
            sdmt.read_detections(file, "xml")
        with self.assertRaisesRegex(ValueError, "no/such"):
            sdmt.read_detections("no/such")

    def test_rows(self):
        folder = support.write_sequence(self.path / "s")
        truth = sdmt.read_ground_truth(folder / "gt" / "gt.txt")
        np.testing.assert_array_equal(truth["boxes"][truth["frame"] == 3], support.boxes(2))
        self.assertTrue(truth["keep"].all())
        tracker = sdmt.Tracker(min_length=1, delay=0)
        frames = [f for t in range(5) for f in tracker.update(support.boxes(t), support.scores(t))]
        sdmt.write_results(self.path / "r.txt", frames)
        results = sdmt.read_results(self.path / "r.txt")
        self.assertEqual(results["frame"].tolist(), [1, 1, 2, 2, 3, 3, 4, 4, 5, 5])
        np.testing.assert_allclose(results["boxes"][-2:], frames[-1].boxes, atol=0.005)


class Validate(unittest.TestCase):
    def test_against_all_pairs(self):
        random = np.random.default_rng(3)
        people = np.repeat(np.arange(1, 9), 4)
        cameras = np.tile([1, 2], 16)
        vectors = random.normal(size=(8, 16))[people - 1] + 0.9 * random.normal(size=(32, 16))
        unit = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
        distance = np.linalg.norm(unit[:, None] - unit[None], axis=2)
        first, second = np.triu_indices(32, 1)
        same = people[first] == people[second]
        near, far = distance[first, second][same], distance[first, second][~same]
        auc = np.mean((near[:, None] < far) + 0.5 * (near[:, None] == far))

        found = sdmt.validate_roc(vectors, people, cameras)
        self.assertAlmostEqual(found["auc"], auc, places=5)
        self.assertLess(found["auc_low"], auc)
        self.assertGreater(found["auc_high"], auc)
        self.assertEqual((found["positives"], found["negatives"]), (same.sum(), (~same).sum()))
        heights = (found["tpr"][1:] + found["tpr"][:-1]) / 2
        self.assertAlmostEqual(np.sum(np.diff(found["fpr"]) * heights), auc, places=5)
        tau_a = found["thresholds"]["fpr 0.1"]["tau_a"]
        self.assertLessEqual(np.mean(1 - far > tau_a), 0.1)

        queries = cameras == 1
        metrics = sdmt.reid_metrics(vectors[queries], people[queries], cameras[queries],
                                    vectors[~queries], people[~queries], cameras[~queries])
        nearest = np.argmin(distance[queries][:, ~queries], axis=1)
        rank1 = np.mean(people[~queries][nearest] == people[queries])
        self.assertAlmostEqual(metrics["rank1"], rank1)
        with self.assertRaisesRegex(ValueError, r"person_ids has shape \(3,\)"):
            sdmt.validate_roc(vectors, [1, 2, 3])


@unittest.skipUnless(os.path.exists(Path(sdmt.__file__).parent / "__init__.py") and
                     any(Path(sdmt.__file__).parent.glob("_train*")), "built without training")
class Train(support.InAFolder):
    def test_the_same_model_as_the_command(self):
        support.sdmt("synth", "reid", "--output", self.path / "people", "--identities", "20")
        options = {"identities": 4, "instances": 2, "iterations": 3, "seed": 5,
                   "validate_every": 2, "views": 0, "tie": "none"}
        typed = [word for name, value in options.items()
                 for word in (f"--{name.replace('_', '-')}", value)]
        support.sdmt("train-embedder", "--data", self.path / "people", "--architecture", "lite",
                     "--holdout-ids", 2, "--output", self.path / "command.safetensors", *typed)
        steps = []
        report = sdmt.train(self.path / "people", self.path / "module.safetensors",
                            architecture="lite", holdout_ids=2, progress=steps.append, **options)
        self.assertEqual((self.path / "module.safetensors").read_bytes(),
                         (self.path / "command.safetensors").read_bytes())
        self.assertEqual([step["iteration"] for step in steps], [1, 2, 3])
        self.assertEqual(report["loss"], steps[-1]["loss"])
        self.assertEqual(report["iterations"], 3)

        class Enough(Exception):
            pass

        def stop(step):
            raise Enough

        with self.assertRaises(Enough):
            sdmt.train(self.path / "people", self.path / "x.safetensors", architecture="lite",
                       checkpoint=self.path / "checkpoint", progress=stop, **options)
        self.assertFalse((self.path / "x.safetensors").exists())
        sdmt.train(self.path / "people", self.path / "resumed.safetensors", architecture="lite",
                   resume=self.path / "checkpoint", **options)
        self.assertTrue((self.path / "resumed.safetensors").exists())
        with self.assertRaisesRegex(ValueError, "the training has no option 'rate'"):
            sdmt.train(self.path / "people", self.path / "x", rate=1)


class Manual(unittest.TestCase):
    """Everything public has a docstring, and the stub tells the same names and parameters."""

    def test_docstrings(self):
        for name in sdmt.__all__:
            thing = getattr(sdmt, name)
            if inspect.isclass(thing):
                self.assertTrue(inspect.getdoc(thing), name)
                for member, value in inspect.getmembers(thing):
                    if not member.startswith("_"):
                        self.assertTrue(inspect.getdoc(value), f"{name}.{member}")
            elif callable(thing):
                self.assertTrue(inspect.getdoc(thing), name)

    def test_stub(self):
        stub = ast.parse((Path(sdmt.__file__).parent / "__init__.pyi").read_text())
        told = {}
        for node in stub.body:
            if isinstance(node, ast.ClassDef):
                told[node.name] = {member.name for member in node.body
                                   if isinstance(member, ast.FunctionDef)}
            elif isinstance(node, ast.FunctionDef):
                told[node.name] = [a.arg for a in node.args.args + node.args.kwonlyargs]
            elif isinstance(node, ast.AnnAssign):
                told[node.target.id] = None
        self.assertEqual(set(sdmt.__all__) | {"__version__"}, set(told))
        for name, members in told.items():
            thing = getattr(sdmt, name)
            if inspect.isclass(thing):
                public = {m for m in dir(thing) if not m.startswith("_")}
                self.assertEqual(public, {m for m in members if not m.startswith("_")}, name)
            elif inspect.isfunction(thing):
                parameters = inspect.signature(thing).parameters.values()
                self.assertEqual([p.name for p in parameters if p.kind != p.VAR_KEYWORD], members,
                                 name)


if __name__ == "__main__":
    unittest.main()
