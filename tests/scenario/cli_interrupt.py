#!/usr/bin/env python3
"""Signals to `weft run`: the first ends it in an orderly way, the second at once, and the file is readable after both.

    cli_interrupt.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, line_has

PATIENCE_S = 120
LONG_S = 200  # duration of phase S in bench time; takes some tenths of a second here


def trials(campaign, outcome):
    """Number of trials with this outcome in the present file."""
    database = sqlite3.connect(f"file:{campaign}?mode=ro", uri=True)
    try:
        return database.execute("SELECT count(*) FROM trial WHERE outcome IS ?", (outcome,)).fetchone()[0]
    finally:
        database.close()


def let_signals_through():
    """Restores the default signals, also if this test was started in the background or by nohup."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def start(t, d, rig, out):
    """A long campaign with two complete trials and one just begun. The rest takes far longer than reading the file and sending a signal."""
    process = subprocess.Popen(
        [t.weft, "run", "recipe.json", "--rig", str(rig), "--out", out, "--json"], cwd=d, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=let_signals_through)
    campaign, end, before = d / out / "campaign.sqlite", time.monotonic() + PATIENCE_S, 0
    while process.poll() is None and time.monotonic() < end:
        try:
            if campaign.exists() and trials(campaign, None) == 1:
                done = trials(campaign, "complete")
                if done >= 2 and done > before:
                    return process, campaign
                before = done
        except sqlite3.OperationalError:
            pass  # not all tables exist yet
        time.sleep(0.005)
    process.kill()
    raise SystemExit(f"the run did not get to its third trial: {process.communicate()}")


def stopped_tidily(t, d, rig, number):
    process, campaign = start(t, d, rig, out=f"by{number}")
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE_S)
    t.expect(process.returncode == 128 + number, f"signal {number}: status {process.returncode}: {err}")
    summary = json.loads(out)
    done = summary["trials_complete"]
    t.expect(2 <= done < summary["trials_planned"] and summary["outcome"] == "aborted", f"signal {number}: {summary}")
    t.expect(line_has(err, [str(number), str(done), str(summary["trials_planned"]), f"by{number}/campaign.sqlite"]), f"message: {err}")
    t.expect(trials(campaign, "complete") == done, "complete trials in the campaign file")
    t.expect(trials(campaign, "aborted") == 1 and trials(campaign, None) == 0, "the trial under way was ended as aborted")
    info = t.succeeds("dataset", "info", f"by{number}/dataset.h5", cwd=d)
    t.expect(info["trials"] == done and info["dataset_sha256"] == summary["dataset_sha256"], f"info: {info}")
    t.expect(not (d / f"by{number}/report.json").exists(), "an interrupted campaign is not evaluated")


def sent_at_once(process, *signals):
    """Its output on standard error until it ends."""
    process.send_signal(signal.SIGSTOP)  # so that all signals are pending together
    for number in signals:
        process.send_signal(number)
    process.send_signal(signal.SIGCONT)
    return process.communicate(timeout=PATIENCE_S)[1]


def hung_up_and_ended(t, d, rig):
    """The end of a session sends both signals; neither counts as a second Ctrl-C."""
    process, campaign = start(t, d, rig, out="both")
    err = sent_at_once(process, signal.SIGTERM, signal.SIGHUP)
    t.expect(process.returncode == 128 + signal.SIGTERM, f"it ended tidily: {process.returncode}: {err}")
    t.expect(trials(campaign, "aborted") == 1 and trials(campaign, None) == 0, "the trial under way was ended as aborted")


def stopped_at_once(t, d, rig):
    process, campaign = start(t, d, rig, out="twice")
    err = sent_at_once(process, signal.SIGINT, signal.SIGTERM)
    # Either may count as the second, because two threads may take one each at the same time.
    t.expect(process.returncode in (-signal.SIGTERM, -signal.SIGINT), f"the second signal ends it: {process.returncode}: {err}")
    database = sqlite3.connect(campaign)
    t.expect(database.execute("PRAGMA integrity_check").fetchone() == ("ok",), "the file is whole")
    database.close()
    t.expect(trials(campaign, "complete") >= 2, "complete trials are kept")


def without_a_reader(t, d, rig):
    """`weft run ... | head -1`: the campaign continues to its end."""
    recipe = json.loads((d / "recipe.json").read_text())
    recipe.update(fabrics=recipe["fabrics"][:2], repetitions=2)
    (d / "few.json").write_text(json.dumps(recipe))
    process = subprocess.Popen([t.weft, "run", "few.json", "--rig", str(rig), "--out", "unread", "--no-evaluate"], cwd=d,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    process.stdout.readline()
    process.stdout.close()
    status = process.wait(timeout=PATIENCE_S)
    t.expect(status != -signal.SIGPIPE, "ended by SIGPIPE")
    found = t.succeeds("verify", "unread", cwd=d)
    t.expect(found["certified"] and found["trials_complete"] == found["trials_planned"], f"unread: {found}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    with tempfile.TemporaryDirectory(prefix="weft-interrupt-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((root / "recipes/library/khan2016.json").read_text())
        del recipe["$schema"]
        for exploration in recipe["explorations"].values():
            exploration["phases"][0]["duration_s"] = LONG_S
        (d / "recipe.json").write_text(json.dumps(recipe))
        stopped_tidily(t, d, rig, signal.SIGINT.value)
        stopped_tidily(t, d, rig, signal.SIGTERM.value)
        stopped_tidily(t, d, rig, signal.SIGHUP.value)  # the terminal was closed
        hung_up_and_ended(t, d, rig)
        stopped_at_once(t, d, rig)
        without_a_reader(t, d, rig)
    t.finish()


main()
