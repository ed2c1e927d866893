#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How fast processes share a training, and what they send.

  shared_training.py before --other OLD/sdmt   one process against another binary
  shared_training.py ranks                     2 processes of 1 thread, 1 of 2
  shared_training.py bytes                     sent, and the trained values by layer
  shared_training.py network                   networks of less speed between 2 processes
  shared_training.py delays                    networks of longer ways between 2 processes

Runs are interleaved, the best of --rounds counts. `network` and `delays` need root: they make two
name spaces of their own, joined by a cable, and start Open MPI's processes in them. The cable has a
rate that tc sets, or is delayed_cable.py (needs ethtool).
"""
import argparse
import contextlib
import json
import math
import pathlib
import subprocess
import sys
import tempfile

# What each configuration trains; `frozen` the tied head on cached features, `full` the paper's
# network with all weights, `tied` the same with FC1 tied, `lite` the small network.
CONFIGURATIONS = {
    "frozen": ["--freeze-trunk", "--views", "1"],
    "full": ["--tie", "none", "--views", "0"],
    "tied": ["--views", "0"],
    "lite": ["--architecture", "lite", "--tie", "none", "--views", "0"],
}


class Bench:
    def __init__(self, arguments, work):
        self.arguments, self.work = arguments, work
        subprocess.run([arguments.sdmt, "synth", "reid", "--output", work / "people",
                        "--identities", "60"], check=True, capture_output=True)

    def step(self, binary, configuration, before=(), threads=1, more=()):
        """The report of a training: its seconds an iteration are the mean of all."""
        report = self.work / "report.json"
        iterations = {"frozen": 200}.get(configuration, self.arguments.iterations)
        subprocess.run(
            [str(w) for w in [*before, binary, "train-embedder", "--data", self.work / "people",
                              "--output", self.work / "model", "--json", report, "--identities",
                              self.arguments.identities, "--iterations", iterations, "--warmup",
                              "0", "--threads", threads, *CONFIGURATIONS[configuration], *more]],
            check=True, capture_output=True)
        return json.loads(report.read_text())

    def best(self, runs):
        """Seconds an iteration of each of `runs`, called in turn."""
        best = [1e9] * len(runs)
        for _ in range(self.arguments.rounds):
            for i, run in enumerate(runs):
                best[i] = min(best[i], run()["seconds_per_iteration"])
        return best

    def mpirun(self, size, *more):
        return [self.arguments.mpirun, "--allow-run-as-root", "--oversubscribe", *more, "-n", size]


def before(bench):
    for name in bench.arguments.configurations:
        old, new = bench.best([lambda b=b: bench.step(b, name)
                               for b in (bench.arguments.other, bench.arguments.sdmt)])
        print(f"{name}: {old * 1e3:.1f} ms before, {new * 1e3:.1f} ms now: "
              f"{old / new:.3f} of the speed", flush=True)


def ranks(bench):
    for name in bench.arguments.configurations:
        one, two = bench.best([lambda: bench.step(bench.arguments.sdmt, name, threads=2),
                               lambda: bench.step(bench.arguments.sdmt, name, bench.mpirun(2))])
        print(f"{name}: one process of two threads {one * 1e3:.1f} ms, two of one {two * 1e3:.1f} "
              f"ms: {one / two:.3f} of the speed", flush=True)


def layers(bench):
    """Trained values by layer, from the tensors of the last checkpoint."""
    data = (bench.work / "model.checkpoint").read_bytes()
    header = json.loads(data[8:8 + int.from_bytes(data[:8], "little")])
    sizes = {}
    for name, entry in header.items():
        if not name.startswith("training.state.") or "running_" in name:
            continue
        layer = name.removeprefix("training.state.").rsplit(".", 1)[0]
        sizes[layer] = sizes.get(layer, 0) + math.prod(entry["shape"])
    return sizes


def sent(bench):
    for name in bench.arguments.configurations:
        for size in (2, 4):
            report = bench.step(bench.arguments.sdmt, name, bench.mpirun(size),
                                more=["--checkpoint-every", 1])
            print(f"{name}, {size} processes: process 0 sends "
                  f"{report['bytes_sent_per_iteration'] / 1e6:.3f} MB an iteration", flush=True)
        for layer, values in layers(bench).items():
            print(f"  {layer}: {values} values, {values * 4 / 1e6:.3f} MB", flush=True)


# Runs a command of Open MPI's in the other name space, where it would use ssh.
AGENT = """#!/bin/sh
while [ "${1#-}" != "$1" ]; do shift; done
shift
exec ip netns exec sdmt-bench-1 sh -c "$*"
"""


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)


@contextlib.contextmanager
def two_machines(bench, delay=None):
    """Two name spaces with an address each and a cable between them, which takes `delay`
    milliseconds; yields the words that start two processes, one in each."""
    spaces = ["sdmt-bench-0", "sdmt-bench-1"]
    middle = "sdmt-bench-cable"
    agent = bench.work / "agent"
    agent.write_text(AGENT)
    agent.chmod(0o755)
    made, cable = [], None
    try:
        for space in [*spaces, middle]:
            run("ip", "netns", "add", space)
            made.append(space)
        if delay is None:
            run("ip", "link", "add", "cable0", "netns", spaces[0], "type", "veth", "peer", "name",
                "cable1", "netns", spaces[1])
        else:
            for i, space in enumerate(spaces):
                run("ip", "link", "add", f"cable{i}", "netns", space, "mtu", "9000", "type", "veth",
                    "peer", "name", f"end{i}", "netns", middle)
                run("ip", "-n", middle, "link", "set", f"end{i}", "mtu", "9000", "up")
                run("ip", "netns", "exec", space, "ethtool", "-K", f"cable{i}", "tx",
                    "off", "tso", "off", "gso", "off")
            cable = subprocess.Popen(
                ["ip", "netns", "exec", middle, sys.executable,
                 pathlib.Path(__file__).with_name("delayed_cable.py"), "end0", "end1", str(delay)])
        for i, space in enumerate(spaces):
            run("ip", "-n", space, "addr", "add", f"10.199.77.{i + 1}/24", "dev", f"cable{i}")
            run("ip", "-n", space, "link", "set", f"cable{i}", "up")
            run("ip", "-n", space, "link", "set", "lo", "up")
        yield ["ip", "netns", "exec", spaces[0],
               *bench.mpirun(2, "--host", "10.199.77.1:1,10.199.77.2:1", "--mca",
                             "plm_rsh_agent", agent, "--mca", "btl", "tcp,self", "--mca",
                             "btl_tcp_if_include", "10.199.77.0/24", "--mca", "oob_tcp_if_include",
                             "10.199.77.0/24")]
    finally:
        if cable is not None:
            cable.kill()
            cable.wait()
        for space in made:
            run("ip", "netns", "del", space)


def network(bench):
    with two_machines(bench) as launcher:
        for rate in ("10gbit", "1gbit", "100mbit"):
            for i in range(2):
                run("ip", "netns", "exec", f"sdmt-bench-{i}", "tc", "qdisc", "replace", "dev",
                    f"cable{i}", "root", "tbf", "rate", rate, "burst", "1mb", "latency", "50ms")
            for name in bench.arguments.configurations:
                one, two = bench.best(
                    [lambda: bench.step(bench.arguments.sdmt, name),
                     lambda: bench.step(bench.arguments.sdmt, name, launcher)])
                print(f"{name}, {rate}: {one * 1e3:.1f} ms alone, {two * 1e3:.1f} ms "
                      f"shared by two", flush=True)


def delays(bench):
    for name in bench.arguments.configurations:
        undelayed = None
        for delay in (0, 10, 50):
            with two_machines(bench, delay) as launcher:
                seconds, = bench.best([lambda: bench.step(bench.arguments.sdmt, name, launcher)])
            undelayed = undelayed or seconds
            times = "" if delay == 0 else f", {(seconds - undelayed) * 1e3 / delay:.1f} delays more"
            print(f"{name}, {delay} ms: {seconds * 1e3:.1f} ms shared by two{times}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=["before", "ranks", "bytes", "network", "delays"])
    parser.add_argument("--sdmt", type=pathlib.Path, default=pathlib.Path("build/sdmt"))
    parser.add_argument("--other", type=pathlib.Path)
    parser.add_argument("--mpirun", default="mpirun")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=4)
    parser.add_argument("--identities", type=int, default=32)
    parser.add_argument("--configurations", nargs="+", default=list(CONFIGURATIONS))
    arguments = parser.parse_args()
    arguments.sdmt = arguments.sdmt.resolve()
    with tempfile.TemporaryDirectory(prefix="sdmt-bench-") as folder:
        bench = Bench(arguments, pathlib.Path(folder))
        parts = {"before": before, "ranks": ranks, "bytes": sent, "network": network,
                 "delays": delays}
        parts[arguments.part](bench)


if __name__ == "__main__":
    main()
