#!/usr/bin/env python3
"""Rigs that differ from the 5-DoF bench, each on the emulated bench in real time: check, doctor, a small campaign by weftd with its live samples,
verify, features. Each is a rig file of sim/rigs; all run in parallel.

    other_rigs.py WEFT WEFTD WEFT_RIG SOURCE_ROOT [RIG ...]
"""
import csv
import json
import pathlib
import socket
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

from cli_support import Checks
from emulated_support import ServedRig, free_port, near_home, tried
from weftd_support import Client, Daemon

WEFT, WEFTD, WEFT_RIG, ROOT = sys.argv[1:4] + [pathlib.Path(sys.argv[4]).resolve()]
TRIALS = 2
SLIDE_MM = 6
# Axes with a stage, positions of the others, taxels and their rate, their arrangement on the page, by depth or by force, place of the stroke.
RIGS = {
    "emulated-xyz": {"axes": "xyz", "fixed": {"rx_rad": 0, "ry_rad": 0}, "taxels": 16, "rate_hz": 37, "shape": None, "wrench": False, "slide": "dy_mm"},
    "emulated-xz": {"axes": "xz", "fixed": {"y_m": 0.03, "rx_rad": 0, "ry_rad": 0}, "taxels": 16, "rate_hz": 37, "shape": None, "wrench": True, "slide": "dx_mm"},
    "emulated-digital": {"axes": ["x", "y", "z", "rx", "ry"], "fixed": {}, "taxels": 16, "rate_hz": 37, "shape": None, "wrench": True, "slide": "dy_mm"},
    "emulated-taxels32": {"axes": ["x", "y", "z", "rx", "ry"], "fixed": {}, "taxels": 32, "rate_hz": 100, "shape": {"rows": 4, "columns": 8},
                          "wrench": True, "slide": "dy_mm"},
}


def rig_in(folder, name):
    """The rig file with free ports in the folder, its plate near the home positions of the stages."""
    rig = json.loads((ROOT / f"sim/rigs/{name}.json").read_text())
    rig["simulation"]["fabrics"] = str(ROOT / "sim/fabrics.json")
    rig["simulation"]["fidelity"] = str(ROOT / "sim/fidelity.json")
    rig["simulation"]["console"]["port"] = free_port(socket.SOCK_STREAM)
    for device in rig["devices"]:
        link = device["link"]
        if link["kind"] == "udp":
            link["port"] = free_port(socket.SOCK_DGRAM)
        else:
            link["path"] = str(folder / "ports" / device["name"])
    if "y_mm" in rig.get("fixed", {}):
        rig["fixed"]["y_mm"] = 30
    path = folder / "rig.json"
    near_home(path, rig)
    return path, rig


def recipe(of):
    press = {"force_N": 5} if of["wrench"] else {"press_depth_mm": 1.6}
    leg = {"dx_mm": 0, "dy_mm": 0, of["slide"]: SLIDE_MM}
    phases = [{"phase": "S", "duration_s": 1}, {"phase": "P", "duration_s": 1.5, **press},
              {"phase": "M", "speed_mm_s": 2, "path": [leg]}, {"phase": "E", "duration_s": 1}]
    return {"schema_version": 1, "name": "small", "seed": 3, "fabrics": ["denim", "silk"], "repetitions": TRIALS // 2,
            "explorations": {"M1": {"phases": phases}}}


def refused_recipe(of):
    """A recipe that this rig cannot run, and the place that its check reports."""
    out = recipe(of)
    phases = out["explorations"]["M1"]["phases"]
    if not of["wrench"]:
        phases[1] = {"phase": "P", "duration_s": 1.5, "force_N": 5}
        return out, "/explorations/M1/phases/1/force_N"
    if "y_m" in of["fixed"]:
        phases[2]["path"] = [{"dx_mm": 0, "dy_mm": SLIDE_MM}]
        return out, "/explorations/M1/phases/2/path"
    phases[1]["press_depth_mm"] = 1.6
    return out, "/explorations/M1/phases/1/press_depth_mm"


def looked_over(t, folder, path, of):
    """check and doctor."""
    t.succeeds("check", "recipes/small.json", "--rig", path, cwd=folder)
    refused, where = refused_recipe(of)
    (folder / "refused.json").write_text(json.dumps(refused))
    ran = t.run("check", "refused.json", "--rig", path, cwd=folder)
    t.expect(ran.returncode != 0 and where in ran.stdout + ran.stderr, f"refused at {where}: {ran.stdout} {ran.stderr}")
    for _ in range(3):  # a machine that is late for a moment measures another rate
        report = json.loads(t.run("doctor", "--rig", path, "--listen", 1, "--json", cwd=folder).stdout)
        taxels = next(device for device in report["devices"] if device["role"] == "taxels")
        if report["problems"] == 0 and abs(taxels["rate_hz"] / of["rate_hz"] - 1) < 0.05:
            break
    t.expect(report["problems"] == 0, f"doctor: {report['findings']}")
    t.expect(abs(taxels["rate_hz"] / of["rate_hz"] - 1) < 0.05, f"rate of the taxels: {taxels}")


def described(t, client, of):
    """The description from which the page draws the rig."""
    rig = client.call("rig.describe")
    travel = {key.rpartition("_")[0] for key in rig["travel"]}
    t.expect(travel == set(of["axes"]), f"axes: {rig['travel']}")
    t.expect(rig["fixed"] == of["fixed"], f"fixed: {rig['fixed']}")
    t.expect((rig["taxels"], rig["taxel_shape"]) == (of["taxels"], of["shape"]), f"taxels: {rig}")
    t.expect(rig["wrench"] == of["wrench"] and (rig["force_cap_n"] is None) != of["wrench"], f"wrench: {rig}")


def watched(client):
    """Follows a run to its end. Returns its end, and its live samples by topic."""
    topics = ["stream:force", "stream:stages", "stream:taxels"]
    lease = client.call("lease.acquire", ttl_ms=600000)["lease"]
    client.call("sub.open", topics=topics + ["run:*"], mode="every")
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    told = {topic: [] for topic in topics}
    while True:
        event = client.event()
        if event["topic"] in told:
            told[event["topic"]].append(event["delta"])
        if event["topic"] == f"run:{run}" and event["delta"].get("state") == "ended":
            return client.call("run.get", run=run), told


def sampled(t, told, of):
    """The live samples, as the page draws them."""
    t.expect(bool(told["stream:force"]) == of["wrench"], f"force is reported where it is measured: {len(told['stream:force'])}")
    t.expect(all(len(frame["counts"]) == of["taxels"] for frame in told["stream:taxels"]) and len(told["stream:taxels"]) > 50,
             f"frames of taxels: {len(told['stream:taxels'])}")
    slid = "x" if of["slide"] == "dx_mm" else "y"
    low = max(frame["position_mm"]["z"] for frame in told["stream:stages"]) - 0.3
    on_cloth = [frame["position_mm"][slid] for frame in told["stream:stages"] if frame["position_mm"]["z"] > low]
    t.expect(on_cloth and abs(max(on_cloth) - min(on_cloth) - SLIDE_MM) < 1, f"slid along {slid}: {min(on_cloth)} to {max(on_cloth)}")


def recorded(t, folder, run, of):
    """The folder of the run: verified, with features of every taxel."""
    place = folder / "data" / pathlib.Path(run["folder"]).name
    t.succeeds("verify", place, cwd=folder)
    features = folder / "features.csv"
    t.succeeds("features", place / "dataset.h5", "-o", features, cwd=folder)
    rows = list(csv.reader(features.open()))
    named = 3
    t.expect(len(rows) == 1 + TRIALS, f"rows of features: {len(rows)}")
    t.expect(len(rows[0]) - named == 3 + 12 * of["taxels"], f"features: {len(rows[0]) - named}")
    pressed = rows[0].index("diff.SP")
    t.expect(all(abs(float(row[pressed])) > 5 for row in rows[1:]), f"the press shows in the taxels: {[row[pressed] for row in rows]}")


class Ran:
    """The result in the form that tried() needs."""

    def __init__(self, run, told):
        self.run, self.told = run, told
        self.returncode = 0 if run.get("outcome") == "complete" else 1
        self.stdout, self.stderr = json.dumps(run), ""


def whole(name):
    """One rig, from its check to its features."""
    of, t = RIGS[name], Checks(WEFT)
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        (folder / "recipes").mkdir()
        (folder / "recipes/small.json").write_text(json.dumps(recipe(of)))
        path, rig = rig_in(folder, name)

        def once(attempt):
            data = f"data{attempt}"
            (folder / data).mkdir()
            with ServedRig(WEFT_RIG, path, rig) as served:
                if attempt == 0:
                    looked_over(t, folder, path, of)
                daemon = Daemon(WEFTD, ROOT, folder, data=data, rig=path)
                try:
                    client = Client(daemon.socket)
                    described(t, client, of)
                    run, told = watched(client)
                finally:
                    daemon.end()
                truth = served.order(order="truth")
                t.expect(truth["contact_force_n"] == 0, f"the probe is off the cloth in the end: {truth}")
            (folder / "data").unlink(missing_ok=True)
            (folder / "data").symlink_to(folder / data)
            return Ran(run, told)

        ran = tried(once)
        t.expect(ran.returncode == 0, f"the run: {ran.run}")
        if ran.returncode == 0:
            sampled(t, ran.told, of)
            recorded(t, folder, ran.run, of)
    return t


def main():
    names = sys.argv[5:] or list(RIGS)
    with ThreadPoolExecutor(len(names)) as pool:
        found = list(pool.map(whole, names))
    for name, t in zip(names, found):
        print(f"{name}: {t.count} checks, {len(t.failures)} failed")
        for failure in t.failures:
            print(f"  {name}: {failure}")
    sys.exit(1 if any(t.failures for t in found) else 0)


main()
