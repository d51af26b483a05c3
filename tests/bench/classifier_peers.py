#!/usr/bin/python3
"""Times common tools: scikit-learn on pairs of fabrics, and the reference's features of a trial.

classifier_peers.py grid FEATURES.csv PAIRS    one JSON object: seconds of each pair (label first, then features)
classifier_peers.py extract TRIAL.csv ORACLE   one JSON object: seconds of each evaluation (phase first, then counts)
"""
import csv
import importlib.util
import json
import sys
import time

import numpy as np


def grid(path, wanted):
    from scipy import stats
    from sklearn.base import BaseEstimator, TransformerMixin
    from sklearn.model_selection import GridSearchCV, StratifiedKFold
    from sklearn.pipeline import Pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    class SelectByT(TransformerMixin, BaseEstimator):
        """Features with p < delta in the pooled two-sample t-test; at most `most`, at least one."""

        def __init__(self, delta=0.05, most=20):
            self.delta = delta
            self.most = most

        def fit(self, x, y):
            a, b = x[y > 0], x[y <= 0]
            n = len(a) + len(b)
            pooled = (((a - a.mean(0)) ** 2).sum(0) + ((b - b.mean(0)) ** 2).sum(0)) / (n - 2)
            error = np.sqrt(pooled * (1 / len(a) + 1 / len(b)))
            t = np.divide(a.mean(0) - b.mean(0), error, out=np.zeros(x.shape[1]), where=error > 0)
            order = np.argsort(-np.abs(t), kind="stable")
            count = int((2 * stats.t.sf(np.abs(t), n - 2) < self.delta).sum())
            self.columns_ = order[:max(1, min(self.most, count))]
            return self

        def transform(self, x):
            return x[:, self.columns_]

    with open(path, encoding="utf-8") as f:
        rows = list(csv.reader(f))
    label = np.array([r[0] for r in rows])
    x = np.array([[float(v) for v in r[1:]] for r in rows])
    names = sorted(set(label))
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1:]]
    points = {"select__delta": [1e-5, 1e-4, 1e-3, 1e-2, 5e-2], "svc__C": [2.0**k for k in range(-1, 12, 2)],
              "svc__gamma": [2.0**k for k in range(-11, 2, 2)]}
    seconds = []
    for a, b in pairs[::max(1, len(pairs) // wanted)][:wanted]:
        rows_of_pair = (label == a) | (label == b)
        y = np.where(label[rows_of_pair] == a, 1, -1)
        search = GridSearchCV(Pipeline([("select", SelectByT()), ("scale", StandardScaler()), ("svc", SVC())]),
                              points, cv=StratifiedKFold(5, shuffle=True, random_state=1))
        start = time.perf_counter()
        search.fit(x[rows_of_pair], y)
        seconds.append(time.perf_counter() - start)
    return {"seconds": seconds, "pairs": len(pairs)}


def extract(path, oracle):
    spec = importlib.util.spec_from_file_location("oracle", oracle)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with open(path, encoding="utf-8") as f:
        rows = list(csv.reader(f))
    phase = np.array([r[0].encode() for r in rows])
    counts = np.array([[float(v) for v in r[1:]] for r in rows])
    seconds = []
    for _ in range(12):
        start = time.perf_counter()
        module.extract(counts, phase)
        seconds.append(time.perf_counter() - start)
    return {"seconds": seconds[1:]}


if __name__ == "__main__":
    kind, path, last = sys.argv[1:4]
    json.dump(grid(path, int(last)) if kind == "grid" else extract(path, last), sys.stdout)
