#!/usr/bin/env python3
"""A file system of 100 MB that fills up under a run, and one that cannot be written to: `weft run`, and weftd. SIMULATED.

    full_disk.py WEFT WEFTD SOURCE_ROOT     exit 77 (skipped) where a file system of our own is not permitted
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

from campaign_support import PATIENCE_S, RUN, begun, samples, wait_for, write_recipe
from cli_support import Checks
from weftd_support import Client, Daemon, command

DISK = "SMALL_DISK"  # set where this script runs again as root of a user namespace, with a small file system at this place


def fill(disk):
    with open(disk / "filler", "wb", buffering=0) as filler:
        for size in (1 << 20, 1 << 12):
            try:
                while True:
                    filler.write(b"x" * size)
            except OSError:
                pass


def mounted(disk, how):
    subprocess.run(["mount", "-o", f"remount,{how}", str(disk)], check=True)


def of_weft_run(t, d, disk, rig, undisturbed):
    """It ends with a sentence, what is complete is kept, and with room again it goes on."""
    recipe = str(d / "recipe.json")
    process = begun(t.weft, disk, rig, "out", 3, recipe)
    process.send_signal(signal.SIGSTOP)
    fill(disk)
    process.send_signal(signal.SIGCONT)
    _, err = process.communicate(timeout=PATIENCE_S)
    t.expect(process.returncode == 1, f"full disk: status {process.returncode}: {err}")
    t.expect("space" in err or "full" in err, f"full disk: {err}")
    os.remove(disk / "filler")
    seen = t.succeeds("verify", "out", cwd=disk)
    t.expect(seen["holds"] and seen["trials_complete"] >= 3, f"after a full disk: {seen}")
    ran = t.run("run", recipe, "--rig", str(rig), "--out", "out", *RUN, "--resume", cwd=disk)
    t.expect(ran.returncode == 0, f"with room again: {ran.returncode} {ran.stderr}")
    t.expect(samples(disk / "out") == undisturbed, "after a full disk: the samples of a run that nobody touched")
    mounted(disk, "ro")
    t.refuses("run", recipe, "--rig", str(rig), "--out", "out", "--resume", cwd=disk, says=["out"])
    t.refuses("run", recipe, "--rig", str(rig), "--out", "other", cwd=disk, says=["Read-only file system"])
    t.succeeds("verify", "out", cwd=disk)
    mounted(disk, "rw")


def of_weftd(t, weftd, root, d, disk, undisturbed):
    """The daemon lives on and says what is wrong; the run says so too, and is whole once there is room again."""
    (disk / "recipes").mkdir()
    shutil.copy(d / "recipe.json", disk / "recipes" / "small.json")
    daemon = Daemon(weftd, root, disk)
    try:
        client = Client(daemon.socket)
        client.call("sub.open", topics=["*"], mode="every")
        lease = client.call("lease.acquire")["lease"]
        run = client.call("run.start", recipe="small", lease=lease)["run"]
        folder = disk / "data" / run
        t.expect(wait_for(folder, 3, lambda: daemon.process.poll() is None), "weftd: three trials")
        daemon.process.send_signal(signal.SIGSTOP)
        fill(disk)
        daemon.process.send_signal(signal.SIGCONT)
        for _ in range(10000):
            told = client.call("run.get", run=run)
            if told["state"] in ("ended", "interrupted"):
                break
        print("told", told)
        print("ready", client.call("system.ready"))
        os.remove(disk / "filler")
        print("ready", client.call("system.ready"))
        print("run", client.call("run.get", run=run))
        print(client.answer("run.recover", run=run, choice="resume", lease=lease))
        print("run", client.call("run.get", run=run))
    finally:
        daemon.process.kill()
        print(daemon.process.stderr.read())


def inside(t, weftd, root, d, disk):
    undisturbed = samples(d / "undisturbed")
    of_weft_run(t, d, disk, root / "sim/rigs/bench17.json", undisturbed)
    of_weftd(t, weftd, root, d, disk, undisturbed)
    t.finish()


def main():
    t = Checks(sys.argv[1])
    weftd, root = pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
    if DISK in os.environ:
        disk = pathlib.Path(os.environ[DISK])
        inside(t, weftd, root, disk.parent, disk)
    with tempfile.TemporaryDirectory(prefix="weft-disk-") as folder:
        d = pathlib.Path(folder)
        disk = d / "disk"
        disk.mkdir()
        own = ["unshare", "-rm", "sh", "-c", f"mount -t tmpfs -o size=100m tmpfs {disk} && exec \"$@\"", "sh"]
        if subprocess.run([*own, "true"], capture_output=True).returncode != 0:
            print("skipped: a file system of our own is not permitted here")
            sys.exit(77)
        write_recipe(root, d / "recipe.json")
        rig = root / "sim/rigs/bench17.json"
        t.expect(t.run("run", "recipe.json", "--rig", str(rig), "--out", "undisturbed", *RUN, cwd=d).returncode == 0, "the undisturbed run")
        ended = subprocess.run([*own, sys.executable, *sys.argv], env={**os.environ, DISK: str(disk)}).returncode
        t.expect(ended == 0, "on the small disk")
    t.finish()


main()
