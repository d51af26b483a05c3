#!/usr/bin/env python3
"""Results of a finished run: its accuracy without a request, its report, its samples as tables, its trials one by one, and users' tags and notes. All
simulated.

    weftd_trials.py WEFTD WEFT SOURCE_ROOT
"""
import csv
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

from cli_support import line_has
from weftd_support import PATIENCE_S, Client, Daemon

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
RIG = ROOT / "sim/rigs/vibrotactile.json"
STREAMS = {"taxels": "taxel", "wrench": "wrench", "stages": "stages", "acceleration": "acceleration", "sound": "sound"}


def recipes(folder):
    (folder / "recipes").mkdir()
    text = json.loads((ROOT / "recipes/library/vibrotactile.json").read_text())
    text.update(fabrics=["canvas", "felt"], repetitions=3)
    del text["hand_over"]
    phases = text["explorations"]["V1"]["phases"]
    phases[2]["path"] = [{"dx_mm": 0, "dy_mm": 6}]
    for phase in (phases[0], phases[1], phases[3]):
        phase["duration_s"] = 0.5
    for name, more in ("default", {}), ("declined", {"hand_over": False}), ("once", {"repetitions": 1}):
        (folder / f"recipes/{name}.json").write_text(json.dumps(text | more))


def weft(*arguments, status=0):
    done = subprocess.run([WEFT, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == status, done
    return done.stdout


def finished(client, name):
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe=name, lease=lease)["run"]
    client.call("lease.release", lease=lease)
    return client.call("run.wait", run=run, hand_over=True)


def evaluated(client):
    """Without a request: the accuracy is in the run's state, and equals that in the list, the files and the report."""
    done = finished(client, "default")
    assert done["handover"]["state"] == "done", done["handover"]
    (one,) = done["result"]
    (model,) = done["handover"]["models"]
    assert (one["exploration"], one["tested"], one["unit"], one["labels"], one["base_rate"]) == ("V1", 6, "trials", 2, 0.5), one
    assert one["accuracy"] == model["accuracy"] and one["ci95"] == model["ci95"] and one["learner"] and one["protocol"], (one, model)
    (listed,) = [d for d in client.call("data.list")["datasets"] if d["run"] == done["run"]]
    assert listed["result"] == done["result"] == client.call("run.list")["runs"][0]["result"]
    folder = pathlib.Path(done["folder"])
    evaluation = json.loads((folder / "handover/evaluation.json").read_text())
    report = json.loads((folder / "handover/report.json").read_text())
    assert evaluation["results"] == report["headline"] == done["result"], (evaluation["results"], report["headline"])
    assert "SIMULATED" in (folder / "handover/report.html").read_text()
    files = {f["name"]: f for f in client.call("data.get", run=done["run"])["files"]}
    for name in "handover/report.html", "handover/report.json":
        assert files[name]["sha256"] == hashlib.sha256((folder / name).read_bytes()).hexdigest(), name
    assert client.call("data.verify", run=done["run"])["holds"]
    words = weft("status", "--socket", client.wire.getpeername())
    assert line_has(words, ["V1", f"{100 * one['accuracy']:.1f} %"]), words
    for name in "declined", "once":
        other = finished(client, name)
        assert (other["outcome"], other["result"]) == ("complete", None) and "handover" not in other, other
        assert not (pathlib.Path(other["folder"]) / "handover").exists()
    return done


def expected_rows(h5, trial, stream):
    """Rows of the HDF5 file, by docs/reference/dataset.md only: phase, time and values of each sample."""
    import numpy
    group = h5[STREAMS[stream]]

    def rows(kind):
        first = int(h5[f"trials/{kind}_first"][trial])
        return slice(first, first + int(h5[f"trials/{kind}_samples"][trial]))
    frames = rows("taxel")
    frame_ns, phase = h5["taxel/t_ns"][frames], h5["taxel/phase"][frames]
    if stream == "taxels":
        times, values = frame_ns, h5["taxel/counts"][frames].astype(float)
    elif stream in ("wrench", "stages"):
        part = rows(stream)
        per_unit = h5["stages/per_unit"][:] if stream == "stages" else group["quanta"].attrs["per_unit"]
        times, values = group["t_ns"][part], group["quanta"][part] / per_unit
    else:
        blocks, readings = rows(stream + "_blocks"), int(group.attrs["block_readings"])
        before_s = (readings - 1 - numpy.arange(readings)) / group.attrs["rate_hz"]
        times = (group["t_ns"][blocks][:, None] - numpy.round(before_s * 1e9).astype("i8")[None, :]).ravel()
        values = group["quanta"][blocks.start * readings:blocks.stop * readings] / group["quanta"].attrs["per_unit"]
    newest = numpy.searchsorted(frame_ns, times, side="right") - 1
    known = (newest >= 0) & (times - frame_ns[newest] <= round(2e9 / h5["taxel"].attrs["rate_hz"]))
    return [chr(phase[n]) if k else "-" for n, k in zip(newest, known)], times, values.reshape(len(times), -1)


def same_samples(file, dataset, stream):
    import h5py
    import numpy
    with h5py.File(dataset) as h5, open(file, newline="") as text:
        rows = list(csv.DictReader(text))
        columns = list(rows[0])[7:]
        place = 0
        for trial, name in enumerate(h5["trials/file"].asstr()):
            phases, times, values = expected_rows(h5, trial, stream)
            part = rows[place:place + len(times)]
            place += len(times)
            fixed = {(r["bench"], r["trial"], r["label"], r["exploration"], int(r["repetition"])) for r in part}
            assert fixed == {("simulated", name, h5["trials/label"].asstr()[trial], "V1", int(h5["trials/repetition"][trial]))}, fixed
            assert [r["phase"] for r in part] == phases, (stream, name)
            assert [round(float(r["t_s"]) * 1e9) for r in part] == times.tolist(), (stream, name)
            assert numpy.abs(numpy.array([[float(r[c]) for c in columns] for r in part]) - values).max() < 1e-12, (stream, name)
        assert place == len(rows) > 0
    return columns


def samples(client, folder, done):
    """Each stream as a table, listed with its digest; the command line gives the same, and the values equal those of the HDF5 file."""
    run, data = done["run"], pathlib.Path(done["folder"])
    units = {"taxels": "ch1_counts", "wrench": "fx_N", "stages": "x_m", "acceleration": "ax_mps2", "sound": "sound_Pa"}
    for stream in STREAMS:
        made = client.call("data.export", run=run, format="samples-csv", stream=stream)
        file = data / made["name"]
        assert (made["name"], made["trials"], made["bench"]) == (f"export/samples-{stream}.csv", 6, "simulated"), made
        assert made["dataset_sha256"] == done["dataset_sha256"]
        assert hashlib.sha256(file.read_bytes()).hexdigest() == made["sha256"]
        try:
            import h5py  # noqa: F401
            import numpy  # noqa: F401
        except ImportError:
            print("python3-h5py is not installed: the tables were not compared with the HDF5 file")
            continue
        assert same_samples(file, data / "dataset.h5", stream)[0] == units[stream]
    by_hand = json.loads(weft("--json", "export", data, "--format", "samples-csv", "--stream", "sound"))
    assert by_hand["sha256"] == made["sha256"], (by_hand, made)
    exports = client.call("data.get", run=run)["exports"]
    assert len(exports) == 5 and {e["state"] for e in exports} == {"current"}, exports
    for wrong, where in ({"format": "samples-csv"}, "/params/stream"), ({"stream": "sound"}, "/params/stream"), \
            ({"format": "samples-csv", "stream": "smell"}, "/params/stream"):
        assert client.refused("data.export", run=run, **wrong)["data"]["where"] == where, wrong


def trials(client, done):
    """The records of each attempt, page by page; the curves of one, reduced."""
    run = done["run"]
    page = client.call("data.trials", run=run, most=4)
    rest = client.call("data.trials", run=run, **{"from": page["next"]})
    assert (page["next"], rest["next"], page["bench"]) == (4, None, "simulated")
    all_of_it = page["trials"] + rest["trials"]
    assert [(t["index"], t["label"], t["repetition"]) for t in all_of_it] == \
        [(i, ("canvas", "felt")[i // 3], i % 3 + 1) for i in range(6)], all_of_it
    for one in all_of_it:
        assert (one["outcome"], one["reason"], one["lost_frames"], one["attempt"]) == ("complete", None, 0, 0), one
        assert 0 < one["force_rms_error_N"] <= one["force_worst_error_N"] < 1 and 0.5 < one["force_in_band_share"] <= 1, one
    name = all_of_it[1]["trial"]
    told = client.call("data.trial", run=run, trial=name, points=200)
    assert (told["trial"], told["label"], [p["phase"] for p in told["phases"]]) == (name, "canvas", list("SPME")), told["phases"]
    assert told["target"] == {"phase": "M", "force_N": 3, "band_N": 0.25}
    for kind, names in ("force", ("fx_N", "fy_N", "fz_N")), ("stages", ("x_mm", "y_mm", "z_mm")):
        curve = told[kind]
        assert 50 < len(curve["t_s"]) <= 200, (kind, len(curve["t_s"]))
        times = [t for t in curve["t_s"] if t is not None]
        assert times == sorted(times) and times[0] >= 0
        for each in names:
            low, high = curve[each]["min"], curve[each]["max"]
            assert len(low) == len(high) == len(curve["t_s"])
            assert all((a is None) == (b is None) == (t is None) and (a is None or a <= b) for a, b, t in zip(low, high, curve["t_s"])), each
    motion = told["phases"][2]
    held = [(a + b) / 2 for t, a, b in zip(told["force"]["t_s"], told["force"]["fz_N"]["min"], told["force"]["fz_N"]["max"])
            if t is not None and motion["begin_s"] + 0.1 < t < motion["end_s"] - 0.1]
    assert held and abs(sum(held) / len(held) - 3) < 0.25, held
    taxels = told["taxels"]
    assert len(taxels["counts"]) == len(taxels["t_s"]) <= 300
    assert len(taxels["mean_S_counts"]) == len(taxels["mean_M_counts"]) == len(taxels["counts"][0])
    assert sum(taxels["mean_M_counts"]) != sum(taxels["mean_S_counts"])
    assert len(client.call("data.trial", run=run, trial=name)["force"]["t_s"]) > 200
    assert client.refused("data.trial", run=run, trial="0099-canvas")["data"]["kind"] == "not_found"
    assert client.refused("data.trial", run=run, trial=name, points=9)["data"]["where"] == "/params/points"
    assert client.refused("data.trials", run=run, most=201)["data"]["where"] == "/params/most"


def ids(client, **what):
    return [r["run"] for r in client.call("run.list", **what)["runs"]]


def annotated(client, done):
    """Tags and a note by operators: they are in the journal, and a search finds them."""
    run = done["run"]
    client.call("sub.open", topics=[f"run:{run}"], mode="every")
    told = client.call("run.annotate", run=run, tags=["damp", "Größe 2"], note="the cloth was damp", idem="n1")
    assert client.call("run.annotate", run=run, tags=["damp", "Größe 2"], note="the cloth was damp", idem="n1") == told
    assert (told["tags"], told["note"]) == (["damp", "Größe 2"], "the cloth was damp"), told
    while client.event()["delta"].get("note") != "the cloth was damp":
        pass
    assert client.call("run.annotate", run=run, tags=["wet"])["note"] == "the cloth was damp", "what is not given stays"
    words = weft("annotate", run, "--tag", "a b", "--tag", "c", "--note", "by Ada", "--socket", client.wire.getpeername())
    assert "a b, c" in words and "by Ada" in words, words
    kept = client.call("run.get", run=run)
    assert (kept["tags"], kept["note"]) == (["a b", "c"], "by Ada") and kept in client.call("run.list")["runs"], kept
    lines = client.call("log.query", run=run, kind="note")["lines"]
    assert [line["data"]["tags"] for line in lines] == [["damp", "Größe 2"], ["wet"], ["a b", "c"]], lines
    for wrong, where in ({}, "note"), ({"tags": ["t"] * 17}, "tags"), ({"tags": ["ü" * 41]}, "tags"), ({"tags": [""]}, "tags"), \
            ({"tags": [1]}, "tags"), ({"note": "n" * 4001}, "note"):
        assert client.refused("run.annotate", run=run, **wrong)["data"]["where"] == f"/params/{where}", wrong
    client.call("run.annotate", run=run, tags=["ü" * 40] * 16, note="n" * 4000)
    client.call("run.annotate", run=run, tags=["a b", "c"], note="by Ada")
    for text in "A B", "by ada", "DEFAULT", run.lower():
        assert ids(client, search=text) == [run], text
    every = ids(client)
    assert ids(client, search="felt") == ids(client, search="complete") == every and ids(client, search="json") == []
    first = client.call("run.list", search="felt", most=1)
    assert [r["run"] for r in first["runs"]] == every[:1] and first["next"] == every[1], first
    assert ids(client, search="felt", most=5, **{"from": first["next"]}) == every[1:]
    assert client.refused("run.list", search="x" * 41)["data"]["where"] == "/params/search"
    return client.call("run.get", run=run)


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipes(folder)
        daemon = Daemon(WEFTD, ROOT, folder, rig=RIG)
        try:
            client = Client(daemon.socket)
            done = evaluated(client)
            samples(client, folder, done)
            trials(client, done)
            before = annotated(client, done)
            assert daemon.end() == 0
            daemon = Daemon(WEFTD, ROOT, folder, rig=RIG)
            after = Client(daemon.socket).call("run.get", run=done["run"])
            for key in "result", "tags", "note", "handover":
                assert after[key] == before[key], (key, after[key])
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("weftd: results found again (simulated)")


main()
