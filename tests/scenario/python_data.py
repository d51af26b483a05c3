#!/usr/bin/env python3
"""A small simulated campaign read by the Python client with numpy, pandas, xarray and scikit-learn, and written as Parquet and MCAP. Every value is
compared with h5py's own reading of the file; pyarrow and the mcap reader read the exports back. Packages from PyPI at pinned versions
(python_data.txt).

    python_data.py WEFT SOURCE_ROOT FOLDER      FOLDER has their virtual environment, and is made if it does not exist

WEFT_CLIENT names a folder with an installed weft_client, tested in place of the source tree's. Exit 77 (skipped) if PyPI cannot be reached or is too slow.
"""
import collections
import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import pypi_environment

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_suffix(".txt"))

ROOT = pathlib.Path(sys.argv[2]).resolve()
CLIENT = pathlib.Path(os.environ.get("WEFT_CLIENT", ROOT / "clients/python/src"))
sys.path.insert(0, str(CLIENT))

import h5py
import numpy
import pyarrow.parquet
from mcap.reader import make_reader
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.model_selection import GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from cli_support import Checks
from weft_client import WeftError, _arrays
from weft_client.campaign import Campaign
from weft_client.dataset import DataSet
from weft_client.frames import samples

FABRICS, REPETITIONS = ["denim", "silk"], 4
TRIALS = len(FABRICS) * REPETITIONS
WRENCH = ["fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"]
STAGES = ["x_m", "y_m", "z_m", "rx_rad", "ry_rad"]


def same(a, b):
    return numpy.array_equal(numpy.asarray(a), numpy.asarray(b))


def raw(path):
    """The file as h5py alone reads it, by docs/reference/dataset.md: a record for each trial."""
    with h5py.File(path) as f:
        column = {name: values[:] for name, values in f["trials"].items()}
        wrench = f["wrench/quanta"][:] / f["wrench/quanta"].attrs["per_unit"]
        stages = f["stages/quanta"][:] / f["stages/per_unit"][:]
        trials = []
        for i in range(len(column["file"])):
            part = {s: slice(int(column[f"{s}_first"][i]), int(column[f"{s}_first"][i] + column[f"{s}_samples"][i])) for s in ("taxel", "wrench", "stages")}
            trials.append({**{k: column[k][i].decode() for k in ("file", "label", "group", "exploration", "sha256")},
                           "counts": f["taxel/counts"][part["taxel"]], "phase": [chr(c) for c in f["taxel/phase"][part["taxel"]]],
                           "wrench": wrench[part["wrench"]], "stages": stages[part["stages"]],
                           **{f"{s}_ns": f[f"{s}/t_ns"][part[s]] for s in part}})
        axes = [f"{name.decode()}_{unit.decode()}" for name, unit in zip(f["stages/axis"], f["stages/unit"])]
        return trials, f.attrs["dataset_sha256"].item().decode(), axes


def refused(t, kind, call, *arguments):
    try:
        call(*arguments)
    except WeftError as error:
        t.expect(error.kind == kind, f"{call.__name__}{arguments}: {error.kind}, not {kind}")
        return
    t.expect(False, f"{call.__name__}{arguments}: not refused")


def in_memory(t, d, trials, digest):
    """numpy, pandas and xarray."""
    with DataSet(d / "out/dataset.h5") as data, Campaign(d / "out") as campaign:
        t.expect(data.simulated is True and data.dataset_sha256 == digest and list(data.stage_columns) == STAGES, f"data set: {data.stage_columns}")
        of_campaign = list(campaign.trials())
        t.expect(len(data) == len(of_campaign) == TRIALS, f"{len(data)} and {len(of_campaign)} trials")
        for i, true in enumerate(trials):
            name, trial = true["file"], data[i]
            t.expect(trial.units == {"taxel_t_s": "s", "counts": "count", "wrench_t_s": "s", "wrench": ("N",) * 3 + ("N m",) * 3, "stages_t_s": "s",
                                     "stages": ("m", "m", "m", "rad", "rad")}, f"{name}: units {trial.units}")
            t.expect(trial.attrs == {**of_campaign[i].attrs, "dataset_sha256": digest, "trial_sha256": true["sha256"]}
                     and trial.attrs["simulated"] is True, f"{name}: attrs {trial.attrs}")
            t.expect(same(trial.counts, true["counts"]) and same(trial.wrench, true["wrench"]) and same(trial.stages, true["stages"]), f"{name}: arrays")
            t.expect(same(samples(of_campaign[i], "stages"), true["stages"]), f"{name}: stages of the campaign file")
            for stream, columns, values in (("taxels", [f"ch{k}" for k in range(1, 17)], true["counts"]), ("wrench", WRENCH, true["wrench"]),
                                            ("stages", STAGES, true["stages"])):
                frame, times = data.frame(i, stream), true["taxel_ns" if stream == "taxels" else f"{stream}_ns"]
                t.expect(same(frame[columns], values) and same(frame.index, times / 1e9), f"{name}: frame of {stream}")
                t.expect(set(frame.attrs["units"]) == {"t_s", *columns} and frame.attrs["dataset_sha256"] == digest
                         and frame.attrs["simulated"] is True, f"{name}: attrs of {stream}: {frame.attrs}")
            t.expect(list(data.frame(i)["phase"]) == true["phase"], f"{name}: phases of the frame")
            whole = data.xarray(i)
            t.expect(dict(whole.sizes) == {"time": len(true["counts"]), "taxel": 16, "wrench_time": len(true["wrench"]), "channel": 3,
                                           "stages_time": len(true["stages"])}, f"{name}: {dict(whole.sizes)}")
            t.expect(same(whole.counts, true["counts"]) and same(whole.phase, true["phase"]) and same(whole.force, true["wrench"][:, :3])
                     and same(whole.torque, true["wrench"][:, 3:]) and same(whole.force.sel(channel="z"), true["wrench"][:, 2])
                     and all(same(whole[f"stage_{column.partition('_')[0]}"], true["stages"][:, k]) for k, column in enumerate(STAGES)),
                     f"{name}: values of xarray")
            t.expect(all(same(whole[time], true[ns] / 1e9) and whole[time].attrs["units"] == "s" for time, ns in
                         (("time", "taxel_ns"), ("wrench_time", "wrench_ns"), ("stages_time", "stages_ns"))), f"{name}: times of xarray")
            units = {variable: whole[variable].attrs["units"] for variable in ("counts", "force", "torque", "stage_z", "stage_ry")}
            t.expect(units == {"counts": "count", "force": "N", "torque": "N m", "stage_z": "m", "stage_ry": "rad"}, f"{name}: {units}")
            t.expect(whole.attrs == trial.attrs, f"{name}: attrs of xarray: {whole.attrs}")
        overview = data.overview()
        t.expect(overview.attrs == {"name": "small", "dataset_sha256": digest, "bench_kind": "simulated", "simulated": True}, f"{overview.attrs}")
        t.expect(all(list(overview[k]) == [true[k] for true in trials] for k in ("file", "label", "group", "exploration", "sha256"))
                 and list(overview["wrench_samples"]) == [len(true["wrench"]) for true in trials], "overview")
        refused(t, "param.range", data.frame, 0, "sound")


def exported_features(t, d, digest):
    """The table of `weft export` has the digest of its data set in list.json."""
    t.succeeds("export", "out", "--format", "features-csv", cwd=d)
    table, listed = d / "out/export/features-M1.csv", d / "out/export/list.json"
    with DataSet(d / "out/dataset.h5") as data:
        arrays, plain = data.arrays(table, "M1"), data.arrays(d / "features.csv", "M1")
        t.expect(arrays.dataset_sha256 == digest and plain.dataset_sha256 is None and same(arrays.X, plain.X) and same(arrays.y, plain.y), "exported features")
        kept = table.read_text(), listed.read_text()
        table.write_text(kept[0].replace("denim", "silk"))
        refused(t, "data.altered", data.arrays, table)
        table.write_text(kept[0])
        listed.write_text(kept[1].replace(digest, "0" * 64))
        refused(t, "request.unreadable", data.arrays, table)
        for text in kept[1][:-20], kept[1].replace("dataset_sha256", "digest"):
            listed.write_text(text)
            refused(t, "request.unreadable", data.arrays, table)
        for text in "[]", "{}", kept[1].replace("features-M1.csv", "features-M2.csv"):
            listed.write_text(text)
            t.expect(data.arrays(table).dataset_sha256 is None, f"a table that is not in the list: {text[:20]}")
        listed.unlink()
        t.expect(data.arrays(table).dataset_sha256 is None, "a table without a list")
        table.unlink()


def learning(t, d, trials):
    """The features CSV as X, y and groups; GroupKFold with a learner of scikit-learn."""
    t.succeeds("fabric", "features", "out/dataset.h5", "-o", "features.csv", cwd=d)
    t.succeeds("fabric", "features", "out/dataset.h5", "--window-s", 3, "-o", "windows.csv", cwd=d)
    with open(d / "features.csv", newline="") as file:
        head, *rows = csv.reader(file)
    with DataSet(d / "out/dataset.h5") as data:
        arrays = data.arrays(d / "features.csv", "M1")
        t.expect(arrays.X.shape == (TRIALS, 195) and same(arrays.X, [[float(v) for v in row[3:]] for row in rows]) and list(arrays.names) == head[3:], "X")
        t.expect(list(arrays.files) == [true["file"] for true in trials] and list(arrays.y) == [true["label"] for true in trials]
                 and list(arrays.groups) == [true["group"] for true in trials], "y and groups")
        windows = data.arrays(d / "windows.csv")
        t.expect(len(windows.X) > TRIALS and {name.partition("#")[0] for name in windows.files} == set(arrays.files), f"{len(windows.X)} windows")
        refused(t, "not_found", data.arrays, d / "features.csv", "M9")
        (d / "other.csv").write_text((d / "features.csv").read_text().replace("M1-r02,silk", "M1-r02,satin"))
        refused(t, "request.unreadable", data.arrays, d / "other.csv")
        (d / "cut.csv").write_text((d / "features.csv").read_text().rstrip("\n").rpartition(",")[0])
        refused(t, "request.unreadable", data.arrays, d / "cut.csv")
        (d / "no.csv").write_text("a,b\n1,2\n")
        refused(t, "request.unreadable", data.arrays, d / "no.csv")
    # A trial may have "#" in its name; "#w2" behind a name is a window.
    (d / "marks.csv").write_text("file,label,group,f1\nlinen#0,a,1,1\nlinen#0#w2,a,1,2\nlinen,a,2,3\n")
    marked = _arrays.read(d / "marks.csv", {"linen#0": "a", "linen": "a"}, {"linen#0"}, ())
    t.expect(marked.files == ("linen#0", "linen#0#w2") and marked.X.tolist() == [[1], [2]], f"{marked}")
    right = tested = 0
    for train, test in GroupKFold(n_splits=REPETITIONS).split(arrays.X, arrays.y, arrays.groups):
        t.expect(len(test) == len(FABRICS) and not set(arrays.groups[train]) & set(arrays.groups[test]), f"fold: {arrays.groups[test]}")
        learner = make_pipeline(StandardScaler(), LinearDiscriminantAnalysis(solver="lsqr", shrinkage=0.5)).fit(arrays.X[train], arrays.y[train])
        right, tested = right + int((learner.predict(arrays.X[test]) == arrays.y[test]).sum()), tested + len(test)
    print(f"SIMULATED GroupKFold with LDA of scikit-learn: {right} of {tested} right")
    t.expect((right, tested) == (TRIALS, TRIALS), f"{right} of {tested} right")


def command(*arguments, python=sys.executable):
    return subprocess.run([python, "-m", "weft_client.export", *map(str, arguments)], capture_output=True, text=True, timeout=120,
                          env={"PYTHONPATH": str(CLIENT), "PYTHONDONTWRITEBYTECODE": "1"})


def in_parquet(t, d, trials, digest):
    ran = command(d / "out/dataset.h5", "-o", d / "s.parquet")
    t.expect(ran.returncode == 0 and "SIMULATED" in ran.stdout and digest in ran.stdout, f"to Parquet: {ran}")
    file = pyarrow.parquet.ParquetFile(d / "s.parquet")
    table, schema = file.read(), file.schema_arrow
    t.expect(schema.metadata == {b"weft.format": b"weft-export 1", b"weft.name": b"small", b"weft.dataset_sha256": digest.encode(),
                                 b"weft.bench_kind": b"simulated", b"weft.simulated": b"true"}, f"{schema.metadata}")
    t.expect(schema.names == ["trial", "label", "group", "exploration", "phase", "t_s", *(f"ch{k}" for k in range(1, 17))], f"{schema.names}")
    t.expect(schema.field("t_s").metadata == {b"unit": b"s"} and all(schema.field(f"ch{k}").metadata == {b"unit": b"count"}
             and schema.field(f"ch{k}").type == pyarrow.uint16() for k in range(1, 17)), "units of Parquet")
    t.expect(file.num_row_groups == TRIALS and table.num_rows == sum(len(true["counts"]) for true in trials), f"{table.num_rows} rows")
    for name, key in (("trial", "file"), ("label", "label"), ("group", "group"), ("exploration", "exploration")):
        t.expect(table[name].to_pylist() == [true[key] for true in trials for _ in true["phase"]], f"column {name}")
    t.expect(table["phase"].to_pylist() == [p for true in trials for p in true["phase"]], "column phase")
    t.expect(same(table["t_s"].to_numpy(), numpy.concatenate([true["taxel_ns"] for true in trials]) / 1e9), "column t_s")
    counts = numpy.concatenate([true["counts"] for true in trials])
    t.expect(all(same(table[f"ch{k + 1}"].to_numpy(), counts[:, k]) for k in range(16)), "columns ch")
    print(f"SIMULATED Parquet: {table.num_rows} rows, {(d / 's.parquet').stat().st_size} bytes")


def read_mcap(path):
    """Messages in the order of the file: (topic, log time, content); metadata; schemas."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        messages = [(channel.topic, message.log_time, json.loads(message.data)) for _, channel, message in reader.iter_messages(log_time_order=False)]
        metadata = [(each.name, each.metadata) for each in reader.iter_metadata()]
        summary = reader.get_summary()
        schemas = {channel.topic: (channel.message_encoding, summary.schemas[channel.schema_id]) for channel in summary.channels.values()}
        return messages, metadata, schemas, summary.statistics


def runs(phases):
    return [p for i, p in enumerate(phases) if i == 0 or phases[i - 1] != p]


def in_mcap(t, d, trials, digest):
    ran = command(d / "out/dataset.h5", "-o", d / "s.mcap")
    t.expect(ran.returncode == 0 and "SIMULATED" in ran.stdout and digest in ran.stdout, f"to MCAP: {ran}")
    messages, metadata, schemas, statistics = read_mcap(d / "s.mcap")
    counts = collections.Counter(topic for topic, _, _ in messages)
    expected = {"/taxels": sum(len(true["counts"]) for true in trials), "/wrench": sum(len(true["wrench"]) for true in trials),
                "/stages": sum(len(true["stages"]) for true in trials), "/phase": sum(len(runs(true["phase"])) for true in trials)}
    t.expect(counts == expected and statistics.message_count == sum(expected.values()), f"{counts}, not {expected}")
    times = [time for _, time, _ in messages]
    t.expect(times == sorted(times), "MCAP: log times fall")
    by_topic = collections.defaultdict(list)
    for topic, time, said in messages:
        by_topic[topic].append((time, said))
        if abs(said["t_s"] - time / 1e9) > 1e-9:
            t.expect(False, f"{topic}: t_s {said['t_s']} at {time} ns")
            break
    for topic, key in (("/taxels", "taxel_ns"), ("/wrench", "wrench_ns"), ("/stages", "stages_ns")):
        t.expect([time for time, _ in by_topic[topic]] == [int(ns) for true in trials for ns in true[key]], f"MCAP: times of {topic}")
    for topic, columns, key in (("/wrench", WRENCH, "wrench"), ("/stages", STAGES, "stages")):
        t.expect(same([[said[c] for c in columns] for _, said in by_topic[topic]], numpy.concatenate([true[key] for true in trials])), f"MCAP: {topic}")
    t.expect(same([said["counts"] for _, said in by_topic["/taxels"]], numpy.concatenate([true["counts"] for true in trials])), "MCAP: /taxels")
    t.expect([(said["trial"], said["label"], said["group"], said["phase"]) for _, said in by_topic["/phase"]]
             == [(true["file"], true["label"], true["group"], p) for true in trials for p in runs(true["phase"])], "MCAP: /phase")
    t.expect(metadata[0] == ("weft", {"format": "weft-export 1", "name": "small", "dataset_sha256": digest, "bench_kind": "simulated", "simulated": "true"})
             and metadata[1:] == [("weft.trial", {"trial": true["file"], "sha256": true["sha256"], "shift_ns": "0"}) for true in trials], f"{metadata}")
    for topic, (encoding, schema) in schemas.items():
        properties = json.loads(schema.data)["properties"]
        t.expect(encoding == "json" and schema.encoding == "jsonschema" and set(properties) == set(by_topic[topic][0][1])
                 and properties["t_s"]["description"] == "s", f"{topic}: schema {properties}")
    wrench = json.loads(schemas["/wrench"][1].data)["properties"]
    t.expect([wrench[c]["description"] for c in WRENCH] == ["N"] * 3 + ["N m"] * 3, f"units of /wrench: {wrench}")
    print(f"SIMULATED MCAP: {dict(counts)}, {(d / 's.mcap').stat().st_size} bytes")


def other_clock(t, d, trials):
    """A copy of an unknown bench, with trials that each begin at the same time before zero, as in imported sets."""
    shutil.copy(d / "out/dataset.h5", d / "unknown.h5")
    with h5py.File(d / "unknown.h5", "r+") as f:
        f.attrs.modify("bench_kind", numpy.bytes_(b"unknown"))
        for stream in "taxel", "wrench", "stages":
            times = f[f"{stream}/t_ns"][:]
            for i, true in enumerate(trials):
                first = int(f[f"trials/{stream}_first"][i])
                times[first:first + len(true[f"{stream}_ns"])] -= true["taxel_ns"][0] + 5_000_000_000
            f[f"{stream}/t_ns"][:] = times
    with DataSet(d / "unknown.h5") as data:
        sent = data.to_mcap(d / "unknown.mcap")
        rows = data.to_parquet(d / "unknown.parquet")
        t.expect(data.simulated is None and not any("simulated" in each for each in (data[0].attrs, data.frame(0).attrs, data.xarray(0).attrs,
                                                                                      data.overview().attrs)), "an unknown bench is called simulated or real")
        first_s = data[0].taxel_t_s[0]
    t.expect(pyarrow.parquet.read_schema(d / "unknown.parquet").metadata[b"weft.simulated"] == b"unknown"
             and rows == sum(len(true["counts"]) for true in trials), "Parquet of an unknown bench")
    messages, metadata, _, _ = read_mcap(d / "unknown.mcap")
    times = [time for _, time, _ in messages]
    t.expect(len(messages) == sent and times == sorted(times) and times[0] == 0, f"times from {times[0]} to {times[-1]}")
    t.expect(metadata[0][1]["simulated"] == "unknown", f"{metadata[0]}")
    begins = [n for n, (topic, _, said) in enumerate(messages) if topic == "/taxels" and abs(said["t_s"] - first_s) < 1e-9]
    t.expect(len(begins) == TRIALS and first_s == -5.0, f"{len(begins)} begins at {first_s} s")
    of_trial = [metadata[1 + k][1] for k in range(TRIALS)]
    t.expect(all(messages[n][1] == -5_000_000_000 + int(of["shift_ns"]) for n, of in zip(begins, of_trial)), "shift_ns")
    names = [said["trial"] for topic, _, said in messages if topic == "/phase"]
    t.expect(runs(names) == [true["file"] for true in trials], "MCAP: trials are mixed")


def failures(t, d):
    """Nothing is overwritten by a failed export, and a missing package is named with its extra."""
    before = (d / "out/dataset.h5").read_bytes()
    (d / "link.mcap").symlink_to(d / "out/dataset.h5")
    with DataSet(d / "out/dataset.h5") as data:
        refused(t, "param.range", data.to_mcap, d / "link.mcap")
    t.expect((d / "out/dataset.h5").read_bytes() == before, "the data set was overwritten")
    shutil.copy(d / "out/dataset.h5", d / "broken.h5")
    with h5py.File(d / "broken.h5", "r+") as f:
        del f["trials/sha256"]
    kept = {name: (d / name).read_bytes() for name in ("s.parquet", "s.mcap")}
    for name in kept:
        with DataSet(d / "broken.h5") as data:
            try:
                (data.to_mcap if name == "s.mcap" else data.to_parquet)(d / name)
                t.expect(False, f"{name} of a broken data set")
            except KeyError:
                pass
    t.expect(all((d / name).read_bytes() == kept[name] for name in kept) and not list(d.glob("*.partial-*")), "a failed export left its file")
    t.expect(command(d / "out/dataset.h5", "-o", d / "s.csv").returncode == 2, "unknown format")
    t.expect(command(d / "no.h5", "-o", d / "s.mcap").returncode == 1, "no data set")
    bare = subprocess.run([sys.executable, "-S", "-m", "weft_client.export", "a", "-o", "b.mcap"], capture_output=True, text=True,
                          env={"PYTHONPATH": str(CLIENT), "PYTHONDONTWRITEBYTECODE": "1"})
    t.expect(bare.returncode == 1 and "weft-client[h5py]" in bare.stderr, f"without numpy: {bare}")
    for package, extra, use in (("pyarrow", "parquet", "to_parquet('x.parquet')"), ("mcap", "mcap", "to_mcap('x.mcap')"), ("xarray", "xarray", "xarray(0)"),
                                ("pandas", "pandas", "frame(0)"), ("pandas", "pandas", "overview()")):
        code = (f"import sys\nsys.modules['{package}'] = None\nfrom weft_client.dataset import DataSet\ntry:\n    DataSet('out/dataset.h5').{use}\n"
                "except ImportError as problem:\n    print(problem.name, problem)")
        ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=d,
                             env={"PYTHONPATH": str(CLIENT), "PYTHONDONTWRITEBYTECODE": "1"})
        t.expect(ran.stdout.split(" ")[0] == package and f"weft-client[{extra}]" in ran.stdout, f"without {package}: {ran}")
    t.expect(not list(d.glob("x.*")), "a file without its package")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-data-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((ROOT / "recipes/library/first.json").read_text())
        for key in "$schema", "hand_over":
            recipe.pop(key)
        recipe.update(name="small", fabrics=FABRICS, repetitions=REPETITIONS)
        (d / "small.json").write_text(json.dumps(recipe))
        ran = t.run("run", "small.json", "--rig", ROOT / "sim/rigs/bench17.json", "--out", "out", "--no-evaluate", "--no-error-check", cwd=d)
        assert ran.returncode == 0, ran.stderr
        trials, digest, axes = raw(d / "out/dataset.h5")
        assert len(trials) == TRIALS and axes == STAGES, (len(trials), axes)
        in_memory(t, d, trials, digest)
        learning(t, d, trials)
        exported_features(t, d, digest)
        in_parquet(t, d, trials, digest)
        in_mcap(t, d, trials, digest)
        other_clock(t, d, trials)
        failures(t, d)
    t.finish()


if __name__ == "__main__":
    main()
