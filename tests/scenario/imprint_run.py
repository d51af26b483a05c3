#!/usr/bin/env python3
"""A campaign of presses on the simulated imprint array: run, data set, handover to the experiments, evaluate. All SIMULATED.

    imprint_run.py WEFT ROOT

Four objects of two classes, lightly and heavily, at level Z; Ellis' twelve at level Z+ are recipes/library/imprint.json.
"""
import json
import pathlib
import sqlite3
import struct
import sys
import tempfile

from cli_support import Checks

OBJECTS = {"planar": ["PLANE1", "PLANE2"], "rasp": ["RASP1", "RASP2"]}


def inputs(root, d):
    recipe = json.loads((root / "recipes/library/imprint.json").read_text())
    recipe["classes"] = OBJECTS
    recipe["fabrics"] = [name for names in OBJECTS.values() for name in names]
    rig = json.loads((root / "sim/rigs/imprint12.json").read_text())
    for key in ("fidelity", "fabrics"):
        rig["simulation"][key] = str(root / "sim" / pathlib.Path(rig["simulation"][key]).name)
    for device in rig["devices"]:
        if device["role"] == "taxels":
            device["emulator"]["level"] = "Z"
    (d / "recipe.json").write_text(json.dumps(recipe))
    (d / "rig.json").write_text(json.dumps(rig))


def run(t, d, out):
    ran = t.run("run", "recipe.json", "--rig", "rig.json", "--out", out, "--json", cwd=d)
    t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stderr}")
    return json.loads(ran.stdout)


def look_at_run(t, d):
    told = run(t, d, "first")
    t.expect(told["bench"] == "simulated", f"bench: {told['bench']}")
    t.expect(told["trials_complete"] == 8, f"trials: {told['trials_complete']}")
    t.expect("not_classified" not in told, f"not classified: {told.get('not_classified')}")
    t.expect(told["handover"]["state"] == "done", f"handover: {told['handover']}")
    info = t.succeeds("dataset", "info", "first/dataset.h5", cwd=d)
    t.expect(info["taxels"] == 1024, f"taxels: {info['taxels']}")
    t.expect(sorted(info["labels"]) == ["PLANE1", "PLANE2", "RASP1", "RASP2"], f"labels: {info['labels']}")
    t.expect(t.run("verify", "first", cwd=d).returncode == 0, "verify")
    again = t.run("run", "recipe.json", "--rig", "rig.json", "--out", "again", "--no-evaluate", "--json", cwd=d)
    t.expect(json.loads(again.stdout)["dataset_sha256"] == told["dataset_sha256"], "the same seed records the same scans")
    return told


def scans(d):
    """Counts of every recorded scan: {(object, exploration): [(phase, counts)]}, from the campaign file (docs/reference/dataset.md)."""
    out = {}
    with sqlite3.connect(d / "first/campaign.sqlite") as campaign:
        for label, exploration, rows, data in campaign.execute(
                "SELECT label, exploration, rows, data FROM chunk JOIN trial ON trial.id = chunk.trial WHERE stream = 0 ORDER BY chunk.trial, number"):
            size = len(data) // rows
            for at in range(0, len(data), size):
                row = data[at:at + size]
                out.setdefault((label, exploration), []).append((chr(row[16]), struct.unpack("<1024H", row[17:])))
    return out


def look_at_scans(t, d):
    mean = {}
    for press, recorded in scans(d).items():
        t.expect([p for p, _ in recorded] == sorted((p for p, _ in recorded), key="SPE".index), f"{press}: phases")
        t.expect(all(max(counts) <= 127 for _, counts in recorded), f"{press}: more than seven bits")
        last = dict(recorded)
        mean[press] = {phase: sum(counts) / len(counts) for phase, counts in last.items()}
        if press == ("RASP1", "heavy"):
            t.expect(max(last["P"]) == 127, "50 N on teeth saturate some taxels")
    for names in OBJECTS.values():
        for name in names:
            light, heavy = mean[name, "light"], mean[name, "heavy"]
            t.expect(heavy["P"] > 1.2 * light["P"], f"{name}: 50 N read {heavy['P']}, 20 N {light['P']}")
            t.expect(heavy["P"] > 5 * heavy["S"], f"{name}: the probe's weight reads {heavy['S']}")
    rasp = mean["RASP1", "heavy"]
    print("SIMULATED mean counts of RASP1, heavy:", {k: round(v, 2) for k, v in rasp.items()})
    t.expect(rasp["E"] > 1.05 * rasp["S"], "under the same weight the cover remembers the press")


def look_at_report(t, d):
    """The report names the page of imprints, and that page exists there."""
    page = (d / "first/report.html").read_text()
    t.expect("SIMULATED" in page, "the report is not marked as simulated")
    t.expect("handover/imprints.html" in page and "handover/imprints.model" in page, "the report does not name the page of imprints and their model")
    for name in ("handover/imprints.html", "handover/imprints.model"):
        t.expect((d / "first" / name).is_file(), f"the report names {name}, which is not there")
    t.expect("M1, paper" not in page and "M2, paper" not in page, "rows of another paper's explorations")


def look_at_hand_over(t, d, told):
    page = (d / "first/handover/imprints.html").read_text()
    t.expect("SIMULATED" in page.upper(), "the page is not marked as simulated")
    t.expect("22 / 24 (92 %)" in page, "the page lacks the paper's figures")
    handed = json.loads((d / "first/handover/evaluation.json").read_text())
    t.expect(handed["dataset_sha256"] == told["dataset_sha256"], "another data set's hand-over")
    tables = json.loads((d / "first/handover/imprints.json").read_text())
    t.expect((tables["imprints"], tables["classes"], tables["objects"]) == (8, 2, 4), f"{tables['imprints']}")
    t.expect(len(tables["sets"]) == 2 * 7 + 2, f"{len(tables['sets'])} sets of features")
    three_scales = next(s for s in tables["sets"] if s["scales"] == [1, 2, 4] and s["features"] == "10")
    for name in ("1/N", "2/N"):
        row = three_scales["experiments"][name]
        print(f"SIMULATED {name} at 1, 2, 4, 10 features: paper {row['paper']['correct']} of 24;",
              {rule: cell["correct"] for rule, cell in row.items() if rule != "paper"}, "of 8")
        # teeth and planes differ strongly
        t.expect(row["perceptron-zscore"]["correct"] >= 7 and row["lda"]["correct"] >= 7, f"{name}: {row}")
    [model] = told["handover"]["models"]
    [headline] = json.loads((d / "first/report.json").read_text())["headline"]
    classes = handed["explorations"]["imprints"]["confusion"]["labels"]
    t.expect(headline["labels"] == len(classes) and headline["accuracy"] == model["accuracy"], f"headline: {headline}, classes {classes}")
    print(f"SIMULATED handed-over model ({model['learner']}): {model['accuracy']} of objects never seen")
    t.expect((model["model"], model["trained"], model["asked"]) == ("handover/imprints.model", 8, 8), f"model: {model}")
    t.expect(handed["models"] == [model] and handed["explorations"]["imprints"]["left_out"] == "one object", f"{handed.keys()}")
    kept = t.succeeds("classify", "first/" + model["model"], "first/dataset.h5", cwd=d)
    t.expect(kept["model_bench"] == "simulated" and len(kept["imprints"]) == 8, f"classify: {kept}")
    t.expect(all(one["label"] == one["true_label"] for one in kept["imprints"]), f"what it was trained on: {kept['imprints']}")
    same = t.run("imprint", "tables", "first/dataset.h5", "--json", cwd=d)
    t.expect(json.loads(same.stdout)["sets"] == tables["sets"], "the command finds other figures than the hand-over")


def look_at_evaluate(t, d):
    asked = t.succeeds("evaluate", "first/dataset.h5", "--learner", "lda", "--train-groups", "PLANE1,RASP1", "--test-groups",
                       "PLANE2,RASP2", cwd=d)
    t.expect(asked["labels"] == ["planar", "rasp"], f"evaluate does not know the recipe's classes: {asked['labels']}")
    accuracy = asked["results"]["lda"]["accuracy"]
    print("SIMULATED evaluate, objects never seen:", accuracy)
    t.expect(accuracy >= 0.75, f"accuracy {accuracy}")
    part = t.succeeds("imprint", "search", "first/dataset.h5", "--groups", "PLANE1,RASP1,PLANE2,RASP2", "--rule", "lda", "--scales", "1,2", cwd=d)
    t.expect(part["imprints"] == 8, f"search on some of the objects: {part}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        d = pathlib.Path(folder)
        inputs(root, d)
        told = look_at_run(t, d)
        look_at_scans(t, d)
        look_at_report(t, d)
        look_at_hand_over(t, d, told)
        look_at_evaluate(t, d)
    t.finish()


main()
