#!/usr/bin/env python3
"""The largest published campaign as one recipe: its textures, its check, and a cut of it from recording to left-out speeds and directions. SIMULATED.

    cli_textures118.py WEFT ROOT

The textures must be those of the generator, the whole recipe must be checked in a second of processor time, and its cut to three textures must run.
"""
import json
import pathlib
import resource
import subprocess
import sys
import tempfile

from cli_support import Checks

TRIALS = 18880
TEXTURES = ["sandpaper07", "glass03", "foam02"]  # grains, hard and smooth, soft


def generated(t, root):
    """sim/textures118.json is the output of its generator; rig and recipe list its textures."""
    made = subprocess.run([sys.executable, root / "script/textures118", "-"], capture_output=True, text=True, check=True).stdout
    shipped = (root / "sim/textures118.json").read_text()
    t.expect(made == shipped, "sim/textures118.json differs from the output of script/textures118")
    names = [texture["name"] for texture in json.loads(shipped)["fabrics"]]
    for file in ("sim/rigs/textures118.json", "recipes/library/textures118.json"):
        t.expect(json.loads((root / file).read_text())["fabrics"] == names, f"{file} lists other textures")


def processor_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def checked(t, root, rig, d):
    before = processor_s()
    plan = t.succeeds("check", root / "recipes/library/textures118.json", "--rig", rig, cwd=d)
    took_s = processor_s() - before
    t.expect(took_s < 1, f"the check takes {took_s} s of processor time")
    t.expect(plan["trials"] == TRIALS and plan["sweep"]["cells"] == 40 and plan["bench"] == "simulated", f"plan {plan['trials']}")
    t.expect(plan["warnings"] == [], f"warnings {plan['warnings']}")
    hours = plan["forecast"]["duration_s"] / 3600
    print(f"SIMULATED: {hours:.1f} h of rig time, checked in {1000 * took_s:.0f} ms")
    t.expect(20 < hours < 60, f"{hours} h of rig time")


def cut(root):
    recipe = json.loads((root / "recipes/library/textures118.json").read_text())
    recipe["name"], recipe["fabrics"] = "cut", TEXTURES
    speed, direction = recipe["sweep"]["factors"]
    speed["values"] = [20, 60]
    direction["values"] = direction["values"][::3]  # 0, 135, 270 deg
    return recipe


def evaluated(t, d):
    """Each speed, and each direction, is tested by a model of the others."""
    for column, groups in (("speed_mps", 2), ("direction_rad", 3)):
        out = t.succeeds("vibro", "evaluate", "out/dataset.h5", "--group", column, "--leave-one-group-out", "--window-s", "0.4", "--step-s", "0.2", "--learner",
                         "lda", "--features", "WIDE", cwd=d)
        found = out["results"]["lda"]
        t.expect(len(found["accuracy_of_splits"]) == groups, f"{column}: {len(found['accuracy_of_splits'])} groups left out")
        t.expect(out["leak"]["largest_share"] == 0 and out["bench"] == "simulated", f"{column}: {out['leak']}")
        print(f"SIMULATED {column} left out: {found['accuracy']:.3f} of {out['windows']} windows, chance {1 / len(TEXTURES):.3f}")
        t.expect(found["accuracy"] > 1 / len(TEXTURES), f"{column}: better than chance")
    t.refuses("vibro", "evaluate", "out/dataset.h5", "--group", "force_n", "--leave-one-group-out", "--window-s", "0.4", cwd=d,
              code="not found", where=["--group"], got="force_n", expected="recorded, speed_mps, direction_rad, repetition, mounting, piece, patch")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/textures118.json"
    generated(t, root)
    with tempfile.TemporaryDirectory(prefix="weft-textures118-") as folder:
        d = pathlib.Path(folder)
        checked(t, root, rig, d)
        (d / "cut.json").write_text(json.dumps(cut(root)))
        ran = t.run("run", "cut.json", "--rig", rig, "--set", "replicates=2", "--out", "out", "--yes", "--no-error-check", "--json", cwd=d)
        t.expect(ran.returncode == 0, f"run: {ran.stderr}")
        done = json.loads(ran.stdout)
        t.expect(done["trials_complete"] == done["trials_planned"] == 36 and done["bench"] == "simulated", f"run: {done}")
        t.expect(done["force"]["in_band_fraction"] > 0.99, f"force {done['force']}")
        t.expect(t.run("verify", "out", cwd=d).returncode == 0, "the folder agrees with its certificate")
        evaluated(t, d)
    t.finish()


main()
