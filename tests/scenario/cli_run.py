#!/usr/bin/env python3
"""`weft run`: a small campaign on the simulated bench, its report, its repeatability and the use of its data set.

    cli_run.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from cli_support import Checks, has, line_has

FABRICS, REPETITIONS = ["denim", "velvet"], 5


def run(t, d, rig, *more, out):
    ran = t.run("run", "recipe.json", "--rig", rig, "--out", out, "--json", *more, cwd=d)
    t.expect(ran.returncode == 0, f"run {more}: {ran.returncode} {ran.stderr}")
    t.expect("\r" not in ran.stderr, "no bar away from a terminal")
    return json.loads(ran.stdout) if ran.returncode == 0 else {}


def two_explorations(t, d, root, rig):
    """A model of one exploration classifies only trials of that exploration."""
    for name, library in {"both": "khan2016", "only_m2": "m2"}.items():
        recipe = library_recipe(d, root, name, library, fabrics=FABRICS, repetitions=3)
        ran = t.run("run", recipe, "--rig", rig, "--out", name, "--no-evaluate", cwd=d)
        t.expect(ran.returncode == 0, f"run {name}: {ran.stderr}")
    trained = t.succeeds("train", "a/dataset.h5", "-o", "m1.weft", cwd=d)
    t.expect(trained["exploration"] == "M1", f"the only exploration is stored: {trained}")
    answers = t.succeeds("classify", "m1.weft", "both/dataset.h5", cwd=d)["trials"]
    t.expect(len(answers) == 6 and all("-M1-" in a["file"] for a in answers), f"M1 of M1 and M2: {answers}")
    error = t.refuses("classify", "m1.weft", "only_m2/dataset.h5", cwd=d, where=["only_m2"], got="M2", expected="M1")
    t.expect("--" not in error.get("sentence", "--"), f"classify has no option to choose: {error}")
    t.refuses("train", "both/dataset.h5", "-o", "x.weft", cwd=d, got="M1, M2", says=["--exploration"])
    t.succeeds("train", "both/dataset.h5", "-o", "m2.weft", "--exploration", "M2", cwd=d)
    answers = t.succeeds("classify", "m2.weft", "only_m2/dataset.h5", cwd=d)["trials"]
    t.expect(len(answers) == 6, f"M2: {answers}")


def library_recipe(d, root, name, library="m1", **changes):
    recipe = json.loads((root / f"recipes/library/{library}.json").read_text())
    recipe.update(name=name, **changes)
    del recipe["$schema"]
    (d / f"{name}.json").write_text(json.dumps(recipe))
    return f"{name}.json"


def not_classified(t, d, root, rig):
    """One fabric cannot be classified: the data are kept, and the exit status shows that a part failed."""
    recipe = library_recipe(d, root, "alone", fabrics=["denim"], repetitions=2)
    ran = t.run("run", recipe, "--rig", rig, "--out", "alone", "--json", cwd=d)
    t.expect(ran.returncode == 1, f"not classified: status {ran.returncode}")
    t.expect(line_has(ran.stderr, ["classified", "alone/dataset.h5", "2", "3"]), f"sentence: {ran.stderr}")
    summary = json.loads(ran.stdout)
    t.expect(summary["complete"] and "not_classified" in summary, f"not classified: {summary}")
    t.expect((d / "alone/report.html").is_file(), "the report is written all the same")
    t.succeeds("dataset", "info", "alone/dataset.h5", cwd=d)
    ran = t.run("run", recipe, "--rig", rig, "--out", "alone2", "--no-evaluate", cwd=d)
    t.expect(ran.returncode == 0, f"--no-evaluate: status {ran.returncode} {ran.stderr}")


def handed_over(t, d, root, rig):
    """The handover follows the recipe and has its digests."""
    recipe = library_recipe(d, root, "handed", fabrics=FABRICS, repetitions=4, hand_over={"learner": "lda", "groups": 2})
    ran = t.run("run", recipe, "--rig", rig, "--out", "handed", "--repeats", "2", "--json", cwd=d)
    t.expect(ran.returncode == 0, f"handed over: {ran.returncode} {ran.stderr}")
    told = json.loads(ran.stdout)["handover"]
    t.expect(told["state"] == "done" and told["bench"] == "simulated" and told["models"][0]["asked"] == 8, f"handed over: {told}")
    t.succeeds("verify", "handed", cwd=d)
    answers = t.succeeds("classify", "handed/handover/M1.model", "c/dataset.h5", cwd=d)["trials"]
    t.expect(len(answers) == len(FABRICS) * REPETITIONS, f"it answers on another campaign: {answers}")
    with (d / "handed/handover/M1.model").open("ab") as model:
        model.write(b"\n")
    found = t.run("verify", "handed", cwd=d)
    t.expect(found.returncode == 1 and "M1.model" in found.stdout, f"altered: {found.stdout}")


def some_failed(t, d, root, rig):
    """With a rigid face 1.3 s are enough to settle on firm fabric and too few on velvet: complete trials are classified, and the result is marked."""
    changed = json.loads((root / "sim/rigs/bench17.json").read_text())
    changed["simulation"].update(cover_um=0, fabrics=str(root / "sim/fabrics.json"), fidelity=str(root / "sim/fidelity.json"))
    rig = d / "rigid.json"
    rig.write_text(json.dumps(changed))
    recipe = library_recipe(d, root, "some", fabrics=["denim", "velvet", "satin"], repetitions=4,
                            on_trial_failure="continue", settle={"dwell_s": 0.5, "timeout_s": 1.3})
    ran = t.run("run", recipe, "--rig", rig, "--out", "some", "--repeats", "2", "--json", cwd=d)
    t.expect(ran.returncode == 1, f"incomplete: status {ran.returncode}")
    summary = json.loads(ran.stdout)
    complete = summary["trials_complete"]
    t.expect(summary["trials_planned"] == 12 and 0 < complete < 12 and not summary["complete"], f"incomplete: {summary}")
    words = ["INCOMPLETE", str(complete), "12"]
    t.expect(line_has(ran.stderr, words), f"incomplete, not shown: {ran.stderr}")
    report = json.loads((d / "some/report.json").read_text())
    t.expect(report["complete"] is False and report["results"]["M1"]["trials"] == complete, f"report: {report['results']}")
    t.expect(report["results"]["M1"]["pvalue"]["confusion"]["labels"] == ["denim", "satin"], "classes that are there")
    page = (d / "some/report.html").read_text()
    marks = re.findall(rf"INCOMPLETE\D+{complete}\D+12\b", page)
    t.expect(len(marks) > 8, f"marked {len(marks)} times")
    info = t.succeeds("dataset", "info", "some/campaign.sqlite", cwd=d)
    t.expect(info["trials"] == complete and info["left_out"] == {"failed": 12 - complete}, f"left out: {info}")
    made = t.succeeds("dataset", "export", "some/campaign.sqlite", "-o", "some.h5", cwd=d)
    t.expect(made["dataset_sha256"] == summary["dataset_sha256"], "the same data set by hand")


def killed(t, d, root, rig):
    """A killed run leaves its complete trials in the campaign file."""
    recipe = library_recipe(d, root, "killed", repetitions=20)
    run = subprocess.Popen([t.weft, "run", recipe, "--rig", rig, "--out", "killed"], cwd=d, stderr=subprocess.PIPE, text=True)
    run.stderr.readline()  # the first twentieth is complete
    run.kill()
    run.communicate()
    t.expect(not (d / "killed/dataset.h5").exists(), "killed before its export")
    info = t.succeeds("dataset", "info", "killed/campaign.sqlite", cwd=d)
    t.expect(17 <= info["trials"] < 340 and not info["finished"], f"killed: {info}")
    made = t.run("dataset", "export", "killed/campaign.sqlite", "-o", "killed.h5", cwd=d)
    t.expect(made.returncode == 0 and line_has(made.stdout, [str(info["trials"]), "340"]), made.stdout + made.stderr)
    again = t.succeeds("dataset", "info", "killed.h5", cwd=d)
    t.expect(again["dataset_sha256"] == info["dataset_sha256"] and again["trials"] == info["trials"], f"export: {again}")
    left = sum(info["left_out"].values()) + info["never_begun"]
    t.expect(info["trials"] + left == 340, f"none is forgotten: {info}")
    t.refuses("train", "killed/campaign.sqlite", "-o", "x.weft", cwd=d, where="killed/campaign.sqlite", got="SQLite", expected="HDF5",
              says=["weft dataset export"])
    t.refuses("dataset", "export", "killed/campaign.sqlite", "-o", "killed/../killed/campaign.sqlite", cwd=d, code="invalid argument",
              where="killed/../killed/campaign.sqlite", got="")
    t.refuses("dataset", "export", "killed.h5", "-o", "x.h5", cwd=d, says=["killed.h5"])


def inputs_are_kept(t, d, root, rig):
    (d / "own").mkdir()
    (d / "own/report.json").write_text((d / "recipe.json").read_text())
    t.refuses("run", "own/report.json", "--rig", rig, "--out", "own", cwd=d, code="invalid argument", where="own/report.json", got="")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    with tempfile.TemporaryDirectory(prefix="weft-run-") as folder:
        d = pathlib.Path(folder)
        library_recipe(d, root, "recipe", fabrics=FABRICS, repetitions=REPETITIONS)
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
        t.expect("SIMULATED" in (d / "a/report.html").read_text(), "report.html is marked")
        simulation = report["simulation"]
        t.expect(simulation["setting"] == "L1 3.072 ms" and len(simulation["errors"]) == 1, f"simulation: {simulation}")
        t.expect(simulation["errors"][0]["trials"] == len(FABRICS), f"one trial of each fabric: {simulation}")
        t.expect(has(simulation["sentence"], ["L1 3.072 ms", simulation["because"]]), f"sentence: {simulation}")
        t.expect(simulation["sentence"] in (d / "a/report.html").read_text(), "the page has the sentence")

        again = run(t, d, rig, "--no-evaluate", "--no-error-check", out="b")
        t.expect(again["simulation"]["errors"] == [] and first["simulation"] == simulation, "no error is looked for")
        other = run(t, d, rig, "--no-evaluate", "--seed", "77", out="c")
        t.expect(again["dataset_sha256"] == first["dataset_sha256"], "same seed, same data")
        t.expect(other["dataset_sha256"] != first["dataset_sha256"], "another seed, other data")
        t.expect(not (d / "b/report.json").exists(), "--no-evaluate writes no report")
        t.refuses("run", "recipe.json", "--rig", rig, "--out", "a", cwd=d, says=["a/campaign.sqlite"])

        info = t.succeeds("dataset", "info", "a/dataset.h5", cwd=d)
        t.expect(info["bench"] == "simulated" and info["explorations"] == ["M1"], f"info: {info}")
        t.expect(info["dataset_sha256"] == first["dataset_sha256"], "info names the digest of the run")
        plain = t.run("train", "a/dataset.h5", "-o", "m.weft", cwd=d)
        t.expect("SIMULATED" in plain.stdout, f"train marks its data: {plain.stdout}{plain.stderr}")
        answers = t.succeeds("classify", "m.weft", "c/dataset.h5", cwd=d)
        t.expect(answers["model_bench"] == "simulated" and len(answers["trials"]) == trials, f"classify: {answers}")
        for more in (two_explorations, not_classified, handed_over, some_failed, killed, inputs_are_kept):
            more(t, d, root, rig)
    t.finish()


main()
