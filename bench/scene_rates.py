#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The false-match rates that --scene on reaches, against the ones that are asked for.

    bench/scene_rates.py --build build --detections det-frcnn.txt --config detector-frcnn PETS09-S2L1

Boxes are given to people of the ground truth (IoU > 0.5); a person's states are twenty of the vectors
of his boxes so far, evenly spread over time, as the tracker keeps them. Of strangers who are in the
picture together the share is printed whose nearest states exceed the threshold that the tracker
learned for two tracks. Needs python3-opencv.
"""
import argparse
import collections
import json
import os
import pathlib
import subprocess
import sys
import tempfile

STATES, EVERY = 20, 5  # states of a person; frames between two looks at all pairs


def overlaps(a, b, np):
    """IoU of all boxes of a with all of b: left, top, width, height."""
    sides = [np.minimum(a[:, None, i] + a[:, None, i + 2], b[:, i] + b[:, i + 2])
             - np.maximum(a[:, None, i], b[:, i]) for i in (0, 1)]
    both = np.clip(sides[0], 0, None) * np.clip(sides[1], 0, None)
    return both / (a[:, None, 2] * a[:, None, 3] + b[:, 2] * b[:, 3] - both)


def stranger_affinities(sdmt, sequence, detections, model):
    import cv2
    import numpy as np

    embedder = sdmt.Embedder(model)
    boxes = sdmt.read_detections(sequence / "det" / detections)
    truth = sdmt.read_ground_truth(sequence / "gt/gt.txt")
    seen_of = collections.defaultdict(list)
    found = []
    for frame in range(1, int(truth["frame"].max()) + 1):
        there = (truth["frame"] == frame) & truth["keep"].astype(bool)
        people, ids = truth["boxes"][there], truth["id"][there]
        seen, _ = boxes.frame(frame)
        if len(people) == 0 or len(seen) == 0:
            continue
        picture = next((sequence / "img1").glob(f"{frame:06d}.*"))
        vectors, valid = embedder.embed(cv2.imread(str(picture)), seen)
        iou = overlaps(seen, people, np)
        present = []
        for i in np.argsort(-iou.max(axis=1)):
            person = iou[i].argmax()
            if iou[i, person] > 0.5 and valid[i] and ids[person] not in present:
                seen_of[ids[person]].append(vectors[i])
                present.append(ids[person])
        if frame % EVERY:
            continue
        known = [np.stack([seen_of[one][k] for k in np.linspace(0, len(seen_of[one]) - 1, STATES)
                           .round().astype(int)]) for one in present if len(seen_of[one]) >= STATES]
        for n, one in enumerate(known):
            for other in known[:n]:
                nearest = (one @ other.T).max()
                found.append(1 - np.sqrt(np.clip(2 - 2 * nearest, 0, None)))
    return np.array(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", type=pathlib.Path)
    parser.add_argument("--detections", default="det.txt")
    parser.add_argument("--config", nargs="*", default=[])
    parser.add_argument("--model", default="sdmt-lite")
    parser.add_argument("sequences", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    source = pathlib.Path(__file__).parents[1]
    os.environ.setdefault("SDMT_SHARE_DIR", str(source))
    sys.path.insert(0, str(arguments.build / "python"))
    import sdmt

    for sequence in arguments.sequences:
        affinities = stranger_affinities(sdmt, sequence, arguments.detections, arguments.model)
        for asked in (0.01, 0.05, 0.1):
            with tempfile.TemporaryDirectory() as folder:
                report = pathlib.Path(folder) / "report.json"
                config = [word for name in arguments.config for word in ("--config", name)]
                subprocess.run(
                    [arguments.build / "sdmt", "track", sequence, "--detections",
                     sequence / "det" / arguments.detections, *config, "--model",
                     source / f"models/{arguments.model}.safetensors", "--scene", "on",
                     "--false-match-rate", str(asked), "--json", report, "--output",
                     pathlib.Path(folder) / "tracks.txt", "-q"], check=True)
                scene = json.loads(report.read_text())["scene"]
            reached = (affinities > scene["association_threshold"]).mean()
            print(f"{sequence.name}: asked {100 * asked:.0f} %, reached {100 * reached:.1f} % of "
                  f"{len(affinities)} pairs, affinity above {scene['association_threshold']:.3f} "
                  f"(model {scene['prior']:.3f}), say of appearance {scene['say']:.2f}", flush=True)


if __name__ == "__main__":
    main()
