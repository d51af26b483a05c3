#!/usr/bin/env python3
"""`weft run`: a small campaign on the simulated bench, its report, its repeatability and what follows from its data set.

    cli_run.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import sys
import tempfile

from cli_support import Checks

FABRICS, REPETITIONS = ["denim", "velvet"], 5


def run(t, d, rig, *more, out):
    ran = t.run("run", "recipe.json", "--rig", rig, "--out", out, "--json", *more, cwd=d)
    t.expect(ran.returncode == 0, f"run {more}: {ran.returncode} {ran.stderr}")
    t.expect("\r" not in ran.stderr, "no bar away from a terminal")
    return json.loads(ran.stdout) if ran.returncode == 0 else {}


def two_explorations(t, d, root, rig):
    """A model of one exploration answers for trials of that one alone."""
    for name, library in {"both": "khan2016", "only_m2": "m2"}.items():
        recipe = json.loads((root / f"recipes/library/{library}.json").read_text())
        recipe.update(name=name, fabrics=FABRICS, repetitions=3)
        del recipe["$schema"]
        (d / f"{name}.json").write_text(json.dumps(recipe))
        ran = t.run("run", f"{name}.json", "--rig", rig, "--out", name, "--no-evaluate", cwd=d)
        t.expect(ran.returncode == 0, f"run {name}: {ran.stderr}")
    trained = t.succeeds("train", "a/dataset.h5", "-o", "m1.weft", cwd=d)
    t.expect(trained["exploration"] == "M1", f"the only exploration is stored: {trained}")
    answers = t.succeeds("classify", "m1.weft", "both/dataset.h5", cwd=d)["trials"]
    t.expect(len(answers) == 6 and all("-M1-" in a["file"] for a in answers), f"M1 of M1 and M2: {answers}")
    error = t.refuses("classify", "m1.weft", "only_m2/dataset.h5", cwd=d, says=["only_m2", "M1", "got M2"])
    t.expect("--" not in error.get("sentence", "--"), f"classify has no option to choose: {error}")
    t.refuses("train", "both/dataset.h5", "-o", "x.weft", cwd=d, says=["M1, M2", "--exploration"])
    t.succeeds("train", "both/dataset.h5", "-o", "m2.weft", "--exploration", "M2", cwd=d)
    answers = t.succeeds("classify", "m2.weft", "only_m2/dataset.h5", cwd=d)["trials"]
    t.expect(len(answers) == 6, f"M2: {answers}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    with tempfile.TemporaryDirectory(prefix="weft-run-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((root / "recipes/library/m1.json").read_text())
        recipe.update(name="small", fabrics=FABRICS, repetitions=REPETITIONS)
        del recipe["$schema"]
        (d / "recipe.json").write_text(json.dumps(recipe))
        trials = len(FABRICS) * REPETITIONS

        first = run(t, d, rig, "--repeats", "3", out="a")
        t.expect(first["trials_complete"] == first["trials_planned"] == trials, f"trials: {first}")
        t.expect(first["bench"] == "simulated" and "not_classified" not in first, f"run: {first}")
        t.expect(first["virtual_s"] > trials * 36, "36 s of phases a trial at least")
        report = json.loads((d / "a/report.json").read_text())
        t.expect(report["bench"] == "simulated" and report["trials_complete"] == trials, "report.json")
        for reduction in ("pvalue", "pca", "all"):
            result = report["results"]["M1"][reduction]
            t.expect(0 <= result["ci95"][0] <= result["accuracy"] <= result["ci95"][1] <= 1, f"{reduction}: {result}")
        t.expect("simulated" in (d / "a/report.html").read_text().lower(), "report.html says simulated")

        again = run(t, d, rig, "--no-evaluate", out="b")
        other = run(t, d, rig, "--no-evaluate", "--seed", "77", out="c")
        t.expect(again["dataset_sha256"] == first["dataset_sha256"], "same seed, same data")
        t.expect(other["dataset_sha256"] != first["dataset_sha256"], "another seed, other data")
        t.expect(not (d / "b/report.json").exists(), "--no-evaluate writes no report")
        t.refuses("run", "recipe.json", "--rig", rig, "--out", "a", cwd=d, says=["a/campaign.sqlite"])

        info = t.succeeds("dataset", "info", "a/dataset.h5", cwd=d)
        t.expect(info["bench"] == "simulated" and info["explorations"] == ["M1"], f"info: {info}")
        t.expect(info["dataset_sha256"] == first["dataset_sha256"], "info names the digest of the run")
        plain = t.run("train", "a/dataset.h5", "-o", "m.weft", cwd=d)
        t.expect("SIMULATED" in plain.stdout, f"train says what the data are: {plain.stdout}{plain.stderr}")
        answers = t.succeeds("classify", "m.weft", "c/dataset.h5", cwd=d)
        t.expect(answers["model_bench"] == "simulated" and len(answers["trials"]) == trials, f"classify: {answers}")
        two_explorations(t, d, root, rig)
    t.finish()


main()
