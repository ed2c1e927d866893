#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes one teacher of two: their vectors of the same images side by side; or centres those of one.

  join-teachers.py OUT.safetensors --first FILE... [--second FILE... [--weight W]] [--domains FILE]
                   [--keep-first-mean]

FILEs are what `sdmt embed` and distillation-set.py write. Of either teacher the mean over all images
of the first is taken away, as what all people have in common says nothing of who is who; with
--domains, OUT/domains.json of distillation-set.py, the mean of the image's domain, so that what the
vectors say of a camera and its light is not taught. With --keep-first-mean the first's are left as they
are, for a teacher who knows more places than those that the images are of. What remains is cut to
length 1, the second's times W, and the whole to length 1 again. Needs python3-numpy.
"""
import argparse
import json
import pathlib

import numpy as np

from embeddings import read_embeddings, write_embeddings


def vectors_of(files):
    vectors = {}
    for file in files:
        vectors.update(zip(*read_embeddings(file)))
    return vectors


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def centred(rows, domains):
    """Each row less the mean of its domain."""
    rows = unit(np.asarray(rows))
    _, domain_of, counts = np.unique(domains, return_inverse=True, return_counts=True)
    sums = np.zeros((len(counts), rows.shape[1]))
    np.add.at(sums, domain_of, rows)
    return unit(rows - (sums / counts[:, None])[domain_of])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out")
    parser.add_argument("--first", nargs="+", required=True, metavar="FILE")
    parser.add_argument("--second", nargs="+", default=[], metavar="FILE")
    parser.add_argument("--weight", type=float, default=0.5)
    parser.add_argument("--domains", type=pathlib.Path)
    parser.add_argument("--keep-first-mean", action="store_true")
    arguments = parser.parse_args()

    first, second = vectors_of(arguments.first), vectors_of(arguments.second)
    missing = [name for name in first if name not in second]
    if arguments.second and missing:
        raise SystemExit(f"{len(missing)} of {len(first)} images have no vector of the second teacher, "
                         f"such as {missing[0]}")
    domains = [""] * len(first)
    if arguments.domains:
        known = json.loads(arguments.domains.read_text())
        unknown = [name for name in first if name not in known]
        if unknown:
            raise SystemExit(f"{arguments.domains}: knows no domain of {unknown[0]}")
        domains = [known[name] for name in first]
    rows = np.asarray(list(first.values()))
    rows = unit(rows) if arguments.keep_first_mean else centred(rows, domains)
    if second:
        of_second = centred([second[name] for name in first], domains)
        rows = unit(np.hstack([rows, arguments.weight * of_second]))
    write_embeddings(arguments.out, list(first), rows)
    print(f"{len(rows)} images, {rows.shape[1]} values each: {arguments.out}")


if __name__ == "__main__":
    main()
