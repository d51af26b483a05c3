#!/usr/bin/env python3
"""`weft doctor` on a simulated rig, on healthy and on broken emulated rigs, and on a real rig file without hardware.

    doctor.py WEFT WEFT_RIG SOURCE_ROOT
"""
import fcntl
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from cli_support import Checks, has
from emulated_support import ServedRig, rig_file, tried

STAGES = ["stage.x", "stage.y", "stage.z", "stage.rx", "stage.ry"]


def doctor(t, d, rig, status, *more):
    def once(_=0):
        return t.run("doctor", "--rig", rig, "--listen", 1, "--json", *more, cwd=d)

    ran = tried(once) if status == 0 else once()
    t.expect(ran.returncode == status, f"{rig}: status {ran.returncode}: {ran.stdout} {ran.stderr}")
    return json.loads(ran.stdout)


def of(report, name):
    return next(device for device in report["devices"] if device["name"] == name)


def problems(report, subject):
    return " ".join(f"{f['what']} -> {f['hint']}" for f in report["findings"]
                    if f["severity"] == "problem" and f["subject"] == subject)


def healthy(t, report, bench, latency_s):
    t.expect(report["bench"] == bench and report["problems"] == 0, f"{bench}: {report['findings']}")
    for device in report["devices"]:
        t.expect(device["answered"] and device["armed"] and not device["error"], f"{bench}: {device}")
    for name in STAGES:
        stage = of(report, name)
        t.expect(stage["reported"]["serial"].isdigit() and "counts_per" in str(stage["scale"]), f"{stage}")
        t.expect(0 < stage["latency_s"] <= latency_s, f"{bench}: {stage}")
        t.expect(any("firmware" in key for key in stage["reported"]), f"firmware: {stage}")
    for name, rate_hz in {"ft": {"simulated": 100, "emulated": 500}[bench], "taxels": 37}.items():
        t.expect(abs(of(report, name)["rate_hz"] / rate_hz - 1) < 0.05, f"{bench} rate: {of(report, name)}")


def change(d, path, name, edit):
    rig = json.loads(pathlib.Path(path).read_text())
    edit({device["name"]: device for device in rig["devices"]}, rig)
    (d / name).write_text(json.dumps(rig))
    return name


def printed(t, text):
    """The text for people: the force sensor's scale with its values, and a finding for each part with timing."""
    lines = [line.split(maxsplit=2) for line in text.splitlines()]
    scales = [what for severity, subject, what in (line for line in lines if len(line) == 3)
              if severity == "ok" and subject == "ft" and "scale: " in what]
    t.expect(len(scales) == 1 and all(re.search(rf"\b{key} 1(e\+06|000000)\b", scales[0])
                                      for key in ("counts_per_n", "counts_per_nm")), f"the sensor's scale: {scales}\n{text}")
    for subject, value in {"scheduling": "SCHED_FIFO", "memory": "", "clock": r"\d+ ns", "wall": "clock "}.items():
        found = [line for line in lines if len(line) == 3 and line[0] in ("ok", "warning") and line[1] == subject]
        t.expect(len(found) == 1 and re.search(value, found[0][2]), f"a finding for {subject}: {found}\n{text}")


def in_use(t, d, path, rig):
    """A program that has a port of the rig also protects the network sensor, which streams to its last client."""
    device = next(device for device in rig["devices"] if device["name"] == "stage.x")
    with open(device["link"]["path"], "rb+", buffering=0) as port:
        fcntl.flock(port, fcntl.LOCK_EX)
        report = doctor(t, d, path, 1)
    t.expect(of(report, "stage.x")["error"]["code"] == "busy" and problems(report, "stage.x"), f"a port in use: {report['findings']}")
    sensor = of(report, "ft")
    t.expect(sensor["error"]["code"] == "wrong state" and sensor["error"]["hint"] and problems(report, "ft") and not sensor["answered"],
             f"the sensor: {sensor}")
    t.expect(of(report, "stage.z")["armed"], "free ports are examined")

    # A port that another program has open is not tried at all; any character device will do.
    def elsewhere(devices, rig):
        devices["stage.x"]["link"]["path"] = "/dev/null"
    with subprocess.Popen(["sleep", "600"], stdin=subprocess.DEVNULL) as other:
        report = doctor(t, d, change(d, path, "elsewhere.json", elsewhere), 1)
        other.kill()
    t.expect(has(problems(report, "stage.x"), ["/dev/null", "sleep"]), f"a port that is open: {report['findings']}")
    sensor = of(report, "ft")
    t.expect(sensor["error"]["code"] == "wrong state" and problems(report, "ft") and not sensor["answered"], f"the sensor: {report['findings']}")


def emulated(t, d, root, weft_rig):
    path, rig = rig_file(root, d)
    with ServedRig(weft_rig, path, rig) as served:
        healthy(t, doctor(t, d, path, 0), "emulated", 0.1)
        truth = served.order(order="truth")
        plain = tried(lambda _: t.run("doctor", "--rig", path, "--listen", 0.5, cwd=d))
        t.expect(plain.stdout.startswith("EMULATED ") and "problem " not in plain.stdout, plain.stdout)
        printed(t, plain.stdout)
        t.expect(served.order(order="truth") == truth, "nothing moves during the examination")

        in_use(t, d, path, rig)

        # Noise on a line, as with a wrong baud rate or parity, and a sensor at half its rate.
        for device, fault in {"taxels": "bit_flip", "ft": "rate_halved"}.items():
            t.expect(served.order(order="fault", device=device, fault=fault)["ok"], f"order {fault}")
        noisy = doctor(t, d, path, 1)
        error = of(noisy, "taxels")["error"]
        t.expect(error["code"] == "timeout" and error["hint"] in problems(noisy, "taxels"), f"a noisy line: {noisy['findings']}")
        rates = re.findall(r"([\d.]+) Hz", problems(noisy, "ft"))
        t.expect(len(rates) == 2 and abs(float(rates[0]) / 250 - 1) < 0.1 and rates[1] == "500.0", f"half the rate: {noisy['findings']}")
        for device in ("taxels", "ft"):
            served.order(order="clear", device=device)

        def faults(devices, rig):
            links = {name: device["link"] for name, device in devices.items()}
            links["stage.x"]["path"] = str(d / "ports/missing")          # no such port
            devices["stage.y"]["link"] = dict(links["taxels"])           # another kind of device, and one port twice
            devices["stage.rx"]["config"]["stage"] = "LTS150"            # another model than the connected one
            devices["stage.rx"]["config"].update(travel_mm=[0, 10], max_speed_mm_s=4, acceleration_mm_s2=20)
            for key in ("travel_deg", "max_speed_deg_s", "acceleration_deg_s2"):
                devices["stage.rx"]["config"].pop(key)
            links["stage.ry"]["path"] = str(d / "emulated.json")         # not a port
            links["ft"]["port"] += 1                                     # no device at that address
            rig["simulation"]["console"]["port"] = 1
        report = doctor(t, d, change(d, path, "faults.json", faults), 1)
        for subject, names in {"stage.x": [str(d / "ports/missing")], "stage.ry": [str(d / "emulated.json"), "/dev/ttyUSB0"],
                               "weft-rig": ["weft-rig RIG"], "taxels": ["stage.y"]}.items():
            found = problems(report, subject)
            t.expect(has(found, names), f"{subject}: no {names} in '{found}'")
        t.expect(of(report, "ft")["error"]["code"] == "timeout" and problems(report, "ft"), f"no sensor at that address: {of(report, 'ft')}")
        t.expect(problems(report, "stage.y"), f"a stage behind a taxel array's port: {report['findings']}")
        t.expect(problems(report, "stage.rx"), f"another model: {report['findings']}")
        t.expect(of(report, "stage.z")["armed"] and not problems(report, "stage.z"),
                 f"a good device has no problem, whatever the others: {of(report, 'stage.z')}")


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        healthy(t, doctor(t, d, root / "sim/rigs/bench17.json", 0), "simulated", 0.01)
        text = t.run("doctor", "--rig", root / "sim/rigs/bench17.json", cwd=d).stdout
        t.expect(text.startswith("SIMULATED ") and has(text.splitlines()[0], "bench17"), text)
        emulated(t, d, root, weft_rig)

        def real(_, rig):
            rig["bench"] = "real"
            rig.pop("simulation")
            for i, device in enumerate(rig["devices"]):
                if device["link"]["kind"] == "serial":
                    device["link"]["path"] = f"/dev/ttyUSB{90 + i}"
                else:
                    device["link"] = {"kind": "tcp", "host": "127.0.0.1", "port": 1}
        report = doctor(t, d, change(d, root / "sim/rigs/emulated17.json", "real.json", real), 1)
        for i, device in enumerate(report["devices"]):
            found = problems(report, device["name"])
            t.expect(f"ttyUSB{90 + i}" in found or "127.0.0.1" in found, f"{device['name']}: {found}")
        t.expect(not problems(report, "disk"), f"a folder that is there: {report['findings']}")
        missing = doctor(t, d, root / "sim/rigs/bench17.json", 1, "--out", "nowhere")
        t.expect(problems(missing, "disk"), f"disk: {missing['findings']}")
        t.refuses("doctor", "--rig", "nowhere.json", cwd=d, where="nowhere.json")
    finally:
        shutil.rmtree(d)
    t.finish()


if __name__ == "__main__":
    main()
