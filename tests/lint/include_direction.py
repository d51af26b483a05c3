#!/usr/bin/env python3
"""Fails on an #include that no row of docs/architecture.md allows, on a clock read outside a Loop, and on
nlohmann/json in a header.

    include_direction.py ROOT      checks the tree
    include_direction.py --selftest  checks that the checker refuses what it must refuse
"""
import pathlib
import re
import sys
import tempfile

# folder -> folders it may include. A room may always include itself. Longest match wins.
ALLOWED = {
    "protocols/base": [],
    "protocols/*": ["protocols/base"],
    "drivers/api": ["protocols/base"],
    "drivers/*": ["drivers/api", "protocols/base", "protocols/{own}"],
    "recipes": ["protocols/base"],
    "classifier": ["protocols/base"],
    "sim/plant": ["protocols/base"],
    "sim/devices": ["sim/plant", "protocols"],
    "sim/rig": ["sim/devices", "sim/plant", "drivers/api", "protocols/base"],
    "daemon": ["drivers", "protocols", "recipes", "classifier", "sim"],
    "tests": [""],
}
# which wires a driver may speak
WIRES = {"thorlabs_apt": ["apt"], "ati_netft": ["rdt"], "ati_digital": ["modbus", "ati_digital"], "taxel_array": ["taxel"],
         "vibro": ["vibro"], "imprint_array": ["imprint"]}
ROOTS = ("protocols", "drivers", "recipes", "classifier", "sim", "daemon", "tests")
# only a Loop reads a clock; benchmarks and the wall-time figures of the report measure real time
CLOCK_FILES = ("daemon/loop/", "tests/bench/")
CLOCK = re.compile(r"sleep_for|sleep_until|\busleep\b|nanosleep|_clock::now|clock_gettime|gettimeofday|timespec_get|std::clock\b|std::time\b|"
                   r"\b(?:steady|system|high_resolution|utc)_clock\b")  # any use of one: it may have another name there
INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.M)


def room_of(path):
    parts = path.split("/")
    for depth in (2, 1):
        key = "/".join(parts[:depth])
        if key in ALLOWED:
            return key, key
        star = parts[0] + "/*"
        if depth == 2 and len(parts) > 2 and star in ALLOWED:
            return star, key
    return None, None


def allowed(path, target):
    rule, own = room_of(path)
    if rule is None:
        return False
    if target.startswith(own + "/"):
        return True
    wires = WIRES.get(own.split("/")[-1], [])
    for row in ALLOWED[rule]:
        for prefix in [row.replace("{own}", wire) for wire in wires] if "{own}" in row else [row]:
            if prefix == "" or target.startswith(prefix + "/"):
                return True
    return False


def check(root):
    problems = []
    for path in sorted(root.rglob("*")):
        rel = path.relative_to(root).as_posix()
        if path.suffix not in (".cpp", ".hpp", ".cc") or not rel.startswith(tuple(r + "/" for r in ROOTS)):
            continue
        text = path.read_text()
        for target in INCLUDE.findall(text):
            if target.startswith(tuple(r + "/" for r in ROOTS)) and not allowed(rel, target):
                problems.append(f"{rel}: may not include {target}: no row of docs/architecture.md allows it")
            if target.startswith("nlohmann/") and path.suffix == ".hpp" and target != "nlohmann/json_fwd.hpp":
                problems.append(f"{rel}: {target} belongs in .cpp files only, it is slow to compile")
        if CLOCK.search(text) and not rel.startswith(CLOCK_FILES):
            problems.append(f"{rel}: reads a clock or sleeps; take the time as an argument, only a Loop reads a clock")
    return problems


def selftest():
    cases = {
        "drivers/thorlabs_apt/a.cpp": ('#include "sim/plant/plant.hpp"', True),
        "drivers/thorlabs_apt/b.cpp": ('#include "protocols/apt/apt.hpp"', False),
        "drivers/thorlabs_apt/c.cpp": ('#include "protocols/rdt/rdt.hpp"', True),
        "drivers/ati_digital/a.cpp": ('#include "protocols/modbus/rtu.hpp"', False),
        "drivers/ati_digital/b.cpp": ('#include "protocols/rdt/rdt.hpp"', True),
        "sim/devices/a.cpp": ('#include "drivers/api/link.hpp"', True),
        "sim/rig/a.cpp": ('#include "daemon/loop/virtual_loop.hpp"', True),
        "classifier/features/a.cpp": ('#include "recipes/engine/plan.hpp"', True),
        "classifier/features/b.cpp": ('#include "classifier/selection/t_test.hpp"', False),
        "recipes/engine/a.hpp": ("#include <nlohmann/json.hpp>", True),
        "recipes/engine/b.cpp": ("auto t = std::chrono::steady_clock::now();", True),
        "recipes/engine/c.cpp": ("using Clock = std::chrono::steady_clock;", True),
        "classifier/svm/a.cpp": ("const auto began = std::clock();", True),
        "daemon/run/b.cpp": ("clock_gettime(CLOCK_MONOTONIC, &now);", True),
        "daemon/run/c.cpp": ("const auto began = loop_->now();", False),
        "protocols/base/a.hpp": ('#include "protocols/apt/apt.hpp"', True),
        "daemon/run/a.cpp": ('#include "sim/rig/rig.hpp"', False),
    }
    failures = []
    for name, (line, refused) in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / name
            file.parent.mkdir(parents=True)
            file.write_text(line + "\n")
            if bool(check(pathlib.Path(folder))) != refused:
                failures.append(f"{name}: {line} should be {'refused' if refused else 'allowed'}")
    return failures


problems = selftest() if sys.argv[1] == "--selftest" else check(pathlib.Path(sys.argv[1]))
print("\n".join(problems) or "includes, clocks and heavy headers: in order")
sys.exit(1 if problems else 0)
