"""Uses the installed Python client with a daemon on the simulated bench. Run by python_client.py.

    python_client_scene.py SCENE.json      places of the daemons, tokens and certificates
"""
import asyncio
import hashlib
import json
import pathlib
import sys
import threading

import weft_client
from weft_client import AccessError, ConnectionLost, DataAltered, RequestError, StateError, WeftError, connect

PATIENCE_S = 240


def refused(kind, call, *args, **named):
    try:
        call(*args, **named)
    except WeftError as error:
        assert isinstance(error, kind), (type(error), error)
        return error
    raise AssertionError(f"{call} was not refused")


def until(watch, state):
    for event in watch:
        if event.state.get("state") == state:
            return event
    raise AssertionError(f"never {state}")


def held(client, lease, **how):
    """A run that is paused."""
    run = client.start("long", lease, **how)
    with run.watch(mode="every") as watch:
        until(watch, "running")
        run.pause(now=True)
        until(watch, "held")
    return run


def before_anything_moves(client):
    assert (client.role, client.ready()) == ("admin", [])
    assert set(client.recipes()) == {"long", "people", "small"}
    check = client.check("small")
    assert check.ok and check.disk_ok and check.plan["trials"] == 4 and check.plan["eta_s"] > 60, check
    error = refused(RequestError, client.check, "smal")
    assert error.where and error.kind, error
    error = refused(RequestError, client.call, "run.get", {"ran": "R-000001"})
    assert error.kind == "param.unknown" and "run" in error.hint, error
    assert {m["name"] for m in client.api.rpc.discover()["methods"]} >= {"run.start", "sub.open"}


def orders(client, lease):
    run = held(client, lease, name="orders")
    with run.watch(mode="every") as watch:
        try:
            run.wait(timeout_s=0.05)
            raise AssertionError("it is held, and has ended")
        except TimeoutError:
            pass
        run.resume()
        assert until(watch, "ended").state["outcome"] == "complete"
    end = run.wait()
    assert (end.outcome, end.cleanup, end.rig, end.error) == ("complete", "done", "safe", "") and len(end.dataset_sha256) == 64, end
    assert [e.state["state"] for e in run.watch()] == ["ended"], "a watch of what is over"
    for order, outcome in ("stop", "stopped"), ("abort", "aborted"):
        other = held(client, lease)
        getattr(other, order)()
        assert other.wait().outcome == outcome
    again = client.start("small", lease, idem="once")
    assert client.start("small", lease, idem="once").name == again.name, "started twice"
    assert again.wait().outcome == "complete"
    assert [r.name for r in client.runs()][:1] == [run.name]
    return run


def people(client, lease):
    run = client.start("people", lease)
    asked = 0
    for event in run.watch():
        if event.state["state"] == "awaiting_operator" and (event.state.get("attention") or {}).get("asked"):
            refused(StateError, run.confirm, "Q-999")
            run.confirm()
            asked += 1
    assert run.wait().outcome == "complete" and asked >= 2, asked
    refused(RequestError, run.confirm)


async def side_by_side(client, lease):
    """Two watches on one event loop during a whole run."""
    run = client.start("small", lease)

    async def states(**how):
        return [event.state["state"] async for event in run.watch(**how)]

    every, latest, end = await asyncio.gather(states(mode="every"), states(max_hz=50), asyncio.to_thread(run.wait))
    assert every[-1] == latest[-1] == "ended" and end.outcome == "complete", (every, latest, end)


def halt(client, scene, lease):
    run = held(client, lease)
    told = weft_client.halt(scene["socket"])
    assert told["latched"] == "halt", told
    end = run.wait()
    assert (end.outcome, end.cleanup) == ("aborted", "skipped") and client.api.rig.state()["rig"] == "latched", end
    assert client.ready()[0]["kind"] == "rig.latched"
    waits = client.start("small", lease)
    assert waits.state()["state"] == "queued", "nothing begins on a latched rig"
    client.reset("a test has looked at it")
    client.api.queue.start(lease=lease.name)
    end = waits.wait()
    assert end.outcome == "complete", end.state
    client.halt()
    recipes = pathlib.Path(scene["folder"]) / "recipes"
    (recipes / "gone.json").write_text((recipes / "small.json").read_text())
    waits = client.start("gone", lease)
    (recipes / "gone.json").unlink()  # before the run begins
    client.reset("and again")
    client.api.queue.start(lease=lease.name)
    end = waits.wait()
    assert end.outcome == "complete", f"what was checked is what runs: {end}"
    client.halt()
    waits = client.start("small", lease)
    occupied = pathlib.Path(waits.state()["folder"])
    occupied.mkdir()
    (occupied / "campaign.sqlite").write_text("somebody else's")
    client.reset("once more")
    client.api.queue.start(lease=lease.name)
    end = waits.wait()
    assert end.outcome == "failed" and "campaign.sqlite" in end.error, end
    refused(AccessError, weft_client.halt, scene["tcp"])


def leases(client, scene):
    lost = threading.Event()
    with client.lease(note="short", ttl_ms=1000, on_lost=lambda error: lost.set()) as lease:
        expires = lease.expires_us
        with connect(scene["tcp"], token=scene["operator"]) as other:
            refused(WeftError, other.lease)
            with other.watch("lease:*") as watch:
                while lease.expires_us < expires + 1_000_000:  # at least two renewals
                    watch.next(0.1)
        client.api.lease.break_(lease=lease.name, reason="a test")
        assert lost.wait(PATIENCE_S) and isinstance(lease.lost, WeftError), lease.lost
    assert client.api.lease.list()["leases"] == []


def tokens(scene):
    with connect(scene["tcp"], token=scene["observer"]) as client:
        assert client.role == "observer" and client.api.session.whoami()["local"] is False
        assert refused(AccessError, client.lease).kind == "access.role"
    assert refused(AccessError, connect, scene["tcp"], token="wft_" + 64 * "0").kind == "access.token"
    refused(ConnectionLost, connect, "tcp://127.0.0.1:1", token=scene["observer"])
    refused(ConnectionLost, connect, "/no/such.sock")


def tls(scene):
    with connect(scene["tls"], token=scene["operator"], tls_ca=scene["ca"], http=scene["https"]) as client:
        assert client.role == "operator"
        answers = [client.request("rpc.discover", {}) for _ in range(40)]  # large answers while requests are written
        assert len({json.dumps(a.result(PATIENCE_S), sort_keys=True) for a in answers}) == 1
        with client.lease() as lease:
            run = client.start("small", lease)
            assert until(run.watch(mode="every"), "ended").state["outcome"] == "complete"
        run.wait()
        fetched(run, pathlib.Path(scene["folder"]) / "over-tls")
    refused(ConnectionLost, connect, scene["tls"], token=scene["operator"], tls_ca=scene["other_ca"])


def fetched(run, folder):
    folder.mkdir()
    names = {file.name: file for file in run.files()}
    assert {"certificate.json", "campaign.sqlite", "dataset.h5"} <= set(names), names
    cut = names["dataset.h5"].bytes // 3
    whole = (run.folder() / "dataset.h5").read_bytes()
    (folder / "dataset.h5.part").write_bytes(whole[:cut])
    place = run.download("dataset.h5", folder)
    assert hashlib.sha256(place.read_bytes()).hexdigest() == names["dataset.h5"].sha256
    run.download("certificate.json", folder / "mine.json")
    refused(RequestError, run.download, "tokens.json", folder)
    assert sorted(p.name for p in folder.iterdir()) == ["dataset.h5", "mine.json"]
    for name in ("dataset.h5", "certificate.json"):  # a folder that does not exist yet
        run.download(name, f"{folder}/there/")
    assert sorted(p.name for p in (folder / "there").iterdir()) == ["certificate.json", "dataset.h5"]


def altered(run, folder):
    """A file that was changed is refused as a download."""
    file = run.folder() / "dataset.h5"
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    refused(DataAltered, run.download, "dataset.h5", folder)
    assert not run.verify()["holds"]
    file.write_bytes(whole)
    assert run.verify()["holds"]


def main():
    scene = json.loads(pathlib.Path(sys.argv[1]).read_text())
    assert "site-packages" in weft_client.__file__, weft_client.__file__
    with connect(scene["socket"], http=scene["http"], token=scene["observer"], program="scene") as client:
        before_anything_moves(client)
        with client.lease(note="scene") as lease:
            run = orders(client, lease)
            people(client, lease)
            asyncio.run(side_by_side(client, lease))
            halt(client, scene, lease)
        leases(client, scene)
        fetched(run, pathlib.Path(scene["folder"]) / "over-http")
        altered(run, pathlib.Path(scene["folder"]) / "over-http")
    tokens(scene)
    tls(scene)
    print("the Python client: all of it held (simulated)")


main()
