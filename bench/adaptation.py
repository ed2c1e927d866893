#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `sdmt adapt` gives on the second half of a sequence when it learns from the first.

  adaptation.py SEQUENCE --detections det-frcnn.txt:detector-frcnn det.txt:detector-acf
      [--home DATA]      a data set in Market-1501's layout that must not suffer
      [--draws 8]        also tracks the second half, with 2 % of its boxes dropped each time

The ground truth of the second half judges, nobody's labels teach. Per detector and seed: area under
the ROC curve, false-match rate at TPR 0.7, area at home, CPU seconds; then MOTA and IDF1, means of
the draws with both networks.
"""
import argparse
import configparser
import json
import pathlib
import random
import resource
import subprocess
import tempfile


def run(words, wanted=(0,)):
    result = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if result.returncode not in wanted:
        raise SystemExit(f"{' '.join(map(str, words))}:\n{result.stderr}")
    return result


class Bench:
    def __init__(self, arguments, work):
        self.a, self.work = arguments, work
        info = configparser.ConfigParser()
        info.read(arguments.sequence / "seqinfo.ini")
        self.info = info["Sequence"]
        self.length = int(self.info["seqLength"])
        self.half = self.length // 2

    def roc(self, model, data, *more):
        report = self.work / "roc.json"
        run([self.a.sdmt, "validate-roc", "--model", model, "--data", data, "--json", report, *more])
        return json.loads(report.read_text())["person_only"]

    def scores(self, model):
        second = self.roc(model, self.a.sequence, "--frames", f"{self.half + 1}-", "--frame-step", 5)
        home = self.roc(model, self.a.home)["auc"] if self.a.home else float("nan")
        return second["auc"], second["fpr_at_tpr"]["0.7"], second["fpr_at_tpr"]["0.9"], home

    def adapt(self, detections, config, seed):
        model, report = self.work / f"{detections}-{seed}.safetensors", self.work / "adapt.json"
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = run([self.a.sdmt, "adapt", "--model", self.a.model, "--output", model,
                      self.a.sequence, "--detections", detections, "--config", config, "--frames",
                      f"1-{self.half}", "--seed", seed, "--json", report, *self.a.more], (0, 1))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return model if result.returncode == 0 else None, json.loads(report.read_text()), seconds

    def second_half(self, detections, draw):
        """The sequence from its second half on, numbered from 1, without 2 % of its boxes."""
        folder = self.work / f"half-{detections}-{draw}" / self.a.sequence.name
        if folder.exists():
            return folder
        (folder / "img1").mkdir(parents=True)
        info = configparser.ConfigParser()
        info.optionxform = str
        info["Sequence"] = {**self.info, "seqLength": str(self.length - self.half)}
        with open(folder / "seqinfo.ini", "w") as file:
            info.write(file, space_around_delimiters=False)
        for frame in range(self.half + 1, self.length + 1):
            name = f"{frame - self.half:06d}.jpg"
            (folder / "img1" / name).symlink_to(
                (self.a.sequence / "img1" / f"{frame:06d}.jpg").resolve())
        drop = random.Random(draw)
        for source, target, share in ((f"det/{detections}", "det/det.txt", 0.02 if draw else 0),
                                      ("gt/gt.txt", "gt/gt.txt", 0)):
            (folder / target).parent.mkdir(exist_ok=True)
            with open(folder / target, "w") as file:
                for line in open(self.a.sequence / source):
                    frame, rest = line.split(",", 1)
                    if int(frame) > self.half and drop.random() >= share:
                        file.write(f"{int(frame) - self.half},{rest}")
        return folder

    def track(self, model, detections, config):
        sums = [0.0, 0.0]
        for draw in range(1, self.a.draws + 1):
            folder = self.second_half(detections, draw)
            tracks, report = self.work / f"{folder.name}.txt", self.work / "scores.json"
            run([self.a.sdmt, "track", folder, "--model", model, "--config", config, "--output",
                 tracks])
            run([self.a.sdmt, "evaluate", "--gt", folder, "--results", tracks, "--benchmark",
                 self.a.benchmark, "--json", report])
            scores = json.loads(report.read_text())["combined"]
            sums[0] += 100 * scores["MOTA"] / self.a.draws
            sums[1] += 100 * scores["IDF1"] / self.a.draws
        return sums


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("--detections", nargs="+", required=True, metavar="NAME:CONFIG")
    parser.add_argument("--sdmt", default="build/sdmt")
    parser.add_argument("--model", default="models/sdmt-lite.safetensors")
    parser.add_argument("--home", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--benchmark", default="MOT15")
    parser.add_argument("--more", nargs=argparse.REMAINDER, default=[], help="options of adapt")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as work:
        bench = Bench(arguments, pathlib.Path(work))
        row = "{:26} AUC {:.4f}  FMR at TPR 0.7 {:.4f}  at 0.9 {:.4f}  at home {:.4f}"
        print(row.format("before", *bench.scores(arguments.model)), flush=True)
        for entry in arguments.detections:
            detections, config = entry.split(":")
            for seed in range(arguments.seeds):
                model, report, seconds = bench.adapt(detections, config, seed)
                name = f"{detections} seed {seed}"
                if model is None:
                    print(f"{name:26} not written; {seconds:.0f} s of CPU", flush=True)
                    continue
                print(row.format(name, *bench.scores(model)),
                      f" {report['iterations']} steps, {seconds:.0f} s of CPU", flush=True)
                if arguments.draws and seed == 0:
                    for which, file in (("before", arguments.model), ("after", model)):
                        mota, idf1 = bench.track(file, detections, config)
                        print(f"{'':26} tracked {which}: MOTA {mota:.1f} IDF1 {idf1:.1f}",
                              flush=True)


if __name__ == "__main__":
    main()
