#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes one teacher of two: their vectors of the same images side by side.

  join-teachers.py OUT.safetensors --first FILE... --second FILE... [--weight W]

FILEs are what `sdmt embed` and distillation-set.py write. Of either teacher the mean over all images
of the first is taken away, as what all people have in common says nothing of who is who; what remains
is cut to length 1, the second's times W, and the whole to length 1 again. Needs python3-numpy.
"""
import argparse

import numpy as np

from embeddings import read_embeddings, write_embeddings


def vectors_of(files):
    vectors = {}
    for file in files:
        vectors.update(zip(*read_embeddings(file)))
    return vectors


def unit(rows):
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def centred(rows):
    rows = unit(np.asarray(rows))
    return unit(rows - rows.mean(axis=0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out")
    parser.add_argument("--first", nargs="+", required=True, metavar="FILE")
    parser.add_argument("--second", nargs="+", required=True, metavar="FILE")
    parser.add_argument("--weight", type=float, default=0.5)
    arguments = parser.parse_args()

    first, second = vectors_of(arguments.first), vectors_of(arguments.second)
    missing = [name for name in first if name not in second]
    if missing:
        raise SystemExit(f"{len(missing)} of {len(first)} images have no vector of the second teacher, "
                         f"such as {missing[0]}")
    rows = unit(np.hstack([centred(list(first.values())),
                           arguments.weight * centred([second[name] for name in first])]))
    write_embeddings(arguments.out, list(first), rows)
    print(f"{len(rows)} images, {rows.shape[1]} values each: {arguments.out}")


if __name__ == "__main__":
    main()
