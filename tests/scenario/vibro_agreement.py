#!/usr/bin/env python3
"""Compares the features of sound and vibration with the Python reference, on synthetic and real recordings.

    vibro_agreement.py TOOL SHARED_DIR      exit 77 (skipped) without the reference

Windows of 1 s and 2 s (and of 0.37 s: a frame of its own, a length with large prime factors) at places spread over every recording. All to 1e-9
relative, except the mean: it cancels, and is compared to 1e-13 of the RMS.
"""
import pathlib
import subprocess
import sys
import tempfile

from vibro_data import need_sound_reference, real, synthetic

NAMES = ["MEAN", "STD", "MAD", "RMSE", "CHROMA", "CENTROID", "BANDWIDTH", "ROLLOFF", "PERCEPTUAL", "ZCR", "FFT"]


def windows(recordings, seconds, places):
    import numpy as np
    for name, rate, samples in recordings:
        count = int(round(seconds * rate))
        for start in np.linspace(0, max(0, len(samples) - count), places).astype(int):
            yield f"{name} at {start}", rate, np.ascontiguousarray(samples[start:start + count], float)


def ours(tool, cut):
    import numpy as np
    with tempfile.TemporaryFile() as f:
        for _, rate, samples in cut:
            f.write(np.uint64(len(samples)).tobytes() + np.float64(rate).tobytes() + samples.tobytes())
        f.seek(0)
        out = subprocess.run([tool], stdin=f, check=True, capture_output=True, text=True).stdout
    return np.array([[float(v) for v in line.split(",")] for line in out.splitlines()])


def compare(tool, oracle, what, cut):
    import numpy as np
    got = ours(tool, cut)
    assert got.shape == (len(cut), len(NAMES)), got.shape
    worst = dict.fromkeys(NAMES, 0.0)
    for (name, rate, samples), row in zip(cut, got):
        want = np.r_[oracle.channel_features(samples, rate), oracle.fft_feature(samples)]
        slack = 1e-9 * np.maximum(np.abs(row), np.abs(want))
        slack[0] = max(slack[0], 1e-13 * np.sqrt(np.mean(samples ** 2)))
        difference = np.abs(row - want)
        bad = ~(difference <= slack)  # also true for NaN
        assert not bad.any(), f"{name}: {[(NAMES[k], row[k], want[k]) for k in np.flatnonzero(bad)]}"
        for k, column in enumerate(NAMES):
            if want[k]:
                worst[column] = max(worst[column], difference[k] / abs(want[k]))
    print(f"{what}: {len(cut)} windows, largest relative difference " + ", ".join(f"{c} {v:.0e}" for c, v in worst.items()))


def main():
    tool, shared = sys.argv[1], pathlib.Path(sys.argv[2])
    oracle = need_sound_reference(shared)
    with tempfile.TemporaryDirectory() as folder:
        made = list(synthetic(shared, folder))
    for seconds, places in ((1.0, 2), (2.0, 2), (0.37, 1)):
        compare(tool, oracle, f"SYNTHETIC, {seconds} s", list(windows(made, seconds, places)))
    for kind, recordings in real(shared / "data"):
        recordings = list(recordings)
        for seconds, places in ((1.0, 2), (2.0, 1)):
            compare(tool, oracle, f"{kind}, {seconds} s", list(windows(recordings, seconds, places)))


if __name__ == "__main__":
    main()
