#!/usr/bin/env python3
"""`weft` with edge cases of people's recordings: units, levels, pauses, dead taxels, clocks, files copied by text transfers.

    cli_edges.py WEFT REPOSITORY SHARED

Every case has its own small input; if SHARED/cases/data/inputs exists, the inputs of the bug reports are tried too.
"""
import csv
import math
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, has, line_has


def write_rows(path, header, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(header + "\n" + "".join(",".join(str(v) for v in row) + "\n" for row in rows))


def write_manifest(folder, rows, name="m.csv"):
    write_rows(folder / name, "file,label,group", [['"' + str(v).replace('"', '""') + '"' for v in row] for row in rows])


def noise(seed, count, scale=10):
    numbers = random.Random(seed)
    return [round(numbers.gauss(0, scale)) for _ in range(count)]


def write_slide(path, seed, shift=0, samples=120, unit=1.0, level=8000, taxels=4, change=None, t_s=None, scale=None):
    """Noise about a level, in counts times `unit`, at 50 Hz; change(sample, taxel, count) alters it."""
    columns = [noise(100 * seed + k, samples, scale or 10 + shift) for k in range(taxels)]
    rows = []
    for i in range(samples):
        counts = [level + shift + column[i] for column in columns]
        if change:
            counts = [change(i, k, v) for k, v in enumerate(counts)]
        rows.append([f"{t_s(i) if t_s else i * 0.02:.4f}"] + [repr(v * unit) if unit != 1.0 else v for v in counts])
    write_rows(path, "t_s," + ",".join(f"ch{k + 1}" for k in range(taxels)), rows)


def slides(folder, labels=("denim", "silk"), groups=3, **how):
    rows = []
    for a, label in enumerate(labels):
        for g in range(groups):
            write_slide(folder / f"{label}{g}.csv", 10 * a + g, 8 * a, **how)
            rows.append([f"{label}{g}.csv", label, f"g{g}"])
    write_manifest(folder, rows)
    return rows


def features(t, folder, *options, data="d.h5"):
    t.run("features", data, "-o", "f.csv", *options, cwd=folder)
    with open(folder / "f.csv", newline="") as file:
        return list(csv.DictReader(file))


def import_slides(t, folder, *options):
    return t.succeeds("dataset", "import", "m.csv", "-o", "d.h5", *options, cwd=folder)


def near(a, b, share=1e-9):
    return math.isclose(float(a), float(b), rel_tol=share, abs_tol=0)


def same_bytes(t, d, repository):
    """The same content gives the same file at any time."""
    slides(d / "slides")
    write_rows(d / "sound" / "a.csv", "t_s,X", [[i / 100, v] for i, v in enumerate(noise(1, 300))])
    write_manifest(d / "sound", [["a.csv", "felt", "1"]])
    write_rows(d / "press" / "a.csv", "1,2,3", [[4, 5, 6], [7, 8, 9]])
    write_manifest(d / "press", [["a.csv", "ball", "1"]])
    campaign = repository / "tests/golden/last_version/campaign/campaign.sqlite"
    shutil.copy(campaign, d / "campaign.sqlite")
    commands = [("dataset", "import", "slides/m.csv"), ("dataset", "import", "sound/m.csv", "--format", "recordings"),
                ("dataset", "import", "press/m.csv", "--format", "imprints"), ("dataset", "export", "campaign.sqlite")]
    written = []
    for turn in range(2):
        for k, command in enumerate(commands):
            ran = t.run(*command, "-o", f"{turn}_{k}.h5", cwd=d)
            t.expect(ran.returncode == 0, f"{command}: {ran.stderr}")
        written.append([(d / f"{turn}_{k}.h5").read_bytes() for k in range(len(commands))])
        time.sleep(1.2)
    for k, command in enumerate(commands):
        t.expect(written[0][k] == written[1][k], f"{command}: other bytes a second later")


def units(t, d):
    """Features in farad are those in counts, scaled; a level of 1e12 costs no precision."""
    powers = {"var": 2, "kurt": 0, "skew": 0, "range": 1, "m5": 5, "Hfrq": 1, "Sh": 1, "hfrq": 1, "sh": 1}
    slides(d / "counts", level=800)
    slides(d / "farad", level=800, unit=1e-15)
    slides(d / "high", level=10**12)
    sets = {}
    for name in ("counts", "farad", "high"):
        import_slides(t, d / name)
        sets[name] = features(t, d / name)
    compared = 0
    for r, row in enumerate(sets["counts"]):
        for column, value in row.items():
            power = powers.get(column.split(".")[0])
            if power is None:
                continue
            compared += 1
            farad = float(sets["farad"][r][column]) * 1e15**power
            t.expect(near(farad, value, 1e-9), f"farad {column}: {farad}, {value} in counts")
            t.expect(near(sets["high"][r][column], value, 1e-7 if column[0] in "HhSs" else 1e-9),
                     f"level 1e12, {column}: {sets['high'][r][column]}, {value} about 800")
    t.expect(compared >= 6 * 4 * 7, f"features compared: {compared}")


def windows(t, d):
    """No window spans a pause or two strokes."""
    gap = lambda i: i * 0.02 + (3.0 if i >= 70 else 0.0)
    slides(d / "gap", t_s=gap, change=lambda i, k, v: v + (5000 if i >= 70 else 0))
    slides(d / "short", t_s=lambda i: i * 0.02 + (0.3 if i >= 70 else 0.0), change=lambda i, k, v: v + (5000 if i >= 70 else 0))
    slides(d / "even")
    for name, expected in (("gap", 3 + 2), ("short", 3 + 2), ("even", 6)):
        import_slides(t, d / name)
        rows = features(t, d / name, "--window-s", "0.4")
        t.expect(len(rows) == 6 * expected, f"{name}: {len(rows)} windows, not {6 * expected}")
        widest = max(float(row["range.M.1"]) for row in rows)
        t.expect(widest < 1000, f"{name}: a window holds both sides of the pause: range {widest}")
    folder = d / "strokes"
    for k, label in enumerate(("a", "b") * 2):
        lines = []
        for i in range(200):
            phase = "M" if i % 100 >= 25 else "P"
            lines.append([f"{i * 0.02:.2f}", phase, 8000 + 500 * (i >= 100) + noise(k, 200)[i]])
        write_rows(folder / f"{label}{k}.csv", "t_s,phase,ch1", lines)
    write_manifest(folder, [[f"{label}{k}.csv", label, f"g{k // 2}"] for k, label in enumerate(("a", "b") * 2)])
    import_slides(t, folder)
    rows = features(t, folder, "--window-s", "1.0")
    t.expect(len(rows) == 4 * 2, f"strokes: {len(rows)} windows")
    t.expect(max(float(row["range.M.1"]) for row in rows) < 400, "a window holds samples of two strokes")
    t.refuses("features", "d.h5", "-o", "bad.csv", "--window-s", "2.0", cwd=folder, code="range", where=["a0.csv"], got="75", expected="100 samples")


def sound_windows(t, d):
    """If samples are missing at a stated rate, no window spans the gap."""
    for name, pause in (("even", 0.0), ("gap", 2.0)):
        for k, label in enumerate(("felt", "foil") * 2):
            write_rows(d / name / f"{label}{k}.csv", "t_s,X",
                       [[f"{i / 100 + (pause if i >= 250 else 0):.3f}", v + 10000 * (i >= 250)] for i, v in enumerate(noise(k, 500))])
        write_manifest(d / name, [[f"{label}{k}.csv", label, str(k // 2)] for k, label in enumerate(("felt", "foil") * 2)])
        t.succeeds("dataset", "import", "m.csv", "-o", "d.h5", "--format", "recordings", "--rate-hz", "100", cwd=d / name)
    made = {name: t.succeeds("evaluate", "d.h5", "--method", "LDA", "--leave-one-group-out", "--window-s", "1", "--step-s", "0.5", cwd=d / name)
            for name in ("even", "gap")}
    t.expect(made["even"]["windows"] == 4 * 9, f"even: {made['even']['windows']}")
    t.expect(made["gap"]["windows"] == 4 * 2 * 4, f"gap: {made['gap']['windows']}")


def codes(answer):
    return sorted(warning["code"] for warning in answer["warnings"])


def taxels(t, d):
    """Import, train and evaluate name dead and saturated taxels with their trials."""
    folder = d / "faulty"
    rows = slides(folder, groups=4)
    write_slide(folder / "denim2.csv", 2, change=lambda i, k, v: 4321 if k == 2 else v)
    write_slide(folder / "silk1.csv", 11, 8, change=lambda i, k, v: min(v + 40 * (i % 30), 8700) if k == 0 else v)
    made = import_slides(t, folder)
    t.expect(codes(made) == ["constant", "saturated"], f"warnings: {made['warnings']}")
    dead, held = ["taxel 3", "constant", "1", "8", "denim2.csv"], ["taxel 1", "saturated", "1", "8", "silk1.csv"]
    t.expect(all(has(w["text"], parts) for w, parts in zip(made["warnings"], (dead, held))), f"warnings: {made['warnings']}")
    for command in (("dataset", "info", "d.h5"), ("train", "d.h5", "-o", "m.model", "--learner", "lda"),
                    ("evaluate", "d.h5", "--learner", "lda", "--leave-one-group-out")):
        text = t.run(*command, cwd=folder).stdout
        t.expect(line_has(text, ["WARNING", *dead]) and line_has(text, ["WARNING", *held]), f"{command}: {text}")
        t.expect(codes(t.succeeds(*command, cwd=folder)) == ["constant", "saturated"], f"{command}: codes")
    clean = d / "clean"
    slides(clean, groups=4)
    t.expect(codes(import_slides(t, clean)) == [], "no warning about good recordings")
    high = d / "stamps"
    slides(high, level=10**15)
    few = import_slides(t, high)["warnings"]
    t.expect([w["code"] for w in few] == ["few_digits"] and has(few[0]["text"], "16 digits"), f"digits: {few}")
    t.expect(len(rows) == 8, "eight trials")


def clocks(t, d):
    """Import, train and evaluate name a clock or counter among the channels; a slow rise is not one."""
    for name, column, code in (("clock", lambda i: 1700000000000 + 10 * i, "only_rises"), ("counter", lambda i: i % 256, "only_rises"),
                               ("nibble", lambda i: i % 16, "only_rises"), ("slow", lambda i: 1000 + 10 * (i // 4), "only_rises"),
                               ("countdown", lambda i: 65535 - i, "only_falls"), ("silent", lambda i: 1e-9 * (i * i % 17), "small_unit"),
                               ("drift", lambda i: round(i / 10 + 3 * math.sin(i)), None)):
        folder = d / name
        for k, label in enumerate(("felt", "foil") * 2):
            write_rows(folder / f"{label}{k}.csv", "t_s,N,X",
                       [[f"{i / 100:.2f}", column(i + 600 * k), v] for i, v in enumerate(noise(k, 600))])
        write_manifest(folder, [[f"{label}{k}.csv", label, str(k // 2)] for k, label in enumerate(("felt", "foil") * 2)])
        expected = [code] if code else []
        made = t.succeeds("dataset", "import", "m.csv", "-o", "d.h5", "--format", "recordings", cwd=folder)
        t.expect(codes(made) == expected, f"{name}: {made['warnings']}")
        for command in (("evaluate", "d.h5", "--method", "LDA", "--leave-one-group-out", "--window-s", "1"),
                        ("train", "d.h5", "-o", "m.model", "--window-s", "1")):
            t.expect(codes(t.succeeds(*command, cwd=folder)) == expected, f"{name}, {command}")
            t.expect(line_has(t.run(*command, cwd=folder).stdout, ["WARNING", "channel N"]) == bool(expected), f"{name}, {command}")


def imprint_units(t, d):
    """The same imprints in counts and in farad give the same answers."""
    found = []
    for unit in (1.0, 2.0**-40):
        folder = d / str(unit)
        rows = []
        for k, label in enumerate(("a", "b", "c")):
            for g in range(4):
                numbers = random.Random(10 * k + g)
                write_rows(folder / f"{label}{g}.csv", ",".join([repr(unit)] * 16),
                           [[repr(unit * round(100 + 50 * math.sin((k + 1) * c * 0.7) * math.cos((k + 1) * r * 0.5) + numbers.gauss(0, 2)))
                             for c in range(16)] for r in range(15)])
                rows.append([f"{label}{g}.csv", label, f"{label}{g}"])
        write_manifest(folder, rows)
        t.succeeds("dataset", "import", "m.csv", "-o", "d.h5", "--format", "imprints", cwd=folder)
        told = t.succeeds("evaluate", "d.h5", "--learner", "lda,trees", "--leave-one-group-out", cwd=folder)
        found.append({learner: result["accuracy"] for learner, result in told["results"].items()})
    t.expect(found[0] == found[1] and found[0]["lda"] > 0.8, f"imprints in another unit: {found}")


def model_files(t, d):
    """The error for a model file damaged by a text transfer differs from that for another version."""
    slides(d / "base", groups=4)
    import_slides(t, d / "base")
    write_rows(d / "base" / "s.csv", "t_s,X", [[i / 100, v] for i, v in enumerate(noise(1, 600))])
    write_rows(d / "base" / "u.csv", "t_s,X", [[i / 100, 2 * v] for i, v in enumerate(noise(2, 600))])
    write_manifest(d / "base", [["s.csv", "felt", "1"], ["u.csv", "foil", "1"]], "r.csv")
    t.succeeds("dataset", "import", "r.csv", "-o", "r.h5", "--format", "recordings", cwd=d / "base")
    t.succeeds("train", "d.h5", "-o", "a.model", "--learner", "lda", cwd=d / "base")
    t.succeeds("train", "r.h5", "-o", "b.model", "--window-s", "1", cwd=d / "base")
    for name, data in (("a", "d.h5"), ("b", "r.h5")):
        changed = d / "base" / f"{name}_crlf.model"
        changed.write_bytes((d / "base" / f"{name}.model").read_bytes().replace(b"\n", b"\r\n"))
        t.refuses("classify", changed.name, data, cwd=d / "base", code="corrupt", where=[changed.name], got="carriage return", expected="line feed")


def names(t, d):
    """Groups with commas can be named; a set with a name that is not UTF-8 is written as valid text."""
    folder = d / "comma"
    slides(folder, groups=3)
    write_manifest(folder, [[f"{label}{g}.csv", label, f"g{g}, left"] for label in ("denim", "silk") for g in range(3)])
    import_slides(t, folder)
    told = t.succeeds("evaluate", "d.h5", "--learner", "lda", "--train-groups", '"g0, left","g1, left"',
                      "--test-groups", '"g2, left"', cwd=folder)
    t.expect((told["train_rows"], told["test_rows"]) == (4, 2), f"groups with commas: {told}")
    t.refuses("evaluate", "d.h5", "--train-groups", '"g0, left', "--test-groups", '"g2, left"', cwd=folder, says=["--train-groups", '"g0, left'], status=2)
    latin = folder / "latin"
    slides(latin)
    raw = bytes(latin) + b"/vers\xfcche.csv"
    (latin / "m.csv").rename(pathlib.Path(raw.decode("utf-8", "surrogateescape")))
    ran = subprocess.run([t.weft.encode(), b"dataset", b"import", b"vers\xfcche.csv", b"-o", b"d.h5"], cwd=latin, capture_output=True)
    t.expect(ran.returncode == 0, f"Latin-1 name: {ran.stderr}")
    stored = (latin / "d.h5").read_bytes()
    t.expect(b"vers\xfcche" not in stored and "vers\ufffdche".encode() in stored, "the set's name is UTF-8")


def similar_names(t, d):
    """Every command that reads the set reports labels and groups that look alike, with the codes of their characters."""
    pairs = {"nbsp": ("denim", "denim\u00a0", "similar_names", "<U+00A0>"), "nfd": ("cr\u00e8pe", "cre\u0300pe", "similar_names", "<U+0300>"),
             "cyrillic": ("denim", "d\u0435nim", "similar_names", "<U+0435>"), "soft": ("denim", "de\u00adnim", "similar_names", "<U+00AD>"),
             "quoted": ("denim", " denim", "similar_names", "' denim'"), "capital": ("denim", "Denim", "capital_letters", "'Denim'"),
             "apart": ("denim", "silk", None, "")}
    for name, (first, second, code, shown) in pairs.items():
        folder = d / name
        slides(folder, groups=3)
        write_manifest(folder, [[f"{file}{g}.csv", label, f"g{g}"] for file, label in (("denim", first), ("silk", second)) for g in range(3)])
        expected = [code] if code else []
        for command in (("dataset", "import", "m.csv", "-o", "d.h5"), ("dataset", "info", "d.h5"),
                        ("train", "d.h5", "-o", "m.model", "--learner", "lda"),
                        ("evaluate", "d.h5", "--learner", "lda", "--leave-one-group-out")):
            made = t.succeeds(*command, cwd=folder)
            t.expect(codes(made) == expected, f"{name}, {command}: {made['warnings']}")
            t.expect(all(shown in w["text"] for w in made["warnings"]), f"{name}, {command}: {made['warnings']}")
            t.expect(not code or shown in t.run(*command, cwd=folder).stdout, f"{name}, {command}: no code in the text")
    folder = d / "others"
    for k in range(4):
        write_rows(folder / f"{k}.csv", "t_s,X", [[i / 100, v] for i, v in enumerate(noise(k, 300))])
        write_rows(folder / f"i{k}.csv", ",".join(["7"] * 16), [[abs(v) for v in noise(20 * k + row, 16)] for row in range(15)])
    write_manifest(folder, [[f"{k}.csv", ("felt", "felt\u200b")[k % 2], f"g{k // 2}"] for k in range(4)])
    write_manifest(folder, [[f"i{k}.csv", ("felt", "felt\u200b")[k % 2], f"g{k}"] for k in range(4)], "i.csv")
    for command in (("dataset", "import", "m.csv", "-o", "r.h5", "--format", "recordings"),
                    ("train", "r.h5", "-o", "r.model", "--window-s", "0.5"),
                    ("evaluate", "r.h5", "--method", "LDA", "--leave-one-group-out", "--window-s", "0.5"),
                    ("dataset", "import", "i.csv", "-o", "i.h5", "--format", "imprints"), ("dataset", "info", "i.h5"),
                    ("train", "i.h5", "-o", "i.model", "--learner", "lda")):
        made = t.succeeds(*command, cwd=folder)
        t.expect("similar_names" in codes(made), f"{command}: {made.get('warnings')}")


def honest(t, d):
    """Intervals over groups without an error; groups on both sides of a random split; a vote and its probability."""
    folder = d / "groups"
    rows = []
    for g in range(100):
        for label in ("a", "b", "c"):
            name = f"{label}{g}.csv"
            write_slide(folder / name, g, {"a": 0, "b": 200, "c": 400}[label], samples=12, taxels=1, scale=10)
            rows.append([name, label, f"g{g:03}"])
    write_manifest(folder, rows)
    import_slides(t, folder)
    ask = ("evaluate", "d.h5", "--learner", "lda", "--leave-one-group-out")
    sure = t.succeeds(*ask, cwd=folder)["results"]["lda"]
    t.expect(sure["accuracy"] == 1.0 and near(sure["ci95"][0], 100 / (100 + 1.959963984540054**2)), f"100 groups: {sure['ci95']}")
    lows = [sure["ci95"][0]]
    for wrong in (1, 2, 3):
        write_manifest(folder, [[f, "b" if i < 3 * wrong and label == "a" else label, g] for i, (f, label, g) in enumerate(rows)])
        import_slides(t, folder)
        some = t.succeeds(*ask, cwd=folder)["results"]["lda"]
        t.expect(some["accuracy"] < 1.0, f"{wrong} wrong labels")
        lows.append(some["ci95"][0])
    t.expect(all(0 < a - b < 0.02 for a, b in zip(lows, lows[1:])), f"continuous in the errors: {lows}")
    pieces = d / "pieces"
    slides(pieces, groups=4)
    import_slides(t, pieces)
    told = t.succeeds("evaluate", "d.h5", "--train-fraction", "0.5", "--learner", "lda", "--repeats", "30", cwd=pieces)
    t.expect(told["groups_on_both_sides"] == ["g0", "g1", "g2", "g3"], f"both sides: {told['groups_on_both_sides']}")
    text = t.run("evaluate", "d.h5", "--train-fraction", "0.5", "--learner", "lda", "--repeats", "30", cwd=pieces).stdout
    t.expect(line_has(text, ["groups", "g0, g1, g2, g3"]), text)
    told = t.succeeds("evaluate", "d.h5", "--leave-one-group-out", "--learner", "lda", cwd=pieces)
    t.expect(told["groups_on_both_sides"] == [], "none where groups are left out")


def two_classes(t, d):
    """With two labels the prediction is the likelier one, even after few training trials."""
    for seed in range(4):
        folder = d / f"two{seed}"
        rows = []
        for label, shift, count in (("a", 0, 3), ("b", 3, 4)):
            for k in range(count):
                write_slide(folder / f"{label}{k}.csv", 1000 * seed + 10 * k + shift, shift, samples=40)
                rows.append([f"{label}{k}.csv", label, f"g{k}"])
        write_manifest(folder, rows)
        import_slides(t, folder)
        tests = []
        for k in range(20):
            write_slide(folder / f"t{k}.csv", 5000 + 100 * seed + k, 3 * (k % 2), samples=40)
            tests.append([f"t{k}.csv", "ab"[k % 2], "t"])
        write_manifest(folder, tests, "t.csv")
        t.succeeds("dataset", "import", "t.csv", "-o", "t.h5", cwd=folder)
        for learner in ("pvalue", "all", "lda", "svc", "trees"):
            t.succeeds("train", "d.h5", "-o", "m.model", "--learner", learner, cwd=folder)
            answers = t.succeeds("classify", "m.model", "t.h5", cwd=folder)["trials"]
            odd = [a for a in answers if a.get("probability") and a["probability"][a["label"]] < 0.5]
            t.expect(not odd and not any("likelier" in a for a in answers), f"{learner}: less likely answers: {odd}")


def reported(t, d, inputs):
    """The inputs of the bug reports."""
    work = d / "reported"
    shutil.copytree(inputs, work)
    for path in [work, *work.rglob("*")]:
        path.chmod(0o755 if path.is_dir() else 0o644)
    rows = features(t, work / "ml/farad")
    t.expect(len(rows) == 12 and all(float(row["var.M.1"]) > 1e-31 and float(row["Hfrq.M.1"]) > 0 for row in rows), f"farad: {rows[0]}")
    told = t.succeeds("evaluate", "d.h5", "--leave-one-group-out", "--learner", "svc", cwd=work / "ml/texfarad")
    t.expect(told["results"]["svc"]["accuracy"] == 1.0, f"texture in farad: {told['results']['svc']['accuracy']}")
    rows = features(t, work / "time/strokes", "--window-s", "1.0")
    t.expect(rows and max(float(row["range.M.1"]) for row in rows) < 400, "strokes: no window over both")
    sure = t.succeeds("evaluate", "d.h5", "--leave-one-group-out", "--learner", "lda", cwd=work / "reps")["results"]["lda"]
    t.expect(near(sure["ci95"][0], 0.9630, 1e-3) and sure["ci95"][1] == 1.0, f"100 groups: {sure['ci95']}")
    one = t.succeeds("evaluate", "d1.h5", "--leave-one-group-out", "--learner", "lda", cwd=work / "reps")["results"]["lda"]
    t.expect(0 <= sure["ci95"][0] - one["ci95"][0] < 0.02, f"one of 300 wrong: {one['ci95']}")
    told = t.succeeds("evaluate", "d.h5", "--train-fraction", "0.5", "--learner", "lda", cwd=work / "ml/leak")
    t.expect(len(told["groups_on_both_sides"]) == 12, f"groups: {told['groups_on_both_sides']}")
    made = t.succeeds("dataset", "import", "m_ts.csv", "-o", "ts.h5", "--format", "recordings", cwd=work / "rec")
    t.expect(codes(made) == ["only_rises"] and "timestamp_ms" in made["warnings"][0]["text"], f"clock: {made['warnings']}")
    for command in (["dataset", "info"], ["verify"]):  # not reported as damage
        t.refuses(*command, "lzf.h5", cwd=work / "h5", code="unsupported", got=["lzf", "32000"], says=["h5repack"])
    t.refuses("classify", "crlf.model", "../ml/farad/d.h5", cwd=work / "base", code="corrupt", where=["crlf.model"], got="carriage return",
              expected="line feed")
    told = t.succeeds("evaluate", "d.h5", "--learner", "lda", "--train-groups", '"g0, left","g1, left"', "--test-groups", '"g2, left"',
                      cwd=work / "comma")
    t.expect(told["test_rows"] > 0, "groups with commas")
    answers = t.succeeds("classify", "tr2pvalue.model", "te.h5", cwd=work / "cal")["trials"]
    text = t.run("classify", "tr2pvalue.model", "te.h5", cwd=work / "cal").stdout
    odd = [a for a in answers if a["probability"][a["label"]] < 0.5]
    shown = sum(line_has(text, [a["file"], f"{max(a['probability'], key=a['probability'].get)} {100 * max(a['probability'].values()):.0f} %"]) for a in odd)
    t.expect(len(odd) == shown == 34, f"an older model: {len(odd)} answers, {shown} with the likelier label")


def main(weft, repository, shared):
    t = Checks(weft)
    inputs = pathlib.Path(shared) / "cases/data/inputs"
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        for k, case in enumerate((units, windows, sound_windows, taxels, clocks, imprint_units, model_files, names, similar_names, honest, two_classes)):
            case(t, d / str(k))
        (d / "bytes").mkdir()
        same_bytes(t, d / "bytes", pathlib.Path(repository))
        if inputs.is_dir():
            reported(t, d, inputs)
        else:
            print(f"skipped: {inputs} is not there")
    t.finish()


if __name__ == "__main__":
    main(*sys.argv[1:])
