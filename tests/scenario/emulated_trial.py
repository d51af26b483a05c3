#!/usr/bin/env python3
"""One trial of M1 over pseudo-terminals and one of M2 over TCP on the emulated bench: weft in one process, weft-rig in another, real time, the
drivers of the simulated bench. The data are compared with the virtual-time run of the same seed and patches. The test prints the differences and
fails if they exceed the effects of scheduling.

    emulated_trial.py WEFT WEFT_RIG SOURCE_ROOT
"""
import csv
import json
import pathlib
import socket
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

from cli_support import Checks
from emulated_support import ServedRig, free_port, near_home, rig_file, tried

SEED, FABRIC = 7, "denim"
# Effects of scheduling: commands and samples are up to a cycle (10 ms) later than in virtual time, 20 um of fabric at 2 mm/s. Means over a phase come
# from other samples of the same ramp; the noise of the taxels is drawn frame by frame.
DURATION_S = 1.0       # for the whole run of about 60 to 100 s
FORCE_RMS_N = 0.02     # for the error of the force in phase M
PRESS_SHARE = 0.02     # of the change of counts by the press
MEAN_COUNTS = 4.0      # each taxel's mean in phase M
VARIANCE_SHARE = 0.10  # each taxel's variance in phase M


def recipe(root, d, exploration):
    document = json.loads((root / f"recipes/library/{exploration.lower()}.json").read_text())
    document.update(name=exploration, fabrics=[FABRIC], repetitions=1, seed=SEED)
    document.pop("$schema", None)
    (d / f"{exploration}.json").write_text(json.dumps(document))
    return f"{exploration}.json"


def run(t, d, recipe_name, rig, out):
    ran = t.run("run", recipe_name, "--rig", rig, "--out", out, "--no-evaluate", "--json", cwd=d)
    return ran, json.loads(ran.stdout) if ran.stdout else {}


def emulated(t, d, weft_rig, recipe_name, path, rig, out):
    """A run in real time that must complete, and the truth afterwards."""
    def once(attempt):
        folder = f"{out}{attempt}"
        with ServedRig(weft_rig, path, rig, seed=SEED) as served:
            return *run(t, d, recipe_name, path, folder), folder, served.order(order="truth")

    ran, summary, folder, after = tried(once)
    t.expect(ran.returncode == 0, f"{out}: {ran.returncode} {ran.stderr}")
    t.expect(after["contact_force_n"] == 0, f"the probe is off the cloth in the end, however it ends: {after}")
    return summary, folder


def features(t, d, out):
    t.succeeds("features", f"{out}/dataset.h5", "-o", f"{out}.csv", cwd=d)
    names, values = list(csv.reader((d / f"{out}.csv").open()))[:2]
    return {name: float(value) for name, value in zip(names[3:], values[3:])}


def near(t, what, virtual, real, limit):
    print(f"SIMULATED {what}: virtual time {virtual:.5g}, real time {real:.5g}, "
          f"apart {abs(real - virtual):.3g} (at most {limit:.3g})")
    t.expect(abs(real - virtual) <= limit, f"{what}: {virtual} and {real}")


def worst(of, apart):
    return max(of, key=apart)


def compare(t, name, summaries, tables):
    virtual, real = tables
    near(t, f"{name} duration [s]", summaries[0]["virtual_s"], summaries[1]["virtual_s"], DURATION_S)
    near(t, f"{name} force error in phase M [N rms]", summaries[0]["force_rms_error_n"],
         summaries[1]["force_rms_error_n"], FORCE_RMS_N)
    for key in ("diff.SP", "diff.PE"):
        near(t, f"{name} {key} [counts]", virtual[key], real[key], PRESS_SHARE * abs(virtual["diff.SP"]))
    pads = range(1, 17)
    pad = worst(pads, lambda i: abs(virtual[f"mean.M.{i}"] - real[f"mean.M.{i}"]))
    near(t, f"{name} mean of the worst taxel ({pad}) [counts]", virtual[f"mean.M.{pad}"], real[f"mean.M.{pad}"],
         MEAN_COUNTS)
    pad = worst(pads, lambda i: abs(real[f"var.M.{i}"] / virtual[f"var.M.{i}"] - 1))
    near(t, f"{name} variance of the worst taxel ({pad}) [counts^2]", virtual[f"var.M.{pad}"], real[f"var.M.{pad}"],
         VARIANCE_SHARE * virtual[f"var.M.{pad}"])


def in_memory(d, rig):
    """The same rig in virtual time."""
    rig = json.loads(json.dumps(rig))
    rig["bench"] = "simulated"
    for device in rig["devices"]:
        device["link"] = {"kind": "memory"}
        if "http" in device:
            device["http"] = {"kind": "memory"}
    path = d / f"memory-{rig['simulation']['console']['port']}.json"
    path.write_text(json.dumps(rig))
    return path


def trial(t, d, root, weft_rig, exploration, over_tcp):
    name = recipe(root, d, exploration)
    path, rig = rig_file(root, d, over_tcp)
    near_home(path, rig, plate_mm=(70, 70))
    if over_tcp:  # units and calibration come from the box's pages
        rig["devices"][5]["http"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
        path.write_text(json.dumps(rig))
    real, folder = emulated(t, d, weft_rig, name, path, rig, f"{exploration}-real")
    ran, virtual = run(t, d, name, in_memory(d, rig), f"{exploration}-virtual")
    t.expect(ran.returncode == 0, f"{exploration} in virtual time: {ran.stderr}")
    t.expect(real.get("bench") == "simulated", f"data of an emulated bench are marked as simulated: {real}")
    if not t.failures:
        tables = features(t, d, f"{exploration}-virtual"), features(t, d, folder)
        compare(t, exploration, (virtual, real), tables)


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    # Both benches at the same time, because they mostly wait.
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
        trials = [pool.submit(trial, t, pathlib.Path(folder), root, weft_rig, exploration, over_tcp)
                  for exploration, over_tcp in (("M1", False), ("M2", True))]
        for done in trials:
            done.result()
    t.finish()


if __name__ == "__main__":
    main()
