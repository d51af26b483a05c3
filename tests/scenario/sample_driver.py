#!/usr/bin/env python3
"""Tests the checklist of docs/howto/own-device.md: installs the SDK, builds the sample driver against it out of tree (with another compiler if there is
one), and finds a device of its protocol on an emulated rig.

    sample_driver.py WEFT WEFT_RIG SOURCE_ROOT BUILD
"""
import json
import os
import pathlib
import pty
import shutil
import subprocess
import sys
import tempfile
import threading
import tty

from cli_support import Checks
from emulated_support import ServedRig, rig_file

MOST_LINES = 100
RATE_HZ = 37
LOST_FRAME = 20  # interval of frames after which one number is left out


class LineTaxels:
    """The sample's device on a pseudo-terminal: answers "?" and prints frames."""

    def __init__(self, path):
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        self.slave = slave  # kept open, so that the port survives a host that leaves
        path.parent.mkdir(parents=True, exist_ok=True)
        path.symlink_to(os.ttyname(slave))
        self.over = threading.Event()
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.stream, self.answer)]
        for thread in self.threads:
            thread.start()

    def answer(self):
        while not self.over.is_set():
            if b"?" in os.read(self.master, 100):
                os.write(self.master, b"taxels LT-0042\n")

    def stream(self):
        number = 0
        while not self.over.wait(1 / RATE_HZ):
            number += 2 if number % LOST_FRAME == 0 else 1
            line = ",".join(str(n) for n in [number, *range(1000, 1016)]) + "\n"
            os.write(self.master, line[:7].encode())  # in two pieces, as on serial lines
            os.write(self.master, line[7:].encode())


def build(t, d, root, build_folder):
    def call(*command, **more):
        ran = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=280, **more)
        t.expect(ran.returncode == 0, f"{command}: {ran.stdout[-1500:]} {ran.stderr[-1500:]}")

    call("cmake", "--install", build_folder, "--component", "sdk", "--prefix", d / "sdk")
    t.expect((d / "sdk/include/weft/drivers/api/weft_driver.h").exists(), "the SDK has the C header")
    source = root / "docs/sample_driver"
    lines = len((source / "line_taxels.cpp").read_text().splitlines())
    t.expect(lines < MOST_LINES, f"the sample driver is short: {lines} lines")
    shutil.copytree(source, d / "sample")
    compiler = [f"-DCMAKE_CXX_COMPILER={shutil.which('clang++')}"] if shutil.which("clang++") else []
    call("cmake", "-G", "Ninja", "-S", d / "sample", "-B", d / "plugins", f"-DCMAKE_PREFIX_PATH={d / 'sdk'}",
         "-DCMAKE_BUILD_TYPE=Debug", *compiler)
    call("cmake", "--build", d / "plugins")
    symbols = subprocess.run(["nm", "-D", "--defined-only", d / "plugins/weft-driver-line_taxels.so"],
                             capture_output=True, text=True).stdout.split("\n")
    strong = [line for line in symbols if line and line.split()[1] in "TDBR"]
    t.expect([line.split()[2] for line in strong] == ["weft_driver_v1"], f"one symbol is exported: {strong}")
    return lines, "clang++" if compiler else "the default compiler"


def sample_rig(root, d):
    path, rig = rig_file(root, d)
    served = json.loads(json.dumps(rig))
    taxels = next(device for device in rig["devices"] if device["role"] == "taxels")
    taxels.update(driver="line_taxels", config={"taxels": 16, "rate_hz": RATE_HZ})
    taxels["link"] = {"kind": "serial", "path": str(d / "own/taxels"), "baud": 115200}
    rig["plugins"] = ["plugins"]
    mine = d / "sample.json"
    mine.write_text(json.dumps(rig))
    return path, served, mine


def examine(t, d, root, weft_rig):
    path, served, mine = sample_rig(root, d)
    device = LineTaxels(d / "own/taxels")
    with ServedRig(weft_rig, path, served):
        ran = t.run("doctor", "--rig", mine, "--json", cwd=d)
    device.over.set()
    t.expect(ran.returncode == 0, f"doctor: {ran.returncode} {ran.stdout} {ran.stderr}")
    report = json.loads(ran.stdout)
    found = next(device for device in report["devices"] if device["name"] == "taxels")
    t.expect(found["plugin"] == str(d / "plugins/weft-driver-line_taxels.so"), f"plugin: {found}")
    t.expect(found["reported"] == {"serial": "LT-0042"}, f"identity: {found}")
    t.expect(found["armed"] and found["samples"] > RATE_HZ, f"frames: {found}")
    t.expect(2 <= found["frames_lost"] <= 8, f"the frames that were left out are counted: {found}")
    return found


def main():
    weft, weft_rig, root, build_folder = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    t = Checks(weft)
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        lines, compiler = build(t, d, root, build_folder)
        found = examine(t, d, root, weft_rig)
        print(f"EMULATED: sample driver of {lines} lines, built by {compiler}: {found['rate_hz']:.1f} Hz, "
              f"{found['samples']} frames, {found['frames_lost']} lost on purpose")
    finally:
        shutil.rmtree(d)
    t.finish()


if __name__ == "__main__":
    main()
