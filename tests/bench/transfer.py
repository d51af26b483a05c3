#!/usr/bin/env python3
"""Distance of the calibrated simulation from fabricslide: statistics, intraclass correlations, and accuracy from one side to the other.

    transfer.py WEFT ROOT [--fabrics FILE] [--before FILE] [--shared FOLDER] [--json FILE] [--write PAGE]

`weft sim strokes` simulates every recorded stroke with two fabric tables: the calibrated one (--fabrics), and an earlier one (--before; default: the
newest sim/fabrics.json of the history without a calibration). Recorded and SIMULATED strokes then pass through the same statistics, features and
learners. --write fills the text between the markers of docs/explanation/calibration.md; the pictures there come from `weft sim calibrate --pictures`.
"""
import argparse
import collections
import csv
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

PREFIX = "fabricslide"
LEARNERS = {"pvalue": "p-value cores", "pca": "PCA cores", "all": "cores, all features", "lda": "LDA", "trees": "trees"}
FEATURES = ["--norm", "rms"]  # strokes have different lengths
PERMUTATIONS = 5
NAME = re.compile(r"(recorded|simulated)-(.+)_F([0-9.]+)_V(-?[0-9.]+)mmps_\d+\.csv")

# The first table of realism.md: name, its parts as `weft sim strokes` names them, factor and unit.
TWELVE = [
    ("modulation over 50 mm", ["modulation"], 100, "%"),
    ("modulation, whole stroke", ["modulation_stroke"], 100, "%"),
    ("log-modulation, spread between cloths, within cells", ["modulation_between", "modulation_within"], 1, ""),
    ("pad pattern, spread within one path", ["pattern_path"], 1, ""),
    ("pad pattern, other patches of one mounting", ["pattern_patch"], 1, ""),
    ("pad pattern, between mountings", ["pattern_mounting"], 1, ""),
    ("pad level, sd of its logarithm over pads", ["level_spread"], 1, ""),
    ("noise, and its exponent of the level", ["noise", "noise_exponent"], 1, "counts; 1"),
    ("correlation of neighbours, far pads, common share", ["neighbours", "far", "common_share"], 1, ""),
    ("drift per stroke", ["drift"], 100, "%"),
    ("jumps above 5 sd", ["jumps"], 1, ""),
    ("spectral peak", ["peak"], 1, "1/mm"),
]
LEAST_INSIDE = 9  # aim, like LEAST_NEAR

# Columns of the second table. If a column has two features, both must be near.
ELEVEN = [["max"], ["min"], ["mean", "norm"], ["mode"], ["range"], ["var"], ["kurt"], ["skew"], ["m5"], ["Hfrq"], ["Sh"]]
OF_LEVEL = {"max", "min", "mean", "norm", "mode"}
NEAR, LEAST_NEAR = 0.15, 9
# Definitions of a group: the fabric and grip of a run; the strokes of one path; the latter only at the speed of realism.md.
GROUPS = {
    "fabric and grip": lambda fabric, grip, speed: (fabric, grip),
    "fabric, grip, direction and speed": lambda fabric, grip, speed: (fabric, grip, speed),
    "the same, 10 mm/s alone": lambda fabric, grip, speed: (fabric, grip, speed) if abs(float(speed)) == 10 else None,
}


def run(weft, *arguments):
    ran = subprocess.run([weft, *map(str, arguments), "--json"], capture_output=True, text=True)
    if ran.returncode != 0:
        sys.exit(f"weft {' '.join(map(str, arguments))}: {ran.stderr}")
    return json.loads(ran.stdout)


# Statistics.


def values_of(rows, name, side):
    """Values of strokes of single fabrics; nothing for a statistic that needs several fabrics."""
    return {r["strokes_of"]: r[side] for r in rows if r["strokes_of"] and r["name"] == name and r[side] is not None}


def one_part(rows, name):
    """Real range over the fabrics, and the median of the simulated ones. For a statistic of all fabrics together: the 95 % interval."""
    real, made = values_of(rows, name, "recorded"), values_of(rows, name, "simulated")
    if real:
        low, high = min(real.values()), max(real.values())
        inside = sum(low <= v <= high for v in made.values())
        return {"name": name, "real": statistics.median(real.values()), "range": [low, high],
                "simulated": statistics.median(made.values()) if made else None, "cloths_inside": inside, "cloths": len(made)}
    whole = [r for r in rows if not r["strokes_of"] and not r["cloth"] and r["name"] == name]
    if not whole:
        return None
    return {"name": name, "real": whole[0]["recorded"], "range": whole[0]["interval"], "simulated": whole[0]["simulated"]}


def is_inside(part):
    return part is not None and part["simulated"] is not None and part["range"][0] <= part["simulated"] <= part["range"][1]


def twelve_of(rows):
    out = []
    for title, names, factor, unit in TWELVE:
        parts = [one_part(rows, name) for name in names]
        out.append({"statistic": title, "unit": unit, "factor": factor, "parts": parts, "inside": all(map(is_inside, parts))})
    return out


# Intraclass correlations.


def intraclass(groups):
    """One-way random effects; groups of one count only in the spread between groups. None: no variation."""
    groups = [g for g in groups if g]
    count, total = len(groups), sum(map(len, groups))
    if count < 2 or total == count:
        return None
    means = [statistics.fmean(g) for g in groups]
    grand = sum(map(sum, groups)) / total
    between = sum(len(g) * (m - grand) ** 2 for g, m in zip(groups, means)) / (count - 1)
    within = sum((x - m) ** 2 for g, m in zip(groups, means) for x in g) / (total - count)
    size = (total - sum(len(g) ** 2 for g in groups) / total) / (count - 1)
    spread = between + (size - 1) * within
    return (between - within) / spread if spread > 0 else None


def correlations_of(table, side, key):
    """Feature -> median over the pads."""
    with open(table, newline="") as f:
        head, *rows = csv.reader(f)
    keys = []
    for row in rows:
        of, *parts = NAME.fullmatch(row[0]).groups()
        keys.append(key(*parts) if of == side else None)
    out = {}
    for feature in sum(ELEVEN, []):
        pads = []
        for column in (i for i, name in enumerate(head) if name.startswith(feature + ".M.")):
            groups = collections.defaultdict(list)
            for k, row in zip(keys, rows):
                if k is not None:
                    groups[k].append(float(row[column]))
            pads.append(intraclass(list(groups.values())))
        pads = [p for p in pads if p is not None]
        out[feature] = statistics.median(pads) if pads else None
    return out


def near(real, made):
    """The columns in which every feature is near."""
    def one(name):
        return None not in (real[name], made[name]) and abs(real[name] - made[name]) <= NEAR
    return [names for names in ELEVEN if all(map(one, names))]


# Accuracies.


def accuracies(weft, data, *options):
    """Learner -> accuracy, 95 % interval, and the same with each pad's level removed."""
    out = {name: {} for name in LEARNERS}
    for level in ("kept", "removed"):
        remove = ["--remove-level", "motion"] if level == "removed" else []
        said = run(weft, "evaluate", data, "--learner", ",".join(LEARNERS), *FEATURES, *remove, *options)
        for name in LEARNERS:
            result = said["results"][name]
            out[name][level] = result.get("permuted", result)["accuracy"]
            out[name][level + "_ci95"] = None if "permuted" in result else result["ci95"]
    return out


def split(train, test):
    return ["--train-groups", train, "--test-groups", test]


# Main part.


def earlier_table(root, folder):
    """The newest committed table without a calibration; None without a history."""
    def git(*arguments):
        return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True).stdout
    for commit in git("log", "--format=%H", "--", "sim/fabrics.json").split():
        text = git("show", f"{commit}:sim/fabrics.json")
        if text and not json.loads(text).get("calibrations"):
            (folder / "before.json").write_text(text)
            return folder / "before.json", f"sim/fabrics.json of {commit[:10]}"
    return None, "no table without a calibration"


def one_table(weft, recordings, fabrics, folder, name):
    """All results on the simulated strokes of one fabric table."""
    both = folder / f"{name}-both.h5"
    said = run(weft, "sim", "strokes", recordings, "--fabrics", fabrics, "--name", PREFIX, "-o", folder / f"{name}.h5", "--beside", both)
    table = folder / f"{name}.csv"
    run(weft, "features", both, "-o", table, *FEATURES)
    sides = {title: {side: correlations_of(table, side, key) for side in ("recorded", "simulated")} for title, key in GROUPS.items()}
    transfer = {"real to real": accuracies(weft, both, *split("recorded-0", "recorded-1")),
                "simulated to simulated": accuracies(weft, both, *split("simulated-0", "simulated-1")),
                "simulated to real": accuracies(weft, both, *split("simulated-0", "recorded-1")),
                "real to simulated": accuracies(weft, both, *split("recorded-0", "simulated-1"))}
    return {"bench": "simulated", "cloths": said["cloths"], "strokes": said["strokes"], "remarks": said["remarks"],
            "twelve": twelve_of(said["statistics"]), "statistics": said["statistics"], "intraclass": sides, "transfer": transfer}


def newest_calibration(fabrics):
    calibrations = json.loads(pathlib.Path(fabrics).read_text()).get("calibrations") or {}
    return (list(calibrations)[-1], calibrations[list(calibrations)[-1]]) if calibrations else (None, None)


def measure(weft, options, data, folder):
    recordings = folder / f"{PREFIX}.h5"
    imported = run(weft, "dataset", "import", "--format", "fabricslide", data, "-o", recordings)
    before, said = (pathlib.Path(options.before), options.before) if options.before else earlier_table(options.root, folder)
    key, calibration = newest_calibration(options.fabrics)
    out = {"name": "transfer", "recordings_sha256": imported["dataset_sha256"],
           "before_table": said, "after_table": str(options.fabrics), "calibration": key,
           "chance": accuracies(weft, recordings, "--train-fraction", 0.5, "--repeats", 1, "--permute-labels", PERMUTATIONS),
           "before": one_table(weft, recordings, before, folder, "before") if before else None,
           "after": one_table(weft, recordings, options.fabrics, folder, "after") if key else None,
           "commit": os.environ.get("WEFT_COMMIT", "unknown")}
    return out, calibration


# Tables in Markdown.


def number(value):
    return "-" if value is None else f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def table(head, rows):
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def values_text(row, name):
    return "; ".join("-" if p is None or p[name] is None else number(row["factor"] * p[name]) for p in row["parts"])


def range_text(row):
    return "; ".join("not recorded" if p is None else " to ".join(number(row["factor"] * v) for v in p["range"]) for p in row["parts"])


def inside_text(row):
    cloths = [f"{p['cloths_inside']} of {p['cloths']}" if p is not None and "cloths" in p else "-" for p in row["parts"]]
    return f"{'yes' if row['inside'] else 'no'} ({'; '.join(cloths)})"


def statistics_block(found):
    sides = {name: found[name]["twelve"] for name in ("before", "after") if found[name]}
    head = ["statistic", "REAL, range over cloths", "median"]
    for name in sides:
        head += [f"SIMULATED {name}", "within the range (cloths)"]
    some = next(iter(sides.values()))
    rows = []
    for i, (title, _, _, unit) in enumerate(TWELVE):
        row = [title + (f" [{unit}]" if unit else ""), range_text(some[i]), values_text(some[i], "real")]
        for twelve in sides.values():
            row += [values_text(twelve[i], "simulated"), inside_text(twelve[i])]
        rows.append(row)
    counts = [f"SIMULATED {name}: {sum(r['inside'] for r in twelve)} of {len(twelve)} within" for name, twelve in sides.items()]
    return table(head, rows) + "\n\n" + "; ".join(counts) + f" (aim: {LEAST_INSIDE} after)."


def correlation_cell(names, values):
    return ", ".join(number(values[n]) if values[n] is None else f"{values[n]:.2f}" for n in names)


def intraclass_block(found):
    sides = [name for name in ("before", "after") if found[name]]
    head = ["groups", ""] + [", ".join(n) + (" *" if set(n) <= OF_LEVEL else "") for n in ELEVEN] + [f"within {NEAR}"]
    rows = []
    for title in GROUPS:
        real = found[sides[0]]["intraclass"][title]["recorded"]
        rows.append([title, "REAL"] + [correlation_cell(n, real) for n in ELEVEN] + [""])
        for name in sides:
            made = found[name]["intraclass"][title]["simulated"]
            hits = near(real, made)
            cells = [correlation_cell(n, made) + ("" if n in hits else " (no)") for n in ELEVEN]
            rows.append(["", f"SIMULATED {name}"] + cells + [f"{len(hits)} of {len(ELEVEN)}"])
    return table(head, rows) + f"\n\n(no): further than {NEAR} from the real one (aim: {LEAST_NEAR} of {len(ELEVEN)} within it)."


def accuracy_cell(result):
    return f"{100 * result['kept']:.1f} / {100 * result['removed']:.1f}"


def transfer_block(found):
    sides = [name for name in ("before", "after") if found[name]]
    rows = [["real to real (label and mounting confounded)"] + [accuracy_cell(r) for r in found[sides[-1]]["transfer"]["real to real"].values()]]
    for name in sides:
        for title in ("simulated to simulated", "simulated to real", "real to simulated"):
            row = [title.replace("simulated", "SIMULATED") + ", " + name]
            rows.append(row + [accuracy_cell(r) for r in found[name]["transfer"][title].values()])
    rows.append([f"chance: labels shuffled {PERMUTATIONS} times"] + [accuracy_cell(r) for r in found["chance"].values()])
    return table(["trained on, tested on"] + list(LEARNERS.values()), rows)


def value_text(p):
    interval = f" ({number(p['interval'][0])} to {number(p['interval'][1])})"
    return number(p["value"]) + (interval if p["standing"] in ("calibrated", "bounded") else "")


def parameters_block(key, calibration):
    rows = [[p["name"], p["cloth"] or "all", p["standing"].replace("_", " "), number(p["estimate_before"]), value_text(p),
             " to ".join(map(number, p["bounds"]))] for p in calibration["parameters"]]
    text = f"Calibration {key} of the cloth table: {calibration['command']}, data set {calibration['dataset_sha256'][0][:12]}.\n\n"
    blind = "".join(f"* {sentence}\n" for sentence in calibration["blind_directions"])
    return text + table(["parameter", "cloth", "standing", "estimate before", "value (95 % interval)", "bounds"], rows) + (f"\n\n{blind}" if blind else "")


def held_out_block(calibration):
    held_out = calibration["held_out"]
    if not held_out["checked"]:
        return "Not checked."
    counts = collections.Counter((s["name"], bool(s["cloth"])) for s in held_out["statistics"] if not s["inside"])
    outside = [name + (f" ({count} cloth{'s' if count > 1 else ''})" if of_cloth else "") for (name, of_cloth), count in counts.items()]
    text = f"{'Passes' if held_out['passes'] else '**Does not pass**'}: {held_out['inside']} of {len(held_out['statistics'])} statistics of " \
           f"{held_out['strokes']} strokes that were not fitted lie where 95 % of the SIMULATED ones do (80 % are asked for)."
    return text + (f" Outside: {', '.join(outside)}." if outside else "")


def pictures_block(page):
    files = sorted((page.parent / "pictures").glob("calibration-*.svg"))
    return "\n\n".join(f"![{f.stem.removeprefix('calibration-').replace('-', ' ')}: recorded, SIMULATED before, SIMULATED after](pictures/{f.name})"
                       for f in files) or "No pictures: `weft sim calibrate --pictures` writes them."


def write_page(page, blocks):
    text = page.read_text()
    for name, block in blocks.items():
        begin, end = f"<!-- generated: {name} -->\n", f"<!-- end: {name} -->"
        if begin not in text or end not in text:
            sys.exit(f"{page}: no markers of {name}")
        at, to = text.index(begin) + len(begin), text.index(end)
        text = text[:at] + "\n" + block.rstrip() + "\n\n" + text[to:]
    page.write_text(text)


def blocks_of(found, calibration, page):
    out = {"statistics": statistics_block(found), "intraclass": intraclass_block(found), "transfer": transfer_block(found)}
    if calibration:
        out |= {"parameters": parameters_block(found["calibration"], calibration), "held-out": held_out_block(calibration)}
    return out | ({"pictures": pictures_block(page)} if page else {})


def read_options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weft", type=pathlib.Path)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--fabrics", type=pathlib.Path, help="cloth table with a calibration (sim/fabrics.json)")
    parser.add_argument("--before", help="cloth table before it")
    parser.add_argument("--shared", type=pathlib.Path, help="folder with data/fabricslide")
    parser.add_argument("--json", type=pathlib.Path, default=pathlib.Path("out/bench/transfer.json"))
    parser.add_argument("--write", type=pathlib.Path, help="page; its marked parts are written")
    options = parser.parse_args()
    options.fabrics = options.fabrics or options.root / "sim/fabrics.json"
    options.shared = options.shared or options.root.resolve().parent / "shared"
    return options


def main():
    options = read_options()
    data = options.shared / "data/fabricslide"
    if not data.is_dir():
        sys.exit(f"no recordings in {data}")
    with tempfile.TemporaryDirectory(prefix="weft-transfer-") as folder:
        found, calibration = measure(str(options.weft.resolve()), options, data, pathlib.Path(folder))
    if not found["before"] and not found["after"]:
        sys.exit("no cloth table: name one with --fabrics or --before")
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(found, indent=2) + "\n")
    blocks = blocks_of(found, calibration, options.write)
    for name, block in blocks.items():
        print(f"\n{name}\n\n{block}")
    if not calibration:
        print(f"\n{options.fabrics} has no calibration: nothing is shown as SIMULATED after")
    if options.write:
        if not calibration:
            sys.exit("the page is written for a calibrated table alone")
        write_page(options.write, blocks)


main()
