#!/usr/bin/env python3
"""`weft check`: accepts the library's recipes and refuses every kind of bad recipe with a JSON pointer.

    cli_check.py WEFT SOURCE_ROOT
"""
import copy
import errno
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from cli_support import Checks, fits, has


def change(recipe, path, value):
    """A copy with one member set; `path` is a JSON pointer without escapes. None removes."""
    out = copy.deepcopy(recipe)
    *parents, last = path.strip("/").split("/")
    place = out
    for key in parents:
        place = place[int(key)] if isinstance(place, list) else place[key]
    if isinstance(place, list):
        last = int(last)
    if value is None:
        del place[last]
    else:
        place[last] = value
    return out


PHASES = "/explorations/M1/phases"
# name: (pointer to change, new value, pointer that a problem must have, names that the text must have)
BAD = {
    "unknown key": ("/repetitons", 3, "/repetitons", ["repetitions"]),
    "wrong unit": (f"{PHASES}/2/speed_inch_s", 1, f"{PHASES}/2/speed_inch_s", []),
    "missing phase": (f"{PHASES}/1", None, PHASES, ["P"]),
    "speed over the rig's limit": (f"{PHASES}/2/speed_mm_s", 50, f"{PHASES}/2", ["speed"]),
    "path outside the travel": (f"{PHASES}/2/path", [{"dx_mm": 0, "dy_mm": 900}], PHASES, []),
    "force over the cap": (f"{PHASES}/2/force_N", 500, f"{PHASES}/2", ["force"]),
    "repetition 0": ("/repetitions", 0, "/repetitions", []),
    "unknown fabric": ("/fabrics", ["wool", "chain mail"], "/fabrics/1", ["chain mail"]),
    "text for a number": (f"{PHASES}/0/duration_s", "long", f"{PHASES}/0/duration_s", []),
}


def version(t, root):
    """`weft --version` names the commit of the build, which data sets, models and certificates record."""
    printed = t.run("--version", cwd=root).stdout.strip()
    found = re.fullmatch(r"weft \d+\.\d+\.\d+(?:\+g([0-9a-f]{12})(?:\.modified)?)?", printed)
    t.expect(found, f"no version with its commit: {printed!r}")

    def git(*words):
        return shutil.which("git") and subprocess.run(["git", "-C", root, *words], capture_output=True).returncode == 0
    if found and git("rev-parse", "HEAD"):
        t.expect(found[1] and git("cat-file", "-e", found[1] + "^{commit}"), f"{printed!r} names no commit of {root}")


def accepted(t, root, rig, d):
    for name, trials in {"m1": 340, "m2": 340, "khan2016": 680}.items():
        plan = t.succeeds("check", root / f"recipes/library/{name}.json", "--rig", rig, cwd=d)
        t.expect(plan["trials"] == trials and plan["bench"] == "simulated", f"{name}: {plan}")
        margins = [axis.get("margin_m", axis.get("margin_rad")) for axis in plan["forecast"]["envelope"].values()]
        t.expect(len(margins) == 5 and min(margins) >= 0, f"{name}: margins {margins}")
        t.expect(plan["forecast"]["duration_s"] > trials * 36, f"{name}: 36 s of phases a trial at least")


def fidelity(t, root, rig, d):
    """The level follows from the scene; an accuracy or a budget chooses from the shipped table."""
    recipe = root / "recipes/library/m1.json"
    plan = t.succeeds("check", recipe, "--rig", rig, cwd=d)["simulation"]
    t.expect(plan["setting"] == "L1 3.072 ms" and plan["because"] and "mN" not in plan["because"], f"by scene: {plan}")
    plan = t.succeeds("check", recipe, "--rig", rig, "--accuracy", "25mN", cwd=d)["simulation"]
    t.expect(plan["setting"].startswith("L2 ") and has(plan["because"], "25 mN"), f"accuracy: {plan}")
    plan = t.succeeds("check", recipe, "--rig", rig, "--budget", "100x", cwd=d)["simulation"]
    t.expect(plan["setting"].startswith(("L2 ", "L3 ")) and has(plan["because"], "100"), f"budget: {plan}")
    t.refuses("check", recipe, "--rig", rig, "--accuracy", "1uN", cwd=d, says=["--accuracy", "10mN"], status=2)
    t.refuses("check", recipe, "--rig", rig, "--budget", "fast", cwd=d, says=["--budget", "1000x"], status=2)
    error = t.refuses("check", recipe, "--rig", rig, "--accuracy", "0.000001mN", cwd=d, where=["/simulation/level"], expected="1e-06 mN")
    t.expect(any(re.search(r"\bL[23] .* [\d.]+ mN\b", each["got"]) for each in error.get("problems", [])), f"nearest setting: {error}")
    error = t.refuses("check", recipe, "--rig", rig, "--budget", "1e9x", cwd=d, where=["/simulation/level"], expected="1e+09")
    t.expect(any(re.search(r"\b\d+x \(L\d ", each["got"]) for each in error.get("problems", [])), f"fastest setting: {error}")
    changed = json.loads(rig.read_text())
    changed["simulation"]["fabrics"] = str(root / "sim/fabrics.json")
    changed["simulation"]["level"] = "L0"
    (d / "l0.json").write_text(json.dumps(changed))
    t.refuses("check", recipe, "--rig", "l0.json", cwd=d, where=["/simulation/level"], got="L0", says=["l0.json", "relaxation"])


def refused(t, root, rig, d):
    m1 = json.loads((root / "recipes/library/m1.json").read_text())
    bad = d / "bad.json"
    for name, (path, value, pointer, words) in BAD.items():
        bad.write_text(json.dumps(change(m1, path, value)))
        error = t.refuses("check", "bad.json", "--rig", rig, cwd=d, says=["bad.json", *words])
        pointers = [p["pointer"] for p in error.get("problems", [])]
        t.expect(any(p.startswith(pointer) for p in pointers), f"{name}: {pointer} is not among {pointers}")
        ran = t.run("run", "bad.json", "--rig", rig, "--out", "out", cwd=d)
        t.expect(ran.returncode == 1 and not (d / "out").exists(), f"{name}: weft run left {list(d.iterdir())}")
    several = change(change(m1, "/repetitions", 0), f"{PHASES}/2/force_N", 500)
    bad.write_text(json.dumps(several))
    error = t.refuses("check", "bad.json", "--rig", rig, cwd=d, says=["/repetitions", "force"])
    t.expect(len(error["problems"]) >= 2, f"all problems at once: {error['problems']}")


def no_acceleration(rig, device):
    return {k: v for k, v in rig["devices"][device]["config"].items() if k != "acceleration_mm_s2"}


def bench(t, root, rig, d):
    """Problems that need the drivers, emulators and the fabric table to find."""
    good = json.loads(rig.read_text())
    good["simulation"]["fabrics"] = str(root / "sim/fabrics.json")
    recipe = json.loads((root / "recipes/library/m1.json").read_text())
    recipe["repetitions"] = 1
    (d / "recipe.json").write_text(json.dumps(recipe))
    (d / "rig.json").write_text(json.dumps(good))
    t.succeeds("check", "recipe.json", "--rig", "rig.json", cwd=d)
    cases = {  # changes of the rig, pointers of the problems, required words
        "limit over the driver's speed": ({"/limits/speed_mm_s": 20}, {"/limits/speed_mm_s"}, ["stage.z", "4 mm/s", "20 mm/s"]),
        "tilt speed": ({"/limits/tilt_speed_deg_s": 9}, {"/limits/tilt_speed_deg_s"}, ["stage.rx", "5 deg/s"]),
        "acceleration": ({"/devices/1/config/acceleration_mm_s2": 10}, {"/devices/1/config/acceleration_mm_s2"}, ["10 mm/s2", "20"]),
        "emulated controller of another scale": ({"/devices/0/emulator/model": "TST001"}, {"/devices/0/config/stage"}, ["LTS150", "TST001", "BSC20x"]),
        "emulated controller of another kind": ({"/devices/0/emulator/model": "KDC101"}, {"/devices/0/config/stage"}, ["LTS150", '"KDC101"']),
        "stated controller without a scale": ({"/devices/0/config/controller": "KST101"}, {"/devices/0/config/controller"}, ["LTS150", "KST101", "BSC20x"]),
        "calibration without the box's page": ({"/devices/5/config/calibration_serial": "FT1"}, {"/devices/5/config/calibration_serial"}, ["http", "calibration_serial"]),
        "no acceleration of a stage": ({"/limits/acceleration_mm_s2": 10}, {f"/devices/{i}/config/acceleration_mm_s2" for i in range(3)}, ["20 mm/s2"]),
        "acceleration over the stages'": ({f"/devices/{i}/config": no_acceleration(good, i) for i in range(3)} | {"/limits/acceleration_mm_s2": 100},
                                          {"/limits/acceleration_mm_s2"}, ["50", "100"]),
        "travel": ({"/devices/0/config/travel_mm": [10, 150]}, {"/limits/travel_mm/x"}, ["stage.x", "10.00 to 150.00 mm"]),
        "tilt": ({"/devices/3/config/travel_deg": [-1, 5]}, {"/limits/tilt_deg"}, ["stage.rx"]),
        "unknown driver": ({"/devices/2/driver": "thorlab"}, {"/devices/2/driver"}, ["thorlabs_apt"]),
        "driver's key": ({"/devices/2/config/max_sped_mm_s": 4}, {"/devices/2/config/max_sped_mm_s"}, ["max_speed_mm_s"]),
        "two drivers": ({"/devices/2/config/stage": "LTS1500", "/devices/6/config/stale_after_s": -1},
                        {"/devices/2/config/stage", "/devices/6/config/stale_after_s"}, []),
        "emulator": ({"/devices/5/emulator/kind": "rdp"}, {"/devices/5/emulator/kind"}, ["rdp"]),
        "rates": ({"/devices/5/config/rate_hz": 50}, {"/devices/5/config/rate_hz"}, ["50", "100"]),
        "no cloth table": ({"/simulation/fabrics": "gone.json"}, {"/simulation/fabrics"}, [os.strerror(errno.ENOENT)]),
    }
    for name, (changes, pointers, words) in cases.items():
        wrong = good
        for path, value in changes.items():
            wrong = change(wrong, path, value)
        (d / "rig.json").write_text(json.dumps(wrong))
        for command in (["check", "recipe.json", "--rig", "rig.json"], ["run", "recipe.json", "--rig", "rig.json", "--out", "out"]):
            error = t.refuses(*command, cwd=d, says=["rig.json", *words])
            found = {p["pointer"] for p in error.get("problems", []) if p["file"] == "rig.json"}
            t.expect(found == pointers, f"{name}, {command[0]}: {found} instead of {pointers}")
            sentences = [p["sentence"] for p in error.get("problems", [])]
            t.expect(len(sentences) == len(set(sentences)), f"{name}, {command[0]}: a problem twice: {sentences}")
    (d / "rig.json").write_text(json.dumps(change(good, "/fabrics/0", "tweed")))  # listed, but not in the fabric table
    (d / "recipe.json").write_text(json.dumps(change(recipe, "/fabrics/0", "tweed")))
    for command in (["check", "recipe.json", "--rig", "rig.json"], ["run", "recipe.json", "--rig", "rig.json", "--out", "out"]):
        error = t.refuses(*command, cwd=d, says=["recipe.json", "/fabrics/0", "tweed"])
        t.expect([p["pointer"] for p in error.get("problems", [])] == ["/fabrics/0"], f"cloth table: {error}")


def parameters(t, root, rig, d):
    """`--set` binds the declared parameters of a recipe; errors name their place; `run --resume` needs the same values."""
    recipe = json.loads((root / "recipes/library/m1.json").read_text())
    recipe |= {"fabrics": ["denim"], "repetitions": {"parameter": "n"},
               "parameters": {"n": {"type": "integer", "min": 1, "max": 3}, "cloth": {"type": "text", "default": "denim"}}}
    recipe["fabrics"] = [{"parameter": "cloth"}]
    (d / "bound.json").write_text(json.dumps(recipe))
    command = "check", "bound.json", "--rig", rig
    plan = t.succeeds(*command, "--set", "n=2", "--set", "cloth=silk", cwd=d)
    t.expect((plan.get("trials"), plan.get("fabrics")) == (2, ["silk"]), f"--set: {plan}")
    t.expect(plan.get("parameters") == recipe["parameters"], f"parameters: {plan}")
    found = {}
    for words, place, got, expected in ([], "/parameters/n", None, None), (["n=0"], "/parameters/n", "0", ["1.0", "3.0"]), (["n=x"], "/parameters/n", "x", None), \
                                       (["n=1", "n=2"], "/parameters/n", None, None), (["n=1", "clot=silk"], "/parameters/clot", "clot", ["cloth", "n"]), \
                                       (["n=1", "cloth=3"], "/parameters/cloth", "3", None), (["n=1", "cloth=tweed"], "/fabrics/0", "tweed", None):
        error = t.refuses(*command, *(w for each in words for w in ("--set", each)), cwd=d, where=place, got=got, expected=expected, says=["bound.json"])
        found[" ".join(words)] = tuple(each["message"] for each in error.get("problems", []))
    t.expect(found["n=1 cloth=3"] == found["n=x"] and len({*found.values()}) == len(found) - 1, f"each kind of mistake has its own message: {found}")
    t.refuses(*command, "--set", "n", cwd=d, says=["NAME=VALUE"], status=2)
    run = "run", "bound.json", "--rig", rig, "--out", "bound", "--no-evaluate", "--no-error-check"
    ran = t.run(*run, "--set", "n=1", cwd=d)
    t.expect(ran.returncode == 0, f"run --set: {ran.stderr}")
    t.expect(t.run("verify", "bound", cwd=d).returncode == 0, "a resolved recipe is not verified")
    t.refuses(*run, "--resume", "--preview", "--set", "n=2", cwd=d, code="wrong state", where=["resume"], got=["/repetitions", "2", "1"], says=["recipe"])


def not_json(t, root, rig, d):
    text = (root / "recipes/library/m1.json").read_text()
    bad = d / "bad.json"
    for name, broken in {"nan": text.replace('"duration_s": 3', '"duration_s": NaN'), "cut": text[: len(text) // 2],
                         "empty": "", "deep": "[" * 500_000, "array": "[]"}.items():
        bad.write_text(broken)
        error = t.refuses("check", "bad.json", "--rig", rig, cwd=d, says=["bad.json"])
        t.expect(bool(error), name)
    deep = {"expected": ["levels"]}
    for name, (broken, expected) in {"a key twice": (text.replace('"seed": 2016', '"seed": 1, "seed": 2'), {"where": ["/seed"]}), "deep": ("[" * 500_000, deep),
                                     "deep and closed": ('{"a":' * 100_000 + "1" + "}" * 100_000, deep)}.items():
        bad.write_text(broken)
        error = t.refuses("run", "bad.json", "--rig", rig, "--out", "out", "--seed", "7", cwd=d, says=["bad.json"])
        t.expect(fits(error, **expected), f"{name} with --seed: {error} is not {expected}")
    bad.write_text(text)
    t.refuses("run", "bad.json", "--rig", rig, "--out", "out", "--seed", str(2**53), cwd=d, says=["bad.json: ", "/seed"])
    with open(bad, "wb") as f:  # a sparse file of 200 MB
        f.truncate(200 << 20)
    t.refuses("check", "bad.json", "--rig", rig, cwd=d, says=["bad.json", "bytes"])
    t.refuses("run", "bad.json", "--rig", rig, "--out", "out", cwd=d, says=["bad.json", "bytes"])
    t.refuses("check", "gone.json", "--rig", rig, cwd=d, says=["gone.json"])
    t.refuses("check", "bad.json", "--rig", "gone.json", cwd=d, says=["gone.json"])
    t.refuses("check", root / "recipes/library/m1.json", "--rig", root / "recipes/library/m1.json", cwd=d,
              says=["m1.json", "/"])


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    with tempfile.TemporaryDirectory(prefix="weft-check-") as folder:
        d = pathlib.Path(folder)
        version(t, root)
        accepted(t, root, rig, d)
        fidelity(t, root, rig, d)
        refused(t, root, rig, d)
        parameters(t, root, rig, d)
        not_json(t, root, rig, d)
        bench(t, root, rig, d)
    t.finish()


main()
