#!/usr/bin/env python3
"""One wheel of the Python client with the oldest Python that it promises, this one, and the newest on the machine. Each installs it without packages and
runs the client's unit tests; then, with packages from PyPI at pinned versions (python_versions.txt), all checks of python_data.py and a run through the
pytest fixture.

    python_versions.py WEFTD WEFT SOURCE_ROOT FOLDER [--core]
        FOLDER has the virtual environments, and is made if it does not exist. --core: only the part without packages

Interpreters are python3.N on the PATH and those of pyenv. WEFT_PYTHONS replaces them: paths, separated by ":", all of which are run. The output names
the interpreters that were run, and the promised ones that were not found. Exit 77 (skipped) if PyPI cannot be reached or Debian's wheels are missing.
"""
import concurrent.futures
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

import client_wheel
import pypi_environment

WEFTD, WEFT = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
ROOT, FOLDER = pathlib.Path(sys.argv[3]).resolve(), pathlib.Path(sys.argv[4]).resolve()
PINS = pathlib.Path(__file__).with_suffix(".txt")
OLDEST, OWN, PINNED = (3, 9), tuple(sys.version_info[:2]), ((3, 9), (3, 11), (3, 13))
LIMIT_S = 300
TELL = "import platform, sys, venv, ensurepip; print(platform.python_implementation(), *sys.version_info[:2], sys.version.split()[0])"

FIXTURE = """
def test_a_run(weftd):
    run = weftd.start("small")
    assert run.wait().outcome == "complete"
    assert run.verify()["holds"]
"""
RECIPE = """{"schema_version": 1, "name": "small", "seed": 1, "fabrics": ["denim"], "repetitions": 2, "order": {"kind": "blocked"}, "hand_over": false,
 "explorations": {"M1": {"phases": [{"phase": "S", "duration_s": 1},
  {"phase": "P", "force_N": 5, "force_band_N": 0.25, "duration_s": 1},
  {"phase": "M", "force_N": 5, "force_band_N": 0.25, "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 2}]}, {"phase": "E", "duration_s": 1}]}}}"""


def version(python):
    """(3, N) and "3.N.M" of an interpreter of CPython that can make virtual environments; None of anything else."""
    try:
        told = subprocess.run([python, "-I", "-c", TELL], capture_output=True, text=True, timeout=30)
    except OSError:
        return None
    words = told.stdout.split()
    return ((int(words[1]), int(words[2])), words[3]) if told.returncode == 0 and words[0] == "CPython" else None


def found():
    """Newest interpreter of each minor version, by path."""
    places = [place for minor in range(OLDEST[1], 30) for place in [shutil.which(f"python3.{minor}")] if place]
    pyenv = pathlib.Path(os.environ.get("PYENV_ROOT", pathlib.Path.home() / ".pyenv")) / "versions"
    out = {}
    for python in [*places, *map(str, sorted(pyenv.glob("3.*/bin/python")))]:
        known = version(python)
        if known and known[0] >= OLDEST and known[0] != OWN and (known[0] not in out or newer(known[1], out[known[0]][1])):
            out[known[0]] = (python, known[1])
    return {**out, OWN: (sys.executable, "{}.{}.{}".format(*sys.version_info))}


def newer(a, b):
    return [int(n) for n in re.findall(r"\d+", a)] > [int(n) for n in re.findall(r"\d+", b)]


def chosen():
    """[(path, (3, N), "3.N.M")] to run, oldest first."""
    named = os.environ.get("WEFT_PYTHONS")
    if named:
        known = [(python, version(python)) for python in named.split(os.pathsep)]
        unfit = [python for python, of in known if of is None or of[0] < OLDEST]
        assert not unfit, f"WEFT_PYTHONS: {unfit}: no CPython from {OLDEST} on with venv"
        return sorted(((python, *of) for python, of in known), key=lambda each: each[1:])
    at = found()
    return [(at[v][0], v, at[v][1]) for v in sorted({min(at), OWN, max(at)})]


def run(*words, **more):
    ran = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=LIMIT_S, **more)
    assert ran.returncode == 0, f"{words}: {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
    return ran.stdout + ran.stderr


def without_packages(python, wheel, folder):
    """pip installs the wheel into a clean environment; the unit tests use that copy. Returns its site-packages and the number of tests."""
    run(python, "-m", "venv", folder)
    own = folder / "bin/python"
    run(own, "-m", "pip", "install", "--quiet", "--no-index", "--disable-pip-version-check", wheel)
    site = pathlib.Path(run(own, "-I", "-c", "import weft_client; print(weft_client.__file__)").strip()).parents[1]
    assert site.is_relative_to(folder) and (site / "weft_client/py.typed").is_file(), site
    tests = ROOT / "clients/python/tests"
    said = run(own, "-W", "error::DeprecationWarning", "-m", "unittest", "discover", "-s", tests, "-t", tests, cwd=folder)
    return site, int(re.search(r"^Ran (\d+) tests", said, re.M)[1])


def with_packages(python, site, folder):
    """The checks of the other scenarios with the installed client, and a run through the pytest fixture. Returns the number of checks."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("WEFT_", "PYTEST_", "PYTHONPATH"))}
    said = [run(python, ROOT / "tests/scenario" / name, WEFT, ROOT, python.parent.parent, env={**clean, "WEFT_CLIENT": str(site)})
            for name in ("python_data.py", "python_vibration.py")]
    (folder / "recipes").mkdir(parents=True)
    (folder / "recipes/small.json").write_text(RECIPE)
    (folder / "test_run.py").write_text(FIXTURE)
    told = run(python, "-m", "pytest", "-q", "-p", "no:cacheprovider", f"--basetemp={folder / 'tmp'}", "test_run.py", cwd=folder,
               env={**clean, "PYTHONPATH": str(site), "WEFT_BIN": str(WEFTD.parent)})
    assert re.search(r"^1 passed", told, re.M), told
    return sum(int(re.search(r"^(\d+) checks, 0 failed", each, re.M)[1]) for each in said)


def in_wheel(wheel):
    """Every source file and py.typed, for any Python 3 and system."""
    source = ROOT / "clients/python/src/weft_client"
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if name.startswith("weft_client/")}
        metadata = archive.read(next(name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))).decode()
    expected = {f"weft_client/{path.name}" for path in source.iterdir() if path.suffix == ".py" or path.name == "py.typed"}
    assert names == expected and "weft_client/py.typed" in names, names ^ expected
    assert wheel.name.endswith("-py3-none-any.whl") and "\nRequires-Python: >={}.{}\n".format(*OLDEST) in metadata, (wheel.name, metadata)


def main():
    reason = client_wheel.missing()
    if reason:
        pypi_environment.skip(reason)
    pythons = chosen()
    with tempfile.TemporaryDirectory(prefix="weft-versions-") as name, concurrent.futures.ThreadPoolExecutor(len(pythons)) as pool:
        folder = pathlib.Path(name).resolve()
        wheel = client_wheel.build(ROOT, folder)
        in_wheel(wheel)
        parts = [folder / f"{number}-{full}" for number, (_, _, full) in enumerate(pythons)]
        core = list(pool.map(lambda each, part: without_packages(each[0], wheel, part / "core"), pythons, parts))
        for (_, _, full), (_, tests) in zip(pythons, core):
            print(f"Python {full}: {tests} unit tests without packages")
        if sys.argv[5:] == ["--core"]:
            return
        sites = [(each, part, site) for each, part, (site, _) in zip(pythons, parts, core) if each[1] in PINNED]
        made = {own: pypi_environment.made(FOLDER / "python{}.{}".format(*own), PINS, base=path) for (path, own, _), _, _ in sites}
        checks = list(pool.map(lambda each: with_packages(made[each[0][1]], each[2], each[1] / "extras"), sites))
        for ((_, _, full), _, _), count in zip(sites, checks):
            print(f"Python {full}, SIMULATED: {count} checks and a run with packages")
        for _, own, full in pythons:
            if own not in PINNED:
                print(f"Python {full}: not run with packages, because {PINS.name} has no wheels for it")
    for minor in sorted({OLDEST, *PINNED} - {own for _, own, _ in pythons}):
        print("Python {}.{}: not run, because it is not {}".format(*minor, "in WEFT_PYTHONS" if os.environ.get("WEFT_PYTHONS") else "on this machine"))


if __name__ == "__main__":
    main()
