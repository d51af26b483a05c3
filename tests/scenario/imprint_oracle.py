#!/usr/bin/env python3
"""The ten features a scale of static imprints: ours against the Python reference static002.py.

    imprint_oracle.py TOOL SHARED_DIR [all]      exit 77 (skipped) where the reference is absent

The reference's synthetic imprints (three seeds) with both forms of noise and of orientation, then every fourth imprint of
tactile22 (with `all`: every one). All figures agree to 1e-9 relative. The spread of orientations is compared by its square:
the reference takes it from 1 - R, which knows small spreads only to the root of rounding.
Where two neighbours are equal but for rounding, an extremum or a ridge is a matter of the order of a sum. An image and scale
whose counts differ must have such a tie, to 1e-12 of its largest value, for each taxel that differs; these are counted.
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
    """Whether the reference's own decisions on this image hang on rounding: extrema, ridges or thresholds."""
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
    assert ties <= 0.02 * len(images) * len(SIGMAS), "too many ties to say that anything agreed"


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
            images = np.load(folder + "/static.npz")["img"].astype(float)
            for noise in ("gradient", "literal"):
                for orientation in ("circular", "linear"):
                    if seed == 5 or (noise, orientation) == ("gradient", "circular"):
                        compare(oracle, tool, f"synthetic imprints, seed {seed}", images, noise, orientation)
    table = shared / "data/tactile22/tactile22.csv"
    if not table.exists():
        skip(f"{table} is not there; the synthetic imprints agreed")
    rows = np.loadtxt(table, delimiter=",", comments="#")
    rows = rows if len(sys.argv) > 3 else rows[::4]
    compare(oracle, tool, "tactile22", rows[:, 2:].reshape(-1, 28, 50))


main()
