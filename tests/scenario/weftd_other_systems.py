#!/usr/bin/env python3
"""weftd on the rigs of the other two systems, vibration and imprints, from the socket to the handover. All SIMULATED.

    weftd_other_systems.py WEFTD WEFT SOURCE_ROOT

The shipped recipes with fewer objects, and with fewer and shorter strokes. The results are requested over the socket and read from the folder.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

from weftd_support import PATIENCE_S, Client, Daemon

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
TEXTURES = ["hook_strip", "aluminium_foil", "tyre_rubber"]
OBJECTS = {"planar": ["PLANE1", "PLANE2"], "rasp": ["RASP1", "RASP2"]}


def shipped(name):
    return json.loads((ROOT / f"recipes/library/{name}.json").read_text())


def slides():
    recipe = shipped("vibrotactile")
    recipe.update(fabrics=TEXTURES, repetitions=3)
    recipe["hand_over"].update(learner="best", groups=3)
    s, p, m, e = recipe["explorations"]["V1"]["phases"]
    s["duration_s"] = e["duration_s"] = 0.5
    p["duration_s"] = 1
    m["path"] = [{"dx_mm": 0, "dy_mm": 24}]
    return recipe


def presses():
    recipe = shipped("imprint")
    recipe.update(classes=OBJECTS, fabrics=[name for names in OBJECTS.values() for name in names])
    return recipe


def level_z():
    """The rig of the presses with the array's faster level."""
    rig = json.loads((ROOT / "sim/rigs/imprint12.json").read_text())
    for key in ("fidelity", "fabrics"):
        rig["simulation"][key] = str(ROOT / "sim" / pathlib.Path(rig["simulation"][key]).name)
    for device in rig["devices"]:
        if device["role"] == "taxels":
            device["emulator"]["level"] = "Z"
    return rig


def done_by(client, name, trials):
    """Checks, runs and hands over through the socket. Returns the end from run.wait."""
    report = client.call("recipe.check", recipe=name)
    assert report["ok"], report
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe=name, lease=lease)["run"]
    client.call("lease.release", lease=lease)
    end = client.call("run.wait", run=run, hand_over=True)
    assert end["outcome"] == "complete" and end["trials_done"] == trials, end
    assert end["handover"]["state"] == "done" and end["handover"]["bench"] == "simulated", end["handover"]
    verified = subprocess.run([WEFT, "verify", end["folder"]], capture_output=True, text=True, timeout=PATIENCE_S)
    assert verified.returncode == 0, verified
    return pathlib.Path(end["folder"]), end


def evaluation_of(folder):
    return json.loads((folder / "handover/evaluation.json").read_text())


def heard(folder):
    daemon = Daemon(WEFTD, ROOT, folder, data="heard", rig=ROOT / "sim/rigs/vibrotactile.json")
    client = Client(daemon.socket)
    out, end = done_by(client, "slides", 9)
    (line,) = end["handover"]["evaluations"]
    assert line["recordings"] == 9 and line["materials"] == len(TEXTURES), line
    rates = {c["name"]: c["rate_hz"] for c in evaluation_of(out)["explorations"]["V1"]["channels"]}
    assert rates == {"S": 8000, "X": 200, "Y": 200, "Z": 200}, rates
    assert "SIMULATED" in (out / "handover/V1.html").read_text()
    print(f"SIMULATED slides right: {line['slides']['accuracy']:.3f} by {line['learner']}, chance {1 / len(TEXTURES):.3f}")
    assert daemon.end() == 0


def scanned(folder):
    (folder / "rig.json").write_text(json.dumps(level_z()))
    daemon = Daemon(WEFTD, ROOT, folder, data="scanned", rig=folder / "rig.json")
    client = Client(daemon.socket)
    out, end = done_by(client, "presses", 8)
    [model] = end["handover"]["models"]
    assert model["model"] == "handover/imprints.model" and (out / model["model"]).exists(), model
    evaluation = evaluation_of(out)
    assert evaluation["bench"] == "simulated" and evaluation["imprints"], evaluation
    assert "SIMULATED" in (out / "handover/imprints.html").read_text()
    assert daemon.end() == 0


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-other-") as name:
        folder = pathlib.Path(name)
        (folder / "recipes").mkdir()
        for recipe, text in (("slides", slides()), ("presses", presses())):
            (folder / f"recipes/{recipe}.json").write_text(json.dumps(text))
        heard(folder)
        scanned(folder)


main()
