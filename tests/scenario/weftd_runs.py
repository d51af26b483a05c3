#!/usr/bin/env python3
"""A whole session of weftd on the simulated bench, over its socket, with Python's standard library only.

    weftd_runs.py WEFTD WEFT SOURCE_ROOT

Greeting, session.open, refusals, a lease; a campaign that is started, watched, paused, resumed and ended; a second one in the queue; halt from an
unauthenticated connection and reset; tokens on TCP; kill -9 and the report of the next start. All simulated.
"""
import hashlib
import json
import os
import pathlib
import re
import signal
import sqlite3
import subprocess
import sys
import tempfile

from cli_support import error_of, fits, has, line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def small_recipe(folder):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe["fabrics"], recipe["repetitions"] = ["denim", "satin"], 20
    (folder / "recipes").mkdir()
    (folder / "recipes" / "small.json").write_text(json.dumps(recipe))
    return 40


def introductions(daemon):
    stranger = Client(daemon.socket, introduce=False)
    assert stranger.refused("system.info")["data"]["kind"] == "session.required"
    assert stranger.refused("session.open", client="x", protocol="9.0")["data"]["kind"] == "protocol.version"
    client = Client(daemon.socket)
    assert client.session["role"] == "admin" and client.session["ready"]["ok"], client.session
    assert client.refused("system.inof")["data"]["hint"].find("system.info") >= 0
    wrong = client.refused("run.list", stat="ended")
    assert wrong["data"]["kind"] == "param.unknown" and "state" in wrong["data"]["hint"], wrong
    client.send("not json")
    assert client.read()["error"]["code"] == -32700
    methods = {m["name"] for m in client.call("rpc.discover")["methods"]}
    assert {"run.start", "lease.acquire", "sub.open", "rig.halt"} <= methods, methods
    assert "explorations" in client.call("recipe.schema")["properties"]
    return client


def checks(client, trials):
    assert client.call("recipe.list")["recipes"] == ["small"]
    report = client.call("recipe.check", recipe="small")
    assert report["ok"] and report["plan"]["trials"] == trials and report["disk_ok"], report
    height = report["plan"]["envelope"]["z"]
    assert height["min_m"] < height["max_m"] and height["margin_m"] > 0 and report["plan"]["force_max_n"] == 5, report
    assert has(client.refused("recipe.check", recipe="smal")["data"]["hint"], "small?")
    for path in ("../small", "/etc/passwd", ".hidden", ""):
        assert client.refused("recipe.check", recipe=path)["data"]["kind"] == "request.invalid"


def template(folder):
    """`small` with two parameters; with n=20 it is the same campaign."""
    recipe = json.loads((folder / "recipes/small.json").read_text())
    recipe["parameters"] = {"force_N": {"type": "number", "unit": "N", "min": 1, "max": 8, "default": 5},
                            "n": {"type": "integer", "min": 1, "max": 20}}
    recipe["repetitions"] = {"parameter": "n"}
    for phase in recipe["explorations"]["M1"]["phases"]:
        if "force_N" in phase:
            phase["force_N"] = {"parameter": "force_N"}
    (folder / "recipes/bound.json").write_text(json.dumps(recipe))
    return recipe


def bound(folder, client):
    """Parameters are bound by the request; the resolved recipe is checked, started by its digest, recorded and verified."""
    recipe = template(folder)
    assert client.call("recipe.list")["parameters"] == {"bound": recipe["parameters"]}
    unbound = client.call("recipe.check", recipe="bound")
    assert not unbound["ok"] and [p["where"] for p in unbound["problems"]] == ["/parameters/n"], unbound
    values = {"n": 1, "force_N": 3}
    checked = client.call("recipe.check", recipe="bound", parameters=values)
    assert checked["ok"] and checked["parameters"] == recipe["parameters"], checked
    assert (checked["plan"]["trials"], checked["plan"]["force_max_n"]) == (2, 3), checked
    written = "sha256:" + hashlib.sha256((folder / "recipes/bound.json").read_bytes()).hexdigest()
    assert checked["file_digest"] == written != checked["digest"], checked
    assert client.call("recipe.plan", recipe="bound", parameters=values)["digest"] == checked["digest"]
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    for method in "run.start", "queue.add":
        for wrong, where in ({"n": 1, "forse_N": 3}, "forse_N"), ({"n": "1"}, "n"), ({"n": 21}, "n"), ({}, "n"), ({"n": 1, "force_N": 9}, "force_N"):
            error = client.refused(method, recipe="bound", lease=lease, parameters=wrong)["data"]
            assert error["where"].endswith(f": /parameters/{where}") and error["expected"], (wrong, error)
    assert client.refused("run.start", recipe="small", lease=lease, parameters=values)["data"]["kind"] == "request.invalid"
    other = client.refused("run.start", recipe="bound", lease=lease, parameters=values, digest=written)["data"]
    assert (other["where"], other["expected"]) == ("/params/digest", checked["digest"]), other
    wanted = {"recipe": "bound", "lease": lease, "parameters": values, "digest": checked["digest"], "idem": "bound"}
    run = client.call("run.start", **wanted)["run"]
    assert client.refused("run.start", **{**wanted, "parameters": {"n": 1}})["data"]["kind"] == "idem.reused"
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["trials_done"]) == ("complete", 2), ended
    client.call("lease.release", lease=lease)
    database = sqlite3.connect(f"file:{ended['folder']}/campaign.sqlite?mode=ro", uri=True)
    text, digest = database.execute("SELECT recipe_json, recipe_sha256 FROM campaign").fetchone()
    database.close()
    recorded = json.loads(text)
    assert "sha256:" + digest == checked["digest"] == "sha256:" + hashlib.sha256(text.encode()).hexdigest()
    assert (recorded["repetitions"], recorded["bound_parameters"], "parameters" in recorded) == (1, values, False), recorded
    assert client.call("recipe.plan", recipe=run)["digest"] == checked["digest"]
    subprocess.run([WEFT, "verify", ended["folder"]], check=True, capture_output=True)


def a_run(client, trials):
    assert client.refused("run.start", recipe="small", lease="L-99")["data"]["kind"] == "lease.required"
    lease = client.call("lease.acquire", note="test", ttl_ms=600_000)["lease"]
    sub = client.call("sub.open", topics=["run:*"], mode="every")
    first = client.call("run.start", recipe="small", lease=lease, name="first", idem="k-1")
    again = client.call("run.start", recipe="small", lease=lease, name="first", idem="k-1")
    assert again["run"] == first["run"], "done twice"
    assert client.refused("run.start", recipe="small", lease=lease, name="other", idem="k-1")["data"]["kind"] == "idem.reused"
    run = first["run"]
    client.until(run, "running")
    assert client.call("run.pause", run=run, at="now")["state"] == "pausing"
    client.until(run, "held")
    assert client.call("rig.state")["run"] == run
    assert re.findall(r"\w+", client.refused("run.pause", run=run)["data"]["expected"]) == ["resume", "stop", "abort", "halt"]
    second = client.call("run.start", recipe="small", lease=lease, name="second")
    assert second["state"] == "queued", second
    client.call("run.withdraw", run=second["run"])
    client.call("run.resume", run=run)
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["cleanup"], ended["rig"]) == ("complete", "done", "safe"), ended
    assert ended["trials_done"] == trials and len(ended["dataset_sha256"]) == 64, ended
    assert client.refused("run.stop", run=run)["data"]["kind"] == "state.conflict"
    client.call("sub.close", sub=sub["sub"])
    client.call("lease.release", lease=lease)
    info = subprocess.run([WEFT, "--json", "dataset", "info", str(pathlib.Path(ended["folder"]) / "dataset.h5")],
                          check=True, capture_output=True, text=True)
    assert json.loads(info.stdout)["trials"] == trials, info.stdout
    kinds = [line["kind"] for line in client.call("log.tail", run=run)["lines"]]
    assert kinds[0] == "submitted" and "state" in kinds, kinds
    return ended


def halts(daemon, client):
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    client.call("sub.open", topics=["run:*", "rig"], mode="every")
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    client.until(run, "running")
    queued = client.call("run.start", recipe="small", lease=lease)["run"]
    stranger = Client(daemon.socket, introduce=False)
    stranger.send("!halt")
    assert stranger.read()["params"]["delta"]["latched"] == "halt"
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["cleanup"]) == ("aborted", "skipped"), ended
    assert client.call("rig.state")["rig"] == "latched"
    assert [b["kind"] for b in client.call("system.ready")["blockers"]] == ["rig.latched", "queue.paused"]
    assert client.call("run.get", run=queued)["state"] == "queued", "no run begins on a latched rig"
    client.call("run.withdraw", run=queued)
    assert client.refused("rig.reset", reason="")["data"]["kind"] == "request.invalid"
    reset = client.call("rig.reset", reason="looked at the probe")
    assert (reset["rig"], reset["fact"], reset["left_by"], reset["acknowledged"]) == ("holding", "holding", run, True), reset
    client.call("rig.halt")
    client.call("rig.reset", reason="looked once more")
    assert client.call("system.ready")["ok"]
    states = [(e["delta"]["rig"], e["delta"]["fact"], e["delta"]["acknowledged"]) for e in client.events if e["topic"] == "rig"]
    left = ("holding", "holding", True)
    assert states == [("latched", "safe", None), ("latched", "holding", False), left, ("latched", "holding", True), left], states
    client.call("lease.release", lease=lease)


def tokens(folder, daemon, token):
    at = ("127.0.0.1", daemon.port)
    client = Client(at, introduce=False)
    assert client.greeting["params"]["auth"] == ["token"]
    said = [client.refused("session.open", client="x"), client.refused("session.open", client="x", token="wft_" + 64 * "0")]
    assert all(s["data"]["kind"] == "access.token" for s in said), said
    client.send("!halt")
    assert client.read()["error"]["data"]["kind"] == "access.local_only"
    assert client.call("session.open", client="x", token=token)["role"] == "observer"
    assert client.refused("lease.acquire")["data"]["kind"] == "access.role"
    client.call("run.list")
    long = Client(at, introduce=False)
    long.wire.sendall(b"x" * (1 << 20) + b"yyyy")
    assert long.read()["error"]["data"]["kind"] == "request.too_long"
    assert not long.lines.readline(), "the connection stays after a line that is too long"
    assert token not in (folder / "data" / "tokens.json").read_text()


def slow_reader(daemon, client):
    """A subscriber to everything that never reads delays no other client; the gap in its events is then reported exactly."""
    slow, quick = Client(daemon.socket), Client(daemon.socket)
    for each in slow, quick:
        each.call("sub.open", topics=["lease:*"], mode="every")
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    assert quick.event()["delta"]["acquired"]["lease"] == lease
    many = 8000  # more than its limit and all buffers of a socket hold
    for _ in range(many):
        client.call("lease.renew", lease=lease)
        event = quick.event()
        assert event["delta"]["renewed"]["lease"] == lease and event["dropped"] == 0, event
    client.call("lease.release", lease=lease)
    told = dropped = 0
    event = {"delta": {}}
    while not event["delta"].get("released"):
        event = slow.event()
        told, dropped = told + 1, dropped + event["dropped"]
    assert dropped > 0 and told + dropped == many + 2, (told, dropped)
    for each in slow, quick:
        each.wire.close()


def reference(folder):
    """The same campaign by `weft run`."""
    subprocess.run([WEFT, "run", folder / "recipes" / "small.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", folder / "undisturbed",
                    "--no-evaluate", "--no-error-check"], check=True, capture_output=True, timeout=PATIENCE_S)
    return contents_of(folder / "undisturbed")


def death(folder, client, daemon):
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    client.call("sub.open", topics=["run:*"], mode="every")
    run = client.call("run.start", recipe="bound", lease=lease, parameters={"n": 20})["run"]
    client.until(run, "running")
    daemon.end(signal.SIGKILL)
    distant = subprocess.run([WEFTD, "--rig", ROOT / "sim/rigs/bench17.json", "--recipes", folder / "recipes", "--data",
                              folder / "elsewhere", "--socket", "/" + "x" * 200], capture_output=True, text=True)
    assert distant.returncode == 1 and "/" + "x" * 200 in distant.stderr, distant
    daemon = Daemon(WEFTD, ROOT, folder)
    other = subprocess.run([WEFTD, "--rig", ROOT / "sim/rigs/bench17.json", "--recipes", folder / "recipes", "--data", folder / "data"],
                           capture_output=True, text=True)
    assert other.returncode == 1 and line_has(other.stderr, ["weftd", str(folder / "data/weftd.sqlite")]), other
    client = Client(daemon.socket)
    found = client.call("run.get", run=run)
    assert (found["state"], found["outcome"], found["rig"]) == ("interrupted", "interrupted", "unknown"), found
    assert client.call("run.list", state="interrupted")["runs"][0]["run"] == run
    assert client.call("rig.state") == {"rig": "unknown", "fact": "unknown", "left_by": run, "acknowledged": False}
    assert [b["kind"] for b in client.call("system.ready")["blockers"]] == ["rig.unknown"]
    return daemon, client, run


def goes_on(client, run, trials, digest):
    """The preview reports the remaining trials before anything moves. Resuming needs a lease. The data equal those of an undisturbed run."""
    left = client.call("run.resume", run=run, preview=True)
    assert left["trials_left"] + left["trials_done"] == trials and any(has(step, f"trial {left['trials_done'] + 1}") for step in left["will"]), left
    assert client.call("run.get", run=run)["state"] == "interrupted"
    assert client.refused("run.resume", run=run)["data"]["kind"] == "lease.required"
    assert client.refused("run.pause", run=run)["data"]["kind"] == "state.conflict"
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    client.call("run.resume", run=run, lease=lease)
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["rig"], ended["trials_done"]) == ("complete", "safe", trials), ended
    assert client.refused("run.resume", run=run, preview=True)["data"]["kind"] == "state.conflict"
    client.call("lease.release", lease=lease)
    verified = subprocess.run([WEFT, "--json", "verify", ended["folder"]], capture_output=True, text=True)
    assert verified.returncode == 0 and json.loads(verified.stdout)["certified"], verified
    assert contents_of(ended["folder"]) == digest, "not the samples of the undisturbed run"


def contents_of(folder):
    """The samples of every complete trial, by stream, whatever the number of the attempt."""
    database = sqlite3.connect(f"file:{folder}/campaign.sqlite?mode=ro", uri=True)
    hash = hashlib.sha256()
    for (data,) in database.execute(
            "SELECT data FROM chunk JOIN trial ON trial.id = trial WHERE outcome = 'complete' "
            "ORDER BY plan_index, stream, number"):
        hash.update(data)
    database.close()
    return hash.hexdigest()


def told_runs(folder):
    """The runs that a temporary daemon reports."""
    daemon = Daemon(WEFTD, ROOT, folder)
    try:
        return Client(daemon.socket).call("run.list")["runs"]
    finally:
        assert daemon.end() == 0


def damaged_memory(folder):
    """Each page of the daemon's own database is damaged in turn: the daemon reports it and does not overwrite it; with the page restored all runs are
    back."""
    runs = told_runs(folder)
    assert runs
    file = folder / "data" / "weftd.sqlite"
    whole = file.read_bytes()
    spare = sqlite3.connect(f"file:{file}?mode=ro&immutable=1", uri=True)
    assert spare.execute("PRAGMA freelist_count").fetchone() == (0,), "a page that holds nothing is not missed"
    spare.close()
    assert len(whole) >= 8 * 4096
    for at in range(0, len(whole), 4096):
        file.write_bytes(whole[:at] + b"\xa5" * 4096 + whole[at + 4096:])
        bent = file.read_bytes()
        ran = subprocess.run([WEFTD, "--rig", ROOT / "sim/rigs/bench17.json", "--recipes", folder / "recipes", "--data",
                              folder / "data"], capture_output=True, text=True, timeout=PATIENCE_S)
        assert ran.returncode == 1 and "weftd.sqlite" in ran.stderr, (at, ran)
        assert file.read_bytes() == bent
    file.write_bytes(whole)
    assert told_runs(folder) == runs


def commands(folder, daemon):
    def weft(*words, status=0):
        done = subprocess.run([WEFT, *words, "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == status, (words, done)
        return done.stdout
    assert weft("status").startswith("ready\n")
    assert "small (shell)" in weft("start", "small", "--name", "shell", "--wait")
    assert "2 of 2" in weft("start", "bound", "--set", "n=1", "--set", "force_N=3", "--wait")
    for wrong in ["n=1", "n=2"], ["n=two"], ["m=1"]:
        refused = subprocess.run([WEFT, "start", "bound", *(w for each in wrong for w in ("--set", each)), "--socket", str(daemon.socket)],
                                 capture_output=True, text=True, timeout=PATIENCE_S)
        assert refused.returncode == 1 and f"/{wrong[0][0]}" in refused.stderr and not refused.stdout, refused
    waited = subprocess.run([WEFT, "start", "small", "--wait", "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
    run = waited.stdout.split()[0]
    assert line_has(waited.stdout, ["complete", "done", "safe"]) and f"weft watch {run}" in waited.stderr, waited
    lines = weft("watch", run, "--json").splitlines()
    assert lines and json.loads(lines[-1])["outcome"] == "complete", lines
    assert has(weft("halt"), "latched") and json.loads(weft("--json", "halt"))["rig"] == "latched"
    assert "rig.latched" in weft("status")

    def waits(way_out):
        behind = subprocess.run([WEFT, "start", "small", "--name", "behind", "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
        assert behind.returncode == 0 and "queued" in behind.stdout and way_out in behind.stderr, behind
        weft("queue", "remove", behind.stdout.split()[0])

    waits("weft reset")
    assert has(weft("reset", "by hand"), "safe")
    weft("queue", "pause")
    assert "weft queue start" in weft("status")
    waits("weft queue start")
    weft("queue", "start")
    assert re.search(r"(?m)^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} UTC  R-\d+  submitted", weft("log")), weft("log")
    for of_a_run in ("watch", "log", "pause"):
        command = [WEFT, of_a_run, "R-000099", "--socket", str(daemon.socket)]
        refused = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
        assert refused.returncode == 1 and "R-000099" in refused.stderr and not refused.stdout, refused
        refused = subprocess.run([*command, "--json"], capture_output=True, text=True, timeout=PATIENCE_S)
        assert refused.returncode == 1 and fits(error_of(refused), where="/params/run", got="R-000099"), refused
    weft("pause", status=1)


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        trials = small_recipe(folder)
        token = token_of(WEFT, folder / "tokens.json", "viewer", "observer")
        (folder / "data").mkdir()
        os.rename(folder / "tokens.json", folder / "data" / "tokens.json")
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
        try:
            client = introductions(daemon)
            checks(client, trials)
            a_run(client, trials)
            bound(folder, client)
            halts(daemon, client)
            tokens(folder, daemon, token)
            slow_reader(daemon, client)
            undisturbed = reference(folder)
            daemon, client, run = death(folder, client, daemon)
            goes_on(client, run, trials, undisturbed)
            commands(folder, daemon)
            assert daemon.end() == 0
            damaged_memory(folder)
            assert not daemon.socket.exists()
        finally:
            daemon.process.kill()
    print("weftd: all of it held (simulated)")


main()
