#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fits the constants of tools/tracking/hog_detector.cpp to a sequence with ground truth.

    scripts/fit-hog.py mot15/PETS09-S2L1      (needs python3-opencv; some three minutes)

Does what HogDetector does, on the frames 1-100, 201-300, ...; there it fits the share of the window
that a person takes (medians, twice over) and then the score (logistic regression on the strongest
margin and the logarithm of the number of windows). The frames between are for the test: it prints how
often boxes of each score are true there.
"""
import pathlib
import sys

import cv2
import numpy as np

MIN_PERSON_HEIGHT, PERSON_HEIGHT, SCALE_STEP, LEAST_MARGIN = 64, 96, 1.2, -0.6
GROUP_IOU, SUPPRESSION_OVERLAP = 0.5, 0.6


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
    zoom = PERSON_HEIGHT / MIN_PERSON_HEIGHT
    size = (round(image.shape[1] * zoom), round(image.shape[0] * zoom))
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


def logistic(features, labels):
    weights = np.zeros(features.shape[1])
    for _ in range(50):  # Newton's method
        p = 1 / (1 + np.exp(-features @ weights))
        hessian = (features * (p * (1 - p))[:, None]).T @ features
        weights += np.linalg.solve(hessian, features.T @ (labels - p))
    return weights


def evaluate(windows, truth, frames, shape):
    """Labels, features, and by how much the boxes that find somebody are off."""
    labels, features, errors = [], [], []
    for frame in frames:
        people, of_people = find_people(*windows[frame], shape)
        found = match(people, truth[frame])
        labels.append(found >= 0)
        features.append(of_people)
        box, person = people[found >= 0], truth[frame][found[found >= 0]]
        lift = (box[:, 1] + box[:, 3] / 2 - person[:, 1] - person[:, 3] / 2) / box[:, 3]
        errors.append(np.column_stack([person[:, 2] / box[:, 2], person[:, 3] / box[:, 3], lift]))
    return np.concatenate(labels).astype(float), np.vstack(features), np.vstack(errors)


def main():
    folder = pathlib.Path(sys.argv[1])
    rows = np.loadtxt(folder / "gt/gt.txt", delimiter=",")
    rows = rows[rows[:, 6] != 0]
    cv2.setNumThreads(1)
    hog = cv2.HOGDescriptor()
    hog.setSVMDetector(cv2.HOGDescriptor_getDefaultPeopleDetector())
    images = {int(file.stem): file for file in sorted((folder / "img1").glob("*.jpg"))}
    windows = {n: find_windows(cv2.imread(str(file)), hog) for n, file in images.items()}
    truth = {n: rows[rows[:, 0] == n][:, 2:6] for n in images}
    fitted = [n for n in images if (n - 1) // 100 % 2 == 0]
    held_out = [n for n in images if n not in set(fitted)]

    shape = np.array([0.5, 0.75, 0.0])
    for _ in range(2):
        ratio_w, ratio_h, lift = np.median(evaluate(windows, truth, fitted, shape)[2], axis=0)
        shape += [shape[0] * (ratio_w - 1), shape[1] * (ratio_h - 1), shape[1] * lift]
    print("width, height, lift: %.3f %.3f %.3f of the window" % tuple(shape))
    labels, features, _ = evaluate(windows, truth, fitted, shape)
    weights = logistic(features, labels)
    print("margin, ln count, bias: %.2f %.2f %.2f" % tuple(weights))

    for name, frames in (("fitted", fitted), ("held out", held_out)):
        labels, features, _ = evaluate(windows, truth, frames, shape)
        p = 1 / (1 + np.exp(-features @ weights))
        print("%s: %d people, %d found by %d boxes" % (
            name, sum(len(truth[n]) for n in frames), labels.sum(), len(labels)))
        for low in np.arange(0, 1, 0.2):
            bin_ = (p >= low) & (p < low + 0.2)
            print("  score %.1f to %.1f: %4d boxes, %.2f true (mean score %.2f)" % (
                low, low + 0.2, bin_.sum(), labels[bin_].mean(), p[bin_].mean()))


if __name__ == "__main__":
    main()
