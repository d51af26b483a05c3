#!/usr/bin/env python3
"""Campaign design, SIMULATED and on real strokes: stability of the pilot study's choice, coverage of the intervals of forecasts.

    design.py WEFT SOURCE_ROOT [SHARED] [pilot|campaigns|fabricslide ...]    prints tables, writes out/bench/design.json

pilot        recipes/library/pilot-force-speed.json under 20 seeds: how often each cell is recommended, and the statement of the page
campaigns    100 seeded campaigns of 20 repetitions, predicted from their first 8, against the result (a) of all 20 repetitions of
             the same campaign, which share those 8, and (b) of 20 repetitions of the campaign of the next seed, which share none
fabricslide  real strokes of each grip, in 20 drawn orders: the accuracy of all strokes of a fabric, predicted from half of them

The seeds are those of the test; the methods were developed on others (1 to 20). WEFT_DESIGN_CAMPAIGNS, _PILOTS and _ORDERS set the numbers,
WEFT_DESIGN_FIRST_SEED the first seed.
"""
import collections
import concurrent.futures
import itertools
import json
import os
import pathlib
import subprocess
import sys
import tempfile

CAMPAIGNS = int(os.environ.get("WEFT_DESIGN_CAMPAIGNS", 100))
PILOTS = int(os.environ.get("WEFT_DESIGN_PILOTS", 20))
ORDERS = int(os.environ.get("WEFT_DESIGN_ORDERS", 20))
FIRST = int(os.environ.get("WEFT_DESIGN_FIRST_SEED", 1001))
FABRICS = ["denim", "cotton", "silk", "satin", "wool", "felt"]
REPETITIONS, SEEN = 20, 8
GRIPS = [120, 150, 180, 210, 250]


def run(weft, *arguments):
    ran = subprocess.run([weft, *map(str, arguments), "--json"], capture_output=True, text=True)
    if ran.returncode != 0:
        raise RuntimeError(f"weft {' '.join(map(str, arguments))}: {ran.stderr[-2000:]}")
    return json.loads(ran.stdout)


def pilot(weft, root, seed):
    with tempfile.TemporaryDirectory() as d:
        run(weft, "run", root / "recipes/library/pilot-force-speed.json", "--rig", root / "sim/rigs/pilot17.json",
            "--out", f"{d}/out", "--seed", seed, "--yes", "--no-evaluate", "--no-error-check")
        return run(weft, "design", "analyse", f"{d}/out/dataset.h5")["analyses"][0]["recommendation"]


def repetitions(weft, data, *arguments):
    return run(weft, "design", "repetitions", data, *arguments)


def foretold(weft, data, seen, whole, *arguments):
    """Accuracy of `whole` repetitions, predicted from `seen` repetitions."""
    told = repetitions(weft, data, "--first", seen, "--predict", whole, *arguments)
    assert told["repetitions"] == seen
    low, high = told["predicted"]["interval95"]
    return {"told": told["predicted"]["accuracy"], "low": low, "high": high}


def measured(weft, data, whole, *arguments):
    """Accuracy measured with `whole` repetitions."""
    last = repetitions(weft, data, "--draws", 1, "--first", whole, *arguments)["curve"][-1]
    assert last["repetitions"] == whole
    return last["accuracy"]


def compared(forecast, got):
    return {**forecast, "measured": got, "within": forecast["low"] <= got <= forecast["high"]}


def stroke_forecast(weft, data, whole, *arguments):
    return compared(foretold(weft, data, whole // 2, whole, *arguments), measured(weft, data, whole, *arguments))


def campaign(weft, root, seed):
    """The prediction from a campaign's first repetitions, and the accuracy measured with all of them."""
    with tempfile.TemporaryDirectory() as d:
        recipe = json.loads((root / "recipes/library/m1.json").read_text())
        del recipe["$schema"]
        recipe.update(name="forecast", fabrics=FABRICS, repetitions=REPETITIONS)
        phases = recipe["explorations"]["M1"]["phases"]
        phases[2]["path"] = [{"dx_mm": 0, "dy_mm": 20}]
        pathlib.Path(d, "recipe.json").write_text(json.dumps(recipe))
        run(weft, "run", f"{d}/recipe.json", "--rig", root / "sim/rigs/bench17.json", "--out", f"{d}/out", "--seed", seed,
            "--no-evaluate", "--no-error-check")
        data = f"{d}/out/dataset.h5"
        return foretold(weft, data, SEEN, REPETITIONS), measured(weft, data, REPETITIONS)


def table(rows, title):
    within = sum(r["within"] for r in rows)
    errors = sorted(r["told"] - r["measured"] for r in rows)
    widths = sorted(r["high"] - r["low"] for r in rows)
    middle = len(rows) // 2
    measured = sorted(r["measured"] for r in rows)
    print(f"{title}: {within} of {len(rows)} within their own 95 % interval; measured {measured[0]:.3f} to {measured[-1]:.3f}, "
          f"median {measured[middle]:.3f}; median error of the forecast {errors[middle]:+.3f}, median width of the "
          f"interval {widths[middle]:.3f}", flush=True)
    return {"within": within, "of": len(rows), "median_error": errors[middle], "median_width": widths[middle], "rows": rows}


def main(weft, root, *rest):
    root = pathlib.Path(root).resolve()
    parts = {"pilot", "campaigns", "fabricslide"} & set(rest) or {"pilot", "campaigns", "fabricslide"}
    folders = [part for part in rest if part not in ("pilot", "campaigns", "fabricslide")]
    shared = pathlib.Path(folders[0] if folders else root.parent / "shared")
    out = {"commit": os.environ.get("WEFT_COMMIT", "")}
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        if "campaigns" in parts:
            found = list(pool.map(lambda s: campaign(weft, root, s), range(FIRST, FIRST + CAMPAIGNS + 1)))
            title = f"SIMULATED, {len(FABRICS)} fabrics, {REPETITIONS} repetitions forecast from {SEEN}"
            out["campaigns"] = table([compared(*one) for one in found[:-1]], title + ", of the same campaign")
            out["independent"] = table([compared(one[0], other[1]) for one, other in itertools.pairwise(found)],
                                       title + ", of an independent campaign")
        if "fabricslide" in parts and not (shared / "data/fabricslide").is_dir():
            print("fabricslide: skipped, no", shared / "data/fabricslide")
        elif "fabricslide" in parts:
            rows = []
            for grip in GRIPS:
                with tempfile.TemporaryDirectory() as d:
                    run(weft, "dataset", "import", shared / "data/fabricslide", "--format", "fabricslide", "--filter",
                        f"*_F{grip}_*", "-o", f"{d}/f.h5")
                    real = ("--strokes", "--norm", "rms")
                    whole = repetitions(weft, f"{d}/f.h5", "--draws", 1, *real)["repetitions"]
                    rows += pool.map(lambda s: stroke_forecast(weft, f"{d}/f.h5", whole, *real, "--seed", s),
                                     range(FIRST, FIRST + ORDERS))
                    print(f"fabricslide, grip {grip}: {whole} strokes of each fabric", flush=True)
            out["fabricslide"] = table(rows, "real strokes of fabricslide (label and mounting confounded), all forecast from half of them")
        if "pilot" in parts:
            told = list(pool.map(lambda s: pilot(weft, root, s), range(FIRST, FIRST + PILOTS)))
            cells = collections.Counter(json.dumps(r["factors"]) for r in told)
            print(f"SIMULATED, pilot under {len(told)} seeds: recommended cells", dict(cells.most_common()))
            agree = cells.most_common(1)[0][1]
            print(f"the most frequent in {agree} of {len(told)}; a choice called supported in "
                  f"{sum(r['supported'] for r in told)}; median share of resamples "
                  f"{sorted(r['share'] for r in told)[len(told) // 2]:.2f}")
            out["pilot"] = {"cells": dict(cells), "agree": agree, "of": len(told), "recommendations": told}
    folder = root / "out/bench"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "design.json").write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
