#!/usr/bin/env python3
"""Motion outside a run over weftd's socket: retract after a halt on the fabric, park, jog; refusals, interruptions, and the state after a crash. All
simulated; the last part on the emulated bench of weft-rig in real time.

    weftd_motion.py WEFTD WEFT WEFT_RIG SOURCE_ROOT
"""
import contextlib
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from emulated_support import ServedRig, near_home, rig_file
from weftd_support import Client, Daemon

WEFTD, WEFT, WEFT_RIG, ROOT = sys.argv[1], sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
CLEAR_Z_M = 0.052     # bench17: plate at 60 mm, clearance 8 mm
EMULATED_CLEAR_Z_M = 0.008


def refused(client, method, kind, **params):
    error = client.refused(method, **params)
    assert error["data"]["kind"] == kind, (method, params, error)


def watched(daemon, ttl_ms=600_000):
    client = Client(daemon.socket)
    client.call("sub.open", topics=["run:*", "rig"], mode="every")
    return client, client.call("lease.acquire", ttl_ms=ttl_ms)["lease"]


def halted_on_the_cloth(client, lease):
    """A run that is halted while its probe slides over the fabric."""
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    while (client.event()["delta"].get("at") or {}).get("step") != "sliding":
        pass
    client.call("rig.halt", reason="smoke")
    ended = client.call("run.wait", run=run)
    assert (ended["outcome"], ended["cleanup"]) == ("aborted", "skipped"), ended


def begun(client, method, **params):
    """Starts a motion and returns the id of its call. The answer has not come yet. The stages have begun to move."""
    client.last = call = client.last + 1
    client.events.clear()
    client.send(json.dumps({"jsonrpc": "2.0", "id": call, "method": method, "params": params}))
    while client.event()["delta"].get("maintenance") is None:
        pass
    while maintenance(client)[-1]["state"] != "moving":
        time.sleep(0.01)
    return call


def answer_of(client, call):
    while (message := client.read()).get("id") != call:
        pass
    return message["result"]


def maintenance(client):
    return [line["data"] for line in client.call("log.query", kind="maintenance")["lines"]]


def lifts(client, lease):
    refused(client, "rig.retract", "state.conflict", lease=lease)  # latched
    client.call("rig.reset", reason="looked at")
    refused(client, "rig.retract", "lease.required", lease="none")
    assert maintenance(client) == [], "nothing moves without lease and reset"
    done = client.call("rig.retract", lease=lease)
    assert (done["order"], done["outcome"], done["rig"], done["relative"]) == ("retract", "complete", "safe", False), done
    assert done["from"]["z_m"] > CLEAR_Z_M + 1e-3 and abs(done["to"]["z_m"] - CLEAR_Z_M) < 5e-6, done
    assert all(abs(done["to"][axis] - done["from"][axis]) < 1e-4 for axis in ("x_m", "y_m", "rx_rad", "ry_rad")), done
    lines = maintenance(client)
    assert [line["state"] for line in lines] == ["begun", "moving", "ended"], lines
    assert lines[2]["from"] == done["from"] and lines[2]["to"] == done["to"] and lines[2]["rig"] == "safe", lines
    assert client.call("rig.state")["rig"] == "safe"


def jogs(daemon, client, lease):
    for axis, distance, kind in ("x", 0.006, "param.range"), ("rx", 0.02, "param.range"), ("z", 0.0, "param.range"), \
            ("w", 0.001, "request.invalid"):
        error = client.refused("rig.jog", lease=lease, axis=axis, distance=distance)
        assert error["data"]["kind"] == kind, (axis, distance, error)
    before = len(maintenance(client))
    there = client.call("rig.jog", lease=lease, axis="x", distance=-0.002)
    assert there["outcome"] == "complete" and abs(there["to"]["x_m"] - there["from"]["x_m"] + 0.002) < 5e-6, there
    down = client.call("rig.jog", lease=lease, axis="z", distance=0.001)
    assert down["outcome"] == "complete" and down["rig"] == "holding" and abs(down["to"]["z_m"] - CLEAR_Z_M - 0.001) < 1e-4, down
    assert len(maintenance(client)) == before + 6
    client.call("lease.release", lease=lease)
    said = subprocess.run([WEFT, "--json", "jog", "z", "-2", "--socket", daemon.socket], capture_output=True, text=True)
    assert said.returncode == 0 and json.loads(said.stdout)["rig"] == "safe", said
    said = subprocess.run([WEFT, "jog", "z", "6", "--socket", daemon.socket], capture_output=True, text=True)
    assert said.returncode != 0 and "jog" in said.stderr, said
    return client.call("lease.acquire", ttl_ms=600_000)["lease"]


def is_halted(client, lease):
    """A halt stops a park; meanwhile no other motion starts."""
    client.call("sim.clock", pace=1)
    call = begun(client, "rig.park", lease=lease)
    state = client.call("rig.state")
    assert (state["rig"], state["maintenance"]) == ("moving", "park"), state
    refused(client, "rig.retract", "state.conflict", lease=lease)
    refused(client, "rig.reset", "state.conflict", reason="looked at")
    client.send('{"jsonrpc": "2.0", "id": "halt", "method": "rig.halt"}')
    done = answer_of(client, call)
    assert done["outcome"] == "aborted" and done["to"]["x_m"] > 1e-3, done
    state = client.call("rig.state")
    assert state["rig"] == "latched" and "maintenance" not in state, state
    client.call("sim.clock", pace=0)
    client.call("rig.reset", reason="looked at")
    parked = client.call("rig.park", lease=lease)
    assert parked["outcome"] == "complete" and parked["rig"] == "safe", parked
    assert all(abs(parked["to"][axis]) < 1e-5 for axis in ("x_m", "y_m", "rx_rad", "ry_rad")), parked


def ends_with_the_daemon(folder, daemon, client, lease):
    """SIGTERM aborts a motion and records its end; after SIGKILL the rig is unknown."""
    halted_on_the_cloth(client, lease)
    client.call("rig.reset", reason="looked at")
    client.call("sim.clock", pace=1)
    begun(client, "rig.retract", lease=lease)
    assert daemon.end() == 0
    daemon = Daemon(WEFTD, ROOT, folder, "--pace", "2")
    client, lease = watched(daemon)
    last = maintenance(client)[-1]
    assert (last["state"], last["outcome"], last["rig"]) == ("ended", "aborted", "holding"), last
    assert client.call("rig.state")["rig"] != "unknown"
    begun(client, "rig.retract", lease=lease)  # stages that a new process has switched on move by 8 mm, slowly
    assert daemon.end(signal.SIGKILL) == -signal.SIGKILL
    daemon = Daemon(WEFTD, ROOT, folder)
    client, lease = watched(daemon)
    state = client.call("rig.state")
    assert state["rig"] == "unknown" and state["left_by"].startswith("retract"), state
    refused(client, "rig.park", "state.conflict", lease=lease)
    assert daemon.end() == 0


def simulated(folder):
    daemon = Daemon(WEFTD, ROOT, folder, "--pace", "10")
    client, lease = watched(daemon)
    halted_on_the_cloth(client, lease)
    lifts(client, lease)
    lease = jogs(daemon, client, lease)
    is_halted(client, lease)
    client.call("sim.clock", pace=10)
    ends_with_the_daemon(folder, daemon, client, lease)


def emulated(folder):
    """True positions from another process: the probe leaves the fabric, and the monitor stops a jog after its daemon was killed."""
    path, rig = rig_file(ROOT, folder)
    near_home(path, rig, (18, 24))
    with ServedRig(WEFT_RIG, path, rig) as served, contextlib.ExitStack() as ending:
        daemon = Daemon(WEFTD, ROOT, folder, data="emulated", rig=path)
        ending.callback(daemon.process.kill)
        client, lease = watched(daemon)
        halted_on_the_cloth(client, lease)
        assert served.order(order="truth")["contact_force_n"] > 0.5
        client.call("rig.reset", reason="looked at")
        done = client.call("rig.retract", lease=lease)
        truth = served.order(order="truth")
        assert done["outcome"] == "complete" and not done["relative"], done
        assert truth["contact_force_n"] == 0 and abs(truth["probe_z_m"] - EMULATED_CLEAR_Z_M) < 2e-3, truth
        begun(client, "rig.jog", lease=lease, axis="z", distance=-0.005)
        while abs(served.order(order="truth")["probe_z_m"] - truth["probe_z_m"]) < 2e-4:
            time.sleep(0.05)
        daemon.process.kill()
        daemon.process.wait()
        places = []
        while len(places) < 2 or abs(places[-1] - places[-2]) > 1e-6:
            places.append(served.order(order="truth")["probe_z_m"])
            time.sleep(0.3)
        assert truth["probe_z_m"] - places[-1] < 0.004, (truth, places)  # short of its target
        daemon = Daemon(WEFTD, ROOT, folder, data="emulated", rig=path)
        ending.callback(daemon.process.kill)
        assert Client(daemon.socket).call("rig.state")["rig"] == "unknown"
        assert daemon.end() == 0


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe.update(fabrics=["denim"], repetitions=1)
        for phase in recipe["explorations"]["M1"]["phases"]:
            if phase["phase"] == "M":
                phase["path"] = [{"dx_mm": 0, "dy_mm": 6}]
        for name in "recipes", "data", "emulated":
            (folder / name).mkdir()
        (folder / "recipes/small.json").write_text(json.dumps({k: v for k, v in recipe.items() if k != "$schema"}))
        simulated(folder)
        emulated(folder)
    print("ok")


if __name__ == "__main__":
    main()
