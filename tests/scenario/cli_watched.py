#!/usr/bin/env python3
"""The daemon inside `weft run`: a client can watch, pause, resume, stop and halt its campaign. It accepts no other run, and without a socket the
campaign still runs. All simulated.

    cli_watched.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time

from cli_support import Checks, line_has
from weftd_support import PATIENCE_S, Client

ROOT = pathlib.Path(sys.argv[2]).resolve()
RIG = ROOT / "sim/rigs/bench17.json"


def written(d, name, fabrics, repetitions):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    del recipe["$schema"]
    recipe["fabrics"], recipe["repetitions"] = fabrics, repetitions
    (d / name).write_text(json.dumps(recipe))
    return name


def start(t, d, recipe, out, *more):
    """A campaign in progress, and a client of its daemon."""
    process = subprocess.Popen([t.weft, "run", recipe, "--rig", str(RIG), "--out", out, "--no-error-check", "--json", *more], cwd=d,
                               text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    end = time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < end:
        try:
            return process, Client(d / out / "weftd.sock")
        except (FileNotFoundError, ConnectionRefusedError, ConnectionResetError):
            time.sleep(0.01)
    process.kill()
    raise SystemExit(f"no daemon inside the run: {process.communicate()}")


def under_way(client):
    """Its run, after it started to move."""
    client.call("sub.open", topics=["run:*"], mode="every")
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        runs = client.call("run.list")["runs"]
        if runs and runs[0]["state"] == "running" and runs[0]["trials_done"] >= 2:
            return runs[0]
        time.sleep(0.005)
    raise SystemExit(f"the run did not get to its third trial: {runs}")


def ended(t, process, what):
    out, err = process.communicate(timeout=PATIENCE_S)
    try:
        return json.loads(out), err, process.returncode
    except ValueError:
        t.expect(False, f"{what}: status {process.returncode}, printed '{out[:300]}', {err}")
        raise SystemExit(1) from None


def orders_of(folder):
    """The orders in the campaign's own journal, with their users."""
    database = sqlite3.connect(f"file:{folder}/campaign.sqlite?mode=ro", uri=True)
    try:
        return [json.loads(payload) for payload, in database.execute("SELECT payload_json FROM journal WHERE kind = 'order' ORDER BY sequence")]
    finally:
        database.close()


def facts(summary):
    return {key: summary[key] for key in ("outcome", "cleanup", "rig", "trials_complete")}


def held_and_stopped(t, d, recipe):
    process, client = start(t, d, recipe, "stopped")
    run = under_way(client)
    name = run["run"]
    t.expect(run["folder"] == str(d / "stopped") and run["submitted_by"] == "weft run", f"its folder: {run}")
    status = json.loads(t.run("status", "--socket", d / "stopped/weftd.sock", "--json", cwd=d).stdout)
    t.expect(name in json.dumps(status), f"weft status shows it: {status}")
    ran = t.run("pause", "--socket", d / "stopped/weftd.sock", cwd=d)
    t.expect(ran.returncode == 0, f"weft pause: {ran.stderr}")
    client.until(name, "held")
    before = client.call("run.get", run=name)["trials_done"]
    time.sleep(0.3)
    t.expect(client.call("run.get", run=name)["trials_done"] == before, "it is held: no trial more")
    lease = client.call("lease.acquire", scope="rig:bench17")["lease"]
    # The daemon inside `weft run` refuses by its kind, not by its state.
    refusals = [client.refused("run.start", recipe="recipe", lease=lease, idem="one-more-please"), client.refused("token.add", name="x", role="observer"),
                client.refused("recipe.put", recipe="other", content={})]
    t.expect(not list((d / "stopped").glob("tokens.json*")), "no file of tokens in the campaign's folder")
    t.expect(all(one["data"]["kind"] == "state.conflict" and "weft run" in one["message"] for one in refusals), f"run, token, recipe: {refusals}")
    t.expect(len({one["message"] for one in refusals}) == 3, f"each refusal has its reason: {refusals}")
    client.call("lease.release", lease=lease)
    ran = t.run("resume", "--socket", d / "stopped/weftd.sock", cwd=d)
    t.expect(ran.returncode == 0, f"weft resume: {ran.stderr}")
    client.until(name, "running")
    ran = t.run("stop", "--socket", d / "stopped/weftd.sock", cwd=d)
    t.expect(ran.returncode == 0, f"weft stop: {ran.stderr}")
    client.until(name, "ended")
    summary, err, status = ended(t, process, "stopped")
    t.expect(status == 1 and summary["outcome"] == "stopped" and summary["cleanup"] == "done", f"{status} {facts(summary)}")
    t.expect(before <= summary["trials_complete"] < summary["trials_planned"], f"what was done is kept: {summary}")
    t.expect((d / "stopped/report.html").exists(), f"reported on what there is: {err}")
    t.expect(not (d / "stopped/weftd.sock").exists(), "its socket goes with it")
    orders = orders_of(d / "stopped")
    t.expect([each["order"] for each in orders] == ["pause", "resume", "stop"], f"the campaign's own journal has what was ordered: {orders}")
    t.expect(all(each["by"].startswith("s-") and "(" in each["by"] for each in orders), f"and who did: {orders}")
    info = t.succeeds("verify", "stopped", cwd=d)
    t.expect(info["holds"] and info["certified"], f"verify: {info}")


def halted(t, d, recipe):
    process, client = start(t, d, recipe, "halted")
    under_way(client)
    client.send("!halt")
    summary, _, status = ended(t, process, "halted")
    t.expect(status == 1 and summary["outcome"] == "aborted" and summary["rig"] == "holding", f"{status} {facts(summary)}")


def by_signal_while_held(t, d, recipe):
    process, client = start(t, d, recipe, "signalled")
    name = under_way(client)["run"]
    client.call("run.pause", run=name)
    client.until(name, "held")
    process.send_signal(signal.SIGTERM)
    summary, err, status = ended(t, process, "signalled")
    t.expect(status == 128 + signal.SIGTERM and line_has(err, [str(int(signal.SIGTERM)), "signalled/campaign.sqlite"]), f"{status} {err}")
    t.expect(summary["outcome"] == "aborted" and summary["rig"] == "safe", f"{summary}")


def waited_for_the_end(t, d, recipe):
    """A waiting client learns how the run ended, and the data equal those of a run without clients."""
    process, client = start(t, d, recipe, "watched")
    answer = {}
    name = client.call("run.list")["runs"][0]["run"]
    waiting = threading.Thread(target=lambda: answer.update(client.call("run.wait", run=name)))
    waiting.start()
    summary, err, status = ended(t, process, "watched")
    waiting.join(PATIENCE_S)
    t.expect(status == 0 and summary["outcome"] == "complete", f"{status} {summary} {err}")
    t.expect(answer.get("state") == "ended" and answer.get("dataset_sha256") == summary["dataset_sha256"], f"answer: {answer}")
    return summary["dataset_sha256"]


def without_a_socket(t, d, recipe, digest):
    for out, socket in (("long", d / ("x" * 120)), ("taken", d / recipe)):
        ran = t.run("run", recipe, "--rig", RIG, "--out", out, "--no-error-check", "--socket", socket, "--json", cwd=d)
        t.expect(ran.returncode == 0 and line_has(ran.stderr, ["weft", str(socket)]), f"{out}: {ran.stderr}")
        t.expect(json.loads(ran.stdout)["dataset_sha256"] == digest, f"{out}: the same data")
    t.expect(json.loads((d / recipe).read_text())["repetitions"] > 0, "what was in the way is left alone")


def refused_leaves_nothing(t, d, recipe):
    """If a bench fails to start, no folder remains that has only a socket."""
    rig = json.loads(RIG.read_text())
    rig["simulation"].update(fabrics=str(ROOT / "sim/fabrics.json"), fidelity=str(ROOT / "sim/fidelity.json"), faults=[{"device": "stage.z", "fault": "never_homes"}])
    (d / "dead.json").write_text(json.dumps(rig))
    ran = t.run("run", recipe, "--rig", d / "dead.json", "--out", "dead/of/old", cwd=d)
    t.expect(ran.returncode == 1 and "stage.z" in ran.stderr and "simulation/faults" not in ran.stderr, f"it comes to the bench: {ran.stderr}")
    t.expect(not (d / "dead").exists(), f"{ran.returncode}: {ran.stderr}; {list((d / 'dead').rglob('*'))}")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-watched-") as folder:
        d = pathlib.Path(folder)
        long = written(d, "recipe.json", ["denim", "satin", "fleece"], 200)
        short = written(d, "short.json", ["denim", "satin"], 20)
        held_and_stopped(t, d, long)
        halted(t, d, long)
        by_signal_while_held(t, d, long)
        digest = waited_for_the_end(t, d, short)
        without_a_socket(t, d, short, digest)
        refused_leaves_nothing(t, d, short)
    t.finish()


main()
