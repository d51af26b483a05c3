#!/usr/bin/env python3
"""Live samples of a run over weftd's socket, at the requested simulation speed. All simulated.

    weftd_samples.py WEFTD SOURCE_ROOT
"""
import json
import pathlib
import sys
import tempfile
import time

from weftd_support import Client, Daemon

WEFTD, ROOT = sys.argv[1], pathlib.Path(sys.argv[2])
PACE = 8
SLIDE_MM = 16
TOPICS = "stream:force", "stream:stages", "stream:taxels"


def recipe():
    out = json.loads((ROOT / "recipes/library/m1.json").read_text())
    out.update(fabrics=["denim"], repetitions=1)
    phases = out["explorations"]["M1"]["phases"]
    phases[2].update(speed_mm_s=4, path=[{"dx_mm": 0, "dy_mm": SLIDE_MM}])
    for phase in (phases[0], phases[1], phases[3]):
        phase["duration_s"] = 0.5
    return {key: value for key, value in out.items() if key != "$schema"}


def watched(client, lease):
    """Follows a run to its end. Returns its samples by topic, each with the wall time of its arrival."""
    told = {topic: [] for topic in TOPICS}
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    while True:
        event = client.event()
        if event["topic"] in told:
            assert event["delta"]["run"] == run, event
            told[event["topic"]].append((time.monotonic(), event["delta"]))
        if event["topic"] == "run:" + run and event["delta"].get("state") == "ended":
            assert event["delta"]["outcome"] == "complete", event
            return told


def check_samples(told):
    for topic, frames in told.items():
        times = [delta["bench_s"] for _, delta in frames]
        assert len(times) > 20 and times == sorted(set(times)), (topic, len(times))
    forces = [delta for _, delta in told["stream:force"]]
    assert all(f["fz_min_n"] <= f["fz_n"] <= f["fz_max_n"] for f in forces), forces
    assert min(f["fz_min_n"] for f in forces) < 0.5 < 4 < max(f["fz_max_n"] for f in forces), "never pressed, or never let go"
    places = [delta["position_mm"] for _, delta in told["stream:stages"]]
    on_cloth = [p["y"] for p in places if p["z"] > max(p["z"] for p in places) - 0.3]  # z counts downwards
    slid = max(on_cloth) - min(on_cloth)
    assert abs(slid - SLIDE_MM) < 1, slid
    assert set(told["stream:stages"][0][1]["angle_deg"]) == {"rx", "ry"}
    counts = [delta["counts"] for _, delta in told["stream:taxels"]]
    assert all(len(c) == 16 for c in counts) and len({tuple(c) for c in counts}) > 20, "the pads do not change"


def check_pace(told):
    """A slowed run cannot be faster than requested; how slow it is depends on the machine."""
    frames = told["stream:stages"]
    wall_s, bench_s = frames[-1][0] - frames[0][0], frames[-1][1]["bench_s"] - frames[0][1]["bench_s"]
    lag_s = 0.5  # delay of a frame
    assert bench_s <= PACE * (wall_s + lag_s), (bench_s, wall_s)


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for each in "recipes", "data":
            (folder / each).mkdir()
        (folder / "recipes/small.json").write_text(json.dumps(recipe()))
        daemon = Daemon(WEFTD, ROOT, folder, "--pace", str(PACE))
        client = Client(daemon.socket)
        assert client.call("system.info")["pace"] == PACE and client.call("system.info")["bench"] == "simulated"
        for wrong in 0.5, -1, 1e7:
            assert client.refused("sim.clock", pace=wrong)["data"]["where"] == "/params/pace", wrong
        lease = client.call("lease.acquire", ttl_ms=600000)["lease"]
        opened = client.call("sub.open", topics=["run:*", *TOPICS], mode="every")
        assert not opened["snapshot"], opened
        told = watched(client, lease)
        check_samples(told)
        check_pace(told)

        assert client.call("sim.clock", pace=1)["pace"] == 1
        run = client.call("run.start", recipe="small", lease=lease)["run"]
        client.until(run, "running")
        client.call("run.pause", run=run, at="now")  # received while the bench waits for its time
        client.until(run, "held")
        client.call("sim.clock", pace=0)
        client.call("run.resume", run=run)
        client.until(run, "ended")
        assert daemon.end() == 0
    print("samples at pace", PACE, "times real time (SIMULATED):", {topic: len(frames) for topic, frames in told.items()})


if __name__ == "__main__":
    main()
