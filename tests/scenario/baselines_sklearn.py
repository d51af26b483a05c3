#!/usr/bin/env python3
"""Compares the evaluator's baselines with scikit-learn on real strokes: the same answer on every test trial; for trees, as similar as two runs of
scikit-learn.

    baselines_sklearn.py WEFT SHARED     exit 77 (skipped) without the recordings or without scikit-learn

fabricslide, repetition 0 trains and 1 tests; also each pressure left out. LDA: StandardScaler and LinearDiscriminantAnalysis (lsqr,
shrinkage='auto'). SVC: with the C and gamma that our grid chose, on which libsvm must agree with itself. Ridge: RidgeClassifier with the penalty that
generalised cross-validation, by the whole hat matrix, chooses from our grid. Trees use other random numbers. So our answers must be as similar to
those of scikit-learn's ExtraTreesClassifier as its answers from two seeds are to each other, within chance.
"""
import csv
import json
import pathlib
import sys
import tempfile

from cli_support import Checks

try:
    import numpy
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.ensemble import ExtraTreesClassifier
    from sklearn.linear_model import RidgeClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)


def table(path):
    with open(path, newline="") as f:
        rows = list(csv.reader(f))[1:]
    return ([r[0] for r in rows], numpy.array([r[1] for r in rows]), numpy.array([r[2] for r in rows]),
            numpy.array([[float(v) for v in r[3:]] for r in rows]))


def evaluated(t, d, *arguments):
    ran = t.run("evaluate", *arguments, "--learner", "lda,svc,ridge,trees", "--norm", "rms", "--answers", "--json", cwd=d)
    t.expect(ran.returncode == 0, f"{arguments}: {ran.stderr}")
    return json.loads(ran.stdout)["results"]


def compare(t, what, model, trains, tests, files, labels, values, answers):
    theirs = make_pipeline(StandardScaler(), model).fit(values[trains], labels[trains]).predict(values[tests])
    ours = dict(map(tuple, answers))
    rows = [i for i, chosen in enumerate(tests) if chosen]
    different = [files[i] for i, answer in zip(rows, theirs) if ours[files[i]] != answer]
    print(f"{what}: {len(rows) - len(different)} of {len(rows)} answers alike, "
          f"accuracy {sum(ours[files[i]] == labels[i] for i in rows) / len(rows):.4f}")
    t.expect(not different and len(ours) == len(rows), f"{what}: other answers on {different}")


def compare_trees(t, what, splits, values, labels, files, answers):
    """Sums over all splits; `splits` has the test trials and `answers` our answers on them."""
    alike = themselves = tested = 0
    for tests, ours in zip(splits, map(dict, answers), strict=True):
        one, other = (ExtraTreesClassifier(1000, random_state=seed).fit(values[~tests], labels[~tests]).predict(values[tests])
                      for seed in (1, 2))
        mine = numpy.array([ours[files[i]] for i in numpy.flatnonzero(tests)])
        alike += int((mine == one).sum())
        themselves += int((other == one).sum())
        tested += len(mine)
    print(f"trees, {what}: {alike} of {tested} answers as scikit-learn's, {themselves} of its own from another seed")
    deviation = (2 * (tested - themselves + 1)) ** 0.5  # for a difference of two counts of rare events
    t.expect(alike >= themselves - 3 * deviation, f"trees, {what}: {alike} alike, {themselves} of its own")


def lda():
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


class GcvRidge(RidgeClassifier):
    def fit(self, x, y):
        targets = (y[:, None] == numpy.unique(y)).astype(float)
        targets -= targets.mean(axis=0)
        rest = numpy.eye(len(x)) - 1 / len(x)
        square = x @ x.T
        scores = []
        grid = [scale * 10.0**power for power in range(-6, 4) for scale in (1, 3)][:19]
        for each in grid:
            left = rest - square @ numpy.linalg.inv(square + each * len(x) * numpy.eye(len(x)))
            scores.append((left @ targets).ravel() @ (left @ targets).ravel() / numpy.trace(left) ** 2)
        self.alpha = len(x) * grid[int(numpy.argmin(scores))]
        return super().fit(x, y)


def strokes(t, source, d, group, arguments, split_of):
    t.succeeds("dataset", "import", "--format", "fabricslide", source, "--group", group, "-o", f"{group}.h5", cwd=d)
    t.succeeds("features", f"{group}.h5", "-o", f"{group}.csv", "--norm", "rms", cwd=d)
    files, labels, groups, values = table(pathlib.Path(d) / f"{group}.csv")
    results = evaluated(t, d, f"{group}.h5", *arguments)
    for i, left_out in enumerate(split_of):
        tests = groups == left_out
        compare(t, f"LDA, {group} {left_out} tests", lda(), ~tests, tests, files, labels, values,
                results["lda"]["answers"][i])
        compare(t, f"ridge, {group} {left_out} tests", GcvRidge(), ~tests, tests, files, labels, values,
                results["ridge"]["answers"][i])
        if i == 0:
            svc = SVC(C=results["svc"]["C"], gamma=results["svc"]["gamma"])
            compare(t, f"SVC, {group} {left_out} tests", svc, ~tests, tests, files, labels, values,
                    results["svc"]["answers"][i])
    compare_trees(t, group, [groups == left_out for left_out in split_of], values, labels, files, results["trees"]["answers"])


def main():
    t = Checks(sys.argv[1])
    source = (pathlib.Path(sys.argv[2]) / "data/fabricslide").resolve()
    if not source.is_dir():
        print(f"skipped: no {source}")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="weft-baseline-") as d:
        strokes(t, source, d, "repetition", ["--train-groups", "0", "--test-groups", "1"], ["1"])
        strokes(t, source, d, "pressure", ["--leave-one-group-out"], ["120", "150", "180", "210", "250"])
    t.finish()


main()
