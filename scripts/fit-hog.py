#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits the constants of src/pipeline/hog_detector.cpp to sequences with ground truth.

    scripts/fit-hog.py [--frames N] SEQUENCE...      (needs python3-opencv; some 0.2 s a frame)

Does what HogDetector does but for its second search, and fits the share of the window that a person takes
(medians, twice over) and then the score (logistic regression on the strongest margin and the logarithm of
the number of windows); every sequence counts as much as another, however long. Each sequence is then
judged by the constants that the others give: how often boxes of each score are true there, beside the
constants in use. One sequence alone is taken for two, the frames 1-100, 201-300, ... and those between.
"""
import argparse
import pathlib

import cv2
import numpy as np

MIN_PERSON_HEIGHT, PERSON_HEIGHT, SCALE_STEP, LEAST_MARGIN, MOST_PIXELS = 64, 96, 1.2, -0.6, 2.4e6
GROUP_IOU, SUPPRESSION_OVERLAP = 0.5, 0.6
IN_USE = (0.546, 0.750, 0.015), (2.15, 1.05, -2.71)  # width, height, lift; margin, ln count, bias


def shared(a, b):
    """Areas that boxes (rows of left, top, width, height) of a and b share."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum((a[:, :2] + a[:, 2:])[:, None], (b[:, :2] + b[:, 2:])[None])
    return np.clip(high - low, 0, None).prod(2)


def iou(a, b):
    common = shared(a, b)
    return common / (a[:, 2:].prod(1)[:, None] + b[:, 2:].prod(1)[None] - common)


def find_windows(image, hog):
    """Windows (left, top, width, height) and margins, the strongest first."""
    height, width = image.shape[:2]
    zoom = min(PERSON_HEIGHT / MIN_PERSON_HEIGHT, (MOST_PIXELS / (width * height)) ** 0.5)
    size = (round(width * zoom), round(height * zoom))
    windows, margins = hog.detectMultiScale(
        cv2.resize(image, size), hitThreshold=LEAST_MARGIN, winStride=(8, 8), padding=(16, 16),
        scale=SCALE_STEP, groupThreshold=0)
    windows, margins = np.reshape(windows, (-1, 4)) / zoom, np.ravel(margins)
    order = np.lexsort((windows[:, 3], windows[:, 1], windows[:, 0], -margins))
    return windows[order], margins[order]


def find_people(windows, margins, shape):
    """Boxes and what their scores are made of: margin and logarithm of the count."""
    width, height, lift = shape
    size = windows[:, 2:] * (width, height)
    centre = windows[:, :2] + windows[:, 2:] * (0.5, 0.5 - lift) + 1
    boxes = np.hstack([centre - size / 2, size])
    areas = size.prod(1)
    taken, people, features = [], [], []
    for k in np.flatnonzero(margins > 0):
        one = boxes[k:k + 1]
        common = shared(one, boxes[taken])[0]
        if (common > SUPPRESSION_OVERLAP * np.minimum(areas[k], areas[taken])).any():
            continue
        taken.append(k)
        group = iou(one, boxes)[0] > GROUP_IOU
        weights = np.exp(margins[group])
        mean = np.average(centre[group], axis=0, weights=weights)
        extent = np.exp(np.average(np.log(size[group]), axis=0, weights=weights))
        people.append(np.hstack([mean - extent / 2, extent]))
        features.append((margins[k], np.log(group.sum()), 1))
    return np.reshape(people, (-1, 4)), np.reshape(features, (-1, 3))


def match(people, truth):
    """For each box, the strongest first, the person that it finds (IoU of 0.5 or more), or -1."""
    found = np.full(len(people), -1)
    overlaps = iou(people, truth)
    for i in range(len(people)):
        free = np.where(np.isin(np.arange(len(truth)), found), 0, overlaps[i])
        if len(truth) and free.max() >= 0.5:
            found[i] = free.argmax()
    return found


def logistic(features, labels, weights):
    constants = np.zeros(features.shape[1])
    for _ in range(50):  # Newton's method
        p = 1 / (1 + np.exp(-features @ constants))
        hessian = (features * (weights * p * (1 - p))[:, None]).T @ features
        constants += np.linalg.solve(hessian, features.T @ (weights * (labels - p)))
    return constants


def weighted_median(columns, weights):
    order = np.argsort(columns, axis=0)
    passed = np.cumsum(weights[order], axis=0) >= weights.sum() / 2
    return np.take_along_axis(columns, order, 0)[passed.argmax(0), range(columns.shape[1])]


class Sequence:
    """Windows and people of some frames."""

    def __init__(self, name, frames):
        self.name, self.frames = name, frames

    def evaluate(self, shape):
        """Labels and features of all boxes, and by how much those that find somebody are off."""
        labels, features, errors = [], [], []
        for windows, margins, truth, ignored in self.frames:
            people, of_people = find_people(windows, margins, shape)
            found = match(people, truth)
            counts = found >= 0
            if len(ignored):
                counts |= iou(people, ignored).max(1) < 0.5
            labels.append(found[counts] >= 0)
            features.append(of_people[counts])
            box, person = people[found >= 0], truth[found[found >= 0]]
            lift = (box[:, 1] + box[:, 3] / 2 - person[:, 1] - person[:, 3] / 2) / box[:, 3]
            errors.append(np.column_stack([person[:, 2] / box[:, 2], person[:, 3] / box[:, 3], lift]))
        return np.concatenate(labels).astype(float), np.vstack(features), np.vstack(errors)

    def report(self, shape, constants):
        labels, features, _ = self.evaluate(shape)
        p = 1 / (1 + np.exp(-features @ constants))
        print("    %d people, %d found by %d boxes; mean logarithm of the loss %.3f" % (
            sum(len(frame[2]) for frame in self.frames), labels.sum(), len(labels),
            -np.log(np.where(labels > 0, p, 1 - p)).mean()))
        print("    true of those with a score of " + ", ".join("%.1f to %.1f: %.2f of %d" % (
            low, low + 0.2, labels[chosen].mean() if chosen.any() else 0, chosen.sum())
            for low in np.arange(0, 1, 0.2) for chosen in [(p >= low) & (p < low + 0.2)]))


def read(folder, most):
    rows = np.loadtxt(folder / "gt/gt.txt", delimiter=",")
    has_classes = rows.shape[1] == 9  # MOT15 has world coordinates there, in ten columns
    keep = (rows[:, 6] != 0) & (rows[:, 7] <= 1 if has_classes else True)
    hog = cv2.HOGDescriptor()
    hog.setSVMDetector(cv2.HOGDescriptor_getDefaultPeopleDetector())
    frames = {}
    files = sorted((folder / "img1").glob("*.jpg"))
    for file in files[::-(-len(files) // most)]:
        of_frame = rows[:, 0] == int(file.stem)
        frames[int(file.stem)] = (*find_windows(cv2.imread(str(file)), hog),
                                  rows[of_frame & keep][:, 2:6], rows[of_frame & ~keep][:, 2:6])
    return frames


def fit(sequences):
    def joined(shape):
        parts = [sequence.evaluate(shape) for sequence in sequences]
        weights = [[np.full(len(values), 1 / len(values)) for values in part] for part in parts]
        return [np.concatenate(some) for some in zip(*parts)], [
            np.concatenate(some) for some in zip(*weights)]

    shape = np.array([0.5, 0.75, 0.0])
    for _ in range(2):
        (_, _, errors), (_, _, weights) = joined(shape)
        ratio_w, ratio_h, lift = weighted_median(errors, weights)
        shape += [shape[0] * (ratio_w - 1), shape[1] * (ratio_h - 1), shape[1] * lift]
    (labels, features, _), (weights, _, _) = joined(shape)
    return shape, logistic(features, labels, weights)


def say(name, constants):
    print("%s: width, height, lift %.3f %.3f %.3f; margin, ln count, bias %.2f %.2f %.2f" % (
        name, *constants[0], *constants[1]))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=10**6, help="at most so many of each, evenly spread")
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    sequences = []
    for folder in arguments.folders:
        frames = read(folder, arguments.frames)
        if len(arguments.folders) > 1:
            sequences.append(Sequence(folder.name, list(frames.values())))
            continue
        for part in (0, 1):
            sequences.append(Sequence("part %d" % (part + 1), [
                frame for n, frame in frames.items() if (n - 1) // 100 % 2 == part]))

    say("all", fit(sequences))
    for sequence in sequences:
        constants = fit([other for other in sequences if other is not sequence])
        say("without " + sequence.name, constants)
        sequence.report(*constants)
        print("    with the constants in use:")
        sequence.report(*map(np.array, IN_USE))


if __name__ == "__main__":
    main()
