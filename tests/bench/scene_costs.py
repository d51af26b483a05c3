#!/usr/bin/env python3
"""Counts the instructions of every mechanism in every scene with callgrind, and fails where a scene computes what it
does not need.

    scene_costs.py PROGRAM      PROGRAM is bench_scene_costs; prints a table, writes out/bench/scene_instructions.json

Optional: needs valgrind (Debian package of that name); exit status 77 without it. Instructions do not depend on the
machine's load, and on the machine itself only through its C library."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# What a mechanism costs is what its entry functions and all below them cost. A mechanism inside another one is counted
# on its own and taken off the outer one.
ENTRIES = {
    "texture": r"weft::sim::(TextureMap::(response|TextureMap)|LinearTexture::height_m)\(",
    "pads": r"weft::sim::PadArray::convert(_stages)?\(",
    "pressure": r"weft::sim::(ContactModel|AlgebraicContact|AlgebraicProbe)::pressures?_pa\(",
    "contact": r"weft::sim::(ContactModel::(step|advance)|(AlgebraicProbe|DynamicContact)::step)\(",
    "lugre": r"weft::sim::glide_(midpoint|tr_bdf2)\(",
    "modal": r"weft::sim::Vibration::advance\(",
    "force sensor": r"weft::sim::FtSensor::read\(",
    "imprint": r"weft::sim::(press_winkler|HalfSpace::press)\(",
}
INSIDE = {"lugre": "contact"}  # the friction of levels L2 and L3 is a part of their contact
WRENCH = {"contact", "force sensor"}
TAXELS = {"texture", "pads", "pressure"}
NEEDED = {
    "stages": set(),
    "wrench-means": WRENCH,
    "taxel-means": WRENCH | TAXELS,
    "wrench": WRENCH,
    "taxels": WRENCH | TAXELS,
    "wrench-overshoot": WRENCH | {"lugre"},
    "taxels-overshoot": WRENCH | TAXELS | {"lugre"},
    "accelerometer": WRENCH | TAXELS | {"lugre", "modal"},
    "microphone": WRENCH | TAXELS | {"lugre", "modal"},
    "accelerometer-microphone": WRENCH | TAXELS | {"lugre", "modal"},
    "imprint-Z": {"imprint"},
    "imprint-Z+": {"imprint"},
}


def calls(text):
    """(caller, callee, instructions with all below) of a callgrind file, names in full."""
    names, caller, callee = {}, None, None

    def name(entry):
        number, _, words = re.match(r"\((\d+)\)( (.*))?", entry).groups()[0], None, entry.partition(") ")[2]
        if words:
            names[number] = words
        return names[number]

    for line in text.splitlines():
        if line.startswith("fn="):
            caller = name(line[3:])
        elif line.startswith("cfn="):
            callee = name(line[4:])
        elif line.startswith("calls="):
            pass
        elif callee is not None and re.match(r"[+\-*\d]", line):
            yield caller, callee, int(line.split()[-1])
            callee = None


def count(text):
    found = {mechanism: 0 for mechanism in ENTRIES}
    patterns = {mechanism: re.compile(pattern) for mechanism, pattern in ENTRIES.items()}

    def of(function):
        return next((m for m, pattern in patterns.items() if pattern.search(function)), None)

    for caller, callee, cost in calls(text):
        mechanism = of(callee)
        if mechanism is None or of(caller) == mechanism:  # an entry that calls another of its own is counted once
            continue
        found[mechanism] += cost
    for inner, outer in INSIDE.items():
        found[outer] -= found[inner]
    totals = re.search(r"^(?:totals|summary): (\d+)", text, re.M)
    found["all"] = int(totals.group(1))
    return found


def measured(program, scene, folder):
    out = pathlib.Path(folder) / "callgrind.out"
    ran = subprocess.run(["valgrind", "--tool=callgrind", "--toggle-collect=measured_part*", f"--callgrind-out-file={out}",
                          program, scene], capture_output=True, text=True)
    if ran.returncode != 0:
        sys.exit(f"{scene}: {ran.stderr}")
    return count(out.read_text())


def main():
    program = sys.argv[1]
    if shutil.which("valgrind") is None:
        print("valgrind is not installed: no instructions counted")
        sys.exit(77)
    scenes = subprocess.run([program, "--list"], capture_output=True, text=True, check=True).stdout.split()
    problems = [f"{s}: what it needs is not known" for s in scenes if s not in NEEDED]
    table = {}
    columns = [*ENTRIES, "all"]
    print("SIMULATED bench, instructions for one second of sliding (imprints: for one press)")
    print(f"{'scene':26}" + "".join(f"{c:>13}" for c in columns))
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes:
            table[scene] = row = measured(program, scene, folder)
            print(f"{scene:26}" + "".join(f"{row[c]:13,}" for c in columns), flush=True)
            if sum(row[mechanism] for mechanism in ENTRIES) > row["all"]:
                problems.append(f"{scene}: mechanisms cost more than all together: one is counted twice")
            for mechanism in ENTRIES:
                needed = mechanism in NEEDED.get(scene, set())
                if (row[mechanism] > 0) != needed:
                    problems.append(f"{scene}: {mechanism} costs {row[mechanism]} instructions, "
                                    f"and is {'' if needed else 'not '}needed")
    out = pathlib.Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    (out / "scene_instructions.json").write_text(
        json.dumps({"bench": "simulated", "unit": "instructions a simulated second, imprints a press", "scenes": table},
                   indent=1) + "\n")
    for problem in problems:
        print("NOT AS IT SHOULD BE:", problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
