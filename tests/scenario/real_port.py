#!/usr/bin/env python3
"""Tests real serial ports: libserialport opens the lines of the emulated bench. It opens no pseudo-terminal, so a preloaded shim makes each look like
a serial port (real_port.c; docs/reference/device-facts.md, Serial ports). weft doctor checks the bench with unmodified drivers; then a port in use, a
file that is not a port, and a missing one.

    real_port.py WEFT WEFT_RIG SOURCE_ROOT SHIM
"""
import fcntl
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from cli_support import Checks, has
from emulated_support import ServedRig, rig_file, tried

STAGES = ["stage.x", "stage.y", "stage.z", "stage.rx", "stage.ry"]
SERIAL = [*STAGES, "taxels"]


class Ports:
    """`weft` with the preloaded shim."""

    def __init__(self, t, d, shim):
        self.t, self.d, self.log = t, d, d / "ports.log"
        self.environment = dict(os.environ, LD_PRELOAD=str(pathlib.Path(shim).resolve()), WEFT_REAL_PORT_LOG=str(self.log))

    def weft(self, *arguments):
        self.log.unlink(missing_ok=True)
        return subprocess.run([self.t.weft, *map(str, arguments)], cwd=self.d, env=self.environment, capture_output=True, text=True,
                              timeout=300, stdin=subprocess.DEVNULL)

    def noted(self):
        return self.log.read_text().splitlines() if self.log.exists() else []


def looked_over(t, ports, path):
    def once(_):
        return ports.weft("doctor", "--rig", path, "--listen", 3, "--json")

    ran = tried(once)
    t.expect(ran.returncode == 0, f"doctor: {ran.returncode} {ran.stdout} {ran.stderr}")
    report = json.loads(ran.stdout)
    t.expect(report["problems"] == 0, f"findings: {report['findings']}")
    for device in report["devices"]:
        t.expect(device["answered"] and device["armed"] and not device["error"], f"{device}")
    names = {line.split()[1] for line in ports.noted() if line.startswith("opened ")}
    t.expect(len(names) == len(SERIAL) and all(name.startswith("/dev/ttyPTS") for name in names), f"opened as real ports: {names}")
    lines = "\n".join(ports.noted()).split("opened ")[1:]
    raised = sum([note for note in line.splitlines() if "RTS" in note][-1:] == ["set RTS"] for line in lines)
    t.expect(raised == len(STAGES), f"the stages' RTS is raised in the end, although the shim reports it as low: {ports.noted()}")


def refused(t, ports, path, rig):
    line = pathlib.Path(next(device["link"]["path"] for device in rig["devices"] if device["name"] == "stage.x"))
    held = os.open(line, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    fcntl.flock(held, fcntl.LOCK_EX)
    report = json.loads(ports.weft("doctor", "--rig", path, "--listen", 0.5, "--json").stdout)
    error = next(device["error"] for device in report["devices"] if device["name"] == "stage.x")
    t.expect(error is not None and error["code"] == "busy", f"in use: {report}")
    os.close(held)
    document = json.loads(path.read_text())
    for device in document["devices"]:
        if device["name"] == "stage.x":
            device["link"]["path"] = str(ports.d / "wrong.json")
        if device["name"] == "stage.y":
            device["link"]["path"] = "/dev/ttyUSB_none"
    (ports.d / "wrong.json").write_text(json.dumps(document))
    ran = ports.weft("doctor", "--rig", "wrong.json", "--listen", 0.5, "--json")
    found = {name: " ".join(f"{f['what']} {f['hint']}" for f in json.loads(ran.stdout)["findings"] if f["subject"] == name) for name in STAGES}
    t.expect(ran.returncode == 1 and has(found["stage.x"], [str(ports.d / "wrong.json"), "/dev/ttyUSB0"]), f"no serial port: {found['stage.x']}")
    t.expect("/dev/ttyUSB_none" in found["stage.y"] and found["stage.y"] != found["stage.x"], f"not there: {found['stage.y']}")
    ran = ports.weft("align", "--rig", "wrong.json")
    t.expect(ran.returncode == 1 and "stage.x" in ran.stderr, f"nothing begins: {ran.stderr}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[3]).resolve()
    with tempfile.TemporaryDirectory(prefix="weft-real-port-") as folder:
        d = pathlib.Path(folder)
        ports = Ports(t, d, sys.argv[4])
        path, rig = rig_file(root, d)
        with ServedRig(sys.argv[2], path, rig):
            looked_over(t, ports, path)
            refused(t, ports, path, rig)
    t.finish()


main()
