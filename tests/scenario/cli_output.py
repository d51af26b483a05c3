#!/usr/bin/env python3
"""Outputs: a full disk is reported, devices and pipes are not replaced, a link stays a link. Inputs: names that are not text, rates that differ,
names with '#', sums of explorations, invalid numbers.

    cli_output.py WEFT
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from cli_support import Checks, line_has
from made_up_cloths import RATE_HZ, write_manifest, write_set, write_trial


def answers(t, d):
    """A command fails if its answer cannot be written."""
    command = [t.weft, "--json", "evaluate", "d.h5", "--train-fraction", "0.5", "--repeats", "2", "--learner", "lda"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run(command, cwd=d, stdout=full, stderr=subprocess.PIPE, text=True)
    t.expect(ran.returncode == 1 and line_has(ran.stderr, ["weft", "standard output"]), f"/dev/full: {ran}")
    closed = subprocess.run(["sh", "-c", '"$@" >&-', "sh", *command], cwd=d, stderr=subprocess.PIPE, text=True)
    t.expect(closed.returncode == 1 and line_has(closed.stderr, ["weft", "standard output"]), f"closed: {closed}")


def files(t, d):
    os.mkfifo(d / "pipe")
    (d / "folder").mkdir()
    for place in ("pipe", "folder"):
        t.refuses("train", "d.h5", "-o", place, "--learner", "lda", cwd=d, code="io", where=place, got=place)
    t.expect((d / "pipe").is_fifo() and (d / "folder").is_dir(), "they are what they were")
    (d / "old.weft").write_text("old")
    (d / "link.weft").symlink_to("old.weft")
    t.succeeds("train", "d.h5", "-o", "link.weft", "--learner", "lda", cwd=d)
    t.expect((d / "link.weft").is_symlink() and "weft" in (d / "old.weft").read_text(errors="replace")[:40], "a link is followed")
    (d / "dangling.weft").symlink_to("new.weft")
    t.succeeds("train", "d.h5", "-o", "dangling.weft", "--learner", "lda", cwd=d)
    t.expect((d / "dangling.weft").is_symlink() and (d / "new.weft").is_file(), "so is one to a file that is not there yet")
    t.refuses("classify", "folder", "d.h5", cwd=d, code="not found", where="folder", got="folder")


def names(t, d, rows):
    folder = d / "names"
    folder.mkdir()
    for k in range(8):
        for c, label in enumerate(("wool", "felt")):
            write_trial(folder / f"{label} #{k}.csv", 40 * c, 1 + c, 10 * k + c)
    write_manifest(folder / "manifest.csv", [[f"{label} #{k}.csv", label, "AB"[k % 2]] for label in ("wool", "felt") for k in range(8)])
    t.succeeds("dataset", "import", "names/manifest.csv", "-o", "names.h5", cwd=d)
    told = t.succeeds("evaluate", "names.h5", "--train-fraction", "0.5", "--repeats", "1", "--learner", "lda", "--calibration", cwd=d)
    t.expect('"recordings": 8' in str(told).replace("'", '"'), f"each file is a recording of its own: {told}")
    good = (d / rows[0][0]).read_bytes()
    (folder / "a.csv").write_bytes(good)
    (folder / "latin.csv").write_bytes(b"file,label\na.csv,caf\xe9\n")
    t.refuses("dataset", "import", "names/latin.csv", "-o", "bad.h5", cwd=d, code="parse", where=["latin.csv:2"], expected="UTF-8")


def rates(t, d):
    folder = d / "rates"
    folder.mkdir()
    for k in range(4):
        write_trial(folder / f"{k}.csv", 0, 1, k)
    lines = (folder / "3.csv").read_text().splitlines()
    slow = [lines[0]] + [f"{3 * i / RATE_HZ:.3f},{line.split(',', 1)[1]}" for i, line in enumerate(lines[1:])]
    (folder / "3.csv").write_text("\n".join(slow) + "\n")
    write_manifest(folder / "manifest.csv", [[f"{k}.csv", "wool", "A"] for k in range(4)])
    t.succeeds("dataset", "import", "rates/manifest.csv", "-o", "rates.h5", cwd=d)
    for command in (["train"], ["train", "--window-s", "1"], ["train", "--live"], ["features", "--window-s", "1"]):
        t.refuses(command[0], "rates.h5", "-o", "bad", *command[1:], cwd=d, code="invalid argument", where=["3.csv"],
                  got=[f"{RATE_HZ:.2f} Hz", f"{RATE_HZ / 3:.2f} Hz"])
    t.succeeds("features", "rates.h5", "-o", "rates_features.csv", cwd=d)


def pauses(t, d):
    """Pauses between phases do not change the sample rate."""
    folder = d / "pauses"
    folder.mkdir()
    rows = [[f"{k}.csv", ("wool", "felt")[k % 2], "A"] for k in range(8)]
    for name, label, _ in rows:
        write_trial(folder / name, 40 * (label == "wool"), 1, int(name[0]))
        lines = (folder / name).read_text().splitlines()
        later = {"S": 0, "P": 5, "M": 10, "E": 15}
        moved = [f"{float(line.split(',')[0]) + later[line.split(',')[1]]:.3f},{line.split(',', 1)[1]}" for line in lines[1:]]
        (folder / name).write_text("\n".join([lines[0], *moved]) + "\n")
    write_manifest(folder / "manifest.csv", rows)
    t.succeeds("dataset", "import", "pauses/manifest.csv", "-o", "pauses.h5", cwd=d)
    t.succeeds("train", "pauses.h5", "-o", "pauses.weft", "--learner", "lda", cwd=d)


def explorations(t, d):
    for wrong in ("+", "++", "M1+M1", "M1+", "+M1"):
        t.refuses("features", "d.h5", "-o", "bad.csv", "--exploration", wrong, cwd=d, code="invalid argument", where=["--exploration"], got=wrong,
                  expected="M1+M2")


def help_of(t, command, d):
    brief = t.run(*command.split(), "--help", cwd=d).stdout
    return t.run(*command.split(), "--help-all", cwd=d).stdout if "--help-all" in brief else brief


def numbers(t, d):
    """No option accepts NaN or infinity. An accepted "nan" used to make windows without end."""
    seen = 0
    for command in ("run", "doctor", "features", "train", "evaluate", "vibro evaluate", "trade classifier", "trade vibro", "design analyse", "design repetitions"):
        options = re.findall(r"(--[\w-]+) NUMBER", help_of(t, command, d))
        seen += len(options)
        for option in options:
            for value in ("nan", "-NaN", "inf"):
                ran = t.run(*command.split(), f"{option}={value}", cwd=d)
                t.expect(ran.returncode == 2 and line_has(ran.stderr, [option, value]), f"{command} {option} {value}: {ran.returncode} {ran.stderr}")
    t.expect(seen > 12, f"{seen} options take a number in a range")


def main():
    t = Checks(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        d = pathlib.Path(name) / "cloths"
        rows = write_set(d)
        t.succeeds("dataset", "import", "manifest.csv", "-o", "d.h5", cwd=d)
        answers(t, d)
        files(t, d)
        names(t, d, rows)
        rates(t, d)
        pauses(t, d)
        explorations(t, d)
        numbers(t, d)
    t.finish()


main()
