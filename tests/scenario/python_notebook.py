#!/usr/bin/env python3
"""Runs the notebook's cells against weftd with matplotlib, and compares each figure with h5py's own reading of the data set: labels with units, number of
lines, values, phases, the mark SIMULATED. Packages from PyPI at pinned versions (python_data.txt).

    python_notebook.py WEFTD SOURCE_ROOT FOLDER      FOLDER has their virtual environment, and is made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or is too slow.
"""
import json
import os
import pathlib
import sys
import tempfile

import pypi_environment

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_name("python_data.txt"))

ROOT = pathlib.Path(sys.argv[2]).resolve()
sys.path[:0] = [str(ROOT / "clients/python/src"), str(ROOT / "clients/python/tests")]

import h5py
import matplotlib
import numpy

matplotlib.use("Agg")

import matplotlib.pyplot as plt

import run_notebook
from cli_support import Checks
from weftd_support import Daemon

FABRICS, REPETITIONS, TAXELS = ["denim", "silk"], 4, 16
TRIALS = len(FABRICS) * REPETITIONS


def read(path):
    """A record for each trial, by docs/reference/dataset.md."""
    with h5py.File(path) as f:
        assert f.attrs["bench_kind"] == b"simulated"
        trials = []
        for i, file in enumerate(f["trials/file"][:]):
            first = {s: int(f[f"trials/{s}_first"][i]) for s in ("taxel", "wrench")}
            part = {s: slice(first[s], first[s] + int(f[f"trials/{s}_samples"][i])) for s in first}
            own = [k for k, trial in enumerate(f["phases/trial"][:]) if trial == i]
            trials.append({"file": file.decode(), "label": f["trials/label"][i].decode(), "counts": f["taxel/counts"][part["taxel"]].astype(float),
                           "phase": f["taxel/phase"][part["taxel"]].view("S1"), "t_s": f["taxel/t_ns"][part["taxel"]] / 1e9,
                           "wrench_t_s": f["wrench/t_ns"][part["wrench"]] / 1e9,
                           "force_n": f["wrench/quanta"][part["wrench"]][:, :3] / f["wrench/quanta"].attrs["per_unit"],
                           "runs": [(chr(f["phases/phase"][k]), int(f["phases/first"][k]) - first["taxel"], int(f["phases/samples"][k])) for k in own]})
        return trials


def is_line(line, x, y):
    return numpy.array_equal(line.get_xdata(), x) and numpy.allclose(line.get_ydata(), y, rtol=0, atol=1e-9)


def title(figure):
    return figure.get_suptitle()


def trial_figure(t, figure, true):
    upper, lower = figure.axes
    t.expect(title(figure) == f"SIMULATED: {true['file']}", f"title: {title(figure)}")
    t.expect((upper.get_ylabel(), lower.get_ylabel(), lower.get_xlabel())
             == ("force [N]", "taxels above rest [count]", "time of the campaign's clock [s]"), "labels of the trial")
    forces, taxels = upper.get_lines(), lower.get_lines()
    t.expect([line.get_label() for line in forces] == ["Fx", "Fy", "Fz"], f"{len(forces)} lines of force")
    t.expect(all(is_line(line, true["wrench_t_s"], true["force_n"][:, k]) for k, line in enumerate(forces)), "values of the force")
    above = true["counts"] - true["counts"][true["phase"] == b"S"].mean(axis=0)
    t.expect(len(taxels) == TAXELS and all(is_line(line, true["t_s"], above[:, k]) for k, line in enumerate(taxels)), f"{len(taxels)} lines of taxels")
    t.expect(true["force_n"][:, 2].max() > 4 and abs(above).max() > 100, "the trial has no press")
    spans = [(true["t_s"][first], true["t_s"][first + samples - 1]) for _, first, samples in true["runs"]]
    t.expect([phase for phase, _, _ in true["runs"]] == list("SPME"), f"phases of the trial: {true['runs']}")
    for axes in upper, lower:
        drawn = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
        t.expect([patch.get_label() for patch in axes.patches] == ["_S", "_P", "_M", "_E"] and numpy.allclose(drawn, spans, rtol=0, atol=1e-9),
                 f"phases: {drawn}, not {spans}")
    t.expect([(text.get_text(), text.get_position()[0]) for text in upper.texts] == [(phase, true["t_s"][first]) for phase, first, _ in true["runs"]],
             "names of the phases")


def features_figure(t, figure, trials):
    axes, = figure.axes
    t.expect(title(figure) == f"SIMULATED: {TRIALS} trials", f"title: {title(figure)}")
    t.expect((axes.get_xlabel(), axes.get_ylabel()) == ("taxel", "mean of phase M above rest [count]"), "labels of the features")
    lines = axes.get_lines()
    t.expect(len(lines) == len(trials) == TRIALS, f"{len(lines)} lines of {len(trials)} trials")
    for line, true in zip(lines, trials):
        mean = {phase: true["counts"][true["phase"] == phase].mean(axis=0) for phase in (b"S", b"M")}
        t.expect(line.get_label() == true["label"] and is_line(line, range(1, TAXELS + 1), mean[b"M"] - mean[b"S"]), f"features of {true['file']}")
    colours = {line.get_label(): line.get_color() for line in lines}
    legend = axes.get_legend()
    t.expect(len(set(colours.values())) == len(FABRICS) and all(line.get_color() == colours[line.get_label()] for line in lines), f"{colours}")
    t.expect({text.get_text(): handle.get_color() for text, handle in zip(legend.get_texts(), legend.legend_handles)} == colours, "legend")


def confusion_figure(t, figure, folder):
    evaluation = json.loads((folder / "handover/evaluation.json").read_text())["explorations"]["M1"]
    axes, = figure.axes
    count = numpy.asarray(axes.images[0].get_array())
    t.expect(title(figure) == f"SIMULATED: M1, accuracy {evaluation['accuracy']:.0%}", f"title: {title(figure)}")
    t.expect((axes.get_xlabel(), axes.get_ylabel()) == ("predicted fabric [trials]", "true fabric [trials]"), "labels of the confusion")
    t.expect(len(axes.images) == 1 and count.tolist() == evaluation["confusion"]["count"] and count.sum() == TRIALS, f"confusion: {count}")
    t.expect(sorted(evaluation["confusion"]["labels"]) == FABRICS, f"{evaluation['confusion']}")
    t.expect(all([tick.get_text() for tick in ticks] == evaluation["confusion"]["labels"] for ticks in (axes.get_xticklabels(), axes.get_yticklabels())),
             "fabrics of the confusion")
    t.expect([(text.get_position(), text.get_text()) for text in axes.texts]
             == [((column, row), str(int(count[row, column]))) for row in range(len(FABRICS)) for column in range(len(FABRICS))], "cells of the confusion")
    # Each fabric has as many trials; a fabric may be predicted more often. A symmetric confusion would hide swapped axes.
    t.expect(count.sum(axis=1).tolist() == [REPETITIONS] * len(FABRICS) and count.tolist() != count.T.tolist(), f"rows of the confusion: {count}")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-notebook-") as folder:
        d = pathlib.Path(folder)
        (d / "recipes").mkdir()
        recipe = json.loads((ROOT / "recipes/library/first.json").read_text())
        recipe.pop("$schema")
        recipe.update(fabrics=FABRICS, repetitions=REPETITIONS, hand_over={"learner": "lda", "groups": 2})
        phases = recipe["explorations"]["M1"]["phases"]
        for phase in phases:
            phase.update({"path": [{"dx_mm": 0, "dy_mm": 2}]} if "path" in phase else {"duration_s": 1})  # short: some predictions are wrong
        (d / "recipes/small.json").write_text(json.dumps(recipe))
        daemon = Daemon(sys.argv[1], ROOT, d)
        try:
            os.environ.update(WEFT_SOCKET=str(daemon.socket), WEFT_RECIPE="small")
            ran, skipped = run_notebook.run(ROOT / "clients/python/examples/first_campaign.ipynb")
        finally:
            daemon.process.kill()
        t.expect(skipped == [] and plt.get_figlabels() == ["trial", "features", "confusion M1"], f"skipped {skipped}; figures {plt.get_figlabels()}")
        done = d / "data/R-000001"
        trials = read(done / "dataset.h5")
        trial_figure(t, plt.figure("trial"), trials[0])
        features_figure(t, plt.figure("features"), trials)
        confusion_figure(t, plt.figure("confusion M1"), done)
        for name in plt.get_figlabels():
            plt.figure(name).savefig(d / f"{name}.png")
            t.expect((d / f"{name}.png").stat().st_size > 5000, f"{name}: empty picture")
        print(f"SIMULATED notebook: {ran} cells, {len(plt.get_fignums())} figures of {len(trials)} trials")
    t.finish()


if __name__ == "__main__":
    main()
