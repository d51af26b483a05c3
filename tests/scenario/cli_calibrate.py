#!/usr/bin/env python3
"""`weft sim calibrate` on recordings with little information: refused, or answered with a sentence. The recordings are made up.

    cli_calibrate.py WEFT
"""
import csv
import json
import math
import pathlib
import random
import sys
import tempfile

from cli_support import Checks, error_of, fits
from made_up_cloths import write_manifest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
RATE_HZ = 37


def write_stroke(path, count, channels, seed):
    """A stroke of 0.5 s S and 3 s M; in M the counts are `count(wave, channel)`, with a noisy wave between -1 and 1."""
    noise = random.Random(seed)
    with open(path, "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(["t_s", "phase"] + [f"ch{c + 1}" for c in range(channels)])
        for i in range(130):
            wave = noise.gauss(0, 0.05)
            counts = [round(count(wave + math.sin(0.7 * i), c)) if i >= 18 else round(1000 + 50 * wave) for c in range(channels)]
            w.writerow([f"{i / RATE_HZ:.4f}", "S" if i < 18 else "M"] + counts)


def recorded(t, d, name, count, channels=4, strokes=4):
    rows = []
    for k in range(strokes):
        write_stroke(d / f"{name}{k}.csv", count, channels, k)
        rows.append([f"{name}{k}.csv", "denim", str(k)])
    write_manifest(d / f"{name}.csv", rows)
    t.succeeds("dataset", "import", f"{name}.csv", "-o", f"{name}.h5", cwd=d)
    return f"{name}.h5"


def loaded(wave, channel):
    return 2000 + 100 * channel + 300 * wave


def calibrate(data):
    return ("sim", "calibrate", data, "-o", "table.json", "--fabrics", SOURCE / "sim/fabrics.json", "--speed-mm-s", "10")


def answered(t, d, data, absent):
    """Expects sentences in `remarks`, finite numbers and a table without `absent`."""
    ran = t.run(*calibrate(data), "--json", cwd=d)
    if "NLopt" in ran.stderr and ran.returncode == 1:
        print("built without NLopt: nothing is searched")
        return
    t.expect(ran.returncode in (0, 3), f"{data}: {ran.returncode} {ran.stderr}")
    if ran.returncode not in (0, 3):
        return
    out = json.loads(ran.stdout)
    t.expect("NaN" not in ran.stdout and "Infinity" not in ran.stdout, f"{data}: {ran.stdout}")
    t.expect(out["remarks"], f"{data}: no remarks: {out}")
    standing = {p["name"]: p["standing"] for p in out["parameters"]}
    for name in absent:
        t.expect(standing.get(name) == "not_seen", f"{data}: {name} is {standing.get(name)}")
    t.expect((d / "table.json").stat().st_size > 0, f"{data}: no table")
    (d / "table.json").unlink()


def refuses_repeated_data(t, d):
    """Refuses a data set that is fitted twice or also held out, and one of another sensor held out."""
    one = recorded(t, d, "one", loaded)
    (d / "copy.h5").write_bytes((d / one).read_bytes())
    t.refuses(*calibrate(one), "copy.h5", cwd=d, code="invalid argument", where="copy.h5", says=[one])
    t.refuses(*calibrate(one), "--held-out", "copy.h5", cwd=d, code="invalid argument", where="copy.h5", says=[one])
    other = recorded(t, d, "other", loaded, channels=3)
    ran = t.run(*calibrate(one), "--held-out", other, "--json", cwd=d)
    if "NLopt" not in ran.stderr:
        t.expect(ran.returncode == 1 and fits(error_of(ran), got="3", expected="4"), f"other channels: {ran.returncode} {ran.stdout} {ran.stderr}")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        d = pathlib.Path(folder)
        t.refuses(*calibrate(recorded(t, d, "constant", lambda wave, c: 500)), cwd=d, code="measurement", says=["1 to 4", "constant"])
        clipped = recorded(t, d, "clipped", lambda wave, c: min(max(loaded(wave, c), 1900 + 100 * c), 2100 + 100 * c))
        t.refuses(*calibrate(clipped), cwd=d, code="measurement", expected="1 %", says=["clipped", "channels 1, 2, 3, 4"])
        refuses_repeated_data(t, d)
        answered(t, d, recorded(t, d, "channel", loaded, channels=1), ["pad_ratio", "gain_spread", "common_mode"])
        answered(t, d, recorded(t, d, "stroke", loaded, strokes=1), ["path_mm", "tilt_mrad"])
    t.finish()


main()
