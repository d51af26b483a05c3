#!/usr/bin/env python3
"""The workflow's own commands on a good campaign, and the check on worsened ones. All simulated.

    ci_check.py WEFT SOURCE_ROOT
"""
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

from cli_support import line_has

WEFT, ROOT = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
ENVIRONMENT = {**os.environ, "PATH": f"{WEFT.parent}:{os.environ['PATH']}"}


def step(program):
    """The workflow's command that runs this program."""
    (found,) = re.findall(rf"^ +- run: ({re.escape(program)} .*)$", (ROOT / "packaging/ci/workflow.yml").read_text(), re.M)
    return shlex.split(found)


def run(command, status, **more):
    ran = subprocess.run([str(word) for word in command], cwd=ROOT, env={**ENVIRONMENT, **more}, capture_output=True, text=True, timeout=600)
    assert ran.returncode == status, f"{command}: {ran.returncode} (expected {status})\n{ran.stdout}{ran.stderr}"
    return ran


def campaign(folder, status=0, rig=None, accuracy=None):
    command = step("weft run")
    command[command.index("--out") + 1] = folder
    if rig:
        command[command.index("--rig") + 1] = rig
    if accuracy:
        command[command.index("--accuracy") + 1] = accuracy
    run(command, status)
    return folder


def check(folder, status, *more):
    command = step("packaging/ci/check-campaign")
    return run([command[0], folder, *command[2:], *more], status)


def worsened(folder, name, change):
    """A rig file like the workflow's, changed by `change`."""
    source = ROOT / step("weft run")[4]
    rig = json.loads(source.read_text())
    for table in ("fabrics", "fidelity"):
        rig["simulation"][table] = str((source.parent / rig["simulation"][table]).resolve())
    change(rig)
    file = folder / f"{name}.json"
    file.write_text(json.dumps(rig))
    return file


def noisy(rig):
    rig["simulation"]["pads"] = {"noise_counts": 3000}


def promises_too_much(folder):
    """A fidelity table that states a tenth of each setting's error."""
    def change(rig):
        table = json.loads(pathlib.Path(rig["simulation"]["fidelity"]).read_text())
        for setting in table["settings"]:
            for cloth in setting["cloths"]:
                for figure in ("q50_n", "q99_n", "max_n"):
                    cloth[figure] *= 0.1
        rig["simulation"]["fidelity"] = str(folder / "table.json")
        (folder / "table.json").write_text(json.dumps(table))
    return change


def main():
    with tempfile.TemporaryDirectory(prefix="weft-ci-") as name:
        folder = pathlib.Path(name)
        good = campaign(folder / "good")
        check(good, 0)
        assert line_has(check(good, 1, "--error-mN", "10").stderr, "10.0 mN")

        noise = campaign(folder / "noise", rig=worsened(folder, "noisy", noisy))
        printed = check(noise, 1).stderr
        assert line_has(printed, ["accuracy", "M1"]) and "mN" not in printed, printed

        missed = campaign(folder / "missed", status=3, rig=worsened(folder, "coarse", promises_too_much(folder)), accuracy="50mN")
        printed = check(missed, 1).stderr
        assert line_has(printed, "50.0 mN") and "accuracy" not in printed, printed

        data = good / "dataset.h5"
        content = data.read_bytes()
        data.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
        (good / "handover/evaluation.json").unlink()
        printed = check(good, 1).stderr
        assert line_has(printed, "weft verify") and line_has(printed, "evaluation.json"), printed
        check(folder / "nothing", 1)
        run([ROOT / "packaging/ci/check-campaign", good], 2)
    print("ci_check: the workflow's check passes as it should, and fails where it should (simulated)")


main()
