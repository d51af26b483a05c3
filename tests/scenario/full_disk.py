#!/usr/bin/env python3
"""A file system of 100 MB that fills up during a run, and one that is not writable: `weft run`, and weftd. SIMULATED.

    full_disk.py WEFT WEFTD SOURCE_ROOT     exit 77 (skipped) if mounting a file system is not permitted
"""
import errno
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from campaign_support import PATIENCE_S, RUN, begun, samples, wait_for, write_recipe
from cli_support import Checks
from weftd_support import Client, Daemon, command

DISK = "SMALL_DISK"  # set when this script runs again as root of a user namespace, with a small file system at this path


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
    """It ends with a message, complete trials are kept, and with free space again the campaign is resumed."""
    recipe = str(d / "recipe.json")
    process = begun(t.weft, disk, rig, "out", 3, recipe, "--json")
    process.send_signal(signal.SIGSTOP)
    fill(disk)
    process.send_signal(signal.SIGCONT)
    out, err = process.communicate(timeout=PATIENCE_S)
    t.expect(process.returncode == 1, f"full disk: status {process.returncode}: {err}")
    found = json.loads(out)
    error = found.get("error") or found.get("campaign_error") or {}
    t.expect(error.get("code") in ("no space", "safety") and error["got"] in err, f"full disk: {found} {err}")
    os.remove(disk / "filler")
    seen = t.succeeds("verify", "out", cwd=disk)
    t.expect(seen["holds"] and seen["trials_complete"] >= 3, f"after a full disk: {seen}")
    ran = t.run("run", recipe, "--rig", str(rig), "--out", "out", *RUN, "--resume", cwd=disk)
    t.expect(ran.returncode == 0, f"with room again: {ran.returncode} {ran.stderr}")
    t.expect(samples(disk / "out") == undisturbed, "after a full disk: the samples of the undisturbed run")
    mounted(disk, "ro")
    t.refuses("run", recipe, "--rig", str(rig), "--out", "out", "--resume", cwd=disk, says=["out"])
    t.refuses("run", recipe, "--rig", str(rig), "--out", "other", cwd=disk, says=["other", os.strerror(errno.EROFS)])
    t.succeeds("verify", "out", cwd=disk)
    mounted(disk, "rw")


def kinds(client):
    return {blocker["kind"] for blocker in client.call("system.ready")["blockers"]}


def of_weftd(t, weftd, root, d, disk, undisturbed):
    """The daemon continues and reports the problem, and so does the run. Its trials are kept, and with free space again `weft run` completes them.
    The daemon does not start if it cannot write."""
    (disk / "recipes").mkdir()
    shutil.copy(d / "recipe.json", disk / "recipes" / "small.json")
    daemon = Daemon(weftd, root, disk)
    try:
        client = Client(daemon.socket)
        lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
        run = client.call("run.start", recipe="small", lease=lease)["run"]
        folder = disk / "data" / run
        t.expect(wait_for(folder, 3, lambda: daemon.process.poll() is None), "weftd: three trials")
        daemon.process.send_signal(signal.SIGSTOP)
        fill(disk)
        daemon.process.send_signal(signal.SIGCONT)
        client.call("run.wait", run=run)
        ended = client.call("run.get", run=run)
        t.expect(ended["state"] == "ended" and ended["outcome"] == "failed" and ended["error"], f"weftd, the run: {ended}")
        t.expect(ended["cleanup"] == "done" and ended["rig"] == "safe" and "dataset_error" in ended, f"weftd, the probe was lifted: {ended}")
        t.expect(kinds(client) == {"disk.low", "storage.io"}, f"weftd, a full disk: {kinds(client)}")
        begins = client.answer("run.start", recipe="small", lease=lease)
        t.expect(begins.get("error", {}).get("data", {}).get("kind") == "storage.full", f"weftd: no run begins on a full disk: {begins}")
        os.remove(disk / "filler")
        end = time.monotonic() + PATIENCE_S
        while "storage.io" in kinds(client) and time.monotonic() < end:  # the daemon retries the write
            time.sleep(0.1)
        t.expect("storage.io" not in kinds(client), "weftd: with room again its journal is written")
        t.expect(daemon.end() == 0, "weftd: its end")
        daemon = Daemon(weftd, root, disk)
        kept = Client(daemon.socket).call("run.get", run=run)
        t.expect({k: kept[k] for k in ("state", "outcome", "error", "trials_done")} == {k: ended[k] for k in ("state", "outcome", "error", "trials_done")},
                 f"weftd: the end of the run is kept: {kept}")
        t.expect(daemon.end() == 0, "weftd: its second end")
    finally:
        daemon.process.kill()
    seen = t.succeeds("verify", str(folder), cwd=disk)
    t.expect(seen["holds"] and seen["trials_complete"] >= 3, f"weftd, after a full disk: {seen}")
    rig = root / "sim/rigs/bench17.json"
    ran = t.run("run", "recipes/small.json", "--rig", str(rig), "--out", str(folder), *RUN, "--resume", cwd=disk)
    t.expect(ran.returncode == 0 and samples(folder) == undisturbed, f"weftd, resumed: {ran.returncode} {ran.stderr}")
    mounted(disk, "ro")
    ran = subprocess.run(command(weftd, root, disk), capture_output=True, text=True, timeout=PATIENCE_S)
    t.expect(ran.returncode == 1 and ran.stderr.startswith("weftd: ") and os.strerror(errno.EROFS) in ran.stderr, f"weftd, read-only: {ran}")
    mounted(disk, "rw")


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
