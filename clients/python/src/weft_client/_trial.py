"""One trial of a data set or a campaign file, as arrays in SI units (extra: numpy)."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Tuple, Union

WRENCH_COLUMNS = ("fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm")
WRENCH_UNITS = ("N", "N", "N", "N m", "N m", "N m")


def simulated(bench_kind: str) -> Optional[bool]:
    """Whether samples of this bench are simulated; None if it is unknown."""
    return {"simulated": True, "real": False}.get(bench_kind)


def count_unit(dtype: Any) -> str:
    """Unit of taxel values: whole ones are raw counts; of scaled ones it is not recorded."""
    return "count" if dtype.kind == "u" else "unknown"


def stage_columns(axes: Tuple[str, ...], units: Tuple[str, ...]) -> Tuple[str, ...]:
    return tuple(f"{axis}_{unit}" for axis, unit in zip(axes, units))


@dataclass(frozen=True)
class Trial:
    """Record of one trial from mounting to retracting. Times are seconds of the campaign's clock [s].

    label, group, exploration   fabric; trials of one group must not be split between training and test; "M1"
    index, attempt, repetition  in the plan; of that trial; of that fabric, from 1
    outcome                     complete, interrupted, rejected, ...
    taxel_t_s [n]               of each frame
    counts    [n, taxels]       raw counts
    phase     [n]               bytes: S rest, P press, M motion, E end, - transfer
    wrench_t_s, wrench [m, 6]   Fx Fy Fz [N], Tx Ty Tz [N m], in the sensor's frame
    stages_t_s, stages [k, axes]  [m], rotary ones [rad]; `axes` has their names
    bench_kind                  simulated, real or unknown
    axis_units                  "m" or "rad" of each axis
    digests                     of a trial of a data set: dataset_sha256, trial_sha256
    """

    file: str
    label: str
    group: str
    exploration: str
    index: int
    attempt: int
    repetition: int
    outcome: str
    bench_kind: str
    axes: Tuple[str, ...]
    taxel_t_s: Any = field(repr=False)
    counts: Any = field(repr=False)
    phase: Any = field(repr=False)
    wrench_t_s: Any = field(repr=False)
    wrench: Any = field(repr=False)
    stages_t_s: Any = field(repr=False)
    stages: Any = field(repr=False)
    axis_units: Tuple[str, ...] = ()
    digests: Dict[str, str] = field(default_factory=dict, repr=False)

    @property
    def simulated(self) -> Optional[bool]:
        """None if the kind of the bench is unknown."""
        return simulated(self.bench_kind)

    @property
    def units(self) -> Dict[str, Union[str, Tuple[str, ...]]]:
        """Unit of each array; of `wrench` and `stages` one for each column. Scaled counts of an imported set: "unknown"."""
        return {"taxel_t_s": "s", "counts": count_unit(self.counts.dtype), "wrench_t_s": "s", "wrench": WRENCH_UNITS, "stages_t_s": "s",
                "stages": self.axis_units}

    @property
    def stage_columns(self) -> Tuple[str, ...]:
        """Names of the columns of `stages` with their units, such as x_m and rx_rad."""
        return stage_columns(self.axes, self.axis_units)

    @property
    def attrs(self) -> Dict[str, Any]:
        """Metadata for a table of this trial; `simulated` is left out if it is unknown."""
        known = {} if self.simulated is None else {"simulated": self.simulated}
        return {"file": self.file, "label": self.label, "group": self.group, "exploration": self.exploration, "repetition": self.repetition,
                "bench_kind": self.bench_kind, **known, **self.digests}

    def in_phase(self, phase: str) -> Any:
        """Counts of one phase [n, taxels]: "S", "P", "M" or "E"."""
        return self.counts[self.phase == phase.encode()]

    def phases(self) -> List[Dict[str, Any]]:
        """Sections of frames of one phase: phase, first (frame), samples, begins_s, lasts_s."""
        out: List[Dict[str, Any]] = []
        first = 0
        for end in range(1, len(self.phase) + 1):
            if end == len(self.phase) or self.phase[end] != self.phase[first]:
                begins = float(self.taxel_t_s[first])
                out.append({"phase": bytes(self.phase[first]).decode(), "first": first, "samples": end - first, "begins_s": begins,
                            "lasts_s": float(self.taxel_t_s[end - 1]) - begins})
                first = end
        return out
