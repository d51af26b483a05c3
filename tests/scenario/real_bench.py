#!/usr/bin/env python3
"""A "real" rig file: it has no emulator, and a person mounts the fabric. Behind the ports is weft-rig, so the data are SIMULATED in spite of their
bench kind. This script mounts the fabric instead of the person.

    real_bench.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import sqlite3
import sys
import tempfile

from cli_support import Checks
from emulated_support import ServedRig, near_home, rig_file, tried


def recipe(root, d):
    document = json.loads((root / "recipes/library/m1.json").read_text())
    document.pop("$schema", None)
    document.update(name="real", fabrics=["fleece"], repetitions=1, seed=3)
    for phase in document["explorations"]["M1"]["phases"]:
        phase["duration_s"] = 1
        if phase["phase"] == "M":
            del phase["duration_s"]
            phase["path"] = [{"dx_mm": 0, "dy_mm": 4}]
    (d / "real.json").write_text(json.dumps(document))
    return "real.json"


def real(d, rig):
    """The rig as a user would write it for the devices themselves."""
    rig = json.loads(json.dumps(rig))
    rig["bench"] = "real"
    del rig["simulation"]
    for device in rig["devices"]:
        del device["emulator"]
    path = d / "bench.json"
    path.write_text(json.dumps(rig))
    return path


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        recipe_name = recipe(root, d)
        path, rig = rig_file(root, d)
        near_home(path, rig)
        bench = real(d, rig)
        warnings = t.succeeds("check", recipe_name, "--rig", bench, cwd=d)["warnings"]
        t.expect([(one["pointer"], "before" in one["expected"]) for one in warnings] == [("/operator_steps", True)], f"mounting by a person: {warnings}")
        t.refuses("run", recipe_name, "--rig", bench, "--out", "alone", cwd=d, code="unsupported", where="operator_steps", got="1", expected="--yes")

        def once(attempt):
            with ServedRig(weft_rig, path, rig, seed=3) as served:
                t.expect(served.order(order="mount", fabric="fleece", patch_seed=3)["ok"], "the cloth lies on the plate")
                ran = t.run("run", recipe_name, "--rig", bench, "--out", f"o{attempt}", "--no-evaluate", "--yes", "--json", cwd=d)
                return ran, f"o{attempt}"

        ran, out = tried(once)
        t.expect(ran.returncode == 0, f"{ran.returncode} {ran.stderr}")
        summary = json.loads(ran.stdout)
        t.expect(summary["bench"] == "real" and summary["trials_complete"] == 1, f"{summary}")
        with sqlite3.connect(d / out / "campaign.sqlite") as file:
            orders = [json.loads(payload) for payload, in file.execute("SELECT payload_json FROM journal WHERE kind = 'order'")]
        t.expect(any(one["order"] == "confirm" and one["by"] == "auto:--yes" and "fleece" in one["text"] for one in orders), f"the prompt is in the journal: {orders}")
        t.succeeds("verify", out, cwd=d)
    t.finish()


if __name__ == "__main__":
    main()
