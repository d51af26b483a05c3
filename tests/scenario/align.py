#!/usr/bin/env python3
"""`weft align` on a simulated and on an emulated bench with tilted plates, and the cases in which it must fail.

    align.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import math
import pathlib
import shutil
import sys
import tempfile

from cli_support import Checks, error_of, fits
from emulated_support import ServedRig, near_home, rig_file, tried


def simulated_rig(root, d, name, tilt_deg, **changes):
    rig = json.loads((root / "sim/rigs/bench17.json").read_text())
    # a rigid face: a soft cover blurs the height of first contact
    rig["simulation"].update(cover_um=0, fabrics=str(root / "sim/fabrics.json"), plate_tilt_deg=tilt_deg, **changes)
    (d / name).write_text(json.dumps(rig))
    return name


def aligned(t, d, rig, *more):
    ran = t.run("align", "--rig", rig, "--json", *more, cwd=d)
    t.expect(ran.returncode == 0, f"{rig}: status {ran.returncode}: {ran.stdout} {ran.stderr}")
    return json.loads(ran.stdout)


def aligned_on_ports(t, d, weft_rig, path, rig, *more):
    def once(_):
        with ServedRig(weft_rig, path, rig):
            return t.run("align", "--rig", path, "--json", *more, cwd=d)

    ran = tried(once)
    t.expect(ran.returncode == 0, f"{path}: status {ran.returncode}: {ran.stdout} {ran.stderr}")
    return json.loads(ran.stdout)


def found(t, report, tilt_deg, step_rad):
    """The measured tilt is that of the rig file's plate, and the remaining tilt is within the steps of the contact readings."""
    for axis, degrees in zip("xy", tilt_deg):
        error = report["before"][f"tilt_{axis}_rad"] - math.radians(degrees)
        t.expect(abs(error) < step_rad, f"tilt about {axis} is {error * 1e6:.1f} urad off")
    t.expect(report["bench"] == "simulated" and report["outcome"] == "complete" and report["rig_fact"] == "safe", f"{report}")
    t.expect(report["after"]["lean_rad"] < 2 * step_rad, f"left: {report['after']}")
    t.expect(len(report["rounds"]) == 2 and report["before"]["lean_sd_rad"] > 0, f"{report}")


def gives_up(t, d, rig, fields, *more):
    ran = t.run("align", "--rig", rig, *more, "--json", cwd=d)
    error = error_of(ran) or json.loads(ran.stdout).get("align_error", {})
    t.expect(ran.returncode == 1 and fits(error, **fields), f"not {fields} ({ran.returncode}): {error} {ran.stderr}")
    t.expect(error.get("where", "?") in ran.stderr and error.get("got", "?") in ran.stderr, f"text for people: {ran.stderr}")


def on_ports(t, d, weft_rig, root):
    """The same on ports in real time: a small grid, which takes about a minute and a half."""
    tilt = [0.4, -0.3]
    path, rig = rig_file(root, d, plate_tilt_deg=tilt)
    near_home(path, rig)
    report = aligned_on_ports(t, d, weft_rig, path, rig, "--points", 2, "--span-mm", 20, "--max-tilt-deg", 1,
                              "--tolerance-mrad", 0.3, "--touch-speed-mm-s", 0.1)
    print(f"SIMULATED, on ports: {report['bench_time_s']:.0f} s; found {report['before']}; left {report['after']}")
    found(t, report, tilt, 5e-6 / 0.02)  # contact is noticed some milliseconds late: up to 5 um at 0.1 mm/s


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        tilt = [1.7, -1.2]
        found(t, aligned(t, d, simulated_rig(root, d, "askew.json", tilt)), tilt, 1e-6 / 0.1)
        text = t.run("align", "--rig", "askew.json", cwd=d).stdout
        t.expect(text.startswith("SIMULATED") and "tilt" in text, text)

        gives_up(t, d, simulated_rig(root, d, "steep.json", [6, 0]), {"code": "range", "where": "alignment", "expected": "-5"}, "--max-tilt-deg", 7)
        gives_up(t, d, "steep.json", {"code": "measurement", "got": "none"}, "--max-tilt-deg", 1)
        gives_up(t, d, "askew.json", {"code": "range", "where": ["alignment"], "got": "500"}, "--span-mm", 500)
        jump = [{"device": "ft", "fault": "bias_jump", "start_s": 100, "amount": 50}]
        gives_up(t, d, simulated_rig(root, d, "struck.json", tilt, faults=jump), {"code": "safety", "where": ["wrench"], "got": "N"})
        gives_up(t, d, "nowhere.json", {"where": "nowhere.json"})

        if "--ports" in sys.argv:
            on_ports(t, d, weft_rig, root)
    finally:
        shutil.rmtree(d)
    t.finish()


if __name__ == "__main__":
    main()
