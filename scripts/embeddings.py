# SPDX-License-Identifier: Apache-2.0
"""Reads and writes vectors of images as `sdmt embed` does: a safetensors file with a tensor
`embeddings` [images, dimensions] and the images' names in the metadata."""
import json

from tensor_file import read_tensors, write_tensors


def write_embeddings(path, names, vectors):
    write_tensors(path, {"images": json.dumps(names)}, {"embeddings": vectors})


def read_embeddings(path):
    """Names, and a row for each."""
    try:
        metadata, tensors = read_tensors(path)
        return json.loads(metadata["images"]), tensors["embeddings"]
    except (ValueError, KeyError) as error:
        raise SystemExit(f"{path}: holds no embeddings as `sdmt embed` writes them ({error})")
