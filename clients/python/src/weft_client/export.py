"""A data set as one file for other programs: Parquet (extra: parquet) or MCAP (extra: mcap), which Foxglove and PlotJuggler open.

    python3 -m weft_client.export out/m1/dataset.h5 -o m1.parquet
    python3 -m weft_client.export out/v1/dataset.h5 -o sound.parquet --stream sound
    python3 -m weft_client.export out/m1/dataset.h5 -o m1.mcap

Both have the digest of the data set and the kind of its bench. Trials are written one at a time; an existing file is replaced when the new one is complete.
"""
from __future__ import annotations

import argparse
import contextlib
import json
import os
import pathlib
import sys
from typing import Any, Callable, Dict, Iterator, List, Sequence, Tuple, Union

from ._client import VERSION
from ._errors import RequestError, WeftError
from ._extras import extra
from ._readings import COLUMNS, STREAMS, UNITS
from ._trial import WRENCH_COLUMNS, WRENCH_UNITS, Trial
from .dataset import DataSet

numpy = extra("numpy", "h5py")

Place = Union[str, "os.PathLike[str]"]
_NS_PER_S = 1e9
_PAUSE_NS = 1_000_000_000  # between trials that do not follow each other on one clock


def to_parquet(data: DataSet, path: Place, stream: str = "taxels") -> int:
    """Writes a row for each sample of one stream of each trial, and a row group for each trial. Returns the number of rows.

    trial, label, group, exploration, phase   text
    t_s                                       campaign's clock [s]
    taxels         ch1 ... chN as in the data set: raw counts u16, or f64
    wrench         fx_N fy_N fz_N tx_Nm ty_Nm tz_Nm, sensor's frame
    stages         a column for each axis, such as x_m, rx_rad
    acceleration   device_s, sensor's clock [s]; ax_mps2 ay_mps2 az_mps2, its sensor's frame
    sound          device_s [s]; sound_Pa

    Metadata of the schema: `weft.` with format, name, dataset_sha256, bench_kind and simulated (true, false or unknown); of a column: `unit`. The phase of a
    row of another stream than taxels is that of the newest taxel frame, as in samples-csv.
    Errors: ImportError without pyarrow; RequestError if the path is the data set's own or the set does not have the stream; OSError.
    """
    pyarrow = extra("pyarrow", "parquet")
    parquet = extra("pyarrow.parquet", "parquet")
    _check_stream(data, stream)
    fixed = "trial", "label", "group", "exploration"
    text = pyarrow.string()
    schema, rows = None, 0
    with _replaced(data, path) as partial, contextlib.ExitStack() as stack:
        writer: Any = None
        for i, trial in enumerate(data):
            phase, columns = _table(data, i, trial, stream)
            if schema is None:
                schema = pyarrow.schema([*(pyarrow.field(name, text) for name in (*fixed, "phase")),
                                         *(pyarrow.field(name, pyarrow.from_numpy_dtype(values.dtype), metadata={"unit": unit})
                                           for name, unit, values in columns)],
                                        metadata={f"weft.{key}": value for key, value in _metadata(data).items()})
                writer = stack.enter_context(parquet.ParquetWriter(partial, schema))
            count = len(phase)
            texts = [pyarrow.repeat(pyarrow.scalar(value, text), count) for value in (trial.file, trial.label, trial.group, trial.exploration)]
            writer.write_table(pyarrow.Table.from_arrays([*texts, pyarrow.array(phase.astype("U1"), text), *(pyarrow.array(each[2]) for each in columns)],
                                                         schema=schema))
            rows += count
        if writer is None:
            raise RequestError("number of trials in the data set", 1001, {"kind": "request.unreadable", "where": str(data.h5.filename), "got": 0,
                                                                          "expected": "1 or more", "hint": "Export a data set with trials"})
    return rows


def _check_stream(data: DataSet, stream: str) -> None:
    streams = ("taxels", "wrench", "stages", *data.vibrations)
    if stream not in streams:
        raise RequestError("unknown or missing stream", 1003, {"kind": "param.range", "where": str(data.h5.filename), "got": stream,
                                                               "expected": ", ".join(streams)})


def _table(data: DataSet, i: int, trial: Trial, stream: str) -> Tuple[Any, List[Tuple[str, str, Any]]]:
    """Phase of each row, and the columns from t_s on: name, unit, values."""
    if stream == "taxels":
        unit = str(trial.units["counts"])
        return trial.phase, [("t_s", "s", trial.taxel_t_s), *((f"ch{k + 1}", unit, trial.counts[:, k]) for k in range(trial.counts.shape[1]))]
    columns: List[Tuple[str, str, Any]] = []
    if stream in data.vibrations:
        of = data.readings(i, stream)
        t_ns, names, units, values = of.t_ns, of.columns, [of.units["values"]] * len(of.columns), of.values.reshape(len(of.values), -1)
        columns = [("device_s", "s", of.device_s)]
    elif stream == "wrench":
        t_ns, names, units, values = data.times_ns(stream, i), WRENCH_COLUMNS, list(WRENCH_UNITS), trial.wrench
    else:
        t_ns, names, units, values = data.times_ns(stream, i), trial.stage_columns, list(trial.axis_units), trial.stages
    columns += [(name, unit, values[:, k]) for k, (name, unit) in enumerate(zip(names, units))]
    return data.phases_at(i, t_ns), [("t_s", "s", t_ns / _NS_PER_S), *columns]


def to_mcap(data: DataSet, path: Place) -> int:
    """Writes a message for each sample of each stream and for each begin of a phase, as JSON. Returns the number of messages.

    /phase    t_s, trial, label, group, exploration, phase
    /taxels   t_s, counts [taxels]
    /wrench   t_s, fx_N fy_N fz_N tx_Nm ty_Nm tz_Nm, sensor's frame
    /stages   t_s and a value for each axis, such as x_m, rx_rad
    /acceleration   t_s, device_s, ax_mps2 ay_mps2 az_mps2, for each reading
    /sound          t_s, device_s, sound_Pa, for each reading

    The log time is the campaign's clock [ns]. A trial that begins before the end of the one before (a resumed bench, an imported set) is moved to 1 s after it,
    and one before time zero to zero; `t_s` stays as recorded. Metadata records: `weft` as in to_parquet(), and one `weft.trial` for each trial with its
    digest and `shift_ns`, log time minus recorded time. Errors: ImportError without mcap; RequestError if the path is the data set's own; OSError.
    """
    writers = extra("mcap.writer", "mcap")
    sent, end_ns = 0, 0
    with _replaced(data, path) as partial, open(partial, "wb") as file:
        writer = writers.Writer(file)
        writer.start(profile="", library=f"weft-client {VERSION}")
        writer.add_metadata("weft", _metadata(data))
        channels = {topic: writer.register_channel(topic, "json", writer.register_schema(f"weft.{topic[1:]}", "jsonschema", json.dumps(schema).encode()),
                                                   {"simulated": _metadata(data)["simulated"]})
                    for topic, schema in _schemas(data).items()}
        for i in range(len(data)):
            times, messages = _messages(data, i)
            first_ns = times[0] if times else end_ns
            shift_ns = 0 if first_ns >= end_ns else end_ns + (_PAUSE_NS if i else 0) - first_ns
            writer.add_metadata("weft.trial", {"trial": data.text("trials/file", i), "sha256": data.text("trials/sha256", i), "shift_ns": str(shift_ns)})
            for t_ns, (topic, said) in zip(times, messages):
                end_ns = t_ns + shift_ns
                writer.add_message(channels[topic], log_time=end_ns, publish_time=end_ns, data=json.dumps(said, separators=(",", ":")).encode())
            sent += len(times)
        writer.finish()
    return sent


def _messages(data: DataSet, i: int) -> Tuple[List[int], Iterator[Tuple[str, Dict[str, Any]]]]:
    """Messages of one trial in the order of their time: times as recorded [ns]; topics and contents, made one at a time."""
    trial = data[i]
    sections = trial.phases()
    taxel = data.times_ns("taxel", i)
    texts = {"trial": trial.file, "label": trial.label, "group": trial.group, "exploration": trial.exploration}
    parts: List[Tuple[str, Any, Callable[[int], Dict[str, Any]]]] = [
        ("/phase", taxel[[section["first"] for section in sections]], lambda k: {**texts, "phase": sections[k]["phase"]})]
    if trial.counts.shape[1]:
        parts.append(("/taxels", taxel, lambda k: {"counts": trial.counts[k].tolist()}))

    def add(topic: str, t_ns: Any, columns: Sequence[str], values: Any) -> None:
        parts.append((topic, t_ns, lambda k: dict(zip(columns, values[k].tolist()))))

    add("/wrench", data.times_ns("wrench", i), WRENCH_COLUMNS, trial.wrench)
    add("/stages", data.times_ns("stages", i), trial.stage_columns, trial.stages)
    for stream in data.vibrations:
        of = data.readings(i, stream)
        add(f"/{stream}", of.t_ns, ("device_s", *of.columns), numpy.column_stack([of.device_s, of.values]))
    times = numpy.concatenate([t_ns for _, t_ns, _ in parts])
    part = numpy.repeat(numpy.arange(len(parts)), [len(t_ns) for _, t_ns, _ in parts])
    within = numpy.concatenate([numpy.arange(len(t_ns)) for _, t_ns, _ in parts])
    order = numpy.lexsort((part, times))
    sorted_ns: List[int] = times[order].tolist()

    def contents() -> Iterator[Tuple[str, Dict[str, Any]]]:
        for t_ns, p, k in zip(sorted_ns, part[order].tolist(), within[order].tolist()):
            topic, _, made = parts[p]
            yield topic, {"t_s": t_ns / _NS_PER_S, **made(k)}

    return sorted_ns, contents()


def _schemas(data: DataSet) -> Dict[str, Dict[str, Any]]:
    """JSON Schema of each topic; a description of a number is its unit."""
    def of(title: str, properties: Dict[str, Any]) -> Dict[str, Any]:
        properties = {"t_s": {"type": "number", "description": "s"}, **properties}
        return {"title": title, "type": "object", "properties": properties, "required": list(properties)}

    def numbers(names: Any, units: Any) -> Dict[str, Any]:
        return {name: {"type": "number", "description": unit} for name, unit in zip(names, units)}

    texts: Dict[str, Any] = {name: {"type": "string"} for name in ("trial", "label", "group", "exploration", "phase")}
    schemas = {"/phase": of("weft.phase", texts), "/wrench": of("weft.wrench", numbers(WRENCH_COLUMNS, WRENCH_UNITS)),
               "/stages": of("weft.stages", numbers(data.stage_columns, data.axis_units))}
    for stream in data.vibrations:
        columns = COLUMNS[stream]
        schemas[f"/{stream}"] = of(f"weft.{stream}", numbers(("device_s", *columns), ("s", *([UNITS[stream]] * len(columns)))))
    if "taxel/counts" in data.h5:
        schemas["/taxels"] = of("weft.taxels", {"counts": {"type": "array", "items": {"type": "number"}, "description": data.count_unit}})
    return schemas


def _metadata(data: DataSet) -> Dict[str, str]:
    return {"format": "weft-export 1", "name": data.name, "dataset_sha256": data.dataset_sha256, "bench_kind": data.bench_kind,
            "simulated": {True: "true", False: "false", None: "unknown"}[data.simulated]}


@contextlib.contextmanager
def _replaced(data: DataSet, path: Place) -> Iterator[str]:
    """Name of a file beside `path` that replaces it if the block succeeds, and is removed otherwise."""
    place = pathlib.Path(path)
    if place.exists() and place.samefile(data.h5.filename):
        raise RequestError("output is the data set itself", 1003, {"kind": "param.range", "where": str(place), "hint": "Choose another file"})
    partial = place.with_name(f"{place.name}.partial-{os.getpid()}")
    try:
        yield str(partial)
        os.replace(partial, place)
    finally:
        with contextlib.suppress(FileNotFoundError):
            partial.unlink()


_FORMATS = {".parquet": "rows", ".mcap": "messages"}


def main(arguments: List[str]) -> int:
    """The command. Returns its exit status: 0, 1 with a sentence on the standard error, 2 for a wrong option."""
    parser = argparse.ArgumentParser("python3 -m weft_client.export", description="write a data set as Parquet or MCAP")
    parser.add_argument("dataset", help="data set (HDF5)")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path, help="write this file: NAME.parquet or NAME.mcap")
    parser.add_argument("--stream", choices=("taxels", "wrench", "stages", *STREAMS), help="samples to write as Parquet (default: taxels); MCAP has all")
    chosen = parser.parse_args(arguments)
    if chosen.output.suffix not in _FORMATS:
        parser.error(f"unknown format of the output: {chosen.output} (expected {' or '.join(_FORMATS)})")
    if chosen.stream and chosen.output.suffix == ".mcap":
        parser.error("--stream is for Parquet: a file of MCAP has all streams")
    what = _FORMATS[chosen.output.suffix]
    try:
        with DataSet(chosen.dataset) as data:
            count = to_parquet(data, chosen.output, chosen.stream or "taxels") if what == "rows" else to_mcap(data, chosen.output)
            print(f"{chosen.output}: {count} {what} of {len(data)} trials, data set {data.dataset_sha256}")
            if data.simulated:
                print("SIMULATED data: computed by the plant model; no real fabric was touched.")
    except (WeftError, ImportError, OSError) as problem:
        print(f"weft_client.export: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
