#!/usr/bin/env python3
"""SIMULATED fabrics: the paper's comparison, and the physics that separates the fabrics.

    cloth.py WEFT SOURCE_ROOT [PART ...]      prints tables, writes out/bench/cloth.json

paper    accuracy of every learner on M1, M2 and both together, beside the paper's figures (Tables II, IV; section IV-B)
curve    accuracy against the number of training trials of each fabric
length   12.5 to 120 mm along the weft, and 50 mm along weft and warp each
causes   M1 without some parts of the plant: spread of trials, waviness, noise of the pads, texture
groups   features that carry the difference: between-fabric share of the variance, and an SVM (scikit-learn) for each pair on some columns only
pairs    confused fabrics, compared with their differences in sim/fabrics.json; Mantel's test

Every figure describes the plant model, not real fabric. 17 fabrics, 20 trials of each, 40 % train (8 of each), 30 random splits. The first four parts
repeat the demo's campaign under WEFT_CLOTH_SEEDS (5) seeds, the demo's first. They give means over campaigns with Student's 95 % interval, because
campaigns differ by several points. Campaigns of one seed touch the same patches of fabric, so differences are taken seed by seed. groups and pairs
use the demo's campaign.
"""
import concurrent.futures
import copy
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

from cloth_physics import between_share, confused, group_table, mantel, properties
from scipy.stats import t as student

SEEDS = [2016 + k for k in range(int(os.environ.get("WEFT_CLOTH_SEEDS", 5)))]
REPEATS = 30
TRIALS = (2, 3, 4, 6, 8, 12)
LEARNERS = ("pvalue", "pca", "all", "lda", "svc", "trees")
PAPER = {("M1", "pvalue"): "98", ("M1", "pca"): "89", ("M1", "all"): "89", ("M2", "pvalue"): "99", ("M2", "pca"): "99"}


class Cloth:
    """Campaigns like the demo's, by default on its bench."""

    def __init__(self, weft, root, folder):
        self.weft, self.root, self.folder = weft, root, folder
        self.recipe = self.read("recipes/library/khan2016.json")
        self.rig = self.read("sim/rigs/bench17.json")
        self.fabrics = self.read("sim/fabrics.json")

    def read(self, name):
        return json.loads((self.root / name).read_text())

    def run(self, *arguments):
        ran = subprocess.run([self.weft, *map(str, arguments), "--json"], capture_output=True, text=True)
        if ran.returncode != 0:
            raise RuntimeError(f"weft {' '.join(map(str, arguments))}: {ran.stderr[-2000:]}")
        return json.loads(ran.stdout)

    def straight(self, mm):
        """M1 with a stroke of `mm`."""
        out = copy.deepcopy(self.recipe["explorations"]["M1"])
        out["description"] = f"One straight stroke of {mm:g} mm along the weft."
        out["phases"][2]["path"] = [{"dx_mm": 0, "dy_mm": mm}]
        return out

    def campaign(self, seed, place, explorations, rig, fabrics):
        recipe = {key: value for key, value in self.recipe.items() if key != "$schema"}
        recipe.update(name=place.name, explorations=explorations, seed=seed)
        rig = copy.deepcopy(rig)
        rig["simulation"].update(fabrics="fabrics.json", fidelity=str(self.root / "sim/fidelity.json"))
        for file, content in (("recipe", recipe), ("rig", rig), ("fabrics", fabrics)):
            (place / f"{file}.json").write_text(json.dumps(content))
        self.run("run", place / "recipe.json", "--rig", place / "rig.json", "--out", place / "out", "--no-evaluate",
                 "--no-error-check")
        return place / "out/dataset.h5"

    def learning_curve(self, data, exploration, learners):
        """{learner: {training trials of each fabric: accuracy}} on fixed test parts."""
        points = self.run("evaluate", data, "--exploration", exploration, "--train-fraction", 0.6, "--repeats", 5, "--threads", 1,
                          "--curve-draws", 2, "--learning-curve", ",".join(map(str, TRIALS)), "--learner", ",".join(learners))["learning_curve"]
        return {k: {p["trials"]: p["accuracy"][k]["mean"] for p in points} for k in learners}

    def evaluate(self, data, exploration, learners):
        found = self.run("evaluate", data, "--exploration", exploration, "--train-fraction", 0.4, "--repeats", REPEATS, "--threads", 1,
                         "--learner", ",".join(learners))["results"]
        return {k: found[k]["accuracy"] for k in learners}

    def over_seeds(self, explorations, asked, learners, rig=None, fabrics=None, measure=None):
        """{exploration: {learner: [accuracy, one per seed]}} of campaigns of `explorations`, measured on each of `asked`."""
        def one(seed):
            with tempfile.TemporaryDirectory(dir=self.folder) as d:
                data = self.campaign(seed, pathlib.Path(d), explorations, rig or self.rig, fabrics or self.fabrics)
                return {e: (measure or self.evaluate)(data, e, learners) for e in asked}
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            found = list(pool.map(one, SEEDS))
        return {e: {k: [f[e][k] for f in found] for k in learners} for e in asked}

    def demo(self):
        """The demo's own data set, made once."""
        place = self.folder / "demo"
        if not place.exists():
            place.mkdir()
            self.campaign(SEEDS[0], place, self.recipe["explorations"], self.rig, self.fabrics)
        return place / "out/dataset.h5"


def interval(values):
    """Mean and half of Student's 95 % interval, in per cent."""
    half = student.ppf(0.975, len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else math.nan
    return 100 * statistics.mean(values), 100 * half


def words(values):
    return "{:.1f} +- {:.1f}".format(*interval(values))


def against(values, others):
    return "{:+.1f} +- {:.1f}".format(*interval([a - b for a, b in zip(values, others)]))


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def print_head(cells):
    print_row(cells)
    print("|" + "---|" * len(cells))


def paper(cloth):
    asked = ("M1", "M2", "M1+M2")
    out = cloth.over_seeds(cloth.recipe["explorations"], asked, LEARNERS)
    print(f"Per cent right, mean over {len(SEEDS)} campaigns (the demo's own: seed {SEEDS[0]}).\n")
    print_head(["", *LEARNERS])
    for e in asked:
        print_row([e, *(words(out[e][k]) for k in LEARNERS)])
        print_row([f"{e}, the demo's campaign", *(f"{100 * out[e][k][0]:.1f}" for k in LEARNERS)])
        if any(key[0] == e for key in PAPER):
            print_row([f"{e}, paper", *(PAPER.get((e, k), "-") for k in LEARNERS)])
    return out


def curve(cloth):
    learners = ("pvalue", "all", "lda")
    found = cloth.over_seeds(cloth.recipe["explorations"], ("M1", "M2"), learners, measure=cloth.learning_curve)
    print("Per cent right on 40 % of the trials, 5 random splits and 2 draws a campaign.\n")
    print_head(["trials of each", *(f"{e} {k}" for e in found for k in learners)])
    for n in TRIALS:
        print_row([str(n), *(words([c[n] for c in found[e][k]]) for e in found for k in learners)])
    return found


def length(cloth):
    cases = {f"{mm:g} mm along the weft": cloth.straight(mm) for mm in (12.5, 25, 50, 75, 100, 120)}
    cases["50 mm along weft and warp each"] = cloth.recipe["explorations"]["M2"]
    print("p-value cores; every path is called M1, so that all touch the same patches.\n")
    print_head(["path", "per cent right", "against 50 mm"])
    out = {}
    for name in sorted(cases, key=lambda n: not n.startswith("50 mm along the")):
        out[name] = cloth.over_seeds({"M1": cases[name]}, ["M1"], ["pvalue"])["M1"]["pvalue"]
        print_row([name, words(out[name]), against(out[name], out["50 mm along the weft"])])
    return out


def without(cloth, switches=(), pads=None, spread=None):
    """A bench without these switches; `pads` replaces settings of the pads, `spread` lists the only spreads of trials that remain."""
    rig, fabrics = copy.deepcopy(cloth.rig), copy.deepcopy(cloth.fabrics)
    for name in switches:
        rig["simulation"]["switches"][name] = False
    rig["simulation"]["pads"].update(pads or {})
    if spread is not None:
        for name, value in fabrics["trial_spread"].items():
            value[0] = value[0] if name in spread else 0
    return {"rig": rig, "fabrics": fabrics}


def causes(cloth):
    calm = ("trial_spread", "waviness")
    quiet = {"noise_counts": 0.5, "drift_counts": 0, "creep": 0, "hysteresis": 0}  # frames without noise would count as frozen
    cases = {
        "as shipped": without(cloth),
        "no spread of trials": without(cloth, ["trial_spread"]),
        "of the spread lambda's alone (3 %)": without(cloth, spread=["lambda"]),
        "of the spread the pressure's alone (6 %)": without(cloth, spread=["pressure"]),
        "of the spread the pads' gain's alone (1 %)": without(cloth, spread=["gain"]),
        "of the spread the skew's alone (17 mrad)": without(cloth, spread=["skew_mrad"]),
        "no waviness": without(cloth, ["waviness"]),
        "neither spread nor waviness": without(cloth, calm),
        "nor drift and creep, a third of the noise": without(cloth, calm, quiet),
        "no texture": without(cloth, ["texture"]),
    }
    learners = ("pvalue", "trees")
    print("M1.\n")
    print_head(["plant", *(cell for k in learners for cell in (k, "against as shipped"))])
    out = {}
    for name, bench in cases.items():
        out[name] = cloth.over_seeds({"M1": cloth.straight(50)}, ["M1"], learners, **bench)["M1"]
        print_row([name, *(cell for k in learners for cell in (words(out[name][k]), against(out[name][k], out["as shipped"][k])))])
    return out


def groups(cloth):
    out = {}
    for e in ("M1", "M2"):
        csv = cloth.folder / f"{e}.csv"
        cloth.run("features", cloth.demo(), "--exploration", e, "-o", csv)
        out[e] = {"between": between_share(csv), "right": group_table(csv)}
    print("Share of the variance that is between fabrics, median over pads; per cent right of the columns alone, 8 splits (scikit-learn: an SVC "
          "for each pair, C 8, on the 20 columns of the largest |t|; standard deviation over splits).\n")
    print_head(["columns", "between, M1", "M2", "right, M1", "M2"])
    for name in out["M1"]["right"]:
        shares = [out[e]["between"].get(name) for e in out]
        rights = [out[e]["right"][name] for e in out]
        print_row([name, *("-" if s is None else f"{s:.2f}" for s in shares),
                   *(f"{100 * r['right']:.0f} (sd {100 * r['sd']:.0f})" for r in rights)])
    for e in out:
        share = out[e]["between"]
        print(f"\n{e}: the first principal component has {100 * share['component']:.0f} % of the variance of the scaled features, and "
              f"{100 * share['of it between']:.0f} % of its own is between fabrics.")
    return out


def pairs(cloth):
    out = {}
    known = properties(cloth.fabrics)
    for e in ("M1", "M2"):
        found = cloth.run("evaluate", cloth.demo(), "--exploration", e, "--train-fraction", 0.4, "--repeats", REPEATS, "--learner",
                          "pvalue")["results"]["pvalue"]["confusion"]
        share, worst = confused(found)
        out[e] = {"mantel": {name: mantel(share, [values.get(k) for k in found["labels"]]) for name, values in known.items()},
                  "worst": worst}
    print("Rank correlation over pairs of fabrics of how often the two are confused (p-value cores) with how far apart they are; in brackets "
          "Mantel's p, 2000 permutations.\n")
    print_head(["far apart in", *out])
    for name in known:
        print_row([name, *(f"{out[e]['mantel'][name]['r']:.2f} ({out[e]['mantel'][name]['p']:.4f})" for e in out)])
    for e in out:
        worst = out[e]["worst"]
        print(f"\n{e}: the twelve most confused of 136 pairs make {100 * worst['share']:.0f} % of all errors: {', '.join(worst['pairs'])}.")
    return out


def main():
    weft, root = (str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve())
    parts = {f.__name__: f for f in (paper, curve, length, causes, groups, pairs)}
    asked = sys.argv[3:] or list(parts)
    if unknown := [name for name in asked if name not in parts]:
        sys.exit(f"no such part: {', '.join(unknown)}; there are {', '.join(parts)}")
    results = {}
    target = pathlib.Path("out/bench/cloth.json")
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="weft-cloth-") as d:
        cloth = Cloth(weft, root, pathlib.Path(d))
        for name in asked:
            print(f"## SIMULATED: {name}\n")
            results[name] = parts[name](cloth)
            print()
            target.write_text(json.dumps({"name": "cloth", "bench": "simulated", "seeds": SEEDS, "parts": results,
                                          "commit": os.environ.get("WEFT_COMMIT", "unknown")}, indent=2) + "\n")


main()
