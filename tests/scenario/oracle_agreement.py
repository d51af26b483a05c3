#!/usr/bin/env python3
"""Compares features, t, p and selected subsets with the Python reference, on real and simulated trials.

    oracle_agreement.py TOOL SHARED_DIR WEFT SOURCE_ROOT      exit 77 (skipped) without the reference

All fabricslide strokes (of different length; p down to 1e-114), all icub20 slides, and small campaigns on the simulated bench with all four phases. t
and p are compared with scipy's own ttest_ind too.
Exceptions to 1e-9 relative: a skewness or fifth moment that cancels is compared at the scale of its terms. This applies to eleven of the 576 000
figures of icub20, and to none of the other sets; a share above CANCELLING of a set is a failure. If p is compared far below 1e-100, at least one must
lie there (LEAST_P).
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

from oracle_agreement_data import need_reference, real_trials, rows_of, simulated_trials, skip

CANCELLING = 5e-5  # share of a set's values
LEAST_P = {"fabricslide": 1e-100}

def compare_command_line(weft, folder, names, F):
    """`weft features` on the data set itself: the same values without the way through CSV."""
    subprocess.run([weft, "features", folder / "run/dataset.h5", "-o", folder / "f.csv"], check=True, capture_output=True)
    ours = rows_of(folder / "f.csv")
    compare_features([["label"] + ours[0][3:]] + [r[1:2] + r[3:] for r in sorted(ours[1:], key=lambda r: r[1])], names, F)


def tolerance(name, row, names):
    """Absolute tolerance for values that are small differences of large terms."""
    block, _, place = name.partition(".")
    if block == "skew":
        return 1e-11
    if block == "m5":
        return 1e-11 * abs(row[names.index(f"var.{place}")]) ** 2.5
    return 0.0


def compare_features(ours, names, F):
    worst, exceptions = 0.0, 0
    assert ours[0][1:] == names, "feature names differ"
    assert len(ours) - 1 == len(F)
    for a, b in zip(ours[1:], F):
        a = [float(v) for v in a[1:]]
        for k, name in enumerate(names):
            scale = max(abs(a[k]), abs(b[k]))
            difference = abs(a[k] - b[k])
            relative = difference / scale if scale else 0.0
            if relative > 1e-9:
                assert difference <= tolerance(name, b, names), f"{name}: {a[k]} against {b[k]}"
                exceptions += 1
            else:
                worst = max(worst, relative)
    print(f"features: {len(F)} trials x {len(names)}, largest relative difference {worst:.1e}, "
          f"{exceptions} cancelling figures compared at the scale of their terms")
    assert exceptions <= CANCELLING * len(F) * len(names), f"{exceptions} figures cancel"


class Worst:
    """Largest relative difference so far; a value above the tolerance ends the scenario."""

    def __init__(self):
        self.value = 0.0

    def add(self, got, want, absolute, what):
        import numpy as np
        difference, scale = np.abs(got - want), np.maximum(np.abs(got), np.abs(want))
        bad = ~(difference <= np.maximum(1e-9 * scale, absolute))  # also true for NaN
        assert not bad.any(), f"{what}: {got[bad]} against {want[bad]}"
        self.value = max(self.value, np.max(difference / np.maximum(scale, 1e-300), initial=0.0))


def compare_pairs(oracle, ours, names, label, F):
    import numpy as np
    worst, scipys, subsets, undefined, least_p = {"t": Worst(), "p": Worst()}, {"t": Worst(), "p": Worst()}, 0, 0, 1.0
    for a, b, what, *values in ours:
        X, Y = F[label == names.index(a)], F[label == names.index(b)]
        df = len(X) + len(Y) - 2
        t = oracle.t_statistic(X, Y)
        if what not in worst:
            want = [int(k) for k in oracle.select(t, df, float(what), oracle.DEFAULT["cap"])]
            assert want == [int(v) for v in values], f"{a} {b} delta {what}: {values} against {want}"
            subsets += 1
            continue
        got, absolute = np.array(values, float), 1e-9 if what == "t" else 0.0
        worst[what].add(got, t if what == "t" else oracle.p_values(t, df), absolute, f"{a} {b} {what}")
        with np.errstate(invalid="ignore", divide="ignore"):
            scipy_t, scipy_p = oracle.stats.ttest_ind(X, Y)
        spread = np.sqrt((X.var(0, ddof=1) * (len(X) - 1) + Y.var(0, ddof=1) * (len(Y) - 1)) / df)
        defined = spread > 1e-9 * np.maximum(np.abs(X.mean(0)), np.abs(Y.mean(0)))  # AMB-13: otherwise scipy has nan or inf
        undefined += (~defined).sum()
        scipys[what].add(got[defined], (scipy_t if what == "t" else scipy_p)[defined], absolute, f"{a} {b} {what}, scipy")
        least_p = min(least_p, least_p if what == "t" else got.min())
    print(f"t and p: largest relative difference {worst['t'].value:.1e} and {worst['p'].value:.1e} (scipy's ttest_ind: "
          f"{scipys['t'].value:.1e} and {scipys['p'].value:.1e}, {undefined // 2} columns without spread left out); "
          f"smallest p {least_p:.1e}; {subsets} subsets equal")
    return least_p


def compare(tool, index, oracle, below=1.0):
    import numpy as np
    data, phase, offset, label, labels = oracle.load_csv(index)
    F = np.stack([oracle.extract(data[s:e], phase[s:e]) for s, e in zip(offset[:-1], offset[1:])])
    names = oracle.feature_names(data.shape[1], "".join(sorted({p.decode() for p in phase})))
    ours = subprocess.run([tool, "features", index], check=True, capture_output=True, text=True).stdout
    compare_features(list(csv.reader(ours.splitlines())), names, F)
    pairs = subprocess.run([tool, "pairs", index], check=True, capture_output=True, text=True).stdout
    least_p = compare_pairs(oracle, list(csv.reader(pairs.splitlines())), labels, label, F)
    assert least_p < below, f"no p below {below}: {least_p}"
    return names, F


def main():
    tool, shared, weft, root = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4])
    fabric000 = need_reference(shared)
    for exploration in ("m1", "m2"):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            print(f"simulated {exploration}")
            index = simulated_trials(weft, root, folder, exploration)
            compare_command_line(weft, folder, *compare(tool, index, fabric000))
    for kind in ("fabricslide", "icub20"):
        if not (shared / "data" / kind).exists():
            skip(f"{shared / 'data' / kind} is not there; the simulated trials agreed")
        with tempfile.TemporaryDirectory() as folder:
            print(kind)
            compare(tool, real_trials(kind, shared / "data" / kind, pathlib.Path(folder)), fabric000, LEAST_P.get(kind, 1.0))


main()
