#!/usr/bin/env python3
"""Compares imprints with the Python reference static002.py: ten features a scale, perceptron, four experiments.

    imprint_oracle.py TOOL SHARED_DIR [all]      exit 77 (skipped) without the reference

The reference's synthetic imprints (three seeds) with both forms of noise and of orientation, then every fourth imprint of tactile22 (with `all`:
every one). All figures agree to 1e-9 relative. The spread of orientations is compared by its square: the reference computes it from 1 - R, so small
spreads are accurate only to the root of the rounding error.
If two neighbours differ only by rounding, an extremum or a ridge depends on the order of a sum. An image and scale with different counts must have
such a tie, to 1e-12 of its largest value, for each taxel that differs; these are counted.

The perceptron's experiments (convergence, longest training, right answers, wrong rows) equal the reference's, on raw and on z-scored features. The
linear separability of all imprints is compared with a linear program (scipy's HiGHS).
"""
import os
import pathlib
import subprocess
import sys
import tempfile

from oracle_agreement_data import PYTHON, skip

SIGMAS = (0, 1, 2, 3, 4)


def ours(tool, images, noise, orientation):
    import numpy as np
    text = "\n".join(f"{h} {w} " + " ".join(map(repr, image.ravel().tolist())) for image in images for h, w in [image.shape])
    out = subprocess.run([tool, "features", ",".join(map(str, SIGMAS)), noise, orientation], input=text, check=True,
                         capture_output=True, text=True).stdout
    return np.array(out.split(), float).reshape(len(images), len(SIGMAS), 10)


def tied(oracle, image, sigma):
    """Whether the reference's own decisions on this image depend on rounding: extrema, ridges or thresholds."""
    import numpy as np
    z = oracle.smooth(image, sigma)
    slack = 1e-12 * max(1.0, np.abs(z).max())
    nb = np.stack([np.roll(np.roll(z, a, 0), b, 1) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b])[:, 1:-1, 1:-1]
    c = z[1:-1, 1:-1]
    for sign in (1, -1):
        least = (sign * (nb - c[None])).min(0)
        if (np.abs(least) <= slack).any():
            return True
    gx, gy = oracle.gradient(z)
    m = np.hypot(gx, gy)
    noise = oracle.noise_estimate(z, sigma)
    return any((oracle.nms(gx, gy, m + e) != oracle.nms(gx, gy, m)).any() for e in
               np.random.default_rng(1).uniform(-slack, slack, (4,) + m.shape)) or \
        (np.abs(m - 1.2 * noise) <= slack).any() or (np.abs(m - 1.8 * noise) <= slack).any()


def compare(oracle, tool, what, images, noise="gradient", orientation="circular"):
    import numpy as np
    got = ours(tool, images, noise, orientation)
    worst, ties = 0.0, 0
    for image, scales in zip(images, got):
        for sigma, a in zip(SIGMAS, scales):
            b, _ = oracle.features(image, sigma, noise == "literal", orientation)
            if (a[[0, 4, 7]] != b[[0, 4, 7]]).any():
                assert tied(oracle, image, sigma), f"{what}, sigma {sigma}: {a} against {b}"
                ties += 1
                continue
            if orientation == "circular":
                assert abs(a[3] ** 2 - b[3] ** 2) <= 1e-12 + 1e-9 * b[3] ** 2, f"{what}, sigma {sigma}: orientation {a[3]} against {b[3]}"
                a[3] = b[3]
            scale = np.maximum(np.maximum(np.abs(a), np.abs(b)), 1e-300)
            relative = np.abs(a - b) / scale
            assert relative.max() <= 1e-9, f"{what}, sigma {sigma}: {a} against {b}"
            worst = max(worst, relative.max())
    print(f"{what}, {noise} noise, {orientation}: {len(images)} imprints x {len(SIGMAS)} scales x 10, "
          f"largest relative difference {worst:.1e}, {ties} left out for ties that hang on rounding")
    assert ties <= 0.02 * len(images) * len(SIGMAS), "too many ties for an agreement"


def lp_separable(X, y):
    """Whether a linear program finds weights with w_own x - w_other x >= 1 for all."""
    import numpy as np
    from scipy.optimize import linprog
    X = np.c_[(X - X.mean(0)) / np.where(X.std(0) > 0, X.std(0), 1), np.ones(len(X))]
    n, d, rows = int(y.max()) + 1, X.shape[1], []
    for x, c in zip(X, y):
        for j in range(n):
            if j != c:
                row = np.zeros(n * d)
                row[c * d:(c + 1) * d], row[j * d:(j + 1) * d] = -x, x
                rows.append(row)
    return linprog(np.zeros(n * d), A_ub=np.array(rows), b_ub=-np.ones(len(rows)), bounds=(None, None), method="highs").status == 0


def compare_experiments(oracle, tool, what, images, cls, obj, force):
    import numpy as np
    by = {s: np.stack([oracle.features(i, s)[0] for i in images]) for s in SIGMAS}
    text = "\n".join(f"{c} {o} {i.shape[0]} {i.shape[1]} " + " ".join(map(repr, i.ravel().tolist())) for c, o, i in zip(cls, obj, images))
    separable = converged = compared = 0
    for rule, scaling in (("perceptron", "none"), ("perceptron-zscore", "zscore")):
        for scales in ((0,), (1,), (2,), (3,), (1, 2), (1, 3), (1, 2, 4)):
            out = subprocess.run([tool, "experiments", ",".join(map(str, scales)), rule], input=text, check=True, capture_output=True,
                                 text=True).stdout
            for form, verdict, name, ok, rounds, correct, *wrong in (line.split(",") for line in out.splitlines()):
                F = np.hstack([by[s][:, list(range(10)) if form == "10" else oracle.SHORT] for s in scales])
                want = oracle.experiment(F, cls, oracle.rounds(name, cls, obj, force), scaling)
                where = f"{what}, {rule}, {scales}, {form}, {name}"
                assert (ok == "1") == want["converged"], f"{where}: {ok} against {want}"
                if want["converged"]:
                    assert [int(rounds), int(correct)] == [want["passes"], want["correct"]], f"{where}: {rounds}, {correct} against {want}"
                    assert sorted(map(int, wrong)) == sorted(want["wrong"]), f"{where}: {wrong} against {want}"
                    converged += 1
                compared += 1
                if name == "1/N" and scaling == "none":
                    assert verdict in ("separable", "not separable"), f"{where}: {verdict}"
                    assert (verdict == "separable") == lp_separable(F, cls), f"{where}: {verdict}, another answer from the linear program"
                    separable += verdict == "separable"
    print(f"{what}: {compared} experiments the same, {converged} of them converged; {separable} of 14 feature sets linearly separable, as "
          f"the linear program finds")


def main():
    tool, shared = sys.argv[1], pathlib.Path(sys.argv[2])
    if not (shared / "oracle/static002.py").exists():
        skip("no reference in " + str(shared))
    if not os.path.exists(PYTHON) or subprocess.run([PYTHON, "-c", "import numpy, scipy"], capture_output=True).returncode:
        skip("no numpy and scipy for " + PYTHON)
    if os.path.realpath(sys.executable) != os.path.realpath(PYTHON):
        os.execv(PYTHON, [PYTHON] + sys.argv)
    sys.path.insert(0, str(shared / "oracle"))
    import gen_synth
    import numpy as np
    import static002 as oracle
    with tempfile.TemporaryDirectory() as folder:
        for seed in (5, 6, 7):
            gen_synth.static(folder + "/static.npz", seed)
            data = np.load(folder + "/static.npz")
            images = data["img"].astype(float)
            for noise in ("gradient", "literal"):
                for orientation in ("circular", "linear"):
                    if seed == 5 or (noise, orientation) == ("gradient", "circular"):
                        compare(oracle, tool, f"synthetic imprints, seed {seed}", images, noise, orientation)
            compare_experiments(oracle, tool, f"synthetic imprints, seed {seed}", images, data["cls"], data["obj"], data["force"])
    table = shared / "data/tactile22/tactile22.csv"
    if not table.exists():
        skip(f"{table} is not there; the synthetic imprints agreed")
    rows = np.loadtxt(table, delimiter=",", comments="#")
    rows = rows if len(sys.argv) > 3 else rows[::4]
    compare(oracle, tool, "tactile22", rows[:, 2:].reshape(-1, 28, 50))


main()
