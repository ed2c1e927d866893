# SPDX-License-Identifier: Apache-2.0
"""Reads and writes safetensors: what the scripts exchange with `sdmt`."""
import json
import pathlib
import struct

import numpy as np

KINDS = {"F32": np.float32, "F16": np.float16}


def write_tensors(path, metadata, tensors):
    """In float32; the file appears whole."""
    header, at, parts = {"__metadata__": metadata}, 0, []
    for name, values in tensors.items():
        parts.append(np.ascontiguousarray(values, np.float32))
        header[name] = {"dtype": "F32", "shape": list(parts[-1].shape),
                        "data_offsets": [at, at + parts[-1].nbytes]}
        at += parts[-1].nbytes
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    whole = pathlib.Path(f"{path}.part")
    with whole.open("wb") as file:
        file.write(struct.pack("<Q", len(text)) + text)
        for part in parts:
            file.write(part.data)
    whole.replace(path)


def read_tensors(path):
    """Metadata and tensors, by name, in float32. ValueError for other files."""
    data = pathlib.Path(path).read_bytes()
    try:
        begin = 8 + struct.unpack("<Q", data[:8])[0]
        header = json.loads(data[8:begin])
        metadata, tensors = header.pop("__metadata__"), {}
        for name, entry in header.items():
            first, end = (begin + offset for offset in entry["data_offsets"])
            values = np.frombuffer(data[first:end], KINDS[entry["dtype"]])
            tensors[name] = values.reshape(entry["shape"]).astype(np.float32, copy=False)
        return metadata, tensors
    except (struct.error, KeyError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error
