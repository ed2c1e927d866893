#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes tests/track/fixtures/kalman.txt: the reference for sdmt::track::KalmanFilter.

The same filter and Rauch-Tung-Striebel smoother in their textbook form, eight states at once, plain
matrix algebra, one frame at a time. Needs numpy.

  kalman_reference.py > tests/track/fixtures/kalman.txt

A line is a box: frames since the last one; cx cy w h measured; then mean and velocity (4 + 4), and the
three entries of the covariance, after the update; then mean and velocity smoothed.
"""
import numpy as np

NOISE = dict(measurement=0.05, position=0.01, velocity=0.004, initial_position=0.1, initial_velocity=0.07)
H = np.hstack([np.eye(4), np.zeros((4, 4))])


def scale(x):
    return max(x[3], 2.0)


def q(x):
    return np.diag([(scale(x) * NOISE["position"]) ** 2] * 4 + [(scale(x) * NOISE["velocity"]) ** 2] * 4)


def main():
    rng = np.random.default_rng(7)
    F = np.eye(8) + np.eye(8, k=4)
    steps = [1, 1, 1, 4, 1, 1, 11, 1, 2, 1, 1, 1, 1, 30, 1, 1]
    truth, v = np.array([100.0, 200.0, 40.0, 90.0]), np.array([3.0, -1.0, 0.2, 0.4])
    rows, x, P = [], None, None
    for i, n in enumerate(steps):
        truth = truth + v * n
        z = truth + rng.normal(size=4) * [3, 4, 2, 5]
        if i == 0:
            x, P = np.concatenate([z, np.zeros(4)]), np.diag(
                [(scale(z) * NOISE["initial_position"]) ** 2] * 4 + [(scale(z) * NOISE["initial_velocity"]) ** 2] * 4)
            rows.append(dict(n=0, z=z, x=x, P=P))
            continue
        Q = q(x)                                   # the height that scales the noise is that of the last box
        Fn = np.eye(8)
        xp, Pp = x, P
        for _ in range(n):
            xp, Pp, Fn = F @ xp, F @ Pp @ F.T + Q, F @ Fn
        S = H @ Pp @ H.T + np.eye(4) * (scale(xp) * NOISE["measurement"]) ** 2
        K = Pp @ H.T @ np.linalg.inv(S)
        x, P = xp + K @ (z - H @ xp), (np.eye(8) - K @ H) @ Pp
        rows.append(dict(n=n, z=z, x=x, P=P, xp=xp, Pp=Pp, F=Fn))
    rows[-1]["s"] = rows[-1]["x"]
    for a, b in zip(rows[-2::-1], rows[:0:-1]):
        a["s"] = a["x"] + a["P"] @ b["F"].T @ np.linalg.inv(b["Pp"]) @ (b["s"] - b["xp"])
    for r in rows:
        P = r["P"]
        print(r["n"], *(repr(float(t)) for t in [*r["z"], *r["x"], P[0, 0], P[0, 4], P[4, 4], *r["s"]]))


if __name__ == "__main__":
    main()
