"""Trials and their phases as pandas frames (extra: pandas).

    from weft_client.frames import phases, trials
    trials(data).groupby("label").size()
"""
from __future__ import annotations

from typing import Any, Iterable

import pandas

from ._trial import Trial


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
