#!/usr/bin/env python3
"""`weft trade classifier` on a small simulated campaign and on a made-up set of recordings: fronts, page, refusals.

    cli_trade.py WEFT SOURCE_ROOT

The script computes the Pareto fronts again from the JSON, by their definition.
"""
import csv
import json
import math
import pathlib
import random
import re
import sys
import tempfile

from cli_support import Checks, has

FABRICS, REPETITIONS = ["denim", "velvet", "terry"], 6
TIMES = ("answer_s", "contact_s")
POINT_KEYS = {"name", "family", "settings", "bench", "accuracy", "ci95", "ci95_method", "tested", "answer_s",
              "features_s", "vote_s", "timings_s", "contact_s", "train_s", "front"}


def simulated_set(t, d, root):
    """M1 and M2 of three fabrics on the simulated bench."""
    recipe = json.loads((root / "recipes/library/khan2016.json").read_text())
    recipe.update(name="trade", fabrics=FABRICS, repetitions=REPETITIONS)
    del recipe["$schema"]
    (d / "recipe.json").write_text(json.dumps(recipe))
    ran = t.run("run", "recipe.json", "--rig", root / "sim/rigs/bench17.json", "--out", "out", "--no-evaluate", cwd=d)
    t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stderr}")
    (d / "out/dataset.h5").rename(d / "sim.h5")


def recorded_set(t, d):
    """Two fabrics at two speeds, with file names like those of fabricslide; groups are repetitions. 4 s or 2 s at 50 Hz."""
    rows = []
    for c, label in enumerate(["cotton", "wool"]):
        for k in range(24):
            speed = (10, 20)[k % 2]
            name, noise = f"{label}_F{k}_V{speed}mmps_{k // 12}.csv", random.Random(100 * c + k)
            with open(d / name, "w", newline="") as f:
                w = csv.writer(f)
                w.writerow(["t_s", "ch1", "ch2"])
                for i in range(2000 // speed):
                    w.writerow([f"{i / 50:.3f}"] + [round(1000 + 20 * c + noise.gauss(0, 40 + 5 * c)) for _ in "ab"])
            rows.append([name, label, str(k // 12)])
    with open(d / "manifest.csv", "w", newline="") as f:
        csv.writer(f).writerows([["file", "label", "group"]] + rows)
    t.succeeds("dataset", "import", "manifest.csv", "-o", "recorded.h5", cwd=d)
    with open(d / "one.csv", "w", newline="") as f:
        csv.writer(f).writerows([["file", "label", "group"]] + [r for r in rows if r[1] == "wool"])
    t.succeeds("dataset", "import", "one.csv", "-o", "one.h5", cwd=d)


def dominated(points, p, time):
    return any(q["accuracy"] >= p["accuracy"] and q[time] <= p[time] and
               (q["accuracy"] > p["accuracy"] or q[time] < p[time]) for q in points)


def numbers_in(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [n for v in value for n in numbers_in(v)]
    return [value] if isinstance(value, float) else []


def check_set(t, one, bench):
    points, name = one["points"], one["dataset"]
    t.expect(one["bench"] == bench and re.fullmatch("[0-9a-f]{64}", one["dataset_sha256"]), f"{name}: {one['bench']}")
    t.expect(points[0]["family"] == "default" and [p["family"] for p in points].count("default") == 1, f"{name}: default")
    t.expect(len({p["name"] for p in points}) == len(points), f"{name}: a name each")
    t.expect(all(math.isfinite(n) for n in numbers_in(one)), f"{name}: finite")
    for p in points:
        what = f"{name}, {p['name']}"
        t.expect(set(p) == POINT_KEYS and p["bench"] == bench, f"{what}: {sorted(p)}")
        t.expect(0 <= p["ci95"][0] <= p["accuracy"] <= p["ci95"][1] <= 1 and p["tested"] > 0, f"{what}: {p['ci95']}")
        mean = sum(p["timings_s"]) / len(p["timings_s"])
        t.expect(math.isclose(p["answer_s"], mean) and math.isclose(p["answer_s"], p["features_s"] + p["vote_s"]),
                 f"{what}: {p['answer_s']} of {p['timings_s']}, {p['features_s']} + {p['vote_s']}")
        t.expect(p["answer_s"] > 0 and p["contact_s"] > 0 and p["train_s"] > 0, f"{what}: times")
        for time in TIMES:
            t.expect(p["front"][time] == (not dominated(points, p, time)), f"{what}: front of {time} is {p['front']}")
    for time in TIMES:
        on = [p["name"] for p in points if p["front"][time]]
        t.expect(on and set(one["fronts"][time]) == set(on), f"{name}: {one['fronts'][time]} is not {on}")
        costs = [next(p for p in points if p["name"] == n)[time] for n in one["fronts"][time]]
        t.expect(costs == sorted(costs), f"{name}: front by rising cost: {costs}")
    return {p["name"]: p for p in points}


def check_page(t, page, benches):
    t.expect(page.count("<svg") == len(benches), f"a picture for each of {benches}")
    words = {"simulated": "SIMULATED", "unknown": "ORIGIN UNKNOWN"}
    for bench in set(benches):
        t.expect(page.count(f">{words[bench]}</text>") == benches.count(bench), f"a picture has no {words[bench]}")
    t.expect(page.count("<figcaption><span class=\"badge\">") == 2 * len(benches), "every figure has its badge")
    t.expect(not re.search(r"<script|<link|<img|url\(|@import", page), "nothing from elsewhere")
    t.expect(set(re.findall(r"https?://[^\"\s<]*", page)) <= {"http://www.w3.org/2000/svg"}, "no address")
    t.expect("nan" not in re.sub(r"<[^>]*>", " ", page.split("<body>")[1]).lower().split(), "no nan")


def both_sets(t, d):
    out = t.succeeds("trade", "classifier", "sim.h5", "recorded.h5", "-o", "t.html", "--data", "t.json", "--splits", "3",
                     cwd=d)
    data = json.loads((d / "t.json").read_text())
    t.expect(data["data_sets"] == out["data_sets"] and data["schema_version"] == 1, "--json and --data agree")
    t.expect(data["machine"] and has(data["timing"], "9"), f"how it was timed: {data['timing']}")
    t.expect(len(data["data_sets"]) == 2, "real and simulated apart")
    page = (d / "t.html").read_text()
    check_page(t, page, ["simulated", "unknown"])
    simulated, recorded = (check_set(t, one, b) for one, b in zip(data["data_sets"], ["simulated", "unknown"]))
    t.expect(page.count('<tr class="on-front">') == sum(any(p["front"].values()) for one in data["data_sets"]
                                                        for p in one["points"]), "rows on a front are marked")
    # a stroke of M1 is 50 mm at 2 mm/s; M2 is two of them
    t.expect(abs(simulated["default"]["contact_s"] - 25) < 0.5, f"M1: {simulated['default']['contact_s']} s")
    t.expect(abs(simulated["M2"]["contact_s"] - 50) < 1, f"M2: {simulated['M2']['contact_s']} s")
    joined = simulated["M1"]["contact_s"] if "M1" in simulated else simulated["default"]["contact_s"]
    t.expect(abs(simulated["M1+M2"]["contact_s"] - joined - simulated["M2"]["contact_s"]) < 1e-9, "M1+M2 takes both")
    t.expect(abs(simulated["2 s"]["contact_s"] - 2) < 0.03, f"2 s: {simulated['2 s']['contact_s']}")
    for name in ("N 1", "N 195", "PCA cores", "LDA", "SVC", "trees", "best of all", "0.5 s", "16 s", "DAG", "short-list of 2"):
        t.expect(name in simulated, f"no {name} in {list(simulated)}")
    t.expect("speed" in data["data_sets"][0]["left_out"], f"left out: {data['data_sets'][0]['left_out']}")
    t.expect(simulated["default"]["tested"] == 3 * len(FABRICS) * 4, f"4 of 6 test: {simulated['default']['tested']}")
    # each repetition is left out once; each speed is half of the trials
    t.expect(recorded["default"]["tested"] == 48 and data["data_sets"][1]["facts"]["splits"] == 2, "groups left out")
    t.expect(recorded["10 mm/s"]["tested"] == recorded["20 mm/s"]["tested"] == 24, "trials of one speed")
    right = sum(24 * recorded[s]["accuracy"] for s in ("10 mm/s", "20 mm/s"))
    t.expect(abs(right - 48 * recorded["default"]["accuracy"]) < 1e-9, f"the speeds make up the default: {right}")
    t.expect(abs(recorded["10 mm/s"]["contact_s"] - 4) < 0.05 and abs(recorded["20 mm/s"]["contact_s"] - 2) < 0.05,
             "seconds of a stroke")


def chosen_families(t, d):
    for split in (["--train-groups", "0", "--test-groups", "1"], ["--leave-one-group-out"], ["--train-fraction", "0.4"]):
        repeats, splits = (["--repeats", "4"], ["--splits", "4"]) if split[0] == "--train-fraction" else ([], [])
        evaluated = t.succeeds("evaluate", "recorded.h5", *split, *repeats, "--learner", "pvalue,lda", cwd=d)["results"]
        out = t.succeeds("trade", "classifier", "recorded.h5", "-o", "v.html", "--vary", "learner,slide", *split, *splits,
                         cwd=d)["data_sets"][0]
        points = check_set(t, out, "unknown")
        t.expect({p["family"] for p in out["points"]} == {"default", "learner", "slide"}, "only what was asked for")
        for name, learner in (("default", "pvalue"), ("LDA", "lda")):
            ours, theirs = points[name], evaluated[learner]
            t.expect(abs(ours["accuracy"] - theirs["accuracy"]) < 1e-12 and ours["ci95_method"] == theirs["ci95_method"]
                     and all(abs(a - b) < 1e-12 for a, b in zip(ours["ci95"], theirs["ci95"])),
                     f"{split}, {name}: {ours['accuracy']} {ours['ci95']} {ours['ci95_method']} is not as `weft evaluate` "
                     f"has it: {theirs['accuracy']} {theirs['ci95']} {theirs['ci95_method']}")


def refusals(t, d):
    t.refuses("features", "sim.h5", "-o", "f.csv", cwd=d, code="invalid argument", got="M1, M2", says=["--exploration"])
    trade = ["trade", "classifier", "recorded.h5"]
    t.refuses(*trade, "-o", "x.html", "--vary", "learnr", cwd=d, says=["--vary", "learnr", "learner?"], status=2)
    t.refuses(*trade, cwd=d, says=["--output"], status=2)
    t.refuses("trade", "bicycle", cwd=d, says=["'bicycle'", "weft trade"], status=2)
    t.refuses("trade", cwd=d, says=["subcommand"], status=2)
    t.refuses("trade", "clasifier", cwd=d, says=["'clasifier'", "weft trade", "classifier?"], status=2)
    t.refuses("queue", "--socket", "x.sock", "remov", "R1", cwd=d, says=["'remov'", "weft queue", "remove?"], status=2)
    t.refuses("queue", "--socket", "x.sock", cwd=d, code="not found", where=["x.sock"])
    t.refuses("--json", "trade", "bicycle", cwd=d, says=["'bicycle'", "weft trade"], status=2)
    t.refuses("tarde", "classifier", cwd=d, says=["'tarde'", "weft", "trade?"], status=2)
    t.refuses(*trade, "-o", "recorded.h5", cwd=d, code="invalid argument", where=["recorded.h5"], got="")
    t.refuses(*trade, "-o", "x.html", "--data", "recorded.h5", cwd=d, code="invalid argument", where=["recorded.h5"], got="")
    t.refuses(*trade, "-o", "x.html", "--data", "./x.html", cwd=d, code="invalid argument", where=["--data"], got="./x.html")
    t.refuses(*trade, "-o", "no/such/x.html", cwd=d, code="not found", where=["no/such/x.html"], got="no/such")
    t.refuses(*trade, "-o", "x.html", "--vary", "exploration", cwd=d, code="invalid argument", where=["recorded.h5"], got="exploration")
    t.refuses("trade", "classifier", "one.h5", "-o", "x.html", cwd=d, code="invalid argument", where=["one.h5", "labels"], got="1", expected="2")
    t.refuses("trade", "classifier", "gone.h5", "-o", "x.html", cwd=d, says=["gone.h5"])
    t.refuses(*trade, "-o", "x.html", "--exploration", "M9", cwd=d, says=["M9"])
    t.refuses(*trade, "-o", "x.html", "--timings", "4", cwd=d, says=["--timings"], status=2)
    t.refuses(*trade, "-o", "x.html", "--train-groups", "0", "--test-groups", "0", cwd=d, says=["both"])


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory(prefix="weft-trade-") as folder:
        d = pathlib.Path(folder)
        simulated_set(t, d, root)
        recorded_set(t, d)
        both_sets(t, d)
        chosen_families(t, d)
        refusals(t, d)
    t.finish()


main()
