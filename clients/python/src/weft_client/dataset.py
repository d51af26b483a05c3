"""Data sets (dataset.h5) as arrays (extra: h5py). Layout: docs/reference/dataset.md, "HDF5 layout".

    from weft_client.dataset import DataSet
    with DataSet("out/m1/dataset.h5") as data:
        print(data.bench_kind, data[0].label, data[0].in_phase("M").shape)
"""
from __future__ import annotations

import os
from typing import Any, Iterator, Tuple, Union

import h5py
import numpy

from ._errors import RequestError
from ._trial import Trial

_NS_PER_S = 1e9


class DataSet:
    """A sequence of trials, read one at a time. Digests are not checked here: `weft verify` does that.

    Attributes: `bench_kind` (simulated, real, unknown), `name`, `dataset_sha256`, `axes`; `h5` is the h5py file.
    """

    def __init__(self, file: "Union[str, os.PathLike[str]]") -> None:
        """Errors: RequestError if it is not a data set of Weft; OSError if it is not an HDF5 file."""
        self.h5 = h5py.File(file, "r")
        if _text(self.h5.attrs.get("format", b"")) != "weft-dataset":
            self.h5.close()
            raise RequestError("not a data set of Weft", 1001, {"kind": "request.unreadable", "where": os.fspath(file)})
        self.bench_kind, self.name, self.dataset_sha256 = (_text(self.h5.attrs[k]) for k in ("bench_kind", "name", "dataset_sha256"))
        self.axes: Tuple[str, ...] = tuple(_text(name) for name in self.h5["stages/axis"][:])

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
        if not -len(self) <= i < len(self):
            raise IndexError(f"trial index out of range: {i} (expected {-len(self)} to {len(self) - 1})")
        i %= len(self)
        file, label, group, exploration, outcome = (_text(self.h5[f"trials/{k}"][i])
                                                    for k in ("file", "label", "group", "exploration", "outcome"))
        index, attempt, repetition = (int(self.h5[f"trials/{k}"][i]) for k in ("index", "attempt", "repetition"))
        taxel, wrench, stages = (self._span(stream, i) for stream in ("taxel", "wrench", "stages"))
        phase = self.h5["taxel/phase"][taxel]
        quanta, per_unit = self.h5["wrench/quanta"], self.h5["wrench/quanta"].attrs["per_unit"]
        return Trial(file, label, group, exploration, index, attempt, repetition, outcome, self.bench_kind, self.axes,
                     self.h5["taxel/t_ns"][taxel] / _NS_PER_S, self._counts(taxel), phase.view("S1"),
                     self.h5["wrench/t_ns"][wrench] / _NS_PER_S, quanta[wrench] / per_unit,
                     self.h5["stages/t_ns"][stages] / _NS_PER_S, self.h5["stages/quanta"][stages] / self.h5["stages/per_unit"][:])

    def _counts(self, taxel: slice) -> Any:
        """A rig without taxels has [n, 0]: its phases refer to the wrench samples."""
        if "taxel/counts" in self.h5:
            return self.h5["taxel/counts"][taxel]
        return numpy.empty((taxel.stop - taxel.start, 0), numpy.uint16)

    def _span(self, stream: str, i: int) -> slice:
        first = int(self.h5[f"trials/{stream}_first"][i])
        return slice(first, first + int(self.h5[f"trials/{stream}_samples"][i]))


def _text(value: Any) -> str:
    if isinstance(value, numpy.ndarray):
        value = value.item()
    return value.decode() if isinstance(value, bytes) else str(value)
