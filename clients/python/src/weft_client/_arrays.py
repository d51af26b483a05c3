"""Features of a data set as the arrays of scikit-learn."""
from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import pathlib
import re
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Set, Tuple, Union

from ._errors import DataAltered, RequestError
from ._extras import extra

numpy = extra("numpy", "h5py")


class Arrays(NamedTuple):
    """Rows of a features CSV.

    X       [rows, features] float64, in the units that `weft fabric features` prints
    y       [rows] labels
    groups  [rows]; rows of one group must not be split between training and test
    files   [rows] the trial of each row; with --window-s its window follows, as in 0000-silk-M1-r01#w0
    names   of the features
    dataset_sha256  of the data set, if the table has it: `weft export --format features-csv` writes it into list.json beside the table; None of other tables
    """

    X: Any
    y: Any
    groups: Any
    files: Tuple[str, ...]
    names: Tuple[str, ...]
    dataset_sha256: Optional[str] = None


def read(table: "Union[str, os.PathLike[str]]", labels: Dict[str, str], chosen: Set[str], factors: Sequence[str], dataset_sha256: str = "") -> Arrays:
    """Rows of the `chosen` trials. `labels`: of each trial of the data set; `factors` are columns that are no features.

    Errors: OSError; RequestError if the table is no features CSV, is listed as one of another data set than `dataset_sha256`, or has a trial that the data set
    lacks or labels otherwise; DataAltered if it differs from its digest in the list.
    """
    content = pathlib.Path(table).read_bytes()
    digest = _listed_digest(pathlib.Path(table), content)
    if digest not in (None, dataset_sha256):
        raise RequestError("table is of another data set", 1001, {"kind": "request.unreadable", "where": os.fspath(table), "got": digest,
                                                                  "expected": dataset_sha256, "hint": "Write the table again with `weft export`"})
    with io.StringIO(content.decode("utf-8"), newline="") as file:
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
                  tuple(head[i] for i in columns), digest)


def _listed_digest(table: pathlib.Path, content: bytes) -> Optional[str]:
    """Digest of the data set of an exported table, from list.json beside it; None without a list or an entry. The table's own digest is checked."""
    listed = table.with_name("list.json")
    try:
        files = json.loads(listed.read_text(encoding="utf-8"))
        ours = isinstance(files, dict) and files.get("format") == "weft-exports"
        found = [(str(each["sha256"]), str(each["dataset_sha256"])) for each in files["files"] if each["name"] == table.name] if ours else []
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as problem:
        raise RequestError(f"list of exports: {problem!r}", 1001, {"kind": "request.unreadable", "where": str(listed),
                                                                   "hint": "Move the table to another folder, or export it again"}) from problem
    if not found:
        return None
    own, dataset_sha256 = found[0]
    if hashlib.sha256(content).hexdigest() != own:
        raise DataAltered("table differs from its digest", 0, {"kind": "data.altered", "where": str(table), "expected": own,
                                                               "hint": "Write the table again with `weft export`"})
    return dataset_sha256


def _unreadable(table: "Union[str, os.PathLike[str]]", line: int, what: str, got: object, expected: object) -> RequestError:
    return RequestError(what, 1001, {"kind": "request.unreadable", "where": f"{os.fspath(table)}, line {line}", "got": got, "expected": expected,
                                     "hint": "Write the table of this data set with `weft fabric features`"})
