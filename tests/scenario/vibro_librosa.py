#!/usr/bin/env python3
"""Compares the features of sound and vibration with those of the real librosa (PyPI) on the same windows.

    vibro_librosa.py TOOL SHARED_DIR      exit 77 (skipped) without librosa

librosa comes from the virtual environment WEFT_PEERS, else from build/peers (made by `script/bench vibro_current`), else from this Python. Windows
are MADE UP, and REAL if SHARED_DIR has recordings.

Tolerance: 1e-9 of the larger value. Both compute in doubles; librosa's RMS and its chroma filters need an option for that, because their single
precision has errors of 6e-8. Sums of 1e5 terms lose about 1e-12. MEAN cancels: 1e-13 of the RMS. A share of zero crossings and a roll-off have steps:
they are equal or a whole step apart. MAD is scipy's, MEAN, STD and FFT numpy's. BANDS has no peer; Weft has no MFCC.
"""
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
TOLERANCE = 1e-9


def with_librosa():
    """Continues in a Python that has librosa; skips if none has."""
    for python in (pathlib.Path(os.environ.get("WEFT_PEERS", HERE.parents[1] / "build/peers")) / "bin/python", pathlib.Path(sys.executable)):
        if python.exists() and subprocess.run([python, "-c", "import librosa"], capture_output=True).returncode == 0:
            if os.environ.get("WEFT_IN_PEERS") != "1":
                os.execve(python, [str(python), *sys.argv], {**os.environ, "WEFT_IN_PEERS": "1"})
            return
    print("skipped: no librosa; `script/bench vibro_current` fetches it, or set WEFT_PEERS to a virtual environment that has it")
    sys.exit(77)


def theirs(y, rate):
    """The ten features and FFT by librosa, scipy and numpy: frames as the window allows, means over frames."""
    import librosa
    import numpy as np
    from scipy.stats import median_abs_deviation
    n_fft = min(2048, 1 << (len(y).bit_length() - 1))
    frame = {"n_fft": n_fft, "hop_length": n_fft // 4}
    framed = {"frame_length": n_fft, "hop_length": n_fft // 4}
    spectrum = np.abs(librosa.stft(y, **frame))
    power = librosa.perceptual_weighting(spectrum ** 2, librosa.fft_frequencies(sr=rate, n_fft=n_fft))
    amplitude = np.abs(np.fft.rfft(y - y.mean())) * 2 / len(y)
    return {
        "MEAN": y.mean(), "STD": y.std(), "MAD": median_abs_deviation(y),
        "RMSE": librosa.feature.rms(y=y, dtype=np.float64, **framed).mean(),
        "CHROMA": librosa.feature.chroma_stft(y=y, sr=rate, tuning=0, dtype=np.float64, **frame).mean(),
        "CENTROID": librosa.feature.spectral_centroid(y=y, sr=rate, **frame).mean(),
        "BANDWIDTH": librosa.feature.spectral_bandwidth(y=y, sr=rate, **frame).mean(),
        "ROLLOFF": librosa.feature.spectral_rolloff(y=y, sr=rate, **frame).mean(),
        "PERCEPTUAL": power.mean(),
        "ZCR": librosa.feature.zero_crossing_rate(y, **framed).mean(),
        "FFT": amplitude[1:].mean()}


def made_up():
    """Noise, a chord with an offset, and a decaying knock, of a microphone and of an axis."""
    import numpy as np
    rng = np.random.default_rng(1)
    for rate in (8000, 200):
        t = np.arange(2 * rate) / rate
        yield f"noise at {rate} Hz", rate, rng.normal(size=t.size)
        yield f"chord at {rate} Hz", rate, 3 + sum(np.sin(2 * np.pi * f * rate * t / 8000 + f) for f in (440, 554.4, 659.3)) + 0.01 * rng.normal(size=t.size)
        yield f"knocks at {rate} Hz", rate, np.exp(-5 * (t % 0.5)) * rng.normal(size=t.size) + 1e-3 * rng.normal(size=t.size)


def cut(recordings):
    from vibro_agreement import windows
    recordings = list(recordings)
    for seconds in (1.0, 2.0):
        yield from windows(recordings, seconds, 1)


def compare(tool, what, chosen):
    import numpy as np
    from vibro_agreement import NAMES, ours
    chosen = list(chosen)
    worst = dict.fromkeys(NAMES, 0.0)
    for (name, rate, y), row in zip(chosen, ours(tool, chosen)):
        want = theirs(y, rate)
        for own, column in zip(row, NAMES):
            slack = TOLERANCE * max(abs(own), abs(want[column]))
            if column == "MEAN":
                slack = max(slack, 1e-13 * np.sqrt(np.mean(y ** 2)))
            difference = abs(own - want[column])
            assert difference <= slack, f"{name}: {column} is {own!r}, librosa has {want[column]!r}"
            worst[column] = max(worst[column], difference / max(abs(want[column]), 1e-300))
    print(f"{what}: {len(chosen)} windows, largest relative difference " + ", ".join(f"{c} {v:.0e}" for c, v in worst.items()))
    return len(chosen)


def main():
    with_librosa()
    import librosa
    import numpy
    from vibro_data import real
    print(f"librosa {librosa.__version__}, numpy {numpy.__version__}")
    tool, shared = sys.argv[1], pathlib.Path(sys.argv[2])
    count = compare(tool, "MADE UP", cut(made_up()))
    for kind, recordings in real(shared / "data"):
        count += compare(tool, f"REAL {kind}", cut(recordings))
    assert count >= 12


main()
