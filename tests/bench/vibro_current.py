#!/usr/bin/env python3
"""Compares the ten learners of sound and vibration with the current scikit-learn and XGBoost of PyPI: accuracy, answers and times in one run.

    vibro_current.py LEARNERS FIGURES SHARED    run by `script/bench vibro_current` in the virtual environment with the peers

LEARNERS and FIGURES are the tools vibro_learners and vibro_agreement. Rows are MADE UP (twelve classes, nine features), and REAL if SHARED has
vibtac12 (X, Y, Z, windows of 2 s at random, the paper's protocol, which leaks). Scaling and three components come before every learner on both sides.
Times are processor seconds of one thread, medians over the splits; the two sides alternate. `same` is the share of test rows with the same answer;
beside it is the share for two seeds of the peer.
"""
import json
import os
import pathlib
import subprocess
import sys
import time
import warnings

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scenario"))
from vibro_data import splits  # noqa: E402

SPLITS, TREES, SINGLE = 10, 1000, 31


def made_up():
    rng = np.random.default_rng(1)
    label = np.repeat(np.arange(12), 100)
    return rng.normal(size=(12, 9))[label] + 0.7 * rng.normal(size=(1200, 9)), label


def recorded(tool, data):
    """Five features, means over the axes, and FFT of each axis; 100 windows of each texture."""
    from vibro_agreement import ours
    rng = np.random.default_rng(1)
    axes = [np.loadtxt(data / f"vibtac12/{axis}.csv", delimiter=",") for axis in "XYZ"]
    cut, label = [], []
    for k in range(12):
        for first in rng.choice(axes[0].shape[1] - 400, 100, replace=False):
            label.append(k)
            cut += [("", 200.0, np.ascontiguousarray(axis[k, first:first + 400])) for axis in axes]
    figures = ours(tool, cut).reshape(-1, 3, 11)
    return np.hstack([figures[:, :, [0, 1, 2, 3, 8]].mean(1), figures[:, :, 10]]), np.array(label)


def ours_on(tool, name, x, y, trains):
    """Accuracy, seconds of training and of an answer, answers; None if the build has no library for the learner."""
    rows = np.array([*x.shape, len(set(y))], np.uint64).tobytes() + x.tobytes() + y.astype(np.uint64).tobytes()
    ran = subprocess.run([tool, name, str(TREES), "1", "3", "timed"], input=rows + trains.tobytes(), capture_output=True)
    if ran.returncode == 77:
        return None
    assert ran.returncode == 0, ran.stderr.decode()
    accuracy, train_s, answer_s, *answers = ran.stdout.split()
    return float(accuracy), float(train_s), float(answer_s), np.array(answers, int)


def theirs_on(make, x, y, trains, seed):
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    train, test = trains > 0, trains == 0
    model = make_pipeline(StandardScaler(), PCA(3), make(seed))
    begun = time.process_time()
    model.fit(x[train], y[train])
    train_s = time.process_time() - begun
    begun = time.process_time()
    answers = model.predict(x[test])
    batch_s = (time.process_time() - begun) / test.sum()
    single_s = []
    for row in x[test][:SINGLE]:
        begun = time.process_time()
        model.predict(row[None])
        single_s.append(time.process_time() - begun)
    return (answers == y[test]).mean(), train_s, float(np.median(single_s)), answers, batch_s


def peers():
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.naive_bayes import GaussianNB
    from sklearn.neighbors import KNeighborsClassifier
    from sklearn.neural_network import MLPClassifier
    from sklearn.svm import SVC
    from sklearn.tree import DecisionTreeClassifier
    from xgboost import XGBClassifier, XGBRFClassifier
    return {"NB": lambda seed: GaussianNB(), "kNN": lambda seed: KNeighborsClassifier(),
            "Tree": lambda seed: DecisionTreeClassifier(random_state=seed),
            "RForest": lambda seed: RandomForestClassifier(TREES, random_state=seed), "SVM": lambda seed: SVC(),
            "LG": lambda seed: LogisticRegression(max_iter=1000), "NN": lambda seed: MLPClassifier(max_iter=1000, random_state=seed),
            "MLP2": lambda seed: MLPClassifier((100, 100), max_iter=1000, random_state=seed),
            "XGB": lambda seed: XGBClassifier(n_jobs=1, random_state=seed), "XGBRF": lambda seed: XGBRFClassifier(n_jobs=1, random_state=seed)}


def compare(tool, name, make, x, y, chosen):
    own, peer, again = [], [], []
    for seed, trains in enumerate(chosen):
        one = ours_on(tool, name, x, y, trains)
        if one is None:
            return None
        own.append(one)
        peer.append(theirs_on(make, x, y, trains, seed))
        if seed < 3:
            again.append((theirs_on(make, x, y, trains, seed + 1000)[3] == peer[-1][3]).mean())
    def column(rows, k):
        return np.array([row[k] for row in rows])
    accuracy = column(peer, 0)
    return {"accuracy": float(column(own, 0).mean()), "peer_accuracy": float(accuracy.mean()),
            "standard_error": float(accuracy.std(ddof=1) / np.sqrt(SPLITS)),
            "same": float(np.mean([(a[3] == b[3]).mean() for a, b in zip(own, peer)])), "peer_same": float(np.mean(again)),
            "train_ratio": float(np.median(column(peer, 1)) / np.median(column(own, 1))),
            "answer_ratio": float(np.median(column(peer, 2)) / np.median(column(own, 2))),
            "batch_ratio": float(np.median(column(peer, 4)) / np.median(column(own, 2)))}


def main():
    warnings.filterwarnings("ignore")
    import sklearn
    import xgboost
    tool, figures, data = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]) / "data"
    sets = {"MADE UP": made_up()}
    if (data / "vibtac12").is_dir():
        sets["REAL vibtac12, random windows"] = recorded(figures, data)
    out = {"versions": {"scikit-learn": sklearn.__version__, "xgboost": xgboost.__version__, "numpy": np.__version__}, "splits": SPLITS, "sets": {}}
    print(", ".join(f"{name} {version}" for name, version in out["versions"].items()) + f"; {SPLITS} splits, load {os.getloadavg()[0]:.1f}")
    for title, (x, y) in sets.items():
        print(f"{title}: {len(x)} rows. Times: how many times as long the peer takes")
        print("  learner   ours    peer    se      same   peer's  training  an answer  in a batch")
        out["sets"][title] = {}
        for name, make in peers().items():
            got = compare(tool, name, make, x, y, splits(y, SPLITS))
            if got is None:
                print(f"  {name:8} left out: this build has no library for it")
                continue
            out["sets"][title][name] = got
            print(f"  {name:8} {got['accuracy']:.4f}  {got['peer_accuracy']:.4f}  {got['standard_error']:.4f}  {got['same']:.3f}  {got['peer_same']:.3f}"
                  f"   {got['train_ratio']:7.2f}   {got['answer_ratio']:8.1f}   {got['batch_ratio']:8.2f}", flush=True)
    path = pathlib.Path("out/bench/vibro_current.json")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(out, indent=2) + "\n")


main()
