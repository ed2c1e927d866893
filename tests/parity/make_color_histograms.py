#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes tests/image/fixtures/color_histograms.safetensors with OpenCV and numpy.

Colour histograms of rectangles of the formula's pictures: 8 horizontal stripes of the middle columns,
each with hue x saturation and value bins, square root, unit length.
"""
import os

import cv2
import numpy as np

from parity_network import CROPS, crop, hashed, write_safetensors


def histogram(bgr):
    small = cv2.resize(bgr, (32, 64), interpolation=cv2.INTER_AREA)
    hsv = cv2.cvtColor(small, cv2.COLOR_BGR2HSV)[:, 4:28]
    bins = []
    for stripe in np.split(hsv, 8):
        hue, saturation, value = stripe[..., 0].ravel(), stripe[..., 1].ravel(), stripe[..., 2].ravel()
        bins.append(np.histogram2d(hue, saturation, (8, 4), ((0, 180), (0, 256)))[0].ravel())
        bins.append(np.histogram(value, 4, (0, 256))[0])
    counts = np.concatenate(bins)
    return np.sqrt(counts / counts.sum())


def main():
    rects, rows = [], []
    for i in range(0, CROPS, 3):
        picture = crop(i)
        height, width = picture.shape[:2]
        h = hashed(40, 700 + i).reshape(10, 4)
        for a, b, c, d in [(1.0, 1.0, 0.0, 0.0), *h]:
            w, t = int(2 + a * (width - 2)), int(2 + b * (height - 2))
            x, y = int(c * (width - w + 1)), int(d * (height - t + 1))
            rects.append((i, x, y, w, t))
            rows.append(histogram(picture[y:y + t, x:x + w]))
    write_safetensors(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "image", "fixtures",
                                   "color_histograms.safetensors"),
                      {"rects": np.array(rects, np.int64), "histograms": np.array(rows, np.float32)})


main()
