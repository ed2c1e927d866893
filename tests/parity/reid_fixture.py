#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes reid_fixture.json: ROC figures and re-identification metrics of made-up embeddings, computed by plain
numpy straight from the definitions (every pair compared with every pair, no shared code with the library).

Usage: reid_fixture.py > reid_fixture.json        (numpy 1.24)
"""
import json
import sys

import numpy as np

rng = np.random.default_rng(20)
IDS, CAMS, DIM = 9, 3, 6

# Points: a centre a person, noise, a shift a camera; rounded coarsely so that equal distances occur; 8 background points.
centres = rng.normal(size=(IDS, DIM))
shift = 0.25 * rng.normal(size=(CAMS, DIM))
points, pids, camids = [], [], []
for pid in range(1, IDS + 1):
    for _ in range(rng.integers(3, 7)):
        cam = int(rng.integers(CAMS))
        points.append(centres[pid - 1] + 0.55 * rng.normal(size=DIM) + shift[cam])
        pids.append(pid), camids.append(cam + 1)
for _ in range(8):
    points.append(rng.normal(size=DIM)), pids.append(0), camids.append(int(rng.integers(CAMS)) + 1)
order = rng.permutation(len(points))
x = np.array(points)[order]
x /= np.linalg.norm(x, axis=1, keepdims=True)
x = (np.round(x * 4) / 8).astype(np.float32)            # eighths: squared distances are exact, ties are real
pids, camids = np.array(pids)[order], np.array(camids)[order]
dist = np.sqrt(((x[:, None].astype(np.float64) - x[None]) ** 2).sum(-1)).astype(np.float32)


def figures(pos, neg):
    pos, neg = np.sort(pos.astype(np.float64)), np.sort(neg.astype(np.float64))
    auc = ((pos[:, None] < neg[None]).mean() + 0.5 * (pos[:, None] == neg[None]).mean())
    cuts = np.unique(np.r_[pos, neg])
    tpr = np.r_[0, [(pos <= c).mean() for c in cuts]]
    fpr = np.r_[0, [(neg <= c).mean() for c in cuts]]
    middle = np.r_[cuts[0] / 2, (cuts[1:] + cuts[:-1]) / 2, cuts[-1]]
    # densely sampled polyline: equal error rate and heights by search
    t = np.linspace(0, 1, 200001)
    arc = np.arange(len(tpr)) / (len(tpr) - 1)
    f_t, t_t = np.interp(t, arc, fpr), np.interp(t, arc, tpr)
    eer = f_t[np.argmin(np.abs(f_t + t_t - 1))]
    at = {str(f): float(t_t[np.where(f_t <= f + 1e-12)[0][-1]]) for f in (0.1, 0.01)}
    accuracy = (tpr + 1 - fpr) / 2
    best = int(np.argmax(accuracy))
    fpr_cut = {str(f): float(1 - middle[np.where(fpr <= f)[0][-1]]) for f in (0.1, 0.01)}
    nearest = int(np.argmin(np.abs(fpr + tpr - 1)))
    return dict(auc=float(auc), eer=float(eer), tpr_at_fpr=at, accuracy=float(accuracy[best]),
                tau_a_accuracy=float(1 - middle[best]), tau_a_eer=float(1 - middle[nearest]), tau_a_at_fpr=fpr_cut,
                positives=len(pos), negatives=len(neg))


i, j = np.triu_indices(len(x), 1)
person = (pids[i] > 0) & (pids[j] > 0)
same = pids[i] == pids[j]
across = camids[i] != camids[j]
d = dist[i, j]
out = dict(embeddings=x.tolist(), pids=pids.tolist(), camids=camids.tolist(),
           person_only=figures(d[person & same], d[person & ~same]),
           cross_camera=figures(d[person & same & across], d[person & ~same & across]))

# Bootstrap by identity: identities drawn with replacement, the pairs between two copies of one identity left out.
areas = []
for _ in range(4000):
    w = np.bincount(rng.integers(1, IDS + 1, IDS), minlength=IDS + 1).astype(float)
    wp, wn = w[pids[i[person & same]]], (w[pids[i]] * w[pids[j]])[person & ~same]
    if wp.sum() == 0 or wn.sum() == 0:
        continue
    p, n = d[person & same], d[person & ~same]
    wins = (p[:, None] < n[None]) + 0.5 * (p[:, None] == n[None])
    areas.append((wp[:, None] * wn[None] * wins).sum() / wp.sum() / wn.sum())
out['auc_interval'] = [float(v) for v in np.percentile(areas, [2.5, 97.5])]

# Market-1501 protocol, every person image a query against all images.
rank, ap, ap_trapezoid = [], [], []
for q in np.where(pids > 0)[0]:
    keep = ~((pids == pids[q]) & (camids == camids[q]))
    candidates = np.where(keep)[0]
    ranked = candidates[np.argsort(dist[q][candidates], kind='stable')]
    good = pids[ranked] == pids[q]
    if not good.any():
        continue
    rank.append(int(np.argmax(good)))
    hits = np.where(good)[0]
    ap.append(np.mean([(k + 1) / (r + 1) for k, r in enumerate(hits)]))
    # the published evaluation code: trapezoids over recall, precision 1 before the first result
    area, old_recall, old_precision, found = 0.0, 0.0, 1.0, 0
    for r, g in enumerate(good):
        found += g
        recall, precision = found / good.sum(), found / (r + 1)
        area += (recall - old_recall) * (old_precision + precision) / 2
        old_recall, old_precision = recall, precision
    ap_trapezoid.append(area)
rank = np.array(rank)
out['reid'] = dict(queries=len(rank), without=int((pids > 0).sum() - len(rank)), rank1=float((rank < 1).mean()),
                   rank5=float((rank < 5).mean()), rank10=float((rank < 10).mean()), map=float(np.mean(ap)),
                   map_trapezoid=float(np.mean(ap_trapezoid)))
json.dump(out, sys.stdout)
print()
