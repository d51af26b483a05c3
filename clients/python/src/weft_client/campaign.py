"""Campaign files (campaign.sqlite) as arrays, without HDF5 (extra: numpy). Layout: docs/reference/dataset.md, "Campaign file".

    from weft_client.campaign import Campaign
    with Campaign("out/m1") as campaign:
        for trial in campaign.trials():
            print(trial.label, trial.in_phase("M").mean())
"""
from __future__ import annotations

import os
import pathlib
import sqlite3
import zlib
from typing import Any, Iterator, List, Tuple, Union

from ._errors import DataAltered, RequestError
from ._extras import extra
from ._trial import Trial

numpy = extra("numpy", "numpy")

_TAXEL, _WRENCH, _STAGES = 0, 1, 2
_WRENCH_PER_UNIT = 1e6
_NS_PER_S = 1e9


class Campaign:
    """One campaign file, or that of a run's folder, opened read-only. During a campaign it has the committed trials."""

    def __init__(self, file: "Union[str, os.PathLike[str]]") -> None:
        """Errors: RequestError if it is not a campaign file."""
        self._path = pathlib.Path(file)
        if self._path.is_dir():
            self._path /= "campaign.sqlite"
        if not self._path.is_file():
            raise RequestError("campaign file not found", 1004, {"kind": "not_found", "where": str(self._path)})
        self._data = sqlite3.connect(f"{self._path.resolve().as_uri()}?mode=ro", uri=True)
        try:
            self.bench_kind, self.name, self._taxels = self._data.execute("SELECT bench_kind, name, taxels FROM campaign").fetchone()
            axes = self._data.execute("SELECT name, rotary FROM axis ORDER BY position").fetchall()
        except (sqlite3.DatabaseError, TypeError) as problem:
            self._data.close()
            raise RequestError(f"not a campaign file: {problem}", 1001, {"kind": "request.unreadable", "where": str(self._path)}) from problem
        self.axes: Tuple[str, ...] = tuple(name for name, _ in axes)
        self._axis_units = tuple("rad" if rotary else "m" for _, rotary in axes)
        self._stage_per_unit = numpy.array([1e8 if rotary else 1e9 for _, rotary in axes])

    def close(self) -> None:
        self._data.close()

    def __enter__(self) -> "Campaign":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def trials(self, outcome: str = "complete") -> Iterator[Trial]:
        """Trials in the order of execution; "" for all outcomes. Errors: DataAltered if the CRC of a chunk differs."""
        rows = self._data.execute("SELECT id, label, trial_group, exploration, plan_index, attempt, repetition, outcome FROM trial ORDER BY id")
        for key, label, group, exploration, index, attempt, repetition, ended in rows.fetchall():
            ended = ended or "interrupted"
            if outcome and ended != outcome:
                continue
            taxels = self._rows(key, _TAXEL, self._taxel_row())
            wrench = self._rows(key, _WRENCH, numpy.dtype([("t_ns", "<i8"), ("status", "<u4"), ("valid", "u1"), ("quanta", "<i4", (6,))]))
            stages = self._rows(key, _STAGES, numpy.dtype([("t_ns", "<i8"), ("quanta", "<i4", (len(self.axes),))]))
            yield Trial(f"{index:04d}-{label}-{exploration}-r{repetition:02d}", label, group, exploration, index, attempt, repetition, ended,
                        self.bench_kind, self.axes, taxels["t_ns"] / _NS_PER_S, taxels["counts"], taxels["phase"],
                        wrench["t_ns"] / _NS_PER_S, wrench["quanta"] / _WRENCH_PER_UNIT, stages["t_ns"] / _NS_PER_S,
                        stages["quanta"] / self._stage_per_unit, self._axis_units)

    def _taxel_row(self) -> Any:
        return numpy.dtype([("t_ns", "<i8"), ("device_us", "<u4"), ("proximity", "<u2"), ("ambient", "<u2"), ("phase", "S1"),
                            ("counts", "<u2", (self._taxels,))])

    def _rows(self, trial: int, stream: int, row: Any) -> Any:
        pieces: List[bytes] = []
        chunks = self._data.execute("SELECT number, rows, crc32, data FROM chunk WHERE trial = ? AND stream = ? ORDER BY number", (trial, stream))
        for number, rows, crc32, data in chunks:
            if zlib.crc32(data) != crc32 or len(data) != rows * row.itemsize:
                raise DataAltered("chunk differs from its recorded length or CRC-32", 0, {
                    "kind": "data.altered", "where": f"{self._path}: trial {trial}, stream {stream}, chunk {number}",
                    "hint": "Run `weft verify` to list the damaged files"})
            pieces.append(data)
        return numpy.frombuffer(b"".join(pieces), dtype=row)
