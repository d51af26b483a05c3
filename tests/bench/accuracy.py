#!/usr/bin/env python3
"""Compares the accuracy of weft's and scikit-learn's learners on real recordings, with the same features and splits, in one run.

    accuracy.py WEFT [SHARED] [CASE ...]      prints a table, writes out/bench/accuracy.json

Data: fabricslide (7 fabrics), whole strokes and windows of 2.8 s; icub20 (20 materials), with its steps in the order of time and as filed (`weft
dataset import --order`). scikit-learn: one-vs-one SVC on all features with weft's C x gamma grid by five folds that keep recordings together (groups
if a group is left out), LDA with automatic shrinkage, random forest of 300 trees. weft makes no choice on test trials: its figure is that of `best`,
chosen by cross-validation on the training part. scikit-learn's figure is its best on the test part, which favours it.
"""
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import numpy
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.model_selection import GridSearchCV, GroupKFold, StratifiedGroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

HERE = pathlib.Path(__file__).resolve().parent
REPETITION = ["--train-groups", "0", "--test-groups", "1"]
FOLDS = ["--train-groups", "0,1,2", "--test-groups", "3"]
LEFT_OUT = ["--leave-one-group-out", "--fold-unit", "group"]
RMS = ["--norm", "rms"]
WINDOW = ["--window-s", "2.8"]
SLOW = "*V*10mmps_*"

# name: data set, split, options of the features, aim
CASES = {
    "strokes": ("repetition", REPETITION, RMS, 0.99),
    "strokes-10mm/s": ("slow", REPETITION, RMS, 0.99),
    "windows": ("repetition", REPETITION, RMS + WINDOW, 0.95),
    "windows-10mm/s": ("slow", REPETITION, RMS + WINDOW, 0.95),
    "pressure-out": ("pressure", LEFT_OUT, RMS, 0.87),
    "speed-out": ("speed", LEFT_OUT, RMS, 0.96),
    "icub20-time": ("icub20-time", FOLDS, [], 0.96),
    "icub20-filed": ("icub20-filed", FOLDS, [], 0.96),
    "strokes-no-level": ("repetition", REPETITION, RMS + ["--remove-level", "motion"], 0),
    "windows-no-level": ("repetition", REPETITION, RMS + WINDOW + ["--remove-level", "motion"], 0),
    "windows-10mm/s-no-level": ("slow", REPETITION, RMS + WINDOW + ["--remove-level", "motion"], 0),
    "pressure-out-no-level": ("pressure", LEFT_OUT, RMS + ["--remove-level", "motion"], 0),
    "strokes-10mm/s-no-level": ("slow", REPETITION, RMS + ["--remove-level", "motion"], 0),
    "speed-out-no-level": ("speed", LEFT_OUT, RMS + ["--remove-level", "motion"], 0),
}


def run(weft, *arguments):
    ran = subprocess.run([weft, *map(str, arguments), "--json"], capture_output=True, text=True)
    if ran.returncode != 0:
        sys.exit(f"weft {' '.join(map(str, arguments))}: {ran.stderr}")
    return json.loads(ran.stdout)


def import_data(weft, data, kind, d):
    out = d / f"{kind}.h5"
    if out.exists():
        return out
    if kind.startswith("icub20"):
        order = kind.removeprefix("icub20-")
        run(weft, "dataset", "import", "--format", "icub20", data / "icub20/icub20.csv", "-o", out, "--order", order)
    else:
        group, files = ("repetition", SLOW) if kind == "slow" else (kind, "*")
        run(weft, "dataset", "import", "--format", "fabricslide", data / "fabricslide", "-o", out, "--group", group,
            "--filter", files)
    return out


def read_features(path):
    with open(path, newline="") as f:
        rows = list(csv.reader(f))[1:]
    names = numpy.array([r[:3] for r in rows])
    return names[:, 0], names[:, 1], names[:, 2], numpy.array([[float(v) for v in r[3:]] for r in rows])


def splits_of(groups, split):
    if split == LEFT_OUT:
        return [(groups != g, groups == g) for g in sorted(set(groups))]
    return [(numpy.isin(groups, split[1].split(",")), numpy.isin(groups, split[3].split(",")))]


def grid_svc(unit, by_group):
    grid = {"svc__C": [2.0**k for k in range(-1, 12, 2)], "svc__gamma": [2.0**k for k in range(-11, 2, 2)]}
    pipe = make_pipeline(StandardScaler(), SVC(decision_function_shape="ovo"))
    kinds = len(set(unit))
    folds = GroupKFold(min(5, kinds)) if by_group else StratifiedGroupKFold(5, shuffle=True, random_state=1)
    return GridSearchCV(pipe, grid, cv=folds, n_jobs=2)


def sklearn_models(by_group):
    return {
        "SVC": lambda unit: grid_svc(unit, by_group),
        "LDA": lambda unit: make_pipeline(StandardScaler(), LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")),
        "forest": lambda unit: RandomForestClassifier(300, random_state=1, n_jobs=2),
    }


def sklearn_scores(features, split):
    files, labels, groups, values = features
    by_group = split == LEFT_OUT
    unit = groups if by_group else numpy.array([re.sub(r"#w\d+$", "", f) for f in files])
    out = {}
    for name, model in sklearn_models(by_group).items():
        right = tested = 0
        began = time.perf_counter()
        for train, test in splits_of(groups, split):
            made = model(unit[train])
            fold_units = {"groups": unit[train]} if name == "SVC" else {}
            right += int((made.fit(values[train], labels[train], **fold_units).predict(values[test]) == labels[test]).sum())
            tested += int(test.sum())
        out[name] = {"accuracy": right / tested, "seconds": time.perf_counter() - began}
    return out


def one_case(weft, data, d, name):
    kind, split, options, aim = CASES[name]
    h5 = import_data(weft, data, kind, d)
    table = d / "features.csv"
    run(weft, "features", h5, "-o", table, *options)
    theirs = sklearn_scores(read_features(table), split)
    began = time.perf_counter()
    found = run(weft, "evaluate", h5, *split, *options)["results"]
    ours = {k: {"accuracy": r["pooled_accuracy"], "mean_of_splits": r["accuracy"], "train_s": r["train_s"]}
            for k, r in found.items()}
    return {"case": name, "aim": aim, "ours": ours, "sklearn": theirs, "chosen": found["best"]["chosen"],
            "candidates": found["best"]["candidates"], "weft_s": time.perf_counter() - began}


def mean_text(result):
    """The mean over the left-out groups, each with the same weight. The pooled share would weigh them by their trials."""
    left_out = CASES[result["case"]][1] == LEFT_OUT
    return f"mean over groups {result['ours']['best']['mean_of_splits']:.4f}" if left_out else ""


def figure_of(result):
    peer = max(result["sklearn"], key=lambda k: result["sklearn"][k]["accuracy"])
    value, peer_value = result["ours"]["best"]["accuracy"], result["sklearn"][peer]["accuracy"]
    everything = ", ".join(f"{k} {r['accuracy']:.4f}" for k, r in sorted(result["ours"].items()))
    sklearn = ", ".join(f"{k} {r['accuracy']:.4f}" for k, r in result["sklearn"].items())
    aim = f"aim {result['aim']}; " if result["aim"] else ""
    if not result["case"].startswith("icub20"):
        aim += "label and mounting confounded" + ("; " if result["case"].endswith("-no-level") else ", see the row without level; ")
    mean = mean_text(result)
    aim += f"{mean}; " if mean else ""
    return {"figure": f"{result['case']}: best, share of all test trials", "value": value, "unit": "accuracy",
            "peer": f"scikit-learn {peer}, best on test", "peer_value": peer_value, "ratio": value / peer_value,
            "note": f"{aim}weft {everything}; scikit-learn {sklearn}"}


def machine():
    with open("/proc/cpuinfo") as f:
        models = [line.split(":", 1)[1].strip() for line in f if line.startswith("model name")]
    return {"cpu": models[0] if models else "unknown", "threads": os.cpu_count()}


def write(results):
    out = pathlib.Path("out/bench/accuracy.json")
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps({"name": "accuracy", "figures": [figure_of(r) for r in results], "cases": results,
                               "machine": machine(), "commit": os.environ.get("WEFT_COMMIT", "unknown")}, indent=2) + "\n")


def main():
    weft = str(pathlib.Path(sys.argv[1]).resolve())
    data = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else HERE.parents[2] / "shared") / "data"
    if not data.is_dir():
        sys.exit(f"no recordings in {data}")
    results = []
    print(f"{'case':26} {'aim':>5} {'ours':>7} {'sklearn best':>20}   all of ours | all of scikit-learn", flush=True)
    with tempfile.TemporaryDirectory(prefix="weft-accuracy-") as d:
        for name in sys.argv[3:] or CASES:
            results.append(one_case(weft, data, pathlib.Path(d), name))
            figure = figure_of(results[-1])
            print(f"{name:26} {CASES[name][3] or '-':>5} {figure['value']:7.4f} {figure['peer'].split()[1].rstrip(','):>12} "
                  f"{figure['peer_value']:.4f}   {figure['note']}; {results[-1]['weft_s']:.0f} s", flush=True)
            write(results)


main()
