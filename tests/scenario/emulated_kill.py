#!/usr/bin/env python3
"""The host of the emulated bench is killed (SIGKILL) or hangs (SIGSTOP) at seeded moments. Each time: the true force
stays under the cap, the stages stop (the monitor's stop, not the end of the slide), a hung host is ended by its
monitor, the file opens and lacks at most 100 ms, and the next host homes and goes on. A last run must be complete.

    emulated_kill.py WEFT WEFT_RIG SOURCE_ROOT [KILLS [SEED]]     2 kills by default, in phase M; more: at any moment
"""
import json
import pathlib
import random
import signal
import socket
import sqlite3
import struct
import subprocess
import sys
import tempfile
import threading
import time
import typing

from cli_support import Checks
from emulated_support import ATTEMPTS, ServedRig, kept_waiting, near_home, rig_file

FORCE_CAP_N = 10.0
STOPPED_WITHIN_S = 1.0      # of the kill; without the monitor a slide goes on to its end
HUNG_ENDED_WITHIN_S = 4.0   # patience of the monitor (2 s) and a busy machine
LACKS_AT_MOST_S = 0.12      # 100 ms of the recorder, and a sample of the force sensor (10 ms) on each side
WRENCH_ROW = 37             # bytes, t_ns first (docs/dataset.md)
TAXEL_PHASE = 16            # byte of a row of the taxels, t_ns first likewise
SLIDE_MM, SLIDE_MM_S = 30, 2
LONGEST_IN_SLIDE_S = 13.0   # of the 15 s that it takes
PHASE_S = {"S": 1, "P": 1, "M": SLIDE_MM / SLIDE_MM_S, "E": 1}  # the least that each of the recipe's phases is recorded for
LATEST_S = 45.0             # a run of this recipe is over by then
STOOD_STILL_S = 0.06        # of the console, asked every 20 ms: the sensor may be silent for 100 ms


class Watch(threading.Thread):
    """Asks weft-rig for the truth, fifty times a second: (wall time, force, place)."""

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
        """The longest that weft-rig left this console, which no kill touches, without an answer."""
        times = [t for t, *_ in self.seen]
        return max((b - a for a, b in zip(times, times[1:])), default=0.0)

    def peak_n(self):
        return max(force for _, force, _ in self.seen)

    def last_motion(self):
        """When a stage last was away from where it ends: 2 um along the cloth, 50 um in height, where the cloth creeps."""
        *_, place = self.seen[-1]
        far = [t for t, _, p in self.seen
               if max(abs(p[0] - place[0]), abs(p[1] - place[1]), abs(p[2] - place[2]) / 25) > 2e-6]
        return far[-1] if far else self.seen[0][0]


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


def newest_row(campaign):
    """World time of the newest row of the force sensor, or None: the file opens, whatever happened to its writer."""
    with sqlite3.connect(campaign) as file:
        clock = file.execute("SELECT t_ns, payload_json FROM journal WHERE kind = 'clock'").fetchone()
        chunk = file.execute("SELECT data FROM chunk WHERE stream = 1 ORDER BY rowid DESC LIMIT 1").fetchone()
        if not clock or not chunk:
            return None
        (t_ns,) = struct.unpack_from("<q", chunk[0], len(chunk[0]) - WRENCH_ROW)
        return (json.loads(clock[1])["utc_ns"] + t_ns - clock[0]) * 1e-9


def phase_under_way(campaign):
    """Whether the trial that has no outcome has a phase that is not over: its rows are of less time than the recipe gives it. What is
    lost of a phase makes it shorter still, so that no loss passes for the time between two phases, of which nothing is recorded."""
    with sqlite3.connect(campaign) as file:
        rows = [(*struct.unpack_from("<q", data, at), chr(data[at + TAXEL_PHASE]))
                for data, count in file.execute("SELECT data, rows FROM chunk JOIN trial ON trial.id = chunk.trial "
                                                "WHERE stream = 0 AND outcome IS NULL ORDER BY number")
                for at in range(0, len(data), len(data) // count)]
    if not rows:
        return False
    newest_ns, phase = rows[-1]
    first_ns = min(t for t, p in rows if p == phase)
    return (newest_ns - first_ns) * 1e-9 < PHASE_S[phase] - LACKS_AT_MOST_S


def wait_for_slide(campaign, process, more_s):
    """Until rows of phase M are in the file, and so many seconds more."""
    end = time.time() + 2 * LATEST_S
    while time.time() < end and process.poll() is None:
        if campaign.exists():
            try:
                with sqlite3.connect(f"file:{campaign}?mode=ro", uri=True) as file:
                    rows = file.execute("SELECT data FROM chunk WHERE stream = 0 ORDER BY rowid DESC LIMIT 1").fetchone()
                if rows and rows[0][TAXEL_PHASE] == ord("M"):  # phase of the chunk's first row
                    time.sleep(more_s)
                    return
            except sqlite3.Error:
                pass
        time.sleep(0.1)


class Moment(typing.NamedTuple):
    sliding: bool   # counted from the first rows of phase M, else from the start
    after_s: float


class Bench:
    def __init__(self, t, weft, folder, rig_path, console):
        self.t, self.weft, self.folder, self.rig_path, self.console = t, weft, folder, rig_path, console
        self.peak_n = 0.0
        self.coasts, self.lacks = [], []

    def start(self, name):
        return subprocess.Popen([self.weft, "run", "kill.json", "--rig", str(self.rig_path), "--out", name,
                                 "--no-evaluate"], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def begun(self, name, moment):
        """A run that has got to the moment, its console's watch, and where it records."""
        for attempt in range(ATTEMPTS):
            watch = Watch(self.console)
            process = self.start(f"{name}_{attempt}")
            campaign = self.folder / f"{name}_{attempt}" / "campaign.sqlite"
            watch.start()
            if moment.sliding:
                wait_for_slide(campaign, process, moment.after_s)
            else:
                time.sleep(moment.after_s)
            if process.poll() is None:
                return process, watch, campaign, ""
            said = process.stdout.read().decode(errors="replace")
            if not self.excused(watch, said, attempt):
                return process, watch, campaign, said
            watch.finish()
            self.under_cap(watch, f"{name}, attempt {attempt + 1}")
        raise AssertionError("the last attempt returns")

    def excused(self, watch, said, attempt):
        """Not where a link is wedged by the kill before: only where weft-rig as a whole was kept from the processor."""
        return watch.stood_still_s() > STOOD_STILL_S and kept_waiting(said, attempt)

    def under_cap(self, watch, what):
        self.t.expect(watch.peak_n() < FORCE_CAP_N, f"{what}: {watch.peak_n():.2f} N")
        self.peak_n = max(self.peak_n, watch.peak_n())

    def complete(self, name):
        """A run to its end."""
        for attempt in range(ATTEMPTS):
            watch = Watch(self.console)
            watch.start()
            run = self.start(f"{name}{attempt}")
            said = run.communicate(timeout=4 * LATEST_S)[0].decode(errors="replace")
            watch.finish()
            self.under_cap(watch, name)
            if run.returncode == 0 or not self.excused(watch, said, attempt):
                break
        self.t.expect(run.returncode == 0, f"the run after the last kill: {run.returncode} {said[-500:]}")

    def lose(self, number, moment, how):
        name, what = f"kill{number}", f"kill {number} ({how.name}, {moment.after_s:.2f} s after {'phase M began' if moment.sliding else 'the start'})"
        process, watch, campaign, said = self.begun(name, moment)
        if said or process.poll() is not None:
            self.t.expect(False, f"{what}: it had ended before, with {process.returncode}: {said[-500:]}")
        killed = time.time()
        process.send_signal(how)
        process.wait(30)
        ended = time.time()
        time.sleep(2 * STOPPED_WITHIN_S)
        watch.finish()
        if how is signal.SIGSTOP:
            self.t.expect(ended - killed < HUNG_ENDED_WITHIN_S, f"{what}: the monitor took {ended - killed:.2f} s")
        coast = watch.last_motion() - ended
        self.t.expect(coast < STOPPED_WITHIN_S, f"{what}: the stages went on for {coast:.2f} s")
        self.under_cap(watch, what)
        self.coasts.append(max(0.0, coast))
        lacks = self.lacking(campaign, killed)
        if lacks is not None:
            self.lacks.append(lacks)
            self.t.expect(lacks < LACKS_AT_MOST_S, f"{what}: {lacks:.3f} s are missing")
        self.t.expect(not moment.sliding or lacks is not None, f"{what}: it was recording")
        print(f"SIMULATED {what}: peak {watch.peak_n():.2f} N, stages stopped {max(0.0, coast):.2f} s after, "
              f"{'not recording' if lacks is None else f'{1e3 * lacks:.0f} ms lacking'}", flush=True)

    def lacking(self, campaign, killed):
        """Seconds between the newest row and the kill; None when nothing was being recorded."""
        if not campaign.exists() or not phase_under_way(campaign):
            return None
        newest = newest_row(campaign)
        return None if newest is None else killed - newest


def main():
    weft, weft_rig, root = str(pathlib.Path(sys.argv[1]).resolve()), sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    kills = int(sys.argv[4]) if len(sys.argv) > 4 else 2
    moments = random.Random(int(sys.argv[5]) if len(sys.argv) > 5 else 5)
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        recipe(root, folder)
        path, rig = rig_file(root, folder)
        near_home(path, rig)
        with ServedRig(weft_rig, path, rig, seed=3):
            bench = Bench(t, weft, folder, path, rig["simulation"]["console"])
            bench.lose(1, Moment(True, 1), signal.SIGKILL)
            bench.lose(2, Moment(True, 1), signal.SIGSTOP)
            for number in range(3, kills + 1):  # half of them from the start on, half from the slide on to the end
                moment = Moment(number % 2 == 0, moments.uniform(0, LONGEST_IN_SLIDE_S if number % 2 == 0 else LATEST_S - 15))
                bench.lose(number, moment, signal.SIGSTOP if moments.random() < 0.25 else signal.SIGKILL)
            bench.complete("last")
    print(f"SIMULATED {kills} kills: peak force {bench.peak_n:.2f} N of {FORCE_CAP_N:g} N, longest coast "
          f"{max(bench.coasts):.2f} s, recording lacks at most "
          f"{1e3 * max(bench.lacks, default=0):.0f} ms ({len(bench.lacks)} of them while recording)")
    t.finish()


if __name__ == "__main__":
    main()
