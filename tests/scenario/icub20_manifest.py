#!/usr/bin/env python3
"""Turns shared/data/icub20/icub20.csv into a manifest and trial files that `weft dataset import` reads.

    icub20_manifest.py SHARED_DIR OUT_DIR

Columns of the source: sample,label,fold,t,tx1..tx60, 75 steps a slide. Its `t` counts steps; the source gives no
rate, so a step is written as 0.02 s. Label stays the label, fold becomes the group. Fields are copied as text.
"""
import csv
import pathlib
import sys

STEP_S = 0.02


def main(shared, out):
    source = pathlib.Path(shared) / "data" / "icub20" / "icub20.csv"
    folder = pathlib.Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    trials = {}
    with open(source, newline="") as file:
        rows = csv.reader(file)
        header = next(rows)
        for row in rows:
            trials.setdefault(row[0], []).append(row)
    channels = ",".join(f"ch{k}" for k in range(1, len(header) - 3))
    with open(folder / "manifest.csv", "w") as manifest:
        manifest.write("file,label,group\n")
        for sample, rows in trials.items():
            name = f"{int(sample):04d}.csv"
            manifest.write(f"{name},{rows[0][1]},{rows[0][2]}\n")
            lines = [f"{float(row[3]) * STEP_S:.9g}," + ",".join(row[4:]) for row in rows]
            (folder / name).write_text(f"t_s,{channels}\n" + "\n".join(lines) + "\n")
    print(f"{len(trials)} trials in {folder}")


main(*sys.argv[1:3])
