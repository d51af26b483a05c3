#!/usr/bin/env python3
"""Fails on an include that no row allows, a dependency upwards, a cycle, a clock read outside a Loop, and nlohmann/json in a header.

    include_direction.py ROOT        checks the tree
    include_direction.py --selftest  checks that the checker refuses what it must refuse

A row is a `weft_module(FOLDER USES FOLDER ...)` of the CMake files: the target's link list. A module may include itself and whatever its
row reaches. docs/explanation/architecture.md shows the same rows; a difference is a problem too.
"""
import pathlib
import re
import sys
import tempfile

# The daemon's layers, lowest first: a module depends on its own layer and those below.
LAYERS = ["base", "hardware", "storage", "campaign", "pages", "analysis", "service", "apps"]
ROW_FILES = ("CMakeLists.txt", "classifier/modules.cmake", "daemon/modules.cmake")
ROW = re.compile(r"^ *weft_module\(([^)]*)\)", re.M)
# Rows from a loop of CMake.
WIRES = {"thorlabs_apt": ["apt"], "ati_netft": ["rdt"], "ati_digital": ["modbus", "ati_digital"], "taxel_array": ["taxel"],
         "vibro": ["vibro"], "imprint_array": ["imprint"]}
ROOTS = ("protocols", "drivers", "recipes", "classifier", "sim", "daemon", "tests")
# Folders of main() files.
PROGRAMS = {"daemon/apps/weftd": ["daemon/apps/weft"], "daemon/apps/weft_train_mpi": ["daemon/apps/weft"]}
# Composition roots and built-in drivers: these name drivers.
BUILT_IN = {"daemon/hardware/plugins": [f"drivers/{name}" for name in WIRES]}
# Includes that a module must not have itself, even if its row leads to them: a calibration compares signals, never predictions of a classifier.
FORBIDDEN = {"daemon/analysis/calibration": "classifier/"}
CLOCK_FILES = ("daemon/base/loop/", "tests/bench/")
CLOCK = re.compile(r"sleep_for|sleep_until|\busleep\b|nanosleep|_clock::now|clock_gettime|gettimeofday|timespec_get|std::clock\b|std::time\b|"
                   r"\b(?:steady|system|high_resolution|utc)_clock\b")  # any use of one: it may have another name there
INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.M)
PAGE = "docs/explanation/architecture.md"
PAGE_ROW = re.compile(r"^\| `([\w/<>]+)` \|[^|]*\|([^|]*)\|$", re.M)


def read_rows(root):
    """Module -> modules of its USES, from the CMake files."""
    rows = {"protocols/base": []}
    for wires in WIRES.values():
        rows.update({f"protocols/{wire}": ["protocols/base"] for wire in wires})
    for driver, wires in WIRES.items():
        rows[f"drivers/{driver}"] = ["drivers/api", *(f"protocols/{wire}" for wire in wires)]
    for file in ROW_FILES:
        if not (root / file).exists():
            continue
        for arguments in ROW.findall((root / file).read_text()):
            name, *words = arguments.split()
            if "$" in name:
                continue
            uses, taking = [], False
            for word in words:
                taking = word == "USES" if word.isupper() or word.endswith("SYSTEM") else taking
                if taking and word != "USES":
                    uses.append(word)
            rows[name] = uses + BUILT_IN.get(name, [])
    for program, uses in PROGRAMS.items():
        if uses[0] in rows:
            rows[program] = uses
    return rows


def reached(rows, module):
    """All modules that its row leads to, without itself unless there is a cycle."""
    out, waiting = set(), list(rows.get(module, []))
    while waiting:
        one = waiting.pop()
        if one not in out:
            out.add(one)
            waiting.extend(rows.get(one, []))
    return out


def layer(module):
    parts = module.split("/")
    return LAYERS.index(parts[1]) if parts[0] == "daemon" and parts[1] in LAYERS else -1


def check_rows(rows):
    problems = []
    for module, uses in rows.items():
        if module in reached(rows, module):
            problems.append(f"{module}: depends on itself through its row: take the cycle apart")
        for use in uses:
            if use not in rows:
                problems.append(f"{module}: its row names {use}, which is no module")
            elif layer(use) > layer(module):
                problems.append(f"{module}: its row names {use} of a higher layer: move what both need down")
    return problems


def module_of(rows, path):
    """The module with the longest name that contains the file."""
    parts = path.split("/")[:-1]
    for depth in range(len(parts), 0, -1):
        if "/".join(parts[:depth]) in rows:
            return "/".join(parts[:depth])
    return None


def check_page(root, rows):
    """The table of docs/explanation/architecture.md has each module with its row."""
    if not (root / PAGE).exists():
        return []
    shown = {name: set(re.findall(r"`([\w/<>]+)`", uses)) for name, uses in PAGE_ROW.findall((root / PAGE).read_text())}
    looped = {name for name in rows if name.startswith(("protocols/", "drivers/")) and name not in ("protocols/base", "drivers/api")}
    problems = [f"{PAGE}: no row of {name}" for name in rows if name not in looped and name not in shown]
    for name, uses in shown.items():
        if "<" not in name and name not in rows:
            problems.append(f"{PAGE}: {name} is no module")
        elif "<" not in name and uses != set(rows[name]) - set(BUILT_IN.get(name, [])):
            problems.append(f"{PAGE}: {name} depends on {' '.join(sorted(rows[name])) or 'nothing'}, the page has {' '.join(sorted(uses))}")
    return problems


def check(root):
    rows = read_rows(root)
    problems = check_rows(rows) + check_page(root, rows)
    allowed = {module: reached(rows, module) | {module} for module in rows}
    for path in sorted(root.rglob("*")):
        rel = path.relative_to(root).as_posix()
        if path.suffix not in (".cpp", ".hpp", ".cc") or not rel.startswith(tuple(r + "/" for r in ROOTS)):
            continue
        text = path.read_text()
        own = module_of(rows, rel)
        if own is None and not rel.startswith("tests/"):
            problems.append(f"{rel}: lies in no module: give its folder a weft_module() row")
        for target in INCLUDE.findall(text):
            if target.startswith(tuple(r + "/" for r in ROOTS)) and own is not None and module_of(rows, target) not in allowed[own]:
                problems.append(f"{rel}: may not include {target}: the row of {own} does not lead to it")
            if own in FORBIDDEN and target.startswith(FORBIDDEN[own]):
                problems.append(f"{rel}: may not include {target}: {own} compares signals, not what a classifier makes of them")
            if target.startswith("nlohmann/") and path.suffix == ".hpp" and target != "nlohmann/json_fwd.hpp":
                problems.append(f"{rel}: {target} belongs in .cpp files only, it is slow to compile")
        if CLOCK.search(text) and not rel.startswith(CLOCK_FILES):
            problems.append(f"{rel}: reads a clock or sleeps; take the time as an argument, only a Loop reads a clock")
    return problems


def selftest():
    rows = """
weft_module(drivers/api USES protocols/base)
weft_module(recipes RECURSE USES protocols/base)
weft_module(classifier/base USES protocols/base SYSTEM Eigen3::Eigen)
weft_module(classifier/features USES classifier/base)
weft_module(classifier/selection USES classifier/features)
weft_module(sim/plant RECURSE USES protocols/base)
weft_module(sim/devices USES sim/plant protocols/apt)
weft_module(sim/rig USES sim/devices drivers/api SYSTEM nlohmann_json::nlohmann_json)
weft_module(daemon/base/loop USES drivers/api)
weft_module(daemon/storage/recorder USES daemon/base/loop)
weft_module(daemon/campaign USES daemon/storage/recorder
            sim/rig)
weft_module(daemon/analysis/calibration USES classifier/base)
"""
    files = {
        "drivers/thorlabs_apt/a.cpp": ('#include "sim/plant/plant.hpp"', True),
        "drivers/thorlabs_apt/b.cpp": ('#include "protocols/apt/bodies.hpp"', False),
        "drivers/thorlabs_apt/c.cpp": ('#include "protocols/rdt/rdt.hpp"', True),
        "drivers/ati_digital/a.cpp": ('#include "protocols/modbus/rtu.hpp"', False),
        "sim/devices/a.cpp": ('#include "drivers/api/driver.hpp"', True),
        "sim/rig/a.cpp": ('#include "daemon/base/loop/virtual_loop.hpp"', True),
        "classifier/features/a.cpp": ('#include "recipes/engine/plan.hpp"', True),
        "classifier/features/b.cpp": ('#include "classifier/selection/selection.hpp"', True),  # upwards
        "classifier/selection/b.cpp": ('#include "classifier/base/matrix.hpp"', False),
        "recipes/engine/a.hpp": ("#include <nlohmann/json.hpp>", True),
        "recipes/engine/b.cpp": ("auto t = std::chrono::steady_clock::now();", True),
        "recipes/engine/c.cpp": ("using Clock = std::chrono::steady_clock;", True),
        "classifier/base/a.cpp": ("const auto began = std::clock();", True),
        "daemon/campaign/b.cpp": ("clock_gettime(CLOCK_MONOTONIC, &now);", True),
        "daemon/campaign/c.cpp": ("const auto began = loop_->now();", False),
        "daemon/campaign/a.cpp": ('#include "sim/rig/rig.hpp"', False),
        "daemon/campaign/d.cpp": ('#include "daemon/base/loop/loop.hpp"', False),
        "daemon/storage/recorder/a.cpp": ('#include "daemon/campaign/campaign.hpp"', True),  # upwards
        "daemon/analysis/calibration/a.cpp": ('#include "classifier/base/matrix.hpp"', True),  # forbidden, though its row leads there
        "daemon/new/a.cpp": ("", True),  # no row
        "protocols/base/a.hpp": ('#include "protocols/apt/bodies.hpp"', True),
    }
    table = "".join(f"| `{name}` | x | {', '.join(f'`{use}`' for use in uses)} |\n" for name, uses in
                    [("protocols/base", []), ("drivers/api", ["protocols/base"]), ("a/b", ["drivers/api"])])
    more = {  # rows, a page: refused
        ("weft_module(a/b USES drivers/api)", table): False,
        ("weft_module(a/b USES drivers/api)", table.replace("`drivers/api` |\n", " |\n")): True,
        ("weft_module(a/b USES drivers/api)\nweft_module(a/c)", table): True,
        ("weft_module(a/b USES drivers/api)", table + "| `a/d` | x | |\n"): True,
        ("weft_module(daemon/base/a USES daemon/storage/b)\nweft_module(daemon/storage/b)", ""): True,  # upwards
        ("weft_module(daemon/storage/a USES daemon/storage/b)\nweft_module(daemon/storage/b USES daemon/storage/a)", ""): True,  # a cycle
        ("weft_module(daemon/storage/a USES daemon/storage/b)\nweft_module(daemon/storage/b)", ""): False,
        ("weft_module(daemon/storage/a USES daemon/storage/b)", ""): True,  # no such module
    }

    def refused(files):
        with tempfile.TemporaryDirectory() as folder:
            for name, content in files.items():
                file = pathlib.Path(folder) / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(content + "\n")
            return bool(check(pathlib.Path(folder)))

    failures = [f"{name}: {line} should be {'refused' if bad else 'allowed'}" for name, (line, bad) in files.items()
                if refused({"CMakeLists.txt": rows, name: line}) != bad]
    for (text, page), bad in more.items():
        tree = {"CMakeLists.txt": "weft_module(drivers/api USES protocols/base)\n" + text} | ({PAGE: page} if page else {})
        if refused(tree) != bad:
            failures.append(f"{text!r} with {page!r} should be {'refused' if bad else 'allowed'}")
    return failures


problems = selftest() if sys.argv[1] == "--selftest" else check(pathlib.Path(sys.argv[1]))
print("\n".join(problems) or "includes, layers, clocks and heavy headers: in order")
sys.exit(1 if problems else 0)
