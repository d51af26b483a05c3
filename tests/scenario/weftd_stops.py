#!/usr/bin/env python3
"""Ends of runs: nothing moves after a stop, an abort, a failure or a halt before a person allows it.

    weftd_stops.py WEFTD WEFT SOURCE_ROOT

One function for each known fault; each fails on the version before the fix. All simulated.
"""
import json
import os
import pathlib
import pty
import subprocess
import sys
import tempfile

from cli_support import has, line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
SILENT = {"device": "ft", "fault": "silent"}


def write_recipes(folder):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe.pop("$schema")
    (folder / "recipes").mkdir()
    for name, repetitions in ("one", 1), ("many", 12):
        recipe.update(fabrics=["denim"], repetitions=repetitions)
        (folder / "recipes" / f"{name}.json").write_text(json.dumps(recipe))


def weft(daemon, *words, status=0):
    done = subprocess.run([WEFT, *words, "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == status, (words, done)
    return done


class Rig:
    """The daemon and a user, who acquires a lease for each order that needs one."""

    def __init__(self, daemon):
        self.daemon, self.client = daemon, Client(daemon.socket)
        self.client.call("sub.open", topics=["run:*", "rig", "queue"], mode="every")

    def ask(self, method, **params):
        lease = self.client.call("lease.acquire")["lease"]
        try:
            return self.client.call(method, lease=lease, **params)
        finally:
            self.client.call("lease.release", lease=lease)

    def start(self, recipe, **params):
        return self.ask("run.start", recipe=recipe, **params)["run"]

    def state(self, run):
        return self.client.call("run.get", run=run)["state"]

    def queue(self):
        listed = self.client.call("queue.list")
        return listed["paused_by"], [run["run"] for run in listed["runs"]]

    def arrives(self, run, trials):
        """Waits until the run has completed `trials` trials."""
        while self.client.call("run.get", run=run).get("trials_done", 0) < trials or self.state(run) == "arming":
            self.client.event()

    def clear(self):
        """Empties the queue and clears the latch for the next test."""
        for run in self.queue()[1]:
            self.client.call("queue.remove", run=run)
        if self.queue()[0]:
            self.ask("queue.start")
        if self.client.call("rig.state")["rig"] != "safe":
            self.client.call("rig.reset", reason="the test has looked at it")


def the_queue_waits_after_every_end(rig):
    """Fault 2. The next queued campaign began 12 ms after a stop, an abort, a device fault and a halt."""
    ends = {"auto:stopped": lambda run: rig.client.call("run.stop", run=run),
            "auto:aborted": lambda run: rig.client.call("run.abort", run=run),
            "auto:failed": lambda run: rig.client.call("sim.inject", **SILENT),
            "auto:halted": lambda run: rig.client.call("rig.halt", reason="fault 2")}
    for paused_by, end in ends.items():
        first, second = rig.start("many"), rig.start("one")
        rig.arrives(first, 1)
        end(first)
        ended = rig.client.call("run.wait", run=first)
        assert ended["outcome"] == {"auto:halted": "aborted"}.get(paused_by, paused_by.removeprefix("auto:")), ended
        assert rig.queue() == (paused_by, [second]), (paused_by, rig.queue())
        if rig.client.call("rig.state")["rig"] != "safe":
            rig.client.call("rig.reset", reason="looked at it")
        assert rig.queue() == (paused_by, [second]), "a reset starts nothing"
        rig.ask("queue.start")
        assert rig.client.call("run.wait", run=second)["outcome"] == "complete"
        rig.clear()
    first, second = rig.start("many", keep_going=True), rig.start("one")
    rig.arrives(first, 1)
    rig.client.call("run.abort", run=first)
    assert rig.client.call("run.wait", run=second)["outcome"] == "complete", "the first was to keep the queue going"


def a_late_pause_holds_the_queue(rig):
    """Fault 13. A pause in the last repetition was lost: the next campaign armed 6 ms after the end."""
    rig.client.call("sim.clock", pace=100)
    first, second = rig.start("one"), rig.start("one")
    while rig.client.call("run.get", run=first).get("at", {}).get("step") not in ("pressing", "holding", "sliding"):
        rig.client.event()
    paused = rig.client.call("run.pause", run=first)
    assert paused["state"] == "pausing" and paused["pause_carried_over"], paused
    rig.client.call("sim.clock", pace=0)
    assert rig.client.call("run.wait", run=first)["outcome"] == "complete"
    by, waiting = rig.queue()
    assert "root" in by and waiting == [second], (by, waiting)
    rig.client.call("queue.remove", run=second)


def a_late_stop_holds_the_queue(rig):
    """Similar to fault 13: a stop in the last repetition, and an abort of a run that has ended, were lost."""
    rig.client.call("sim.clock", pace=100)
    first, second = rig.start("one"), rig.start("one")
    while rig.client.call("run.get", run=first).get("at", {}).get("step") not in ("pressing", "holding", "sliding"):
        rig.client.event()
    assert rig.client.call("run.stop", run=first)["state"] == "finishing"
    rig.client.call("sim.clock", pace=0)
    assert rig.client.call("run.wait", run=first)["trials_done"] == 1
    assert rig.queue() == ("auto:stopped", [second]), rig.queue()
    last = [line for line in rig.client.call("log.tail", run=first)["lines"] if line["kind"] == "state"][-1]
    assert "root" in last["by"] and last["data"]["state"] == "ended", last
    rig.client.call("queue.remove", run=second)
    rig.client.call("sim.clock", pace=100)
    under_way, waits = rig.start("many"), rig.start("one")
    rig.arrives(under_way, 1)
    late = rig.client.refused("run.abort", run=first)
    assert late["data"]["kind"] == "state.conflict", late
    by, waiting = rig.queue()
    assert "root" in by and waiting == [waits], (by, waiting)
    rig.client.call("run.abort", run=under_way)
    rig.client.call("run.wait", run=under_way)
    rig.client.call("sim.clock", pace=0)


def remote(daemon, token):
    client = Client(("127.0.0.1", daemon.port), introduce=False)
    client.call("session.open", client="test", protocol="1.x", token=token)
    return client


def a_lease_is_kept_for_the_run(rig, tokens):
    """Fault 3. `weft start` gave its lease back after 12 ms, so that another token aborted the run."""
    ada, bo, engineer = (remote(rig.daemon, tokens[name]) for name in ("ada", "bo", "engineer"))
    lease = ada.call("lease.acquire")["lease"]
    run = ada.call("run.start", recipe="many", lease=lease)["run"]
    ada.call("lease.release", lease=lease)
    rig.arrives(run, 1)
    kept = ada.call("lease.list")["leases"]
    assert [(one["user"], one["kept_for"]) for one in kept] == [("token:ada", run)], kept
    assert bo.refused("run.abort", run=run)["data"]["kind"] == "lease.held"
    assert bo.refused("lease.acquire")["data"]["kind"] == "state.conflict"
    assert rig.client.refused("run.resume", run=run)["data"]["kind"] == "lease.held"
    behind = bo.call("run.start", recipe="one")["run"]  # it needs no lease: nothing starts before the end
    bo.call("run.pause", run=run)
    while rig.state(run) != "held":
        rig.client.event()
    assert bo.refused("run.resume", run=run, break_lease="ada is away")["data"]["kind"] == "access.role"
    assert bo.refused("run.resume", run=run)["data"]["kind"] == "lease.held"
    again = remote(rig.daemon, tokens["ada"])
    assert again.call("run.resume", run=run)["state"] == "resuming", "the same user in another session"
    assert rig.state(run) != "aborting"
    bo.call("run.abort", run=run, break_lease="ada is away")
    assert rig.client.call("run.wait", run=run)["outcome"] == "aborted"
    broken = [line for line in rig.client.call("log.tail", most=50)["lines"] if line["kind"] == "lease.broken"]
    assert broken[-1]["data"]["reason"] == "ada is away" and "token:bo" in broken[-1]["by"], broken
    assert rig.queue() == ("auto:aborted", [behind])
    rig.clear()
    run = rig.start("many")
    rig.arrives(run, 1)
    rig.client.call("run.pause", run=run)
    while rig.state(run) != "held":
        rig.client.event()
    assert engineer.call("run.resume", run=run, break_lease="root is away")["state"] == "resuming"
    weft(rig.daemon, "abort", run)
    rig.client.call("run.wait", run=run)


def a_lock_out_is_one_persons(rig, tokens, folder):
    """Fault 3. A halts, B resets, and the next run armed 3 ms later."""
    ada, bo, engineer = (remote(rig.daemon, tokens[name]) for name in ("ada", "bo", "engineer"))
    ada.call("rig.halt")
    locked = ada.call("rig.lock", reason="my hand is in it")
    assert (locked["locked"]["by"], locked["locked"]["reason"]) == ("token:ada", "my hand is in it"), locked
    run = rig.start("one")
    lease = bo.call("lease.acquire")["lease"]
    for method, params in ("rig.reset", {"reason": "not looked at"}), ("rig.lock", {"reason": "mine"}), ("rig.unlock", {}), \
            ("queue.start", {"lease": lease}):
        assert bo.refused(method, **params)["data"]["kind"] == "rig.locked", method
    bo.call("lease.release", lease=lease)
    rig.daemon.end()
    rig.daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
    rig.client = Client(rig.daemon.socket)
    rig.client.call("sub.open", topics=["run:*", "rig", "queue"], mode="every")
    ada, bo, engineer = (remote(rig.daemon, tokens[name]) for name in ("ada", "bo", "engineer"))
    assert {"rig.locked", "rig.latched"} <= {b["kind"] for b in bo.call("system.ready")["blockers"]}
    assert bo.refused("rig.unlock")["data"]["kind"] == "rig.locked"
    assert engineer.refused("rig.unlock")["data"]["kind"] == "request.invalid"
    engineer.call("rig.unlock", reason="ada reports that it is free")
    assert rig.state(run) == "queued" and rig.queue()[0] == "auto:restart", rig.queue()
    assert line_has(weft(rig.daemon, "lock", "cable").stdout, ["root", "cable"])
    assert rig.client.call("rig.state")["locked"]["reason"] == "cable", rig.client.call("rig.state")
    weft(rig.daemon, "unlock")
    rig.clear()


def the_journal_tells_an_end(rig, folder):
    """Fault 4. `weft log RUN` ended with {"state":"ended"} for all ends alike, and nothing was written after a kill."""
    def state_lines(run):
        lines = [json.loads(json.dumps(line)) for line in rig.client.call("log.tail", run=run)["lines"]]
        submitted = [line for line in lines if line["kind"] == "submitted"][0]["data"]
        assert submitted["recipe"] == "many" and submitted["seed"] == 7 and submitted["digest"].startswith("sha256:"), submitted
        return [line for line in lines if line["kind"] == "state"]

    run = rig.start("many", seed=7)
    rig.arrives(run, 1)
    rig.client.call("sim.inject", **SILENT)
    ended = rig.client.call("run.wait", run=run)
    last = state_lines(run)[-1]["data"]
    assert {key: last.get(key) for key in ("state", "outcome", "cleanup", "rig", "error", "seed")} == {
        "state": "ended", "outcome": "failed", "cleanup": ended["cleanup"], "rig": ended["rig"], "error": ended["error"], "seed": 7}, last
    rig.clear()
    run = rig.start("many", seed=7)
    rig.arrives(run, 1)
    rig.daemon.process.kill()
    rig.daemon.process.wait()
    rig.daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
    rig.client = Client(rig.daemon.socket)
    rig.client.call("sub.open", topics=["run:*", "rig", "queue"], mode="every")
    last = state_lines(run)[-1]
    assert last["by"] == "auto:restart" and last["data"]["state"] == "interrupted" and last["data"]["rig"] == "unknown", last
    return run


def what_is_left_is_recovered(rig, interrupted):
    """Fault 5. A stopped, aborted or failed campaign could not be resumed over the API."""
    rig.ask("run.recover", run=interrupted, choice="discard")
    rig.clear()
    for end in "run.stop", "run.abort", "sim.inject", "rig.halt":
        run = rig.start("many")
        rig.arrives(run, 2)
        params = {"sim.inject": SILENT, "rig.halt": {}}.get(end, {"run": run})
        rig.client.call(end, **params)
        cut = rig.client.call("run.wait", run=run)
        assert cut["state"] == "ended" and cut["trials_done"] < cut["trials_planned"], cut
        left = rig.client.call("run.recover", run=run, choice="resume", preview=True)
        assert left["trials_left"] == cut["trials_planned"] - left["trials_done"] > 0, (left, cut)
        if rig.client.call("rig.state")["rig"] != "safe":
            rig.client.call("rig.reset", reason="looked at it")
        rig.ask("run.recover", run=run, choice="resume")
        whole = rig.client.call("run.wait", run=run)
        assert (whole["outcome"], whole["trials_done"]) == ("complete", whole["trials_planned"]), whole
        assert rig.client.refused("run.recover", run=run, choice="resume", preview=True)["data"]["kind"] == "state.conflict"
        rig.clear()


def a_reset_says_where_the_probe_is(rig):
    """Fault 8. `weft reset` printed "rig safe" while the run's fact was holding."""
    run = rig.start("many")
    rig.arrives(run, 1)
    rig.client.call("rig.halt")
    ended = rig.client.call("run.wait", run=run)
    assert ended["rig"] == "holding", ended
    state = rig.client.call("rig.state")
    assert (state["rig"], state["fact"], state["left_by"]) == ("latched", "holding", run), state
    printed = weft(rig.daemon, "reset", "looked at it").stdout
    assert line_has(printed, ["holding", run]), printed
    state = rig.client.call("rig.state")
    assert (state["rig"], state["acknowledged"]) == ("holding", True), state
    assert rig.client.call("system.ready")["ok"]
    assert rig.client.call("run.wait", run=rig.start("one"))["outcome"] == "complete"
    assert rig.client.call("rig.state")["rig"] == "safe"


def a_halt_never_fails_for_its_words(rig):
    """Fault 1. `weft halt R-000001` ended with 2, and the rig continued to move."""
    def halt(*words, status=0, **environment):
        env = {key: value for key, value in os.environ.items() if not key.startswith("WEFT_")} | environment
        done = subprocess.run([WEFT, *words], capture_output=True, text=True, timeout=PATIENCE_S, env=env)
        assert done.returncode == status, (words, done)
        state = rig.client.call("rig.state")
        assert state["rig"] == "latched", (words, state)
        rig.client.call("rig.reset", reason="the test has looked at it")
        return done, state

    here, nowhere = str(rig.daemon.socket), "tcp://127.0.0.1:1"
    done, state = halt("halt", "R-000001", "--frobnicate", "smoke", WEFT_SOCKET=here)
    assert "R-000001 --frobnicate smoke" in done.stderr and state["latched_by"].endswith("R-000001 --frobnicate smoke"), (done, state)
    done, state = halt("estop", "smoke", WEFT_SOCKET=here)
    assert state["latch"] == "estop" and state["latched_by"].endswith("smoke"), state
    done, _ = halt("halt", status=1, WEFT_SOCKET=here, WEFT_DAEMON=nowhere)
    assert nowhere in done.stderr, done
    halt("halt", "--socket", "/nowhere/weftd.sock", "--token-file", "/nowhere", status=1, WEFT_SOCKET=here)
    halt("--json", "halt", "--socket", here)
    if pathlib.Path("/run/weft/weftd.sock").exists():
        print("not tried, as a daemon of this machine would be halted: weft halt without a socket")
        return
    unit = subprocess.run([WEFT, "halt"], capture_output=True, text=True, timeout=PATIENCE_S,
                          env={key: value for key, value in os.environ.items() if not key.startswith("WEFT_")})
    assert unit.returncode == 1 and "/run/weft/weftd.sock" in unit.stderr, unit


def the_end_is_forecast_from_the_beginning(rig):
    """Fault 6. wall_left_s was 0 until the first trial ended, and kept the pace before."""
    rig.client.call("sim.clock", pace=60)
    run = rig.start("many")
    first = rig.client.call("run.get", run=run)
    assert first["trials_done"] == 0 and first["wall_left_s"] > 1, first
    rig.arrives(run, 1)
    before = rig.client.call("run.get", run=run)["wall_left_s"]
    rig.client.call("sim.clock", pace=600)
    after = rig.client.call("run.get", run=run)["wall_left_s"]
    assert 0 < after < before / 4, (before, after)
    rig.client.call("run.abort", run=run)
    assert rig.client.call("run.wait", run=run)["wall_left_s"] == 0
    rig.client.call("sim.clock", pace=0)


def the_present_comes_first(rig):
    """Fault 7. `weft status` printed all runs, the newest last; `weft queue` required a subcommand; `weft watch` printed each change."""
    lines = weft(rig.daemon, "status").stdout.splitlines()
    assert lines[0] == "ready" and has(lines[1], ["rig", "safe"]), lines[:3]
    listed = json.loads(weft(rig.daemon, "--json", "status").stdout)["runs"]
    assert len(listed) == 10 and [run["run"] for run in listed] == sorted((run["run"] for run in listed), reverse=True), listed
    assert len(json.loads(weft(rig.daemon, "--json", "status", "--all").stdout)["runs"]) > 10
    assert weft(rig.daemon, "queue").stdout == weft(rig.daemon, "queue", "list").stdout
    rig.client.call("sim.clock", pace=600)
    run = rig.start("many")
    lines = weft(rig.daemon, "watch", run).stdout.splitlines()
    assert 12 <= len(lines) <= 24, lines
    run = rig.start("many")
    ours, theirs = pty.openpty()
    watching = subprocess.Popen([WEFT, "watch", run, "--socket", str(rig.daemon.socket)], stdout=subprocess.PIPE, stderr=theirs, text=True)
    os.close(theirs)
    shown = b""
    try:
        while chunk := os.read(ours, 4096):
            shown += chunk
    except OSError:  # the other end is closed
        pass
    assert watching.wait(PATIENCE_S) == 0 and "complete" in watching.stdout.read()
    assert b"\r[" in shown and b"/12" in shown and b" left" in shown, shown
    rig.client.call("sim.clock", pace=0)


def main():
    with tempfile.TemporaryDirectory(prefix="weft-stops-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        (folder / "data").mkdir()
        roles = {"ada": "operator", "bo": "operator", "engineer": "engineer"}
        tokens = {name: token_of(WEFT, folder / "data" / "tokens.json", name, role) for name, role in roles.items()}
        rig = Rig(Daemon(WEFTD, ROOT, folder, "--port", "0"))
        try:
            for test in the_queue_waits_after_every_end, a_late_pause_holds_the_queue, a_late_stop_holds_the_queue:
                test(rig)
                rig.clear()
            a_lease_is_kept_for_the_run(rig, tokens)
            a_lock_out_is_one_persons(rig, tokens, folder)
            what_is_left_is_recovered(rig, the_journal_tells_an_end(rig, folder))
            a_reset_says_where_the_probe_is(rig)
            a_halt_never_fails_for_its_words(rig)
            the_end_is_forecast_from_the_beginning(rig)
            the_present_comes_first(rig)
            assert rig.daemon.end() == 0
        finally:
            rig.daemon.process.kill()
    print("around an end: all of it held (simulated)")


main()
