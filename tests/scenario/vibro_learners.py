#!/usr/bin/env python3
"""Compares the learners of classifier/vibro with scikit-learn's: the same accuracy over 30 splits.

    vibro_learners.py TOOL FEATURES_TOOL SHARED_DIR [--full]     exit 77 (skipped) without scikit-learn or the reference

SMMRPFFT (mean over channels) of 1 s windows of the reference's SYNTHETIC recordings, three principal components, 80 % of each class trains, as in the
paper. The mean difference of accuracy over the 30 splits must be within one standard error of scikit-learn's mean. Without --full the costly learners
have fewer trees and fewer splits, and MLP2 is left out. With --full all are complete: 13 minutes. XGBoost is compared if python3-xgboost is
installed.
"""
import pathlib
import subprocess
import sys
import tempfile

from vibro_data import need_sound_reference, splits, synthetic

SPLITS, PER_CLASS, FIVE = 30, 40, [0, 1, 2, 3, 8]


def features(tool, shared):
    """[windows x 9] and the classes: the five features, mean over S, X, Y, Z, then the four FFT."""
    import numpy as np
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        channels = list(synthetic(shared, folder))
    classes = len(channels) // 4
    cut, label = [], []
    for k in range(classes):
        for start in rng.choice(20 * 200 - 200, PER_CLASS, replace=False) / 200:
            label.append(k)
            for _, rate, samples in channels[4 * k:4 * k + 4]:
                first = int(round(start * rate))
                cut.append((rate, samples[first:first + int(rate)]))
    sent = b"".join(np.uint64(len(s)).tobytes() + np.float64(rate).tobytes() + s.tobytes() for rate, s in cut)
    out = subprocess.run([tool], input=sent, check=True, capture_output=True).stdout.decode()
    figures = np.array([[float(v) for v in line.split(",")] for line in out.splitlines()]).reshape(-1, 4, 11)
    return np.hstack([figures[:, :, FIVE].mean(1), figures[:, :, 10]]), np.array(label, np.uint64)


def ours(tool, method, trees, x, y, chosen):
    import numpy as np
    sent = np.array([*x.shape, len(set(y))], np.uint64).tobytes() + x.tobytes() + y.tobytes() + chosen.tobytes()
    ran = subprocess.run([tool, method, str(trees), str(len(chosen)), "3"], input=sent, capture_output=True)
    if ran.returncode == 77:
        return None
    assert ran.returncode == 0, ran.stderr.decode()
    return np.array([float(line) for line in ran.stdout.split()])


def theirs(make, x, y, chosen):
    import numpy as np
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    out = []
    for seed, trains in enumerate(chosen.astype(bool)):
        model = make_pipeline(StandardScaler(), PCA(3), make(seed)).fit(x[trains], y[trains])
        out.append((model.predict(x[~trains]) == y[~trains]).mean())
    return np.array(out)


def peers(full):
    """(name, trees of ours, splits, maker)"""
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.naive_bayes import GaussianNB
    from sklearn.neighbors import KNeighborsClassifier
    from sklearn.neural_network import MLPClassifier
    from sklearn.svm import SVC
    from sklearn.tree import DecisionTreeClassifier
    trees = 1000 if full else 50
    yield "NB", trees, SPLITS, lambda seed: GaussianNB()
    yield "kNN", trees, SPLITS, lambda seed: KNeighborsClassifier()
    yield "Tree", trees, SPLITS, lambda seed: DecisionTreeClassifier(random_state=seed)
    yield "RForest", trees, SPLITS, lambda seed: RandomForestClassifier(trees, random_state=seed)
    yield "SVM", trees, SPLITS, lambda seed: SVC()
    yield "LG", trees, SPLITS, lambda seed: LogisticRegression(max_iter=1000)
    yield "NN", trees, SPLITS if full else 6, lambda seed: MLPClassifier(max_iter=1000, random_state=seed)
    if full:
        yield "MLP2", trees, SPLITS, lambda seed: MLPClassifier((100, 100), max_iter=1000, random_state=seed)
    try:
        from xgboost import XGBClassifier, XGBRFClassifier
    except ImportError:
        print("no python3-xgboost: XGB and XGBRF are not compared")
        return
    yield "XGB", trees, SPLITS if full else 6, lambda seed: XGBClassifier(n_jobs=1, random_state=seed)
    yield "XGBRF", trees, SPLITS if full else 6, lambda seed: XGBRFClassifier(n_jobs=1, random_state=seed)


def main():
    tool, features_tool, shared = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    need_sound_reference(shared)
    import warnings

    import numpy as np
    warnings.filterwarnings("ignore")
    x, y = features(features_tool, shared)
    chosen = splits(y, SPLITS)
    failed = []
    for name, trees, count, make in peers("--full" in sys.argv):
        a = ours(tool, name, trees, x, y, chosen[:count])
        if a is None:
            print(f"{name}: this build has no library for it")
            continue
        b = theirs(make, x, y.astype(int), chosen[:count])
        error = b.std(ddof=1) / np.sqrt(count)
        agrees = abs((a - b).mean()) <= error
        print(f"{name}: ours {a.mean():.4f}, scikit-learn {b.mean():.4f}, standard error {error:.4f} over {count} splits, "
              f"{int((a == b).sum())} equal{'' if agrees else ': DIFFERENT'}")
        if not agrees:
            failed.append(name)
    assert not failed, failed


main()
