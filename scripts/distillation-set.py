#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes what a small network is taught with: crops of many places, and a teacher's vectors for them.

  distillation-set.py OUT [--teacher NETWORK.onnx] [--made NAME] SOURCE[:VARIANTS:DEGRADED]...

A SOURCE is a folder of crops (a re-identification set, or crops without names), a folder of MOT
sequences that have frames and ground truth, or a video with the boxes of its people in it,
VIDEO=BOXES, as `sdmt detect` writes them. Of each crop are made, on average,
  VARIANTS   legs of somebody else, clothes of another colour, another light; the teacher tells them
             apart, though nobody has ever worn them (default 1.5)
  DEGRADED   the same as worse cameras and detectors show them: shifted, coarse, blurred, noisy,
             half hidden (default 1.5)
Written are
  OUT/crops/            people of the sequences
  OUT/clip/             people of the video
  OUT/made/             variants and degraded crops; --made gives the folder another name, as the
                        folders of one training must differ in theirs
  OUT/domains.json      for each image where it comes from and what was done to it; the teacher's
                        vectors of one such domain have much in common (join-teachers.py --domains)
  OUT/teacher.safetensors   with --teacher: its unit vectors of all of these and of the folders'
                        images, as `sdmt embed` writes them
for `sdmt train-embedder --unlabelled OUT/crops OUT/clip OUT/made --teacher OUT/teacher.safetensors`.
The teacher is any network that OpenCV's dnn reads; it gets RGB, 128 x 256, with ImageNet's mean and
deviation. The same seed gives the same crops. Needs python3-opencv and python3-numpy.
"""
import argparse
import json
import pathlib
import re

import cv2
import numpy as np

from embeddings import write_embeddings

SIZE = (64, 128)  # of a crop: width, height
WAIST = (58, 74)  # rows of a crop between which the legs may begin
MEAN = np.float32([0.485, 0.456, 0.406])
DEVIATION = np.float32([0.229, 0.224, 0.225])


def images_below(folder):
    found = sorted(p for p in pathlib.Path(folder).rglob("*")
                   if p.suffix.lower() in (".jpg", ".jpeg", ".png") and not p.name.startswith("."))
    if not found:
        raise SystemExit(f"{folder}: holds no .jpg or .png image")
    return found


def read(path):
    image = cv2.imread(str(path))
    if image is None:
        raise SystemExit(f"{path}: cannot be read as an image")
    return image


def crop_sequence(folder, out):
    """People of the first and last frame that are there, at least half visible and 60 pixels tall."""
    frames = images_below(folder / "img1")
    truth = np.loadtxt(folder / "gt" / "gt.txt", delimiter=",", ndmin=2)
    for frame in (frames[0], frames[-1]):
        image = read(frame)
        height, width = image.shape[:2]
        for row in truth[truth[:, 0] == int(frame.stem)]:
            if len(row) > 8 and (row[7] not in (1, 2, 7) or row[8] < 0.5):
                continue  # no person, or hidden
            left, top, right, bottom = (int(round(v)) for v in (
                max(0, row[2] - 1), max(0, row[3] - 1),
                min(width, row[2] - 1 + row[4]), min(height, row[3] - 1 + row[5])))
            if row[5] < 60 or bottom - top < 50 or right - left < 18:
                continue
            crop = cv2.resize(image[top:bottom, left:right], SIZE, interpolation=cv2.INTER_AREA)
            cv2.imwrite(str(out / f"{folder.name}-{frame.stem}-{int(row[1]):04d}.png"), crop)


def crop_video(video, boxes, out):
    """People at least 60 pixels tall whose score is at least 0.4."""
    rows = np.loadtxt(boxes, delimiter=",", ndmin=2)
    reader = cv2.VideoCapture(str(video))
    frame = count = 0
    while True:
        more, image = reader.read()
        frame += 1
        if not more:
            break
        height, width = image.shape[:2]
        for row in rows[rows[:, 0] == frame]:
            left, top = max(0, int(row[2])), max(0, int(row[3]))
            right, bottom = min(width, int(row[2] + row[4])), min(height, int(row[3] + row[5]))
            if row[6] < 0.4 or row[5] < 60 or bottom - top < 50 or right - left < 18:
                continue
            crop = cv2.resize(image[top:bottom, left:right], SIZE, interpolation=cv2.INTER_AREA)
            cv2.imwrite(str(out / f"{frame:04d}-{count:05d}.png"), crop)
            count += 1


def recoloured(image, first, last, rng):
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(np.int32)
    part = hsv[first:last]
    part[..., 0] = (part[..., 0] + rng.integers(0, 180)) % 180
    part[..., 1] = np.clip(part[..., 1] * rng.uniform(0.5, 1.8), 0, 255)
    part[..., 2] = np.clip(part[..., 2] * rng.uniform(0.6, 1.5), 0, 255)
    return cv2.cvtColor(hsv.astype(np.uint8), cv2.COLOR_HSV2BGR)


def relit(image, rng):
    values = (image.astype(np.float32) / 255) ** rng.uniform(0.6, 1.6)
    values = values * rng.uniform(0.75, 1.25) * rng.uniform(0.85, 1.15, 3)
    mean = values.mean()
    values = (values - mean) * rng.uniform(0.7, 1.3) + mean
    return np.clip(values * 255, 0, 255).astype(np.uint8)


def variant(images, i, rng):
    image = images[i].copy()
    if rng.random() < 0.5:
        image = image[:, ::-1].copy()
    kind = rng.random()
    waist = int(rng.integers(*WAIST))
    if kind < 0.45:
        other = images[rng.integers(len(images))]
        if rng.random() < 0.5:
            other = other[:, ::-1]
        share = np.clip((np.arange(SIZE[1]) - waist) / 4 + 0.5, 0, 1)[:, None, None]
        image = (image * (1 - share) + other * share).astype(np.uint8)
    elif kind < 0.75:
        if rng.random() < 0.7:
            image = recoloured(image, 18, waist, rng)
        if rng.random() < 0.7:
            image = recoloured(image, waist, SIZE[1], rng)
    return relit(image, rng) if rng.random() < 0.6 else image


def degraded(images, image, rng):
    width, height = SIZE
    if rng.random() < 0.7:
        scale = rng.uniform(0.85, 1.2)
        across = rng.uniform(-0.1, 0.1) * width
        down = rng.uniform(-0.08, 0.08) * height
        move = np.float32([[scale, 0, (1 - scale) * width / 2 + across],
                           [0, scale * rng.uniform(0.95, 1.05), (1 - scale) * height / 2 + down]])
        image = cv2.warpAffine(image, move, SIZE, borderMode=cv2.BORDER_REPLICATE)
    if rng.random() < 0.4:
        share = rng.uniform(0.25, 0.8)
        coarse = (max(8, int(width * share)), max(16, int(height * share)))
        image = cv2.resize(cv2.resize(image, coarse, interpolation=cv2.INTER_AREA), SIZE)
    if rng.random() < 0.2:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.6))
    if rng.random() < 0.3:  # somebody or something stands before
        other = images[rng.integers(len(images))]
        h = int(rng.integers(height // 8, height // 2))
        w = int(rng.integers(width // 4, width))
        top = height - h if rng.random() < 0.5 else int(rng.integers(0, height - h + 1))
        left = int(rng.integers(0, width - w + 1))
        image = image.copy()
        image[top:top + h, left:left + w] = (
            other[top:top + h, :w] if rng.random() < 0.6 else rng.integers(0, 255, 3))
    if rng.random() < 0.3:
        noise = rng.normal(0, rng.uniform(2, 12), image.shape)
        image = np.clip(image.astype(np.float32) + noise, 0, 255).astype(np.uint8)
    return image


def teach(network, image):
    values = cv2.resize(image, (128, 256))[:, :, ::-1].astype(np.float32) / 255
    values = (values - MEAN) / DEVIATION
    network.setInput(np.ascontiguousarray(values.transpose(2, 0, 1)[None]))
    vector = network.forward().ravel()
    return vector / np.linalg.norm(vector)


class Source:
    """Crops of one kind of place, and how many others are made of each."""

    def __init__(self, text, out):
        place, *counts = text.split(":")
        try:
            self.variants, self.degraded = [float(count) for count in counts] or (1.5, 1.5)
        except ValueError:
            raise SystemExit(f"{text}: expected SOURCE or SOURCE:VARIANTS:DEGRADED, two numbers") from None
        path = pathlib.Path(place.split("=")[0])
        self.name = path.stem
        self.sequences = path.is_dir() and sorted(
            s for s in path.iterdir() if (s / "gt" / "gt.txt").exists())
        folder = path
        if self.sequences:
            folder = out / "crops"
            folder.mkdir(parents=True, exist_ok=True)
            for sequence in self.sequences:
                crop_sequence(sequence, folder)
        elif "=" in place:
            folder = out / "clip"
            folder.mkdir(parents=True, exist_ok=True)
            crop_video(path, place.split("=")[1], folder)
        elif path.name == "bounding_box_train":
            self.name = path.parent.name
        self.paths = images_below(folder)
        self.images = [cv2.resize(read(p), SIZE) for p in self.paths]

    def domain(self, i, kind):
        """Sequences are places of their own, with too few crops to tell the kinds apart; so are the
        cameras of a re-identification set."""
        if self.sequences:
            return self.paths[i].name.rsplit("-", 2)[0]
        camera = re.match(r"-?\d+_(c\d+)", self.paths[i].name)
        return "/".join([self.name, *(camera.groups() if camera else ()), kind])


def whole(count, rng):
    return int(count) + (rng.random() < count - int(count))


def make_others(sources, folder, rng):
    """Names of what was made, and their domains."""
    folder.mkdir(parents=True, exist_ok=True)
    made = {}
    for source in sources:
        for i, image in enumerate(source.images):
            variants, of_degraded = whole(source.variants, rng), whole(source.degraded, rng)
            for kind, count in (("variant", variants), ("degraded", of_degraded)):
                for _ in range(count):
                    same_place = rng.random() < 0.6
                    others = source.images if same_place else (
                        sources[rng.integers(len(sources))].images)
                    images = [image] + [others[k] for k in rng.integers(0, len(others), 6)]
                    crop = variant(images, 0, rng)
                    quality = 92
                    if kind == "degraded":
                        crop = degraded(images, crop, rng)
                        quality = int(rng.integers(45, 95))
                    path = folder / f"{len(made):06d}.jpg"
                    cv2.imwrite(str(path), crop, [cv2.IMWRITE_JPEG_QUALITY, quality])
                    made[str(path)] = source.domain(i, kind)
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("sources", nargs="+", metavar="source")
    parser.add_argument("--teacher")
    parser.add_argument("--made", default="made", metavar="NAME")
    parser.add_argument("--seed", type=int, default=20)
    arguments = parser.parse_args()

    for folder in ("crops", "clip", arguments.made):
        if (arguments.out / folder).exists():
            raise SystemExit(f"{arguments.out / folder}: is there already, and its crops would be taken "
                             "for these; expected a new folder")
    sources = [Source(text, arguments.out) for text in arguments.sources]
    domains = {str(p): s.domain(i, "plain") for s in sources for i, p in enumerate(s.paths)}
    domains.update(make_others(sources, arguments.out / arguments.made,
                               np.random.default_rng(arguments.seed)))
    (arguments.out / "domains.json").write_text(json.dumps(domains))
    print(f"{len(domains)} crops of {len(set(domains.values()))} domains: {arguments.out}")

    if arguments.teacher:
        network = cv2.dnn.readNet(arguments.teacher)
        vectors = [teach(network, cv2.resize(read(p), SIZE)) for p in domains]
        write_embeddings(arguments.out / "teacher.safetensors", list(domains), vectors)


if __name__ == "__main__":
    main()
