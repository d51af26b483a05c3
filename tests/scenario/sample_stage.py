#!/usr/bin/env python3
"""A stage of another maker: docs/sample_driver/line_stage.cpp, built out of tree against the installed SDK, drives a stage with text commands as x,
in a short campaign on the emulated bench. A silent stage ends the campaign, which names it.

    sample_stage.py WEFT WEFT_RIG SOURCE_ROOT BUILD
"""
import json
import os
import pathlib
import pty
import shutil
import sys
import tempfile
import threading
import time
import tty

from cli_support import Checks, error_of, fits
from emulated_support import ServedRig, near_home, rig_file, tried
from sample_driver import build

SLIDE_MM = 4


class LineStage:
    """The stage on a pseudo-terminal: written from the description at the head of the driver."""

    def __init__(self, path):
        self.master, self.slave = pty.openpty()  # the slave is kept open, so that the port survives a host that leaves
        tty.setraw(self.slave)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(self.slave))
        self.at, self.target, self.speed, self.since = 12.0, 12.0, 1.0, time.monotonic()
        self.homed = self.enabled = False
        self.travelled, self.acceleration = 0.0, None
        threading.Thread(target=self.serve, daemon=True).start()

    def position(self):
        now = time.monotonic()
        step = min(abs(self.target - self.at), self.speed * (now - self.since))
        self.at += step if self.target > self.at else -step
        self.travelled += step
        self.since = now
        return self.at

    def obey(self, words):
        here = self.position()
        match words:
            case ["*IDN?"]:
                os.write(self.master, b"Example,LS-150,SN0042,1.3\n")
            case ["STAT?"]:
                line = f"STAT {here:.6f} {int(here != self.target)} {int(self.homed)} 0 0\n".encode()
                os.write(self.master, line[:9])  # in two pieces, as on serial lines
                os.write(self.master, line[9:])
            case ["EN", value]:
                self.enabled = value == "1"
            case ["ACC", value]:
                self.acceleration = float(value)
            case ["VEL", value]:
                self.speed = float(value)
            case ["HOME"] if self.enabled:
                self.at, self.target, self.homed, self.speed = min(here, 1.0), 0.0, True, 4.0
            case ["MOV", value] if self.enabled:
                self.target = float(value)
            case ["STOP"] | ["ABORT"]:
                self.target = here

    def serve(self):
        waiting = b""
        while True:
            waiting += os.read(self.master, 1000)
            *lines, waiting = waiting.split(b"\n")
            for line in lines:
                self.obey(line.decode().split())


def own_rig(root, d):
    path, rig = rig_file(root, d)
    near_home(path, rig)
    mine = json.loads(json.dumps(rig))
    x = next(device for device in mine["devices"] if device["role"] == "x")
    x.update(driver="line_stage", config={"travel_mm": [0, 150], "max_speed_mm_s": 4},
             link={"kind": "serial", "path": str(d / "own/x"), "baud": 115200})
    mine["plugins"] = ["plugins"]
    (d / "mine.json").write_text(json.dumps(mine))
    recipe = {"schema_version": 1, "name": "short", "source": "test", "seed": 1, "fabrics": ["denim"], "repetitions": 1,
              "explorations": {"M1": {"phases": [
                  {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "force_band_N": 0.25, "duration_s": 2},
                  {"phase": "M", "force_N": 5, "force_band_N": 0.25, "speed_mm_s": 2, "path": [{"dx_mm": SLIDE_MM, "dy_mm": 0}]},
                  {"phase": "E", "duration_s": 1}]}}}
    (d / "recipe.json").write_text(json.dumps(recipe))
    return path, rig


def campaign(t, d, weft_rig, path, rig, prepare=lambda stage: None):
    """A run, and the stage that it drove."""
    def once(attempt):
        stage = LineStage(d / "own/x")
        prepare(stage)
        with ServedRig(weft_rig, path, rig):
            return t.run("run", "recipe.json", "--rig", "mine.json", "--out", f"out{attempt}-{time.monotonic_ns()}", "--no-evaluate", "--json", cwd=d), stage
    return tried(once)


def main():
    weft, weft_rig, root, build_folder = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
    t = Checks(weft)
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        build(t, d, root, build_folder)
        path, rig = own_rig(root, d)
        t.succeeds("check", "recipe.json", "--rig", "mine.json", cwd=d)
        ran, stage = campaign(t, d, weft_rig, path, rig)
        t.expect(ran.returncode == 0, f"run: {ran.returncode} {ran.stdout} {ran.stderr}")
        t.expect(stage.homed and stage.travelled > 2 * SLIDE_MM, f"it moved: {stage.travelled} mm")
        t.expect(stage.acceleration == 20, f"the rig's acceleration is handed on: {stage.acceleration}")
        print(f"EMULATED: a campaign with a stage of another maker, which went {stage.travelled:.1f} mm")
        ran, _ = campaign(t, d, weft_rig, path, rig, lambda stage: setattr(stage, "obey", lambda words: None))
        error = error_of(ran) or json.loads(ran.stdout).get("campaign_error", {})
        t.expect(ran.returncode != 0 and fits(error, code="timeout", where=["stage.x"]) and "stage.x" in ran.stderr, f"a dead stage: {error} {ran.stderr}")
    finally:
        shutil.rmtree(d)
    t.finish()


main()
