#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes one teacher of two: their vectors of the same images side by side; or centres those of one.

  join-teachers.py OUT.safetensors --first FILE... [--second FILE... [--weight W]] [--domains FILE...]
                   [--keep-first-mean] [--align FILE...] [--person SHARE]

FILEs are what `sdmt embed` and distillation-set.py write. Of either teacher the mean over all images
of the first is taken away, as what all people have in common says nothing of who is who; with
--domains, OUT/domains.json of distillation-set.py, the mean of the image's domain, so that what the
vectors say of a camera and its light is not taught. With --keep-first-mean the first's are left as they
are, for a teacher who knows more places than those that the images are of. What remains is cut to
length 1, the second's times W, and the whole to length 1 again. With --align, vectors that a network
makes of these images, the whole is turned, and cut to as many dimensions, so that it lies as close to
them as it can (orthogonal Procrustes problem): that network then need not learn other axes first when
it is trained on. With --person, images named as in Market-1501 (PID_cCAM...) go that SHARE of the way, 0
to 1, to their person's mean vector: the teacher is told who is one person. Needs python3-numpy.
"""
import argparse
import collections
import json
import pathlib
import re

import numpy as np

from embeddings import read_embeddings, write_embeddings


def vectors_of(files):
    vectors = {}
    for file in files:
        vectors.update(zip(*read_embeddings(file)))
    return vectors


def require(names, vectors, purpose):
    missing = [name for name in names if name not in vectors]
    if missing:
        raise SystemExit(f"{len(missing)} of {len(names)} images have no vector {purpose}, "
                         f"such as {missing[0]}")


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def centred(rows, domains):
    """Each row less the mean of its domain."""
    rows = unit(np.asarray(rows))
    _, domain_of, counts = np.unique(domains, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), rows.shape[1]))
    np.add.at(sums, domain_of, rows)
    return unit(rows - (sums / counts[:, None])[domain_of])


def aligned(rows, model):
    """Rows turned to those of the model, and cut to as many dimensions."""
    left, _, right = np.linalg.svd(rows.T @ model, full_matrices=False)
    turned = rows @ (left @ right)
    kept = (turned ** 2).sum(axis=1).mean()
    turned = unit(turned)
    print(f"{kept:.3f} of the squared length kept, mean dot product with the network's vectors "
          f"{(turned * model).sum(axis=1).mean():.3f}")
    return turned


def drawn_to_people(rows, names, weight):
    """Rows of named images, moved to the mean of their person's in that folder."""
    people = collections.defaultdict(list)
    for i, name in enumerate(names):
        folder, _, file = name.rpartition("/")
        named = re.match(r"(\d+)_c\d", file)
        if named and int(named[1]) > 0:
            people[folder, int(named[1])].append(i)
    moved = rows.copy()
    for images in people.values():
        mean = unit(rows[images].mean(axis=0, keepdims=True))
        moved[images] = (1 - weight) * rows[images] + weight * mean
    return unit(moved)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out")
    parser.add_argument("--first", nargs="+", required=True, metavar="FILE")
    parser.add_argument("--second", nargs="+", default=[], metavar="FILE")
    parser.add_argument("--weight", type=float, default=0.5)
    parser.add_argument("--domains", nargs="+", default=[], type=pathlib.Path)
    parser.add_argument("--keep-first-mean", action="store_true")
    parser.add_argument("--align", nargs="+", default=[], metavar="FILE")
    parser.add_argument("--person", type=float, default=0, metavar="SHARE")
    arguments = parser.parse_args()
    if not 0 <= arguments.person <= 1:
        raise SystemExit(f"--person is {arguments.person}, expected 0 to 1")

    first, second = vectors_of(arguments.first), vectors_of(arguments.second)
    if arguments.second:
        require(first, second, "of the second teacher")
    domains = [""] * len(first)
    if arguments.domains:
        known = {}
        for file in arguments.domains:
            known.update(json.loads(file.read_text()))
        unknown = [name for name in first if name not in known]
        if unknown:
            raise SystemExit(f"{arguments.domains[-1]}: knows no domain of {unknown[0]}, nor does a "
                             "file before it")
        domains = [known[name] for name in first]
    rows = np.asarray(list(first.values()))
    rows = unit(rows) if arguments.keep_first_mean else centred(rows, domains)
    if second:
        of_second = centred([second[name] for name in first], domains)
        rows = unit(np.hstack([rows, arguments.weight * of_second]))
    if arguments.align:
        model = vectors_of(arguments.align)
        require(first, model, "to align with")
        rows = aligned(rows, unit(np.asarray([model[name] for name in first])))
    rows = drawn_to_people(rows, list(first), arguments.person)
    write_embeddings(arguments.out, list(first), rows)
    print(f"{len(rows)} images, {rows.shape[1]} values each: {arguments.out}")


if __name__ == "__main__":
    main()
