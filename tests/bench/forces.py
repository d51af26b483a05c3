#!/usr/bin/env python3
"""How well the force is held, on the simulated bench in virtual time and on the emulated one in real time (two
programs, real ports; its cloth is simulated all the same). All 17 fabrics take about 14 minutes of real time;
WEFT_BENCH_FABRICS names fewer ("denim,silk"), WEFT_BENCH_EMULATED=0 leaves the emulated bench out.

    forces.py BENCH_FORCES WEFT_RIG
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/scenario"))
from emulated_support import ServedRig, rig_file  # noqa: E402

AIM_OVERSHOOT = 0.05   # of the set point, or one quantum
AIM_SETTLED_S = 1.5
AIM_RMS = 1.5          # times the quantum-limited floor


def verdict(run):
    """How many fabrics meet each aim, beside what the quantum allows."""
    rows = run["fabrics"]
    met = {
        "overshoot": sum(r["press_overshoot_n"] <= max(AIM_OVERSHOOT * 5, r["quantum_n"]) for r in rows),
        "touch": sum(r["touch_overshoot_n"] <= max(AIM_OVERSHOOT * 5, r["quantum_n"]) for r in rows),
        "settled": sum(r["settled_s"] <= AIM_SETTLED_S for r in rows),
        "rms": sum(r["rms_m_n"] <= AIM_RMS * r["quantum_floor_rms_n"] for r in rows),
    }
    print(f"{run['bench']}: of {len(rows)} fabrics, overshoot at touch within 5 % or a quantum: {met['touch']}, in the "
          f"press: {met['overshoot']}, settled to 2 % within {AIM_SETTLED_S} s: {met['settled']}, RMS within "
          f"{AIM_RMS} times the quantum's floor: {met['rms']}")
    return met


def main():
    program, weft_rig = (str(pathlib.Path(p).resolve()) for p in sys.argv[1:3])
    fabrics = [f for f in os.environ.get("WEFT_BENCH_FABRICS", "").split(",") if f]
    out = pathlib.Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        path, rig = rig_file(ROOT, pathlib.Path(folder))
        memory = json.loads(json.dumps(rig))
        memory["bench"] = "simulated"
        for device in memory["devices"]:
            device["link"] = {"kind": "memory"}
        in_memory = pathlib.Path(folder) / "memory.json"
        in_memory.write_text(json.dumps(memory))
        for bench in (ROOT / "sim/rigs/bench17.json", in_memory):
            part = out / f"forces-{bench.stem}.json"
            subprocess.run([program, str(bench), str(part), *fabrics], check=True)
            runs.append(json.loads(part.read_text()))
        if os.environ.get("WEFT_BENCH_EMULATED", "1") != "0":
            part = out / "forces-emulated.json"
            with ServedRig(weft_rig, path, rig, seed=2016):
                subprocess.run([program, str(path), str(part), *fabrics])
            runs.append(json.loads(part.read_text()))
    for run in runs:
        run["met"] = verdict(run)
    (out / "forces.json").write_text(json.dumps({"name": "forces", "runs": runs}, indent=1))


if __name__ == "__main__":
    main()
