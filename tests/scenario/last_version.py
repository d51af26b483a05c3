#!/usr/bin/env python3
"""Files of the last version still open: a campaign folder, its data set, models, and a daemon's database (tests/golden/last_version, made by 243037ce
from its tiny.json; SIMULATED). The expected values are those of that version.

    last_version.py WEFT WEFTD SOURCE_ROOT
"""
import json
import pathlib
import shutil
import sys
import tempfile

from cli_support import Checks
from weftd_support import Client, Daemon

DATASET = "54669657372b17595c33d00978dfd9ef0390f5307323e096fce97f3f7cd9fb54"
SILK_BY_CORES = 6.277662997329774e-07  # probability of silk for the first trial, denim


def main():
    weft, weftd, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name)
        shutil.copytree(root / "tests/golden/last_version", d, dirs_exist_ok=True)
        seen = t.succeeds("verify", "campaign", cwd=d)
        t.expect(seen["holds"] and seen["certified"] and seen["attempts"] == 4 and seen["dataset_sha256"] == DATASET, f"verify: {seen}")
        exported = t.succeeds("dataset", "export", "campaign/campaign.sqlite", "-o", "again.h5", cwd=d)
        t.expect(exported.get("dataset_sha256") == DATASET, f"the campaign file gives the same data set: {exported}")
        for model, learner in (("cores.model", "pvalue"), ("lda.model", "lda")):
            found = t.succeeds("classify", model, "campaign/dataset.h5", cwd=d)
            t.expect(found["learner"] == learner and len(found["trials"]) == 4, f"{model}: {found}")
            t.expect(all(trial["label"] == trial["true_label"] for trial in found["trials"]), f"{model}: {found['trials']}")
            if learner == "pvalue":
                t.expect(found["trials"][0]["probability"]["silk"] == SILK_BY_CORES, f"{model}: {found['trials'][0]}")
        (d / "sim/rigs").mkdir(parents=True)
        shutil.move(d / "bench17.json", d / "sim/rigs")  # its original place
        for table in ("fabrics.json", "fidelity.json"):
            shutil.copy(root / "sim" / table, d / "sim")
        t.refuses("run", "tiny.json", "--rig", "sim/rigs/bench17.json", "--out", "campaign", "--resume", "--no-evaluate", cwd=d, code="wrong state",
                  where="campaign/campaign.sqlite")

        (d / "data").mkdir()
        (d / "recipes").mkdir()
        shutil.move(d / "weftd.sqlite", d / "data")
        shutil.copytree(d / "campaign", d / "data/R-000001")
        shutil.copy(d / "tiny.json", d / "recipes")
        daemon = Daemon(weftd, root, d)
        try:
            client = Client(daemon.socket)
            runs = {run["run"]: run for run in client.call("run.list")["runs"]}
            t.expect({number: (run["state"], run.get("outcome")) for number, run in runs.items()}
                     == {"R-000001": ("ended", "complete"), "R-000002": ("queued", None)}, f"runs: {runs}")
            rig = client.call("rig.state")
            t.expect(rig["rig"] == "safe", f"the rig was left safe: {rig}")
            queue = client.call("queue.list")
            t.expect(queue["paused_by"] == "s-4 (root)" and [run["run"] for run in queue["runs"]] == ["R-000002"], f"queue: {queue}")
        finally:
            t.expect(daemon.end() == 0, "the daemon ends")
    t.finish()


main()
