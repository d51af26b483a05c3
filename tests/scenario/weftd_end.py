#!/usr/bin/env python3
"""weftd gets the signal to end while work is in progress: a run becomes interrupted; a stopped run has ended; a run that is being discarded is
discarded. New requests are refused with the reason. All simulated.

    weftd_end.py WEFTD SOURCE_ROOT
"""
import json
import pathlib
import signal
import sys
import tempfile

from cli_support import has
from weftd_support import PATIENCE_S, Client, Daemon

WEFTD, ROOT = sys.argv[1], pathlib.Path(sys.argv[2])


def in_a_trial(folder):
    """A daemon, its client, the lease and a run that presses on the fabric, slow enough to get the signal during the trial."""
    daemon = Daemon(WEFTD, ROOT, folder, "--pace", "4")
    client = Client(daemon.socket)
    client.call("sub.open", topics=["run:*"], mode="every")
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    while (client.event()["delta"].get("at") or {}).get("step") != "pressing":
        pass
    return daemon, client, lease, run


def end_of(folder, run):
    daemon = Daemon(WEFTD, ROOT, folder)
    try:
        return Client(daemon.socket).call("run.get", run=run)
    finally:
        assert daemon.end() == 0


def one_that_was_stopped(folder):
    daemon, client, lease, run = in_a_trial(folder)
    assert client.call("run.stop", run=run)["state"] == "finishing"
    daemon.process.send_signal(signal.SIGTERM)
    while "daemon.stops" not in (kinds := [b["kind"] for b in client.call("system.ready")["blockers"]]):
        assert kinds == ["rig.busy"], kinds
    refused = client.refused("run.start", recipe="small", lease=lease)
    assert (refused["data"]["kind"], refused["data"]["where"]) == ("state.conflict", "daemon"), refused
    assert daemon.process.wait(PATIENCE_S) == 0
    end = end_of(folder, run)
    assert (end["state"], end["outcome"], end["cleanup"], end["rig"]) == ("ended", "aborted", "done", "safe"), end
    assert has(end["error"], "daemon"), end


def one_that_went_on(folder):
    daemon, _, _, run = in_a_trial(folder)
    assert daemon.end() == 0
    end = end_of(folder, run)
    assert (end["state"], end["outcome"], end["cleanup"], end["rig"]) == ("interrupted", "aborted", "done", "safe"), end
    assert has(end["error"], "daemon"), end
    return run


def one_that_is_discarded(folder, run):
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
    client.send(json.dumps({"jsonrpc": "2.0", "id": "gone", "method": "run.recover", "params": {"run": run, "choice": "discard", "lease": lease}}))
    client.send(json.dumps({"jsonrpc": "2.0", "id": "heard", "method": "rig.state"}))
    answers = [client.read()]
    daemon.process.send_signal(signal.SIGTERM)
    answers.append(client.read())
    assert daemon.process.wait(PATIENCE_S) == 0
    gone = next(answer for answer in answers if answer["id"] == "gone")["result"]
    assert (gone["state"], gone["recovered"]) == ("ended", "discard"), gone
    end = end_of(folder, run)
    assert (end["state"], end["recovered"]) == ("ended", "discard"), end


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe["fabrics"], recipe["repetitions"] = ["denim"], 3
        (folder / "recipes").mkdir()
        (folder / "recipes/small.json").write_text(json.dumps(recipe))
        one_that_was_stopped(folder)
        one_that_is_discarded(folder, one_that_went_on(folder))
    print("weftd_end: all as it should be (simulated)")


main()
