#!/usr/bin/env python3
"""Writes public recordings in the CSV form that oracle_agreement and the Python reference read.

    real_data.py fabricslide SRC OUT [GLOB]     group = repetition; GLOB such as '*V*10mmps_*'
    real_data.py icub20 SRC OUT                 group = fold

All samples are phase M. The recordings stay outside the repository (see /work/shared/data/README.md).
"""
import csv
import pathlib
import sys


def write_trial(path, header, rows):
    with open(path, "w", newline="") as out:
        w = csv.writer(out)
        w.writerow(["phase"] + header)
        w.writerows(["M"] + r for r in rows)


def fabricslide(src, out, glob="*.csv"):
    for file in sorted(src.glob(glob)):
        fabric, repetition = file.stem.split("_")[0], file.stem.split("_")[-1]
        with open(file) as f:
            rows = [r[3:] for r in csv.reader(f)][1:]
        write_trial(out / file.name, [f"c{k + 1}" for k in range(16)], rows)
        yield file.name, fabric, repetition


def icub20(src, out):
    trials = {}
    with open(src / "icub20.csv") as f:
        for r in csv.DictReader(f):
            trials.setdefault((int(r["sample"]), r["label"], r["fold"]), []).append(r)
    for (sample, label, fold), rows in sorted(trials.items()):
        taxels = [f"tx{k + 1}" for k in range(60)]
        write_trial(out / f"{sample}.csv", taxels, [[r[t] for t in taxels] for r in rows])
        yield f"{sample}.csv", f"{int(label):02d}", fold


def main():
    kind, src, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    trials = {"fabricslide": fabricslide, "icub20": icub20}[kind](src, out, *sys.argv[4:])
    with open(out / "index.csv", "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(["file", "label", "group"])
        w.writerows(trials)


main()
