#!/usr/bin/env python3
"""`weft init`: rig files of the simulated shapes, and of devices found behind weft-rig's ports; then check, doctor and run with them.

    init.py WEFT WEFT_RIG SOURCE_ROOT simulated|ports
"""
import csv
import fcntl
import json
import os
import pathlib
import pty
import re
import select
import socket
import struct
import subprocess
import sys
import tempfile
import tty
from concurrent.futures import ThreadPoolExecutor

from cli_support import Checks
from emulated_support import ServedRig, digital_rig, free_run, near_home, rig_file, tried

WEFT, WEFT_RIG, ROOT = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
FIVE, THREE, TWO = ["x", "y", "z", "rx", "ry"], ["x", "y", "z"], ["x", "z"]
# Axes with a stage, driver of the force sensor, taxels and rate of each array.
SHAPES = {
    "5dof": (FIVE, "ati_netft", [(16, 37)]), "xyz": (THREE, "ati_netft", [(16, 37)]), "xz": (TWO, "ati_netft", [(16, 37)]),
    "digital": (FIVE, "ati_digital", [(16, 37)]), "taxels32": (FIVE, "ati_netft", [(32, 100)]), "no-force-sensor": (THREE, None, [(16, 37)]),
    "two-arrays": (THREE, "ati_netft", [(16, 37), (6, 50)]),
}
RUN_SHAPES = ("two-arrays", "no-force-sensor")  # other_rigs.py runs others
# Near the home positions of the stages, because time is real.
PLATE = {"surface_z_mm": 8, "plate_x_mm": 30, "plate_y_mm": 30, "clearance_mm": 4, "speed_mm_s": 20}
# Values without a default on a real bench.
MEASURED = {"probe_mass_kg": 0.2, "force_cap_n": 6, "torque_cap_nm": 2}
STAGES = {"x": "45000001", "y": "45000002", "z": "45000003", "rx": "27000004", "ry": "27000005"}


def devices_of(path):
    return {device["role"]: device for device in json.loads(pathlib.Path(path).read_text())["devices"]}


def short(recipe, folder):
    """Two trials of a recipe of the library."""
    made = json.loads(pathlib.Path(recipe).read_text())
    made.update(fabrics=made["fabrics"][:2], repetitions=1)
    del made["hand_over"]
    (folder / "short.json").write_text(json.dumps(made))
    return folder / "short.json"


def simulated(t, folder):
    """Each shape has its description and no problems; two of them also run a campaign in virtual time."""
    for shape, (axes, wrench, arrays) in SHAPES.items():
        path, out = folder / f"{shape}.json", folder / f"out-{shape}"
        wrote = json.loads(t.run("init", path, "--simulated", shape, "--json", cwd=ROOT).stdout)
        devices = devices_of(path)
        t.expect([role for role in FIVE if role in devices] == axes, f"{shape}: stages {list(devices)}")
        t.expect(devices.get("wrench", {}).get("driver") == wrench, f"{shape}: force sensor {devices.get('wrench')}")
        of = [device["config"] for device in json.loads(path.read_text())["devices"] if device["role"] == "taxels"]
        t.expect([(one.get("taxels", one.get("rows", 0) * one.get("cols", 0)), one["rate_hz"]) for one in of] == arrays, f"{shape}: {of}")
        checked = t.run("check", ROOT / wrote["recipe"], "--rig", path, cwd=folder)
        t.expect(checked.returncode == 0, f"{shape}: the recipe that is suggested {checked.stderr}")
        report = json.loads(t.run("doctor", "--rig", path, "--json", cwd=folder).stdout)
        t.expect(report["problems"] == 0 and report["warnings"] == 0, f"{shape}: doctor {report['findings']}")
        if shape not in RUN_SHAPES:
            continue
        ran = t.run("run", short(ROOT / wrote["recipe"], folder), "--rig", path, "--out", out, "--no-evaluate", cwd=folder)
        t.expect(ran.returncode == 0, f"{shape}: run {ran.stderr[-500:]}")
        if ran.returncode == 0:
            info, taxels = t.succeeds("dataset", "info", out / "dataset.h5", cwd=folder), sum(count for count, _ in arrays)
            t.expect(info["trials"] == 2 and info["bench"] == "simulated" and info["taxels"] == taxels, f"{shape}: data set {info}")
    t.refuses("init", folder / "new.json", "--simulated", "6dof", cwd=folder, code="not found", where=["6dof"], expected=["5dof", "no-force-sensor"])
    t.refuses("init", folder / "5dof.json", "--simulated", "xyz", cwd=folder, code="wrong state", where=str(folder / "5dof.json"))


def recipe(folder):
    """One trial, as short as possible."""
    phases = [{"phase": "S", "duration_s": 0.5}, {"phase": "P", "duration_s": 1, "force_N": 5},
              {"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 2}]}, {"phase": "E", "duration_s": 0.5}]
    (folder / "small.json").write_text(json.dumps({
        "schema_version": 1, "name": "small", "seed": 3, "fabrics": ["denim"], "repetitions": 1, "approach": {"speed_mm_s": 4},
        "explorations": {"M1": {"phases": phases}}}))
    return folder / "small.json"


def stated(option, pairs):
    return [word for name, value in pairs.items() for word in (option, f"{name}={value}")]


def numbers():
    return stated("--set", PLATE)


def roles():
    return stated("--role", {serial: role for role, serial in STAGES.items()})


def positions(rig):
    """Position of each stage in counts, requested from the stage: MOT_REQ_POSCOUNTER."""
    out = {}
    for device in rig["devices"]:
        if device["role"] in FIVE:
            with open(os.open(device["link"]["path"], os.O_RDWR | os.O_NOCTTY), "rb+", buffering=0) as port:
                tty.setraw(port)
                port.write(bytes([0x11, 0x04, 0x01, 0x00, 0x50, 0x01]))
                reply = b""
                while len(reply) < 12 and select.select([port], [], [], 5)[0]:
                    reply += port.read(12 - len(reply))
            out[device["role"]] = struct.unpack("<HHBBHi", reply)[-1]
    return out


def offered(rig):
    """Ports of weft-rig as options; the force sensor is a box or on a port."""
    words = []
    for link in (device["link"] for device in rig["devices"]):
        words += ["--netft", "{host}:{port}".format(**link)] if link["kind"] == "udp" else ["--port", link["path"]]
    return words


def console_of(rig):
    return ["--emulated", "127.0.0.1:{port}".format(**rig["simulation"]["console"])]


def found_right(t, path, wrench):
    """Roles by serial number, rates as in weft-rig's rig file."""
    devices = devices_of(path)
    t.expect({role: str(devices[role]["config"]["serial"]) for role in STAGES} == STAGES, f"stages by serial number: {devices}")
    t.expect([devices[role]["config"]["stage"] for role in FIVE] == 3 * ["LTS150"] + 2 * ["PRM1-Z8"], f"stages: {devices}")
    t.expect((devices["wrench"]["driver"], devices["wrench"]["config"]["rate_hz"]) == (wrench, 500), f"sensor: {devices['wrench']}")
    of = devices["taxels"]["config"]
    t.expect((of["taxels"], of["rate_hz"]) == (16, 37), f"taxels: {of}")


def looked_over(t, folder, path, small):
    checked = t.run("check", small, "--rig", path, cwd=folder)
    t.expect(checked.returncode == 0, f"check: {checked.stderr}")
    report = json.loads(t.run("doctor", "--rig", path, "--listen", 1, "--json", cwd=folder).stdout)
    t.expect(report["problems"] == 0, f"doctor: {report['findings']}")
    rates = {device["role"]: device.get("rate_hz", 0) for device in report["devices"]}
    t.expect(abs(rates["wrench"] / 500 - 1) < 0.05 and abs(rates["taxels"] / 37 - 1) < 0.05, f"rates: {rates}")


def pressed(t, folder, out):
    """The recorded campaign is complete and verified, and has the press."""
    t.succeeds("verify", out, cwd=folder)
    t.succeeds("features", out / "dataset.h5", "-o", folder / "features.csv", cwd=folder)
    rows = list(csv.DictReader((folder / "features.csv").open()))
    t.expect(len(rows) == 1 and all(abs(float(row["diff.SP"])) > 5 for row in rows), f"the press: {rows[:1]}")


def at_home(path, rig):
    """The plate as in PLATE, the stages a millimetre from home."""
    near_home(path, rig, (PLATE["plate_x_mm"], PLATE["plate_y_mm"]))
    rig["plate"]["surface_z_mm"] = PLATE["surface_z_mm"]
    for device in rig["devices"]:
        if device["role"] in "xyz":
            device["emulator"]["start_mm"] = 1
    path.write_text(json.dumps(rig, indent=1))


def emulated(t, folder):
    """Acceptance: weft-rig's ports are offered, and a campaign runs with the file that was written."""
    path, rig = rig_file(ROOT, folder)
    at_home(path, rig)
    small, made = recipe(folder), folder / "made.json"

    def once(attempt):
        out = folder / f"out{attempt}"
        with ServedRig(WEFT_RIG, path, rig) as served:
            if attempt == 0:
                before = positions(rig)
                t.refuses("init", made, *console_of(rig), *offered(rig), cwd=folder, code="unsupported", says=["--yes"])
                t.succeeds_once("init", made, *console_of(rig), *offered(rig), *numbers(), "--yes", "--json", cwd=ROOT)
                t.expect(positions(rig) == before, f"nothing moves: {before} {positions(rig)}")
                found_right(t, made, "ati_netft")
                looked_over(t, folder, made, small)
            ran = t.run("run", small, "--rig", made, "--out", out, "--yes", "--no-evaluate", cwd=folder)
            truth = served.order(order="truth")
            t.expect(truth["contact_force_n"] == 0, f"the probe is off the cloth in the end: {truth}")
        if ran.returncode == 0:
            pressed(t, folder, out)
        return ran

    ran = tried(once)
    t.expect(ran.returncode == 0, f"the run: {ran.stdout[-300:]} {ran.stderr[-500:]}")


def in_use(t, folder, rig):
    """A port of another program is not touched, and its holder is named."""
    held = next(device["link"]["path"] for device in rig["devices"] if device["role"] == "x")
    with open(held, "rb+", buffering=0) as port:
        fcntl.flock(port, fcntl.LOCK_EX)
        ran = t.run("init", folder / "held.json", *console_of(rig), *offered(rig), "--yes", "--json", cwd=ROOT)
    error = json.loads(ran.stdout)["error"]
    of = next(device for device in error["found"] if device["place"] == held)
    t.expect(ran.returncode == 1 and not (folder / "held.json").exists(), f"no file while a port is in use: {ran.stdout}")
    t.expect(of["kind"] == "unknown" and of["problem"] is not None, f"the port in use: {of}")


def without_one(t, folder, rig):
    """A held port with the role "none" is not touched. A remaining rotary stage gets the role rx by a guess."""
    held = next(device["link"]["path"] for device in rig["devices"] if device["role"] == "rx")
    made = folder / "without.json"
    with open(held, "rb+", buffering=0) as port:
        fcntl.flock(port, fcntl.LOCK_EX)
        wrote = t.succeeds_once("init", made, *console_of(rig), *offered(rig), "--role", f"{held}=none", "--yes", "--json", cwd=ROOT)
    t.expect(held not in [device["place"] for device in wrote["found"]], f"not asked: {wrote['found']}")
    t.expect(devices_of(made)["rx"]["config"]["serial"] == int(STAGES["ry"]), f"the other rotary stage: {devices_of(made)}")
    t.expect(wrote["assumed"]["roles"][wrote["roles"]["rx"]["place"]] == "rx", f"a role by guess: {wrote['assumed']}")


def real_bench(t, folder, offers):
    """No guessed role and no dangerous number: without the values no file is written. With all values there is a file, and z ends below the plate."""
    real, command = folder / "real.json", ["--only-named", *offers, "--yes", "--json"]
    ran = t.run("init", real, *command, cwd=ROOT)
    problems = [problem["where"] for problem in json.loads(ran.stdout)["error"]["problems"]]
    t.expect(ran.returncode == 1 and not real.exists(), f"nothing is written: {ran.stdout}")
    t.expect(problems == [*offers[1:11:2], "surface_z_mm", "probe_mass_kg", "force_cap_n", "torque_cap_nm"], f"missing values: {problems}")
    wrote = t.succeeds_once("init", real, *command, *roles(), *numbers(), *stated("--set", MEASURED), cwd=ROOT)
    document = json.loads(real.read_text())
    t.expect(document["bench"] == "real" and "simulation" not in document and document["limits"]["force_cap_N"] == 6, f"{document}")
    t.expect(document["limits"]["travel_mm"]["z"] == [0, PLATE["surface_z_mm"] + 5], f"z ends below the plate: {document['limits']}")
    t.expect(wrote["to_do"] and set(wrote["assumed"]["roles"].values()) == {"wrench", "taxels"}, f"what is left to do: {wrote}")
    looked_over(t, folder, real, folder / "small.json")


def over_tcp(t, folder):
    """The same ports on TCP with the box's pages; then a real bench of the same ports."""
    (folder / "tcp").mkdir()
    path, rig = rig_file(ROOT, folder / "tcp")
    near_home(path, rig)
    first = free_run(len(rig["devices"]) + 1)
    served = ServedRig(WEFT_RIG, path, rig)
    served.command += ["--tcp", str(first)]
    with served:
        made = folder / "tcp.json"
        t.succeeds_once("init", made, *console_of(rig), *tcp_offers(rig, first), *numbers(), "--yes", "--json", cwd=ROOT)
        found_right(t, made, "ati_netft")
        wrench = devices_of(made)["wrench"]
        t.expect(wrench["config"]["calibration_serial"] == "FT00000" and "http" in wrench, f"the box's pages: {wrench}")
        real_bench(t, folder, tcp_offers(rig, first))
        prompted(t, folder, rig, first)


def tcp_offers(rig, first):
    words, port = [], first
    for device in rig["devices"]:
        if device["driver"] != "ati_netft":
            words += ["--port", f"tcp:127.0.0.1:{port}"]
            port += 1
    link = next(device["link"] for device in rig["devices"] if device["driver"] == "ati_netft")
    return words + ["--netft", f"{link['host']}:{link['port']}/{port}"]


def prompted(t, folder, rig, first):
    """At a terminal: an invalid answer is requested again, an empty one takes the default if there is one, a role can be exchanged."""
    made = folder / "prompted.json"
    master, slave = pty.openpty()
    command = [WEFT, "init", made, "--only-named", *tcp_offers(rig, first)]
    process = subprocess.Popen(command, stdin=slave, stdout=subprocess.PIPE, stderr=slave, cwd=ROOT, text=True)
    os.close(slave)
    # By device, or by unit for numbers without a default: the plate's position, the probe's mass, the largest force and torque.
    replies = {r"\b45000001\b": ["wrench", "y"], r"\b45000002\b": ["x"], r"\[mm\]: $": ["", "1e9", "17.5"], r"\[kg\]: $": ["0.2"], r"\[N\]: $": ["6"],
               r"\[N m\]: $": ["2"]}
    shown, answered, questions = "", 0, []
    while len(questions) < 60 and select.select([master], [], [], 20)[0]:
        try:
            shown += os.read(master, 4096).decode()
        except OSError:
            break
        if shown[answered:].endswith(": "):
            question = shown[answered:].splitlines()[-1]
            answered = len(shown)
            questions.append(question)
            answers = next((answers for sign, answers in replies.items() if re.search(sign, question)), [])
            os.write(master, (answers.pop(0) if answers else "").encode() + b"\n")
    if len(questions) == 60:  # an answer is never accepted
        process.kill()
    process.communicate(timeout=20)
    os.close(master)
    t.expect(process.returncode == 0 and made.exists(), f"asked at a terminal: {shown}")
    if made.exists():
        devices = devices_of(made)
        t.expect([devices[role]["config"]["serial"] for role in "xyz"] == [45000002, 45000001, 45000003], f"roles exchanged: {devices}")
        t.expect(json.loads(made.read_text())["plate"]["surface_z_mm"] == 17.5, "a number as it was answered")


def held_ports(t, folder):
    """Ports held by another program."""
    (folder / "held").mkdir()
    path, rig = rig_file(ROOT, folder / "held")
    with ServedRig(WEFT_RIG, path, rig):
        in_use(t, folder / "held", rig)
        without_one(t, folder / "held", rig)


def digital(t, folder):
    """A Digital F/T sensor is found by Modbus and its records are counted; its stream is ended. Answers come from a file."""
    (folder / "digital").mkdir()
    path, rig = digital_rig(ROOT, folder / "digital", "rtu",
                            {"kind": "serial", "path": str(folder / "digital/ports/ft"), "baud": 1250000})
    (folder / "answers.json").write_text(json.dumps({**PLATE, "roles": {"27000004": "ry", "27000005": "rx"}}))
    with ServedRig(WEFT_RIG, path, rig):
        made = folder / "found-digital.json"
        t.succeeds_once("init", made, *console_of(rig), *offered(rig), "--answers", folder / "answers.json", "--json", cwd=ROOT)
        devices = devices_of(made)
        t.expect((devices["wrench"]["driver"], devices["wrench"]["config"]["rate_hz"]) == ("ati_digital", 500), f"{devices['wrench']}")
        t.expect(devices["rx"]["config"]["serial"] == 27000005, "roles by serial number in the answers")
        t.expect(json.loads(made.read_text())["plate"]["size_mm"] == [30, 30], "numbers of the answers")
        looked_over(t, folder, made, folder / "small.json")
        wrong = folder / "wrong.json"
        wrong.write_text(json.dumps({"surfaze_z_mm": 3}))
        ran = t.run("init", folder / "new.json", *console_of(rig), *offered(rig), "--answers", wrong, "--json", cwd=ROOT)
        error = json.loads(ran.stdout)["error"]
        t.expect(ran.returncode == 1 and error["code"] == "not found" and "surfaze_z_mm" in error["where"], f"a number that no rig has: {error}")
        t.expect("surface_z_mm" in error["expected"] and not (folder / "new.json").exists(), f"what there is: {error}")


def other_sensors(t, folder):
    """A card in a rack, which needs its stage stated; an imprint array and a vibration sensor."""
    (folder / "other").mkdir()
    path, rig = rig_file(ROOT, folder / "other", fidelity=str(ROOT / "sim/fidelity.json"))
    rig["simulation"]["fabrics"] = str(ROOT / "sim/objects.json")
    del rig["fabrics"]
    rig["devices"][0]["emulator"].update(model="BSC203", serial=70000001, bay=0)
    rig["devices"][0]["config"]["destination"] = 33
    link = {"kind": "serial", "path": str(folder / "other/ports/imprint"), "baud": 921600}
    rig["devices"][-1].update(name="imprint", driver="imprint_array", config={"rows": 32, "cols": 32, "rate_hz": 5}, link=link,
                              emulator={"kind": "imprint", "level": "Z+", "rate_hz": 5})
    rig["devices"].append({"name": "vibro", "role": "vibro", "driver": "vibro", "config": {}, "emulator": {"kind": "vibro"},
                           "link": {"kind": "serial", "path": str(folder / "other/ports/vibro"), "baud": 460800}})
    path.write_text(json.dumps(rig))
    made = folder / "other.json"
    command = ["init", made, *console_of(rig), *offered(rig), "--yes", "--json"]
    with ServedRig(WEFT_RIG, path, rig):
        error = json.loads(t.run(*command, cwd=ROOT).stdout)["error"]
        t.expect(error["where"] == rig["devices"][0]["link"]["path"] and "LTS150" in error["expected"], f"a stage to be stated: {error}")
        t.succeeds_once(*command, "--stage", "70000001=LTS150", cwd=ROOT)
        devices = devices_of(made)
        order = {role: devices[role]["config"]["serial"] for role in "xyz"}
        t.expect(order == {"x": 45000002, "y": 45000003, "z": 70000001} and devices["z"]["config"]["destination"] == 33, f"{order}")
        t.expect(devices["taxels"]["driver"] == "imprint_array" and devices["vibro"]["config"]["sound_rate_hz"] == 8000, f"{devices}")
        report = json.loads(t.run("doctor", "--rig", made, "--listen", 1, "--json", cwd=folder).stdout)
        t.expect(report["problems"] == 0, f"doctor: {report['findings']}")


def silent(t, folder):
    """A port without a device: all missing devices are listed, and no file is written."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"tcp:127.0.0.1:{server.getsockname()[1]}"
        ran = t.run("init", folder / "none.json", "--only-named", "--port", place, "--yes", "--json", cwd=folder)
        error = json.loads(ran.stdout)["error"]
        t.expect(ran.returncode == 1 and [problem["where"] for problem in error["problems"]] == [place], f"nothing replies: {error}")
        t.expect([device["kind"] for device in error["found"]] == ["unknown"], f"found: {error['found']}")
        ran = t.run("init", folder / "none.json", "--only-named", "--yes", "--json", cwd=folder)
    where = [problem["where"] for problem in json.loads(ran.stdout)["error"]["problems"]]
    t.expect(where == 3 * [""] + ["surface_z_mm", "probe_mass_kg", "taxel_cap_counts", "press_depth_mm", "touch_counts"],
             f"x, z, a sensor and all numbers of one without a force sensor are missing: {where}")
    t.expect(not (folder / "none.json").exists(), "no file")


class InitChecks(Checks):
    def succeeds_once(self, *arguments, cwd):
        """The JSON object of a command that writes a new file, and therefore runs only once."""
        ran = self.run(*arguments, cwd=cwd)
        self.expect(ran.returncode == 0, f"{arguments}: {ran.returncode} {ran.stderr}")
        return json.loads(ran.stdout) if ran.returncode == 0 else {}


def main():
    t = InitChecks(WEFT)
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        if sys.argv[4] == "simulated":
            simulated(t, folder)
        else:
            emulated(t, folder)  # a run in real time: no other load beside it
            with ThreadPoolExecutor() as pool:
                list(pool.map(lambda part: part(t, folder), (silent, over_tcp, held_ports, digital, other_sensors)))
    t.finish()


main()
