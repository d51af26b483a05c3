#!/usr/bin/env python3
"""weftd while its machine's wall clock is set forward and back: an expired token stays expired, and the journal's times rise. With a shifted
monotonic clock: the daemon also ends on request if its run does not answer.

    weftd_clock.py WEFTD WEFT SOURCE_ROOT SHIFTED_CLOCK_LIBRARY
"""
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from cli_support import line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT, LIBRARY = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), sys.argv[4]
DAY_S = 86400


class Clock:
    def __init__(self, folder, which="CLOCK"):
        self.file = folder / f"shift-{which}"
        self.set(0)
        self.environment = {"LD_PRELOAD": LIBRARY, f"WEFT_SHIFTED_{which}": str(self.file)}

    def set(self, shift_s):
        new = self.file.with_suffix(".new")
        new.write_text(f"{shift_s}\n")
        new.replace(self.file)  # replaced atomically


def daemon_by(clock, folder, *arguments):
    os.environ.update(clock.environment)
    daemon = Daemon(WEFTD, ROOT, folder, *arguments)
    for variable in clock.environment:
        del os.environ[variable]
    return daemon


def refused(port, token):
    stranger = Client(("127.0.0.1", port), introduce=False)
    message = stranger.answer("session.open", client="test", token=token)
    return "error" in message and message["error"]["data"]["kind"] == "access.token"


def journal_us(client):
    client.call("rig.halt")  # writes a line of the journal
    client.call("rig.reset", reason="the clock is looked at")
    return [line["t_us"] for line in client.call("log.tail", most=100)["lines"]]


def asked_us(client, run):
    """Time of the run's next or pending operator step, from its newest event [us]."""
    while True:
        event = client.event()
        if event["topic"] == f"run:{run}" and event["delta"].get("next_attention_us"):
            return event["delta"]["next_attention_us"]


def times_ahead(client, clock):
    """Times for people follow the wall clock, also when it is set back while the run waits."""
    client.call("sub.open", topics=["run:*"], mode="every")
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe="people", lease=lease)["run"]
    client.until(run, "awaiting_operator")
    for shift_s in 7200, -7200:
        clock.set(shift_s)
        told_s = asked_us(client, run) / 1e6
        assert abs(told_s - (time.time() + shift_s)) < 600, (told_s, time.time(), shift_s)
        assert client.call("run.get", run=run)["next_attention_us"] / 1e6 < time.time() + shift_s + 600
    clock.set(0)
    client.call("run.abort", run=run)
    client.call("run.wait", run=run)


def does_not_answer(folder):
    """A run that waits forever for a lock is given up after its deadlines, and one SIGTERM is enough."""
    clock = Clock(folder, "STEADY")
    clock.environment["WEFT_LOCK_HANGS"] = "1"
    daemon = daemon_by(clock, folder)
    try:
        client = Client(daemon.socket)
        client.call("sub.open", topics=["run:*"], mode="every")
        run = client.call("run.start", recipe="people", lease=client.call("lease.acquire")["lease"])["run"]
        client.until(run, "arming")
        daemon.process.send_signal(signal.SIGTERM)
        for hours in range(1, PATIENCE_S):
            clock.set(hours * 3600)
            with contextlib.suppress(subprocess.TimeoutExpired):
                daemon.process.wait(1)
                break
        assert daemon.process.returncode == 1, daemon.process.returncode
    finally:
        daemon.process.kill()
    printed = daemon.process.stderr.read()
    assert line_has(printed, ["weftd", run]), printed
    daemon = Daemon(WEFTD, ROOT, folder)
    lost = Client(daemon.socket).call("run.get", run=run)
    assert (lost["state"], lost["outcome"], lost["cleanup"], lost["by"]) == ("ended", "failed", "skipped", "auto:daemon") and lost["error"], lost
    assert daemon.end() == 0


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for made in "recipes", "data":
            (folder / made).mkdir()
        people = json.loads((ROOT / "recipes/library/m1.json").read_text())
        people.update(fabrics=["denim"], repetitions=1, operator_steps=[{"before": "fabric", "text": "Mount {fabric}.", "people_s": 60}])
        (folder / "recipes/people.json").write_text(json.dumps(people))
        token = token_of(WEFT, folder / "data" / "tokens.json", "ada", "operator")  # valid for 30 days
        clock = Clock(folder)
        daemon = daemon_by(clock, folder, "--port", "0")
        try:
            client = Client(daemon.socket)
            before = journal_us(client)
            assert not refused(daemon.port, token)
            clock.set(31 * DAY_S)
            assert refused(daemon.port, token), "the clock that the daemon goes by was not set"
            ahead = journal_us(client)
            assert ahead[-1] - before[-1] > 30 * DAY_S * 1_000_000, "the clock forward is followed"
            clock.set(0)
            assert refused(daemon.port, token), "a token that had expired is good again"
            back = journal_us(client)
            assert len(back) > len(ahead) and back == sorted(back), back
            times_ahead(client, clock)
        finally:
            assert daemon.end() == 0
        does_not_answer(folder)
    print("weftd_clock: all as it should be")


if __name__ == "__main__":
    main()
