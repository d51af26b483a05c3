"""Trials, their phases and their samples as pandas frames (extra: pandas).

    from weft_client.frames import phases, readings, samples, trials
    trials(data).groupby("label").size()
    samples(data[0], "wrench")["fz_N"].plot()
"""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Iterable

from ._errors import RequestError
from ._extras import extra
from ._trial import WRENCH_COLUMNS, Trial

if TYPE_CHECKING:
    from ._readings import Readings

pandas = extra("pandas", "pandas")


def trials(of: Iterable[Trial]) -> Any:
    """A row for each trial: names, outcome, frames, lasts_s [s], and the mean of Fz in phase M, force_n [N]."""
    rows = []
    for trial in of:
        moving = trial.taxel_t_s[trial.phase == b"M"]
        if len(moving):
            during = trial.wrench[(trial.wrench_t_s >= moving[0]) & (trial.wrench_t_s <= moving[-1]), 2]
        else:
            during = trial.wrench[:0, 2]
        rows.append({"file": trial.file, "label": trial.label, "group": trial.group, "exploration": trial.exploration,
                     "repetition": trial.repetition, "outcome": trial.outcome, "bench_kind": trial.bench_kind, "frames": len(trial.counts),
                     "lasts_s": float(trial.taxel_t_s[-1] - trial.taxel_t_s[0]) if len(trial.taxel_t_s) else 0.0,
                     "force_n": float(during.mean()) if len(during) else float("nan")})
    return pandas.DataFrame(rows)


def phases(of: Iterable[Trial]) -> Any:
    """A row for each phase of each trial: file, label, exploration, repetition, phase, first, samples, begins_s, lasts_s [s]."""
    return pandas.DataFrame([{"file": trial.file, "label": trial.label, "exploration": trial.exploration, "repetition": trial.repetition, **phase}
                             for trial in of for phase in trial.phases()])


def samples(trial: Trial, stream: str = "taxels") -> Any:
    """A row for each sample of one stream; the index is t_s, the campaign's clock [s].

    taxels   phase, ch1 ... chN in `trial.units["counts"]`
    wrench   fx_N fy_N fz_N tx_Nm ty_Nm tz_Nm, in the sensor's frame
    stages   a column for each axis with its unit, such as x_m, rx_rad

    `attrs` has file, label, group, exploration, repetition, bench_kind, `simulated` (left out if unknown) and `units` of the columns.
    Errors: RequestError for another stream.
    """
    units: Dict[str, str] = {}
    if stream == "taxels":
        units = {f"ch{taxel + 1}": str(trial.units["counts"]) for taxel in range(trial.counts.shape[1])}
        frame = pandas.DataFrame(trial.counts, index=trial.taxel_t_s, columns=list(units))
        frame.insert(0, "phase", trial.phase.astype("U1"))
    elif stream == "wrench":
        units = dict(zip(WRENCH_COLUMNS, trial.units["wrench"]))
        frame = pandas.DataFrame(trial.wrench, index=trial.wrench_t_s, columns=list(units))
    elif stream == "stages":
        units = dict(zip(trial.stage_columns, trial.axis_units))
        frame = pandas.DataFrame(trial.stages, index=trial.stages_t_s, columns=list(units))
    else:
        raise RequestError("unknown stream", 1003, {"kind": "param.range", "where": "stream", "got": stream, "expected": "taxels, wrench or stages",
                                                      "hint": "acceleration and sound: DataSet.frame()"})
    frame.index.name = "t_s"
    frame.attrs = {**trial.attrs, "units": {"t_s": "s", **units}}
    return frame


def readings(trial: Trial, of: "Readings", phase: Any) -> Any:
    """A row for each reading of acceleration or sound; the index is t_s, the campaign's clock [s]. DataSet.frame() calls it.

    phase                       as in samples-csv
    device_s                    sensor's clock [s], without the delays of the transport
    ax_mps2 ay_mps2 az_mps2     of acceleration, in the sensor's frame [m/s2]
    sound_Pa                    of sound [Pa]

    `attrs` as in samples(), and rate_hz.
    """
    frame = pandas.DataFrame(of.values.reshape(len(of.values), -1), index=of.t_s, columns=list(of.columns))
    frame.insert(0, "phase", phase.astype("U1"))
    frame.insert(1, "device_s", of.device_s)
    frame.index.name = "t_s"
    frame.attrs = {**trial.attrs, "rate_hz": of.rate_hz, "units": {"t_s": "s", "device_s": "s", **{column: of.units["values"] for column in of.columns}}}
    return frame
