#!/usr/bin/env python3
"""Times a SIMULATED campaign in 1, 2, 4 and 8 parts at once on this machine, and its merge; fits a model and prints where more parts stop helping.

    parts.py WEFT SOURCE_ROOT [RUNS]      prints tables, writes out/bench/parts.json

Khan's exploration M1 on eight fabrics, 20 repetitions: 160 trials. Wall time T(N) = fixed + work / min(N, cores, fabrics) + merge: `fixed` is the wall time
of a part without fabrics, `merge` that of the merge, `work` is fitted by least squares to the medians. Other programs on the machine make wall times longer,
so each run has its own ratio against one part, and CPU seconds are shown beside wall seconds.
"""
import concurrent.futures
import json
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

PARTS, RUNS, FABRICS, REPETITIONS = (1, 2, 4, 8), 5, 8, 20
LARGE = {"trials": 100_000, "fabrics": 118}  # the model beyond this machine
MEBI = 1024 * 1024


def timed(*command, cwd):
    """Wall [s], CPU [s] and peak memory [MiB] of a command that must succeed."""
    began = time.perf_counter()
    process = subprocess.Popen(command, cwd=cwd, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{' '.join(command)}: status {process.returncode}")
    return {"wall_s": time.perf_counter() - began, "cpu_s": used.ru_utime + used.ru_stime, "peak_mib": used.ru_maxrss / 1024}


class Campaign:
    def __init__(self, weft, root, folder):
        self.weft, self.rig, self.folder = weft, str(root / "sim/rigs/bench17.json"), folder
        recipe = json.loads((root / "recipes/library/m1.json").read_text())
        del recipe["$schema"]
        recipe.update(fabrics=recipe["fabrics"][:FABRICS], repetitions=REPETITIONS)
        (folder / "recipe.json").write_text(json.dumps(recipe))

    def part(self, out, k, count):
        return timed(self.weft, "run", "recipe.json", "--rig", self.rig, "--out", out, "--part", f"{k}/{count}", "--no-error-check", cwd=self.folder)

    def parts(self, count):
        """All parts at once, then the merge."""
        shutil.rmtree(self.folder / "parts", ignore_errors=True)
        (self.folder / "parts").mkdir()
        began = time.perf_counter()
        with concurrent.futures.ThreadPoolExecutor(count) as pool:
            used = list(pool.map(lambda k: self.part(f"parts/{k}", k, count), range(1, count + 1)))
        wall_s = time.perf_counter() - began
        merge = timed(self.weft, "dataset", "merge", *(f"parts/{k}" for k in range(1, count + 1)), "-o", "merged.h5", cwd=self.folder)
        info = subprocess.run([self.weft, "dataset", "info", "merged.h5", "--json"], cwd=self.folder, capture_output=True, text=True, check=True)
        return {"parts_wall_s": wall_s, "parts_cpu_s": sum(one["cpu_s"] for one in used), "part_peak_mib": max(one["peak_mib"] for one in used),
                "merge_wall_s": merge["wall_s"], "merge_cpu_s": merge["cpu_s"], "merge_peak_mib": merge["peak_mib"],
                "dataset_sha256": json.loads(info.stdout)["dataset_sha256"]}

    def bytes_of(self, pattern):
        return sum(file.stat().st_size for file in self.folder.glob(pattern))


def medians(runs):
    return {key: statistics.median(run[key] for run in runs) for key in runs[0] if key != "dataset_sha256"}


def fit(table, fixed_s, cores):
    """`work` by least squares over the numbers of parts, with the other terms as measured."""
    share = {n: 1 / min(n, cores, FABRICS) for n in table}
    work_s = sum(share[n] * (table[n]["parts_wall_s"] - fixed_s) for n in table) / sum(x * x for x in share.values())
    return work_s, {n: fixed_s + work_s * share[n] for n in table}


def most_useful(fixed_s, work_s, merge_s, fabrics):
    """The smallest number of parts with a wall time within 10 % of that of one part for each fabric; a part has whole fabrics."""
    def wall_s(n):
        return fixed_s + work_s * -(-fabrics // n) / fabrics + merge_s
    return next(n for n in range(1, fabrics + 1) if wall_s(n) <= 1.1 * wall_s(fabrics)), wall_s


def beyond(fixed_s, work_cpu_s, merge_cpu_s, trials):
    """The large campaign on a machine with as many free cores as parts: CPU seconds of a trial as measured here."""
    work_s, merge_s = work_cpu_s / trials * LARGE["trials"], merge_cpu_s / trials * LARGE["trials"]
    useful, wall_s = most_useful(fixed_s, work_s, merge_s, LARGE["fabrics"])
    rows = {n: wall_s(n) for n in (1, 2, 4, 8, 16, 32, 64, LARGE["fabrics"])}
    print(f"\nmodel for {LARGE['trials']} trials on {LARGE['fabrics']} fabrics, a free core for each part; the merge takes {merge_s:.0f} s of each row")
    for n, seconds in rows.items():
        print(f"{n:4} parts {seconds:8.0f} s   {rows[1] / seconds:5.1f} times one part")
    print(f"within 10 % of the shortest time from {useful} parts on; no part has less than one fabric, so none helps beyond {LARGE['fabrics']}; "
          f"without limit {(work_s + merge_s) / merge_s:.1f} times")
    return {**LARGE, "merge_s": merge_s, "work_s": work_s, "wall_s": rows, "parts_within_10_percent": useful}


def main():
    weft, root = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
    count, cores = int(sys.argv[3]) if len(sys.argv) > 3 else RUNS, len(os.sched_getaffinity(0))
    runs, empty, loads = {n: [] for n in PARTS}, [], []
    with tempfile.TemporaryDirectory(prefix="weft-parts-") as d:
        campaign = Campaign(weft, root, pathlib.Path(d))
        for _ in range(count):
            loads.append(os.getloadavg()[0])
            empty.append(campaign.part("empty", FABRICS + 1, FABRICS + 1))
            shutil.rmtree(campaign.folder / "empty")
            for n in PARTS:
                runs[n].append(campaign.parts(n))
        stored = {"parts_bytes": campaign.bytes_of("parts/*/*/*"), "merged_bytes": campaign.bytes_of("merged.h5")}
    trials = FABRICS * REPETITIONS
    if len({run["dataset_sha256"] for n in PARTS for run in runs[n]}) != 1:
        sys.exit("the number of parts changes the digest")
    table, fixed_s = {n: medians(runs[n]) for n in PARTS}, statistics.median(one["wall_s"] for one in empty)
    work_s, modelled = fit(table, fixed_s, cores)
    print(f"SIMULATED: {trials} trials on {FABRICS} fabrics; {cores} cores, load of the machine {min(loads):.1f} to {max(loads):.1f}; medians of {count} runs\n"
          "parts   wall s   model s   one part / N parts   CPU s   peak MiB of a part   merge wall s   merge CPU s   merge peak MiB")
    figures = []
    for n, row in table.items():
        ratios = [one["parts_wall_s"] / run["parts_wall_s"] for one, run in zip(runs[1], runs[n])]
        print(f"{n:5} {row['parts_wall_s']:8.2f} {modelled[n]:9.2f} {statistics.median(ratios):20.2f} {row['parts_cpu_s']:7.2f} {row['part_peak_mib']:20.0f} "
              f"{row['merge_wall_s']:14.2f} {row['merge_cpu_s']:13.2f} {row['merge_peak_mib']:16.0f}")
        figures.append({"figure": f"{n} parts", "value": row["parts_wall_s"], "unit": "s", "runs": [run["parts_wall_s"] for run in runs[n]],
                        "peer": "one part, same run", "peer_value": table[1]["parts_wall_s"], "ratio": statistics.median(ratios), "ratios": ratios, **row})
    merge_cpu_s = statistics.median(table[n]["merge_cpu_s"] for n in PARTS)
    print(f"fixed {fixed_s:.3f} s, work {work_s:.2f} s (fit); CPU of a trial: {table[1]['parts_cpu_s'] / trials * 1e3:.1f} ms, "
          f"in the merge {merge_cpu_s / trials * 1e3:.2f} ms; a trial has {stored['parts_bytes'] / trials / MEBI:.2f} MiB in its part, "
          f"{stored['merged_bytes'] / trials / MEBI:.3f} MiB merged")
    large = beyond(fixed_s, table[1]["parts_cpu_s"], merge_cpu_s, trials)
    out = pathlib.Path("out/bench/parts.json")
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps({"name": "parts", "simulated": True, "figures": figures, "trials": trials, "fabrics": FABRICS, "cores": cores, "loads": loads,
                               "machine": platform.platform(), "date": time.strftime("%Y-%m-%d", time.gmtime()), **stored,
                               "model": {"fixed_s": fixed_s, "work_s": work_s, "parts_wall_s": modelled, "large": large},
                               "commit": os.environ.get("WEFT_COMMIT", "unknown")}, indent=2) + "\n")


main()
