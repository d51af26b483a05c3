#!/usr/bin/env python3
"""Signals other than SIGKILL, and a killed monitor, during a stroke on the emulated bench (cases/bench, rows 2 and 7). Each time the program reports
it, the probe ends above the fabric, and the campaign can be resumed.

    host_signals.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, line_has
from emulated_kill import LATEST_S, PLATE_MM, recipe
from emulated_support import ServedRig, near_home, rig_file
from killed_campaign import Campaign

AT_ONCE_BYTES, IN_THE_MIDDLE_BYTES = 200 * 1024, 2 * 1024 * 1024


class Host:
    """`weft run` on the emulated bench."""

    def __init__(self, t, d, out):
        self.campaign = Campaign(d / out / "campaign.sqlite")
        self.process = subprocess.Popen([t.weft, "run", "kill.json", "--rig", "emulated.json", "--out", out, "--no-evaluate", "--resume", "--json"],
                                        cwd=d, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def wait_for(self, phase):
        before = len(self.campaign.asked("SELECT id FROM trial"))
        end = time.time() + LATEST_S
        while time.time() < end and self.process.poll() is None:
            if len(self.campaign.asked("SELECT id FROM trial")) > before and self.campaign.begun_phase() == phase:
                return True
            time.sleep(0.02)
        return False

    def monitor(self):
        children = pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/children")
        (pid,) = [int(word) for file in children for word in file.read_text().split()]
        return pid

    def ended(self):
        out, err = self.process.communicate(timeout=2 * LATEST_S)
        return subprocess.CompletedProcess([], self.process.returncode, out, err)


def run(t, d, out, act):
    """The finished host; `act` was called during its stroke."""
    host = Host(t, d, out)
    was_there = host.wait_for("M")
    if was_there:
        act(host)
    ran = host.ended()
    t.expect(was_there, f"{out}: no slide began: {ran.stderr[-500:]}")
    return ran


def off_the_cloth(t, served, what):
    force = served.order(order="truth")["contact_force_n"]
    t.expect(abs(force) < 0.05, f"{what}: {force:.2f} N left on the cloth")


def suspended(t, d, served):
    """Ctrl-Z is refused with a message, and the stroke continues. Then the terminal is closed, which ends the run in an orderly way."""
    def act(host):
        host.process.send_signal(signal.SIGTSTP)
        host.process.send_signal(signal.SIGTTOU)
        time.sleep(2.5)  # the monitor's patience is 2 s
        t.expect(host.process.poll() is None and host.campaign.begun_phase() in "ME", "Ctrl-Z ended the run")
        host.process.send_signal(signal.SIGHUP)
    ran = run(t, d, "hup", act)
    t.expect(ran.returncode == 128 + signal.SIGHUP, f"SIGHUP: {ran.returncode} {ran.stderr[-500:]}")
    t.expect(line_has(ran.stderr, ["weft", "Ctrl-C"]), f"Ctrl-Z without a message: {ran.stderr[-500:]}")
    ended = json.loads(ran.stdout)
    t.expect((ended["cleanup"], ended["rig"]) == ("done", "safe"), f"SIGHUP: {ended['cleanup']} {ended['rig']}")
    off_the_cloth(t, served, "SIGHUP")


def monitor_killed(t, d, served):
    """A run without a monitor fails, names the monitor, and lifts the probe itself."""
    def act(host):
        subprocess.run(["kill", "-KILL", str(host.monitor())], check=True)
    ran = run(t, d, "unwatched", act)
    t.expect(ran.returncode == 1 and "monitor" in ran.stderr + ran.stdout, f"{ran.returncode} {ran.stderr[-500:]}")
    ended = json.loads(ran.stdout)
    t.expect((ended["outcome"], ended["cleanup"]) == ("failed", "done"), f"without a monitor: {ended}")
    off_the_cloth(t, served, "without a monitor")


def both_killed(t, d, served):
    """Both processes are gone: the motions end by themselves, at the latest at the end of the stroke, and the force stays constant."""
    def act(host):
        monitor = host.monitor()
        subprocess.run(["kill", "-KILL", str(monitor)], check=True)
        host.process.kill()
    ran = run(t, d, "alone", act)
    t.expect(ran.returncode == -signal.SIGKILL, f"{ran.returncode}")
    time.sleep(4)  # the stroke takes 3 s
    before = served.order(order="truth")
    time.sleep(1)
    after = served.order(order="truth")
    t.expect(before["fabric_point_m"] == after["fabric_point_m"] and after["contact_force_n"] < 6, f"{before} {after}")


def file_limit(t, d, root):
    """A limited file size: the failed write ends the campaign in an orderly way, during it or before its start."""
    def run(limit_bytes):
        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes))
        ran = subprocess.run([t.weft, "run", root / "recipes/library/first.json", "--rig", root / "sim/rigs/bench17.json", "--out",
                              f"limit{limit_bytes}", "--no-evaluate", "--json"], cwd=d, capture_output=True, text=True, timeout=300,
                             preexec_fn=limited)
        t.expect(ran.returncode == 1, f"{limit_bytes} bytes: {ran.returncode} {ran.stderr[-500:]}")
        return json.loads(ran.stdout)
    error = run(AT_ONCE_BYTES)["error"]
    t.expect(error["code"] == "io" and "ulimit" in error["hint"], f"at once: {error}")
    ended = run(IN_THE_MIDDLE_BYTES)
    t.expect((ended["outcome"], ended["cleanup"]) == ("failed", "done"), f"in the middle: {ended}")


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        file_limit(t, d, root)
        recipe(root, d)
        path, rig = rig_file(root, d)
        near_home(path, rig, PLATE_MM)
        with ServedRig(weft_rig, path, rig, seed=3) as served:
            for case in (suspended, monitor_killed, both_killed):
                case(t, d, served)
    t.finish()


if __name__ == "__main__":
    main()
