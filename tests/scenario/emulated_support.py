"""An emulated rig for scenario tests: a rig file with free ports, and weft-rig serving it."""
import contextlib
import json
import pathlib
import random
import re
import socket
import subprocess

from machine_pace import LATE_S, Lateness, skip_as_too_slow


# On a busy machine a port may wait longer than a sensor may be silent. A virtual machine does so too: its host accounts processor time in tenths of a
# second. When that is used up (for example by a build), even a sleeping thread of real-time priority 50 with locked memory is late by 100 ms. Then
# the guard's finding does not belong to the test, and the test is tried again. The lateness of the machine is measured: without lateness, the same
# finding in each attempt is a fault.
ATTEMPTS = 3


# A silent port: the code in output of --json, or `got` of the errors of drivers and guards in output for people.
SILENT = re.compile(r'"code": "timeout"|nothing (?:received|after)|no reading yet|\d s old')


def kept_waiting(printed):
    """The code or value in `printed` that stands for a silent port; empty if there is none."""
    found = SILENT.search(printed)
    return found[0] if found else ""


def tried(once):
    """Result of `once(attempt)`: a finished process, or one with further results. Repeats it if it failed with a silent port or a late machine. If it
    fails each time, the test is skipped if the machine was late; otherwise the finding is a failure."""
    was_late = False
    for attempt in range(ATTEMPTS):
        with Lateness() as late:
            found = once(attempt)
        ran = found[0] if isinstance(found, tuple) else found
        silence, is_late = kept_waiting(ran.stdout + ran.stderr), late.most_s() > LATE_S
        if ran.returncode == 0 or not (silence or is_late):
            return found
        was_late = was_late or is_late
        print(f"attempt {attempt + 1}: status {ran.returncode} ({silence or 'no port was silent'}), the machine was "
              f"{1e3 * late.most_s():.0f} ms late", flush=True)
    if not was_late:
        return found
    skip_as_too_slow(f"{ATTEMPTS} attempts")


def free_port(kind):
    with socket.socket(socket.AF_INET, kind) as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def free_run(count):
    """First of `count` neighbouring free TCP ports, below those that the system gives to other programs."""
    lowest = int(pathlib.Path("/proc/sys/net/ipv4/ip_local_port_range").read_text().split()[0])
    for _ in range(100):
        first = random.randrange(max(1024, lowest // 2), lowest - count)
        with contextlib.ExitStack() as held:
            try:
                for port in range(first, first + count):
                    held.enter_context(socket.socket()).bind(("127.0.0.1", port))
            except OSError:
                continue
        return first
    raise RuntimeError(f"no {count} neighbouring ports are free")


def rig_file(root, folder, over_tcp=False, **changes):
    """emulated17 with its ports in `folder`, or its stages and taxels on TCP. Returns the path and the document."""
    rig = json.loads((root / "sim/rigs/emulated17.json").read_text())
    rig["simulation"].update(fabrics=str(root / "sim/fabrics.json"), **changes)
    rig["simulation"]["console"]["port"] = free_port(socket.SOCK_STREAM)
    for device in rig["devices"]:
        link = device["link"]
        if link["kind"] == "udp":
            link["port"] = free_port(socket.SOCK_DGRAM)
        elif over_tcp:
            device["link"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
        else:
            link["path"] = str(folder / "ports" / device["name"])
    path = folder / ("tcp.json" if over_tcp else "emulated.json")
    path.write_text(json.dumps(rig, indent=1))
    return path, rig


def near_home(path, rig, plate_mm=(60, 60)):
    """Puts the fabric 16 mm from the home position of the stages, which otherwise spend most of the time on homing."""
    rig["plate"].update(surface_z_mm=16, size_mm=list(plate_mm))
    for device in rig["devices"]:
        if device["role"] in "xyz":
            device["emulator"]["start_mm"] = 4
    path.write_text(json.dumps(rig, indent=1))


PLATE_KG = 0.3
START_RX_DEG = 2.0  # large enough to distinguish a sine from noise


def digital_rig(root, folder, framing, link):
    """emulated17 with a Digital F/T sensor."""
    path, rig = rig_file(root, folder)
    for device in rig["devices"]:
        if device["role"] == "rx":
            device["emulator"]["start_deg"] = START_RX_DEG
        if device["role"] == "wrench":
            rate_hz = device["config"]["rate_hz"]
            for key in ("http", "also"):
                device.pop(key, None)
            device.update(driver="ati_digital", config={"rate_hz": rate_hz}, link=link,
                          emulator={"kind": "ati_digital", "framing": framing, "rate_hz": rate_hz,
                                    "plate_mass_kg": PLATE_KG})
    path.write_text(json.dumps(rig))
    return path, rig


class ServedRig:
    """Runs weft-rig during the block and sends orders to its console."""

    def __init__(self, program, path, rig, seed=1):
        self.command = [str(pathlib.Path(program).resolve()), str(path), "--seed", str(seed)]
        self.console = rig["simulation"]["console"]

    def __enter__(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines = []
        for line in self.process.stdout:
            self.lines.append(line.strip())
            if line.strip() == "ready":
                return self
        raise RuntimeError(f"weft-rig did not start: {self.process.stderr.read()}")

    def order(self, **order):
        with socket.create_connection((self.console["host"], self.console["port"]), timeout=10) as s:
            s.sendall(json.dumps(order).encode() + b"\n")
            return json.loads(s.makefile().readline())

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)
        self.process.stdout.close()
        self.process.stderr.close()
