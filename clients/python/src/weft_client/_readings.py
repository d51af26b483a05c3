"""Readings of acceleration and sound of one trial, as arrays in SI units (extra: h5py)."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, Tuple

from ._extras import extra

numpy = extra("numpy", "h5py")

STREAMS = ("acceleration", "sound")
COLUMNS = {"acceleration": ("ax_mps2", "ay_mps2", "az_mps2"), "sound": ("sound_Pa",)}
UNITS = {"acceleration": "m/s2", "sound": "Pa"}
_NS_PER_S, _US_PER_S = 1e9, 1e6
_WRAP = 1 << 32  # of the sensor's clock [us]: 71.6 minutes


@dataclass(frozen=True)
class Readings:
    """Readings of a sensor that sends blocks, all of one size. Within a block they are evenly spaced by the sensor's clock.

    stream               acceleration or sound
    rate_hz              of the readings
    block_t_ns [blocks]  arrival of each block, campaign's clock [ns]
    device_us  [blocks]  sensor's clock at the first reading of the block, wraps around
    lost       [blocks]  blocks missing right before this one
    clipped    [blocks]  values at an end of the sensor's range
    values     [n, 3]    x y z of the sensor's frame [m/s2]; of sound [n], [Pa]
    """

    stream: str
    rate_hz: float
    block_t_ns: Any = field(repr=False)
    device_us: Any = field(repr=False)
    lost: Any = field(repr=False)
    clipped: Any = field(repr=False)
    values: Any = field(repr=False)

    @property
    def t_ns(self) -> Any:
        """[n] int64, campaign's clock [ns]: the arrival of the block, minus the readings after this one at `rate_hz`. Blocks may arrive late, never early."""
        after = numpy.arange(self._in_block - 1, -1, -1) / self.rate_hz * _NS_PER_S
        return (self.block_t_ns[:, None] - numpy.floor(after + 0.5).astype(numpy.int64)).reshape(-1)

    @property
    def t_s(self) -> Any:
        """[n] campaign's clock [s]: t_ns."""
        return self.t_ns / _NS_PER_S

    @property
    def device_s(self) -> Any:
        """[n] sensor's clock [s]: reading k of a block was taken k / rate_hz after its device_us. It does not wrap within a trial, and is free of the delays
        of the transport. Lost blocks and pauses between phases are steps of more than 1 / rate_hz."""
        steps = numpy.diff(self.device_us.astype(numpy.int64))
        steps = (steps + _WRAP // 2) % _WRAP - _WRAP // 2
        begins = numpy.cumsum(numpy.concatenate([self.device_us[:1].astype(numpy.int64), steps])) / _US_PER_S
        return (begins[:, None] + numpy.arange(self._in_block) / self.rate_hz).reshape(-1)

    @property
    def units(self) -> Dict[str, str]:
        """Unit of each array."""
        return {"block_t_ns": "ns", "device_us": "us", "lost": "1", "clipped": "1", "t_ns": "ns", "t_s": "s", "device_s": "s", "values": UNITS[self.stream]}

    @property
    def columns(self) -> Tuple[str, ...]:
        """Names of the columns of `values` with their unit: ax_mps2, ay_mps2, az_mps2, or sound_Pa."""
        return COLUMNS[self.stream]

    @property
    def _in_block(self) -> int:
        return len(self.values) // len(self.block_t_ns) if len(self.block_t_ns) else 0


def phase_at(t_ns: Any, frame_t_ns: Any, phase: Any, rate_hz: float) -> Any:
    """Phase [n] bytes at times [n] int64: that of the newest taxel frame, or "-" if that is older than two frame periods (of `rate_hz`; 0: any age)."""
    newest = numpy.searchsorted(frame_t_ns, t_ns, side="right") - 1
    out = numpy.full(len(t_ns), b"-", dtype="S1")
    if len(frame_t_ns):
        oldest_ns = int(2 * _NS_PER_S / rate_hz + 0.5) if rate_hz > 0 else numpy.iinfo(numpy.int64).max
        known = (newest >= 0) & (t_ns - frame_t_ns[newest] <= oldest_ns)
        out[known] = phase[newest[known]]
    return out
