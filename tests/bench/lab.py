#!/usr/bin/env python3
"""Fills a PostgreSQL of its own with 100 rigs and 10^6 trials in 10^4, then in 10^5 runs, all MADE UP, by COPY. Runs bench_lab on each.

    lab.py WEFT BENCH_LAB

Exit status 77 without Debian's PostgreSQL server.
"""
import hashlib
import json
import os
import pathlib
import random
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/scenario"))
import lab_support  # noqa: E402

SEED = 51
RIGS, TRIALS = 100, 1_000_000
SIZES = {"lab": 100, "lab_short_runs": 10}  # trials of a run, by the name of the output
FABRICS = [f"fabric{i:03d}" for i in range(118)]
RECIPES = ["khan2016", "first", "vibro-slide", "imprint", "pilot-force-speed", "m1", "m2"]
START_S = 1_750_000_000


def copy(server, table, rows):
    """COPY of an iterable of rows; fields are texts without tabs."""
    psql = subprocess.Popen(["psql", "-X", "-q", "-v", "ON_ERROR_STOP=1", "-d", server.uri("admin"), "-c", f"COPY weft.{table} FROM STDIN"],
                            stdin=subprocess.PIPE, text=True)
    for row in rows:
        psql.stdin.write("\t".join(row) + "\n")
    psql.stdin.close()
    assert psql.wait() == 0, table


def utc(seconds):
    return time.strftime("%Y-%m-%d %H:%M:%S+00", time.gmtime(seconds))


def digest(*parts):
    return hashlib.sha256("/".join(map(str, parts)).encode()).hexdigest()


def rig_rows():
    status = json.dumps({"run": "R-000099", "trial": 3, "trials": 100, "eta_s": 900, "next_action": "mount fabric007", "alarms": []})
    for i in range(RIGS):
        yield [f"rig{i:03d}", f"login{i:03d}", f"tls://rig{i:03d}:8443", "simulated", "safe", utc(START_S), f"{i:016x}", digest("rig", i), status]


def run_rows(runs, trials):
    draws = random.Random(SEED)
    for k in range(runs):
        rig, run, recipe = f"rig{k % RIGS:03d}", f"R-{k // RIGS + 1:06d}", draws.choice(RECIPES)
        fabrics = draws.sample(FABRICS, 5)
        start = START_S + 600 * k
        place = f"/made-up/{run}"
        text = " ".join([rig, run, recipe, *fabrics, place]).lower()
        yield [rig, run, recipe, digest(recipe), str(k), "{" + ",".join(fabrics) + "}", "simulated", "complete", str(trials), str(trials),
               utc(start), utc(start + 500), place, str(start * 1_000_000), text]


def trial_rows(runs, trials):
    draws = random.Random(SEED)
    for k in range(runs):
        draws.choice(RECIPES)
        fabrics = draws.sample(FABRICS, 5)
        for i in range(trials):
            yield [str(k + 1), str(i), fabrics[i % 5], "M1" if i % 2 else "M2", str(i // 10 + 1), "complete", digest(k, i)]


def measure(name, trials):
    """Exit status of bench_lab on a store with runs of this number of trials."""
    runs = TRIALS // trials
    with lab_support.Server(settings="log_min_duration_statement = -1\n") as server:
        server.make_lab(("reader", ""), ("scanner", ""))
        for setting in ("enable_indexscan = off", "enable_bitmapscan = off", "enable_indexonlyscan = off", "max_parallel_workers_per_gather = 0"):
            server.sql(f"ALTER ROLE scanner SET {setting}")
        subprocess.run([sys.argv[1], "lab", "install", "--lab", server.uri("admin")], check=True, stdout=subprocess.DEVNULL)
        server.grant(("reader", "weft_reader"), ("scanner", "weft_reader"))
        begun = time.monotonic()
        copy(server, "rig", rig_rows())
        copy(server, "run (rig, run, recipe, recipe_sha256, seed, fabrics, bench, state, trials_planned, trials_complete, started_at, ended_at, place, "
             "revision, search_text)", run_rows(runs, trials))
        copy(server, "dataset", ([str(k + 1), digest("dataset", k), str(trials), "1000000", f"/made-up/{k}.h5"] for k in range(runs)))
        copy(server, "trial", trial_rows(runs, trials))
        server.sql("ANALYZE")
        filled_s = time.monotonic() - begun
        bytes_text = server.sql("SELECT pg_size_pretty(pg_database_size('lab'))")
        print(f"MADE UP: {RIGS} rigs, {runs} runs, {runs * trials} trials, filled in {filled_s:.0f} s, {bytes_text}", flush=True)
        return subprocess.run([sys.argv[2], server.uri("reader"), server.uri("scanner"), name], check=False, env=os.environ).returncode


def main():
    if lab_support.programs() is None:
        print(lab_support.NOT_INSTALLED)
        sys.exit(77)
    sys.exit(max(measure(name, trials) for name, trials in SIZES.items()))


if __name__ == "__main__":
    main()
