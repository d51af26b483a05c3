#!/usr/bin/env python3
"""Files locked by other programs, and file systems without some function (cases/bench, rows 5 and 6), on the simulated bench. A locked data set is
reported as in use and never damaged. A campaign and `weft verify` wait for a locked campaign file and name the holder.

    files_in_use.py WEFT SOURCE_ROOT POOR_DISK_LIBRARY
"""
import contextlib
import fcntl
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, error_of, has, line_has

HELD_S = 8.0       # as in the case; the recording waits up to 30 s


@contextlib.contextmanager
def flocked(path):
    with open(path, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def dataset_in_use(t, d):
    before = (d / "out/dataset.h5").read_bytes()
    with flocked(d / "out/dataset.h5"):
        for command in (("verify", "out"), ("verify", "out/dataset.h5"), ("dataset", "info", "out/dataset.h5"),
                        ("fabric", "evaluate", "out/dataset.h5", "--learner", "lda"), ("fabric", "features", "out/dataset.h5", "--output", "f.csv")):
            ran = t.run(*command, "--json", cwd=d)
            error = error_of(ran)
            t.expect(ran.returncode == 1 and error["code"] == "busy", f"{command}: {ran.returncode} {ran.stdout} {ran.stderr}")
            t.expect(has(error["got"], str(os.getpid())), f"{command}: who holds it: {error}")
            t.expect("xport" not in error["hint"] and not (d / "f.csv").exists(), f"{command}: {error}")
    t.expect((d / "out/dataset.h5").read_bytes() == before, "the data set was touched")
    t.expect(t.run("verify", "out", cwd=d).returncode == 0, "the data set afterwards")


def campaign_in_use(t, d):
    """A finished campaign file with an exclusive lock."""
    with contextlib.closing(sqlite3.connect(d / "out/campaign.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        ran = t.run("verify", "out", "--json", cwd=d)
        t.expect(ran.returncode == 1 and error_of(ran)["code"] == "busy" and has(error_of(ran)["got"], str(os.getpid())),
                 f"verify: {ran.returncode} {ran.stdout}")
        other.execute("ROLLBACK")
    t.expect(t.run("verify", "out", cwd=d).returncode == 0, "the campaign afterwards")


def lock_while_running(t, d, root, held_s):
    """The finished `weft run`; another program held the write lock for `held_s` seconds during the run."""
    out = f"held{int(held_s)}"
    run = subprocess.Popen([t.weft, "run", root / "recipes/library/khan2016.json", "--rig", root / "sim/rigs/bench17.json", "--out", out,
                            "--no-evaluate", "--no-error-check", "--json"], cwd=d, stdout=subprocess.PIPE,
                           stderr=subprocess.PIPE, text=True)
    file = d / out / "campaign.sqlite"
    end = time.time() + 60
    rows = 0
    while rows < 2 and time.time() < end and run.poll() is None:
        with contextlib.suppress(sqlite3.Error), contextlib.closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True, timeout=0.1)) as reader:
            (rows,) = reader.execute("SELECT count(*) FROM trial").fetchone()
        time.sleep(0.01)
    with contextlib.closing(sqlite3.connect(file, timeout=10, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        was_running = run.poll() is None
        with contextlib.suppress(subprocess.TimeoutExpired):
            run.wait(held_s)
        t.expect(not was_running or run.poll() is None or held_s > 30, f"the run ended while its file was locked: {run.poll()}")
        other.execute("ROLLBACK")
    said = run.communicate(timeout=300)
    t.expect(was_running, "the campaign was over before its file was locked")
    return subprocess.CompletedProcess([], run.returncode, *said)


def recording_waits(t, d, root):
    ran = lock_while_running(t, d, root, HELD_S)
    t.expect(ran.returncode == 0, f"a file held for {HELD_S} s: {ran.returncode} {ran.stderr[-800:]}")
    t.expect(line_has(ran.stderr, ["campaign.sqlite", str(os.getpid())]), f"the holder's name: {ran.stderr[-800:]}")
    t.expect(t.run("verify", f"held{int(HELD_S)}", cwd=d).returncode == 0, "the campaign afterwards")


def poor_disk(t, d, root, library):
    """Missing functions of the file system are found before anything is recorded."""
    for lacks in ("flock", "fcntl", "mmap", "fsync_folder"):
        ran = subprocess.run([t.weft, "run", root / "recipes/library/first.json", "--rig", root / "sim/rigs/bench17.json", "--out", lacks,
                              "--no-evaluate", "--json"], cwd=d, capture_output=True, text=True, timeout=300,
                             env={**os.environ, "LD_PRELOAD": library, "POOR_DISK": lacks})
        t.expect(ran.returncode == 1 and error_of(ran)["code"] == "unsupported", f"no {lacks}: {ran.returncode} {ran.stdout} {ran.stderr}")
        left = [file.name for file in (d / lacks).glob("*")]
        t.expect(left == [], f"no {lacks}: left {left}")


def main():
    weft, root = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        ran = t.run("run", root / "recipes/library/first.json", "--rig", root / "sim/rigs/bench17.json", "--out", "out", "--no-evaluate", cwd=d)
        t.expect(ran.returncode == 0, f"a campaign: {ran.returncode} {ran.stderr}")
        dataset_in_use(t, d)
        campaign_in_use(t, d)
        recording_waits(t, d, root)
        poor_disk(t, d, root, sys.argv[3])
    t.finish()


if __name__ == "__main__":
    main()
