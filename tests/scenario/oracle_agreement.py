#!/usr/bin/env python3
"""Features, t, p and selected subsets on real and simulated trials: ours against the Python reference.

    oracle_agreement.py TOOL SHARED_DIR WEFT SOURCE_ROOT      exit 77 (skipped) where the reference is absent

42 fabricslide strokes of different length, and a small campaign on the simulated bench with all four phases; the
reference runs as a program on the same files.
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


def simulated_trials(weft, root, folder, exploration):
    """A campaign on the simulated bench, its HDF5 data set rewritten as the reference's CSV. Transfer rows are left out."""
    import h5py
    recipe = json.loads((root / f"recipes/library/{exploration}.json").read_text())
    recipe.update(fabrics=["satin", "denim", "velvet"], repetitions=4)
    recipe.pop("$schema", None)
    (folder / "recipe.json").write_text(json.dumps(recipe))
    subprocess.run([weft, "run", folder / "recipe.json", "--rig", root / "sim/rigs/bench17.json", "--out",
                    folder / "run", "--no-evaluate"], check=True, capture_output=True)
    index = [["file", "label", "group"]]
    with h5py.File(folder / "run/dataset.h5") as h5:
        trials, phases, counts = h5["trials"], h5["taxel/phase"][:], h5["taxel/counts"][:]
        for i, (first, samples) in enumerate(zip(trials["taxel_first"][:], trials["taxel_samples"][:])):
            name = f"{i:04d}.csv"
            rows = range(int(first), int(first + samples))
            with open(folder / name, "w", newline="") as f:
                w = csv.writer(f)
                w.writerow(["phase"] + [f"c{k + 1}" for k in range(counts.shape[1])])
                w.writerows([chr(phases[r]), *map(int, counts[r])] for r in rows if chr(phases[r]) in "SPME")
            index.append([name, trials["label"][i].decode(), str(int(trials["repetition"][i]) % 2)])
    with open(folder / "index.csv", "w", newline="") as f:
        csv.writer(f).writerows([index[0]] + sorted(index[1:], key=lambda row: row[1]))  # the reference numbers labels as met
    return folder / "index.csv"


def compare_command_line(weft, folder, theirs):
    """`weft features` on the data set itself: the same figures without the detour over CSV."""
    subprocess.run([weft, "features", folder / "run/dataset.h5", "-o", folder / "f.csv"], check=True, capture_output=True)
    ours = rows_of(folder / "f.csv")
    compare_features([["label"] + ours[0][3:]] + [r[1:2] + r[3:] for r in sorted(ours[1:], key=lambda r: r[1])], theirs)


def tolerance(name, row, names):
    """Absolute slack for figures that are small differences of large terms."""
    block, _, place = name.partition(".")
    if block == "skew":
        return 1e-11
    if block == "m5":
        return 1e-11 * abs(row[names.index(f"var.{place}")]) ** 2.5
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


def compare(tool, shared, index, folder, oracle):
    run = subprocess.run([PYTHON, shared / "oracle/fabric000.py", "--csv", index, "--reduce", "none",
                          "--train-groups", "0", "--test-groups", "1", "--save-features", folder / "theirs.csv"],
                         check=True, capture_output=True, text=True)
    trials = len(rows_of(index)) - 1
    assert json.loads(run.stdout)["trials"] == trials
    theirs = rows_of(folder / "theirs.csv")
    ours = subprocess.run([tool, "features", index], check=True, capture_output=True, text=True).stdout
    compare_features(list(csv.reader(ours.splitlines())), theirs)
    pairs = subprocess.run([tool, "pairs", index], check=True, capture_output=True, text=True).stdout
    compare_pairs(oracle, list(csv.reader(pairs.splitlines())), theirs)
    return theirs


def main():
    tool, shared, weft, root = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4])
    if not (shared / "oracle/fabric000.py").exists():
        skip("no reference in " + str(shared))
    if not os.path.exists(PYTHON) or subprocess.run([PYTHON, "-c", "import sklearn, scipy, h5py"], capture_output=True).returncode:
        skip("no scikit-learn and h5py for " + PYTHON)
    if os.path.realpath(sys.executable) != os.path.realpath(PYTHON):
        os.execv(PYTHON, [PYTHON] + sys.argv)
    sys.path.insert(0, str(shared / "oracle"))
    import fabric000
    for exploration in ("m1", "m2"):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            print(f"simulated {exploration}")
            index = simulated_trials(weft, root, folder, exploration)
            compare_command_line(weft, folder, compare(tool, shared, index, folder, fabric000))
    source = shared / "data/fabricslide"
    if not source.exists():
        skip(f"{source} is not there; the simulated trials agreed")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        print("fabricslide")
        compare(tool, shared, choose_strokes(folder, source), folder, fabric000)


main()
