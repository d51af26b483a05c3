#!/usr/bin/env python3
"""Operator steps on the simulated bench, over weftd's socket and at a terminal.

    weftd_people.py WEFTD WEFT SOURCE_ROOT

Operator time in the plan; the next operator step in status and events; confirmations that are valid, stale, by the wrong role or against a lease;
pause and kill -9 during a pending step; weft confirm; weft run at a terminal, without one, and with --yes. All simulated.
"""
import json
import os
import pathlib
import pty
import signal
import subprocess
import sys
import tempfile
import time

from cli_support import error_of, fits, line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
RIG = ROOT / "sim/rigs/bench17.json"
STEPS = [{"before": "campaign", "text": "Clean the probe.", "people_s": 30},
         {"before": "fabric", "text": "Mount {fabric}, number {number}.", "people_s": 90}]
ASKED = ["Clean the probe.", "Mount denim, number 1.", "Mount satin, number 2."]


def write_recipe(folder):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe.pop("$schema")
    recipe.update(fabrics=["denim", "satin"], repetitions=2, operator_steps=STEPS)
    (folder / "recipes").mkdir()
    (folder / "recipes" / "people.json").write_text(json.dumps(recipe))
    return folder / "recipes" / "people.json"


def plans(client, recipe):
    plan = client.call("recipe.check", recipe="people")["plan"]
    assert (plan["people_s"], plan["asks"]) == (210, 3), plan
    assert plan["next_attention"] == {"text": ASKED[0], "people_s": 30, "after_s": 0}, plan
    report = json.loads(subprocess.run([WEFT, "--json", "check", recipe, "--rig", RIG], check=True, capture_output=True, text=True).stdout)
    assert abs(plan["eta_s"] - report["forecast"]["duration_s"] - 210) < 1e-6, (plan, report["forecast"])
    assert [step["text"] for step in report["operator_steps"]] == ASKED, report["operator_steps"]
    assert report["operator_steps"][2]["after_s"] > 30, "two trials of satin's come after two of denim"
    words = subprocess.run([WEFT, "check", recipe, "--rig", RIG], check=True, capture_output=True, text=True).stdout
    assert line_has(words, ["3 min 30 s", "3"]) and ASKED[2] in words, words


def asked(client, run):
    """The operator prompt, when it is pending."""
    while True:
        event = client.event()
        if event["topic"] == f"run:{run}" and event["delta"].get("state") == "awaiting_operator":
            attention = event["delta"]["attention"]
            assert attention["asked"] and event["delta"]["next_attention_us"] <= event["t_us"], event
            return attention


def a_run(client, daemon, token):
    lease = client.call("lease.acquire", note="people")["lease"]
    client.call("sub.open", topics=["run:*"], mode="every")
    run = client.call("run.start", recipe="people", lease=lease)["run"]
    first = asked(client, run)
    assert first["text"] == ASKED[0], first
    assert client.call("rig.state") == {"rig": "holding", "fact": "safe", "run": run}
    got = client.call("run.get", run=run)
    assert got["attention"] == first and got["at"]["step"] == "awaiting_operator", got
    time.sleep(0.3)
    assert client.call("run.get", run=run)["state"] == "awaiting_operator", "it does not wait"
    wrong = client.refused("run.confirm", run=run, step="Q-0")
    assert wrong["data"]["kind"] == "state.conflict" and wrong["data"]["expected"] == first["step"], wrong
    assert client.refused("run.confirm", run=run)["data"]["kind"] == "param.missing"
    viewer = Client(("127.0.0.1", daemon.port), introduce=False)
    viewer.call("session.open", client="x", token=token["observer"])
    assert viewer.refused("run.confirm", run=run, step=first["step"])["data"]["kind"] == "access.role"
    by_viewer = subprocess.run([WEFT, "confirm", "--daemon", f"tcp://127.0.0.1:{daemon.port}"], capture_output=True, text=True,
                               env={**os.environ, "WEFT_TOKEN": token["observer"]}, timeout=PATIENCE_S)
    assert by_viewer.returncode == 1 and "done" not in by_viewer.stderr, by_viewer
    other = Client(("127.0.0.1", daemon.port), introduce=False)
    other.call("session.open", client="x", token=token["operator"])
    assert other.refused("run.confirm", run=run, step=first["step"])["data"]["kind"] == "lease.held"
    client.call("lease.release", lease=lease)
    assert other.refused("run.confirm", run=run, step=first["step"])["data"]["kind"] == "lease.held", "it is kept for the run"
    assert client.call("run.confirm", run=run, step=first["step"], idem="c-1")["state"] == "resuming"
    second = asked(client, run)
    assert second["text"] == ASKED[1] and second["step"] != first["step"], second
    assert client.call("run.confirm", run=run, step=first["step"], idem="c-1")["state"] == "resuming", "another answer for the same key"
    assert client.refused("run.confirm", run=run, step=first["step"])["data"]["kind"] == "state.conflict"
    client.call("run.pause", run=run)
    client.until(run, "held")
    assert client.refused("run.confirm", run=run, step=second["step"])["data"]["kind"] == "state.conflict"
    client.call("run.resume", run=run)
    again = asked(client, run)
    assert again["text"] == second["text"] and again["step"] != second["step"], (again, second)
    client.call("run.confirm", run=run, step=again["step"])
    seen = False
    while True:  # between two prompts the next one is announced before it is pending
        event = client.event()
        delta = event["delta"]
        if delta.get("state") == "awaiting_operator":
            break
        if delta.get("attention") and not delta["attention"]["asked"]:
            seen = True
            assert delta["attention"]["text"] == ASKED[2] and delta["attention"]["trial"] == 2, delta
    assert seen, "the next human action is not announced"
    status = weft(daemon, "status")
    assert line_has(status, [ASKED[2], f"weft confirm {run}"]), status
    assert run in weft(daemon, "confirm")
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["rig"], ended["trials_done"], ended["attention"]) == ("complete", "safe", 4, None), ended
    lines = client.call("log.tail", run=run)["lines"]
    assert [line["data"]["text"] for line in lines if line["kind"] == "asked"] == [ASKED[0], ASKED[1], ASKED[1], ASKED[2]], lines
    assert sum(line["kind"] == "confirmed" for line in lines) == 3, lines
    nothing = subprocess.run([WEFT, "--json", "confirm", run, "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert nothing.returncode == 1 and fits(error_of(nothing), code="wrong state", where=run, got="ended") and run in nothing.stderr, nothing
    return ended


def is_forecast(client):
    """The end and the next operator step are computed from the plan, follow a change of the simulation speed at once, and stay known while the run is
    held."""
    plan = client.call("recipe.check", recipe="people")["plan"]
    machine_s = plan["eta_s"] - plan["people_s"]
    lease = client.call("lease.acquire")["lease"]
    client.call("sim.clock", pace=10)
    client.call("sub.open", topics=["run:*"], mode="every")
    run = client.call("run.start", recipe="people", lease=lease)["run"]
    for _ in range(2):
        client.call("run.confirm", run=run, step=asked(client, run)["step"])
    client.until(run, "running")
    now_us, got = time.time() * 1e6, client.call("run.get", run=run)
    assert 0.5 * machine_s / 10 < got["wall_left_s"] < machine_s / 10 + plan["people_s"], (machine_s, got)
    assert 0 < (got["next_attention_us"] - now_us) / 1e6 < machine_s / 10, (now_us, got)
    client.call("sim.clock", pace=100)
    while not (0 < client.event()["delta"].get("wall_left_s", 0) < got["wall_left_s"] / 3):
        pass
    client.call("run.pause", run=run)
    client.until(run, "held")
    held = client.call("run.get", run=run)
    assert (held["attention"]["text"], held["attention"]["asked"], held["next_attention_us"]) == (ASKED[2], False, None), held
    time.sleep(0.3)
    assert client.call("run.get", run=run)["wall_left_s"] == held["wall_left_s"] > 0, "time passes for a run that is held"
    client.call("run.abort", run=run)
    assert client.call("run.wait", run=run)["wall_left_s"] == 0
    client.call("sim.clock", pace=0)
    client.call("lease.release", lease=lease)


def weft(daemon, *words, status=0):
    done = subprocess.run([WEFT, *words, "--socket", str(daemon.socket)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == status, (words, done)
    return done.stdout if status == 0 else done.stderr


def dies_waiting(folder, client, daemon, undisturbed):
    """kill -9 before satin is mounted: the prompt is repeated, and the data equal those of an undisturbed run."""
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe="people", lease=lease)["run"]
    for _ in range(2):
        client.call("run.confirm", run=run, step=asked(client, run)["step"])
    before = asked(client, run)
    daemon.end(signal.SIGKILL)
    daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
    client = Client(daemon.socket)
    assert client.call("run.get", run=run)["state"] == "interrupted"
    left = client.call("run.resume", run=run, preview=True)
    assert sum(ASKED[2] in step for step in left["will"]) == 1 and not any(text in step for text in ASKED[:2] for step in left["will"]), left
    client.call("sub.open", topics=["run:*"], mode="every")
    client.call("run.resume", run=run, lease=client.call("lease.acquire")["lease"])
    after = asked(client, run)
    assert after["text"] == before["text"] and after["step"] != before["step"], (before, after)
    client.call("run.confirm", run=run, step=after["step"])
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["trials_done"]) == ("complete", 4), ended
    assert ended["dataset_sha256"] == undisturbed, (ended, undisturbed)
    return daemon, ended


def run_command(recipe, out, *more):
    return [WEFT, "run", recipe, "--rig", RIG, "--out", out, "--no-evaluate", "--no-error-check", *more]


def at_a_terminal(recipe, folder):
    """Enter confirms; input typed before the prompt does not."""
    master, slave = pty.openpty()
    process = subprocess.Popen(run_command(recipe, folder / "terminal"), stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    os.close(slave)
    asked_for = []
    for line in process.stderr:
        if line.startswith(">> "):
            asked_for.append(next((text for text in ASKED if line[3:].startswith(text)), line))
            os.write(master, b"\n")
    assert process.wait(PATIENCE_S) == 0 and asked_for == ASKED, asked_for
    os.close(master)


def hangs_up(recipe, folder):
    """A terminal that closes during a prompt ends the run in an orderly way."""
    master, slave = pty.openpty()
    process = subprocess.Popen(run_command(recipe, folder / "gone"), stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    os.close(slave)
    while not process.stderr.readline().startswith(">> "):
        pass
    os.close(master)
    assert process.wait(PATIENCE_S) == 1, process.stderr.read()
    assert line_has(process.stdout.read(), "0 of 4")


def interrupted(recipe, folder):
    master, slave = pty.openpty()
    process = subprocess.Popen(run_command(recipe, folder / "signal"), stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    os.close(slave)
    while not process.stderr.readline().startswith(">> "):
        pass
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE_S) == 130, process.stderr.read()
    os.close(master)


def without_a_terminal(recipe, folder):
    refused = subprocess.run(run_command(recipe, folder / "refused", "--json"), stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert refused.returncode == 1 and fits(error_of(refused), code="unsupported", where="operator_steps", got="3", expected="--yes"), refused
    assert "operator_steps" in refused.stderr and "--yes" in refused.stderr, refused
    assert not (folder / "refused").exists()
    done = subprocess.run(run_command(recipe, folder / "yes", "--yes"), stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=PATIENCE_S)
    assert done.returncode == 0, done
    verified = subprocess.run([WEFT, "verify", folder / "yes"], capture_output=True, text=True)
    assert verified.returncode == 0, verified
    return next(word for word in done.stdout.split() if len(word) == 64)


def main():
    with tempfile.TemporaryDirectory(prefix="weft-people-") as name:
        folder = pathlib.Path(name)
        recipe = write_recipe(folder)
        undisturbed = without_a_terminal(recipe, folder)
        at_a_terminal(recipe, folder)
        hangs_up(recipe, folder)
        interrupted(recipe, folder)
        (folder / "data").mkdir()
        token = {role: token_of(WEFT, folder / "data" / "tokens.json", role, role) for role in ("observer", "operator")}
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
        try:
            client = Client(daemon.socket)
            plans(client, recipe)
            a_run(client, daemon, token)
            daemon, _ = dies_waiting(folder, client, daemon, undisturbed)
            assert daemon.end() == 0
            daemon = Daemon(WEFTD, ROOT, folder, "--port", "0")
            is_forecast(Client(daemon.socket))
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("people are asked, confirm, and are counted (simulated)")


main()
