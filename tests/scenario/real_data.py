#!/usr/bin/env python3
"""Writes public recordings in the CSV forms that our programs read. They stay outside the repository.

    real_data.py fabricslide SRC OUT [GLOB]     group = repetition; GLOB such as '*V*10mmps_*'
    real_data.py icub20 SRC OUT                 group = fold
    real_data.py icub20-manifest SRC OUT        the same for `weft dataset import`
    real_data.py icub20-in-order SRC OUT        icub20-manifest with the steps in the order of time

The first two are for oracle_agreement and the Python reference: index.csv and files of phase and channels, all of phase M.
The others write manifest.csv and files of t_s and channels. icub20 (75 steps a slide) gives no rate: a step is written as
0.02 s.

As filed, a row of icub20.csv is no frame of the skin. The values stand in groups of ten (the taxels of one triangle of
RoboSkin), and group 6 j + i of a slide (i < 6, j < 75) is group 75 i + j in the order of time: frames of six triangles were
once taken for six series of 75 steps, and transposed. Neighbouring rows as filed have a correlation of -0.14, in that order
one of 0.97 (`continuity`), the highest of all ways to take such a step back that were tried.
"""
import csv
import pathlib
import sys

STEP_S = 0.02
TRIANGLE = 10  # taxels


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


def in_order(samples):
    """The frames of a slide as its skin felt them, from the rows as filed: see above."""
    triangles = len(samples[0]) // TRIANGLE
    groups = [row[k * TRIANGLE:(k + 1) * TRIANGLE] for row in samples for k in range(triangles)]
    ordered = [groups[j * triangles + i] for i in range(triangles) for j in range(len(samples))]
    return [sum(ordered[t * triangles:(t + 1) * triangles], []) for t in range(len(samples))]


def continuity(slides):
    """Correlation of a taxel's signal with itself one step later, of all slides and taxels together."""
    together = alone = 0.0
    for samples in slides:
        for signal in zip(*samples):
            values = [float(value) for value in signal]
            mean = sum(values) / len(values)
            centred = [value - mean for value in values]
            together += sum(a * b for a, b in zip(centred, centred[1:])) / (len(values) - 1)
            alone += sum(a * a for a in centred) / len(values)
    return together / alone


def icub20(src, out):
    for sample, label, fold, _, samples in icub20_slides(src):
        write_phase_m(out / f"{sample}.csv", [f"tx{k + 1}" for k in range(len(samples[0]))], samples)
        yield f"{sample}.csv", f"{label:02d}", fold


def icub20_manifest(src, out, order=lambda samples: samples):
    for sample, label, fold, steps, samples in icub20_slides(src):
        samples = order(samples)
        header = ["t_s"] + [f"ch{k + 1}" for k in range(len(samples[0]))]
        times = [f"{step * STEP_S:.9g}" for step in steps]
        write_rows(out / f"{sample:04d}.csv", [header] + [[t] + s for t, s in zip(times, samples)])
        yield f"{sample:04d}.csv", label, fold


KINDS = {"fabricslide": (fabricslide, "index.csv"), "icub20": (icub20, "index.csv"),
         "icub20-manifest": (icub20_manifest, "manifest.csv"),
         "icub20-in-order": (lambda src, out: icub20_manifest(src, out, in_order), "manifest.csv")}


def main():
    src, out = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    trials, index = KINDS[sys.argv[1]]
    write_rows(out / index, [["file", "label", "group"]] + list(trials(src, out, *sys.argv[4:])))


if __name__ == "__main__":
    main()
