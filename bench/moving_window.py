#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a camera that moves costs the tracker, where its motion is known exactly.

    bench/moving_window.py --sdmt build/sdmt DATA/mot15/PETS09-S2L1 det-frcnn.txt:detector-frcnn det.txt:detector-acf

A window of 512 x 384 pixels over the frames of a still camera: it stands still, or it pans by 90 and 50
pixels to each side, shakes by 2, zooms by 12 % and rolls by half a degree to each side. Boxes and
ground truth go along, are cut at the window's border, and left out where more than half is outside. By
motion alone. Means of draws, of which the first has all boxes and the others 2 % fewer. Then how far
the motion that was found (--explain, which rounds to a tenth of a pixel) is wrong at the worst corner.
Needs python3-opencv.
"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np

WIDTH, HEIGHT, DROP = 512, 384, 0.02


def views(frames, picture, moves):
    """For each frame, what takes the window's pixels to the picture's: 2 x 3."""
    random = np.random.default_rng(1)
    found = []
    for t in range(frames):
        turn = [math.sin(2 * math.pi * t / period) if moves else 0 for period in (200, 270, 150, 120)]
        shake = random.uniform(-2, 2, 2) if moves else (0, 0)
        scale, roll = 1 + 0.06 * turn[2], math.radians(0.5 * turn[3])
        a, b = scale * math.cos(roll), scale * math.sin(roll)
        x, y = (picture[0] / 2 + 90 * turn[0] + shake[0], picture[1] / 2 + 50 * turn[1] + shake[1])
        found.append(np.array([[a, -b, x - a * WIDTH / 2 + b * HEIGHT / 2],
                               [b, a, y - b * WIDTH / 2 - a * HEIGHT / 2]]))
    return found


def cut(row, view):
    """A row of boxes as the window shows it, or nothing."""
    left, top, width, height = (float(value) for value in row[2:6])
    scale = math.hypot(view[0, 0], view[1, 0])
    centre = np.linalg.solve(view[:, :2], [left - 1 + width / 2, top - 1 + height / 2] - view[:, 2])
    width, height = width / scale, height / scale
    low = np.maximum(centre - [width / 2, height / 2], 0)
    high = np.minimum(centre + [width / 2, height / 2], [WIDTH, HEIGHT])
    size = high - low
    if min(size) <= 0 or size[0] * size[1] < width * height / 2:
        return None
    return [*row[:2], *(f"{value:.3f}" for value in (low[0] + 1, low[1] + 1, *size)), *row[6:]]


def make(sequence, detections, moves, folder):
    """The window as a sequence."""
    info = (sequence / "seqinfo.ini").read_text()
    fields = dict(line.split("=") for line in info.split() if "=" in line)
    picture = int(fields["imWidth"]), int(fields["imHeight"])
    window = views(int(fields["seqLength"]), picture, moves)
    for part in ("gt", "det", "img1"):
        (folder / part).mkdir(parents=True)
    for part in ("gt/gt.txt", *(f"det/{name}" for name in detections)):
        rows = [line.split(",") for line in (sequence / part).read_text().split()]
        kept = [cut(row, window[int(float(row[0])) - 1]) for row in rows]
        (folder / part).write_text("".join(",".join(row) + "\n" for row in kept if row))
    for number, view in enumerate(window, 1):
        image = cv2.imread(str(sequence / "img1" / f"{number:06d}.jpg"))
        image = cv2.warpAffine(image, view, (WIDTH, HEIGHT),
                               flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        cv2.imwrite(str(folder / "img1" / f"{number:06d}.jpg"), image)
    (folder / "seqinfo.ini").write_text(
        f"[Sequence]\nname={sequence.name}\nimDir=img1\nframeRate={fields['frameRate']}\n"
        f"seqLength={len(window)}\nimWidth={WIDTH}\nimHeight={HEIGHT}\nimExt=.jpg\n")
    return window


def motion_errors(explanation, window):
    """Pixels at the worst corner by frame, and how far that corner moved."""
    corners = np.array([[0, 0, 1], [WIDTH, 0, 1], [0, HEIGHT, 1], [WIDTH, HEIGHT, 1]]).T
    found = {}
    for line in explanation.read_text().splitlines():
        if "the camera moved: " not in line:
            continue
        words = line.split()
        zoom, roll = float(words[-3]), math.radians(float(words[-1]))
        a, b = zoom * math.cos(roll), zoom * math.sin(roll)
        found[int(line.split(",")[0])] = np.array([[a, -b, float(words[-6])], [b, a, float(words[-5])]])
    errors, moved = [], []
    for frame in range(2, len(window) + 1):
        before, now = (np.vstack([window[i - 1], [0, 0, 1]]) for i in (frame - 1, frame))
        true = (np.linalg.inv(now) @ before @ corners)[:2]
        guess = found.get(frame, np.eye(2, 3)) @ corners
        errors.append(np.linalg.norm(guess - true, axis=0).max())
        moved.append(np.linalg.norm(corners[:2] - true, axis=0).max())
    return np.array(errors), np.array(moved)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", required=True, type=pathlib.Path)
    parser.add_argument("--draws", type=int, default=9)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("detections", nargs="+", metavar="FILE:CONFIG")
    arguments = parser.parse_args()
    detectors = dict(text.split(":") for text in arguments.detections)

    def run(*words):
        subprocess.run([arguments.sdmt, *words, "-q"], check=True, stdout=subprocess.DEVNULL)

    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        make(arguments.sequence, detectors, False, temporary / "still")
        shown = make(arguments.sequence, detectors, True, temporary / "moves")

        def scores(window, name, words):
            found = []
            lines = (temporary / window / "det" / name).read_text().splitlines(keepends=True)
            for draw in range(arguments.draws):
                random = np.random.default_rng(draw)
                boxes, results = temporary / "boxes.txt", temporary / "results"
                results.mkdir(exist_ok=True)
                boxes.write_text("".join(line for line in lines
                                         if draw == 0 or random.random() >= DROP))
                run("track", temporary / window, "--detections", boxes, "--config", detectors[name],
                    "--no-appearance", *words, "--output", results / f"{window}.txt")
                run("evaluate", "--gt", temporary / window, "--results", results / f"{window}.txt",
                    "--json", temporary / "scores.json", "--benchmark", "MOT15")
                combined = json.loads((temporary / "scores.json").read_text())["combined"]
                found.append([100 * combined["MOTA"], 100 * combined["IDF1"], combined["IDSW"]])
            return np.array(found)

        rows = {"the window stands still": ("still", []),
                "it moves, `--moving-camera`": ("moves", ["--moving-camera"]),
                "it moves": ("moves", [])}
        print("| MOTA / IDF1 (standard deviation of a draw) / ID switches | "
              + " | ".join(detectors) + " |\n|---|" + "---|" * len(detectors))
        for title, (window, words) in rows.items():
            cells = []
            for name in detectors:
                found = scores(window, name, words)
                mota, idf1, switches = found.mean(axis=0)
                cells.append(f"{mota:.1f} / {idf1:.1f} ({found[:, 1].std():.1f}) / {switches:.0f}")
            print(f"| {title} | " + " | ".join(cells) + " |", flush=True)
        run("track", temporary / "moves", "--detections", temporary / "moves/det" / next(iter(detectors)),
            "--no-appearance", "--moving-camera", "--explain", temporary / "explanation.csv",
            "--output", temporary / "tracks.txt")
        errors, moved = motion_errors(temporary / "explanation.csv", shown)
        print(f"the motion found is wrong by {np.median(errors):.2f} pixels (median; 95 %: "
              f"{np.quantile(errors, 0.95):.2f}, at most {errors.max():.2f}) of {np.median(moved):.1f} "
              f"(at most {moved.max():.1f})")


if __name__ == "__main__":
    main()
