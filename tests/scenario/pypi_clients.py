#!/usr/bin/env python3
"""Third-party programs, from PyPI at pinned versions (pypi_clients.txt) and unmodified, drive the emulated bench: pylablib and thorlabs-apt-device
two stages each at the same time, NetFT the force sensor, pymodbus a Digital F/T sensor. Their readings are compared with weft-rig's own truth and the
document's figures.

    pypi_clients.py WEFT_RIG SOURCE_ROOT FOLDER      FOLDER has their virtual environment, and is made if it does not exist

Exit 77 (skipped) if PyPI cannot be reached or is too slow.
"""
import concurrent.futures
import json
import math
import pathlib
import random
import socket
import sys
import tempfile
import time
import urllib.request
import xml.etree.ElementTree

import pypi_environment

if __name__ == "__main__":
    pypi_environment.enter(sys.argv[3], pathlib.Path(__file__).with_suffix(".txt"))

from NetFT import Sensor

from cli_support import Checks
from digital_ft import GRAVITY
from emulated_support import PLATE_KG, ServedRig, free_port, near_home, rig_file
from pypi_registers import digital
from pypi_stages import ARRIVED_S, LTS, PRM, Place, Pylablib, ThorlabsAptDevice, kdc, lts, pylablib_motor, until

FORCE_N, ONE_N = 0.02, 0.1  # for the mean of 100 readings, and for one
SURFACE_MM, PRESS_N = 16, 3


def mean(sensor, count, per_n, per_nm):
    """Mean of `count` records, in N and N m."""
    sums = [0] * 6
    sensor.getMeasurements(count)
    for _ in range(count):
        sums = [total + value for total, value in zip(sums, sensor.receive())]
    return [total / count / (per_n if i < 3 else per_nm) for i, total in enumerate(sums)]


def force_sensor(t, served, place, page, z_port, angle_deg):
    """Its page's units, one reading, a stream, a press by the z stage, and bias. The plate is tilted by `angle_deg`."""
    with urllib.request.urlopen(f"http://127.0.0.1:{page}/netftapi2.xml", timeout=5) as reply:
        told = xml.etree.ElementTree.fromstring(reply.read())
    units = [int(told.find(tag).text) for tag in ("cfgcpf", "cfgcpt")]
    sensor = Sensor(place)
    sensor.sock.settimeout(5)
    weight_n, angle = PLATE_KG * GRAVITY, math.radians(angle_deg)
    expected = [0, -weight_n * math.sin(angle), weight_n * math.cos(angle)]
    one = [counts / units[0] for counts in sensor.getForce()]
    t.expect(all(abs(a - b) < ONE_N for a, b in zip(one, expected)), f"NetFT: one reading {one} N for {expected} N")
    many = mean(sensor, 100, *units)
    print(f"SIMULATED NetFT, plate at {angle_deg} deg: Fx Fy Fz " + " ".join(f"{v:.4f}" for v in many[:3]) + f" N for {expected}")
    t.expect(all(abs(a - b) < FORCE_N for a, b in zip(many, expected)), f"NetFT: {many} N for {expected} N")
    sensor.startStreaming()
    readings = set()
    until(lambda: readings.add(tuple(sensor.measurement())) or len(readings) >= 20, "NetFT: a stream of new readings", 5)
    sensor.stopStreaming()
    sensor.thread.join(6)
    drain(sensor)
    press(t, served, sensor, units, z_port, expected)
    sensor.send(0x42)  # the bias of the box; tare() below is this program's own
    time.sleep(0.1)
    zero = mean(sensor, 100, *units)  # the bias comes from one reading with its noise
    t.expect(all(abs(v) < ONE_N for v in zero[:3]) and all(abs(v) < ONE_N / 50 for v in zero[3:]), f"NetFT: biased {zero}")
    sensor.tare(100)
    tared = mean(sensor, 100, *units)
    t.expect(all(abs(v) < FORCE_N for v in tared[:3]), f"NetFT: tared {tared}")
    sensor.sock.close()


def drain(sensor):
    sensor.sock.settimeout(0.2)
    try:
        while True:
            sensor.receive()
    except (TimeoutError, socket.timeout):
        sensor.sock.settimeout(5)


def press(t, served, sensor, units, z_port, unloaded):
    """pylablib lowers the z stage onto a patch of denim; NetFT must read the true contact force."""
    assert served.order(order="mount", fabric="denim", patch_seed=7)["ok"]
    motor = pylablib_motor(z_port, LTS)
    motor.home(timeout=ARRIVED_S)
    truth_n, mm = 0, SURFACE_MM - 3
    while truth_n < PRESS_N and mm < SURFACE_MM + 3:
        mm += 0.1
        motor.move_to(mm)
        motor.wait_move(timeout=ARRIVED_S)
        truth_n = served.order(order="truth")["contact_force_n"]
    time.sleep(0.5)  # the fabric relaxes: the contact force falls during the reading
    before_n = served.order(order="truth")["contact_force_n"]
    read_n = mean(sensor, 100, *units)[2] - unloaded[2]
    after_n = served.order(order="truth")["contact_force_n"]
    print(f"SIMULATED NetFT under a press by pylablib: {read_n:.4f} N, in truth {before_n:.4f} to {after_n:.4f} N")
    t.expect(PRESS_N * 0.8 < after_n < 2 * PRESS_N, f"{after_n} N at z {mm} mm")
    t.expect(after_n - FORCE_N < read_n < before_n + FORCE_N, f"NetFT: {read_n} N under {before_n} to {after_n} N")
    motor.move_to(0)
    motor.wait_move(timeout=ARRIVED_S)
    motor.close()
    t.expect(served.order(order="truth")["contact_force_n"] == 0, "lifted off")


def bench(root, folder):
    """emulated17 near its home positions, its denim 16 mm from that of z, with TCP beside the terminals, and a box at its own address, because NetFT
    uses only a box's port."""
    path, rig = rig_file(root, folder)
    near_home(path, rig)
    devices = {device["name"]: device for device in rig["devices"]}
    for name in ("stage.x", "stage.rx", "stage.z"):
        devices[name]["also"] = [{"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}]
    devices["ft"]["link"].update(host=".".join(["127", *(str(random.randint(1, 254)) for _ in range(3))]), port=49152)
    devices["ft"]["http"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
    path.write_text(json.dumps(rig))
    return path, rig, devices


def stages_and_box(t, program, root):
    with tempfile.TemporaryDirectory() as folder:
        path, rig, devices = bench(root, pathlib.Path(folder))
        ports = {name: device["also"][0]["port"] for name, device in devices.items() if "also" in device}
        terminal = {name: device["link"].get("path") for name, device in devices.items()}
        with ServedRig(program, path, rig) as served:
            x, y, tilt = (Place(t, served, axis) for axis in (0, 1, None))
            # Direction 2, pylablib's "+", is backward on an LTS150 and forward on a KDC101.
            together(Pylablib(t, x, ports["stage.x"], (45000001, "LTS150"), LTS, -1).run,
                     Pylablib(t, tilt, ports["stage.rx"], (27000004, "KDC101"), PRM, 1).run,
                     ThorlabsAptDevice(t, y, lts, terminal["stage.y"], LTS).run,
                     ThorlabsAptDevice(t, tilt, kdc, terminal["stage.ry"], PRM).run)
            box = devices["ft"]
            force_sensor(t, served, box["link"]["host"], box["http"]["port"], ports["stage.z"], Pylablib.LAST)


def together(*parts):
    with concurrent.futures.ThreadPoolExecutor(len(parts)) as pool:
        for future in [pool.submit(part) for part in parts]:
            future.result()


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    t = Checks(program)
    together(lambda: stages_and_box(t, program, root), *(lambda f=framing: digital(t, program, root, f) for framing in ("tcp", "rtu")))
    t.finish()


if __name__ == "__main__":
    main()
