#!/usr/bin/env python3
"""Writes public recordings in the CSV forms that our programs read. They stay outside the repository.

    real_data.py fabricslide SRC OUT [GLOB]     group = repetition; GLOB such as '*V*10mmps_*'
    real_data.py icub20 SRC OUT                 group = fold

For oracle_agreement and the Python reference: index.csv and files of phase and channels, all of phase M. icub20 as filed: `weft dataset import` puts
the steps of its slides in the order of time.
"""
import csv
import pathlib
import sys


def write_rows(path, rows):
    with open(path, "w", newline="") as out:
        csv.writer(out).writerows(rows)


def write_phase_m(path, channels, samples):
    write_rows(path, [["phase"] + channels] + [["M"] + s for s in samples])


def fabricslide(src, out, glob="*.csv"):
    for file in sorted(src.glob(glob)):
        fabric, repetition = file.stem.split("_")[0], file.stem.split("_")[-1]
        with open(file) as f:
            samples = [r[3:] for r in csv.reader(f)][1:]
        write_phase_m(out / file.name, [f"c{k + 1}" for k in range(16)], samples)
        yield file.name, fabric, repetition


def icub20(src, out):
    slides = {}
    with open(src / "icub20.csv", newline="") as f:
        for sample, label, fold, _, *taxels in list(csv.reader(f))[1:]:
            slides.setdefault((int(sample), int(label), fold), []).append(taxels)
    for (sample, label, fold), samples in sorted(slides.items()):
        write_phase_m(out / f"{sample}.csv", [f"tx{k + 1}" for k in range(len(samples[0]))], samples)
        yield f"{sample}.csv", f"{label:02d}", fold


KINDS = {"fabricslide": fabricslide, "icub20": icub20}


def main():
    src, out = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    trials = KINDS[sys.argv[1]](src, out, *sys.argv[4:])
    write_rows(out / "index.csv", [["file", "label", "group"]] + list(trials))


if __name__ == "__main__":
    main()
