#!/usr/bin/env python3
"""Kills (SIGKILL) or stops (SIGSTOP) the host of the emulated bench at seeded moments of every phase of a trial. Each time the test checks: the true
force stays under the cap. The stages stop along the fabric (by the monitor, not at the end of the stroke). The monitor lifts the probe off the fabric
and writes a line. A hung host is ended by its monitor. The file opens and lacks at most 100 ms. The next host resumes the same campaign: it finds the
attempt interrupted and all records unchanged, homes, and records the rig's true position. The last host completes the campaign, and `weft verify`
finds it whole.

    emulated_kill.py WEFT WEFT_RIG SOURCE_ROOT [KILLS [SEED [JSON]]]     KILLS SIGKILL and a SIGSTOP after every fourth; writes their figures to JSON

By default four SIGKILL, one in each phase, and a SIGSTOP in the stroke.
"""
import collections
import json
import pathlib
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import typing

from cli_support import has
from emulated_support import ATTEMPTS, ServedRig, kept_waiting, near_home, rig_file
from killed_campaign import Campaign
from machine_pace import TimedChecks, skip_as_too_slow

FORCE_CAP_N = 10.0
STOPPED_WITHIN_S = 1.0      # after the kill, along the fabric; without the monitor a stroke continues to its end
LIFTED_WITHIN_S = 4.0       # 0.3 s of braking, 8 mm of clearance and the fabric at 4 mm/s, and STOPPED_WITHIN_S
HUNG_ENDED_WITHIN_S = 4.0   # patience of the monitor (2 s) and a busy machine
LACKS_AT_MOST_S = 0.12      # 100 ms of the recorder, and a sample of the force sensor (10 ms) on each side
PLACE_WITHIN_M = 200e-6     # between record and truth: 2 mm/s, and 100 ms of the recorder on one side
SLIDE_MM, SLIDE_MM_S = 6, 2
SLIDE_S = SLIDE_MM / SLIDE_MM_S
PLATE_MM = (18, 24)         # a little more than the stroke and the probe need: homing moves at 2 mm/s
PHASE_S = {"S": 1, "P": 1, "M": SLIDE_S, "E": 1}  # least recorded duration of each phase of the recipe
LATEST_S = 90.0             # a run of this recipe ends before this
LATEST_BEFORE_S = 0.5       # if the machine is late this long before a kill, records may lack data
STOOD_STILL_S = 0.06        # of the console, which is polled every 20 ms: the sensor may be silent for 100 ms


class Window(typing.NamedTuple):
    name: str
    phase: str       # counted from its first rows in the file; "" from the start of the host
    least_s: float
    most_s: float


# A row reaches the file 50 to 100 ms after its time.
WINDOWS = [Window("phase S", "S", 0, 0.85), Window("phase P", "P", 0, 0.85), Window("phase M", "M", 0, SLIDE_S - STOPPED_WITHIN_S - 0.1),
           Window("phase E", "E", 0, 0.85), Window("start, homing, approach", "", 0, 25), Window("pressing", "S", 0.95, 2.4),
           Window("release", "M", SLIDE_S, SLIDE_S + 0.6), Window("retreat", "E", 1.0, 2.2)]


class Watch(threading.Thread):
    """Requests the truth from weft-rig fifty times a second: (wall time, force, position)."""

    def __init__(self, console):
        super().__init__(daemon=True)
        self.socket = socket.create_connection((console["host"], console["port"]), timeout=10)
        self.seen = []
        self.on = True

    def run(self):
        answers = self.socket.makefile()
        while self.on:
            self.socket.sendall(b'{"order": "truth"}\n')
            truth = json.loads(answers.readline())
            self.seen.append((time.time(), truth["contact_force_n"], (*truth["fabric_point_m"], truth["probe_z_m"])))
            time.sleep(0.02)

    def finish(self):
        self.on = False
        self.join()

    def stood_still_s(self):
        """The longest time without an answer of weft-rig on this console, which no kill affects [s]."""
        times = [t for t, *_ in self.seen]
        return max((b - a for a, b in zip(times, times[1:])), default=0.0)

    def peak_n(self):
        return max(force for _, force, _ in self.seen)

    def place_at(self, when):
        return min(self.seen, key=lambda seen: abs(seen[0] - when))[2]

    def last_motion(self, axes, least_m):
        """Last time at which one of these axes was further than `least_m` from its final position."""
        *_, place = self.seen[-1]
        far = [t for t, _, p in self.seen if max(abs(p[i] - place[i]) for i in axes) > least_m]
        return far[-1] if far else self.seen[0][0]

    def force_at(self, when):
        return min(self.seen, key=lambda seen: abs(seen[0] - when))[1]

    def peak_after(self, when):
        return max(force for t, force, _ in self.seen if t >= when)


def recipe(root, folder):
    document = json.loads((root / "recipes/library/m1.json").read_text())
    document.pop("$schema", None)
    document.update(name="kill", fabrics=["fleece"], repetitions=1, seed=3)
    for phase in document["explorations"]["M1"]["phases"]:
        if phase["phase"] == "M":
            phase.update(path=[{"dx_mm": 0, "dy_mm": SLIDE_MM}], speed_mm_s=SLIDE_MM_S)
        else:
            phase["duration_s"] = PHASE_S[phase["phase"]]
    (folder / "kill.json").write_text(json.dumps(document))


class Loss(typing.NamedTuple):
    """The planned loss of a host."""
    number: int
    window: Window
    after_s: float
    how: signal.Signals

    def __str__(self):
        since = f"phase {self.window.phase} began" if self.window.phase else "the start"
        return f"kill {self.number} ({self.how.name}, {self.window.name}, {self.after_s:.2f} s after {since})"


class Bench:
    def __init__(self, t, weft, folder, rig_path, console):
        self.t, self.weft, self.folder, self.rig_path, self.console = t, weft, folder, rig_path, console
        self.kills = []    # figures of each
        self.peak_n = 0.0  # over all runs, including the last one
        self.offsets_z = {}  # recorded minus true height, by phase, as first seen: the probe's spring is compressed in P and M
        self.folders = 0
        self.begin_anew()

    def begin_anew(self):
        """Starts in another folder after a fault of the machine ended the campaign of this one."""
        self.folders += 1
        self.out = self.folder / f"out{self.folders}"
        self.campaign = Campaign(self.out / "campaign.sqlite")
        self.past = []

    def start(self):
        """A host that starts or resumes the campaign."""
        return subprocess.Popen([self.weft, "run", "kill.json", "--rig", str(self.rig_path), "--out", self.out.name, "--no-evaluate",
                                 "--resume"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def wait_for(self, phase, process):
        """Waits until the file has rows of the phase, of a trial that this host began."""
        end = time.time() + LATEST_S
        before = len(self.past)
        with self.campaign.one_connection():
            while time.time() < end and process.poll() is None:
                if len(self.campaign.asked("SELECT id FROM trial")) > before and self.campaign.begun_phase() == phase:
                    return
                time.sleep(0.02)

    def begun(self, kill):
        """A host that has reached the moment, and its console's watch; or its output if it ended before."""
        for attempt in range(ATTEMPTS):
            watch = Watch(self.console)
            process = self.start()
            watch.start()
            if kill.window.phase:
                self.wait_for(kill.window.phase, process)
            time.sleep(kill.after_s)
            if process.poll() is None:
                return process, watch, ""
            said = process.stdout.read().decode(errors="replace")
            if not self.excused(watch, said, attempt):
                return process, watch, said
            watch.finish()
            self.under_cap(watch, f"{kill}, attempt {attempt + 1}")
            self.begin_anew()
        raise AssertionError("the last attempt returns")

    def excused(self, watch, said, attempt):
        """True only if weft-rig as a whole got no processor time; not if the kill before blocked a link."""
        silence = kept_waiting(said)
        if not silence or watch.stood_still_s() <= STOOD_STILL_S:
            return False
        print(f"attempt {attempt + 1}: weft-rig stood still for {watch.stood_still_s():.2f} s, and a port was silent ({silence})", flush=True)
        if attempt + 1 == ATTEMPTS:
            skip_as_too_slow(f"{ATTEMPTS} attempts")
        return True

    def under_cap(self, watch, what):
        self.t.expect(watch.peak_n() < FORCE_CAP_N, f"{what}: {watch.peak_n():.2f} N")
        self.peak_n = max(self.peak_n, watch.peak_n())

    def lose(self, kill):
        process, watch, said = self.begun(kill)
        if said or process.poll() is not None:
            self.t.expect(False, f"{kill}: it had ended before, with {process.returncode}: {said[-500:]}")
        began = time.monotonic() - LATEST_BEFORE_S
        killed = time.time()
        process.send_signal(kill.how)
        process.wait(30)
        ended = time.time()
        time.sleep(LIFTED_WITHIN_S + 0.5)
        watch.finish()
        if kill.how is signal.SIGSTOP:
            self.t.expect_in_time(ended - killed < HUNG_ENDED_WITHIN_S, f"{kill}: the monitor took {ended - killed:.2f} s", began)
        figures = {"planned": kill.window.name, "how": kill.how.name, "peak_n": watch.peak_n(),
                   "coast_s": max(0.0, watch.last_motion((0, 1), 2e-6) - ended),
                   "lift_s": max(0.0, watch.last_motion((2,), 50e-6) - ended)}
        self.t.expect_in_time(figures["coast_s"] < STOPPED_WITHIN_S, f"{kill}: the stages went on for {figures['coast_s']:.2f} s", began)
        self.t.expect_in_time(figures["lift_s"] < LIFTED_WITHIN_S, f"{kill}: the lift took {figures['lift_s']:.2f} s", began)
        self.under_cap(watch, kill)
        figures.update(self.recorded(kill, watch, killed, self.found_as_left(kill), began))
        self.lifted(kill, process, watch, ended, figures["fell"].startswith("in phase"))
        self.kills.append(figures)
        print(f"SIMULATED {kill}: {figures['fell']}, peak {figures['peak_n']:.2f} N, stages stopped {figures['coast_s']:.2f} s and the probe lifted {figures['lift_s']:.2f} s after"
              + (f", {1e3 * figures['lacks_s']:.0f} ms lacking" if "lacks_s" in figures else ""), flush=True)

    def lifted(self, kill, process, watch, ended, is_on_cloth):
        """The monitor's line names the host and the result for the probe. No force acts on the fabric any longer, and the lift added none."""
        if not kill.window.phase and kill.after_s < 1:
            return  # perhaps before the host had a monitor
        lines = (self.out / "monitor.log").read_text().splitlines() if (self.out / "monitor.log").exists() else []
        line = next((one for one in lines if f"process {process.pid} " in one), "")
        is_killed = re.search(r"\bkilled\b", line) is not None
        self.t.expect(is_killed == (kill.how is signal.SIGSTOP) and has(line, "5 of 5"), f"{kill}: the monitor's line: {lines[-1:]}")
        said = process.stdout.read().decode(errors="replace")
        self.t.expect(line[len("2026-11-29 06:33:06 UTC "):] in said, f"{kill}: standard error lacks the line: {said[-300:]}")
        if not is_on_cloth:
            return
        is_up = re.search(r"\b(up|raised|lifted|retracted)\b", line) is not None
        self.t.expect(is_up and abs(watch.seen[-1][1]) < 0.01, f"{kill}: {watch.seen[-1][1]:.2f} N left on the cloth; {line}")
        self.t.expect(watch.peak_after(ended) < watch.force_at(ended) + 0.2,
                      f"{kill}: {watch.peak_after(ended):.2f} N after the end, {watch.force_at(ended):.2f} N at it")

    def found_as_left(self, kill):
        """The killed host had found the earlier attempts interrupted and had not changed them. Returns whether it had begun one."""
        now = self.campaign.attempts()
        began = len(now) > len(self.past)
        same = [then.digest for then in self.past] == [attempt.digest for attempt in now[:len(self.past)]]
        ended = all(attempt.outcome == "interrupted" or attempt == then and not began for then, attempt in zip(self.past, now))
        self.t.expect(same and ended and len(now) <= len(self.past) + 1, f"{kill}: attempts before were {self.past}, are {now}")
        self.past = now
        return began

    def recorded(self, kill, watch, killed, is_new, since):
        """The phase of the kill according to the record, and the missing time."""
        phase, under_way = self.campaign.where(PHASE_S, LACKS_AT_MOST_S) if is_new else ("", False)
        if not under_way:
            return {"fell": f"after phase {phase}" if phase else "before phase S"}
        lacks = killed - self.campaign.newest_s()
        self.t.expect_in_time(lacks < LACKS_AT_MOST_S, f"{kill}: {lacks:.3f} s are missing", since)
        return {"fell": f"in phase {phase}", "lacks_s": lacks, "apart_m": self.apart(kill, watch, phase)}

    def apart(self, kill, watch, phase):
        """Along the plate, in the frame of the stages, the recorded position is the true one. In height it differs by the probe's spring, as for the
        first host in this phase. So no stage lost its count."""
        when, *place = self.campaign.newest_place()
        x, y, z = (recorded - true for recorded, true in zip(place, watch.place_at(when)))
        first = self.offsets_z.setdefault(phase, z)
        apart = max(abs(x), abs(y), abs(z - first))
        self.t.expect(apart < PLACE_WITHIN_M, f"{kill}: recorded {place} [m], off by {x, y, z}, in height by {first} in the first phase {phase}")
        return apart

    def complete(self):
        """Completes the campaign and verifies it."""
        for attempt in range(ATTEMPTS):
            watch = Watch(self.console)
            watch.start()
            run = self.start()
            said = run.communicate(timeout=4 * LATEST_S)[0].decode(errors="replace")
            watch.finish()
            self.under_cap(watch, "the last run")
            if run.returncode == 0 or not self.excused(watch, said, attempt):
                break
            self.begin_anew()
        self.t.expect(run.returncode == 0, f"the run after the last kill: {run.returncode} {said[-500:]}")
        kept = [attempt.digest for attempt in self.campaign.attempts()[:-1]]
        self.t.expect(kept == [attempt.digest for attempt in self.past], "what was recorded before is as it was")
        seen = self.t.succeeds("verify", self.out.name, cwd=self.folder)
        self.t.expect(seen["holds"] and seen["certified"] and seen["finished"] and seen["trials_complete"] == 1
                      and seen["attempts"] == len(self.past) + 1, f"verify: {seen}")


def losses(count, seed):
    """SIGKILL in one window after another, and a SIGSTOP after every fourth of them, the first in the stroke."""
    moments = random.Random(seed)
    number = 0
    for k in range(count):
        for how, window in [(signal.SIGKILL, seed + k)] + [(signal.SIGSTOP, seed + 2 + k // 4)] * (k % 4 == 3):
            number += 1
            window = WINDOWS[window % len(WINDOWS)]
            yield Loss(number, window, moments.uniform(window.least_s, window.most_s), how)


def summary(kills):
    """Lines with the number of kills by phase, and the worst of each figure. SIMULATED."""
    fell = collections.Counter((kill["fell"], kill["how"]) for kill in kills)
    worst = {figure: max((kill[figure] for kill in kills if figure in kill), default=0.0)
             for figure in ("peak_n", "coast_s", "lift_s", "lacks_s", "apart_m")}
    recording = sum("lacks_s" in kill for kill in kills)
    return [f"SIMULATED {how} {where}: {count}" for (where, how), count in sorted(fell.items())] + [
        f"SIMULATED {len(kills)} kills: peak force {worst['peak_n']:.2f} N of {FORCE_CAP_N:g} N, longest coast {worst['coast_s']:.2f} s, lift {worst['lift_s']:.2f} s, "
        f"recording lacks at most {1e3 * worst['lacks_s']:.0f} ms ({recording} of them while recording), "
        f"places apart {1e6 * worst['apart_m']:.0f} um at most"]


def unmet(kills):
    """The phases without a SIGKILL."""
    return [phase for phase in "SPME" if not any(kill["fell"] == f"in phase {phase}" and kill["how"] == "SIGKILL" for kill in kills)]


def main():
    weft, weft_rig, root = str(pathlib.Path(sys.argv[1]).resolve()), sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    count, seed = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((4, 4), (5, 0)))
    t = TimedChecks(weft)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        recipe(root, folder)
        path, rig = rig_file(root, folder)
        near_home(path, rig, PLATE_MM)
        with ServedRig(weft_rig, path, rig, seed=3):
            bench = Bench(t, weft, folder, path, rig["simulation"]["console"])
            for loss in losses(count, seed):
                bench.lose(loss)
            bench.complete()
    print("\n".join(summary(bench.kills)))
    # On a busy machine a phase may end before the kill; the stroke does not.
    aimed = any(kill["planned"] == "phase M" and kill["how"] == "SIGKILL" for kill in bench.kills)
    t.expect(not aimed or "M" not in unmet(bench.kills), "no SIGKILL fell into phase M")
    if len(sys.argv) > 6:
        pathlib.Path(sys.argv[6]).write_text(json.dumps({"seed": seed, "checks": t.count, "failures": t.failures, "peak_n": bench.peak_n,
                                                         "kills": bench.kills}))
    t.finish()


if __name__ == "__main__":
    main()
