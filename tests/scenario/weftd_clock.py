#!/usr/bin/env python3
"""weftd while its machine's wall clock is set forward and back: a token that has expired stays so, and the journal's times rise.

    weftd_clock.py WEFTD WEFT SOURCE_ROOT SHIFTED_CLOCK_LIBRARY
"""
import json
import os
import pathlib
import sys
import tempfile
import time

from weftd_support import Client, Daemon, token_of

WEFTD, WEFT, ROOT, LIBRARY = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), sys.argv[4]
DAY_S = 86400


class Clock:
    def __init__(self, folder):
        self.file = folder / "shift"
        self.set(0)
        self.environment = {"LD_PRELOAD": LIBRARY, "WEFT_SHIFTED_CLOCK": str(self.file)}

    def set(self, shift_s):
        new = self.file.with_suffix(".new")
        new.write_text(f"{shift_s}\n")
        new.replace(self.file)  # whole at every moment


def refused(port, token):
    stranger = Client(("127.0.0.1", port), introduce=False)
    message = stranger.answer("session.open", client="test", token=token)
    return "error" in message and message["error"]["data"]["kind"] == "access.token"


def journal_us(client):
    client.call("rig.halt")  # a line of its own
    client.call("rig.reset", reason="the clock is looked at")
    return [line["t_us"] for line in client.call("log.tail", most=100)["lines"]]


def asked_us(client, run):
    """When the run asks for somebody, or has asked, as its newest event has it."""
    while True:
        event = client.event()
        if event["topic"] == f"run:{run}" and event["delta"].get("next_attention_us"):
            return event["delta"]["next_attention_us"]


def times_ahead(client, clock):
    """What people compare with the clock on their wall goes by that clock, also when somebody has set it back while the run waits."""
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


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for made in "recipes", "data":
            (folder / made).mkdir()
        people = json.loads((ROOT / "recipes/library/m1.json").read_text())
        people.update(fabrics=["denim"], repetitions=1, operator_steps=[{"before": "fabric", "text": "Mount {fabric}.", "people_s": 60}])
        (folder / "recipes/people.json").write_text(json.dumps(people))
        token = token_of(WEFT, folder / "data" / "tokens.json", "ada", "operator")  # good for 30 days
        clock = Clock(folder)
        os.environ.update(clock.environment)
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
        for variable in clock.environment:
            del os.environ[variable]
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
    print("weftd_clock: all as it should be")


if __name__ == "__main__":
    main()
