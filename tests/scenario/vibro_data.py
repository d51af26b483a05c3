"""Recordings of sound and vibration for the scenarios that compare classifier/vibro with the Python reference."""
import pathlib
import subprocess
import sys

from oracle_agreement_data import PYTHON, need_reference


def need_sound_reference(shared):
    """The reference of the 2023 paper as a module; skips the scenario if it cannot run."""
    need_reference(shared)
    import sound001
    return sound001


def synthetic(shared, folder):
    """SYNTHETIC: twelve recordings of 20 s, as (name, rate, samples) of S, X, Y, Z."""
    import numpy as np
    path = pathlib.Path(folder) / "sound.npz"
    subprocess.run([PYTHON, shared / "oracle/gen_synth.py", "sound", path], check=True)
    z = np.load(path)
    for k in range(len(z["S"])):
        yield f"synthetic {k} S", float(z["fs_s"]), z["S"][k]
        for c, name in enumerate("XYZ"):
            yield f"synthetic {k} {name}", float(z["fs_a"]), z["XYZ"][k, c]


def vibtac12(data):
    import numpy as np
    from scipy.io import wavfile
    for name in "XYZ":
        for k, row in enumerate(np.loadtxt(data / f"vibtac12/{name}.csv", delimiter=",")):
            yield f"vibtac12 {k + 1} {name}", 200.0, row
    for path in sorted((data / "vibtac12").glob("*.wav")):
        rate, samples = wavfile.read(path)
        yield f"vibtac12 {path.name}", float(rate), samples.astype(float)


def lmt_sound(data):
    from scipy.io import wavfile
    for path in sorted((data / "lmt_sound").glob("*/*_0[17].wav")):
        rate, samples = wavfile.read(path)
        yield f"lmt_sound {path.name}", float(rate), samples / 32768.0


def hapmat(data):
    import numpy as np
    for path in sorted((data / "hapmat").glob("*.csv")):
        table = np.genfromtxt(path, delimiter=",", skip_header=1)
        for c in range(1, table.shape[1]):
            yield f"hapmat {path.name} column {c}", 100.0, table[:, c]


def real(data):
    """(set, recordings) of the sets that exist."""
    for kind in (vibtac12, lmt_sound, hapmat):
        if (data / kind.__name__).is_dir():
            yield kind.__name__, kind(data)
        else:
            print(f"no {data / kind.__name__}: not compared", file=sys.stderr)


def splits(label, count):
    """[count x rows], 1 for training rows: a random four fifths of each label."""
    import numpy as np
    rng = np.random.default_rng(2)
    out = np.zeros((count, len(label)), np.uint8)
    for s in range(count):
        for k in set(label):
            rows = rng.permutation(np.flatnonzero(label == k))
            out[s, rows[:round(0.8 * len(rows))]] = 1
    return out
