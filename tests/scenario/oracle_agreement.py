#!/usr/bin/env python3
"""Features, t, p and selected subsets on real strokes: ours against the Python reference.

    oracle_agreement.py TOOL SHARED_DIR       exit 77 (skipped) where the reference or the data are absent

42 fabricslide strokes of different length, the reference run as a program on the same files.
Exceptions to 1e-9 relative: a skewness or fifth moment that cancels is compared at the scale of its terms.
"""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

PYTHON = "/usr/bin/python3"
HERE = pathlib.Path(__file__).parent


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def rows_of(path):
    with open(path) as f:
        return list(csv.reader(f))


def choose_strokes(folder, source):
    """The first six strokes of every fabric at 50 and 150 mm/s, both repetitions."""
    subprocess.run([PYTHON, HERE / "real_data.py", "fabricslide", source, folder, "*V*50mmps_*.csv"], check=True)
    index = folder / "index.csv"
    head, *rows = rows_of(index)
    chosen = [[r for r in rows if r[1] == fabric][:6] for fabric in sorted({r[1] for r in rows})]
    with open(index, "w", newline="") as f:
        csv.writer(f).writerows([head] + sum(chosen, []))
    return index


def tolerance(name, row, names):
    """Absolute slack for figures that are small differences of large terms."""
    block, _, taxel = name.partition(".M.")
    if block == "skew":
        return 1e-11
    if block == "m5":
        return 1e-11 * abs(row[names.index(f"var.M.{taxel}")]) ** 2.5
    return 0.0


def compare_features(ours, theirs):
    names, worst, exceptions = ours[0][1:], 0.0, 0
    assert names == theirs[0][1:], "feature names differ"
    assert len(ours) == len(theirs)
    for a, b in zip(ours[1:], theirs[1:]):
        a, b = [float(v) for v in a[1:]], [float(v) for v in b[1:]]
        for k, name in enumerate(names):
            scale = max(abs(a[k]), abs(b[k]))
            difference = abs(a[k] - b[k])
            relative = difference / scale if scale else 0.0
            if relative > 1e-9:
                assert difference <= tolerance(name, b, names), f"{name}: {a[k]} against {b[k]}"
                exceptions += 1
            else:
                worst = max(worst, relative)
    print(f"features: {len(ours) - 1} strokes x {len(names)}, largest relative difference {worst:.1e}, "
          f"{exceptions} cancelling figures compared at the scale of their terms")


def compare_pairs(oracle, ours, theirs):
    import numpy as np
    label = np.array([int(float(r[0])) for r in theirs[1:]])
    F = np.array([[float(v) for v in r[1:]] for r in theirs[1:]])
    names = sorted({r[0] for r in ours} | {r[1] for r in ours})
    worst, subsets = {"t": 0.0, "p": 0.0}, 0
    for a, b, what, *values in ours:
        X, Y = F[label == names.index(a)], F[label == names.index(b)]
        df = len(X) + len(Y) - 2
        t = oracle.t_statistic(X, Y)
        if what in worst:
            want = t if what == "t" else oracle.p_values(t, df)
            for v, w in zip(map(float, values), want):
                if not math.isclose(v, w, rel_tol=1e-9, abs_tol=1e-9 if what == "t" else 0):
                    raise AssertionError(f"{a} {b} {what}: {v} against {w}")
                worst[what] = max(worst[what], abs(v - w) / max(abs(v), abs(w), 1e-300))
        else:
            want = [int(k) for k in oracle.select(t, df, float(what), oracle.DEFAULT["cap"])]
            assert want == [int(v) for v in values], f"{a} {b} delta {what}: {values} against {want}"
            subsets += 1
    print(f"t and p: largest relative difference {worst['t']:.1e} and {worst['p']:.1e}; {subsets} subsets equal")


def main():
    tool, shared = sys.argv[1], pathlib.Path(sys.argv[2])
    source = shared / "data/fabricslide"
    if not (shared / "oracle/fabric000.py").exists() or not source.exists():
        skip("no reference or no recordings in " + str(shared))
    if not os.path.exists(PYTHON) or subprocess.run([PYTHON, "-c", "import sklearn, scipy"], capture_output=True).returncode:
        skip("no scikit-learn for " + PYTHON)
    if os.path.realpath(sys.executable) != os.path.realpath(PYTHON):
        os.execv(PYTHON, [PYTHON] + sys.argv)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        index = choose_strokes(folder, source)
        run = subprocess.run([PYTHON, shared / "oracle/fabric000.py", "--csv", index, "--reduce", "none",
                              "--train-groups", "0", "--test-groups", "1", "--save-features", folder / "theirs.csv"],
                             check=True, capture_output=True, text=True)
        assert json.loads(run.stdout)["trials"] == 42
        theirs = rows_of(folder / "theirs.csv")
        ours = subprocess.run([tool, "features", index], check=True, capture_output=True, text=True).stdout
        compare_features(list(csv.reader(ours.splitlines())), theirs)
        pairs = subprocess.run([tool, "pairs", index], check=True, capture_output=True, text=True).stdout
        sys.path.insert(0, str(shared / "oracle"))
        import fabric000
        compare_pairs(fabric000, list(csv.reader(pairs.splitlines())), theirs)


main()
