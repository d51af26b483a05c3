#!/usr/bin/env python3
"""A Digital F/T sensor behind a half-duplex adapter that echoes sent bytes: `weft doctor` opens, streams and closes it on the emulated bench.

    echo_line.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import sys
import tempfile

from cli_support import Checks
from emulated_support import ServedRig, digital_rig, tried


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        link = {"kind": "serial", "path": str(folder / "ports" / "ft"), "baud": 115200}
        path, rig = digital_rig(root, folder, "rtu", link)
        wrench = next(device for device in rig["devices"] if device["role"] == "wrench")
        wrench["emulator"]["echo"] = True
        path.write_text(json.dumps(rig))

        def once(_):
            with ServedRig(weft_rig, path, rig):
                return t.run("doctor", "--rig", path, cwd=folder)

        ran = tried(once)
        t.expect(ran.returncode == 0 and "ati_digital" in ran.stdout, f"{ran.returncode}: {ran.stdout}{ran.stderr}")
    t.finish()


main()
