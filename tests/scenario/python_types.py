#!/usr/bin/env python3
"""Checks the types of the Python client with mypy's strict mode, at pinned versions from PyPI (python_types.txt): its sources for the oldest and the newest
Python, and against the types of bluesky, ophyd-async and pytest; then programs that use the installed wheel, with and without its py.typed.

    python_types.py SOURCE_ROOT FOLDER      FOLDER has the virtual environment, and is made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or Debian's wheels to build the client are missing.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

import client_wheel
import pypi_environment

ROOT, FOLDER = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
CLIENT = ROOT / "clients/python"
PINS = [pathlib.Path(__file__).with_name(name) for name in ("python_types.txt", "bluesky_rig.txt", "pytest_plugin.txt")]
OLDEST, NEWEST = "3.9", "3.13"
FINDING = re.compile(r"^(\S+?):(\d+): error: .*\[([\w-]+)\]$", re.M)

RIGHT = """
from typing import List, Optional
import weft_client

def outcomes(place: str, recipe: str) -> List[Optional[str]]:
    with weft_client.connect(place) as client, client.lease(note="types") as lease:
        run: weft_client.Run = client.start(recipe, lease, seed=3)
        end: weft_client.End = run.wait(timeout_s=60.0)
        check: weft_client.Check = client.check(recipe)
        return [end.outcome, check.digest]
"""
WRONG = """
import weft_client

client: int = weft_client.connect("weftd.sock")
weft_client.connect("weftd.sock").start(1, "lease")
weft_client.connect("weftd.sock").statr("first", "lease")
weft_client.connect("weftd.sock").api.sim.clock(speed=10)
"""
EXPECTED = [(4, "assignment"), (5, "arg-type"), (6, "attr-defined"), (7, "call-arg")]


def mypy(python, folder, *words):
    """Exit status, findings as (file, line, code), and the output."""
    ran = subprocess.run([python, "-m", "mypy", "--strict", "--no-error-summary", "--cache-dir", folder / "cache", *map(str, words)], cwd=folder,
                         capture_output=True, text=True, timeout=200)
    return ran.returncode, [(name, int(line), code) for name, line, code in FINDING.findall(ran.stdout)], ran.stdout + ran.stderr


def sources(python, folder):
    for version in OLDEST, NEWEST:
        status, _, text = mypy(python, folder, "--config-file", CLIENT / "pyproject.toml", "--python-version", version, CLIENT / "src")
        assert status == 0 and not text, f"sources for Python {version}:\n{text}"
    # Without the settings of pyproject.toml, which leave out the types of other packages. weft_client.bluesky needs 3.11.
    (folder / "all.toml").write_text("[tool.mypy]\nstrict = true\n")
    status, _, text = mypy(python, folder, "--config-file", folder / "all.toml", "--python-version", "3.11", CLIENT / "src")
    assert status == 0 and not text, f"sources with the types of their extras:\n{text}"
    # An extra without types would pass everything.
    (folder / "extras.py").write_text("import bluesky.plan_stubs\nimport ophyd_async.core\nimport pytest\n"
                                      "bluesky.plan_stubs.no\nophyd_async.core.AsyncStatus()\npytest.raises()\n")
    _, found, text = mypy(python, folder, "--config-file", folder / "all.toml", "extras.py")
    assert found == [("extras.py", 4, "attr-defined"), ("extras.py", 5, "call-arg"), ("extras.py", 6, "call-overload")], text


def programs(python, folder):
    """They use the wheel as pip installs it. Without py.typed mypy must not read its types."""
    subprocess.run([python, "-m", "venv", "--without-pip", folder / "user"], check=True, timeout=60)
    site, = (folder / "user").glob("lib/python3*/site-packages")
    with zipfile.ZipFile(client_wheel.build(ROOT, folder)) as wheel:
        wheel.extractall(site)
    (folder / "right.py").write_text(RIGHT)
    (folder / "wrong.py").write_text(WRONG)
    user = "--python-executable", folder / "user/bin/python", "--config-file", "/dev/null"
    status, found, text = mypy(python, folder, *user, "right.py")
    assert status == 0 and not found, f"a program that uses the wheel:\n{text}"
    status, found, text = mypy(python, folder, *user, "wrong.py")
    assert status == 1 and found == [("wrong.py", *each) for each in EXPECTED], f"{found}, not {EXPECTED}:\n{text}"
    (site / "weft_client/py.typed").unlink()
    status, found, text = mypy(python, folder, *user, "right.py")
    assert status == 1 and ("right.py", 3, "import-untyped") in found, f"without py.typed:\n{text}"


def main():
    reason = client_wheel.missing()
    if reason:
        pypi_environment.skip(reason)
    python = pypi_environment.made(FOLDER, *PINS)
    with tempfile.TemporaryDirectory(prefix="weft-types-") as name:
        folder = pathlib.Path(name).resolve()
        sources(python, folder)
        programs(python, folder)
    print(f"mypy strict: sources for Python {OLDEST}, 3.11 with the types of their extras, and {NEWEST}; programs that use the wheel")


if __name__ == "__main__":
    main()
