#!/usr/bin/env python3
"""Counts the instructions of every mechanism in every scene with callgrind. Fails if a scene computes something that it does not need, or lacks
something that it needs.

    scene_costs.py PROGRAM [--only SCENE ...] [--write-docs]

PROGRAM is bench_scene_costs. Prints a table for the plant alone and one for whole runs, and writes out/bench/scene_instructions.json; with
--write-docs also the table of docs/explanation/fidelity.md.
Optional: needs valgrind (Debian package of that name); exit status 77 without it. Instructions do not depend on the machine's load, and on the
machine itself only through its C library."""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# The cost of a mechanism is that of its entry functions with all their callees. A pattern is the callee, or a caller and the callee. A mechanism that
# the compiler inlines into its caller is seen only by its calls of the C library. A mechanism inside another one counts in both.
ENTRIES = {
    "contact": r"weft::sim::(ContactModel::(step|advance)|(AlgebraicProbe|DynamicContact)::step)\(",
    "relaxation": r"weft::sim::RelaxationStep::weigh\(",
    "friction": (r"weft::sim::(ContactModel|DynamicContact|Algebraic\w+|NearPower)::", r"_*pow\b"),
    "lugre": r"weft::sim::glide_(midpoint|tr_bdf2)\(",
    "modal": r"weft::sim::Vibration::advance\(",
    "cover": (r"weft::sim::(compose|cut_patch|bare_plate)\(", r"_*exp\b"),
    "wear": r"weft::sim::(Plant::rub|PadBed::flatten)\(",
    "texture": r"weft::sim::(HeightField::HeightField\(weft::sim::SurfaceSpec|TextureMap::(tile|strip|synthesise|average)\()",
    "pressure": r"weft::sim::(PadBed::press|Algebraic(Probe|Contact)::pressure_pa)\(",
    "pads": r"weft::sim::PadArray::convert(_stages)?\(",
    "pad noise": r"weft::sim::PadArray::draw_noise\(",
    "taxel frames": r"weft::protocols::taxel::(append|Splitter::next)\(",
    "force sensor": r"weft::sim::FtSensor::read\(",
    "force noise": (r"weft::sim::FtSensor::", r"_*(log|cos)\b"),
    "vibration frames": r"weft::protocols::vibro::(append|Splitter::next)\(",
    "imprint": r"weft::sim::(press_winkler|HalfSpace::press)\(",
}
ANYBODY = r"(?!_dl_)"  # the loader checks which clone of a function this machine can run
OUTERMOST = {"contact", "modal", "pressure", "pads", "force sensor", "imprint"}  # none is inside another of them
IN_RUNS = {"friction", "cover", "wear", "taxel frames", "vibration frames"}  # absent in a steady slide of the plant alone

CONTACT = {"contact", "relaxation"}
FORCE = {"force sensor", "force noise"}
TAXELS = {"texture", "pressure", "pads", "pad noise"}
DYNAMIC = {"lugre"}
RUN = CONTACT | FORCE | TAXELS | {"friction", "taxel frames"}
VIBRATION = DYNAMIC | {"modal"}
NEEDED = {
    "stages": set(),
    "wrench-means": {"contact"} | FORCE,
    "taxel-means": {"contact"} | FORCE | TAXELS,
    "wrench": CONTACT | FORCE,
    "taxels": CONTACT | FORCE | TAXELS,
    "wrench-overshoot": CONTACT | FORCE | DYNAMIC,
    "taxels-overshoot": CONTACT | FORCE | TAXELS | DYNAMIC,
    "accelerometer": CONTACT | FORCE | TAXELS | VIBRATION,
    "microphone": CONTACT | FORCE | TAXELS | VIBRATION,
    "accelerometer-microphone": CONTACT | FORCE | TAXELS | VIBRATION,
    "imprint-Z": {"imprint"},
    "imprint-Z+": {"imprint"},
    "run-press": RUN,
    "run-M1": RUN,
    "run-M2": RUN,
    "run-no-taxels": RUN - TAXELS - {"taxel frames"},
    "run-no-noise": RUN - {"pad noise", "force noise"},
    "run-no-friction": RUN - {"friction"},
    "run-no-texture": RUN - {"texture"},
    "run-no-relaxation": RUN - {"relaxation"},
    "run-soft-cover": RUN | {"cover"},
    "run-wear": RUN | {"wear"},
    "run-L0": RUN - {"relaxation"},
    "run-L3": RUN | VIBRATION | {"vibration frames"},
}
DOCS = pathlib.Path("docs/explanation/fidelity.md")
DOCS_BEGIN = "<!-- scene costs: written by tests/bench/scene_costs.py --write-docs -->\n"
DOCS_END = "<!-- end of scene costs -->\n"


def is_run(scene):
    return scene.startswith("run-")


def mechanisms_of(scene):
    return [m for m in ENTRIES if is_run(scene) or m not in IN_RUNS]


def calls(text):
    """(caller, callee, instructions with all callees) of a callgrind file, with full names."""
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
    patterns = {}
    for mechanism, entry in ENTRIES.items():
        caller, callee = (ANYBODY, entry) if isinstance(entry, str) else entry
        patterns[mechanism] = re.compile(caller), re.compile(callee)
    found = {mechanism: 0 for mechanism in ENTRIES}
    for caller, callee, cost in calls(text):
        for mechanism, (from_whom, entry) in patterns.items():
            # An entry that calls another entry of its own mechanism counts once.
            if entry.match(callee) and from_whom.match(caller) and not entry.match(caller):
                found[mechanism] += cost
    found["all"] = int(re.search(r"^(?:totals|summary): (\d+)", text, re.M).group(1))
    return found


def measured(program, scene, folder):
    """For a whole run everything counts, also the work before and beside it."""
    out = pathlib.Path(folder) / "callgrind.out"
    part = [] if is_run(scene) else ["--toggle-collect=measured_part*"]
    ran = subprocess.run(["valgrind", "--tool=callgrind", *part, f"--callgrind-out-file={out}", program, scene],
                         capture_output=True, text=True)
    if ran.returncode != 0:
        sys.exit(f"{scene}: {ran.stderr}")
    return count(out.read_text())


def problems_of(scene, row):
    if scene not in NEEDED:
        yield f"{scene}: what it needs is not known"
        return
    if sum(row[mechanism] for mechanism in OUTERMOST) > row["all"]:
        yield f"{scene}: mechanisms cost more than all together: one is counted twice"
    for mechanism in mechanisms_of(scene):
        if mechanism in NEEDED[scene] and row[mechanism] == 0:
            yield f"{scene}: {mechanism} is needed, and costs nothing"
        if mechanism not in NEEDED[scene] and row[mechanism] > 0:
            yield f"{scene}: {mechanism} costs {row[mechanism]} instructions, and is not needed"


def print_row(scene, row):
    unit, name = (1e6, "M") if is_run(scene) else (1e3, "k")
    paid = ", ".join(f"{m} {row[m] / unit:,.1f}" for m in [*mechanisms_of(scene), "all"] if row[m] > 0)
    print(f"{scene:26}{paid} {name}", flush=True)


def cell(scene, mechanism, paid):
    needed = mechanism in NEEDED[scene]
    if paid == 0:
        return "needed, 0" if needed else ""
    figure = f"{paid / 1e6:.2f}" if paid >= 1e4 else "< 0.01"
    return figure if needed else f"**{figure}**"


def docs_table(table):
    """Whole runs; a column for each mechanism that any of them has."""
    mechanisms = [m for m in ENTRIES if any(m in NEEDED[s] or row[m] > 0 for s, row in table.items())]
    lines = ["| scene | " + " | ".join(mechanisms) + " | all |", "|---|" + "---:|" * (len(mechanisms) + 1)]
    for scene, row in table.items():
        cells = [cell(scene, m, row[m]) for m in mechanisms]
        lines.append(f"| {scene.removeprefix('run-')} | " + " | ".join(cells) + f" | {row['all'] / 1e6:.0f} |")
    return "\n".join(lines) + "\n"


def write_docs(table):
    text = DOCS.read_text()
    before, begin, rest = text.partition(DOCS_BEGIN)
    _, end, after = rest.partition(DOCS_END)
    if not begin or not end:
        sys.exit(f"{DOCS}: no place for the table")
    DOCS.write_text(before + begin + docs_table(table) + end + after)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--only", nargs="+", default=[], metavar="SCENE")
    parser.add_argument("--write-docs", action="store_true")
    asked = parser.parse_args()
    if asked.write_docs and asked.only:
        parser.error("the table of the docs has all scenes")
    if shutil.which("valgrind") is None:
        print("valgrind is not installed: no instructions counted")
        sys.exit(77)
    listed = subprocess.run([asked.program, "--list"], capture_output=True, text=True, check=True).stdout.split()
    problems = [f"{scene}: no such scene" for scene in asked.only if scene not in listed]
    table = {}
    print("SIMULATED bench, instructions for one second of sliding, one press (imprints) or a whole run of one trial")
    with tempfile.TemporaryDirectory() as folder:
        for scene in listed:
            if asked.only and scene not in asked.only:
                continue
            table[scene] = measured(asked.program, scene, folder)
            print_row(scene, table[scene])
            problems += problems_of(scene, table[scene])
    out = pathlib.Path("out/bench")
    out.mkdir(parents=True, exist_ok=True)
    (out / "scene_instructions.json").write_text(
        json.dumps({"bench": "simulated", "unit": "instructions a simulated second, imprints a press, runs a run",
                    "scenes": table}, indent=1) + "\n")
    for problem in problems:
        print("NOT AS IT SHOULD BE:", problem)
    if asked.write_docs:
        write_docs({scene: row for scene, row in table.items() if is_run(scene)})
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
