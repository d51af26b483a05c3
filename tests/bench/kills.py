#!/usr/bin/env python3
"""Kills hosts of the emulated bench at seeded moments of every phase (tests/scenario/emulated_kill.py), on several benches in parallel, each with its
own ports and seed: a kill takes 35 s, nearly all of it waiting. WEFT_BENCH_KILLS is the number of SIGKILL (16; 200 took 20 minutes on eight benches),
WEFT_BENCH_BENCHES the number of benches (4). Every fourth SIGKILL is accompanied by a SIGSTOP.

Exit status 1 if a check failed on any bench, or no SIGKILL fell into one of the phases S, P, M, E.

    kills.py WEFT WEFT_RIG
"""
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/scenario"))
from emulated_kill import summary, unmet  # noqa: E402


def main():
    benches = int(os.environ.get("WEFT_BENCH_BENCHES", "4"))
    each = -(-int(os.environ.get("WEFT_BENCH_KILLS", "16")) // benches)
    out = pathlib.Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    parts = [out / f"kills-{seed}.json" for seed in range(benches)]
    for part in parts:
        part.unlink(missing_ok=True)  # from an earlier run
    running = [subprocess.Popen([sys.executable, str(ROOT / "tests/scenario/emulated_kill.py"), *sys.argv[1:3], str(ROOT),
                                 str(each), str(seed), str(part)]) for seed, part in enumerate(parts)]
    for process in running:
        process.wait()
    runs = [json.loads(part.read_text()) for part in parts if part.exists()]
    kills = [kill for run in runs for kill in run["kills"]]
    failures = [failure for run in runs for failure in run["failures"]]
    failures += [f"no SIGKILL fell into phase {phase}" for phase in unmet(kills)]
    if len(runs) < benches:
        failures.append(f"{benches - len(runs)} of {benches} benches came to no end")
    (out / "kills.json").write_text(json.dumps({"name": "kills", "commit": os.environ.get("WEFT_COMMIT", ""), "runs": runs}, indent=1))
    print("\n".join(summary(kills)))
    print(f"{benches} benches, {sum(run['checks'] for run in runs)} checks, {len(failures)} failed")
    for failure in failures:
        print("FAILED:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
