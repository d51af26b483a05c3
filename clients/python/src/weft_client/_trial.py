"""One trial of a data set or a campaign file, as arrays in SI units (extra: numpy)."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Tuple


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
