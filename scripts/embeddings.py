# SPDX-License-Identifier: Apache-2.0
"""Reads and writes vectors of images as `sdmt embed` does: a safetensors file with a tensor
`embeddings` [images, dimensions] and the images' names in the metadata."""
import json
import pathlib
import struct

import numpy as np


def write_embeddings(path, names, vectors):
    values = np.asarray(vectors, np.float32)
    header = json.dumps({
        "__metadata__": {"images": json.dumps(names)},
        "embeddings": {"dtype": "F32", "shape": list(values.shape),
                       "data_offsets": [0, values.nbytes]}}).encode()
    header += b" " * (-len(header) % 8)
    pathlib.Path(path).write_bytes(struct.pack("<Q", len(header)) + header + values.tobytes())


def read_embeddings(path):
    """Names, and a row for each."""
    data = pathlib.Path(path).read_bytes()
    try:
        values_at = 8 + struct.unpack("<Q", data[:8])[0]
        header = json.loads(data[8:values_at])
        names = json.loads(header["__metadata__"]["images"])
        begin, end = header["embeddings"]["data_offsets"]
        values = np.frombuffer(data[values_at + begin:values_at + end], np.float32)
        return names, values.reshape(header["embeddings"]["shape"])
    except (struct.error, ValueError, KeyError) as error:
        raise SystemExit(f"{path}: holds no embeddings as `sdmt embed` writes them ({error})")
