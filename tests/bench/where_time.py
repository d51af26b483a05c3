#!/usr/bin/env python3
"""Samples one simulated run of the demo's campaign with perf and prints where its processor time goes.

    where_time.py WEFT [RECIPE]     WEFT is the program, RECIPE the demo's campaign by default; prints a table and
                                    writes out/bench/where_time.json

A sample belongs to the part with the innermost function on its stack, so malloc, libm or the kernel count for their caller. All shares are of one
run: other work of the machine changes seconds, but hardly shares.
Optional: needs perf with access to the processor's samples; exit status 77 without it."""
import collections
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SAMPLES_PER_S = 199  # no divisor of the bench's periods
STACK_BYTES = 16384

# The first pattern that a function matches counts; the names are those of the tree.
PARTS = {
    "export": r"libhdf5|libz\.|libcrypto|hdf5::|write_hdf5|load_campaign|export_dataset|certif|Sha256|ChunkReader",
    "recorder": r"libsqlite|sqlite::|Recorder::|CampaignWriter|TrialRecording",
    "links and codecs": r"MemoryLink|FaultyWire|Attachment|weft::protocols|weft::crc|ByteReader|ByteWriter",
    "emulators": r"weft::sim::\S*(Emulator|FtSensor|AptParameters)",
    "pads and texture": r"weft::sim::\S*(TextureMap|PadArray|PadBed|HeightField|LinearTexture)",
    "plant: contact and stages": r"weft::sim::",
    "loop and timers": r"TimerQueue|VirtualLoop|TimedLoop",
    "drivers and engine": r"weft::drivers|weft::recipes|weft::DriverBase|Supervisor|weft::daemon::\S*(Bench|Device)"
                          r"|Run::execute|Run::apply",
}
PATTERNS = {part: re.compile(pattern) for part, pattern in PARTS.items()}


def part_of(frame):
    """`frame`: a function and its library, as perf prints them."""
    return next((part for part, pattern in PATTERNS.items() if pattern.search(frame)), None)


def counted(script):
    """Samples of each part in the output of perf script: stacks, innermost function first."""
    found = collections.Counter()
    for stack in script.split("\n\n"):
        frames = [line.split(maxsplit=1)[1] for line in stack.strip().splitlines() if " " in line.strip()]
        if frames:
            found[next(filter(None, map(part_of, frames)), "start, end, other")] += 1
    return found


def sampled(weft, recipe, folder):
    data = folder / "perf.data"
    run = subprocess.run(
        ["perf", "record", "-q", "-e", "cpu-clock:u", "-F", str(SAMPLES_PER_S), "--call-graph", f"dwarf,{STACK_BYTES}",
         "-o", data, weft, "run", recipe, "--rig", "sim/rigs/bench17.json", "--out", folder / "run", "--yes",
         "--no-error-check", "--no-evaluate"], capture_output=True, text=True)
    if not (folder / "run/dataset.h5").exists():
        print(f"no samples: {run.stderr.strip()[-500:]}")
        sys.exit(77 if "ermi" in run.stderr or "not supported" in run.stderr else 1)
    script = subprocess.run(["perf", "script", "--no-inline", "-i", data, "-F", "ip,sym,dso"], capture_output=True,
                            text=True, check=True)
    return counted(script.stdout)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if shutil.which("perf") is None:
        print("perf is not installed: no time attributed")
        sys.exit(77)
    recipe = sys.argv[2] if len(sys.argv) > 2 else "recipes/library/khan2016.json"
    with tempfile.TemporaryDirectory() as folder:
        found = sampled(sys.argv[1], recipe, pathlib.Path(folder))
    total = sum(found.values())
    print(f"SIMULATED campaign {recipe}: {total / SAMPLES_PER_S:.2f} s of processor time")
    for part, samples in found.most_common():
        print(f"{part:28}{100 * samples / total:6.1f} %{samples / SAMPLES_PER_S:9.2f} s")
    out = pathlib.Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    (out / "where_time.json").write_text(
        json.dumps({"bench": "simulated", "recipe": recipe, "cpu_s": total / SAMPLES_PER_S,
                    "share": {part: samples / total for part, samples in found.items()}}, indent=1) + "\n")


if __name__ == "__main__":
    main()
