#!/usr/bin/env python3
"""`weft` over a person's own recordings, made up: copies, short ones, several rates, presses of one object.

    cli_own_recordings.py WEFT
"""
import pathlib
import random
import sys
import tempfile

from cli_support import Checks
from made_up_cloths import write_manifest

VIBRATION_HZ = 100


def write_vibration(path, level, seed, seconds=8):
    noise = random.Random(seed)
    lines = [f"{i / VIBRATION_HZ:.2f},{noise.gauss(0, level):.6f}" for i in range(round(seconds * VIBRATION_HZ))]
    path.write_text("\n".join(["t_s,X", *lines]) + "\n")


def vibrations(folder):
    """Two textures, four recordings of each in as many groups."""
    folder.mkdir()
    rows = []
    for c, label in enumerate(("felt", "foil")):
        for k in range(4):
            write_vibration(folder / f"{label}{k}.csv", 1 + c, 10 * c + k)
            rows.append([f"{label}{k}.csv", label, str(k)])
    return rows


def imported(t, d, name, rows, *options):
    write_manifest(d / f"{name}.csv", rows)
    return t.succeeds("dataset", "import", f"{name}.csv", "-o", f"{name}.h5", *options, cwd=d)


def one_manifest(t, d, rows):
    """Recordings are listed as strictly as slides are."""
    for twice in ("felt0.csv", "./felt0.csv", "link.csv"):
        if twice == "link.csv":
            (d / twice).symlink_to("felt0.csv")
        write_manifest(d / "twice.csv", rows + [[twice, "felt", "9"]])
        t.refuses("dataset", "import", "twice.csv", "-o", "bad.h5", "--format", "recordings", cwd=d,
                  says=["twice.csv:10", "the file is listed twice", "twice.csv:2 as 'felt0.csv'"])
    (d / "wrong.csv").write_text("file,label,grp\nfelt0.csv,felt,1\n")
    t.refuses("dataset", "import", "wrong.csv", "-o", "bad.h5", "--format", "recordings", cwd=d, says=["wrong.csv:1", "'grp'"])


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-own-") as name:
        d = pathlib.Path(name) / "own"
        rows = vibrations(d)
        one_manifest(t, d, rows)
    t.finish()


main()
