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

    def test_domains_may_stand_in_several_files(self):
        for part in (0, 1):
            (self.path / f"part{part}.json").write_text(
                json.dumps({name: DOMAINS[name] for name in NAMES[part::2]}))
        whole = self.join("--first", "first", "--domains", "domains.json")
        parts = self.join("--first", "first", "--domains", "part0.json", "part1.json")
        for name in NAMES:
            np.testing.assert_array_equal(parts[name], whole[name])

    def test_turns_the_rows_to_those_of_a_network(self):
        rng = np.random.default_rng(9)
        plain = self.join("--first", "first")
        turn = np.linalg.qr(rng.normal(size=(5, 5)))[0]
        write_embeddings(self.path / "network", NAMES, [turn @ plain[name] for name in NAMES])
        turned = self.join("--first", "first", "--align", "network")
        for name in NAMES:
            np.testing.assert_allclose(turned[name], turn @ plain[name], atol=1e-5)

    def test_no_other_turn_lies_closer(self):
        rng = np.random.default_rng(10)
        network = np.array([unit(v) for v in rng.normal(size=(len(NAMES), 5))])
        write_embeddings(self.path / "network", NAMES, list(network))
        plain = self.join("--first", "first")
        rows = np.array([plain[name] for name in NAMES])
        turned = self.join("--first", "first", "--align", "network")
        found = np.array([turned[name] for name in NAMES])
        np.testing.assert_allclose(found @ found.T, rows @ rows.T, atol=1e-5)  # a turn, no more
        best = max((rows @ np.linalg.qr(rng.normal(size=(5, 5)))[0] * network).sum()
                   for _ in range(2000))
        self.assertGreater((found * network).sum(), best)

    def test_cuts_to_the_dimensions_of_the_network(self):
        rng = np.random.default_rng(11)
        write_embeddings(self.path / "network", NAMES, [unit(v) for v in rng.normal(size=(12, 3))])
        turned = self.join("--first", "first", "--align", "network")
        for name in NAMES:
            self.assertEqual(turned[name].shape, (3,))
            self.assertAlmostEqual(np.linalg.norm(turned[name]), 1, places=5)

    def test_draws_images_to_their_person(self):
        names = ["a/0001_c1_1.jpg", "a/0001_c2_1.jpg", "a/0002_c1_1.jpg", "b/0001_c1_1.jpg",
                 "a/0000_c1_1.jpg", "a/-1_c1_1.jpg", "c/000123.jpg"]
        rows = [unit(row) for row in np.random.default_rng(6).normal(size=(7, 4))]
        write_embeddings(self.path / "named", names, rows)
        subprocess.run([sys.executable, "-B", SCRIPTS / "join-teachers.py", "out", "--first",
                        "named", "--keep-first-mean", "--person", "0.25"], cwd=self.path, check=True,
                       stdout=subprocess.DEVNULL)
        joined = read_embeddings(self.path / "out")[1]
        person = unit(rows[0] + rows[1])
        for i in (0, 1):
            np.testing.assert_allclose(joined[i], unit(0.75 * rows[i] + 0.25 * person), atol=1e-6)
        for i in range(2, 7):  # alone, of another folder, nobody's, not named
            np.testing.assert_allclose(joined[i], rows[i], atol=1e-6)

    def test_refuses_what_has_no_vector_or_domain(self):
        write_embeddings(self.path / "short", NAMES[:3], [self.second[n] for n in NAMES[:3]])
        (self.path / "few.json").write_text(json.dumps({NAMES[0]: "yard"}))
        for options, text in ((["--second", "short"], "9 of 12 images have no vector of the second"),
                              (["--person", "1.5"], "--person is 1.5, expected 0 to 1"),
                              (["--domains", "few.json"], "knows no domain of people/0001.jpg"),
                              (["--align", "short"], "9 of 12 images have no vector to align with")):
            done = subprocess.run(
                [sys.executable, "-B", SCRIPTS / "join-teachers.py", "out", "--first", "first",
                 *options], cwd=self.path, capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertIn(text, done.stderr)
            self.assertFalse((self.path / "out").exists())


if __name__ == "__main__":
    unittest.main()
