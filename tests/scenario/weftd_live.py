#!/usr/bin/env python3
"""Live votes over weftd's socket: a small campaign trains a model; the next campaign uses it and ends its strokes when the prediction is certain. All
simulated.

    weftd_live.py WEFTD WEFT SOURCE_ROOT
"""
import json
import pathlib
import subprocess
import sys
import tempfile

from weftd_support import Client, Daemon

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def recipe(repetitions):
    out = json.loads((ROOT / "recipes/library/m1.json").read_text())
    out.update(fabrics=["pile", "nylon"], repetitions=repetitions)
    phases = out["explorations"]["M1"]["phases"]
    phases[2].update(speed_mm_s=4, path=[{"dx_mm": 0, "dy_mm": 16}])
    for phase in (phases[0], phases[1], phases[3]):
        phase["duration_s"] = 0.5
    return out


def weft(*arguments):
    done = subprocess.run([WEFT, *arguments, "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done
    return json.loads(done.stdout)


def model(folder):
    (folder / "first.json").write_text(json.dumps(recipe(4)))
    weft("run", folder / "first.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", folder / "first", "--no-evaluate")
    told = weft("train", folder / "first" / "dataset.h5", "--live", "--learner", "lda", "-o", folder / "recipes" / "m1.live")
    assert told["live"] and [s["slide_s"] for s in told["stages"]][1:] == [1, 2, 3, 4], told
    asked = recipe(2)
    asked["explorations"]["M1"]["live_vote"] = {"model": "m1.live", "stop_early": {"sure_probability": 0.8, "least_slide_s": 1}}
    (folder / "recipes" / "live.json").write_text(json.dumps(asked))
    asked["explorations"]["M1"]["live_vote"]["model"] = "none.live"
    (folder / "recipes" / "lost.json").write_text(json.dumps(asked))


def votes(folder, client):
    report = client.call("recipe.check", recipe="lost")
    assert not report["ok"] and "/explorations/M1/live_vote/model" in report["problems"][0]["where"], report
    assert client.call("recipe.check", recipe="live")["ok"]
    lease = client.call("lease.acquire")["lease"]
    assert client.refused("run.start", recipe="lost", lease=lease)["data"]["kind"] == "not_found"
    client.call("sub.open", topics=["vote:*"], mode="every")
    run = client.call("run.start", recipe="live", lease=lease)["run"]
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["cleanup"], ended["rig"]) == ("complete", "done", "safe"), ended
    assert ended["trials_done"] == 4, ended
    newest = client.call("classify.live", run=run)["vote"]
    assert newest["trial"] == 3 and newest["ends_slide"] and newest["winner"] == newest["fabric"], newest
    share = {one["label"]: one["probability"] for one in newest["probability"]}
    assert abs(sum(share.values()) - 1) < 1e-6 and share[newest["winner"]] >= 0.8, newest
    assert newest["model_bench"] == "simulated", newest
    client.call("session.whoami")  # all events published before this answer have arrived
    told = [e["delta"] for e in client.events if e["topic"] == "vote:" + run]
    # a delta has the changes: from the end of a trial to the start of the next one the length decreases
    assert len(told) >= 8 and all("slide_s" in delta for delta in told), told
    assert client.refused("classify.live", run="R-999999")["data"]["kind"] == "not_found"
    return pathlib.Path(ended["folder"]), ended


def marked(data, ended):
    assert "dataset_sha256" not in ended and not (data / "dataset.h5").exists(), "no whole slide, and yet a data set"
    verified = weft("verify", data)
    assert verified["trials_complete"] == 4, verified
    log = subprocess.run([WEFT, "dataset", "export", data / "campaign.sqlite", "-o", data / "x.h5"], capture_output=True, text=True)
    assert log.returncode != 0 or "ended_early" in log.stdout + log.stderr, log


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "recipes").mkdir()
        model(folder)
        daemon = Daemon(WEFTD, ROOT, folder)
        try:
            marked(*votes(folder, Client(daemon.socket)))
        finally:
            assert daemon.end() == 0
    print("weftd_live: all as it should be")


if __name__ == "__main__":
    main()
