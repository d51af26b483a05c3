#!/usr/bin/env python3
"""Sound and vibration from recipe to report on the simulated bench: weft run on twelve textures, three times, with short strokes.

    cli_vibrotactile.py WEFT ROOT

The shipped recipe with shorter phases and fewer repetitions. This script reads the campaign file itself.
"""
import array
import copy
import json
import pathlib
import re
import sqlite3
import sys
import tempfile

from cli_support import Checks, line_has

TEXTURES, REPETITIONS = 12, 3
STREAMS = {"acceleration": (3, 200, 4, 3), "sound": (4, 8000, 160, 1)}  # number, rate [Hz], readings in a block, axes


def small(root):
    recipe = json.loads((root / "recipes/library/vibrotactile.json").read_text())
    recipe["repetitions"] = REPETITIONS
    recipe["hand_over"].update({"learner": "best", "groups": REPETITIONS})
    s, p, m, e = recipe["explorations"]["V1"]["phases"]
    s["duration_s"] = e["duration_s"] = 0.5
    p["duration_s"] = 1
    m["path"] = [{"dx_mm": 0, "dy_mm": 24}]
    return recipe


def blocks(data, values):
    """Arrival [ns], the sensor's clock [us] and the values of each row of a chunk (docs/reference/dataset.md)."""
    size = 16 + 4 * values
    for at in range(0, len(data), size):
        row = data[at:at + size]
        yield (int.from_bytes(row[:8], "little", signed=True), int.from_bytes(row[8:12], "little"), array.array("i", row[16:]))


def stream_of(db, trial, stream):
    """Number of lost rows, and the bytes of all chunks."""
    chunks = db.execute("select lost_before, data from chunk where trial = ? and stream = ? order by number", (trial, stream)).fetchall()
    return sum(lost for lost, _ in chunks), b"".join(data for _, data in chunks)


def slide_of(db, trial):
    """First and last time [ns] of phase M, from the taxel frames: 17 bytes of head (the last one is the phase), and the counts of 16 taxels."""
    data, size = stream_of(db, trial, 0)[1], 17 + 2 * 16
    moving = [int.from_bytes(data[at:at + 8], "little", signed=True) for at in range(0, len(data), size) if data[at + 16:at + 17] == b"M"]
    return moving[0], moving[-1]


def recorded(t, campaign):
    """Every texture has the planned number of trials. During the stroke both channels have their rates, no gap and no constant values."""
    db = sqlite3.connect(f"file:{campaign}?mode=ro", uri=True)
    trials = db.execute("select id, label from trial where outcome = 'complete'").fetchall()
    labels = [label for _, label in trials]
    t.expect(len(set(labels)) == TEXTURES and all(labels.count(one) == REPETITIONS for one in labels), f"textures {sorted(labels)}")
    for trial, label in trials:
        begin, end = slide_of(db, trial)
        t.expect(6e9 < end - begin < 7e9, f"{label}: a slide of {(end - begin) / 1e9} s, not 24 mm at 4 mm/s")
        for name, (stream, rate, readings, axes) in STREAMS.items():
            lost, data = stream_of(db, trial, stream)
            period_ns = 1_000_000_000 * readings // rate
            rows = [row for row in blocks(data, readings * axes) if begin <= row[0] - period_ns and row[0] <= end]
            clock = [us for _, us, _ in rows]
            t.expect(lost == 0, f"{label}: lost blocks of {name}")
            t.expect(all((b - a) % 2**32 == period_ns // 1000 for a, b in zip(clock, clock[1:])), f"{label}: a gap in {name}")
            t.expect(abs(len(rows) * period_ns - (end - begin)) < 2.5 * period_ns, f"{label}: {len(rows)} blocks of {name}")
            t.expect(len({value for _, _, values in rows for value in values}) > 8, f"{label}: {name} says nothing")
    db.close()


def handed_over(t, out, ran):
    done = ran["handover"]
    t.expect(done["state"] == "done" and done["bench"] == "simulated" and done["models"] == [], f"handed over: {done}")
    [line] = done["evaluations"]
    t.expect(line["recordings"] == TEXTURES * REPETITIONS and line["materials"] == TEXTURES, f"asked about every slide: {line}")
    for what in ("windows", "slides"):
        low, high = line[what]["ci95"]
        print(f"SIMULATED {what}: {line[what]['accuracy']:.3f} ({low:.3f} to {high:.3f}) by {line['learner']}, chance {1 / TEXTURES:.3f}")
        t.expect(low > 1 / TEXTURES and low <= line[what]["accuracy"] <= high, f"{what} better than chance: {line[what]}")
    evaluation = json.loads((out / "handover/evaluation.json").read_text())
    told = evaluation["explorations"]["V1"]
    rates = {c["name"]: c["rate_hz"] for c in told["channels"]}
    t.expect(rates == {"S": 8000, "X": 200, "Y": 200, "Z": 200}, f"channels {rates}")
    confusion, n = told["best"]["confusion"], TEXTURES
    t.expect(sum(confusion) == told["best"]["windows"] and len(confusion) == n * n, "every window is answered once")
    right = sum(confusion[i * n + i] for i in range(n)) / sum(confusion)
    t.expect(abs(right - line["windows"]["accuracy"]) < 0.02, f"the confusion gives {right}")
    page = (out / "handover/V1.html").read_text()
    shown = f"{100 * line['windows']['accuracy']:.1f}"
    t.expect("SIMULATED" in page and shown in page and "sandpaper_p60" in page and page.count("<svg") >= 1, f"the page has no {shown}")


def reported(t, out):
    page = (out / "report.html").read_text()
    t.expect("SIMULATED" in page and "handover/V1.html" in page and line_has(page, ["sound", "8000.0 Hz"]), "the campaign's report has both channels")
    t.expect(not re.search(r"\bM[12]\b", page), "no row of another paper's explorations")


def evaluated(t, d):
    """weft evaluate on the recorded data set: whole repetitions left out, contiguous parts, and the paper's windows, which leak."""
    common = ["--window-s", "1", "--method", "LDA,kNN"]
    even = ["--step-s", "0.5"]  # not for random windows
    honest = t.succeeds("evaluate", "out/dataset.h5", "--leave-one-group-out", *common, *even, cwd=d)
    t.expect(honest["bench"] == "simulated" and honest["leak"]["largest_share"] == 0 and honest["protocol"] == "groups", f"by repetition: {honest}")
    t.expect(len(honest["results"]["lda"]["accuracy_of_splits"]) == REPETITIONS, "a split for each repetition")
    t.expect(honest["results"]["lda"]["accuracy_ci95"]["low"] > 1 / TEXTURES, "better than chance by repetition")
    parts = t.succeeds("evaluate", "out/dataset.h5", "--blocks", "3", *common, *even, cwd=d)
    spelt = t.succeeds("vibro", "evaluate", "out/dataset.h5", "--parts", "3", "--window-s", "1", "--learner", "LDA", "kNN", *even, cwd=d)
    t.expect(all(spelt["results"][k]["confusion"] == parts["results"][k]["confusion"] for k in ("lda", "knn")), "two spellings, one evaluation")
    t.expect(parts["leak"]["largest_share"] == 0 and parts["protocol"] == "blocks", "contiguous parts share nothing")
    random = t.succeeds("evaluate", "out/dataset.h5", "--protocol", "random", "--per-recording", "30", "--repeats", "2", *common, cwd=d)
    t.expect(random["leak"]["median_share"] > 0.5, f"random windows leak: {random['leak']}")


def stored(t, d):
    """A model file recognises the strokes, and refuses other data."""
    made = t.succeeds("train", "out/dataset.h5", "-o", "slides.model", "--method", "LDA", "--window-s", "1", "--step-s", "0.5", cwd=d)
    t.expect(made["bench"] == "simulated" and made["learner"] == "lda" and len(made["labels"]) == TEXTURES, f"trained: {made}")
    told = t.succeeds("classify", "slides.model", "out/dataset.h5", cwd=d)
    answers = told["recordings"]
    right = sum(a["label"] == a["true_label"] for a in answers)
    t.expect(len(answers) == TEXTURES * REPETITIONS and right > 0.8 * len(answers), f"its own slides: {right} of {len(answers)} right")
    t.expect(all(9 < sum(a["windows"].values()) < 13 for a in answers), "every window of 6 s is answered")
    for method in ("svm", "forest"):
        t.succeeds("train", "out/dataset.h5", "-o", "own.model", "--method", method, "--window-s", "1", "--step-s", "0.5", cwd=d)
        own = t.succeeds("classify", "own.model", "out/dataset.h5", cwd=d)
        right = sum(a["label"] == a["true_label"] for a in own["recordings"])
        t.expect(own["learner"] == method and right > 0.8 * len(answers), f"{method}, its own slides: {right} of {len(answers)} right")
    model = (d / "slides.model").read_bytes()
    (d / "cut.model").write_bytes(model[:-20])
    (d / "altered.model").write_bytes(model.replace(b"window_s 1\n", b"window_s 2\n"))
    t.refuses("classify", "cut.model", "out/dataset.h5", cwd=d, code="corrupt", where=["cut.model"], expected="checksum")
    t.refuses("classify", "altered.model", "out/dataset.h5", cwd=d, code="corrupt", where=["altered.model"], expected="", says=["checksum"])


def weighed(t, d):
    """Importance of the paper's ten features, by permutation and by a forest; and the page."""
    out = t.succeeds("evaluate", "out/dataset.h5", "--leave-one-group-out", "--window-s", "1", "--step-s", "0.5", "--features", "SMMRP10", "--combine",
                     "mean", "--method", "LDA", "--importance", "3", "--report", "page.html", cwd=d)["importance"]
    features = {f["feature"]: f for f in out["features"]}
    t.expect(len(features) == 10 and set(out["paper"]) == {"STD", "MEAN", "MAD", "RMSE", "PERCEPTUAL"} <= set(features), f"ten figures: {out}")
    t.expect(abs(sum(f["forest"] for f in features.values()) - 1) < 1e-9, "shares in a forest")
    first = [f["permutation"] for f in out["features"]]
    t.expect(first == sorted(first, reverse=True) and first[0] > 0.02, f"something matters: {first}")
    t.expect(out["most_permutation"] == [f["feature"] for f in out["features"][:5] if f["permutation"] > 0], "the five that weigh most")
    chosen, papers, every = (out[which] for which in ("selected", "smmrp", "all"))
    t.expect([len(kept) for kept in chosen["columns"]] == [5] * REPETITIONS, f"five selected in the training of every split: {chosen}")
    t.expect(all(set(kept) == set(out["paper"]) for kept in papers["columns"]), f"the paper's five beside them: {papers}")
    t.expect(min(chosen["accuracy"], papers["accuracy"]) > 2 / TEXTURES, f"selected {chosen['accuracy']}, the paper's {papers['accuracy']}")
    t.expect(all(len(kept) == 10 for kept in every["columns"]), f"all ten: {every}")
    page = (d / "page.html").read_text()
    for one in (chosen, papers, every):
        t.expect(f"{100 * one['accuracy']:.2f}" in page or f"{100 * one['accuracy']:.1f}" in page, f"the page has no accuracy of {one}")
    t.expect("SIMULATED" in page and "PERCEPTUAL" in page and "felt" in page and "<svg" in page, "the page of an evaluation")


def two_explorations(t, d, root, rig):
    """A campaign of two explorations needs the choice of one: strokes at two speeds are two explorations."""
    recipe = small(root)
    del recipe["hand_over"]
    recipe["fabrics"], recipe["repetitions"] = ["sandpaper_p60", "felt"], 2
    recipe["explorations"]["V2"] = copy.deepcopy(recipe["explorations"]["V1"])
    recipe["explorations"]["V2"]["phases"][2]["speed_mm_s"] = 3
    (d / "two.json").write_text(json.dumps(recipe))
    ran = t.run("run", "two.json", "--rig", rig, "--out", "two", "--no-error-check", "--no-evaluate", cwd=d)
    t.expect(ran.returncode == 0, f"run: {ran.stderr}")
    common = ["--window-s", "1", "--step-s", "0.5", "--method", "LDA"]
    asked = {"evaluate": [*common, "--leave-one-group-out"], "train": [*common, "-o", "two.model"],
             "trade": ["-o", "two-page.html", "--window-s", "1", "--features", "SMMRP", "--method", "NB", "--blocks", "2", "--per-recording", "10", "--repeats", "2"]}
    for command, options in asked.items():
        verb = ["trade", "vibro"] if command == "trade" else [command]
        t.refuses(*verb, "two/dataset.h5", *options, cwd=d, code="invalid argument", where=["two/dataset.h5"], got="V1, V2", says=["--exploration"])
        t.refuses(*verb, "two/dataset.h5", *options, "--exploration", "V3", cwd=d, code="not found", where=["--exploration"], got="V3", expected="V1, V2")
        t.refuses(*verb, "two/dataset.h5", *options, "--exploration", "V1+V2", cwd=d, code="unsupported", where=["--exploration"], got="V1+V2")
    digests = set()
    for exploration, windows in (("V1", 44), ("V2", 60)):
        told = t.succeeds("evaluate", "two/dataset.h5", *asked["evaluate"], "--exploration", exploration, cwd=d)
        t.expect(told["exploration"] == exploration and abs(told["windows"] - windows) < 6, f"{exploration}: {told['windows']} windows of four slides")
        made = t.succeeds("train", "two/dataset.h5", *asked["train"], "--exploration", exploration, cwd=d)
        t.expect(made["recordings"] == 4 and f"exploration {exploration}" in made["training"], f"trained on {exploration}: {made}")
        digests |= {told["dataset_sha256"], made["dataset_sha256"]}
    t.expect(len(digests) == 2, "recordings of each exploration")
    t.succeeds("trade", "vibro", "two/dataset.h5", *asked["trade"], "--exploration", "V2", cwd=d)


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/vibrotactile.json"
    with tempfile.TemporaryDirectory(prefix="weft-vibrotactile-") as folder:
        d = pathlib.Path(folder)
        (d / "recipe.json").write_text(json.dumps(small(root)))
        ran = t.run("run", "recipe.json", "--rig", rig, "--out", "out", "--no-error-check", "--repeats", "2", "--json", cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.stderr}")
        recorded(t, d / "out/campaign.sqlite")
        handed_over(t, d / "out", json.loads(ran.stdout))
        t.expect(t.run("verify", "out", cwd=d).returncode == 0, "the folder agrees with its certificate")
        reported(t, d / "out")
        evaluated(t, d)
        stored(t, d)
        weighed(t, d)
        two_explorations(t, d, root, rig)
        t.refuses("check", "recipe.json", "--rig", root / "sim/rigs/bench17.json", cwd=d, where="/hand_over/from", expected="vibro")
    t.finish()


main()
