"""Programs of a simulated bench for tests: weftd and weft-rig in temporary folders, never on a real rig. For weft_client.testing; needs no pytest."""
from __future__ import annotations

import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple, Union

from ._client import Client, connect
from ._errors import StateError
from ._run import End, Run
from ._watch import JsonObject

RigSource = Union[str, "os.PathLike[str]", Mapping[str, Any]]
Fault = Mapping[str, Any]

START_S = 60  # until a program is ready [s]
STOP_S = 30  # from SIGTERM to SIGKILL [s]; a running campaign retracts first
INJECT_PACE = 20  # bench seconds per wall second until the faults of a run are injected: at full speed the run could end before
LONGEST_SOCKET = 100  # bytes of a Unix socket's path; the kernel's limit is 107
_DAEMON_VARIABLES = ("WEFT_SOCKET", "WEFT_DAEMON", "WEFT_TOKEN", "WEFT_TLS_CA")
_PORT_KINDS = ("serial", "tcp", "udp")


class ProgramMissing(Exception):
    """A program of Weft is not installed. The text names the package."""


class RigRefused(ValueError):
    """The rig file is not one for tests: unreadable, real, or of another kind of bench than expected."""


def find_program(name: str) -> pathlib.Path:
    """Path of "weftd" or "weft-rig": in the folder WEFT_BIN if it is set, else on PATH. Errors: ProgramMissing if it is not on PATH;
    FileNotFoundError if WEFT_BIN is set and does not have it."""
    folder = os.environ.get("WEFT_BIN")
    if folder:
        path = pathlib.Path(folder, name).absolute()
        if not os.access(path, os.X_OK):
            raise FileNotFoundError(f"WEFT_BIN: no program {name} in {folder} (expected an executable file). Correct WEFT_BIN, or unset it to use PATH")
        return path
    found = shutil.which(name)
    if found is None:
        raise ProgramMissing(f"{name} is not on PATH. Install Debian's package {name} of Weft, or set WEFT_BIN to the folder of the programs")
    return pathlib.Path(found).absolute()


def find_rig(name: str, program: pathlib.Path) -> pathlib.Path:
    """File of a shipped rig such as "bench17", from the installation or build tree of `program`. Errors: RigRefused."""
    real = program.resolve()
    places = [prefix / "share/weft/sim/rigs" for prefix in (program.parent.parent, real.parent.parent)]
    places.extend(parent / "sim/rigs" for parent in list(real.parents)[2:3])
    for place in places:
        if (place / f"{name}.json").is_file():
            return place / f"{name}.json"
    raise RigRefused(f"rig: no shipped rig file {name}.json in {', '.join(map(str, places))}. Install Debian's package weft, or give a path that ends in .json")


def read_rig(source: RigSource, root: pathlib.Path, program: pathlib.Path) -> Tuple[Dict[str, Any], pathlib.Path]:
    """The rig document and the folder its paths are relative to. A source is a document, a path that ends in .json (relative to `root`), or the
    name of a shipped rig. Errors: RigRefused."""
    if isinstance(source, Mapping):
        return json.loads(json.dumps(source)), root
    text = os.fspath(source)
    path = root / text if text.endswith(".json") else find_rig(text, program)
    try:
        rig = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as problem:
        raise RigRefused(f"{path}: rig file not readable: {problem}") from problem
    if not isinstance(rig, dict):
        raise RigRefused(f"{path}: rig file is no JSON object. Write one as in docs/reference/rig-keys.md")
    return rig, path.parent


def isolate(rig: Dict[str, Any], base: pathlib.Path, bench: str, folder: pathlib.Path, faults: Iterable[Fault] = ()) -> Dict[str, Any]:
    """Changes `rig` so that nothing outside `folder` and 127.0.0.1 can be reached: each port gets a new place there. Adds `faults` to those of the
    file. Errors: RigRefused unless the file has this `bench`; a real one is never accepted."""
    found = rig.get("bench")
    if bench not in ("simulated", "emulated") or found != bench:
        raise RigRefused(f'/bench: not a rig for this test: {json.dumps(found)} (expected "{bench}"). Tests never use a real rig: give a rig file with '
                         f'"bench": "{bench}"')
    if not isinstance(rig.setdefault("simulation", {}), dict):
        raise RigRefused(f'/simulation: not an object: {json.dumps(rig["simulation"])} (expected an object). Remove the key')
    simulation = rig["simulation"]
    for key in ("fabrics", "fidelity"):
        if key in simulation:
            simulation[key] = str((base / simulation[key]).resolve())
    if "plugins" in rig:
        rig["plugins"] = [str((base / place).resolve()) for place in rig["plugins"]]
    with contextlib.ExitStack() as held:  # all at once, so that no port is given twice
        for device in rig.get("devices", []):
            link = device.get("link", {}).get("kind")
            if link not in ("memory", *_PORT_KINDS):
                raise RigRefused(f"/devices/{device.get('name')}/link/kind: unknown kind of port: {json.dumps(link)} (expected memory, serial, tcp or udp)")
            name = re.sub(r"[^\w.-]|^\.+", "_", str(device["name"]))  # a file name, whatever the rig file has
            for number, port in enumerate(_ports_of(device)):
                _move(port, folder / "ports" / (name if number == 0 else f"{name}.{number}"), held)
        if "console" in simulation:
            simulation["console"].update(host="127.0.0.1", port=_free_port(socket.SOCK_STREAM, held))
    if faults:
        simulation["faults"] = [*simulation.get("faults", []), *(dict(fault) for fault in faults)]
    return rig


def write_rig(path: pathlib.Path, rig: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(rig, indent=1), encoding="utf-8")


def _ports_of(value: Any) -> Iterator[Dict[str, Any]]:
    if isinstance(value, dict):
        if value.get("kind") in _PORT_KINDS:
            yield value
        for inner in value.values():
            yield from _ports_of(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _ports_of(inner)


def _move(port: Dict[str, Any], place: pathlib.Path, held: contextlib.ExitStack) -> None:
    if port["kind"] == "serial":
        port["path"] = str(place)
        return
    kind = socket.SOCK_DGRAM if port["kind"] == "udp" else socket.SOCK_STREAM
    port.update(host="127.0.0.1", port=_free_port(kind, held))
    if "local_port" in port:
        port["local_port"] = _free_port(kind, held)


def _free_port(kind: int, held: contextlib.ExitStack) -> int:
    bound = held.enter_context(socket.socket(socket.AF_INET, kind))
    bound.bind(("127.0.0.1", 0))
    return int(bound.getsockname()[1])


class Process:
    """A program in a process group of its own, with its output in a log file. The system ends it too if this process is killed (setpriv of
    util-linux, where it exists)."""

    def __init__(self, command: List[str], log: pathlib.Path, ready: str) -> None:
        """Returns when a line of the output matches `ready`. Errors: RuntimeError with the output, if it ends before or takes longer than START_S."""
        self.log = log
        setpriv = shutil.which("setpriv")
        with open(log, "wb") as output:
            self._process = subprocess.Popen([*([setpriv, "--pdeathsig", "TERM"] if setpriv else []), *command], stdin=subprocess.DEVNULL,
                                             stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        self.pid = self._process.pid
        try:
            self._wait_until(ready, pathlib.Path(command[0]).name)
        except BaseException:  # also Ctrl-C and the signal of a time limit
            self.stop()
            raise

    def _wait_until(self, ready: str, name: str) -> None:
        limit = time.monotonic() + START_S
        while not re.search(ready, self.text(), re.M):
            why = "ended" if self._has_ended() else f"not ready within {START_S} s" if time.monotonic() > limit else ""
            if why:
                raise RuntimeError(f"{name}: {why} (expected a line {ready!r}):\n{self.text()}")
            time.sleep(0.01)

    def text(self) -> str:
        return self.log.read_text(encoding="utf-8", errors="replace")

    def _has_ended(self) -> bool:
        """Leaves the process unreaped, so that its group cannot belong to another one."""
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None

    def stop(self) -> int:
        """Ends the program and all processes of its group. Returns its exit status, -9 if it had to be killed."""
        status = self._process.returncode
        if status is None:
            limit = time.monotonic() + STOP_S
            if not self._has_ended():
                os.kill(self.pid, signal.SIGTERM)
            while not self._has_ended() and time.monotonic() < limit:
                time.sleep(0.01)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
            status = self._process.wait()
        return int(status)


class WeftRig:
    """A running weft-rig: emulated devices on ports, in real time.

    rig_file  the file it serves, a copy with ports in a temporary folder
    ports     by name of the device: a serial path, or "127.0.0.1:PORT"
    console   host and port for orders, None if the rig file has none
    log       its output
    """

    def __init__(self, program: pathlib.Path, rig: Dict[str, Any], folder: pathlib.Path, seed: int = 1) -> None:
        self.rig_file = folder / "rig.json"
        write_rig(self.rig_file, rig)
        self.process = Process([str(program), str(self.rig_file), "--seed", str(seed)], folder / "weft-rig.log", r"^ready$")
        self.log = self.process.log
        places = re.findall(r"^  (\S+) on \S+ (\S+)$", self.process.text(), re.M)
        self.ports: Dict[str, str] = {}
        for name, place in places:
            self.ports.setdefault(name, place)  # the first is where the driver reaches it
        orders = self.ports.pop("orders", None)
        self.console: Optional[Tuple[str, int]] = (orders.rsplit(":", 1)[0], int(orders.rsplit(":", 1)[1])) if orders else None

    def order(self, **order: Any) -> JsonObject:
        """Sends an order to the console, such as order="truth", and returns its answer. Errors: OSError; RuntimeError without a console."""
        if self.console is None:
            raise RuntimeError(f"{self.rig_file}: no console. Add simulation.console to the rig file")
        with socket.create_connection(self.console, timeout=START_S) as wire:
            wire.sendall(json.dumps(order).encode() + b"\n")
            answer: JsonObject = json.loads(wire.makefile().readline())
            return answer

    def stop(self) -> int:
        return self.process.stop()


class Weftd:
    """A running weftd on a simulated or emulated rig, and a client of it.

    client       connected through the Unix socket, as admin
    socket       the Unix socket; also in `environment`
    data         folder of runs and journal
    recipes      folder of recipes, a copy: recipe.put changes no file of the repository
    log          output of the daemon
    rig_file     the rig file in use, a copy
    bench        "simulated" or "emulated"
    environment  variables for a program under test: those of this process, with the address of this daemon and no other
    """

    def __init__(self, program: pathlib.Path, rig_file: pathlib.Path, bench: str, recipes: pathlib.Path, folder: pathlib.Path, pace: float = 0) -> None:
        self.rig_file, self.bench, self._pace = rig_file, bench, pace
        self.data, self.recipes = folder / "data", folder / "recipes"
        shutil.copytree(recipes, self.recipes)
        self.socket = self.data / "weftd.sock"
        self._socket_folder: Optional[str] = None
        if len(os.fsencode(self.socket)) > LONGEST_SOCKET:
            self._socket_folder = tempfile.mkdtemp(prefix="weftd-", dir="/tmp")
            self.socket = pathlib.Path(self._socket_folder, "weftd.sock")
        try:
            self.process = Process([str(program), "--rig", str(rig_file), "--recipes", str(self.recipes), "--data", str(self.data), "--socket",
                                    str(self.socket), "--pace", str(pace)], folder / "weftd.log", r"^weftd: .*\bready\b")
            self.log = self.process.log
            try:
                self.client: Client = connect(self.socket, program="pytest")
            except BaseException:
                self.process.stop()
                raise
        except BaseException:
            self._remove_socket_folder()
            raise

    @property
    def environment(self) -> Dict[str, str]:
        return {**{name: value for name, value in os.environ.items() if name not in _DAEMON_VARIABLES}, "WEFT_SOCKET": str(self.socket)}

    def start(self, recipe: str, seed: Optional[int] = None, faults: Iterable[Fault] = ()) -> Run:
        """Starts a run and injects `faults` when its devices are armed. Errors: WeftError; StateError if it ended before."""
        slowed = bool(faults) and self.bench == "simulated"
        if slowed:
            self.client.api.sim.clock(pace=INJECT_PACE)
        try:
            with self.client.lease(note="pytest") as lease:
                run = self.client.start(recipe, lease, seed=seed)
                for fault in faults:
                    self.inject(run, **fault)
        finally:
            if slowed:
                self.client.api.sim.clock(pace=self._pace)
        return run

    def run(self, recipe: str, seed: Optional[int] = None, faults: Iterable[Fault] = (), timeout_s: float = 300) -> End:
        """As start(), and waits for the end. Errors: as start(); TimeoutError."""
        return self.start(recipe, seed, faults).wait(timeout_s)

    def inject(self, run: Run, device: str, fault: str, **parameters: Any) -> JsonObject:
        """Injects a fault into the run once its devices are armed; parameters as of sim.inject. Errors: WeftError; StateError if the run has ended."""
        while True:
            state = run.state()["state"]
            if state in ("ended", "interrupted"):
                raise StateError("run ended before the fault was injected", 3000, {
                    "kind": "state.conflict", "where": run.name, "got": state, "expected": "running",
                    "hint": "Give the fault to start(), or to the marker weftd, or set a pace"})
            if state not in ("queued", "arming"):
                return self.client.api.sim.inject(device=device, fault=fault, **parameters)
            time.sleep(0.005)

    def stop(self) -> int:
        """Ends the daemon; an active run is aborted. Returns its exit status."""
        try:
            self.client.close()
        finally:
            try:
                status = self.process.stop()
            finally:
                self._remove_socket_folder()
        return status

    def _remove_socket_folder(self) -> None:
        if self._socket_folder is not None:
            shutil.rmtree(self._socket_folder, ignore_errors=True)


@contextlib.contextmanager
def only_daemon(socket_path: pathlib.Path) -> Iterator[None]:
    """In the block, connect() without an address reaches this daemon and no other, also in programs that the block starts."""
    before = {name: os.environ.pop(name) for name in _DAEMON_VARIABLES if name in os.environ}
    os.environ["WEFT_SOCKET"] = str(socket_path)
    try:
        yield
    finally:
        for name in _DAEMON_VARIABLES:
            os.environ.pop(name, None)
        os.environ.update(before)
