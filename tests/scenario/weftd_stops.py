#!/usr/bin/env python3
"""What happens around the end of a run: nothing moves after a stop, an abort, a failure or a halt before a person says so.

    weftd_stops.py WEFTD WEFT SOURCE_ROOT

One function for each fault of the kind; each fails on the version before. All simulated.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


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
    """The daemon and a person at it, who has a lease for each order that needs one."""

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
        """Until the run has done so many trials."""
        while self.client.call("run.get", run=run).get("trials_done", 0) < trials or self.state(run) == "arming":
            self.client.event()

    def clear(self):
        """Nothing waits, nothing is latched: for the next test."""
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
            "auto:failed": lambda run: rig.client.call("sim.inject", fault={"device": "stage.x", "kind": "silent"}),
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
    first, second = rig.start("one"), rig.start("one")
    while rig.state(first) != "running":
        rig.client.event()
    paused = rig.client.call("run.pause", run=first)
    assert paused["state"] == "pausing" and paused["pause_carried_over"], paused
    assert rig.client.call("run.wait", run=first)["outcome"] == "complete"
    by, waiting = rig.queue()
    assert "root" in by and waiting == [second], (by, waiting)
    rig.ask("queue.start")
    third = rig.start("one")
    rig.client.call("run.wait", run=second)
    late = rig.client.refused("run.abort", run=first)
    assert late["data"]["kind"] == "state.conflict", late
    if rig.state(third) == "queued":  # else it had begun before the order came
        assert "root" in rig.queue()[0], rig.queue()
        rig.ask("queue.start")
    rig.client.call("run.wait", run=third)


def main():
    with tempfile.TemporaryDirectory(prefix="weft-stops-") as name:
        folder = pathlib.Path(name)
        write_recipes(folder)
        (folder / "data").mkdir()
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
        try:
            rig = Rig(daemon)
            for test in the_queue_waits_after_every_end, a_late_pause_holds_the_queue:
                test(rig)
                rig.clear()
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("around an end: all of it held (simulated)")


main()
