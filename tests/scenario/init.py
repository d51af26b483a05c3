#!/usr/bin/env python3
"""`weft init`: rig files of the simulated shapes, and of devices that it finds behind weft-rig's ports, each checked, examined and run.

    init.py WEFT WEFT_RIG SOURCE_ROOT
"""
import csv
import fcntl
import json
import os
import pathlib
import pty
import select
import socket
import subprocess
import sys
import tempfile

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
# As emulated17 has them, near where the stages home.
PLATE = {"surface_z_mm": 16, "plate_x_mm": 60, "plate_y_mm": 60}
STAGES = {"x": "45000001", "y": "45000002", "z": "45000003", "rx": "27000004", "ry": "27000005"}
TRIALS = 2


def devices_of(path):
    return {device["role"]: device for device in json.loads(pathlib.Path(path).read_text())["devices"]}


def simulated(t, folder):
    """Each shape: as it is called, without problems, and a whole campaign of the library in virtual time."""
    for shape, (axes, wrench, arrays) in SHAPES.items():
        path, out = folder / f"{shape}.json", folder / f"out-{shape}"
        wrote = json.loads(t.run("init", path, "--simulated", shape, "--json", cwd=ROOT).stdout)
        devices = devices_of(path)
        t.expect([role for role in FIVE if role in devices] == axes, f"{shape}: stages {list(devices)}")
        t.expect(devices.get("wrench", {}).get("driver") == wrench, f"{shape}: force sensor {devices.get('wrench')}")
        of = [device["config"] for device in json.loads(path.read_text())["devices"] if device["role"] == "taxels"]
        t.expect([(one.get("taxels", one.get("rows", 0) * one.get("cols", 0)), one["rate_hz"]) for one in of] == arrays, f"{shape}: {of}")
        taxels = sum(count for count, _ in arrays)
        t.succeeds("check", ROOT / wrote["recipe"], "--rig", path, cwd=folder)
        report = json.loads(t.run("doctor", "--rig", path, "--json", cwd=folder).stdout)
        t.expect(report["problems"] == 0 and report["warnings"] == 0, f"{shape}: doctor {report['findings']}")
        ran = t.run("run", ROOT / wrote["recipe"], "--rig", path, "--out", out, "--json", cwd=folder)
        t.expect(ran.returncode == 0, f"{shape}: run {ran.stderr[-500:]}")
        if ran.returncode == 0:
            info = t.succeeds("dataset", "info", out / "dataset.h5", cwd=folder)
            t.expect(info["trials"] == 24 and info["bench"] == "simulated" and info["taxels"] == taxels, f"{shape}: data set {info}")
    refused = t.refuses("init", folder / "new.json", "--simulated", "6dof", cwd=folder, says=["5dof", "no-force-sensor"])
    t.expect(refused.get("code") == "not found", f"an unknown shape: {refused}")
    refused = t.refuses("init", folder / "5dof.json", "--simulated", "xyz", cwd=folder, says=["is there already"])
    t.expect(refused.get("code") == "wrong state", f"a file that exists: {refused}")


def recipe(folder):
    phases = [{"phase": "S", "duration_s": 1}, {"phase": "P", "duration_s": 1.5, "force_N": 5},
              {"phase": "M", "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 6}]}, {"phase": "E", "duration_s": 1}]
    (folder / "small.json").write_text(json.dumps({
        "schema_version": 1, "name": "small", "seed": 3, "fabrics": ["denim", "silk"], "repetitions": TRIALS // 2,
        "explorations": {"M1": {"phases": phases}}}))
    return folder / "small.json"


def numbers():
    return [word for name, value in PLATE.items() for word in ("--set", f"{name}={value}")]


def offered(rig):
    """Ports of weft-rig as options; the force sensor's is a box or a port."""
    words = []
    for link in (device["link"] for device in rig["devices"]):
        words += ["--netft", "{host}:{port}".format(**link)] if link["kind"] == "udp" else ["--port", link["path"]]
    return words


def console_of(rig):
    return ["--emulated", "127.0.0.1:{port}".format(**rig["simulation"]["console"])]


def found_right(t, path, wrench):
    """Roles by serial number, rates as weft-rig's rig file has them."""
    devices = devices_of(path)
    t.expect({role: str(devices[role]["config"]["serial"]) for role in STAGES} == STAGES, f"stages by serial number: {devices}")
    t.expect([devices[role]["config"]["stage"] for role in FIVE] == 3 * ["LTS150"] + 2 * ["PRM1-Z8"], f"stages: {devices}")
    t.expect((devices["wrench"]["driver"], devices["wrench"]["config"]["rate_hz"]) == (wrench, 500), f"sensor: {devices['wrench']}")
    of = devices["taxels"]["config"]
    t.expect((of["taxels"], of["rate_hz"]) == (16, 37), f"taxels: {of}")


def looked_over(t, folder, path, small):
    t.succeeds("check", small, "--rig", path, cwd=folder)
    report = json.loads(t.run("doctor", "--rig", path, "--listen", 1, "--json", cwd=folder).stdout)
    t.expect(report["problems"] == 0, f"doctor: {report['findings']}")
    rates = {device["role"]: device.get("rate_hz", 0) for device in report["devices"]}
    t.expect(abs(rates["wrench"] / 500 - 1) < 0.05 and abs(rates["taxels"] / 37 - 1) < 0.05, f"rates: {rates}")


def pressed(t, folder, out):
    """The recorded campaign: whole, verified, and the press is in it."""
    t.succeeds("verify", out, cwd=folder)
    t.succeeds("features", out / "dataset.h5", "-o", folder / "features.csv", cwd=folder)
    rows = list(csv.DictReader((folder / "features.csv").open()))
    t.expect(len(rows) == TRIALS and all(abs(float(row["diff.SP"])) > 5 for row in rows), f"the press: {rows[:1]}")


def emulated(t, folder):
    """The acceptance of it: weft-rig's ports are offered, and a campaign runs with the file that was written."""
    path, rig = rig_file(ROOT, folder)
    near_home(path, rig)
    small, made = recipe(folder), folder / "made.json"

    def once(attempt):
        out = folder / f"out{attempt}"
        with ServedRig(WEFT_RIG, path, rig) as served:
            if attempt == 0:
                before = served.order(order="truth")
                t.refuses("init", made, *console_of(rig), *offered(rig), cwd=folder, says=["no terminal", "--yes"])
                t.succeeds_once("init", made, *console_of(rig), *offered(rig), *numbers(), "--yes", "--json", cwd=ROOT)
                t.expect(served.order(order="truth")["probe_z_m"] == before["probe_z_m"], "nothing moves")
                found_right(t, made, "ati_netft")
                looked_over(t, folder, made, small)
                in_use(t, folder, rig)
            ran = t.run("run", small, "--rig", made, "--out", out, "--yes", "--no-evaluate", cwd=folder)
            truth = served.order(order="truth")
            t.expect(truth["contact_force_n"] == 0, f"the probe is off the cloth in the end: {truth}")
        if ran.returncode == 0:
            pressed(t, folder, out)
        return ran

    ran = tried(once)
    t.expect(ran.returncode == 0, f"the run: {ran.stdout[-300:]} {ran.stderr[-500:]}")


def in_use(t, folder, rig):
    """A port that another program has is left alone, and its holder named."""
    held = next(device["link"]["path"] for device in rig["devices"] if device["role"] == "x")
    with open(held, "rb+", buffering=0) as port:
        fcntl.flock(port, fcntl.LOCK_EX)
        ran = t.run("init", folder / "held.json", *console_of(rig), *offered(rig), "--yes", "--json", cwd=ROOT)
    error = json.loads(ran.stdout)["error"]
    of = next(device for device in error["found"] if device["place"] == held)
    t.expect(ran.returncode == 1 and not (folder / "held.json").exists(), f"no file while a port is in use: {ran.stdout}")
    t.expect(of["kind"] == "unknown" and of["problem"] is not None, f"the port in use: {of}")


def over_tcp(t, folder):
    """The same ports on TCP with the box's pages; then a real bench of the same ports."""
    (folder / "tcp").mkdir()
    path, rig = rig_file(ROOT, folder / "tcp")
    near_home(path, rig)
    first = free_run(len(rig["devices"]) + 1)
    served = ServedRig(WEFT_RIG, path, rig)
    served.command += ["--tcp", str(first)]
    small = recipe(folder)
    with served:
        made = folder / "tcp.json"
        t.succeeds_once("init", made, *console_of(rig), *tcp_offers(rig, first), *numbers(), "--yes", "--json", cwd=ROOT)
        found_right(t, made, "ati_netft")
        wrench = devices_of(made)["wrench"]
        t.expect(wrench["config"]["calibration_serial"] == "FT00000" and "http" in wrench, f"the box's pages: {wrench}")
        looked_over(t, folder, made, small)
        real = folder / "real.json"
        wrote = t.succeeds_once("init", real, "--only-named", *tcp_offers(rig, first), "--yes", "--json", cwd=ROOT)
        document = json.loads(real.read_text())
        t.expect(document["bench"] == "real" and "simulation" not in document and document["limits"]["force_cap_N"] == 6, f"{document}")
        t.expect(wrote["to_do"] and wrote["assumed"]["surface_z_mm"] == 60, f"what is left to do: {wrote}")
        looked_over(t, folder, real, small)
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
    """At a terminal: a wrong answer is asked for again, an empty one takes the default, a role can be exchanged."""
    made = folder / "prompted.json"
    master, slave = pty.openpty()
    command = [WEFT, "init", made, *console_of(rig), *tcp_offers(rig, first)]
    process = subprocess.Popen(command, stdin=slave, stdout=subprocess.PIPE, stderr=slave, cwd=ROOT, text=True)
    os.close(slave)
    replies = {"Role of LTS150 45000001": ["wrench", "y"], "Role of LTS150 45000002": ["x"], "Position of the z stage": ["1e9", "17.5"]}
    shown, answered = "", 0
    while select.select([master], [], [], 20)[0]:
        try:
            shown += os.read(master, 4096).decode()
        except OSError:
            break
        if shown[answered:].endswith("]: "):
            question = shown[answered:].splitlines()[-1]
            answered = len(shown)
            answers = next((answers for words, answers in replies.items() if question.startswith(words)), [])
            os.write(master, (answers.pop(0) if answers else "").encode() + b"\n")
    process.communicate(timeout=20)
    os.close(master)
    t.expect(process.returncode == 0 and made.exists(), f"asked at a terminal: {shown}")
    if made.exists():
        devices = devices_of(made)
        t.expect([devices[role]["config"]["serial"] for role in "xyz"] == [45000002, 45000001, 45000003], f"roles exchanged: {devices}")
        t.expect(json.loads(made.read_text())["plate"]["surface_z_mm"] == 17.5, "a number as it was answered")


def digital(t, folder):
    """A Digital F/T sensor is found by Modbus, its records counted; its stream is ended. Answers come from a file."""
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
        t.expect(json.loads(made.read_text())["plate"]["size_mm"] == [60, 60], "numbers of the answers")
        looked_over(t, folder, made, recipe(folder))
        wrong = folder / "wrong.json"
        wrong.write_text(json.dumps({"surfaze_z_mm": 3}))
        ran = t.run("init", folder / "new.json", *console_of(rig), *offered(rig), "--answers", wrong, "--json", cwd=ROOT)
        error = json.loads(ran.stdout)["error"]
        t.expect(ran.returncode == 1 and error["code"] == "not found" and "surfaze_z_mm" in error["where"], f"a number that no rig has: {error}")
        t.expect("surface_z_mm" in error["expected"] and not (folder / "new.json").exists(), f"what there is: {error}")


def other_sensors(t, folder):
    """A card in a rack, whose stage is to be stated; an imprint array and a vibration sensor."""
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
    """Nothing at a port: what is missing is said, all of it, and no file is written."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        place = f"tcp:127.0.0.1:{server.getsockname()[1]}"
        ran = t.run("init", folder / "none.json", "--only-named", "--port", place, "--yes", "--json", cwd=folder)
        error = json.loads(ran.stdout)["error"]
        t.expect(ran.returncode == 1 and [problem["where"] for problem in error["problems"]] == [place], f"nothing replies: {error}")
        t.expect([device["kind"] for device in error["found"]] == ["unknown"], f"found: {error['found']}")
        ran = t.run("init", folder / "none.json", "--only-named", "--yes", "--json", cwd=folder)
    t.expect(len(json.loads(ran.stdout)["error"]["problems"]) == 3, f"x, z and a sensor are missing: {ran.stdout}")
    t.expect(not (folder / "none.json").exists(), "no file")


class InitChecks(Checks):
    def succeeds_once(self, *arguments, cwd):
        """The JSON object of a command that writes a new file, so that it is not run twice."""
        ran = self.run(*arguments, cwd=cwd)
        self.expect(ran.returncode == 0, f"{arguments}: {ran.returncode} {ran.stderr}")
        return json.loads(ran.stdout) if ran.returncode == 0 else {}


def main():
    t = InitChecks(WEFT)
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        simulated(t, folder)
        silent(t, folder)
        emulated(t, folder)
        over_tcp(t, folder)
        digital(t, folder)
        other_sensors(t, folder)
    t.finish()


main()
