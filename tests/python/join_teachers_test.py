# SPDX-License-Identifier: Apache-2.0
"""scripts/join-teachers.py against its rule, written out for one image at a time."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))

from embeddings import read_embeddings, write_embeddings  # noqa: E402

NAMES = [f"people/{i:04d}.jpg" for i in range(12)]
DOMAINS = {name: "yard" if i % 3 else "gate" for i, name in enumerate(NAMES)}


def unit(vector):
    return vector / np.linalg.norm(vector)


def less_the_mean_of(names, vectors, name):
    mean = sum(unit(vectors[other]) for other in names) / len(names)
    return unit(unit(vectors[name]) - mean)


class JoinTeachers(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        rng = np.random.default_rng(3)
        self.first, self.second = ({name: rng.normal(1, 1, size) for name in NAMES}
                                   for size in (5, 3))
        write_embeddings(self.path / "first", NAMES, list(self.first.values()))
        backwards = NAMES[::-1]
        write_embeddings(self.path / "second", backwards, [self.second[n] for n in backwards])
        (self.path / "domains.json").write_text(json.dumps(DOMAINS))

    def tearDown(self):
        self.folder.cleanup()

    def join(self, *options):
        out = self.path / "out"
        subprocess.run([sys.executable, "-B", SCRIPTS / "join-teachers.py", out, *options],
                       cwd=self.path, check=True, stdout=subprocess.DEVNULL)
        names, rows = read_embeddings(out)
        self.assertEqual(names, NAMES)
        return dict(zip(names, rows))

    def test_centres_one_teacher_by_domain(self):
        joined = self.join("--first", "first", "--domains", "domains.json")
        for name in NAMES:
            alike = [other for other in NAMES if DOMAINS[other] == DOMAINS[name]]
            expected = less_the_mean_of(alike, self.first, name)
            np.testing.assert_allclose(joined[name], expected, atol=1e-6)

    def test_joins_two_without_domains(self):
        joined = self.join("--first", "first", "--second", "second", "--weight", "0.25")
        for name in NAMES:
            expected = unit(np.concatenate([
                less_the_mean_of(NAMES, self.first, name),
                0.25 * less_the_mean_of(NAMES, self.second, name)]))
            np.testing.assert_allclose(joined[name], expected, atol=1e-6)

    def test_leaves_the_first_as_it_is(self):
        joined = self.join("--first", "first", "--second", "second", "--domains", "domains.json",
                           "--keep-first-mean")
        for name in NAMES:
            alike = [other for other in NAMES if DOMAINS[other] == DOMAINS[name]]
            expected = unit(np.concatenate([
                unit(self.first[name]), 0.5 * less_the_mean_of(alike, self.second, name)]))
            np.testing.assert_allclose(joined[name], expected, atol=1e-6)

    def test_refuses_what_has_no_vector_or_domain(self):
        write_embeddings(self.path / "short", NAMES[:3], [self.second[n] for n in NAMES[:3]])
        (self.path / "few.json").write_text(json.dumps({NAMES[0]: "yard"}))
        for options, text in ((["--second", "short"], "9 of 12 images have no vector of the second"),
                              (["--domains", "few.json"], "knows no domain of people/0001.jpg")):
            done = subprocess.run(
                [sys.executable, "-B", SCRIPTS / "join-teachers.py", "out", "--first", "first",
                 *options], cwd=self.path, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn(text, done.stderr)
            self.assertFalse((self.path / "out").exists())


if __name__ == "__main__":
    unittest.main()
