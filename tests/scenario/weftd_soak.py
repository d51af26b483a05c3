#!/usr/bin/env python3
"""Many small campaigns, one after the other: the daemon's memory must not grow with them. Then a daemon with 5 000 stored runs: time to be ready, and
times of `weft status` and of pages of run.list. All simulated.

    weftd_soak.py WEFTD WEFT SOURCE_ROOT RUNS

With 5 000 RUNS or more the memory at the end is compared with that after a tenth of them; before about 500 runs the store of replayable events still
grows. With fewer, only the number of runs in the daemon's memory is checked.
"""
import json
import pathlib
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

from weftd_support import Client, Daemon

WEFTD, WEFT, ROOT, RUNS = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), int(sys.argv[4])
STORED = 5000
MOST_GROWTH = 1.1


def smallest(folder):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe.update(fabrics=["denim"], repetitions=1)
    phases = recipe["explorations"]["M1"]["phases"]
    phases[2].update(speed_mm_s=4, path=[{"dx_mm": 0, "dy_mm": 2}])
    (folder / "recipes").mkdir()
    (folder / "recipes/small.json").write_text(json.dumps(recipe))


def soak(folder):
    """Like a program: each run is started with a key, waited for and read."""
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    client.call("sub.open", topics=["run:*", "queue"], mode="latest")
    early = None
    for i in range(RUNS):
        lease = client.call("lease.acquire")["lease"]
        run = client.call("run.start", recipe="small", lease=lease, idem=f"run-{i}")["run"]
        assert client.call("run.wait", run=run)["outcome"] == "complete"
        client.call("lease.release", lease=lease)
        client.events.clear()
        if i + 1 == RUNS // 10:
            early = daemon.resident_kib()
        if (i + 1) % max(RUNS // 10, 1) == 0:
            print(f"{i + 1} runs: {daemon.resident_kib()} KiB", flush=True)
    late = daemon.resident_kib()
    first, last = client.call("run.get", run="R-000001"), client.call("run.list", order="newest", most=1)["runs"][0]
    assert (first["outcome"], last["run"]) == ("complete", f"R-{RUNS:06d}"), (first, last)
    assert client.call("system.metrics")["runs"] == {"ended": RUNS}
    opened = client.call("sub.open", topics=["run:*"])
    runs_shown = sum(topic.startswith("run:") for topic in opened["snapshot"])
    assert runs_shown + opened["left_off"] == RUNS and runs_shown <= 60, (runs_shown, opened["left_off"])
    assert client.call("sub.open", topics=["run:R-000001"])["snapshot"]["run:R-000001"]["outcome"] == "complete"
    assert daemon.end() == 0
    return early, late


def stored_runs(folder):
    """Adds rows like that of the newest run to a database that no daemon has open."""
    file = sqlite3.connect(folder / "data/weftd.sqlite")
    columns = [row[1] for row in file.execute("PRAGMA table_info(run)") if row[1] not in ("number", "folder")]
    (have,) = file.execute("SELECT max(number) FROM run").fetchone()
    names = ", ".join(columns)
    if have < STORED:
        file.execute(f"WITH RECURSIVE n(i) AS (SELECT ? UNION ALL SELECT i + 1 FROM n WHERE i < ?) INSERT INTO run (number, folder, {names}) "
                     f"SELECT i, printf('R-%06d', i), {names} FROM n JOIN run ON run.number = ?", (have + 1, STORED, have))
    file.commit()
    file.close()


def median_ms(action, times=11):
    spent = []
    for _ in range(times):
        begin = time.monotonic()
        action()
        spent.append(1e3 * (time.monotonic() - begin))
    return statistics.median(spent)


def with_many(folder):
    def start():
        daemon = Daemon(WEFTD, ROOT, folder)
        daemon.process.kill()
        daemon.process.wait()
    start()  # the handovers of these rows are resolved once
    figures = {"start": median_ms(start, 5)}
    daemon = Daemon(WEFTD, ROOT, folder)
    client = Client(daemon.socket)
    assert client.call("system.metrics")["runs"] == {"ended": STORED}
    status = [WEFT, "status", "--socket", daemon.socket]
    figures["weft status"] = median_ms(lambda: subprocess.run(status, check=True, capture_output=True))
    figures["run.list, the newest 10"] = median_ms(lambda: client.call("run.list", order="newest", most=10))
    figures["run.list, the oldest 1000"] = median_ms(lambda: client.call("run.list"))
    figures["run.get of the oldest"] = median_ms(lambda: client.call("run.get", run="R-000001"))
    listed, page = 0, client.call("run.list")
    while True:
        listed += len(page["runs"])
        if page["next"] is None:
            break
        page = client.call("run.list", **{"from": page["next"]})
    assert listed == STORED, listed
    print(f"with {STORED} runs: {daemon.resident_kib()} KiB;", "; ".join(f"{name} {ms:.1f} ms" for name, ms in figures.items()))
    assert daemon.end() == 0


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        smallest(folder)
        early, late = soak(folder)
        stored_runs(folder)
        with_many(folder)
        if RUNS >= STORED:
            assert late <= MOST_GROWTH * early, f"{early} KiB after {RUNS // 10} runs, {late} KiB after {RUNS}"
    print("weftd_soak: all as it should be (simulated)")


main()
