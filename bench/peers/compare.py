#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Our engine beside others on the same weights and patches: checks that all agree, lets them run in
turn, and prints medians and ratios. With --rivals, our networks beside other networks, each with its
own weights. What is needed is in docs/performance.md.

    bench/peers/compare.py --build build [--batches 1,8,40,128] [--train 128] [--rounds 15]
    bench/peers/compare.py --build build --model A B --rivals FOLDER --onnxruntime DIR
"""
import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

PAUSE_SECONDS = 0.3
HERE = pathlib.Path(__file__).resolve().parent


class Peer:
    def __init__(self, name, command, threads):
        environment = dict(os.environ, OMP_NUM_THREADS=str(threads))
        self.name = name
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True, env=environment)

    def ask(self, question):
        self.process.stdin.write(question + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().strip()
        if not answer:
            sys.exit(f"{self.name} ended when asked: {question}")
        return None if answer == "none" else [float(word) for word in answer.split()]


def start_networks(args):
    """Our models and the networks of the folder, one crop at a time as those of the folder want it."""
    build = pathlib.Path(args.build)
    peers = [Peer(f"sdmt {pathlib.Path(model).stem}", [build / "peer_sdmt", model], args.threads)
             for model in args.model]
    for onnx in sorted(pathlib.Path(args.rivals).glob("*.onnx")):
        peers.append(Peer(onnx.stem, ["node", HERE / "peer_onnxruntime.mjs", onnx, str(args.threads),
                                      args.onnxruntime, "256", "128"], args.threads))
    return peers


def start_peers(args, folder):
    build = pathlib.Path(args.build)
    model = args.model[0] if args.model else None
    if not model:
        model = folder / "model.safetensors"
        subprocess.run([build / "sdmt", "init-model", "--seed", "1", "--output", model],
                       check=True, stdout=subprocess.DEVNULL)
    peers = [Peer("sdmt", [build / "peer_sdmt", model], args.threads)]
    if (build / "peer_onednn").exists():
        for algorithm in ("winograd", "direct"):
            peers.append(Peer(f"oneDNN {algorithm}", [build / "peer_onednn", model, algorithm],
                              args.threads))
    torch = [args.python, HERE / "peer_torch.py", model]
    if subprocess.run([args.python, "-c", "import torch"], stderr=subprocess.DEVNULL).returncode == 0:
        peers.append(Peer("libtorch", [*torch, str(args.threads)], args.threads))
        if args.onnxruntime:
            onnx = pathlib.Path(args.onnxruntime) / "network.onnx"
            subprocess.run([*torch, "--onnx", onnx], check=True, stdout=subprocess.DEVNULL)
            peers.append(Peer("ONNX Runtime", ["node", HERE / "peer_onnxruntime.mjs", onnx,
                                               str(args.threads), args.onnxruntime],
                              args.threads))
    return peers


def compare(peers, question, rounds, calls=1):
    """Medians of interleaved rounds after one to warm up, and the median of each round's ratio: what
    disturbs the machine for a while disturbs all peers of a round. Pauses let the threads of the
    peer before stop spinning: those of ONNX Runtime doubled the time of whoever came after it."""
    able = [peer for peer in peers if peer.ask(question) is not None]
    times = {peer.name: [] for peer in able}
    for _ in range(rounds):
        for peer in able:
            time.sleep(PAUSE_SECONDS)
            times[peer.name].append(statistics.median(peer.ask(question)[0] for _ in range(calls)))
    ours = times[able[0].name]
    print(f"\n{question}")
    print(f"{'':28}{'median ms':>11}{'min ms':>11}{'first / peer':>13}")
    for name, values in times.items():
        ratio = statistics.median(a / b for a, b in zip(ours, values))
        print(f"{name:28}{statistics.median(values):11.2f}{min(values):11.2f}{ratio:13.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", default="build")
    parser.add_argument("--model", nargs="+", default=[],
                        help="float32 or float16 models, several with --rivals; random weights without")
    parser.add_argument("--rivals", help="folder of other networks as ONNX, for crops of 256 x 128")
    parser.add_argument("--python", default="/usr/bin/python3", help="one that has torch")
    parser.add_argument("--onnxruntime", help="folder where npm installed onnxruntime-node")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--batches", default="1,8,40,128")
    parser.add_argument("--train", default="", help="batch sizes of training steps")
    parser.add_argument("--cpu-time", action="store_true",
                        help="one thread and its CPU time: for a machine that has other work")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--calls", type=int, default=1,
                        help="in a row when it is a peer's turn, of which the median counts; 1: each finds "
                             "the caches as the others left them")
    args = parser.parse_args()
    if args.cpu_time:
        args.threads = 1
        os.environ["PEER_CPU_TIME"] = "1"
    if args.rivals:
        if not args.onnxruntime or not args.model:
            parser.error("--rivals needs --onnxruntime and --model")
        peers = start_networks(args)
        for batch in filter(None, args.batches.split(",")):
            compare(peers, f"embed {batch}", args.rounds, args.calls)
        return
    with tempfile.TemporaryDirectory() as folder:
        peers = start_peers(args, pathlib.Path(folder))
        reference = peers[0].ask("values 3")
        for peer in peers[1:]:
            values = peer.ask("values 3")
            worst = max(abs(a - b) for a, b in zip(reference, values))
            print(f"{peer.name}: largest difference of an embedding's value {worst:.1e}")
            if len(values) != len(reference) or not worst < 1e-4:
                sys.exit(f"{peer.name} does not agree")
        for batch in filter(None, args.batches.split(",")):
            compare(peers, f"embed {batch}", args.rounds, args.calls)
        for batch in filter(None, args.train.split(",")):
            for mode in ("all", "frozen"):
                compare(peers, f"train {batch} {mode}", max(3, args.rounds // 4))


if __name__ == "__main__":
    main()
