#!/usr/bin/env python3
"""Writes tests/golden/features/fabric.json from the Python reference (numpy, scipy, scikit-learn).

    make_fabric.py /path/to/oracle > tests/golden/features/fabric.json

The trials are not stored: synthetic_trial() below and in tests/unit/classifier/golden.cpp is the same integer recipe, so every machine can make them
and compare. Made with Debian 12's numpy 1.24.2, scipy 1.10.1, scikit-learn 1.2.1. "edge" has short explicit trials of phase M only.
"""
import itertools
import json
import sys

import numpy as np

CLASSES, REPS, TAXELS = 3, 10, 4


def synthetic_trial(cls, rep):
    drawn = 0

    def draw(n):
        # MurmurHash3's finaliser of (trial, number of the draw)
        nonlocal drawn
        h = (1000 * cls + rep) * 0x9E3779B1 + drawn * 0x85EBCA6B
        drawn += 1
        for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
            h %= 2**32
            h = (h ^ (h >> shift)) * factor
        return h % 2**32 % n

    offset = [draw(90) for _ in range(TAXELS)]
    rows, phases = [], []
    for phase, samples, level in (("S", 7, 900), ("P", 11, 1500), ("M", 97 + rep % 3, 1500), ("E", 5, 950)):
        for i in range(samples):
            row = []
            for k in range(TAXELS):
                period = 6 + cls // 2 + k
                wave = abs(2 * (i % period) - period) * (5 + cls % 2) if phase == "M" else 0
                row.append(level + 40 * k + 6 * cls + offset[k] + wave + draw(120))
            rows.append(row)
            phases.append(phase)
    return np.array(rows, float), np.array(phases, "S1")


EDGE = [
    [[5, 7, 65535]],
    [[5, 7, 65535], [6, 7, 0]],
    [[5, 7, 65535], [6, 7, 0], [5, 7, 65535]],
    [[1, 7, 0], [3, 7, 0], [3, 7, 9], [2, 7, 0], [4, 8, 1], [0, 7, 0], [1, 7, 0]],
    [[1, 3, 0], [2, 3, 0], [3, 2, 0], [2, 2, 0], [1, 1, 0], [2, 1, 60000], [3, 1, 0], [3, 1, 0], [5, 1, 0], [1, 1, 0], [2, 1, 0]],
]


def core_figures(oracle, X, y, folds, test, reduce, nested):
    cfg = dict(oracle.DEFAULT, reduce=reduce, nested=nested)
    core = oracle.Core(0, 1, cfg).train(X, y, folds)
    return dict(reduction={"none": "all"}.get(reduce, reduce), nested=nested, c=core.C, gamma=core.gamma,
                member=core.iview, cv_errors=core.cv_errors, inputs=int(core.nfeat),
                selected=[int(k) for k in core.view[1]] if core.view[0] == "sel" else [],
                decision=[float(f) for f in core.decide(test)])


def main():
    sys.path.insert(0, sys.argv[1])
    import fabric000 as oracle
    from sklearn.model_selection import StratifiedKFold

    F = np.array([oracle.extract(*synthetic_trial(c, r)) for c in range(CLASSES) for r in range(REPS)])
    train = [r for r in range(REPS) if r % 2 == 0]
    test = [r for r in range(REPS) if r % 2 == 1]
    rows = lambda c, reps: [c * REPS + r for r in reps]
    test_rows = sum((rows(c, test) for c in range(CLASSES)), [])
    pairs, models = list(itertools.combinations(range(CLASSES), 2)), {}
    out_pairs = []
    for a, b in pairs:
        X = F[rows(a, train) + rows(b, train)]
        y = np.r_[np.ones(len(train), int), -np.ones(len(train), int)]
        folds = list(StratifiedKFold(5, shuffle=True, random_state=1).split(X, y))
        t = oracle.t_statistic(X[y > 0], X[y < 0])
        cores = [core_figures(oracle, X, y, folds, F[test_rows], r, n)
                 for r in ("pvalue", "pca", "none") for n in (True, False)]
        for core in cores:
            models.setdefault((core["reduction"], core["nested"]), []).append(core["decision"])
        out_pairs.append(dict(
            a=a, b=b, t=list(t), p=list(oracle.p_values(t, len(y) - 2)),
            subsets=[[int(k) for k in oracle.select(t, len(y) - 2, d, 20)] for d in oracle.DEFAULT["deltas"]],
            folds=[[int(i) for i in validate] for _, validate in folds], cores=cores))
    votes = [dict(reduction=k[0], nested=k[1],
                  predictions=[int(oracle.vote(pairs, f, CLASSES)) for f in np.array(d).T])
             for k, d in models.items()]
    edge = [dict(counts=e, features=list(oracle.extract(np.array(e, float), np.array(["M"] * len(e), "S1"))))
            for e in EDGE]
    json.dump(dict(names=oracle.feature_names(TAXELS), features=F.tolist(), train=train, test=test,
                   pairs=out_pairs, votes=votes, edge=edge), sys.stdout, separators=(",", ":"))
    print()


main()
