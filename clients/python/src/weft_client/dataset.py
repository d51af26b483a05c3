"""Data sets (dataset.h5) as arrays (extra: h5py). Layout: docs/reference/dataset.md, "HDF5 layout".

    from weft_client.dataset import DataSet
    with DataSet("out/m1/dataset.h5") as data:
        print(data.bench_kind, data[0].label, data[0].in_phase("M").shape)   # numpy
        print(data.overview(), data.frame(0, "wrench"))                      # extra: pandas
        print(data.xarray(0))                                                # extra: xarray
        print(data.vibrations, data.readings(0, "sound").values)             # sound and vibration
        X, y, groups, *_ = data.arrays("features.csv", "M1")                 # for scikit-learn
        data.to_parquet("m1.parquet"), data.to_mcap("m1.mcap")               # extras: parquet, mcap
"""
from __future__ import annotations

import os
from typing import Any, Dict, Iterator, Optional, Tuple, Union

from . import _arrays, _readings, _trial
from ._errors import RequestError
from ._extras import extra
from ._readings import Readings
from ._trial import Trial

numpy = extra("numpy", "h5py")
h5py = extra("h5py", "h5py")

_NS_PER_S = 1e9


class DataSet:
    """A sequence of trials, read one at a time. Digests are not checked here: `weft verify` does that.

    Attributes: `bench_kind` (simulated, real, unknown), `name`, `dataset_sha256`, `axes`, `axis_units` (m, rad), `count_unit` (count, or
    unknown for scaled values); `h5` is the h5py file, for one thread at a time.
    """

    def __init__(self, file: "Union[str, os.PathLike[str]]") -> None:
        """Errors: RequestError if it is not a data set of Weft; OSError if it is not an HDF5 file."""
        self.h5 = h5py.File(file, "r")
        if _text(self.h5.attrs.get("format", b"")) != "weft-dataset":
            self.h5.close()
            raise RequestError("not a data set of Weft", 1001, {"kind": "request.unreadable", "where": os.fspath(file)})
        self.bench_kind, self.name, self.dataset_sha256 = (_text(self.h5.attrs[k]) for k in ("bench_kind", "name", "dataset_sha256"))
        self.axes: Tuple[str, ...] = tuple(_text(name) for name in self.h5["stages/axis"][:])
        self.axis_units: Tuple[str, ...] = tuple(_text(unit) for unit in self.h5["stages/unit"][:])
        self.count_unit = _trial.count_unit(self.h5["taxel/counts"].dtype) if "taxel/counts" in self.h5 else "count"

    def close(self) -> None:
        self.h5.close()

    def __enter__(self) -> "DataSet":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.h5["trials/label"])

    def __iter__(self) -> Iterator[Trial]:
        return (self[i] for i in range(len(self)))

    def __getitem__(self, i: int) -> Trial:
        """The trial of row `i` of /trials. Errors: IndexError."""
        i = self._index(i)
        file, label, group, exploration, outcome = (_text(self.h5[f"trials/{k}"][i])
                                                    for k in ("file", "label", "group", "exploration", "outcome"))
        index, attempt, repetition = (int(self.h5[f"trials/{k}"][i]) for k in ("index", "attempt", "repetition"))
        taxel, wrench, stages = (self._span(stream, i) for stream in ("taxel", "wrench", "stages"))
        phase = self.h5["taxel/phase"][taxel]
        quanta, per_unit = self.h5["wrench/quanta"], self.h5["wrench/quanta"].attrs["per_unit"]
        return Trial(file, label, group, exploration, index, attempt, repetition, outcome, self.bench_kind, self.axes,
                     self.h5["taxel/t_ns"][taxel] / _NS_PER_S, self._counts(taxel), phase.view("S1"),
                     self.h5["wrench/t_ns"][wrench] / _NS_PER_S, quanta[wrench] / per_unit,
                     self.h5["stages/t_ns"][stages] / _NS_PER_S, self.h5["stages/quanta"][stages] / self.h5["stages/per_unit"][:], self.axis_units,
                     {"dataset_sha256": self.dataset_sha256, "trial_sha256": self.text("trials/sha256", i)})

    @property
    def simulated(self) -> Optional[bool]:
        """None if the kind of the bench is unknown."""
        return _trial.simulated(self.bench_kind)

    @property
    def stage_columns(self) -> Tuple[str, ...]:
        """Names of the axes with their units, such as x_m and rx_rad."""
        return _trial.stage_columns(self.axes, self.axis_units)

    @property
    def vibrations(self) -> Tuple[str, ...]:
        """Those of "acceleration" and "sound" that the set has."""
        return tuple(stream for stream in _readings.STREAMS if stream in self.h5)

    def readings(self, i: int, stream: str) -> Readings:
        """Readings of trial `i`; stream: acceleration [m/s2] or sound [Pa]. Errors: IndexError; RequestError if the set does not have the stream."""
        i = self._index(i)
        if stream not in self.vibrations:
            raise RequestError("unknown or missing stream of readings", 1003, {
                "kind": "param.range", "where": str(self.h5.filename), "got": stream,
                "expected": " or ".join(self.vibrations) or "none: this set has no acceleration and no sound"})
        group = self.h5[stream]
        blocks = self._span(f"{stream}_blocks", i)
        size = int(group.attrs["block_readings"])
        quanta = group["quanta"][blocks.start * size:blocks.stop * size]
        t_ns, device_us, lost, clipped = (group[name][blocks] for name in ("t_ns", "device_us", "lost", "clipped"))
        return Readings(stream, float(group.attrs["rate_hz"]), t_ns, device_us, lost, clipped, quanta / group["quanta"].attrs["per_unit"])

    def phases_at(self, i: int, t_ns: Any) -> Any:
        """Phase [n] bytes of trial `i` at times of the campaign's clock [n] int64 [ns], as in samples-csv: that of the newest taxel frame (without taxels:
        wrench sample), or "-" if that is older than two periods. Errors: IndexError."""
        i = self._index(i)
        rate_hz = float(self.h5["taxel" if "taxel/counts" in self.h5 else "wrench"].attrs["rate_hz"])
        return _readings.phase_at(t_ns, self.times_ns("taxel", i), self.h5["taxel/phase"][self._span("taxel", i)].view("S1"), rate_hz)

    def text(self, column: str, i: int) -> str:
        """Value of a text column, such as "trials/sha256", in row `i`."""
        return _text(self.h5[column][i])

    def times_ns(self, stream: str, i: int) -> Any:
        """Recorded times of trial `i` [n] int64 [ns]; stream: taxel, wrench or stages."""
        return self.h5[f"{stream}/t_ns"][self._span(stream, i)]

    def overview(self) -> Any:
        """A pandas frame with a row for each trial, without reading samples: the columns of /trials, the factors of a sweep [SI], and samples of each stream.

        `attrs` has name, dataset_sha256, bench_kind and `simulated` (left out if unknown). Errors: ImportError without pandas.
        """
        pandas = extra("pandas", "pandas")
        columns: Dict[str, Any] = {}
        for name, column in self.h5["trials"].items():
            if not name.endswith("_first"):
                columns[name] = [_text(value) for value in column[:]] if column.dtype.kind == "S" else column[:]
        for k, name in enumerate(self._factors()):
            columns[name] = self.h5["factors/values"][:, k]
        first = [name for name in ("file", "label", "group", "exploration", "repetition", "outcome") if name in columns]
        frame = pandas.DataFrame(columns)[[*first, *(name for name in columns if name not in first)]]
        known = {} if self.simulated is None else {"simulated": self.simulated}
        frame.attrs = {"name": self.name, "dataset_sha256": self.dataset_sha256, "bench_kind": self.bench_kind, **known}
        return frame

    def frame(self, i: int, stream: str = "taxels") -> Any:
        """Samples of trial `i` as a pandas frame: frames.samples(), of acceleration and sound frames.readings().

        Errors: IndexError; RequestError for an unknown or missing stream; ImportError without pandas.
        """
        from . import frames
        if stream not in _readings.STREAMS:
            return frames.samples(self[i], stream)
        of = self.readings(i, stream)
        return frames.readings(self[i], of, self.phases_at(i, of.t_ns))

    def xarray(self, i: int) -> Any:
        """Trial `i` with its acceleration and sound as an xarray Dataset: xarrays.dataset(). Errors: IndexError; ImportError without xarray."""
        from .xarrays import dataset
        return dataset(self[i], [self.readings(i, stream) for stream in self.vibrations])

    def arrays(self, features: "Union[str, os.PathLike[str]]", exploration: str = "") -> _arrays.Arrays:
        """X, y and groups for scikit-learn, from the CSV that `weft export` or `weft fabric features` writes of this data set; "" takes all explorations.

        Factors of a sweep are left out: overview() has them. An exported table also has the digest of its data set, which is compared. Errors: OSError;
        RequestError if the CSV is of another data set or lacks the exploration; DataAltered if it was changed after the export.
        """
        files, labels, explorations = ([_text(value) for value in self.h5[f"trials/{k}"][:]] for k in ("file", "label", "exploration"))
        chosen = {file for file, of in zip(files, explorations) if exploration in ("", of)}
        if not chosen:
            raise RequestError("exploration not found", 1004, {"kind": "not_found", "where": str(self.h5.filename), "got": exploration,
                                                               "expected": ", ".join(sorted(set(explorations)))})
        return _arrays.read(features, dict(zip(files, labels)), chosen, self._factors(), self.dataset_sha256)

    def to_parquet(self, path: "Union[str, os.PathLike[str]]", stream: str = "taxels") -> int:
        """Writes one stream: export.to_parquet(). Returns the number of rows. Errors: ImportError without pyarrow; RequestError, OSError."""
        from .export import to_parquet
        return to_parquet(self, path, stream)

    def to_mcap(self, path: "Union[str, os.PathLike[str]]") -> int:
        """Writes all streams and phases: export.to_mcap(). Returns the number of messages. Errors: ImportError without mcap; RequestError, OSError."""
        from .export import to_mcap
        return to_mcap(self, path)

    def _factors(self) -> Tuple[str, ...]:
        return tuple(_text(name) for name in self.h5["factors/name"][:]) if "factors" in self.h5 else ()

    def _counts(self, taxel: slice) -> Any:
        """A rig without taxels has [n, 0]: its phases refer to the wrench samples."""
        if "taxel/counts" in self.h5:
            return self.h5["taxel/counts"][taxel]
        return numpy.empty((taxel.stop - taxel.start, 0), numpy.uint16)

    def _index(self, i: int) -> int:
        if not -len(self) <= i < len(self):
            raise IndexError(f"trial index out of range: {i} (expected {-len(self)} to {len(self) - 1})")
        return i % len(self)

    def _span(self, stream: str, i: int) -> slice:
        first = int(self.h5[f"trials/{stream}_first"][i])
        return slice(first, first + int(self.h5[f"trials/{stream}_samples"][i]))


def _text(value: Any) -> str:
    if isinstance(value, numpy.ndarray):
        value = value.item()
    return value.decode() if isinstance(value, bytes) else str(value)
