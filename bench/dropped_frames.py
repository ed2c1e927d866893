#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How tracking bears dropped frames, beside ByteTrack's.

    bench/dropped_frames.py --sdmt build/sdmt --detections det-frcnn17.txt DATA/mot16/*
    bench/dropped_frames.py --sdmt build/sdmt --detections det-frcnn.txt --calibration frcnn DATA/mot15/PETS09-S2L1

Of each sequence every frame, every second and every third is kept, boxes and ground truth; scored are
the frames that are kept. Motion alone; each row twice, with and without the smoothing and filling of a
delay. "by time": the tracker is told when each frame was taken (--frame-rate); otherwise, as for
ByteTrack, a frame is a frame.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

ROWS = {"ByteTrack": "ByteTrack, online", "online, no appearance": "ours, online",
        "ByteTrack, smoothed and filled": "ByteTrack, smoothed and filled",
        "tuned, no appearance": "ours"}


def rows(file):
    return [row.split(",") for row in file.read_text().split("\n") if row]


def thin(sequence, detections, step, folder):
    """The sequence with every step-th frame. Returns the boxes as JSON lines with their times."""
    out = folder / sequence.name
    info = (sequence / "seqinfo.ini").read_text()
    fields = dict(line.split("=") for line in info.split() if "=" in line)
    length, rate = int(fields["seqLength"]), float(fields["frameRate"])
    kept = range(1, length + 1, step)
    number = {frame: i + 1 for i, frame in enumerate(kept)}
    boxes = {}
    for part in ("gt/gt.txt", f"det/{detections}"):
        lines = []
        for row in rows(sequence / part):
            frame = int(float(row[0]))
            if frame not in number:
                continue
            lines.append(",".join([str(number[frame]), *row[1:]]))
            if part != "gt/gt.txt":
                boxes.setdefault(frame, []).append([float(value) for value in row[2:7]])
        (out / part).parent.mkdir(parents=True, exist_ok=True)
        (out / part).write_text("\n".join(lines) + "\n")
    (out / "seqinfo.ini").write_text(info.replace(f"seqLength={length}", f"seqLength={len(kept)}"))
    times = out / "times.jsonl"
    times.write_text("".join(json.dumps({
        "frame": number[frame], "time": (frame - 1) / rate,
        "boxes": [box[:4] for box in boxes.get(frame, [])],
        "scores": [box[4] for box in boxes.get(frame, [])]}) + "\n" for frame in kept))
    return times, rate


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sdmt", required=True, type=pathlib.Path)
    parser.add_argument("--detections", default="det.txt")
    parser.add_argument("--calibration", default="none")
    parser.add_argument("sequences", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()

    def run(*words):
        subprocess.run([arguments.sdmt, *words, "-q"], check=True, stdout=subprocess.DEVNULL)

    def by_time(folder, thinned, results, *words):
        for name, (times, rate) in thinned.items():
            run("track", folder / name, "--detections", times, "--calibration",
                arguments.calibration, "--no-appearance", "--frame-rate", str(rate), "--output",
                results / f"{name}.txt", *words)
        run("evaluate", "--gt", folder, "--results", results, "--json", results / "scores.json",
            "--benchmark", benchmark)
        scores = json.loads((results / "scores.json").read_text())["combined"]
        return scores["MOTA"], scores["IDF1"], scores["IDSW"]

    found = {}
    for step in (1, 2, 3):
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary) / "sequences"
            thinned = {sequence.name: thin(sequence, arguments.detections, step, folder)
                       for sequence in arguments.sequences}
            scores = pathlib.Path(temporary) / "ablation.json"
            run("ablate", "--sequences", folder, "--detections", arguments.detections,
                "--calibration", arguments.calibration, "--variants", *ROWS, "--json", scores)
            ablation = json.loads(scores.read_text())
            benchmark = ablation["benchmark"]
            for row in ablation["rows"]:
                found[ROWS[row["variant"]], step] = row["mota"], row["idf1"], row["ids"]
            for name, words in {"ours, online, by time": ["--config", "track-online"],
                                "ours, by time": []}.items():
                results = pathlib.Path(temporary) / name
                results.mkdir()
                found[name, step] = by_time(folder, thinned, results, *words)
    names = [*list(ROWS.values())[:2], "ours, online, by time", *list(ROWS.values())[2:],
             "ours, by time"]
    print("| MOTA / IDF1 / ID switches | every frame | every second | every third |\n|---|---|---|---|")
    for name in names:
        cells = ["{:.1f} / {:.1f} / {}".format(100 * found[name, step][0], 100 * found[name, step][1],
                                               found[name, step][2]) for step in (1, 2, 3)]
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
