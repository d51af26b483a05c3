#!/usr/bin/env python3
"""Quality of the force regulation on the simulated bench in virtual time and on the emulated one in real time (two programs, real ports, but a
simulated fabric). All 17 fabrics take about 14 minutes of real time; WEFT_BENCH_FABRICS names fewer ("denim,silk"), WEFT_BENCH_EMULATED=0 skips the
emulated bench, WEFT_BENCH_SEED selects other patches and other noise than 2016.

Exit status 1 if on any bench a fabric did not complete, exceeds 5 N or at touch its weight by more than the aim allows, or settles too late. A missed
aim for the RMS is printed with its fabric and is no failure.

    forces.py BENCH_FORCES WEFT_RIG
    forces.py --selftest             checks the verdict on made-up figures
"""
import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/scenario"))
from emulated_support import ServedRig, rig_file  # noqa: E402

SET_POINT_N = 5
AIM_OVERSHOOT = 0.05   # times the set point, or one quantum
AIM_SETTLED_S = 1.5
AIM_RMS = 1.5          # times the quantum-limited floor

FIGURES = ("touch_overshoot_n", "press_overshoot_n", "settled_s", "rms_m_n", "worst_m_n")


def verdict(run):
    """Counts the fabrics that meet each aim, beside the limit of the quantum, and names those that miss one. Returns the counts and whether the run
    passes."""
    whole, failures = [], []
    for row in run["fabrics"]:
        lacking = [figure for figure in FIGURES if row[figure] is None]  # None: the trace does not show it
        if row["ended"] != "complete":
            failures.append(f"{row['fabric']} is incomplete: {row['ended']}")
        elif lacking:
            failures.append(f"{row['fabric']} is incomplete: no {', '.join(lacking)}")
        else:
            whole.append(row)
    if not run["complete"]:
        failures.append("the campaign did not run to its end")

    def allowed(row):
        return max(AIM_OVERSHOOT * SET_POINT_N, row["quantum_n"])

    def meets(aim, failing, told):
        """Number of rows that meet `aim`; the others are added to `failing` with their `told` text."""
        missed = [row for row in whole if not aim(row)]
        for row in missed:
            failing.append(f"{row['fabric']} {told(row)}")
        return len(whole) - len(missed)

    short = []
    met = {
        "touch": meets(lambda r: r["touch_overshoot_n"] <= allowed(r), failures,
                       lambda r: f"overshoots at touch by {1e3 * r['touch_overshoot_n']:.1f} mN"),
        "overshoot": meets(lambda r: r["press_overshoot_n"] <= allowed(r), short,
                           lambda r: f"overshoots in the press by {1e3 * r['press_overshoot_n']:.1f} mN"),
        "settled": meets(lambda r: r["settled_s"] <= AIM_SETTLED_S, failures,
                         lambda r: f"settles in {r['settled_s']:.2f} s"),
        "rms": meets(lambda r: r["rms_m_n"] <= AIM_RMS * r["quantum_floor_rms_n"], short,
                     lambda r: f"RMS {r['rms_m_n'] / r['quantum_floor_rms_n']:.2f} floors"),
    }
    print(f"{run['bench']}: of {len(run['fabrics'])} fabrics, overshoot at touch within 5 % or a quantum: {met['touch']}, in the "
          f"press: {met['overshoot']}, settled to 2 % within {AIM_SETTLED_S} s: {met['settled']}, RMS within "
          f"{AIM_RMS} times the quantum's floor: {met['rms']}")
    for line in short:
        print(f"  short of an aim: {line}")
    for line in failures:
        print(f"  FAILED: {line}")
    return met, not failures


def selftest():
    """Every miss must be reported by name, and the RMS alone must not fail the run."""
    good = {"fabric": "denim", "ended": "complete", "quantum_n": 0.01, "quantum_floor_rms_n": 0.003, "touch_overshoot_n": -0.1,
            "press_overshoot_n": 0.02, "settled_s": 1.2, "rms_m_n": 0.004, "worst_m_n": 0.02}
    for change, complete, passes, says in [
            ({}, True, True, ""), ({}, False, False, "did not run to its end"),
            ({"touch_overshoot_n": 0.26}, True, False, "denim overshoots at touch by 260.0 mN"),
            ({"touch_overshoot_n": 0.26, "quantum_n": 0.3}, True, True, ""),
            ({"ended": "failed: no contact", "touch_overshoot_n": None}, True, False, "denim is incomplete: failed: no contact"),
            ({"settled_s": 1.51}, True, False, "denim settles in 1.51 s"),
            ({"rms_m_n": 0.006}, True, True, "denim RMS 2.00 floors"),
            *(({figure: None}, True, False, f"denim is incomplete: no {figure}") for figure in FIGURES)]:
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            _, passed = verdict({"bench": "made up", "complete": complete, "fabrics": [{**good, **change}]})
        assert passed == passes and says in said.getvalue(), (change, passed, said.getvalue())


def measured(program, bench, part, fabrics):
    """The program's result for one bench, including failed trials."""
    part.unlink(missing_ok=True)  # from an earlier run
    ran = subprocess.run([program, str(bench), str(part), *fabrics])
    if not part.exists():
        sys.exit(f"forces: {bench}: no figures (status {ran.returncode})")
    run = json.loads(part.read_text())
    run["complete"] = run["complete"] and ran.returncode == 0
    return run


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
            runs.append(measured(program, bench, part, fabrics))
        if os.environ.get("WEFT_BENCH_EMULATED", "1") != "0":
            part = out / "forces-emulated.json"
            with ServedRig(weft_rig, path, rig, seed=2016):
                runs.append(measured(program, path, part, fabrics))
    passed = True
    for run in runs:
        run["met"], fine = verdict(run)
        passed = passed and fine
    (out / "forces.json").write_text(json.dumps({"name": "forces", "runs": runs}, indent=1))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(selftest() if sys.argv[1:] == ["--selftest"] else main())
