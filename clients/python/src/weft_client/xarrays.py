"""One trial as an xarray Dataset (extra: xarray).

    from weft_client.xarrays import dataset
    dataset(data[0])["counts"].sel(taxel=3).plot()
"""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Sequence

from ._extras import extra
from ._trial import Trial

if TYPE_CHECKING:
    from ._readings import Readings

xarray = extra("xarray", "xarray")


def dataset(trial: Trial, readings: "Sequence[Readings]" = ()) -> Any:
    """Each stream has its own time, in seconds of the campaign's clock [s]; each variable has one unit, in its attribute `units`.

    counts [time, taxel]            taxels from 1; phase [time]: S rest, P press, M motion, E end, - transfer
    force [wrench_time, channel]    [N], torque [N m]; channels x y z of the sensor's frame
    stage_NAME [stages_time]        [m], rotary axes [rad]
    acceleration [acceleration_time, acceleration_axis]    of `readings`: [m/s2], x y z of its sensor's frame
    sound [sound_time]              of `readings`: [Pa]

    acceleration_device_s and sound_device_s are the sensors' own clocks [s], without the delays of the transport.
    `attrs` has file, label, group, exploration, repetition, bench_kind and `simulated` (left out if unknown).
    """
    def of(dims: Any, values: Any, unit: str, name: str) -> Any:
        return (dims, values, {"units": unit, "long_name": name} if unit else {"long_name": name})

    values: Dict[str, Any] = {
        "counts": of(("time", "taxel"), trial.counts, str(trial.units["counts"]), "taxel counts"),
        "phase": of("time", trial.phase.astype("U1"), "", "phase of the trial"),
        "force": of(("wrench_time", "channel"), trial.wrench[:, :3], "N", "force"),
        "torque": of(("wrench_time", "channel"), trial.wrench[:, 3:], "N m", "torque")}
    for number, (axis, unit) in enumerate(zip(trial.axes, trial.axis_units)):
        values[f"stage_{axis}"] = of("stages_time", trial.stages[:, number], unit, f"position of stage {axis}")
    times = {"time": trial.taxel_t_s, "wrench_time": trial.wrench_t_s, "stages_time": trial.stages_t_s}
    more: Dict[str, Any] = {}
    for each in readings:
        time = f"{each.stream}_time"
        times[time] = each.t_s
        more[f"{each.stream}_device_s"] = of(time, each.device_s, "s", "time of the sensor's clock")
        values[each.stream] = of(time if each.values.ndim == 1 else (time, f"{each.stream}_axis"), each.values, each.units["values"], each.stream)
        values[each.stream][2]["rate_hz"] = each.rate_hz
        if each.values.ndim > 1:
            more[f"{each.stream}_axis"] = ["x", "y", "z"]
    coords = {name: of(name, t_s, "s", "time of the campaign's clock") for name, t_s in times.items()}
    return xarray.Dataset(values, {**coords, **more, "taxel": list(range(1, trial.counts.shape[1] + 1)), "channel": ["x", "y", "z"]}, trial.attrs)
