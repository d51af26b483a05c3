#!/usr/bin/env python3
"""Writes public recordings in the CSV forms that our programs read. They stay outside the repository.

    real_data.py fabricslide SRC OUT [GLOB]     group = repetition; GLOB such as '*V*10mmps_*'
    real_data.py icub20 SRC OUT                 group = fold
    real_data.py icub20-manifest SRC OUT        the same for `weft dataset import`

The first two are for oracle_agreement and the Python reference: index.csv and files of phase and channels, all of phase M.
The third writes manifest.csv and files of t_s and channels. icub20 (75 steps a slide) gives no rate: a step is written as
0.02 s.
"""
import csv
import pathlib
import sys

STEP_S = 0.02


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


def icub20_slides(src):
    """Number, label, fold, steps and samples of each slide; columns of the source: sample,label,fold,t,tx1..tx60."""
    slides = {}
    with open(src / "icub20.csv", newline="") as f:
        for sample, label, fold, step, *taxels in list(csv.reader(f))[1:]:
            slides.setdefault((int(sample), int(label), fold), []).append((float(step), taxels))
    for (sample, label, fold), rows in sorted(slides.items()):
        yield sample, label, fold, [step for step, _ in rows], [taxels for _, taxels in rows]


def icub20(src, out):
    for sample, label, fold, _, samples in icub20_slides(src):
        write_phase_m(out / f"{sample}.csv", [f"tx{k + 1}" for k in range(len(samples[0]))], samples)
        yield f"{sample}.csv", f"{label:02d}", fold


def icub20_manifest(src, out):
    for sample, label, fold, steps, samples in icub20_slides(src):
        header = ["t_s"] + [f"ch{k + 1}" for k in range(len(samples[0]))]
        times = [f"{step * STEP_S:.9g}" for step in steps]
        write_rows(out / f"{sample:04d}.csv", [header] + [[t] + s for t, s in zip(times, samples)])
        yield f"{sample:04d}.csv", label, fold


KINDS = {"fabricslide": (fabricslide, "index.csv"), "icub20": (icub20, "index.csv"),
         "icub20-manifest": (icub20_manifest, "manifest.csv")}


def main():
    src, out = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    trials, index = KINDS[sys.argv[1]]
    write_rows(out / index, [["file", "label", "group"]] + list(trials(src, out, *sys.argv[4:])))


main()
