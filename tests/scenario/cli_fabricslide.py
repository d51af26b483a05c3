#!/usr/bin/env python3
"""Real strokes over seven fabrics through the command line: repetition 0 trains, repetition 1 tests.

    cli_fabricslide.py WEFT SHARED

The published figure is 0.96 (k-NN; Wang et al. 2022, doi 10.3389/fnbot.2022.808222). Skipped (77) without the data.
"""
import pathlib
import sys
import tempfile

from cli_support import Checks

PUBLISHED = 0.96


def main():
    t = Checks(sys.argv[1])
    source = pathlib.Path(sys.argv[2]) / "data/fabricslide"
    if not source.is_dir():
        print(f"skipped: {source} is not there")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="weft-fabricslide-") as d:
        t.succeeds("dataset", "import", "--format", "fabricslide", source.resolve(), "-o", "fs.h5", cwd=d)
        info = t.succeeds("dataset", "info", "fs.h5", cwd=d)
        t.expect(info["trials"] == 644 and len(info["labels"]) == 7 and info["bench"] == "real", f"info: {info}")
        split = ["--train-groups", "0", "--test-groups", "1", "--reduction", "every"]
        strokes = t.succeeds("evaluate", "fs.h5", *split, cwd=d)
        for name, result in strokes["results"].items():
            print(f"whole strokes, {name}: {result['accuracy']:.4f}")
            t.expect(result["accuracy"] >= PUBLISHED, f"{name}: {result['accuracy']} is below {PUBLISHED}")
    t.finish()


main()
