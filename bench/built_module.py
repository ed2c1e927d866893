# SPDX-License-Identifier: Apache-2.0
"""What the benches of the Python module begin with."""
import argparse
import os
import sys
from pathlib import Path


def built_module(**numbers):
    """The module `sdmt` that lies in a build folder, with the models of the source, and the command
    line: the build folder and an option for each of `numbers`, whose values are the defaults."""
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    for name, value in numbers.items():
        parser.add_argument(f"--{name}", type=type(value), default=value)
    options = parser.parse_args()
    os.environ.setdefault("SDMT_SHARE_DIR", str(Path(__file__).parents[1]))
    sys.path.insert(0, f"{options.build}/python")
    import sdmt

    return sdmt, options
