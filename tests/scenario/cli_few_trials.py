#!/usr/bin/env python3
"""`weft train`, `evaluate` and `classify` if a label has few trials or a single group: the output names labels that were not tested.

    cli_few_trials.py WEFT
"""
import csv
import pathlib
import shutil
import sys
import tempfile

from cli_support import Checks, has, line_has
from made_up_cloths import write_manifest, write_set


def imported(t, d, name, rows):
    write_manifest(d / f"{name}.csv", rows)
    t.succeeds("dataset", "import", f"{name}.csv", "-o", f"{name}.h5", cwd=d)
    return f"{name}.h5"


def two_trials_of_one_label(t, d, rows):
    data = imported(t, d, "rare", rows[:18])  # wool has two trials
    for learner in ("best", "svc", "lda"):
        trained = t.succeeds("train", data, "-o", "rare.weft", "--learner", learner, cwd=d)
        t.expect(trained["folds"] == {"none": False, "finer": {}, "not_tested": {"wool": 2}}, f"{learner}: {trained}")
        t.expect(trained["calibrated"] and has(trained["training"], ["folds 5", "wool (2 trials)"]), f"{learner}: {trained}")
        t.expect(trained["training"] in (d / "rare.weft").read_text(), f"{learner}: the model file does not have it")
        text = t.run("train", data, "-o", "rare.weft", "--learner", learner, cwd=d).stdout
        t.expect(line_has(text, ["folds", "wool (2 trials)"]) and "calibrated" in text, text)
    answer = t.succeeds("classify", "rare.weft", data, cwd=d)["trials"][0]
    t.expect("probability" in answer and "none_of_these" in answer, f"calibrated by the others: {answer}")


def two_trials_of_every_label(t, d, rows):
    data = imported(t, d, "few", [row for k, row in enumerate(rows) if k % 8 < 2])
    for learner, words in (("best", ["calibrated"]), ("svc", ["C 8", "gamma 0.03125", "calibrated"])):
        trained = t.succeeds("train", data, "-o", "few.weft", "--learner", learner, cwd=d)
        t.expect(trained["folds"]["none"] and not trained["calibrated"], f"{learner}: {trained}")
        t.expect(has(trained["training"], ["cotton", "2 trials"]), f"{learner}: {trained}")
        text = t.run("train", data, "-o", "few.weft", "--learner", learner, cwd=d).stdout
        t.expect(has(text, words) and line_has(text, ["folds", "none", "cotton", "2 trials"]), f"{learner}: no {words} in {text}")
        t.expect("0/0" not in text, text)
        for answer in t.succeeds("classify", "few.weft", data, cwd=d)["trials"]:
            t.expect("probability" not in answer and "none_of_these" not in answer, f"nothing claimed: {answer}")
    evaluated = t.succeeds("evaluate", "d.h5", "--train-fraction", "0.2", "--learner", "svc,lda", cwd=d)
    t.expect(list(evaluated["results"]["svc"]["folds"].values()) == [30], f"evaluate: {evaluated['results']['svc']}")
    t.expect("folds" not in evaluated["results"]["lda"], f"LDA has nothing to choose: {evaluated['results']['lda']}")
    text = t.run("evaluate", "d.h5", "--train-fraction", "0.2", "--learner", "svc,lda", cwd=d).stdout
    t.expect(line_has(text, ["svc", "folds", "30", "none", "cotton", "2 trials"]), text)
    live = t.succeeds("train", data, "-o", "few.live", "--live", "--learner", "lda", cwd=d)
    t.expect(not any(stage["calibrated"] for stage in live["stages"]), f"live: {live}")
    sure = t.succeeds("train", "d.h5", "-o", "sure.live", "--live", "--learner", "lda", cwd=d)
    texts = [t.run("train", one, "-o", "few.live", "--live", "--learner", "lda", cwd=d).stdout for one in (data, "d.h5")]
    t.expect(any(stage["calibrated"] for stage in sure["stages"]), f"live, all trials: {sure}")
    t.expect(texts[0].count("\n") > texts[1].count("\n"), f"live text has a line about it: {texts}")


def one_group_of_one_label(t, d, rows):
    data = imported(t, d, "group", [row for row in rows if row[1] != "wool" or row[2] == "A"])
    for learner in ("svc", "pvalue", "best"):
        trained = t.succeeds("train", data, "-o", "group.weft", "--fold-unit", "group", "--learner", learner, cwd=d)
        t.expect(trained["folds"]["finer"] == {"wool": "recording"}, f"{learner}: {trained}")
        t.expect(has(trained["training"], ["group", "wool", "recording"]), f"{learner}: {trained}")
    t.expect("folds" not in t.succeeds("train", data, "-o", "group.weft", cwd=d), "by recording nothing is special")


def one_trial_of_one_label(t, d, rows):
    data = imported(t, d, "lone", rows[:17])
    found = [t.refuses("train", data, "-o", "bad", *live, cwd=d, where=["label wool"], got="1", expected="2")["sentence"] for live in ([], ["--live"])]
    t.expect(found[0] == found[1], f"one sentence: {found}")


def groups_by_place(t, d, rows):
    """Groups are the places of the fabric that a trial touched, if the data set states them."""
    with open(d / "places.csv", "w", newline="") as f:
        csv.writer(f).writerows([["file", "label", "group", "piece", "mounting"]]
                                + [[*row, 1 + k % 2, 1] for k, row in enumerate(rows)])
    t.succeeds("dataset", "import", "places.csv", "-o", "places.h5", cwd=d)
    by_piece = t.succeeds("evaluate", "places.h5", "--group", "piece", "--leave-one-group-out", "--learner", "lda", cwd=d)
    t.expect([group["group"] for group in by_piece["groups"]] == ["1", "2"], f"groups: {by_piece.get('groups')}")
    place = {"cwd": d, "where": ["--group"]}
    t.refuses("evaluate", "places.h5", "--group", "mounting", "--leave-one-group-out", "--learner", "lda", code="unsupported", says=["mounting"], **place)
    t.refuses("evaluate", "places.h5", "--group", "patch", "--leave-one-group-out", "--learner", "lda", code="not found", got="patch",
              expected=["mounting", "piece"], **place)
    t.refuses("evaluate", "d.h5", "--group", "piece", "--leave-one-group-out", "--learner", "lda", code="not found", got="piece", **place)


def short_lists(t, d):
    t.succeeds("train", "d.h5", "-o", "m.weft", "--learner", "pvalue", cwd=d)
    one = t.succeeds("classify", "m.weft", "d.h5", "--vote", "shortlist", "--shortlist", "1", cwd=d)["trials"][0]
    t.expect(one["cores_asked"] == 0 and "probability" not in one, f"no core was used: {one}")
    for vote in ([], ["--vote", "dag"], ["--vote", "majority"]):
        t.refuses("classify", "m.weft", "d.h5", "--shortlist", "2", *vote, cwd=d, says=["--shortlist", "--vote shortlist"])


def main():
    t = Checks(sys.argv[1])
    work = pathlib.Path(tempfile.mkdtemp(prefix="weft-cli-"))
    try:
        d = work / "set"
        rows = write_set(d)
        imported(t, d, "d", rows)
        two_trials_of_one_label(t, d, rows)
        two_trials_of_every_label(t, d, rows)
        one_group_of_one_label(t, d, rows)
        one_trial_of_one_label(t, d, rows)
        short_lists(t, d)
        groups_by_place(t, d, rows)
    finally:
        shutil.rmtree(work)
    t.finish()


if __name__ == "__main__":
    main()
