#!/usr/bin/python3
"""Times common tools: the reference's features with numpy, scikit-learn and XGBoost on three components.

    vibro_peers.py SET.csv ORACLE      one JSON object: processor seconds of each, medians. SET: 1 for training or 0, class, features
"""
import json
import pathlib
import sys
import time
import warnings

import numpy as np


def median(count, work):
    work()  # warms caches
    seconds = []
    for _ in range(count):
        start = time.process_time()
        work()
        seconds.append(time.process_time() - start)
    return float(np.median(seconds))


def features(oracle, out):
    rng = np.random.default_rng(1)
    for source in ("S", "XYZ", "SXYZ"):
        for seconds in (1, 2):
            channels = [(rng.normal(size=seconds * rate), rate) for rate in (8000 if c == "S" else 200 for c in source)]

            def work():
                np.concatenate([oracle.channel_features(y, rate) for y, rate in channels])
                [oracle.fft_feature(y) for y, _ in channels]
            out[f"features {source} {seconds} s"] = median(41, work)


def learners(oracle, path, out):
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    rows = np.loadtxt(path, delimiter=",")
    trains, y, x = rows[:, 0] > 0, rows[:, 1].astype(int), rows[:, 2:]
    names = {"KNN": "kNN"}
    for name, model in oracle.classifiers().items():
        made = make_pipeline(StandardScaler(), PCA(3), model)
        if name in ("XGB", "XGBRF"):
            model.set_params(tree_method="hist")  # like ours; first, so that the answers are those of its default
            out[f"{name} fit, hist"] = median(1, lambda: made.fit(x[trains], y[trains]))
            model.set_params(tree_method=None)
        fit = median(1, lambda: made.fit(x[trains], y[trains]))
        test = x[~trains]
        out[f"{names.get(name, name)} fit"] = fit
        out[f"{names.get(name, name)} answer"] = median(31, lambda: made.predict(test[:1]))


def main():
    warnings.filterwarnings("ignore")
    out = {}
    if pathlib.Path(sys.argv[2], "sound001.py").exists():
        sys.path.insert(0, sys.argv[2])
        import sound001
        features(sound001, out)
        learners(sound001, sys.argv[1], out)
    print(json.dumps(out))


main()
