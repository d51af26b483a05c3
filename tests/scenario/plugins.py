#!/usr/bin/env python3
"""Drivers as plugins, from a user's view: the same data as the built-in ones, refusals with a message, and faulty plugins. With a faulty plugin the
run ends, its records are kept, and the rig is at rest.

    plugins.py WEFT SOURCE_ROOT BUILTIN_PLUGINS TEST_PLUGINS
"""
import hashlib
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import tempfile

from cli_support import Checks, error_of, fits, has, line_has

RECIPE = "recipe.json"
PRESS = "press.json"


def recipe(root, d):
    r = json.loads((root / "recipes/library/m1.json").read_text())
    r.update(name="plugins", fabrics=["denim"], repetitions=1, seed=3)
    r.pop("$schema", None)
    (d / RECIPE).write_text(json.dumps(r))
    press = json.loads((root / "recipes/library/imprint.json").read_text())
    press.update(name="press", fabrics=["RASP1"], explorations={"light": press["explorations"]["light"]})
    for key in ("$schema", "classes", "hand_over"):
        press.pop(key)
    (d / PRESS).write_text(json.dumps(press))


def shipped_rig(root, name):
    """A rig file of sim/rigs that works in any folder."""
    r = json.loads((root / "sim/rigs" / name).read_text())
    for key in {"fabrics", "fidelity"} & r["simulation"].keys():
        r["simulation"][key] = str(root / "sim" / pathlib.Path(r["simulation"][key]).name)
    return r


def rig(root, d, name, driver=None, plugins=None, role="taxels", **config):
    r = shipped_rig(root, "bench17.json")
    device = next(device for device in r["devices"] if device["role"] == role)
    if driver:
        device["driver"] = driver
        device["config"].update(config)
    if plugins:
        r["plugins"] = plugins
    (d / name).write_text(json.dumps(r))
    return name


def digital(root):
    """bench17 with a Digital F/T sensor instead of the Net F/T box."""
    r = shipped_rig(root, "bench17.json")
    ft = next(device for device in r["devices"] if device["role"] == "wrench")
    ft.update(driver="ati_digital", config={"rate_hz": 100},
              emulator={"kind": "ati_digital", "rate_hz": 100, "plate_mass_kg": 0.3})
    return r


def recorded(folder):
    """Digest of every sample of a campaign, stream by stream. The ends of chunks depend on the wall clock and are ignored."""
    streams = {}
    with sqlite3.connect(folder / "campaign.sqlite") as campaign:
        for trial, stream, rows, lost, data in campaign.execute(
                "SELECT trial, stream, rows, lost_before, data FROM chunk ORDER BY trial, stream, number"):
            of = streams.setdefault((trial, stream), {"rows": 0, "lost": 0, "samples": hashlib.sha256()})
            of["rows"] += rows
            of["lost"] += lost
            of["samples"].update(data)
    return {key: (of["rows"], of["lost"], of["samples"].hexdigest()) for key, of in streams.items()}


def same_data(t, d, root, builtin):
    """Every driver as a plugin, on a rig that uses it: no recorded bit changes."""
    driven = set()
    for name, document, file in (("plain", shipped_rig(root, "bench17.json"), RECIPE), ("digital", digital(root), RECIPE),
                                 ("vibro", shipped_rig(root, "vibro17.json"), RECIPE),
                                 ("imprint", shipped_rig(root, "imprint12.json"), PRESS)):
        (d / f"{name}.json").write_text(json.dumps(document))
        common = ["run", file, "--rig", f"{name}.json", "--no-evaluate", "--no-error-check", "--json"]
        first = t.run(*common, "--out", f"{name}-built-in", cwd=d)
        second = t.run(*common, "--out", f"{name}-plugins", "--plugins", builtin, "--plugins-only", cwd=d)
        for ran in (first, second):
            t.expect(ran.returncode == 0, f"{ran.args}: {ran.stderr}")
        if first.returncode != 0 or second.returncode != 0:
            continue
        digests = [json.loads(ran.stdout)["dataset_sha256"] for ran in (first, second)]
        t.expect(digests[0] == digests[1], f"{name}: plugins make another data set: {digests}")
        samples = [recorded(d / f"{name}-{by}") for by in ("built-in", "plugins")]
        t.expect(samples[0] and samples[0] == samples[1], f"{name}: plugins record other samples: {samples}")
        with sqlite3.connect(d / f"{name}-plugins/campaign.sqlite") as campaign:
            lines = [json.loads(line) for (line,) in
                     campaign.execute("SELECT payload_json FROM journal WHERE kind = 'plugin'")]
        t.expect(len(lines) == len(document["devices"]), f"{name}: the journal names the code that drove each device: {lines}")
        for driver in {device["driver"] for device in document["devices"]}:
            file = builtin / f"weft-driver-{driver}.so"
            t.expect({hashlib.sha256(file.read_bytes()).hexdigest()} ==
                     {line["sha256"] for line in lines if line["file"] == str(file)}, f"digest of {driver}: {lines}")
            driven.add(file.name)
    every = {file.name for file in builtin.glob("weft-driver-*.so")}
    t.expect(driven == every, f"shared objects that no rig here has: {every - driven}")
    t.refuses("check", RECIPE, "--rig", "plain.json", "--plugins", builtin, cwd=d, where="/devices/6/config", got="weft-driver-taxel_array.so", expected="one",
              says=["--plugins-only"])


def refusals(t, d, root, test_plugins):
    for driver, got, expected in (("wrong_abi", "version 99", "version 1"), ("wrong_size", "88 bytes", "96 bytes"), ("wrong_fingerprint", "pdp11", None),
                                  ("missing_symbol", None, "weft_driver_v1"), ("absent", "absent", "taxel_array")):
        name = rig(root, d, f"{driver}.json", driver)
        for command in (["check", RECIPE, "--rig", name], ["run", RECIPE, "--rig", name, "--out", "never"]):
            pointer = "/devices/6/driver" if driver == "absent" else "/devices/6/config"
            t.refuses(*command, "--plugins", test_plugins, cwd=d, where=pointer, got=got, expected=expected, says=[f"weft-driver-{driver}.so"])
    name = rig(root, d, "nowhere.json", plugins=["no/such/folder"])
    t.refuses("check", RECIPE, "--rig", name, cwd=d, where="/devices/6/driver", expected="weft-driver-NAME.so", says=["no/such/folder"])
    name = rig(root, d, "text.json", driver="text", plugins=["own"])
    (d / "own").mkdir()
    (d / "own/weft-driver-text.so").write_text("not a program")
    t.refuses("check", RECIPE, "--rig", name, cwd=d, where="/devices/6/config", expected="ELF", says=["own/weft-driver-text.so"])


def places(t, d, root, test_plugins):
    """The three ways to name the place of plugins."""
    plain = rig(root, d, "harmless.json", "taxel_array_misbehaving", trouble="none")
    listed = rig(root, d, "listed.json", "taxel_array_misbehaving", [os.path.relpath(test_plugins, d)], trouble="none")
    t.expect(t.run("check", RECIPE, "--rig", plain, "--plugins", test_plugins, cwd=d).returncode == 0, "--plugins")
    t.expect(t.run("check", RECIPE, "--rig", listed, cwd=d).returncode == 0, "plugins of the rig file")
    env = {**os.environ, "WEFT_PLUGIN_PATH": f"{d}:{test_plugins}"}
    ran = subprocess.run([t.weft, "check", RECIPE, "--rig", plain], cwd=d, env=env, capture_output=True, text=True)
    t.expect(ran.returncode == 0, f"WEFT_PLUGIN_PATH: {ran.stderr}")


def faults(t, d, root, test_plugins):
    def run(trouble, out=None, samples=1200, role="taxels", driver="taxel_array_misbehaving"):
        name = rig(root, d, f"{trouble}.json", driver, role=role, trouble=trouble, after_samples=samples)
        return t.run("run", RECIPE, "--rig", name, "--plugins", test_plugins, "--out", out or trouble, "--no-evaluate",
                     "--no-error-check", "--json", cwd=d)

    # The texts of the exceptions are those of tests/plugins/misbehaving.cpp.
    library = "taxel_array_misbehaving.so"
    for trouble in ("create", "open"):
        ran = run(trouble)
        t.expect(ran.returncode == 1 and fits(error_of(ran), got=f"no such thing in {trouble}"), f"{trouble}: {ran.returncode} {ran.stdout}")
        t.expect(library in ran.stderr and f"no such thing in {trouble}" in ran.stderr, f"{trouble}: {ran.stderr}")
        t.expect(not (d / trouble / "campaign.sqlite").exists(), f"{trouble}: a campaign without a bench")
    for trouble, names, fields in (("received", [], {"got": "one sample too many"}), ("late", [library, "received"], {"expected": "ms"})):
        ran = run(trouble)
        t.expect(ran.returncode == 1, f"{trouble}: status {ran.returncode} {ran.stderr}")
        summary = json.loads(ran.stdout)
        error = summary.get("campaign_error", {})
        t.expect(fits(error, code="driver", where=["taxels"], **fields) and has(error["sentence"], names), f"{trouble}: {error}")
        t.expect(summary["rig"] == "safe" and summary["cleanup"] == "done", f"{trouble}: {summary}")
    ran = run("received", "early", samples=3)
    t.expect(ran.returncode == 1 and fits(error_of(ran), code="driver", got="one sample too many"), f"while the bench comes up: {ran.stdout}")
    # A faulty stage is stopped and no longer used. Without z the probe cannot leave the fabric: the rig reports it.
    for role, samples, rig_fact in (("x", 300, "safe"), ("z", 3000, "unknown")):
        ran = run("received", f"stage-{role}", samples, role, "thorlabs_apt_misbehaving")
        summary = json.loads(ran.stdout)
        t.expect(ran.returncode == 1 and fits(summary["campaign_error"], code="driver", where=[f"stage.{role}"]), f"{role}: {summary}")
        t.expect(summary["outcome"] == "failed" and summary["rig"] == rig_fact, f"{role}: {summary}")
    ran = run("hang")
    t.expect(ran.returncode == 1, f"hang: status {ran.returncode}")
    error = error_of(ran)
    t.expect(fits(error, code="driver", where=["taxels", library], expected="ms") and has(error["sentence"], "received"), f"hang: {error}")
    t.expect(line_has(ran.stderr, ["taxels", library, "received"]), f"hang: {ran.stderr}")
    info = t.run("dataset", "info", "hang/campaign.sqlite", cwd=d)
    t.expect(info.returncode == 0, f"what was recorded before the hang cannot be read: {info.stderr}")


def main():
    t = Checks(sys.argv[1])
    root, builtin, test_plugins = (pathlib.Path(a).resolve() for a in sys.argv[2:5])
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        recipe(root, d)
        same_data(t, d, root, builtin)
        refusals(t, d, root, test_plugins)
        places(t, d, root, test_plugins)
        faults(t, d, root, test_plugins)
    finally:
        shutil.rmtree(d)
    t.finish()


if __name__ == "__main__":
    main()
