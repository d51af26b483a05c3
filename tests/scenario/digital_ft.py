"""A Modbus client's readings of a Digital F/T sensor, decoded from the document only and compared with the truth."""
import math
import struct

from emulated_support import PLATE_KG, START_RX_DEG

GRAVITY = 9.80665
TOLERANCE = [0.05] * 3 + [0.002] * 3  # N, N m: resolution of the sensor and five times its noise


def s16(words):
    return [w - 65536 if w > 32767 else w for w in words]


def wrench(calibration, gauges):
    """ATI Digital F/T (docs/reference/device-facts.md): matrix at register 32, float32 with the high word first; scales at 117 and 119."""
    raw = struct.pack(">168H", *calibration)
    matrix = struct.unpack(">36f", raw[64:64 + 144])
    per_force, per_torque = struct.unpack(">2i", raw[234:242])
    return [sum(matrix[6 * row + g] * gauges[g] for g in range(6)) / (per_force if row < 3 else per_torque)
            for row in range(6)]


def near_truth(t, who, calibration, gauges):
    # Nothing touches the plate, which is tilted before rx is homed: the sensor, under its middle, carries its weight.
    weight_n, tilt = PLATE_KG * GRAVITY, math.radians(START_RX_DEG)
    truth = [0, -weight_n * math.sin(tilt), weight_n * math.cos(tilt), 0, 0, 0]
    seen = wrench(calibration, gauges)
    print(f"SIMULATED {who}: Fx Fy Fz " + " ".join(f"{v:.4f}" for v in seen[:3]) + " N")
    t.expect(all(abs(a - b) < limit for a, b, limit in zip(seen, truth, TOLERANCE)), f"{who}: {seen} for {truth}")
