#!/usr/bin/env python3
"""The client's pytest plugin: the repository of docs/howto/ci.md is made from the page's blocks and its tests are run with pytest from PyPI
(pytest_plugin.txt); then tests that must fail, rigs that must be refused, missing programs, and pytest killed in a test. All simulated.

    pytest_plugin.py PROGRAMS SOURCE_ROOT FOLDER      PROGRAMS has weftd and weft-rig; FOLDER has the virtual environment, made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or Debian's wheels to install the client are missing.
"""
import fcntl
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import client_wheel
import pypi_environment

PROGRAMS, ROOT, FOLDER = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
LIMIT_S = 120
ENDED_S = 30  # from the end of pytest to that of its programs
FILE = re.compile(r"^<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", re.M | re.S)

FAILING = """
import pytest, weft_client

def test_that_fails_while_a_run_is_active(weftd):
    weftd.client.api.sim.clock(pace=10)
    run = weftd.start("two-fabrics")
    assert run.state()["state"] == "ended"

@pytest.mark.weftd(emulated=True)
def test_that_fails_on_ports(weftd, weft_rig):
    assert not weft_rig.ports

def test_that_passes_after_them(weftd):
    assert weft_client.connect().session != weftd.client.session
"""

REFUSED = """
import pytest
real = {"bench": "real", "devices": [{"name": "ft", "link": {"kind": "memory"}}]}

@pytest.mark.weftd(rig=real)
def test_real_under_the_daemon(weftd): pass

@pytest.mark.weftd(rig=real, emulated=True)
def test_real_on_ports(weftd): pass

@pytest.mark.weftd(rig=real)
def test_real_rig(weft_rig): pass

@pytest.mark.weftd(rig={"devices": []})
def test_without_a_kind(weftd): pass

@pytest.mark.weftd(rig="emulated17")
def test_emulated_as_simulated(weftd): pass

@pytest.mark.weftd(rigs="bench17")
def test_unknown_option(weftd): pass

@pytest.mark.weftd(recipes="nowhere")
def test_without_recipes(weftd): pass
"""

WAITING = """
import pathlib, time

def test_that_is_killed(weftd, weft_rig):
    pathlib.Path("pids").write_text(f"{weftd.process.pid} {weft_rig.process.pid}")
    time.sleep(600)
"""


def install(python, folder):
    """As `pip install 'clients/python[test]'`, without a registry: pytest is there."""
    shutil.copytree(ROOT / "clients/python", folder / "client", ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__"))
    offline = {**os.environ, **client_wheel.OFFLINE}
    for words in ["uninstall", "--yes", "weft-client"], ["install", f"{folder / 'client'}[test]"]:
        ran = subprocess.run([python, "-m", "pip", "--quiet", *words], env=offline, capture_output=True, text=True, timeout=LIMIT_S)
        assert ran.returncode == 0, f"pip {words}:\n{ran.stdout}{ran.stderr}"


def write_layout(folder):
    """The files of the page, and no others."""
    files = dict(FILE.findall((ROOT / "docs/howto/ci.md").read_text()))
    assert sorted(files) == ["pyproject.toml", "recipes/two-fabrics.json", "scripts/record.py", "tests/test_recipe.py"], sorted(files)
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return files


class Laboratory:
    """The repository of the page in `folder`; pytest runs in it with temporary files in folder/tmp."""

    def __init__(self, python, folder):
        self.python, self.folder, self.tmp = python, folder, folder / "tmp"
        self.tmp.mkdir()

    def command(self, *words):
        return [self.python, "-m", "pytest", "-q", f"--basetemp={self.tmp / 'pytest'}", "--junitxml=report.xml", "-p", "no:cacheprovider", *words]

    def environment(self, **more):
        clean = {k: v for k, v in os.environ.items() if not k.startswith(("WEFT_", "PYTEST_", "PYTHONPATH"))}
        return {**clean, "PYTHONDONTWRITEBYTECODE": "1", "WEFT_BIN": str(PROGRAMS), **more}

    def pytest(self, status, passed, failed=0, errors=0, skipped=0, text=None, environment=None):
        """Runs the page's tests, or those of `text`, and compares status and counts. Returns the output; no process may remain."""
        words = []
        if text is not None:
            (self.folder / "more").mkdir(exist_ok=True)
            (self.folder / "more/test_more.py").write_text(text)
            words = ["more"]
        began = time.monotonic()
        ran = subprocess.run(self.command(*words), cwd=self.folder, env=environment or self.environment(), capture_output=True, text=True, timeout=LIMIT_S)
        suite = xml.etree.ElementTree.parse(self.folder / "report.xml").getroot().find("testsuite")
        found = {name: int(suite.get(name)) for name in ("tests", "failures", "errors", "skipped")}
        expected = {"tests": passed + failed + errors + skipped, "failures": failed, "errors": errors, "skipped": skipped}
        assert (ran.returncode, found) == (status, expected), f"{ran.returncode} {found} (expected {status} {expected})\n{ran.stdout}{ran.stderr}"
        assert not self.processes(), self.processes()
        print(f"SIMULATED pytest: {passed} passed, {failed} failed, {errors} refused, {skipped} skipped in {time.monotonic() - began:.1f} s")
        return ran.stdout

    def processes(self):
        """Programs that have a file of this folder in their command."""
        found = {}
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                command = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            if os.fsencode(self.tmp) in command:
                found[int(entry.name)] = command
        return found


def killed(lab):
    """SIGKILL leaves pytest no time to end the programs; the system ends them."""
    (lab.folder / "more/test_more.py").write_text(WAITING)
    pids = lab.folder / "pids"
    running = subprocess.Popen(lab.command("more"), cwd=lab.folder, env=lab.environment(), stdout=subprocess.DEVNULL)
    limit = time.monotonic() + LIMIT_S
    while not (pids.exists() and len(pids.read_text().split()) == 2):
        assert running.poll() is None and time.monotonic() < limit, "the test never began"
        time.sleep(0.02)
    assert {int(pid) for pid in pids.read_text().split()} <= set(lab.processes()), (pids.read_text(), lab.processes())
    running.send_signal(signal.SIGKILL)
    running.wait(LIMIT_S)
    limit = time.monotonic() + ENDED_S
    while lab.processes() and time.monotonic() < limit:
        time.sleep(0.02)
    left = lab.processes()
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert not left, left


def missing_programs(lab, empty):
    """Skipped where they are not on PATH, with the package's name; an error where WEFT_BIN does not have them."""
    elsewhere = lab.environment(PATH=str(empty))
    del elsewhere["WEFT_BIN"]
    lab.pytest(0, 0, skipped=5, environment=elsewhere)
    reasons = {case.find("skipped").get("message") for case in xml.etree.ElementTree.parse(lab.folder / "report.xml").iter("testcase")}
    assert all("package weftd" in reason and "WEFT_BIN" in reason for reason in reasons), reasons
    lab.pytest(1, 0, errors=5, environment=lab.environment(WEFT_BIN=str(empty)))
    on_path = lab.environment(PATH=f"{PROGRAMS}:{os.environ['PATH']}")
    del on_path["WEFT_BIN"]
    lab.pytest(0, 5, environment=on_path)


def scenes(python, folder):
    install(python, folder)
    lab = Laboratory(python, folder)
    files = write_layout(folder)
    lab.pytest(0, 5)
    log = lab.pytest(1, 1, failed=2, text=FAILING)
    assert "submitted R-000001" in log and "SIMULATED rig emulated17" in log, log
    lab.pytest(1, 0, errors=7, text=REFUSED)
    logs = list(lab.tmp.rglob("*.log"))
    assert not logs, f"a refused rig was started: {logs}"
    missing_programs(lab, lab.tmp)
    # The page's tests notice a script that reports success whatever happened.
    (folder / "scripts/record.py").write_text(files["scripts/record.py"].replace("else 1", "else 0"))
    lab.pytest(1, 4, failed=1)
    killed(lab)


def main():
    reason = client_wheel.missing()
    if reason:
        pypi_environment.skip(reason)
    python = pypi_environment.made(FOLDER, pathlib.Path(__file__).with_suffix(".txt"))
    with open(f"{FOLDER}.lock", "w") as lock, tempfile.TemporaryDirectory(prefix="weft-pytest-") as folder:
        fcntl.flock(lock, fcntl.LOCK_EX)  # the client is installed anew each time
        scenes(python, pathlib.Path(folder).resolve())


if __name__ == "__main__":
    main()
