#!/usr/bin/env python3
"""`weft run --resume` and `weft verify` after kill -9, a full disk, and in a folder that cannot be written to. SIMULATED.

    cli_resume.py WEFT SOURCE_ROOT
"""
import json
import os
import pathlib
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time

from cli_support import Checks

PATIENCE_S = 120
DISK = "SMALL_DISK"  # set where this script runs again as root of a user namespace, with a small file system at this place


def begun(t, d, rig, out, trials, recipe="recipe.json"):
    """A campaign with so many trials done."""
    process = subprocess.Popen([t.weft, "run", recipe, "--rig", str(rig), "--out", out, "--no-evaluate", "--no-error-check"], cwd=d, text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    end = time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < end:
        try:
            if complete(d / out) >= trials:
                return process
        except sqlite3.OperationalError:
            pass
        time.sleep(0.01)
    process.kill()
    raise SystemExit(f"the run did not get to trial {trials}: {process.communicate()}")


def complete(folder):
    if not (folder / "campaign.sqlite").exists():
        return 0
    database = sqlite3.connect(f"file:{folder}/campaign.sqlite?mode=ro", uri=True)
    try:
        return database.execute("SELECT count(*) FROM trial WHERE outcome = 'complete'").fetchone()[0]
    finally:
        database.close()


def samples(folder):
    """Of every complete trial, by stream: what must be the same."""
    database = sqlite3.connect(f"file:{folder}/campaign.sqlite?mode=ro", uri=True)
    rows = database.execute("SELECT plan_index, stream, data FROM chunk JOIN trial ON trial.id = trial WHERE outcome = 'complete' "
                            "ORDER BY plan_index, stream, number").fetchall()
    database.close()
    joined = {}
    for index, stream, data in rows:
        joined[index, stream] = joined.get((index, stream), b"") + data
    return joined


def killed(t, d, rig, undisturbed):
    process = begun(t, d, rig, "killed", 5)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    seen = t.succeeds("verify", "killed", cwd=d)
    t.expect(seen["holds"] and not seen["certified"] and not seen["finished"], f"verify: {seen}")
    before = (d / "killed/campaign.sqlite").read_bytes()
    again = ["run", "recipe.json", "--rig", str(rig), "--out", "killed", "--no-evaluate", "--no-error-check", "--resume"]
    preview = t.succeeds(*again, "--preview", cwd=d)
    t.expect(preview["trials_complete"] == seen["trials_complete"], f"preview: {preview}")
    t.expect(any(f"go on with trial {seen['trials_complete']}" in w for w in preview["will"]), f"preview: {preview}")
    t.expect((d / "killed/campaign.sqlite").read_bytes() == before, "a preview changes nothing")
    ran = t.run(*again, cwd=d)
    t.expect(ran.returncode == 0 and "go on with trial" in ran.stderr, f"resume: {ran.returncode} {ran.stderr}")
    done = t.succeeds("verify", "killed", cwd=d)
    t.expect(done["holds"] and done["certified"] and done["attempts"] - done["trials_complete"] <= 1, f"verify: {done}")
    t.expect(samples(d / "killed") == undisturbed, "the samples are those of a run that nobody touched")
    t.refuses(*again, cwd=d, says=["nothing is left"])
    data = bytearray((d / "killed/dataset.h5").read_bytes())
    data[len(data) // 2] ^= 1
    (d / "killed/dataset.h5").write_bytes(data)
    said = t.run("verify", "killed", cwd=d)
    t.expect(said.returncode == 1 and "dataset.h5: bytes" in said.stdout, f"a flipped bit: {said}")


def full_disk(t, d, rig, undisturbed):
    """The file system fills up under the run: it ends with a sentence, what is complete is kept, and with room again it goes on."""
    disk = pathlib.Path(os.environ[DISK])
    process = begun(t, disk, rig, "out", 3, recipe=str(d / "recipe.json"))
    process.send_signal(signal.SIGSTOP)
    with open(disk / "filler", "wb", buffering=0) as filler:
        for size in (1 << 20, 1 << 12):
            try:
                while True:
                    filler.write(b"x" * size)
            except OSError:
                pass
    process.send_signal(signal.SIGCONT)
    _, err = process.communicate(timeout=PATIENCE_S)
    t.expect(process.returncode == 1, f"full disk: status {process.returncode}: {err}")
    t.expect("space" in err or "full" in err, f"full disk: {err}")
    os.remove(disk / "filler")
    seen = t.succeeds("verify", "out", cwd=disk)
    t.expect(seen["holds"] and seen["trials_complete"] >= 3, f"after a full disk: {seen}")
    ran = t.run("run", str(d / "recipe.json"), "--rig", str(rig), "--out", "out", "--no-evaluate", "--no-error-check", "--resume", cwd=disk)
    t.expect(ran.returncode == 0, f"with room again: {ran.returncode} {ran.stderr}")
    t.expect(samples(disk / "out") == undisturbed, "after a full disk: the samples of a run that nobody touched")
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    said = t.refuses("run", str(d / "recipe.json"), "--rig", str(rig), "--out", "out", "--resume", cwd=disk, says=["out"])
    said = t.refuses("run", str(d / "recipe.json"), "--rig", str(rig), "--out", "other", cwd=disk, says=["Read-only file system"])
    t.expect(bool(said), "read-only")
    t.succeeds("verify", "out", cwd=disk)
    subprocess.run(["mount", "-o", "remount,rw", str(disk)], check=True)


def in_namespace(arguments, d):
    """Runs this script again with a file system of 100 MB of its own; nothing where that is not permitted."""
    disk = d / "disk"
    disk.mkdir()
    words = f"mount -t tmpfs -o size=100m tmpfs {disk} && exec \"$@\""
    if subprocess.run(["unshare", "-rm", "sh", "-c", words, "sh", "true"], capture_output=True).returncode != 0:
        print("skipped: a file system of our own is not permitted here")
        return 0
    return subprocess.run(["unshare", "-rm", "sh", "-c", words, "sh", sys.executable, *arguments],
                          env={**os.environ, DISK: str(disk), "WEFT_RESUME_FOLDER": str(d)}).returncode


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    if DISK in os.environ:
        d = pathlib.Path(os.environ["WEFT_RESUME_FOLDER"])
        full_disk(t, d, rig, samples(d / "undisturbed"))
        t.finish()
    with tempfile.TemporaryDirectory(prefix="weft-resume-") as folder:
        d = pathlib.Path(folder)
        recipe = json.loads((root / "recipes/library/m1.json").read_text())
        del recipe["$schema"]
        recipe["fabrics"], recipe["repetitions"] = ["denim", "satin"], 12
        (d / "recipe.json").write_text(json.dumps(recipe))
        t.expect(t.run("run", "recipe.json", "--rig", str(rig), "--out", "undisturbed", "--no-evaluate", "--no-error-check",
                       cwd=d).returncode == 0, "the undisturbed run")
        killed(t, d, rig, samples(d / "undisturbed"))
        t.expect(in_namespace(sys.argv, d) == 0, "a full disk")
    t.finish()


main()
