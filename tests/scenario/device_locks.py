#!/usr/bin/env python3
"""Only one program at a time has a device, for every kind of link; and `weft doctor` checks the same things as a run (cases/bench, rows 3 and 4).

A campaign runs on an emulated bench with stages and taxels on TCP. Meanwhile `weft doctor` and a second `weft run` start, with the same and with
another name of the machine. They are refused with the holder's name, and the campaign completes. Then rig files that disagree with the box: a run and
the doctor refuse the same ones.

    device_locks.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, has
from emulated_kill import PLATE_MM, recipe
from emulated_support import ServedRig, free_port, near_home, rig_file, tried
from killed_campaign import Campaign

LATEST_S = 60.0


def tcp_rig(root, d):
    """emulated17 with every stage and the taxels on TCP, and the box's page."""
    path, rig = rig_file(root, d, over_tcp=True)
    near_home(path, rig, PLATE_MM)
    box = device(rig, "ft")
    box["http"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
    path.write_text(json.dumps(rig, indent=1))
    return path, rig


def device(rig, name):
    return next(one for one in rig["devices"] if one["name"] == name)


def changed(d, rig, name, edit):
    rig = json.loads(json.dumps(rig))
    edit(rig)
    (d / name).write_text(json.dumps(rig))
    return name


def by_name(rig):
    """The same ports by the machine's other name."""
    for one in rig["devices"]:
        if one["link"]["kind"] in ("tcp", "udp"):
            one["link"]["host"] = "localhost"


def wait_for_phase(d, out, phase, process):
    end = time.time() + LATEST_S
    campaign = Campaign(d / out / "campaign.sqlite")
    while time.time() < end and process.poll() is None:
        if campaign.asked("SELECT id FROM trial") and campaign.begun_phase() == phase:
            return True
        time.sleep(0.05)
    return False


def examined(t, d, rig, *more):
    ran = t.run("doctor", "--rig", rig, "--listen", 0.5, "--json", *more, cwd=d)
    return ran.returncode, json.loads(ran.stdout)


def for_another_user(t, d, rig, pid):
    """A lock of one user also holds for other users, who get the name of its holder."""
    def become_nobody():
        os.setgid(65534)
        os.setuid(65534)
    ran = subprocess.run([t.weft, "doctor", "--rig", rig, "--listen", "0.5", "--json"], cwd=d, capture_output=True, text=True,
                         timeout=300, preexec_fn=become_nobody)
    errors = [one["error"] or {} for one in json.loads(ran.stdout)["devices"]]
    t.expect(ran.returncode == 1 and all(one.get("code") == "busy" and has(json.dumps(one), ["weft", str(pid), "root"]) for one in errors),
             f"another user: {ran.returncode} {errors} {ran.stderr}")


def held(t, d, rig, weft_process):
    """Results of other programs during a stroke."""
    if os.geteuid() == 0:
        for_another_user(t, d, rig, weft_process.pid)
    for name in (rig, changed(d, json.loads((d / rig).read_text()), "by_name.json", by_name)):
        status, report = examined(t, d, name)
        t.expect(status == 1, f"{name}: status {status}")
        for one in report["devices"]:
            error = one["error"] or {}
            t.expect(error.get("code") == "busy" and has(json.dumps(error), ["weft", str(weft_process.pid)]),
                     f"{name}: who holds {one['name']}: {error}")
            t.expect(not one["answered"] and one["samples"] == 0, f"{name}: {one['name']} was touched")
    second = t.run("run", "kill.json", "--rig", rig, "--out", "second", "--no-evaluate", "--json", cwd=d)
    error = json.loads(second.stdout)["error"]
    t.expect(second.returncode == 1 and error["code"] == "busy" and has(error["sentence"], str(weft_process.pid)), f"a second run: {second.returncode} {error}")


def while_it_slides(t, d, path, served):
    reached = []

    def once(_):
        out = f"out{len(list(d.glob('out*')))}"
        run = subprocess.Popen([t.weft, "run", "kill.json", "--rig", path.name, "--out", out, "--no-evaluate"], cwd=d,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        reached.append(wait_for_phase(d, out, "M", run))
        if reached[-1]:
            held(t, d, path.name, run)
        said = run.communicate(timeout=2 * LATEST_S)
        return subprocess.CompletedProcess([], run.returncode, *said)
    ran = tried(once)
    t.expect(any(reached), "phase M was reached, and what else was tried then")
    t.expect(ran.returncode == 0, f"the campaign: {ran.returncode} {ran.stderr[-600:]}")
    truth = served.order(order="truth")
    t.expect(abs(truth["contact_force_n"]) < 0.05, f"force left on the cloth: {truth}")


def as_a_run_would(t, d, rig):
    """A run and the doctor refuse the same rig files."""
    def scale(rig):
        device(rig, "ft")["config"]["counts_per_newton"] = 2 * device(rig, "ft")["config"].get("counts_per_newton", 1000000)

    def serial(rig):
        device(rig, "ft")["config"]["calibration_serial"] = "FT99999"

    def unreachable(rig):
        device(rig, "ft")["http"]["port"] = 1

    for name, edit in (("scale.json", scale), ("serial.json", serial), ("unreachable.json", unreachable)):
        rig_name = changed(d, rig, name, edit)
        status, report = examined(t, d, rig_name)
        found = [f for f in report["findings"] if f["severity"] == "problem" and f["subject"] == "ft"]
        t.expect(status == 1 and len(found) == 1, f"doctor, {name}: {status} {report['findings']}")
        ran = t.run("run", "kill.json", "--rig", rig_name, "--out", "refused-" + name, "--no-evaluate", "--json", cwd=d)
        t.expect(ran.returncode == 1, f"run, {name}: {ran.returncode} {ran.stderr}")
    status, report = tried_report(t, d, rig)
    t.expect(status == 0 and report["problems"] == 0, f"the rig itself: {report['findings']}")


def tried_report(t, d, rig):
    name = changed(d, rig, "fine.json", lambda _: None)
    ran = tried(lambda _: t.run("doctor", "--rig", name, "--listen", 0.5, "--json", cwd=d))
    return ran.returncode, json.loads(ran.stdout)


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        d.chmod(0o755)
        recipe(root, d)
        path, rig = tcp_rig(root, d)
        with ServedRig(weft_rig, path, rig, seed=3) as served:
            while_it_slides(t, d, path, served)
            as_a_run_would(t, d, rig)
    t.finish()


if __name__ == "__main__":
    main()
