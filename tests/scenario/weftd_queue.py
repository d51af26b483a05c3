#!/usr/bin/env python3
"""The queue of weftd and the recovery of interrupted runs, over its socket.

    weftd_queue.py WEFTD WEFT SOURCE_ROOT

Runs are added to the queue, moved, paused and started with its revision, also over a restart. One interrupted run is discarded, another is kept with
its complete trials. The commands of weft for both. All simulated.
"""
import json
import pathlib
import signal
import subprocess
import sys
import tempfile

from cli_support import error_of, fits, has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def write_recipes(folder):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe.pop("$schema")
    (folder / "recipes").mkdir()
    for name, fabrics, repetitions in ("short", ["denim"], 1), ("long", ["denim", "satin"], 20):
        recipe.update(fabrics=fabrics, repetitions=repetitions)
        (folder / "recipes" / f"{name}.json").write_text(json.dumps(recipe))


def weft(daemon, *words, status=0):
    done = subprocess.run([WEFT, *words, *(["--socket", str(daemon.socket)] if daemon else [])], capture_output=True, text=True,
                          timeout=PATIENCE_S)
    assert done.returncode == status, (words, done)
    return done.stdout if status == 0 else done.stderr


def waiting(queue):
    return [run["run"] for run in queue["runs"]]


def a_queue(client, daemon, token):
    lease = client.call("lease.acquire")["lease"]
    client.call("sub.open", topics=["queue"], mode="every")
    empty = client.call("queue.list")
    assert (empty["runs"], empty["paused_by"]) == ([], None), empty
    paused = client.call("queue.pause", if_rev=empty["rev"], idem="p-1")
    assert paused["rev"] == empty["rev"] + 1 and "root" in paused["paused_by"], paused
    assert client.call("queue.pause", if_rev=empty["rev"], idem="p-1") == paused, "another answer for the same key"
    assert client.refused("queue.pause")["data"]["kind"] == "state.conflict"
    assert [b["kind"] for b in client.call("system.ready")["blockers"]] == ["queue.paused"]
    assert client.refused("queue.add", recipe="short", lease="L-99")["data"]["kind"] == "lease.required"
    first = client.call("queue.add", recipe="short", lease=lease, name="first", idem="a-1")
    assert client.call("queue.add", recipe="short", lease=lease, name="first", idem="a-1")["run"] == first["run"], "added twice"
    second = client.call("run.start", recipe="short", lease=lease, name="second")
    third = client.call("queue.add", recipe="short", lease=lease, name="third", place=0)
    a, b, c = (run["run"] for run in (first, second, third))
    assert {run["state"] for run in (first, second, third)} == {"queued"}
    queue = client.call("queue.list")
    assert waiting(queue) == [c, a, b] and [run["place"] for run in queue["runs"]] == [0, 1, 2], queue
    stale = client.refused("queue.move", run=b, place=0, if_rev=queue["rev"] - 1)
    assert (stale["data"]["kind"], stale["data"]["expected"]) == ("rev.changed", str(queue["rev"])), stale
    assert waiting(client.call("queue.move", run=b, place=0, if_rev=queue["rev"])) == [b, c, a]
    assert client.refused("queue.move", run=b, place=-1)["data"]["kind"] == "param.range"
    assert client.refused("queue.move", run="R-000099", place=0)["data"]["kind"] == "not_found"
    got = client.call("queue.get", run=c)
    assert (got["place"], got["name"]) == (1, "third"), got
    viewer, other = (Client(("127.0.0.1", daemon.port), introduce=False) for _ in range(2))
    viewer.call("session.open", client="x", token=token["observer"])
    assert waiting(viewer.call("queue.list")) == [b, c, a]
    for method, params in ("queue.remove", {"run": a}), ("queue.pause", {}), ("queue.start", {"lease": "L-1"}), ("queue.move", {"run": a, "place": 0}):
        assert viewer.refused(method, **params)["data"]["kind"] == "access.role", method
    other.call("session.open", client="x", token=token["operator"])
    assert other.refused("queue.remove", run=a)["data"]["kind"] == "lease.held"
    assert other.refused("queue.start", lease=lease)["data"]["kind"] == "lease.required"
    assert waiting(client.call("queue.remove", run=a)) == [b, c]
    assert client.refused("queue.get", run=a)["data"]["kind"] == "state.conflict"
    changes = [event["delta"] for event in client.events if event["topic"] == "queue"]
    assert changes[-1]["runs"] == [b, c] and changes[-1]["by"] == changes[0]["by"], changes
    return b, c


def over_a_restart(folder, daemon, expected):
    """Order and pause stay; also a queue that was not paused waits for a user's order."""
    assert daemon.end() == 0
    daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
    client = Client(daemon.socket)
    queue = client.call("queue.list")
    assert waiting(queue) == list(expected) and "root" in queue["paused_by"], queue
    lease = client.call("lease.acquire")["lease"]
    client.call("queue.start", lease=lease, if_rev=queue["rev"])
    assert client.refused("queue.start", lease=lease)["data"]["kind"] == "state.conflict"
    ends = [client.call("run.wait", run=run) for run in expected]
    assert {end["outcome"] for end in ends} == {"complete"}, ends
    lines = client.call("log.tail")["lines"]
    begun = [line["run"] for line in lines if line["data"].get("state") == "arming"]
    assert begun == list(expected), begun
    client.call("lease.release", lease=lease)
    return daemon, client


def commands(daemon):
    assert json.loads(weft(daemon, "--json", "queue", "list"))["runs"] == [] and "R-" not in weft(daemon, "queue", "list")
    assert "root" in weft(daemon, "queue", "pause") and "root" in json.loads(weft(daemon, "--json", "queue", "list"))["paused_by"]
    first = json.loads(weft(daemon, "--json", "queue", "add", "short"))["run"]
    second = json.loads(weft(daemon, "--json", "queue", "add", "short", "--place", "0"))["run"]
    assert [line.split()[0] for line in weft(daemon, "queue", "list").splitlines()[1:]] == [second, first]
    assert [line.split()[0] for line in weft(daemon, "queue", "move", first, "0").splitlines()[1:]] == [first, second]
    assert second not in weft(daemon, "queue", "remove", second)
    copies = json.loads(weft(daemon, "--json", "queue", "add", "short", "--repeat", "3", "--seed", "5", "--after", second))["run"]
    queue = json.loads(weft(daemon, "--json", "queue", "list"))["runs"]
    assert [run["run"] for run in queue[1:]] == [f"R-{int(copies[2:]) + i:06}" for i in range(3)], queue
    assert all(run["after"] == second and run["blocked"] for run in queue[1:]), "it was removed"
    text = weft(daemon, "queue", "edit", copies, "--after", "", "--name", "free", "--seed", "9")
    assert [run["run"] for run in json.loads(weft(daemon, "--json", "queue", "list"))["runs"] if run.get("blocked")] == [run["run"] for run in queue[2:]]
    assert sum(second in line for line in text.splitlines()) == 2, text
    weft(daemon, "queue", "clear")
    first = json.loads(weft(daemon, "--json", "queue", "add", "short"))["run"]
    assert [line["kind"] for line in json.loads(weft(daemon, "--json", "queue", "history"))["lines"]][-4:] == [
        "submitted", "edited", "queue_cleared", "submitted"]
    if json.loads(weft(daemon, "--json", "queue", "list"))["paused_by"]:
        weft(daemon, "queue", "start")
    assert "R-" not in weft(daemon, "queue", "list")
    return first


def interrupted(folder, client, daemon):
    """kill -9 during a long run with complete trials, with a short one queued behind it."""
    lease = client.call("lease.acquire")["lease"]
    client.call("sub.open", topics=["run:*"], mode="every")
    run = client.call("run.start", recipe="long", lease=lease)["run"]
    behind = client.call("run.start", recipe="short", lease=lease)["run"]
    while client.call("run.get", run=run)["trials_done"] < 3:
        client.event()
    daemon.end(signal.SIGKILL)
    daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
    client = Client(daemon.socket)
    assert client.call("run.get", run=run)["state"] == "interrupted"
    queue = client.call("queue.list")
    assert (waiting(queue), queue["paused_by"]) == ([behind], "auto:restart"), queue
    assert [b["kind"] for b in client.call("system.ready")["blockers"]] == ["rig.unknown", "queue.paused"]
    return daemon, client, run, behind


def after(client, behind, run):
    """The rig is as it was left: the next run starts only after a user's order."""
    assert client.call("rig.state") == {"rig": "unknown", "fact": "unknown", "left_by": run, "acknowledged": False}
    shown = client.call("sub.open", topics=["rig"], mode="latest")
    assert (shown["snapshot"]["rig"]["rig"], shown["snapshot"]["rig"]["left_by"]) == ("unknown", run), shown
    client.call("sub.close", sub=shown["sub"])
    assert client.call("run.get", run=behind)["state"] == "queued"
    client.call("rig.reset", reason="looked at the probe")
    assert client.call("queue.list")["paused_by"] == "auto:restart", "a reset starts nothing"
    assert client.call("run.get", run=behind)["state"] == "queued"
    lease = client.call("lease.acquire")["lease"]
    client.call("queue.start", lease=lease)
    client.call("lease.release", lease=lease)
    assert client.call("run.wait", run=behind)["outcome"] == "complete"


def discards(folder, client, daemon):
    daemon, client, run, behind = interrupted(folder, client, daemon)
    left = client.call("run.recover", run=run, choice="discard", preview=True)
    assert left["trials_done"] >= 3 and any("discarded" in step for step in left["will"]), left
    assert client.call("run.get", run=run)["state"] == "interrupted"
    assert client.refused("run.recover", run=run, choice="discard")["data"]["kind"] == "lease.required"
    assert has(client.refused("run.recover", run=run, choice="forget")["data"]["expected"], ["resume", "discard", "keep-partial"])
    lease = client.call("lease.acquire")["lease"]
    ended = client.call("run.recover", run=run, choice="discard", lease=lease, idem="d-1")
    assert (ended["state"], ended["outcome"], ended["recovered"]) == ("ended", "aborted", "discard"), ended
    assert client.call("run.recover", run=run, choice="discard", lease=lease, idem="d-1") == ended
    assert client.refused("run.recover", run=run, choice="resume", preview=True)["data"]["kind"] == "state.conflict"
    campaign = pathlib.Path(ended["folder"]) / "campaign.sqlite"
    refused = subprocess.run([WEFT, "--json", "dataset", "export", campaign, "-o", folder / "no.h5"], capture_output=True, text=True)
    assert refused.returncode == 1 and fits(error_of(refused), code="wrong state", where=[str(campaign)]) and not (folder / "no.h5").exists(), refused
    assert "discarded" in weft(None, "dataset", "info", str(campaign))
    weft(None, "verify", ended["folder"])
    client.call("lease.release", lease=lease)
    after(client, behind, run)
    return daemon, client


def keeps(folder, client, daemon):
    daemon, client, run, behind = interrupted(folder, client, daemon)
    left = json.loads(weft(daemon, "--json", "recover", run, "keep-partial", "--preview"))
    assert left["trials_done"] >= 3 and any(has(step, [str(left["trials_done"]), "40"]) for step in left["will"]), left
    assert all(step in weft(daemon, "recover", run, "keep-partial", "--preview") for step in left["will"]), left
    weft(daemon, "recover", run, "keep-partial")
    ended = client.call("run.get", run=run)
    assert (ended["state"], ended["outcome"], ended["recovered"]) == ("ended", "interrupted", "keep-partial"), ended
    assert 3 <= ended["trials_done"] < ended["trials_planned"] == 40, ended
    verified = json.loads(weft(None, "--json", "verify", ended["folder"]))
    assert verified["certified"] and verified["dataset_sha256"] == ended["dataset_sha256"], verified
    info = json.loads(weft(None, "--json", "dataset", "info", str(pathlib.Path(ended["folder"]) / "dataset.h5")))
    assert info["trials"] == ended["trials_done"], info
    assert "recovered" in {line["kind"] for line in client.call("log.tail", run=run)["lines"]}
    after(client, behind, run)
    return daemon, client


def goes_on(folder, client, daemon):
    daemon, client, run, behind = interrupted(folder, client, daemon)
    left = client.call("run.recover", run=run, choice="resume", preview=True)
    assert any(has(step, f"trial {left['trials_done'] + 1}") for step in left["will"]), left
    weft(daemon, "queue", "start")
    weft(daemon, "recover", run, "resume")
    assert client.call("run.wait", run=run)["trials_done"] == 40
    assert client.call("run.wait", run=behind)["outcome"] == "complete"
    return daemon


def main():
    with tempfile.TemporaryDirectory(prefix="weft-queue-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        (folder / "data").mkdir()
        token = {role: token_of(WEFT, folder / "data" / "tokens.json", role, role) for role in ("observer", "operator")}
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
        try:
            expected = a_queue(Client(daemon.socket), daemon, token)
            daemon, client = over_a_restart(folder, daemon, expected)
            assert client.call("run.wait", run=commands(daemon))["outcome"] == "complete"
            daemon, client = discards(folder, client, daemon)
            daemon, client = keeps(folder, client, daemon)
            daemon = goes_on(folder, client, daemon)
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("queue and recoveries: all of it held (simulated)")


main()
