"""Real and simulated trials in the Python reference's CSV form, for the scenarios that compare us with it."""
import csv
import json
import os
import pathlib
import subprocess
import sys

PYTHON = "/usr/bin/python3"
HERE = pathlib.Path(__file__).parent


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def rows_of(path):
    with open(path) as f:
        return list(csv.reader(f))


def need_reference(shared):
    """The reference as a module, on Debian's own Python; skips the scenario if either is absent."""
    if not (shared / "oracle/fabric000.py").exists():
        skip("no reference in " + str(shared))
    if not os.path.exists(PYTHON) or subprocess.run([PYTHON, "-c", "import sklearn, scipy, h5py"], capture_output=True).returncode:
        skip("no scikit-learn and h5py for " + PYTHON)
    if os.path.realpath(sys.executable) != os.path.realpath(PYTHON):
        os.execv(PYTHON, [PYTHON] + sys.argv)
    sys.path.insert(0, str(shared / "oracle"))
    import fabric000
    return fabric000


def real_trials(kind, source, folder, chosen=lambda rows: rows, glob=()):
    """An index of real_data.py with the rows that `chosen` returns, sorted by label, because the reference numbers labels in the order of the rows."""
    subprocess.run([PYTHON, HERE / "real_data.py", kind, source, folder, *glob], check=True)
    index = folder / "index.csv"
    head, *rows = rows_of(index)
    with open(index, "w", newline="") as f:
        csv.writer(f).writerows([head] + sorted(chosen(rows), key=lambda row: row[1]))
    return index


def simulated_trials(weft, root, folder, exploration, fabrics=("satin", "denim", "velvet"), repetitions=4):
    """A campaign on the simulated bench, with its HDF5 data set rewritten as the reference's CSV, without transfer rows."""
    import h5py
    recipe = json.loads((root / f"recipes/library/{exploration}.json").read_text())
    recipe.update(repetitions=repetitions)
    if fabrics:
        recipe.update(fabrics=list(fabrics))
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
        csv.writer(f).writerows([index[0]] + sorted(index[1:], key=lambda row: row[1]))  # the reference numbers labels in the order of the rows
    return folder / "index.csv"


