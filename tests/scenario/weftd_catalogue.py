#!/usr/bin/env python3
"""The database of weftd's runs is damaged or lost: the daemon reports what to do and changes nothing by itself. --rebuild-catalogue reads the runs
back from their folders, and no number is used twice. A folder of `weft run` is imported. Runs are listed page by page. All simulated.

    weftd_catalogue.py WEFTD WEFT SOURCE_ROOT
"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

from cli_support import line_has
from weftd_support import PATIENCE_S, Client, Daemon, command

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def recorded(client, name=""):
    """A small campaign, run to its end."""
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe="small", lease=lease, name=name)["run"]
    ended = client.call("run.wait", run=run)
    client.call("lease.release", lease=lease)
    assert ended["outcome"] == "complete", ended
    return ended


def weft_run(folder, out):
    subprocess.run([WEFT, "run", folder / "recipes/small.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", out, "--no-evaluate"],
                   check=True, capture_output=True)


def data_import(client, out):
    return subprocess.run([WEFT, "--json", "data", "import", out, "--socket", client.wire.getpeername()], capture_output=True, text=True)


def imported(client, folder):
    """A campaign folder is imported once, in its place; other folders are refused."""
    out = folder / "by-hand"
    weft_run(folder, out)
    done = data_import(client, out)
    assert done.returncode == 0, done.stderr
    run = json.loads(done.stdout)
    certified = json.loads((out / "certificate.json").read_text())
    assert (run["run"], run["state"], run["outcome"], run["folder"]) == ("R-000003", "ended", "complete", str(out)), run
    assert run["dataset_sha256"] == certified["dataset_sha256"] and run["trials_done"] == certified["trials_planned"], run
    assert client.call("run.get", run=run["run"]) == run
    assert client.call("data.verify", run=run["run"])["holds"]
    assert [line["kind"] for line in client.call("log.tail", run=run["run"])["lines"]] == ["imported"]
    assert data_import(client, out).returncode == 1 and client.refused("data.import", folder=str(out))["data"]["kind"] == "state.conflict"
    assert client.refused("data.import", folder=str(folder / "recipes"))["data"]["kind"] == "not_found"
    assert len(client.call("run.list")["runs"]) == 3
    return run


def pages(client):
    """Lists runs in both orders, by state, and in small pages."""
    ids = ["R-000001", "R-000002", "R-000003"]
    listed = lambda **params: [run["run"] for run in client.call("run.list", **params)["runs"]]
    assert listed() == ids and listed(order="newest") == ids[::-1] and listed(order="newest", most=1) == ids[2:]
    page = client.call("run.list", order="newest", most=2)
    assert page["next"] == "R-000001" and listed(order="newest", **{"from": page["next"]}) == ids[:1], page
    assert listed(state="ended") == ids and listed(state="queued") == []
    for wrong in {"order": "upwards"}, {"state": "gone"}, {"from": "R-000099"}, {"most": 0}:
        client.refused("run.list", **wrong)
    assert [d["run"] for d in client.call("data.list", order="newest")["datasets"]] == ids[::-1]


def cannot_start(folder):
    process = subprocess.run(command(WEFTD, ROOT, folder), capture_output=True, text=True, timeout=PATIENCE_S)
    assert process.returncode == 1 and str(folder / "data/weftd.sqlite") in process.stderr and "--rebuild-catalogue" in process.stderr, process


def rebuilt(folder):
    return subprocess.run(command(WEFTD, ROOT, folder, "--rebuild-catalogue"), check=True, capture_output=True, text=True, timeout=PATIENCE_S).stdout


def damaged(folder, runs):
    """A truncated file: no daemon starts and nothing changes. After the rebuild every run of the data folder is back."""
    file = folder / "data/weftd.sqlite"
    file.write_bytes(file.read_bytes()[:-4096])
    before = file.read_bytes()
    cannot_start(folder)
    assert file.read_bytes() == before
    rebuilt(folder)
    (aside,) = (folder / "data").glob("weftd.sqlite.damaged-*")
    assert aside.read_bytes() == before
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    listed = client.call("run.list")["runs"]
    assert [run["run"] for run in listed] == [run["run"] for run in runs], listed
    for now, then in zip(listed, runs):
        for same in "state", "outcome", "folder", "dataset_sha256", "trials_done", "trials_planned", "digest", "recipe", "name":
            assert now[same] == then[same], (same, now, then)
        assert (now["cleanup"], now["rig"], now["submitted_by"]) == ("unknown", "unknown", "unknown"), now
    assert "rig.unknown" in [b["kind"] for b in client.call("system.ready")["blockers"]]
    assert client.call("queue.list")["runs"] == []
    client.call("rig.reset", reason="looked at it")
    assert recorded(client)["run"] == "R-000004", "R-000003 was given before"
    assert daemon.end() == 0


def lost(folder):
    """The file is gone, and a daemon starts without a rebuild: it does not reuse a number of a folder, and does not assume that the rig is safe."""
    (folder / "data/weftd.sqlite").unlink()
    shutil.copytree(folder / "by-hand", folder / "data/by-hand")
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    assert client.call("run.list")["runs"] == []
    assert "rig.unknown" in [b["kind"] for b in client.call("system.ready")["blockers"]]
    client.call("rig.reset", reason="looked at it")
    assert recorded(client)["run"] == "R-000005"
    refused = subprocess.run(command(WEFTD, ROOT, folder, "--rebuild-catalogue"), capture_output=True, text=True, timeout=PATIENCE_S)
    assert refused.returncode == 1 and line_has(refused.stderr, ["weftd", str(folder / "data/weftd.sqlite")]), refused
    assert daemon.end() == 0
    assert "R-000006" in rebuilt(folder)
    daemon = Daemon(WEFTD, ROOT, folder)
    runs = {run["run"]: pathlib.Path(run["folder"]).name for run in Client(daemon.socket).call("run.list")["runs"]}
    assert runs == {"R-000001": "R-000001-first", "R-000002": "R-000002", "R-000004": "R-000004", "R-000005": "R-000005", "R-000006": "by-hand"}, runs
    assert daemon.end() == 0


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe["fabrics"], recipe["repetitions"] = ["denim"], 1
        (folder / "recipes").mkdir()
        (folder / "recipes/small.json").write_text(json.dumps(recipe))
        daemon = Daemon(WEFTD, ROOT, folder)
        client = Client(daemon.socket)
        runs = [recorded(client, "first"), recorded(client)]
        imported(client, folder)
        pages(client)
        assert daemon.end() == 0
        damaged(folder, runs)
        lost(folder)
    print("weftd_catalogue: all as it should be (simulated)")


main()
