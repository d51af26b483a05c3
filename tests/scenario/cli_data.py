#!/usr/bin/env python3
"""`weft` with a small made-up data set: import, info, features, train, classify, evaluate; then bad input.

    cli_data.py WEFT
"""
import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

from cli_support import Checks, error_of, fits, line_has
from made_up_cloths import RATE_HZ, TAXELS, write_manifest, write_set, write_trial


def good_path(t, d, rows):
    made = t.succeeds("dataset", "import", "manifest.csv", "-o", "d.h5", cwd=d)
    info = t.succeeds("dataset", "info", "d.h5", cwd=d)
    t.expect(info["trials"] == 24 and info["taxels"] == TAXELS, f"info: {info}")
    t.expect(info["labels"] == {"cotton": 8, "silk, raw": 8, "wool": 8}, f"labels: {info['labels']}")
    t.expect(info["groups"] == ["A", "B"] and info["bench"] == "unknown", f"groups, bench: {info}")
    t.expect(info["dataset_sha256"] == made["dataset_sha256"], "import and info name the same digest")
    t.expect(abs(info["taxel_rate_hz"] - RATE_HZ) < 1e-6, f"rate: {info['taxel_rate_hz']}")

    made = t.succeeds("features", "d.h5", "-o", "f.csv", cwd=d)
    with open(d / "f.csv", newline="") as f:
        table = list(csv.reader(f))
    t.expect(sorted(made["units"]) == sorted(table[0][3:]), f"a unit for every feature: {made}")
    for name, unit in (("mean.P", "count"), ("var.M.2", "count^2"), ("kurt.M.1", "1"), ("m5.M.3", "count^5")):
        t.expect(made["units"][name] == unit, f"{name}: {made['units'][name]}, not {unit}")
    t.expect("[count^5] m5.M.1, m5.M.2, m5.M.3" in t.run("features", "d.h5", "-o", "f.csv", cwd=d).stdout, "units in text")
    t.expect(table[0][:5] == ["file", "label", "group", "mean.P", "diff.SP"], f"header: {table[0][:5]}")
    t.expect(len(table) == 25 and {len(r) for r in table} == {3 + 3 + 12 * TAXELS}, "a row a trial, Table I wide")
    t.expect([r[:3] for r in table[1:]] == rows, "file, label and group as in the manifest")
    with open(d / rows[0][0], newline="") as f:
        pressed = [list(map(float, r[2:])) for r in csv.reader(f) if r[1] == "P"]
    mean_p = sum(map(sum, pressed)) / (len(pressed) * TAXELS)
    t.expect(abs(float(table[1][3]) / mean_p - 1) < 1e-12, f"mean.P {table[1][3]} is not {mean_p}")

    trained = t.succeeds("train", "d.h5", "-o", "m.weft", "--seed", "3", "--learner", "pvalue", cwd=d)
    t.expect(trained["cores"] == 3 and trained["bench"] == "unknown", f"train: {trained}")
    for rule, options in (("loss", []), ("order", ["--paper-selection"]), ("order", ["--tie", "order"]),
                          ("loss", ["--paper-selection", "--tie", "loss"])):
        said = t.succeeds("train", "d.h5", "-o", "t.weft", "--learner", "pvalue", *options, cwd=d)["training"]
        t.expect(said.endswith(f"ties by {rule}") and said in (d / "t.weft").read_text(), f"{options}: {said}")
    machines = {}
    for options in ((), ("--t-test", "pooled"), ("--t-test", "welch"), ("--solver", "own"), ("--solver", "libsvm")):
        ran = t.succeeds("train", "d.h5", "-o", "t.weft", "--seed", "3", "--learner", "pvalue", *options, cwd=d)
        machines[options] = [line for line in (d / "t.weft").read_text().split("\n")
                             if not line.startswith(("training ", "cv_errors,", "head_crc32 ", "crc32 "))]
        t.expect(ran["unconverged"] == 0, f"{options}: {ran}")
        t.expect(("Welch" in ran["training"]) == ("welch" in options), f"{options}: {ran['training']}")
        t.expect(("libsvm" in ran["training"]) == ("libsvm" in options), f"{options}: {ran['training']}")
        if options in (("--t-test", "pooled"), ("--solver", "own")):
            t.expect((d / "t.weft").read_bytes() == (d / "m.weft").read_bytes(), f"{options} is the default")
    t.expect(machines[("--solver", "libsvm")] == machines[()], "the reference solver trains another model")
    t.expect(machines[("--t-test", "welch")] != machines[()], "Welch's test changes nothing")
    for solver in ("own", "libsvm"):
        e = t.succeeds("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--learner", "pvalue,svc", "--solver",
                       solver, "--t-test", "welch", "--answers", cwd=d)
        machines[solver] = {k: (r["answers"], r["accuracy"]) for k, r in e["results"].items()}
    t.expect(machines["own"] == machines["libsvm"], f"solvers answer differently: {machines}")
    for option in ("--t-test", "--solver"):
        t.refuses("train", "d.h5", "-o", "x.weft", option, "best", cwd=d, says=[option], status=2)
    write_trial(d / "new.csv", 80, 5, 999)
    answer = t.succeeds("classify", "m.weft", "new.csv", cwd=d)["trials"][0]
    t.expect(answer["label"] == "wool" and answer["votes"]["wool"] == 2, f"classify: {answer}")
    everything = t.succeeds("classify", "m.weft", "d.h5", cwd=d)["trials"]
    t.expect(len(everything) == 24 and all(a["label"] == a["true_label"] for a in everything), "training trials known")
    t.expect(abs(sum(answer["probability"].values()) - 1) < 1e-9 and "none_of_these" in answer, f"probability: {answer}")
    for kind, cores in (("soft", 3), ("dag", 2), ("shortlist", 1)):
        voted = t.succeeds("classify", "m.weft", "new.csv", "--vote", kind, *["--shortlist", "2"] * (kind == "shortlist"), cwd=d)
        one = voted["trials"][0]
        t.expect(voted["vote"] == kind and one["label"] == "wool" and one["cores_asked"] == cores, f"{kind}: {voted}")
        t.expect(("probability" in one) == (kind != "dag"), f"a DAG has no probability: {voted}")
    t.refuses("classify", "m.weft", "new.csv", "--vote", "loudest", cwd=d, says=["--vote"], status=2)

def every_learner(t, d):
    """Every learner of evaluate can be trained, stored and used. A trial comes as a file, in a data set, or through a pipe."""
    for learner in ("pvalue", "pca", "all", "lda", "svc", "trees", "cores-best", "best"):
        trained = t.succeeds("train", "d.h5", "-o", "l.weft", "--learner", learner, cwd=d)
        t.expect(learner.endswith("best") or trained["learner"] == learner, f"{learner}: {trained}")
        t.expect(("cores" in trained) == (trained["learner"] not in ("lda", "svc", "trees")), f"{learner}: {trained}")
        t.expect(("candidates" in trained) == learner.endswith("best"), f"{learner}: {trained}")
        said = t.succeeds("classify", "l.weft", "d.h5", cwd=d)
        t.expect(said["learner"] == trained["learner"], f"{learner}: {said['learner']}")
        t.expect(len(said["trials"]) == 24, f"{learner}: {len(said['trials'])} answers")
        for a in said["trials"]:
            t.expect(a["label"] == a["true_label"], f"{learner}: {a}")
            t.expect(abs(sum(a["probability"].values()) - 1) < 1e-9 and "none_of_these" in a, f"{learner}: {a}")
            t.expect(("cores_asked" in a) == ("cores" in trained) and ("votes" in a) == (trained["learner"] not in ("lda", "trees")),
                     f"{learner}: {a}")
        again = t.succeeds("train", "d.h5", "-o", "again.weft", "--reduction", learner, "--threads", "1", cwd=d)
        t.expect(again["learner"] == trained["learner"] and (d / "again.weft").read_bytes() == (d / "l.weft").read_bytes(),
                 f"{learner}: threads or the older name of the option change the model")
    chosen = t.succeeds("train", "d.h5", "-o", "l.weft", cwd=d)
    e = t.succeeds("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--learner", "best", cwd=d)
    t.expect(len(chosen["candidates"]) == len(e["results"]["best"]["candidates"]), "the same candidates as evaluate")
    t.succeeds("train", "d.h5", "-o", "l.weft", "--learner", "lda", cwd=d)
    t.refuses("classify", "l.weft", "new.csv", "--vote", "dag", cwd=d, says=["dag", "lda", "cores"])
    t.refuses("train", "d.h5", "-o", "x.weft", "--learner", "oracle", cwd=d, says=["--learner"], status=2)


def name_of(recipe):
    """The name as `weft train` writes it."""
    capped = recipe["learner"] in ("pca", "pvalue")
    return recipe["learner"] + (f", N {recipe['cap']}" if capped else "") + (f', {recipe["view"]}' if recipe["view"] != "plain" else "")


def kept_as_evaluated(t, d):
    """The learner that wins in evaluate is the one that train stores: it gives the same predictions on the same trials. The fabrics overlap (their
    levels differ by less than the noise), and both choices take compressed features."""
    rows = write_set(d, each=16, level=0.5, ripple=0.1)
    t.succeeds("dataset", "import", "manifest.csv", "-o", "d.h5", cwd=d)
    for group in "AB":
        write_manifest(d / f"{group}.csv", [r for r in rows if r[2] == group])
        t.succeeds("dataset", "import", f"{group}.csv", "-o", f"{group}.h5", cwd=d)
    for learner in ("best", "cores-best", "svc", "trees", "lda"):
        ran = t.succeeds("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--learner", learner,
                         "--answers", cwd=d)["results"][learner]
        trained = t.succeeds("train", "A.h5", "-o", "kept.weft", "--learner", learner, cwd=d)
        t.expect(0.3 < ran["accuracy"] < 1, f"{learner}: {ran['accuracy']} right does not tell answers apart")
        for key in ("learner", "view"):
            t.expect(ran["chosen"][0][key] == trained[key], f"{learner}: {ran['chosen']} is not {trained}")
        tried = [(name_of(c), c["errors"], c["tested"]) for c in ran.get("candidates", [])]
        t.expect(tried == [(c["learner"], c["errors"], c["tested"]) for c in trained.get("candidates", [])],
                 f"{learner}: {tried} is not {trained}")
        t.expect(("candidates" in trained) == learner.endswith("best"), f"{learner}: {trained}")
        said = {a["file"]: a["label"] for a in t.succeeds("classify", "kept.weft", "B.h5", cwd=d)["trials"]}
        t.expect(len(said) == 24 and said == dict(ran["answers"][0]), f"{learner}: {said} is not {ran['answers']}")


def through_a_pipe(t, d):
    def piped(data, *arguments):
        return subprocess.run([t.weft, "classify", *arguments], input=data, cwd=d, capture_output=True, timeout=60)

    for name in ("new.csv", "d.h5"):
        by_name = t.succeeds("classify", "m.weft", name, cwd=d)["trials"]
        ran = piped((d / name).read_bytes(), "m.weft", "-", "--json")
        t.expect(ran.returncode == 0, f"{name} through a pipe: {ran.stderr}")
        said = json.loads(ran.stdout)["trials"] if ran.returncode == 0 else []
        t.expect(len(said) == len(by_name), f"{name}: {len(said)} answers through a pipe")
        for a, b in zip(said, by_name):
            t.expect({**a, "file": ""} == {**b, "file": ""}, f"{name}: {a} is not {b}")
    t.expect(b"standard input: wool" in piped((d / "new.csv").read_bytes(), "m.weft", "-").stdout, "named in text")
    half_a_set = (d / "d.h5").read_bytes()[:5000]
    for data, expected in ((b"", {"code": "not found"}), (b"t_s,ch1\n0,x\n", {"code": "parse", "where": ["standard input:2"]}),
                           (half_a_set, {"code": "corrupt", "where": ["standard input"]})):
        ran = piped(data, "m.weft", "-")
        t.expect(ran.returncode == 1 and b"standard input" in ran.stderr and not ran.stdout, f"{data[:20]}: {ran.returncode} {ran.stderr}")
        ran = piped(data, "m.weft", "-", "--json")
        t.expect(ran.returncode == 1 and fits(error_of(ran), **expected), f"{data[:20]} is not {expected}: {ran.stdout}")


def evaluations(t, d):
    for reduction in ("pvalue", "pca", "all", "lda", "svc", "trees", "cores-best", "best"):
        e = t.succeeds("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--reduction", reduction, cwd=d)
        result = e["results"][reduction]
        t.expect(result["accuracy"] == 1.0 and sum(map(sum, result["confusion"]["count"])) == 12, f"{reduction}: {result}")
    every = ["evaluate", "d.h5", "--train-fraction", "0.4", "--repeats", "5", "--seed", "7", "--reduction", "every"]
    a, b = t.succeeds(*every, cwd=d), t.succeeds(*every, "--threads", "1", cwd=d)
    t.expect(list(a["results"]) == ["all", "best", "lda", "pca", "pvalue", "svc", "trees"], f"every: {list(a['results'])}")
    for r in a["results"]:
        t.expect(a["results"][r]["confusion"] == b["results"][r]["confusion"], f"{r}: threads change the result")
        t.expect(len(a["results"][r]["accuracy_of_splits"]) == 5, f"{r}: five splits")


def splits_and_curves(t, d):
    loud = ["evaluate", "d.h5", "--leave-one-group-out", "--learner", "lda,cores-pvalue"]
    e = t.succeeds(*loud, "--learning-curve", "2,3", "--curve-draws", "2", cwd=d)
    t.expect(e["splits"] == 2 and list(e["results"]) == ["lda", "pvalue"], f"two groups: {e['splits']}")
    curve = e["learning_curve"]
    t.expect([p["trials"] for p in curve] == [2, 3] and curve[0]["splits"] == 2 and curve[0]["draws"] == 4, f"curve: {curve}")
    t.expect(all(0.3 <= p["accuracy"]["lda"]["mean"] <= 1 for p in curve), f"curve: {curve}")
    t.refuses(*loud, "--learning-curve", "5", cwd=d, where=["--learning-curve"], expected="4")
    t.refuses(*loud, "--train-fraction", "0.4", cwd=d, says=["--leave-one-group-out"], status=2)
    # without its level a fabric differs by its ripple only; mean.M is zero up to rounding to a count
    t.succeeds("features", "d.h5", "-o", "level.csv", "--remove-level", "motion", cwd=d)
    with open(d / "level.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    t.expect(all(abs(float(r[f"mean.M.{k}"])) <= 0.5 for r in rows for k in (1, 2, 3)), "level removed")
    spelt = ["--train-groups", "A", "--test-groups", "B", "--window-s", "1", "--norm", "rms", "--learner"]
    old = t.succeeds("evaluate", "d.h5", *spelt, "lda,trees", "--window-step-s", "0.5", cwd=d)["results"]
    new = t.succeeds("fabric", "evaluate", *spelt, "lda", "trees", "d.h5", "--step-s", "0.5", cwd=d)["results"]
    t.expect(set(new) == {"lda", "trees"} and all(new[k]["confusion"] == old[k]["confusion"] for k in old), f"two spellings: {old} {new}")
    forest = t.succeeds("fabric", "evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--learner", "forest,knn,nb", cwd=d)["results"]
    t.expect(all(forest[k]["accuracy"] > 0.5 for k in ("forest", "knn", "nb")), f"learners of sound on fabrics: {forest}")
    for learner in ("forest", "knn"):
        t.succeeds("fabric", "train", "d.h5", "-o", "own.weft", "--learner", learner, cwd=d)
        told = t.succeeds("fabric", "classify", "own.weft", "d.h5", cwd=d)
        t.expect(told["learner"] == learner and told["right"] > 0.8 * told["labelled"], f"{learner}: {told['right']} of {told['labelled']}")
    t.refuses("imprint", "classify", "own.weft", "d.h5", cwd=d, code="invalid argument", where="own.weft", got="fabric", expected="imprint",
              says=["weft fabric classify"])
    t.refuses("fabric", "evaluate", "d.h5", "--leave-one-group-out", "--learner", "oracle", cwd=d, says=["--learner", "oracle"], status=2)
    e = t.succeeds("evaluate", "d.h5", "--leave-one-group-out", "--learner", "lda", "--remove-level", "rest", cwd=d)
    t.expect(e["remove_level"] == "rest" and e["results"]["lda"]["accuracy"] > 0.5, f"level: {e['results']}")
    t.refuses("train", "d.h5", "-o", "bad.weft", "--remove-level", "motion", cwd=d, says=["--remove-level"], status=2)
    for live in ([], ["--live"]):
        t.refuses("train", "d.h5", "-o", "bad.weft", "--exploration", "M1+M2", *live, cwd=d, code="unsupported", where=["--exploration"], got="M1+M2",
                  says=["weft fabric evaluate"])


def strangers(t, d):
    """A fabric that was left out of the training, for every learner."""
    command = ["evaluate", "d.h5", "--train-groups", "A", "--test-groups", "B", "--learner", "best,pvalue", "--none-of-these"]
    e = t.succeeds(*command, cwd=d)
    for name in ("best", "pvalue"):
        found = e["results"][name]["none_of_these"]
        t.expect([(s["label"], s["trials"]) for s in found["strangers"]] ==
                 [("cotton", 4), ("silk, raw", 4), ("wool", 4)], f"{name}: {found}")
        accepted = sum(s["accepted"] for s in found["strangers"]) / 12
        t.expect(abs(found["false_accept"] - accepted) < 1e-12, f"{name}: {found}")
        t.expect(found["ci95"][0] <= accepted <= found["ci95"][1], f"{name}: {found}")
        rejected = 24 * found["false_reject"]  # three times four trials of each of two known fabrics
        t.expect(abs(rejected - round(rejected)) < 1e-9 and 0 <= rejected < 24, f"{name}: {found}")
    text = t.run(*command, cwd=d).stdout
    for name in ("best", "pvalue"):
        share = f"{100 * e['results'][name]['none_of_these']['false_accept']:.1f} %"
        t.expect(line_has(text, [name, share]), f"no line with {name} and {share}: {text}")


def page(t, d):
    """One evaluation as text, as JSON and as a page that states its bench."""
    command = ["evaluate", "d.h5", "--leave-one-group-out", "--learner", "lda,pvalue,best", "--learning-curve", "2,3"]
    e = t.succeeds(*command, "--report", "page.html", cwd=d)
    t.expect([g["group"] for g in e["groups"]] == ["A", "B"] and e["groups"][0]["trials"] == 12, f"groups: {e['groups']}")
    for name, result in e["results"].items():
        found = result["calibration"]
        t.expect(found["answers"] == 24 and sum(b["answers"] for b in found["bins"]) == 24, f"{name}: {found}")
        right = sum(b["right"] * b["answers"] for b in found["bins"]) / 24
        t.expect(abs(right - result["pooled_accuracy"]) < 1e-9, f"{name}: bins hold {right} right answers")
        low, high = found["ci95"]
        t.expect(0 <= low <= high <= 1 and found["ci95_method"], f"{name}: {found}")
    text = t.run(*command, "--calibration", cwd=d).stdout
    lines = [line.split() for line in text.splitlines()]
    for group in e["groups"]:
        t.expect(any(line[:1] == [group["group"]] and f"{100 * group['accuracy']['best']:.2f}" in line for line in lines), f"no line for {group}: {text}")
    for point in e["learning_curve"]:
        t.expect(any(line[:1] == [str(point["trials"])] for line in lines), f"no line for {point['trials']} trials: {text}")
    t.expect(len(text) > len(t.run(*command, cwd=d).stdout) + 200 and "calibration" in text, "--calibration adds its tables")
    html = (d / "page.html").read_text()
    entities = '<!DOCTYPE html [<!ENTITY times "x"><!ENTITY minus "-">]>'
    root = xml.etree.ElementTree.fromstring(html.replace("<!DOCTYPE html>", entities, 1))
    figures = list(root.iter("figure"))
    t.expect(len(figures) >= 9, f"{len(figures)} figures")
    t.expect(all("BENCH UNKNOWN" in "".join(f.itertext()) for f in figures), "a figure without the bench's word")
    for words in ("Table II", "Table III", "Table IV", "Reliability", "pvalue"):
        t.expect(words in "".join(root.itertext()), f"no '{words}' on the page")
    t.refuses(*command, "--report", "d.h5", cwd=d, code="invalid argument", where=["d.h5"], got="")
    t.refuses(*command, "--report", "no/such/page.html", cwd=d, code="not found", where=["no/such/page.html"], got="no/such")


def windows(t, d):
    t.succeeds("train", "d.h5", "-o", "w.weft", "--window-s", "1", cwd=d)
    answers = t.succeeds("classify", "w.weft", "new.csv", cwd=d)["trials"]
    t.expect([a["file"] for a in answers] == ["new.csv#w0", "new.csv#w1", "new.csv#w2"], f"windows: {answers}")
    split = ["--train-groups", "A", "--test-groups", "B"]
    e = t.succeeds("evaluate", "d.h5", *split, "--window-s", "1", "--norm", "rms", cwd=d)
    t.expect(e["trials"] == 24 and e["rows"] == 72, f"3 windows a trial: {e['trials']} {e['rows']}")
    t.refuses("evaluate", "d.h5", "--train-fraction", "0.4", "--window-s", "1", cwd=d, code="invalid argument", where=["--train-fraction"], says=["--window-s"])
    t.refuses("evaluate", "d.h5", *split, "--window-s", "9", cwd=d, code="range", expected=f"{9 * RATE_HZ} samples")


def refuses_import(t, d, name, text, says, **fields):
    (d / "bad.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    write_manifest(d / "bad_manifest.csv", [["0_0.csv", "cotton", "A"], ["bad.csv", "silk", "A"]])
    error = t.refuses("dataset", "import", "bad_manifest.csv", "-o", "bad.h5", cwd=d, says=["bad.csv", *says], **fields)
    t.expect("bad_manifest.csv:3" in error.get("where", ""), f"{name}: manifest line not named: {error}")


def bad_trials(t, d):
    good = (d / "0_0.csv").read_text()
    lines = good.splitlines()
    refuses_import(t, d, "truncated", good[: len(good) * 2 // 3].rsplit(",", 1)[0], ["bad.csv:"])
    refuses_import(t, d, "cut after a comma", good.rstrip().rsplit(",", 1)[0] + ",", ["bad.csv:221"])
    refuses_import(t, d, "cut inside the last number", good.rstrip()[:-1], ["bad.csv:221"], got="")
    refuses_import(t, d, "nan", good.replace(lines[7], "0.120,S,nan,1,2"), ["bad.csv:8"])
    refuses_import(t, d, "infinite", good.replace(lines[7], "0.120,S,1,inf,2"), ["bad.csv:8"])
    refuses_import(t, d, "word", good.replace(lines[7], "0.120,S,1,two,2"), ["bad.csv:8", "two"])
    refuses_import(t, d, "phase", good.replace(lines[7], "0.120,Q,1,2,2"), ["bad.csv:8"])
    refuses_import(t, d, "backwards", good.replace(lines[7], "-5,S,1,2,2"), ["bad.csv:8"])
    refuses_import(t, d, "no time", "ch1,ch2,ch3\n1,2,3\n", ["bad.csv:1", "t_s"])
    refuses_import(t, d, "other taxels", "t_s,ch1\n0,1\n", [], got="1", expected="3")
    refuses_import(t, d, "empty", "", [])
    refuses_import(t, d, "binary", bytes(range(256)) * 8, [])


def bad_manifests(t, d):
    def refused(rows, says, **fields):
        write_manifest(d / "m.csv", rows)
        t.refuses("dataset", "import", "m.csv", "-o", "bad.h5", cwd=d, says=says, **fields)

    refused([["0_0.csv", "a", "A"], ["gone.csv", "b", "A"]], ["m.csv:3", "gone.csv"])
    refused([["0_0.csv", "a", "A"], ["0_0.csv", "b", "A"]], ["m.csv:2"], code="parse", where=["m.csv:3"], got="0_0.csv")
    refused([["0_0.csv", "", "A"]], ["label"], code="parse", where=["m.csv:2"])
    refused([], ["m.csv"])
    t.refuses("dataset", "import", "gone.csv", "-o", "bad.h5", cwd=d, says=["gone.csv"])
    t.refuses("dataset", "import", "manifest.csv", "-o", "no/such/folder/d.h5", cwd=d, code="not found", where=["no/such/folder/d.h5"],
              got="no/such/folder")
    t.refuses("dataset", "import", "manifest.csv", "-o", "x.h5", "--filter", "a*", cwd=d, says=["--filter"])
    t.refuses("dataset", "import", "manifest.csv", "-o", "x.h5", "--order", "time", cwd=d, says=["--order", "icub20"])
    t.refuses("dataset", "import", "--format", "icub20", "manifest.csv", "-o", "x.h5", cwd=d, says=["manifest.csv:1", "sample"])
    t.refuses("dataset", "import", "--format", "fabricslide", "nowhere", "-o", "x.h5", cwd=d, says=["nowhere"])
    t.refuses("dataset", "import", "--format", "matlab", ".", "-o", "x.h5", cwd=d, says=["--format"], status=2)


def lonely_label(t, d, rows):
    write_manifest(d / "lonely.csv", rows[:8] + [["2_0.csv", "wool", "A"]])
    t.succeeds("dataset", "import", "lonely.csv", "-o", "lonely.h5", cwd=d)
    t.refuses("train", "lonely.h5", "-o", "bad.weft", cwd=d, where=["label wool"], got="1", expected="2")
    t.refuses("evaluate", "lonely.h5", "--train-fraction", "0.4", cwd=d, where=["label wool"], got="1", expected="2")
    write_manifest(d / "same.csv", rows[:8])
    t.succeeds("dataset", "import", "same.csv", "-o", "same.h5", cwd=d)
    t.refuses("train", "same.h5", "-o", "bad.weft", cwd=d, where=["labels"], got="1", expected="2")


def inputs_are_kept(t, d):
    """Inputs are not overwritten, whatever name the output has."""
    (d / "link.csv").symlink_to("manifest.csv")
    (d / "hard.h5").hardlink_to(d / "d.h5")
    for command in (["features", "d.h5", "-o", "d.h5"], ["features", "d.h5", "-o", "../set/d.h5"],
                    ["features", "d.h5", "-o", "hard.h5"], ["train", "d.h5", "-o", "d.h5"],
                    ["dataset", "import", "manifest.csv", "-o", "manifest.csv"],
                    ["dataset", "import", "manifest.csv", "-o", "link.csv"],
                    ["dataset", "import", "manifest.csv", "-o", "./1_3.csv"]):
        t.refuses(*command, cwd=d, code="invalid argument", where=[command[-1]], got="", expected="")
    (d / "link.csv").unlink()
    (d / "hard.h5").unlink()


def damaged_files(t, d):
    whole = (d / "d.h5").read_bytes()
    for share in (0.0, 0.1, 0.5, 0.9, 0.999):
        (d / "cut.h5").write_bytes(whole[: int(len(whole) * share)])
        for command in (["dataset", "info", "cut.h5"], ["features", "cut.h5", "-o", "bad.csv"],
                        ["train", "cut.h5", "-o", "bad.weft"], ["classify", "m.weft", "cut.h5"]):
            t.refuses(*command, cwd=d, says=["cut.h5"])
    t.refuses("dataset", "info", "0_0.csv", cwd=d, says=["0_0.csv"])
    model = (d / "m.weft").read_text()
    for name, text in {"short": model[: len(model) // 2], "altered": model.replace("bias ", "bias 1", 1),
                       "version": re.sub(r"model \d+", "model 99", model, count=1), "empty": ""}.items():
        (d / "bad_model").write_text(text)
        t.refuses("classify", "bad_model", "new.csv", cwd=d, says=["bad_model"])
    t.refuses("classify", "gone.weft", "new.csv", cwd=d, says=["gone.weft"])
    t.succeeds("train", "d.h5", "-o", "live.weft", "--live", "--learner", "lda", cwd=d)
    t.refuses("classify", "live.weft", "new.csv", cwd=d, where=["live.weft"], says=["live_vote"])


def outputs_refused_before_the_work(t, d):
    """An output that cannot be written is refused before any input is read, and no file remains."""
    (d / "a_folder").mkdir()
    t.refuses("dataset", "info", "a_folder", cwd=d, code="not found", where="a_folder", says=["dataset.h5"])
    before = sorted(p.name for p in d.iterdir())
    for out, code, got in (("a_folder", "io", "folder"), ("no/such/m.weft", "not found", "no/such"), ("", "invalid argument", None),
                           ("/dev/null", "io", "device")):
        for command in (["train", "gone.h5"], ["train", "gone.h5", "--live"], ["features", "gone.h5"], ["dataset", "import", "gone.csv"]):
            t.refuses(*command, "-o", out, cwd=d, code=code, where=out, got=got)
        if out:  # without a name there is no page
            t.refuses("evaluate", "gone.h5", "--train-fraction", "0.5", "--report", out, cwd=d, code=code, where=out, got=got)
    t.expect(sorted(p.name for p in d.iterdir()) == before, "a refused output left something behind")


def separators_and_control_characters(t, d):
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        (d / "other.csv").write_text((d / "new.csv").read_text().replace(",", mark))
        t.refuses("classify", "m.weft", "other.csv", cwd=d, where=["other.csv:1"], says=["commas", name])
    rows = (d / "manifest.csv").read_text().replace("wool", "wool\x1b]0;title\x07\u009b2J")
    (d / "loud.csv").write_text(rows)
    t.succeeds("dataset", "import", "loud.csv", "-o", "loud.h5", cwd=d)
    said = subprocess.run([t.weft, "dataset", "info", "loud.h5"], cwd=d, capture_output=True, timeout=60)
    t.expect(said.returncode == 0 and b"wool?]0;title??2J" in said.stdout and b"\x1b" not in said.stdout, f"control characters: {said.stdout}")


def mismatches(t, d):
    (d / "pad.csv").write_text("t_s,ch1,ch2\n" + "".join(f"{i / 50},{i % 7},{i % 3}\n" for i in range(200)))
    t.refuses("classify", "m.weft", "pad.csv", cwd=d, where=["pad.csv"], got="2", expected="3")
    only_m = [line.split(",") for line in (d / "new.csv").read_text().split()]
    (d / "phase_m.csv").write_text("\n".join(",".join(r[:1] + r[2:]) for r in only_m) + "\n")
    t.refuses("classify", "m.weft", "phase_m.csv", cwd=d, where=["phase_m.csv"], says=["phases"])
    slow = "\n".join(",".join([str(i * 0.04 - 0.04) if i else r[0]] + r[1:]) for i, r in enumerate(only_m))
    (d / "slow.csv").write_text(slow + "\n")
    t.refuses("classify", "w.weft", "slow.csv", cwd=d, where=["slow.csv"], got="25.00 Hz", expected="50.00 Hz")
    whole = [line.split(",") for line in (d / "new.csv").read_text().split()]
    for name, period_s, taken in (("slow_whole.csv", 0.04, False), ("nearly.csv", 0.0202, True)):
        (d / name).write_text("\n".join(",".join([f"{(i - 1) * period_s:.4f}" if i else r[0], *r[1:]])
                                        for i, r in enumerate(whole)) + "\n")
        if taken:
            t.succeeds("classify", "m.weft", name, cwd=d)
        else:
            t.refuses("classify", "m.weft", name, cwd=d, where=[name], got="25.00 Hz", expected="50.00 Hz", says=["0.02", "0.04"])
    t.refuses("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "A", cwd=d, says=["A"])
    t.refuses("evaluate", "d.h5", "--train-groups", "A", "--test-groups", "Z", cwd=d, says=["Z"])
    t.refuses("evaluate", "d.h5", cwd=d, says=["--train-groups"])
    t.refuses("train", "d.h5", "-o", "x", "--exploration", "M9", cwd=d, says=["M9"])
    t.refuses("train", "d.h5", "-o", "no/such/m.weft", cwd=d, says=["no/such"])
    t.refuses("features", "d.h5", "-o", "no/such/f.csv", cwd=d, says=["no/such"])
    t.refuses("features", "d.h5", "-o", "bad.csv", "--colour", cwd=d, says=["--colour"], status=2)


def main():
    t = Checks(sys.argv[1])
    work = pathlib.Path(tempfile.mkdtemp(prefix="weft-cli-"))
    try:
        d = work / "set"
        rows = write_set(d)
        good_path(t, d, rows)
        every_learner(t, d)
        kept_as_evaluated(t, work / "near")
        through_a_pipe(t, d)
        evaluations(t, d)
        splits_and_curves(t, d)
        strangers(t, d)
        page(t, d)
        windows(t, d)
        bad_trials(t, d)
        bad_manifests(t, d)
        lonely_label(t, d, rows)
        inputs_are_kept(t, d)
        damaged_files(t, d)
        outputs_refused_before_the_work(t, d)
        separators_and_control_characters(t, d)
        mismatches(t, d)
    finally:
        shutil.rmtree(work)
    t.finish()


main()
