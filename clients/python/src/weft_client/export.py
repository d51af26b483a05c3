"""A data set as one file for other programs: Parquet (extra: parquet) or MCAP (extra: mcap), which Foxglove and PlotJuggler open.

    python3 -m weft_client.export out/m1/dataset.h5 -o m1.parquet
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
from typing import Any, Dict, Iterator, List, Tuple, Union

from ._client import VERSION
from ._errors import RequestError, WeftError
from ._extras import extra
from ._trial import WRENCH_COLUMNS, WRENCH_UNITS
from .dataset import DataSet

Place = Union[str, "os.PathLike[str]"]
_NS_PER_S = 1e9
_PAUSE_NS = 1_000_000_000  # between trials that do not follow each other on one clock


def to_parquet(data: DataSet, path: Place) -> int:
    """Writes a row for each taxel sample of each trial, and a row group for each trial. Returns the number of rows.

    trial, label, group, exploration, phase   text
    t_s                                       campaign's clock [s]
    ch1 ... chN                               as in the data set: raw counts u16, or f64

    Metadata of the schema: `weft.` with format, name, dataset_sha256, bench_kind and simulated (true, false or unknown); of a column: `unit`.
    Errors: ImportError without pyarrow; RequestError if the path is the data set's own; OSError.
    """
    pyarrow = extra("pyarrow", "parquet")
    parquet = extra("pyarrow.parquet", "parquet")
    fixed = "trial", "label", "group", "exploration"
    text = pyarrow.string()
    schema, rows = None, 0
    with _replaced(data, path) as partial, contextlib.ExitStack() as stack:
        writer: Any = None
        for trial in data:
            if schema is None:
                unit, kind = str(trial.units["counts"]), pyarrow.from_numpy_dtype(trial.counts.dtype)
                schema = pyarrow.schema([*(pyarrow.field(name, text) for name in (*fixed, "phase")),
                                         pyarrow.field("t_s", pyarrow.float64(), metadata={"unit": "s"}),
                                         *(pyarrow.field(f"ch{i + 1}", kind, metadata={"unit": unit}) for i in range(trial.counts.shape[1]))],
                                        metadata={f"weft.{key}": value for key, value in _metadata(data).items()})
                writer = stack.enter_context(parquet.ParquetWriter(partial, schema))
            count = len(trial.taxel_t_s)
            texts = [pyarrow.repeat(pyarrow.scalar(value, text), count) for value in (trial.file, trial.label, trial.group, trial.exploration)]
            writer.write_table(pyarrow.Table.from_arrays(
                [*texts, pyarrow.array(trial.phase.astype("U1"), text), pyarrow.array(trial.taxel_t_s),
                 *(pyarrow.array(trial.counts[:, i]) for i in range(trial.counts.shape[1]))], schema=schema))
            rows += count
        if writer is None:
            raise RequestError("number of trials in the data set", 1001, {"kind": "request.unreadable", "where": str(data.h5.filename), "got": 0,
                                                                          "expected": "1 or more", "hint": "Export a data set with trials"})
    return rows


def to_mcap(data: DataSet, path: Place) -> int:
    """Writes a message for each sample of taxels, wrench and stages and for each begin of a phase, as JSON. Returns the number of messages.

    /phase    t_s, trial, label, group, exploration, phase
    /taxels   t_s, counts [taxels]
    /wrench   t_s, fx_N fy_N fz_N tx_Nm ty_Nm tz_Nm, sensor's frame
    /stages   t_s and a value for each axis, such as x_m, rx_rad

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
            messages = sorted(_messages(data, i), key=lambda message: message[:2])
            first_ns = messages[0][0] if messages else end_ns
            shift_ns = 0 if first_ns >= end_ns else end_ns + (_PAUSE_NS if i else 0) - first_ns
            writer.add_metadata("weft.trial", {"trial": data.text("trials/file", i), "sha256": data.text("trials/sha256", i), "shift_ns": str(shift_ns)})
            for t_ns, _, topic, said in messages:
                end_ns = t_ns + shift_ns
                writer.add_message(channels[topic], log_time=end_ns, publish_time=end_ns, data=json.dumps(said, separators=(",", ":")).encode())
            sent += len(messages)
        writer.finish()
    return sent


def _messages(data: DataSet, i: int) -> Iterator[Tuple[int, int, str, Dict[str, Any]]]:
    """Messages of one trial: time as recorded [ns], rank among those of one time, topic, content."""
    trial = data[i]
    taxel, wrench, stages = (data.times_ns(stream, i).tolist() for stream in ("taxel", "wrench", "stages"))
    for section in trial.phases():
        t_ns = taxel[section["first"]]
        yield t_ns, 0, "/phase", {"t_s": t_ns / _NS_PER_S, "trial": trial.file, "label": trial.label, "group": trial.group,
                                  "exploration": trial.exploration, "phase": section["phase"]}
    if trial.counts.shape[1]:
        for t_ns, counts in zip(taxel, trial.counts.tolist()):
            yield t_ns, 1, "/taxels", {"t_s": t_ns / _NS_PER_S, "counts": counts}
    for t_ns, values in zip(wrench, trial.wrench.tolist()):
        yield t_ns, 2, "/wrench", {"t_s": t_ns / _NS_PER_S, **dict(zip(WRENCH_COLUMNS, values))}
    for t_ns, values in zip(stages, trial.stages.tolist()):
        yield t_ns, 3, "/stages", {"t_s": t_ns / _NS_PER_S, **dict(zip(trial.stage_columns, values))}


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


_FORMATS = {".parquet": (to_parquet, "rows"), ".mcap": (to_mcap, "messages")}


def main(arguments: List[str]) -> int:
    """The command. Returns its exit status: 0, 1 with a sentence on the standard error, 2 for a wrong option."""
    parser = argparse.ArgumentParser("python3 -m weft_client.export", description="write a data set as Parquet or MCAP")
    parser.add_argument("dataset", help="data set (HDF5)")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path, help="write this file: NAME.parquet or NAME.mcap")
    chosen = parser.parse_args(arguments)
    if chosen.output.suffix not in _FORMATS:
        parser.error(f"unknown format of the output: {chosen.output} (expected {' or '.join(_FORMATS)})")
    write, what = _FORMATS[chosen.output.suffix]
    try:
        with DataSet(chosen.dataset) as data:
            count = write(data, chosen.output)
            print(f"{chosen.output}: {count} {what} of {len(data)} trials, data set {data.dataset_sha256}")
            if data.simulated:
                print("SIMULATED data: computed by the plant model; no real fabric was touched.")
    except (WeftError, ImportError, OSError) as problem:
        print(f"weft_client.export: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
