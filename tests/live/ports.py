# SPDX-License-Identifier: Apache-2.0
"""Ports of servers on this machine."""
import socket
import time


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def wait_for_port(port, process):
    """Until the server that `process` is listens there."""
    end = time.monotonic() + 30
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=1).close()
        except OSError:
            assert time.monotonic() < end and process.poll() is None
            time.sleep(0.02)
