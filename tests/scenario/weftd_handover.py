#!/usr/bin/env python3
"""The handover of a complete campaign starts by itself: over weftd's socket, beside the next run, cancelled, killed, too slow; and by `weft run`. All
simulated.

    weftd_handover.py WEFTD WEFT SOURCE_ROOT
"""
import hashlib
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from cli_support import error_of, fits, has, line_has
from weftd_support import PATIENCE_S, Client, Daemon

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
FABRICS = ["pile", "nylon", "denim", "satin", "velvet", "terry"]


def recipe(fabrics, repetitions, hand_over):
    out = json.loads((ROOT / "recipes/library/m1.json").read_text())
    out.update(fabrics=fabrics, repetitions=repetitions)
    phases = out["explorations"]["M1"]["phases"]
    phases[2].update(speed_mm_s=4, path=[{"dx_mm": 0, "dy_mm": 8}])
    for phase in (phases[0], phases[1], phases[3]):
        phase["duration_s"] = 0.5
    if hand_over:
        out["hand_over"] = hand_over
    return out


def of_pieces(text):
    """Each repetition on another piece, which makes the training slow."""
    return text | {"repetition": {"piece": "each_label_split", "pieces": text["repetitions"]}}


def recipes(folder):
    (folder / "recipes").mkdir()
    library = {"quick": recipe(FABRICS[:2], 6, {"learner": "lda", "groups": 3}),
               "slow": of_pieces(recipe(FABRICS, 8, {"learner": "best", "groups": 8})),
               "late": of_pieces(recipe(FABRICS, 8, {"learner": "best", "groups": 8, "at_most_s": 1})),
               "plain": recipe(FABRICS[:2], 2, None),
               "hopeless": recipe(FABRICS[:2], 2, {"learner": "lda"})}
    for name, text in library.items():
        (folder / "recipes" / f"{name}.json").write_text(json.dumps(text))


def weft(*arguments, status=0):
    done = subprocess.run([WEFT, "--json", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == status, done
    return json.loads(done.stdout)


def start(client, name):
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe=name, lease=lease)["run"]
    client.call("lease.release", lease=lease)
    return run


def watch(client, run):
    done = subprocess.run([WEFT, "watch", run, "--socket", client.wire.getpeername()], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done
    return done.stdout


def until_hand_over(client, run, state):
    while True:
        event = client.event()
        told = event["delta"].get("handover") if event["topic"] == f"run:{run}" else None
        if told and told.get("state") == state:
            return told


def handed_over(folder, client):
    """Trained and evaluated without a request, with progress events and digests; the model classifies another campaign."""
    report = client.call("recipe.check", recipe="hopeless")
    assert not report["ok"] and report["problems"][0]["where"] == "/hand_over", report
    sub = client.call("sub.open", topics=["run:*"], mode="every")["sub"]
    run = start(client, "quick")
    ended = client.call("run.wait", run=run)
    assert ended["outcome"] == "complete" and ended["handover"]["state"] != "none", ended
    done = client.call("run.wait", run=run, hand_over=True)
    assert done["outcome"] == "complete" and done["handover"]["state"] == "done", done
    told = [e["delta"]["handover"]["state"] for e in client.events if e["delta"].get("handover", {}).get("state")]
    assert [s for i, s in enumerate(told) if told[i - 1:i] != [s]] == ["waiting", "running", "done"], told
    assert any(e["delta"].get("handover", {}).get("what") for e in client.events), "no progress was reported"
    client.call("sub.close", sub=sub)
    assert "handover/M1.model" in watch(client, start(client, "quick")).splitlines()[-1]
    assert watch(client, run).count("handover/M1.model") == 1, "the handover is shown once"
    handover, data = done["handover"], pathlib.Path(done["folder"])
    (model,) = handover["models"]
    assert handover["bench"] == "simulated" and handover["dataset_sha256"] == done["dataset_sha256"], handover
    assert (model["model"], model["trained"], model["asked"]) == ("handover/M1.model", 12, 12), model
    assert model["sha256"] == hashlib.sha256((data / model["model"]).read_bytes()).hexdigest()
    evaluation = json.loads((data / "handover/evaluation.json").read_text())
    assert evaluation["bench"] == "simulated" and "SIMULATED" in (data / "handover/M1.html").read_text()
    asked = [r for group in evaluation["explorations"]["M1"]["groups"] for r in group["repetitions"]]
    assert sorted(asked) == [1, 2, 3, 4, 5, 6], asked
    assert client.call("run.get", run=run)["handover"] == handover
    assert weft("verify", data)["certified"]
    return run, done


def same_without_a_daemon(folder, done):
    out = folder / "by-hand"
    told = weft("run", folder / "recipes/quick.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", out, "--repeats", "2")
    assert told["handover"]["state"] == "done" and told["handover"]["models"] == done["handover"]["models"], told["handover"]
    other = folder / "other"  # trials that the model was not trained on
    weft("run", folder / "recipes/quick.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", other, "--seed", "77", "--no-evaluate")
    assert not (other / "handover").exists(), "--no-evaluate"
    answers = weft("classify", pathlib.Path(done["folder"]) / "handover/M1.model", other / "dataset.h5")["trials"]
    assert len(answers) == 12 and all(a["label"] in FABRICS[:2] for a in answers), answers


def nothing_partial(client):
    run = start(client, "quick")
    client.call("sub.open", topics=[f"run:{run}"], mode="every")
    while client.call("run.get", run=run)["trials_done"] < 1:
        client.event()
    client.call("run.stop", run=run)
    stopped = client.call("run.wait", run=run, hand_over=True)
    if stopped["outcome"] != "complete":  # the stop may have come during its last trial
        assert "handover" not in stopped and not (pathlib.Path(stopped["folder"]) / "handover").exists(), stopped
        assert client.refused("handover.start", run=run)["data"]["kind"] == "not_found"
    plain = client.call("run.wait", run=start(client, "plain"), hand_over=True)
    watched = watch(client, plain["run"])
    assert sum(has(line, ["complete", "done"]) for line in watched.splitlines()) == 1 and "hand" not in watched, watched
    assert plain["outcome"] == "complete" and "handover" not in plain, plain


def beside_others(daemon, client):
    """During a handover requests are answered, the next run completes, and a halt works; then the handover is cancelled."""
    client.call("sub.open", topics=["run:*"], mode="every")
    slow = start(client, "slow")
    until_hand_over(client, slow, "running")
    beside = subprocess.Popen([WEFT, "watch", slow, "--socket", client.wire.getpeername()], stdout=subprocess.PIPE, text=True)
    lines = beside.stdout.readline() + beside.stdout.readline()
    assert re.search(r"hand-?over\b.*\brunning\b", lines, re.I), lines
    next_run = start(client, "quick")
    ended = client.call("run.wait", run=next_run)
    assert ended["outcome"] == "complete" and ended["handover"]["state"] == "waiting", ended["handover"]
    assert client.call("run.get", run=slow)["handover"]["state"] == "running"
    client.call("rig.halt")
    assert client.call("rig.state")["rig"] == "latched"
    client.call("rig.reset", reason="nothing was moving")
    assert client.refused("handover.start", run=slow)["data"]["kind"] == "state.conflict"
    client.call("handover.cancel", run=next_run)
    assert client.call("run.get", run=next_run)["handover"]["state"] == "cancelled"
    client.call("handover.cancel", run=slow)
    cancelled = client.call("run.wait", run=slow, hand_over=True)
    printed = beside.communicate(timeout=PATIENCE_S)[0]
    shown = re.compile(r"hand-?over\b.*\bcancelled\b", re.I)
    assert beside.returncode == 0 and shown.search(printed) and shown.search(watch(client, slow)), printed
    assert (cancelled["outcome"], cancelled["handover"]["state"]) == ("complete", "cancelled"), cancelled
    assert cancelled["handover"]["by"].startswith("s-") and not (pathlib.Path(cancelled["folder"]) / "handover").exists()
    assert client.refused("handover.cancel", run=slow)["data"]["kind"] == "state.conflict"
    client.call("handover.start", run=next_run)
    assert client.call("run.wait", run=next_run, hand_over=True)["handover"]["state"] == "done"
    return slow


def too_slow(client):
    """A failed handover has an error message and does not change the run."""
    late = client.call("run.wait", run=start(client, "late"), hand_over=True)
    assert late["outcome"] == "complete" and late["dataset_sha256"], late
    assert late["handover"]["state"] == "failed" and "/hand_over/at_most_s" in late["handover"]["error"], late["handover"]
    kinds = [line["data"]["state"] for line in client.call("log.tail", run=late["run"])["lines"] if line["kind"] == "hand_over"]
    assert kinds == ["waiting", "running", "failed"], kinds


def over_restarts(folder, daemon, client, slow, done):
    """After kill -9 the next start repeats the handover. A completed or cancelled one is not repeated."""
    model = pathlib.Path(done["folder"]) / done["handover"]["models"][0]["model"]
    written = model.stat().st_mtime_ns
    client.call("sub.open", topics=[f"run:{slow}"], mode="every")
    client.call("handover.start", run=slow)
    until_hand_over(client, slow, "running")
    daemon.end(signal.SIGKILL)
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    client.call("sub.open", topics=[f"run:{slow}"], mode="every")
    assert client.call("run.get", run=slow)["handover"]["state"] in ("waiting", "running")
    kept = client.call("run.get", run=done["run"])
    assert (kept["handover"], kept["result"]) == (done["handover"], done["result"]), kept
    client.call("handover.cancel", run=slow)
    assert client.call("run.wait", run=slow, hand_over=True)["handover"]["state"] == "cancelled"
    assert daemon.end() == 0
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    assert client.call("run.get", run=slow)["handover"]["state"] == "cancelled"
    assert model.stat().st_mtime_ns == written, "done twice"
    # a damaged model is made again, with the same bytes
    model.write_bytes(model.read_bytes()[:-2])
    client.call("handover.start", run=done["run"])
    again = client.call("run.wait", run=done["run"], hand_over=True)
    assert again["handover"]["models"] == done["handover"]["models"], again["handover"]
    assert hashlib.sha256(model.read_bytes()).hexdigest() == done["handover"]["models"][0]["sha256"]
    client.call("handover.start", run=slow)
    return daemon


def given_up(folder, daemon, client, slow):
    """A handover during which the daemon died twice is not started again automatically."""
    for attempt in range(2):
        while client.call("run.get", run=slow)["handover"]["state"] != "running":
            time.sleep(0.02)
        daemon.end(signal.SIGKILL)
        daemon = Daemon(WEFTD, ROOT, folder)
        client = Client(daemon.socket)
    handover = client.call("run.get", run=slow)["handover"]
    assert handover["state"] == "failed" and "handover.start" in handover["error"], handover
    client.call("handover.start", run=slow)
    assert client.call("run.get", run=slow)["handover"]["state"] == "running"
    return daemon


def ended_in_its_last_retreat(folder):
    """SIGTERM while the probe is lifted after the last trial: the run is aborted with all of its trials, and the next daemon starts the handover."""
    daemon = Daemon(WEFTD, ROOT, folder, data="last")
    client = Client(daemon.socket)
    client.call("sub.open", topics=["run:*"], mode="every")
    client.call("sim.clock", pace=40)  # slow enough for a further slowdown in time
    run, trials = start(client, "quick"), len(FABRICS[:2]) * 6
    while client.event()["delta"].get("trials_done", 0) < trials - 2:
        pass
    client.call("sim.clock", pace=4)
    while client.event()["delta"].get("trials_done", 0) < trials - 1:
        pass
    while (client.event()["delta"].get("at") or {}).get("step") != "retracting":
        pass
    assert daemon.end() == 0
    daemon = Daemon(WEFTD, ROOT, folder, data="last")
    try:
        done = Client(daemon.socket).call("run.wait", run=run, hand_over=True)
        assert (done["state"], done["outcome"], done["trials_done"]) == ("ended", "aborted", trials), done
        assert done.get("handover", {}).get("state") == "done", done
        assert daemon.end() == 0
    finally:
        daemon.process.kill()


def made_up(folder):
    """`weft run` with a killed or skipped handover: verify reports that it is missing, --resume completes it."""
    command = [WEFT, "run", folder / "recipes/quick.json", "--rig", ROOT / "sim/rigs/bench17.json", "--repeats", "2", "--out"]
    killed = folder / "killed"
    ran = subprocess.Popen([*command, killed], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not (killed / "certificate.json").exists():
        assert ran.poll() is None, "it has ended before its handover began"
        time.sleep(0.001)
    ran.kill()
    ran.wait()
    shutil.rmtree(killed / "handover", ignore_errors=True)  # in case it finished before the signal
    left_out = folder / "left-out"
    printed = subprocess.run([*command, left_out, "--no-evaluate"], capture_output=True, text=True, check=True).stderr
    assert line_has(printed, ["--no-evaluate", "--resume"]), printed
    models = []
    for out in killed, left_out:
        seen = weft("verify", out)
        assert seen["holds"] and seen["certified"] and seen["hand_over_missing"], seen
        before = (out / "certificate.json").read_bytes()
        told = weft(*command[1:], out, "--resume")
        assert told["handover"]["state"] == "done" and (out / "handover/M1.model").exists(), told
        assert (out / "certificate.json").read_bytes() == before, "nothing was recorded"
        assert not weft("verify", out)["hand_over_missing"]
        models.append(told["handover"]["models"])
        again = subprocess.run([*command, out, "--resume", "--json"], capture_output=True, text=True)
        assert again.returncode == 1 and fits(error_of(again), code="wrong state", where=[str(out)]), again
    assert models[0] == models[1]


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipes(folder)
        daemon = Daemon(WEFTD, ROOT, folder)
        try:
            client = Client(daemon.socket)
            run, done = handed_over(folder, client)
            same_without_a_daemon(folder, done)
            nothing_partial(client)
            slow = beside_others(daemon, Client(daemon.socket))
            too_slow(client)
            daemon = over_restarts(folder, daemon, Client(daemon.socket), slow, done)
            daemon = given_up(folder, daemon, Client(daemon.socket), slow)
            made_up(folder)
            ended_in_its_last_retreat(folder)
            assert daemon.end() == 0, "a handover does not delay the end of the daemon"
        finally:
            daemon.process.kill()
    print("weftd: handed over (simulated)")


main()
