#!/usr/bin/env python3
"""Fault injection on a simulated bench over weftd's socket, an e-stop, sessions, cancelled calls, credit, uploaded recipes. All simulated.

    weftd_faults.py WEFTD WEFT SOURCE_ROOT
"""
import json
import pathlib
import sqlite3
import subprocess
import sys
import tempfile

from cli_support import has
from weftd_support import Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def recipe(repetitions=1):
    out = json.loads((ROOT / "recipes/library/m1.json").read_text())
    out.update(fabrics=["denim"], repetitions=repetitions)
    return {key: value for key, value in out.items() if key != "$schema"}


def refused(client, method, kind, where=None, **params):
    error = client.refused(method, **params)
    assert error["data"]["kind"] == kind and where in (None, error["data"]["where"]), (method, params, error)
    return error


def faults(client, operator, lease):
    """A refused fault changes nothing. An injected fault ends the run, and the journals of the run and of the daemon have it."""
    refused(client, "sim.inject", "state.conflict", "/rig", device="ft", fault="silent")
    refused(operator, "sim.inject", "access.role", device="ft", fault="silent")
    client.call("sim.clock", pace=2)
    run = client.call("run.start", recipe="long", lease=lease)["run"]
    client.until(run, "running")
    for wrong, where, kind in (dict(device="fu", fault="silent"), "/params/device", "not_found"), \
            (dict(device="ft", fault="motor_stall"), "/params/fault", "unsupported"), \
            (dict(device="ft", fault="drop", probability=2), "/params/probability", "param.range"), \
            (dict(device="ft", fault="drop", amount="much"), "/params/amount", "param.type"):
        refused(client, "sim.inject", kind, where, **wrong)
    refused(client, "sim.clear", "not_found", "/params/device", device="fu")
    client.call("sim.inject", device="ft", fault="noise", amount=0.001)
    assert client.call("sim.clear", device="ft", fault="noise") == {"device": "ft", "fault": "noise", "run": run}
    first = client.call("sim.inject", device="ft", fault="silent", idem="once")
    assert first == {"device": "ft", "fault": "silent", "run": run}, first
    assert client.call("sim.inject", device="ft", fault="silent", idem="once") == first
    client.call("sim.clock", pace=0)
    ended = client.call("run.wait", run=run)
    assert ended["outcome"] != "complete" and "ft" in ended["error"], ended
    told = [line["data"] for line in client.call("log.query", run=run, kind="fault")["lines"]]
    assert sorted((t["fault"]["fault"], t["ends"]) for t in told) == [("noise", False), ("noise", True), ("silent", False)], told
    with sqlite3.connect(f"file:{ended['folder']}/campaign.sqlite?mode=ro", uri=True) as file:
        lines = [json.loads(p) for (p,) in file.execute("SELECT payload_json FROM journal WHERE kind = 'fault' ORDER BY sequence")]
    assert [(t["fault"]["fault"], t["ends"]) for t in lines] == [("noise", False), ("noise", True), ("silent", False)], lines
    if client.call("rig.state")["rig"] != "safe":
        client.call("rig.reset", reason="looked at")
    refused(client, "sim.inject", "state.conflict", "/rig", device="ft", fault="silent")


def latched(client):
    (blocker,) = [b for b in client.call("system.ready")["blockers"] if b["kind"] == "rig.latched"]
    return blocker


def emergency_stop(daemon, client, operator, lease):
    """An e-stop by the raw line of an unknown client. It remains after a halt, and only an engineer can reset it."""
    client.call("sim.clock", pace=2)
    run = client.call("run.start", recipe="long", lease=lease)["run"]
    client.until(run, "running")
    stranger = Client(daemon.socket, introduce=False)
    stranger.send("!estop")
    assert stranger.read()["params"]["delta"]["latched"] == "estop"
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["cleanup"]) == ("aborted", "skipped"), ended
    assert client.call("rig.halt") == {"latched": True, "latch": "estop"}
    assert client.call("rig.state")["latch"] == "estop"
    hint = latched(client)["hint"]
    client.call("lease.release", lease=lease)
    refused(operator, "rig.reset", "access.role", reason="looked at")
    client.call("rig.reset", reason="looked at")
    assert operator.call("rig.estop") == {"latched": True, "latch": "estop"}
    client.call("rig.reset", reason="looked at")
    done = subprocess.run([WEFT, "estop", "--socket", daemon.socket], check=True, capture_output=True, text=True)
    assert has(done.stdout, "latched") and client.call("rig.state")["latch"] == "estop", done
    client.call("rig.reset", reason="looked at")
    client.call("rig.halt")
    assert client.call("rig.state")["latch"] == "halt"
    assert hint.split()[0] != latched(client)["hint"].split()[0], f"the hint names the kind of stop: {hint}, {latched(client)}"
    operator.call("rig.reset", reason="looked at")
    client.call("sim.clock", pace=0)


def estop_outlives_the_daemon(folder, client, daemon):
    client.call("rig.estop")
    assert daemon.end() == 0
    daemon = Daemon(WEFTD, ROOT, folder, "--port", "0", "--tokens", folder / "tokens.json")
    client = Client(daemon.socket)
    assert client.call("rig.state")["latch"] == "estop"
    client.call("rig.reset", reason="looked at")
    assert "latch" not in client.call("rig.state")
    return daemon


def sessions(daemon, client, token):
    operator = Client(("127.0.0.1", daemon.port), introduce=False)
    mine = operator.call("session.open", client="bench", token=token)["session"]
    there = {s["session"]: s for s in client.call("session.list")["sessions"]}
    assert (there[mine]["user"], there[mine]["role"], there[mine]["local"]) == ("token:bo", "operator", False), there
    assert there[client.session["session"]]["waiting_calls"] == 1, "the question itself"
    refused(operator, "session.close", "access.role", "/params/session", session=client.session["session"], reason="no more")
    refused(client, "session.close", "request.invalid", "/params/reason", session=mine)
    refused(client, "session.close", "not_found", "/params/session", session="s-99999", reason="no more")
    assert client.call("session.close", session=mine, reason="out of hours") == {"closed": mine}
    last = operator.read()
    assert last["error"]["data"]["kind"] == "session.closed" and last["error"]["data"]["got"] == "out of hours", last
    assert operator.lines.readline() == "", "it stays open"
    assert mine not in {s["session"] for s in client.call("session.list")["sessions"]}
    own = Client(daemon.socket)
    assert own.call("session.close") == {"closed": own.session["session"]}
    assert own.read()["error"]["data"]["kind"] == "session.closed"
    newest = client.call("log.query", kind="session.closed")["lines"][-1]
    assert newest["data"]["session"] == own.session["session"], newest


def given_up(client, lease):
    """A cancelled call is answered at once, and nothing is sent later. Cancelling does not undo a change."""
    client.call("sim.clock", pace=2)
    run = client.call("run.start", recipe="long", lease=lease)["run"]
    client.until(run, "running")  # an abort while the bench is arming would leave the rig unknown
    client.send(json.dumps({"jsonrpc": "2.0", "id": "w", "method": "run.wait", "params": {"run": run}}))
    client.send(json.dumps({"jsonrpc": "2.0", "id": 9000, "method": "$/cancel", "params": {"id": "w"}}))
    told = {}
    while len(told) < 2:
        message = client.read()
        if "id" in message:
            told[message["id"]] = message
    assert told["w"]["error"]["data"]["kind"] == "request.cancelled" and told[9000]["result"] == {"cancelled": "w"}, told
    refused(client, "$/cancel", "not_found", "/params/id", id="w")
    refused(client, "$/cancel", "param.type", "/params/id", id=[1])
    client.call("run.abort", run=run)
    client.call("sim.clock", pace=0)
    assert client.call("run.wait", run=run)["state"] == "ended"
    client.send(json.dumps({"jsonrpc": "2.0", "id": "last", "method": "system.time"}))
    while (message := client.read()).get("id") != "last":
        assert message.get("id") != "w", "an answer to a call that was given up"


def credit(daemon, client):
    """At most as many events as granted; waiting events follow with the next grant."""
    listener = Client(daemon.socket)
    sub = listener.call("sub.open", topics=["lease:*"], mode="every", credit=2)["sub"]
    for _ in range(3):
        lease = client.call("lease.acquire")["lease"]
        client.call("lease.release", lease=lease)
    listener.call("system.time")
    assert len(listener.events) <= 2
    while len(listener.events) < 2:
        listener.events.append(listener.read()["params"])
    listener.call("system.time")
    assert len(listener.events) == 2, listener.events
    assert listener.call("sub.credit", sub=sub, events=3)["credit"] <= 3
    while len(listener.events) < 5:
        listener.events.append(listener.read()["params"])
    listener.call("system.time")
    assert len(listener.events) == 5 and [e["dropped"] for e in listener.events] == [0] * 5, listener.events
    refused(listener, "sub.credit", "param.range", "/params/events", sub=sub, events=0)
    refused(listener, "sub.credit", "not_found", "/params/sub", sub="u9999", events=1)
    free = listener.call("sub.open", topics=["lease:*"])["sub"]
    refused(listener, "sub.credit", "state.conflict", "/params/sub", sub=free, events=1)


def put(client, operator, lease):
    """An invalid recipe is not written. An existing one is replaced only with its present digest, and never while a run waits for it."""
    refused(operator, "recipe.put", "access.role", recipe="new", content=recipe())
    for name in "../up", "", ".hidden", "a b", "-rf", "--force.json":
        refused(client, "recipe.put", "request.invalid", "/params/recipe", recipe=name, content=recipe())
    refused(client, "run.start", "request.invalid", "/params/name", recipe="long", lease=lease, name="-rf")
    refused(client, "recipe.put", "request.invalid", "/params/content/name", recipe="new", content={**recipe(), "name": "-rf"})
    refused(client, "token.add", "request.invalid", name="-rf")
    wrong = recipe()
    wrong["repetitions"] = 0
    assert refused(client, "recipe.put", "request.invalid", recipe="new", content=wrong)["data"]["where"].startswith("/params/content/")
    assert "new" not in client.call("recipe.list")["recipes"]
    made = client.call("recipe.put", recipe="new", content=recipe(), idem="p1")
    assert made["replaced"] is None and made["digest"] == client.call("recipe.check", recipe="new")["digest"], made
    assert client.call("recipe.put", recipe="new", content=recipe(), idem="p1") == made
    refused(client, "recipe.put", "state.conflict", "/params/recipe", recipe="new", content=recipe(2))
    refused(client, "recipe.put", "state.conflict", "/params/if_digest", recipe="new", content=recipe(2), if_digest="sha256:00")
    again = client.call("recipe.put", recipe="new", content=recipe(2), if_digest=made["digest"])
    assert again["replaced"] == made["digest"] and again["trials"] == 2 * made["trials"], again
    client.call("queue.pause")
    run = client.call("run.start", recipe="new", lease=lease)["run"]
    assert refused(client, "recipe.put", "state.conflict", "/params/recipe", recipe="new", content=recipe(), if_digest=again["digest"])["data"]["got"] == run
    client.call("run.withdraw", run=run)
    client.call("recipe.put", recipe="new", content=recipe(), if_digest=again["digest"])
    client.call("queue.start", lease=lease)


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        for each in "recipes", "data":
            (folder / each).mkdir()
        (folder / "recipes/long.json").write_text(json.dumps(recipe(8)))
        token = token_of(WEFT, folder / "tokens.json", "bo", "operator")
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0", "--tokens", folder / "tokens.json")
        try:
            client, operator = Client(daemon.socket), Client(("127.0.0.1", daemon.port), introduce=False)
            assert operator.call("session.open", client="bench", token=token)["role"] == "operator"
            client.call("sub.open", topics=["run:*"], mode="every")
            sessions(daemon, client, token)
            credit(daemon, client)
            lease = client.call("lease.acquire", ttl_ms=600000)["lease"]
            put(client, operator, lease)
            faults(client, operator, lease)
            given_up(client, lease)
            emergency_stop(daemon, client, operator, lease)
            daemon = estop_outlives_the_daemon(folder, client, daemon)
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("weftd: faults, emergency stop, sessions, given-up calls, credit and recipes, all as they should be (simulated)")


if __name__ == "__main__":
    main()
