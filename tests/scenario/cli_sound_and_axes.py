#!/usr/bin/env python3
"""A user's own sound and three axes of acceleration, each in its own file, from the manifest to the prediction. MADE UP noise.

    cli_sound_and_axes.py WEFT     exit 77 (skipped) if this build reads no sound files

Sound is a WAV file at 8 kHz or a table at 2 kHz, the axes are a table at 200 Hz. `recording` in the manifest names files that belong together.
"""
import pathlib
import random
import struct
import sys
import tempfile
import wave

from cli_support import Checks

LABELS, SECONDS, GROUPS = ("felt", "foil"), 8, 4
HEAD = "file,label,group,recording"


def write_wav(path, level, seed, rate_hz=8000):
    noise = random.Random(seed)
    samples = [round(noise.uniform(-level, level)) for _ in range(SECONDS * rate_hz)]
    with wave.open(str(path), "wb") as f:
        f.setparams((1, 2, rate_hz, 0, "NONE", ""))
        f.writeframes(struct.pack(f"<{len(samples)}h", *samples))


def write_table(path, columns, levels, seed, rate_hz, seconds=SECONDS):
    noise = random.Random(seed)
    rows = [f"{i / rate_hz:.6f}," + ",".join(f"{noise.gauss(0, level):.6f}" for level in levels) for i in range(round(seconds * rate_hz))]
    path.write_text("\n".join([",".join(["t_s", *columns]), *rows]) + "\n")


def record(folder, label, k, sound):
    """Writes the two files of a recording: neither its sound nor its axes separate the labels well. Returns the rows of the manifest."""
    seed = 100 * LABELS.index(label) + k
    more = LABELS.index(label)
    name = f"{label}{k}"
    if sound == "wav":
        write_wav(folder / f"{name}.wav", 3000 + 2500 * more, seed)
    else:
        write_table(folder / f"{name}-sound.csv", ["S"], [0.1 + 0.1 * more], seed, 2000)
    write_table(folder / f"{name}-axes.csv", ["X", "Y", "Z"], [1, 1, 1 + 0.5 * more], seed + 50, 200 * (1 + 1e-5 * k))
    of_sound = f"{name}.wav" if sound == "wav" else f"{name}-sound.csv"
    return [f"{of_sound},{label},{k},{name}", f"{name}-axes.csv,{label},{k},{name}"]


def manifest(folder, name, rows):
    (folder / name).write_text("\n".join([HEAD, *rows]) + "\n")
    return name


def imported(t, folder, sound):
    folder.mkdir()
    rows = [row for label in LABELS for k in range(GROUPS) for row in record(folder, label, k, sound)]
    ran = t.run("dataset", "import", "--format", "recordings", manifest(folder, "own.csv", rows), "-o", "own.h5", "--json", cwd=folder)
    if "libsndfile1-dev" in ran.stderr:
        print("skipped: this build reads no sound files")
        sys.exit(77)
    t.expect(ran.returncode == 0, f"import: {ran.stderr}")
    return rows


def whole_way(t, d, sound, rate_hz):
    """Imports, evaluates, trains, and classifies a session of another day."""
    folder = d / sound
    rows = imported(t, folder, sound)
    info = t.succeeds("dataset", "info", "own.h5", cwd=folder)
    t.expect(sum(info["labels"].values()) == len(LABELS) * GROUPS, f"a recording of two files is one: {info['labels']}")
    told = t.succeeds("evaluate", "own.h5", "--method", "LDA", "--window-s", "1", "--leave-one-group-out", cwd=folder)
    t.expect({f"STD.{c}" for c in "SXYZ"} <= set(told["columns"]), f"columns of every channel: {told['columns']}")
    t.expect(told["leak"]["largest_share"] == 0 and told["results"]["lda"]["accuracy_ci95"]["low"] > 0.5, f"evaluate: {told['results']['lda']}")
    made = t.succeeds("train", "own.h5", "-o", "own.model", "--method", "LDA", "--window-s", "1", cwd=folder)
    t.expect(made["recordings"] == len(LABELS) * GROUPS, f"train: {made}")
    head = (folder / "own.model").read_text()[:4000]
    t.expect(head.count("rate_hz 200\n") == 3 and f"rate_hz {rate_hz}\n" in head, f"each channel at its rate: {head[:600]}")
    later = [row for label in LABELS for row in record(folder, label, 9, sound)]
    t.succeeds("dataset", "import", "--format", "recordings", manifest(folder, "later.csv", later), "-o", "later.h5", cwd=folder)
    answers = t.succeeds("classify", "own.model", "later.h5", cwd=folder)["recordings"]
    t.expect([a["label"] == a["true_label"] for a in answers] == [True, True], f"classify: {answers}")
    return rows


def refused(t, folder, rows):
    """Files that cannot belong together are refused, each with its line."""
    ask = ("dataset", "import", "--format", "recordings")
    sound, axes = rows[:2]
    for bad, got, expected in ((axes.replace("felt,", "foil,"), "foil", "felt"), (axes.replace("felt,0", "felt,7"), "7", "0")):
        t.refuses(*ask, manifest(folder, "bad.csv", [sound, bad]), "-o", "bad.h5", cwd=folder, code="invalid argument", where=["bad.csv:3"], got=got,
                  expected=expected)
    t.refuses(*ask, manifest(folder, "bad.csv", [sound, axes, "felt1-axes.csv,felt,0,felt0"]), "-o", "bad.h5", cwd=folder, code="invalid argument",
              where=["bad.csv:4"], got="X")
    t.refuses(*ask, manifest(folder, "bad.csv", [sound, axes, rows[2]]), "-o", "bad.h5", cwd=folder, says=["channels", "S", "X"])
    lines = (folder / "felt0-axes.csv").read_text().splitlines()
    (folder / "paused.csv").write_text("\n".join(lines[:400] + lines[700:]) + "\n")
    t.refuses(*ask, manifest(folder, "bad.csv", [sound, axes.replace("felt0-axes.csv", "paused.csv")]), "-o", "bad.h5", "--rate-hz", "200", cwd=folder,
              code="invalid argument", where=["bad.csv:3"], got="paused.csv")
    (folder / "slides.csv").write_text(f"{HEAD}\n{axes}\n")
    t.refuses("dataset", "import", "slides.csv", "-o", "bad.h5", cwd=folder, says=["slides.csv:1", "'recording'"])


def alone(t, folder):
    """A file without a name under `recording` is a recording by itself."""
    rows = [f"{label}{k}-axes.csv,{label},{k}," for label in LABELS for k in range(GROUPS)]
    t.succeeds("dataset", "import", "--format", "recordings", manifest(folder, "alone.csv", rows), "-o", "alone.h5", cwd=folder)
    made = t.succeeds("train", "alone.h5", "-o", "alone.model", "--method", "LDA", "--window-s", "1", cwd=folder)
    t.expect(made["recordings"] == len(rows), f"each file a recording: {made}")
    t.refuses("classify", "alone.model", "own.h5", cwd=folder, code="invalid argument", got="8000", expected="200")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-sound-and-axes-") as name:
        d = pathlib.Path(name)
        rows = whole_way(t, d, "wav", 8000)
        refused(t, d / "wav", rows)
        alone(t, d / "wav")
        whole_way(t, d, "table", 2000)
    t.finish()


main()
