#!/usr/bin/env python3
"""`weft run --resume` and `weft verify` after kill -9. SIMULATED.

    cli_resume.py WEFT SOURCE_ROOT
"""
import json
import pathlib
import signal
import sys
import tempfile

from campaign_support import RUN, begun, samples, write_recipe
from cli_support import Checks, has, line_has


def killed(t, d, rig, undisturbed):
    process = begun(t.weft, d, rig, "killed", 5)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    seen = t.succeeds("verify", "killed", cwd=d)
    t.expect(seen["holds"] and not seen["certified"] and not seen["finished"], f"verify: {seen}")
    before = (d / "killed/campaign.sqlite").read_bytes()
    again = ["run", "recipe.json", "--rig", str(rig), "--out", "killed", *RUN, "--resume"]
    preview = t.succeeds(*again, "--preview", cwd=d)
    t.expect(preview["trials_complete"] == seen["trials_complete"], f"preview: {preview}")
    first = f"trial {seen['trials_complete'] + 1}"
    t.expect(any(has(w, first) for w in preview["will"]), f"preview: {preview}")
    t.expect((d / "killed/campaign.sqlite").read_bytes() == before, "a preview changes nothing")
    ran = t.run(*again, cwd=d)
    t.expect(ran.returncode == 0 and has(ran.stderr, first), f"resume: {ran.returncode} {ran.stderr}")
    done = t.succeeds("verify", "killed", cwd=d)
    t.expect(done["holds"] and done["certified"] and done["attempts"] - done["trials_complete"] <= 1, f"verify: {done}")
    t.expect(samples(d / "killed") == undisturbed, "the samples are those of the undisturbed run")
    t.refuses(*again, cwd=d, code="wrong state", where=["killed"])
    data = bytearray((d / "killed/dataset.h5").read_bytes())
    data[len(data) // 2] ^= 1
    (d / "killed/dataset.h5").write_bytes(data)
    ran = t.run("verify", "killed", "--json", cwd=d)
    found = json.loads(ran.stdout)
    t.expect(ran.returncode == 1 and not found["holds"] and "dataset.h5" in [one["where"] for one in found["findings"]], f"a flipped bit: {found}")
    text = t.run("verify", "killed", cwd=d).stdout
    t.expect(line_has(text, ["dataset.h5", "SHA-256"]), f"a flipped bit: {text}")


def main():
    t = Checks(sys.argv[1])
    root = pathlib.Path(sys.argv[2]).resolve()
    rig = root / "sim/rigs/bench17.json"
    with tempfile.TemporaryDirectory(prefix="weft-resume-") as folder:
        d = pathlib.Path(folder)
        write_recipe(root, d / "recipe.json")
        t.expect(t.run("run", "recipe.json", "--rig", str(rig), "--out", "undisturbed", *RUN, cwd=d).returncode == 0, "the undisturbed run")
        killed(t, d, rig, samples(d / "undisturbed"))
    t.finish()


main()
