"""pytest plugin: a weftd on a simulated rig, and emulated devices, for the tests of a laboratory's scripts. Needs the extra `test`.

pytest loads it by itself where weft-client is installed. All of it is SIMULATED: a rig file with "bench": "real" is refused, and every port is moved
to the temporary folder of the test or to 127.0.0.1.

    @pytest.mark.weftd(recipes="recipes", faults=[{"device": "ft", "fault": "silent", "start_s": 10}])
    def test_a_silent_sensor(weftd):
        assert weftd.run("mine").outcome == "failed"

Options of the marker; a module's `pytestmark` gives defaults:

    rig       name of a shipped rig, path that ends in .json (relative to pytest's root folder), or a document; "bench17", emulated "emulated17"
    recipes   folder, relative to pytest's root folder; "recipes"
    pace      bench seconds per wall second, 0: as fast as possible (simulated rig only); 0
    emulated  True: the daemon reaches the devices of weft-rig through ports, in real time; False
    faults    added to simulation.faults of the rig file: active from `start_s` of the bench's clock [s]. Same seed, same result; ()

Programs are those of PATH, or of the folder WEFT_BIN. Tests are skipped if one is not on PATH; they fail if WEFT_BIN does not have it.
"""
from __future__ import annotations

import pathlib
from dataclasses import dataclass, fields
from typing import Any, Dict, Iterator, Optional, Sequence

try:
    import pytest
except ImportError as missing:
    raise ImportError("weft_client.testing needs pytest: pip install 'weft-client[test]'") from missing

from ._simulated import Fault, Process, ProgramMissing, RigRefused, RigSource, Weftd, WeftRig, find_program, isolate, only_daemon, read_rig, write_rig

__all__ = ["ProgramMissing", "RigRefused", "WeftRig", "Weftd", "weft_rig", "weftd"]

LOG_LINES = 40  # of a program's log in the report of a failed test


@dataclass(frozen=True)
class Options:
    rig: Optional[RigSource] = None
    recipes: str = "recipes"
    pace: float = 0
    emulated: bool = False
    faults: Sequence[Fault] = ()


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "weftd(rig, recipes, pace, emulated, faults): SIMULATED rig of the fixtures weftd and weft_rig (weft_client.testing)")


def options_of(request: pytest.FixtureRequest) -> Options:
    """Options of all markers `weftd` of a test; the nearest one has precedence. Errors: TypeError for an unknown option."""
    given: Dict[str, Any] = {}
    for marker in reversed(list(request.node.iter_markers("weftd"))):
        if marker.args:
            raise TypeError(f"pytest.mark.weftd: positional arguments {marker.args} (expected named options)")
        given.update(marker.kwargs)
    known = [field.name for field in fields(Options)]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise TypeError(f"pytest.mark.weftd: unknown options {', '.join(unknown)} (expected {', '.join(known)})")
    return Options(**given)


def program_or_skip(name: str) -> pathlib.Path:
    try:
        return find_program(name)
    except ProgramMissing as missing:
        raise pytest.skip.Exception(str(missing)) from None


def print_log(process: Process) -> None:
    """pytest shows it with a failed test."""
    print(f"SIMULATED {process.log}:", *process.text().splitlines()[-LOG_LINES:], sep="\n")


@pytest.fixture
def weft_rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[WeftRig]:
    """Emulated devices on ports, in real time. Takes `rig` and `faults` of the marker. Errors: RigRefused if the rig file is not an emulated one."""
    options, program = options_of(request), program_or_skip("weft-rig")
    rig, base = read_rig(options.rig or "emulated17", request.config.rootpath, program)
    folder = tmp_path_factory.mktemp("weft-rig")
    served = WeftRig(program, isolate(rig, base, "emulated", folder, options.faults), folder)
    try:
        yield served
    finally:
        served.stop()
        print_log(served.process)


@pytest.fixture
def weftd(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Weftd]:
    """A daemon on a simulated rig, or with `emulated` on that of weft_rig, which the test may then use too. WEFT_SOCKET is its address during the test.
    Errors: RigRefused; FileNotFoundError without the folder of recipes."""
    options, program = options_of(request), program_or_skip("weftd")
    recipes = request.config.rootpath / options.recipes
    if not recipes.is_dir():
        raise FileNotFoundError(f"{recipes}: no folder of recipes. Set the option recipes of pytest.mark.weftd, relative to {request.config.rootpath}")
    folder = tmp_path_factory.mktemp("weftd")
    if options.emulated:
        rig_file = request.getfixturevalue("weft_rig").rig_file
    else:
        rig, base = read_rig(options.rig or "bench17", request.config.rootpath, program)
        rig_file = folder / "rig.json"
        write_rig(rig_file, isolate(rig, base, "simulated", folder, options.faults))
    daemon = Weftd(program, rig_file, "emulated" if options.emulated else "simulated", recipes, folder, options.pace)
    try:
        with only_daemon(daemon.socket):
            yield daemon
    finally:
        daemon.stop()
        print_log(daemon.process)
