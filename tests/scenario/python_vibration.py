#!/usr/bin/env python3
"""Sound and vibration of a small simulated campaign (recipes/library/vibro-slide.json, shortened) read by the Python client as arrays, frames and xarray,
and written as Parquet and MCAP. Every value and time is compared with h5py's own reading of the file, and with `weft export --format samples-csv`.
Packages from PyPI at pinned versions (python_data.txt).

    python_vibration.py WEFT SOURCE_ROOT FOLDER      FOLDER has their virtual environment, and is made if it does not exist

WEFT_CLIENT names a folder with an installed weft_client, tested in place of the source tree's. Exit 77 (skipped) if PyPI cannot be reached or is too slow.
"""
import collections
import csv
import json
import pathlib
import shutil
import sys
import tempfile

import pypi_environment

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_name("python_data.txt"))

import h5py
import numpy
import pyarrow.parquet

from cli_support import Checks
from python_data import ROOT, command, read_mcap, refused, runs, same
from weft_client.dataset import DataSet

FABRICS, REPETITIONS = ["denim", "silk"], 2
TRIALS = len(FABRICS) * REPETITIONS
COLUMNS = {"acceleration": ["ax_mps2", "ay_mps2", "az_mps2"], "sound": ["sound_Pa"]}
UNITS = {"acceleration": "m/s2", "sound": "Pa"}
MICRO = 10 ** 6


def raw(path):
    """Per stream a record for each trial, by docs/reference/dataset.md: reading k of a block was taken k / rate after device_us, and the block arrived after
    its last reading. Times in whole ns of the campaign's clock and us of the sensor's."""
    out = {}
    with h5py.File(path) as f:
        files = [name.decode() for name in f["trials/file"][:]]
        for stream, columns in COLUMNS.items():
            group = f[stream]
            size, rate_hz = int(group.attrs["block_readings"]), float(group.attrs["rate_hz"])
            quanta = group["quanta"][:].reshape(-1, len(columns))
            out[stream] = []
            for i, name in enumerate(files):
                first, count = (int(f[f"trials/{stream}_blocks_{part}"][i]) for part in ("first", "samples"))
                t_ns, device_us = [], []
                for block in range(first, first + count):
                    arrival_ns, begin_us = int(group["t_ns"][block]), int(group["device_us"][block])
                    t_ns += [arrival_ns - round((size - 1 - k) / rate_hz * 1e9) for k in range(size)]
                    device_us += [begin_us + k / rate_hz * 1e6 for k in range(size)]
                out[stream].append({"file": name, "rate_hz": rate_hz, "blocks": count, "t_ns": t_ns, "device_us": device_us,
                                    "quanta": quanta[first * size:(first + count) * size]})
    return out


def exported(t, d, stream):
    """Rows of `weft export`'s table of one stream by trial: phase, time in ns, quanta."""
    t.succeeds("export", "out", "--format", "samples-csv", "--stream", stream, cwd=d)
    rows = collections.defaultdict(list)
    with open(d / f"out/export/samples-{stream}.csv", newline="") as file:
        for row in csv.DictReader(file):
            rows[row["trial"]].append((row["phase"], *(int(row[c].replace(".", "")) for c in ("t_s", *COLUMNS[stream]))))
    return rows


def in_memory(t, d, true, tables):
    with DataSet(d / "out/dataset.h5") as data:
        t.expect(data.vibrations == ("acceleration", "sound") and len(data) == TRIALS, f"{data.vibrations}")
        for i in range(TRIALS):
            whole = data.xarray(i)
            for stream, columns in COLUMNS.items():
                of, readings, frame = true[stream][i], data.readings(i, stream), data.frame(i, stream)
                name = f"{of['file']}, {stream}"
                values = of["quanta"] / MICRO
                t.expect(readings.rate_hz == of["rate_hz"] and readings.units["values"] == UNITS[stream] and list(readings.columns) == columns
                         and len(readings.block_t_ns) == of["blocks"] > 50, f"{name}: {readings}")
                t.expect(same(readings.values.reshape(-1, len(columns)), values) and readings.t_ns.tolist() == of["t_ns"]
                         and readings.t_ns.dtype == numpy.int64 and same(readings.t_s, numpy.array(of["t_ns"]) / 1e9), f"{name}: arrays")
                t.expect(numpy.allclose(readings.device_s, numpy.array(of["device_us"]) / 1e6, rtol=0, atol=1e-9), f"{name}: times of the sensor")
                steps = numpy.diff(readings.device_s)
                pauses = numpy.count_nonzero(abs(steps - 1 / of["rate_hz"]) > 2e-6)  # nothing is recorded between phases
                t.expect(pauses <= 3 and steps.min() > 0, f"{name}: {pauses} pauses, steps from {steps.min()} to {steps.max()} s")
                t.expect(readings.lost.sum() == 0 and len(readings.clipped) == of["blocks"], f"{name}: lost {readings.lost.sum()}")
                t.expect(list(frame.columns) == ["phase", "device_s", *columns] and same(frame[columns], values) and same(frame.index, readings.t_s)
                         and same(frame["device_s"], readings.device_s), f"{name}: frame")
                t.expect(frame.attrs["units"] == {"t_s": "s", "device_s": "s", **{c: UNITS[stream] for c in columns}} and frame.attrs["simulated"] is True
                         and frame.attrs["rate_hz"] == of["rate_hz"] and frame.attrs["file"] == of["file"], f"{name}: {frame.attrs}")
                rows = list(zip(frame["phase"], of["t_ns"], *of["quanta"].T.tolist()))
                t.expect(rows == tables[stream][of["file"]], f"{name}: differs from the table of weft export")
                t.expect(runs([phase for phase in frame["phase"] if phase != "-"]) == list("SPME"), f"{name}: phases {runs(list(frame['phase']))}")
                variable = whole[stream]
                t.expect(same(variable.values.reshape(-1, len(columns)), values) and variable.attrs["units"] == UNITS[stream]
                         and variable.attrs["rate_hz"] == of["rate_hz"] and variable.dims[0] == f"{stream}_time", f"{name}: xarray")
                t.expect(same(whole[f"{stream}_time"], readings.t_s) and same(whole[f"{stream}_device_s"], readings.device_s)
                         and whole[f"{stream}_time"].attrs["units"] == whole[f"{stream}_device_s"].attrs["units"] == "s", f"{name}: times of xarray")
            t.expect(same(whole.acceleration.sel(acceleration_axis="z"), true["acceleration"][i]["quanta"][:, 2] / MICRO)
                     and same(whole.counts, data[i].counts) and whole.attrs == data[i].attrs, "xarray of a whole trial")
        refused(t, "param.range", data.readings, 0, "wrench")
        refused(t, "param.range", data.frame, 0, "noise")
        moving = data.frame(0, "sound").query("phase == 'M'")["sound_Pa"]
        still = data.frame(0, "sound").query("phase == 'S'")["sound_Pa"]
        t.expect(moving.std() > 2 * still.std(), f"the slide is silent: {moving.std()} Pa, at rest {still.std()} Pa")
        print(f"SIMULATED sound: {still.std():.6f} Pa at rest, {moving.std():.6f} Pa in the slide")


def in_parquet(t, d, true, tables):
    with DataSet(d / "out/dataset.h5") as data:
        digest = data.dataset_sha256
        refused(t, "param.range", data.to_parquet, d / "no.parquet", "noise")
        wrench = numpy.concatenate([trial.wrench for trial in data])
        t.expect(data.to_parquet(d / "wrench.parquet", "wrench") == len(wrench), "rows of the wrench")
    read = pyarrow.parquet.read_table(d / "wrench.parquet")
    t.expect(same(numpy.column_stack([read[name] for name in ("fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm")]), wrench), "Parquet of the wrench")
    for stream, columns in COLUMNS.items():
        ran = command(d / "out/dataset.h5", "-o", d / f"{stream}.parquet", "--stream", stream)
        t.expect(ran.returncode == 0 and "SIMULATED" in ran.stdout and digest in ran.stdout, f"to Parquet: {ran}")
        file = pyarrow.parquet.ParquetFile(d / f"{stream}.parquet")
        table, schema = file.read(), file.schema_arrow
        t.expect(schema.metadata[b"weft.dataset_sha256"] == digest.encode() and schema.metadata[b"weft.simulated"] == b"true", f"{schema.metadata}")
        t.expect(schema.names == ["trial", "label", "group", "exploration", "phase", "t_s", "device_s", *columns], f"{schema.names}")
        units = {name: schema.field(name).metadata[b"unit"].decode() for name in ("t_s", "device_s", *columns)}
        t.expect(units == {"t_s": "s", "device_s": "s", **{c: UNITS[stream] for c in columns}}, f"{units}")
        t.expect(file.num_row_groups == TRIALS and table["trial"].to_pylist() == [of["file"] for of in true[stream] for _ in of["t_ns"]], "column trial")
        t.expect(same(table["t_s"], numpy.concatenate([of["t_ns"] for of in true[stream]]) / 1e9)
                 and numpy.allclose(table["device_s"], numpy.concatenate([of["device_us"] for of in true[stream]]) / 1e6, rtol=0, atol=1e-9), "times")
        t.expect(table["phase"].to_pylist() == [row[0] for of in true[stream] for row in tables[stream][of["file"]]], "column phase")
        t.expect(same(numpy.column_stack([table[c] for c in columns]), numpy.concatenate([of["quanta"] for of in true[stream]]) / MICRO), "values")
        print(f"SIMULATED Parquet of {stream}: {table.num_rows} rows, {(d / f'{stream}.parquet').stat().st_size} bytes")
    t.expect(command(d / "out/dataset.h5", "-o", d / "x.mcap", "--stream", "sound").returncode == 2, "--stream with MCAP")


def in_mcap(t, d, true):
    ran = command(d / "out/dataset.h5", "-o", d / "v.mcap")
    t.expect(ran.returncode == 0 and "SIMULATED" in ran.stdout, f"to MCAP: {ran}")
    messages, metadata, schemas, _ = read_mcap(d / "v.mcap")
    times = [time for _, time, _ in messages]
    t.expect(times == sorted(times) and [of["shift_ns"] for _, of in metadata[1:]] == ["0"] * TRIALS, "MCAP: log times")
    for stream, columns in COLUMNS.items():
        got = [(time, said) for topic, time, said in messages if topic == f"/{stream}"]
        readings = [(t_ns, us, row) for of in true[stream] for t_ns, us, row in zip(of["t_ns"], of["device_us"], (of["quanta"] / MICRO).tolist())]
        t.expect([time for time, _ in got] == [t_ns for t_ns, _, _ in readings], f"MCAP: times of /{stream}")
        t.expect([[said[c] for c in columns] for _, said in got] == [row for _, _, row in readings], f"MCAP: values of /{stream}")
        t.expect(all(abs(said["device_s"] - us / 1e6) < 1e-9 and said["t_s"] == time / 1e9 for (time, said), (_, us, _) in zip(got, readings)),
                 f"MCAP: sensor's clock of /{stream}")
        properties = json.loads(schemas[f"/{stream}"][1].data)["properties"]
        t.expect({name: of["description"] for name, of in properties.items()} == {"t_s": "s", "device_s": "s", **{c: UNITS[stream] for c in columns}},
                 f"MCAP: units of /{stream}: {properties}")
    print(f"SIMULATED MCAP: {len(messages)} messages, {(d / 'v.mcap').stat().st_size} bytes")


def other_clocks(t, d, true):
    """A sensor's clock that wraps within a trial, a lost block, and a set with sound alone."""
    shutil.copy(d / "out/dataset.h5", d / "wrapped.h5")
    with h5py.File(d / "wrapped.h5", "r+") as f:
        us = f["sound/device_us"][:].astype(numpy.int64)
        middle = int(f["trials/sound_blocks_samples"][0]) // 2
        us[middle:] += 20_000  # a block of 20 ms is missing here
        f["sound/device_us"][:] = (us - us[middle - 2] + 2 ** 32 - 7).astype(numpy.uint32)
        lost = f["sound/lost"][:]
        lost[middle] = 1
        f["sound/lost"][:] = lost
        del f["acceleration"]
    with DataSet(d / "wrapped.h5") as data:
        readings = data.readings(0, "sound")
        raw_us = readings.device_us.astype(numpy.int64)
        t.expect(raw_us.max() - raw_us.min() > 2 ** 31, "the clock does not wrap")
        whole = numpy.array(true["sound"][0]["device_us"])
        expected = (whole - whole[0]) / 1e6
        expected[middle * len(expected) // len(readings.block_t_ns):] += 0.02
        t.expect(numpy.allclose(readings.device_s - readings.device_s[0], expected, rtol=0, atol=1e-8), "times across the wrap")
        t.expect(data.vibrations == ("sound",) and readings.lost.tolist() == [int(k == middle) for k in range(len(readings.lost))], "lost block")
        t.expect("sound" in data.xarray(0) and "acceleration" not in data.xarray(0), "xarray with sound alone")
        refused(t, "param.range", data.readings, 0, "acceleration")
        refused(t, "param.range", data.to_parquet, d / "no.parquet", "acceleration")
    t.expect(not (d / "no.parquet").exists(), "a file of a missing stream")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory(prefix="weft-vibration-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((ROOT / "recipes/library/vibro-slide.json").read_text())
        recipe.pop("$schema")
        recipe.update(name="small", fabrics=FABRICS, repetitions=REPETITIONS)
        for phase in recipe["explorations"]["V1"]["phases"]:
            phase.update({"path": [{"dx_mm": 0, "dy_mm": 4}]} if "path" in phase else {"duration_s": 0.5})
        (d / "small.json").write_text(json.dumps(recipe))
        ran = t.run("run", "small.json", "--rig", ROOT / "sim/rigs/vibro17.json", "--out", "out", "--no-evaluate", "--no-error-check", cwd=d)
        assert ran.returncode == 0, ran.stderr
        true = raw(d / "out/dataset.h5")
        tables = {stream: exported(t, d, stream) for stream in COLUMNS}
        in_memory(t, d, true, tables)
        in_parquet(t, d, true, tables)
        in_mcap(t, d, true)
        other_clocks(t, d, true)
    t.finish()


if __name__ == "__main__":
    main()
