"""`weft-train-mpi` under mpirun: the same model file as `weft train`, byte for byte, and no file if a rank dies.

    train_mpi.py WEFT WEFT_TRAIN_MPI     exit status 77 without MPI

If Slurm's controller answers, also under srun; otherwise that part prints that it was skipped.
"""
import json
import math
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from cli_support import Checks, contents


def level_rows(noise, label):
    """Levels of two taxels that differ by label; the rest is noise."""
    return [(int(1000 + 5 * label + noise.gauss(0, 9)), int(900 + noise.gauss(0, 5 + label))) for _ in range(40)]


def tail_rows(noise, label):
    """Deviations of two taxels, log-normal over the trials; one of them grows with the label."""
    deviation, other = math.exp(noise.gauss(0, 0.5) + 0.5 * label), math.exp(noise.gauss(0, 0.5))
    return [(round(1e5 + 1000 * deviation * noise.gauss(0, 1)), round(1e5 + 1000 * other * noise.gauss(0, 1))) for _ in range(40)]


def make_dataset(checks, folder, labels, trials, rows_of=level_rows):
    """A made-up data set of two taxels, from a fixed seed."""
    noise = random.Random(5)
    lines = ["file,label,group"]
    for label in range(labels):
        for trial in range(trials):
            name = f"l{label}_{trial}.csv"
            lines.append(f"{name},fabric{label:02},{trial}")
            rows = [f"{i / 37},{one},{other}" for i, (one, other) in enumerate(rows_of(noise, label))]
            (folder / name).write_text("t_s,ch1,ch2\n" + "\n".join(rows) + "\n")
    (folder / "manifest.csv").write_text("\n".join(lines) + "\n")
    ran = checks.run("dataset", "import", "manifest.csv", "-o", "set.h5", cwd=folder)
    checks.expect(ran.returncode == 0, f"import: {ran.stderr}")
    for table in folder.glob("*.csv"):
        table.unlink()


def launch(ranks, *command):
    return ["mpirun", "-n", str(ranks), "--oversubscribe", "--allow-run-as-root", *map(str, command)]


def mpi(folder, ranks, *command):
    return subprocess.run(launch(ranks, *command), cwd=folder, capture_output=True, text=True, timeout=120)


def same_bytes(checks, program, folder):
    for ranks, options in ((2, ["--learner", "cores-best"]), (2, ["--learner", "best"]), (2, ["--learner", "svc"]), (2, ["--learner", "trees"]),
                           (3, ["--reduction", "pvalue", "--paper-selection"])):
        compare(checks, folder, options, launch(ranks, program, "set.h5", "-o", "shared", *options))


def compare(checks, folder, options, command):
    """`command` writes to `shared` the same bytes as a single `weft train`."""
    alone = checks.run("train", "set.h5", "-o", "alone", *options, cwd=folder)
    checks.expect(alone.returncode == 0, f"train: {alone.stderr}")
    shared = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)
    checks.expect(shared.returncode == 0, f"{command}: {shared.stderr}")
    checks.expect((folder / "shared").exists() and (folder / "shared").read_bytes() == (folder / "alone").read_bytes(),
                  f"{command}: the model differs from the single-process one")
    for name in ("alone", "shared"):
        (folder / name).unlink(missing_ok=True)


def normal_scores_win(checks, program, folder):
    """The last view of the features, and all rows, reach the other ranks."""
    alone = checks.run("train", "set.h5", "-o", "alone", "--learner", "cores-best", "--json", cwd=folder)
    checks.expect(alone.returncode == 0 and json.loads(alone.stdout)["view"] == "normal-scores", f"normal scores do not win: {alone.stdout} {alone.stderr}")
    options = ["--learner", "cores-best"]
    compare(checks, folder, options, launch(2, program, "set.h5", "-o", "shared", *options))


def controller_answers():
    if shutil.which("srun") is None or shutil.which("scontrol") is None:
        return False
    try:
        return subprocess.run(["scontrol", "ping"], capture_output=True, timeout=20).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def same_bytes_under_slurm(checks, program, folder):
    if not controller_answers():
        print("skipped: srun, no controller of Slurm answers here")
        return
    options = ["--learner", "cores-best"]
    compare(checks, folder, options, ["srun", "--mpi=pmix", "--kill-on-bad-exit=1", "-n", "2", "--overcommit", str(program), "set.h5", "-o", "shared", *options])


def refusals(checks, program, folder):
    before = contents(folder)
    cases = [
        ([program, "no.h5", "-o", "model"], "no.h5"),
        ([program, "set.h5", "-o", "model", "--folds", "1"], "--folds"),
        ([program, "set.h5", "-o", "model", ":", "-n", "1", program, "no.h5", "-o", "model"], "rank 1"),
        ([program, "set.h5", "-o", "nowhere/model"], "nowhere/model"),
    ]
    for command, name in cases:
        ran = mpi(folder, 1 if ":" in command else 2, *command)
        checks.expect(ran.returncode != 0 and name in ran.stderr, f"{command}: {ran.returncode} {ran.stderr}")
    checks.expect(contents(folder) == before, "a refusal left a file behind")


def busy_rank(rank, folder, cpu_s):
    """Process number of a rank that has computed for `cpu_s` seconds and so works on its share; None until then."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            ours = os.readlink(process / "cwd") == str(folder)
            if not ours or f"OMPI_COMM_WORLD_RANK={rank}".encode() not in (process / "environ").read_bytes().split(b"\0"):
                continue
            ticks = int((process / "stat").read_text().rsplit(")", 1)[1].split()[11])
            if ticks / os.sysconf("SC_CLK_TCK") > cpu_s:
                return int(process.name)
        except OSError:
            continue
    return None


def death_of_a_rank(checks, program, folder, rank, *says):
    """The launcher names the killed rank; the earlier model is unchanged, and no other file remains."""
    (folder / "model").write_text("an older model")
    before = contents(folder)
    job = subprocess.Popen(launch(2, program, "set.h5", "-o", "model", "--threads", "1"), cwd=folder,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    victim, deadline = None, time.monotonic() + 60
    while victim is None and job.poll() is None and time.monotonic() < deadline:
        victim = busy_rank(rank, folder, cpu_s=0.4)
    checks.expect(victim is not None, f"rank {rank} was not found, or done too soon")
    if victim is not None:
        os.kill(victim, signal.SIGKILL)
    _, errors = job.communicate(timeout=60)
    checks.expect(job.returncode != 0, f"rank {rank} died and the job succeeded")
    for words in (f"rank {rank}", "signal 9", *says):
        checks.expect(words in errors, f"rank {rank} died, no '{words}' in: {errors}")
    checks.expect(contents(folder) == before, f"rank {rank} died and left a file behind: {contents(folder) ^ before}")
    print(errors.strip())


def main():
    program = pathlib.Path(sys.argv[2]).resolve()
    if shutil.which("mpirun") is None or not program.is_file():
        print("skipped: MPI was not there when Weft was built, or mpirun is not there now")
        sys.exit(77)
    checks = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory() as small, tempfile.TemporaryDirectory() as tails, tempfile.TemporaryDirectory() as large:
        make_dataset(checks, pathlib.Path(small), labels=7, trials=5)
        same_bytes(checks, program, pathlib.Path(small))
        same_bytes_under_slurm(checks, program, pathlib.Path(small))
        refusals(checks, program, pathlib.Path(small))
        make_dataset(checks, pathlib.Path(tails), labels=3, trials=8, rows_of=tail_rows)
        normal_scores_win(checks, program, pathlib.Path(tails))
        make_dataset(checks, pathlib.Path(large), labels=80, trials=6)
        death_of_a_rank(checks, program, pathlib.Path(large).resolve(), 1, "no model was written")
        death_of_a_rank(checks, program, pathlib.Path(large).resolve(), 0)  # no rank remains that could print the message
    checks.finish()


main()
