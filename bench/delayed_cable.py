#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A cable between two network interfaces on which every frame takes its time.

    bench/delayed_cable.py INTERFACE INTERFACE MILLISECONDS      (root; ends with SIGTERM)

What arrives at one interface leaves by the other so many milliseconds later, as netem's delay does
where the kernel has it. Frames must be whole: their senders have to do without offloading
(ethtool -K NAME tx off tso off gso off).
"""
import collections
import select
import socket
import sys
import time

ETH_P_ALL = 3
LARGEST = 65536  # bytes of a frame


def main():
    names, delay = sys.argv[1:3], float(sys.argv[3]) / 1000
    ends = []
    for name in names:
        end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
        end.bind((name, 0))
        ends.append(end)
    waiting = [collections.deque(), collections.deque()]  # (when, frame) for each end
    while True:
        now = time.monotonic()
        for end, frames in zip(ends, waiting):
            while frames and frames[0][0] <= now:
                end.send(frames.popleft()[1])
        due = min((frames[0][0] for frames in waiting if frames), default=now + 1)
        for ready in select.select(ends, [], [], max(0, due - now))[0]:
            frame, address = ready.recvfrom(LARGEST)
            if address[2] != socket.PACKET_OUTGOING:
                waiting[1 - ends.index(ready)].append((time.monotonic() + delay, frame))


if __name__ == "__main__":
    main()
