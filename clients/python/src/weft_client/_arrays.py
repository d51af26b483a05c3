"""Features of a data set as the arrays of scikit-learn."""
from __future__ import annotations

import csv
import os
import re
from typing import Any, Dict, List, NamedTuple, Sequence, Set, Tuple, Union

from ._errors import RequestError
from ._extras import extra

numpy = extra("numpy", "h5py")


class Arrays(NamedTuple):
    """Rows of a features CSV.

    X       [rows, features] float64, in the units that `weft fabric features` prints
    y       [rows] labels
    groups  [rows]; rows of one group must not be split between training and test
    files   [rows] the trial of each row; with --window-s its window follows, as in 0000-silk-M1-r01#w0
    names   of the features
    """

    X: Any
    y: Any
    groups: Any
    files: Tuple[str, ...]
    names: Tuple[str, ...]


def read(table: "Union[str, os.PathLike[str]]", labels: Dict[str, str], chosen: Set[str], factors: Sequence[str]) -> Arrays:
    """Rows of the `chosen` trials. `labels`: of each trial of the data set; `factors` are columns that are no features.

    Errors: OSError; RequestError if the table is no features CSV, or has a trial that the data set lacks or labels otherwise.
    """
    with open(table, newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        head: List[str] = next(rows, [])
        if head[:3] != ["file", "label", "group"]:
            raise _unreadable(table, 1, "first columns of a features CSV", ",".join(head[:3]), "file,label,group")
        columns = [i for i, name in enumerate(head) if i >= 3 and name not in factors]
        kept: List[List[str]] = []
        for row in rows:
            if len(row) != len(head):
                raise _unreadable(table, rows.line_num, "number of columns", len(row), len(head))
            trial = row[0] if row[0] in labels else re.sub(r"#w\d+$", "", row[0])  # a window, else the trial
            if labels.get(trial) != row[1]:
                raise _unreadable(table, rows.line_num, f"label of trial {trial}", row[1], labels.get(trial, "a trial of this data set"))
            if trial in chosen:
                kept.append(row)
    x = numpy.array([[float(row[i]) for i in columns] for row in kept], dtype=numpy.float64).reshape(len(kept), len(columns))
    return Arrays(x, numpy.array([row[1] for row in kept], dtype=str), numpy.array([row[2] for row in kept], dtype=str), tuple(row[0] for row in kept),
                  tuple(head[i] for i in columns))


def _unreadable(table: "Union[str, os.PathLike[str]]", line: int, what: str, got: object, expected: object) -> RequestError:
    return RequestError(what, 1001, {"kind": "request.unreadable", "where": f"{os.fspath(table)}, line {line}", "got": got, "expected": expected,
                                     "hint": "Write the table of this data set with `weft fabric features`"})
