#!/usr/bin/env python3
"""Third-party programs read the emulated Digital F/T sensor: mbpoll, pymodbus and a client of libmodbus, Modbus RTU on a pseudo-terminal and Modbus
TCP. Their readings are decoded here from the document only and compared with the truth. Then weft itself runs a trial on the pseudo-terminal at 1.25
Mbaud. pymodbus also makes the golden vectors again.

    modbus_clients.py WEFT WEFT_RIG LIBMODBUS_CLIENT SOURCE_ROOT
"""
import json
import pathlib
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile

from cli_support import Checks
from digital_ft import near_truth, s16
from emulated_support import ServedRig, digital_rig, free_port, tried

try:
    from pymodbus.client import ModbusSerialClient, ModbusTcpClient
    from pymodbus.factory import ClientDecoder
    from pymodbus.framer.rtu_framer import ModbusRtuFramer
    from pymodbus.framer.socket_framer import ModbusSocketFramer
    from pymodbus import pdu
    from pymodbus import register_read_message as reads
    from pymodbus import register_write_message as writes
except ImportError as missing:
    print(f"skipped: python3-pymodbus 3 is not installed ({missing})")
    sys.exit(77)


def mbpoll(where, table, address, count):
    said = subprocess.run(["mbpoll", "-a", "10", "-0", "-r", str(address), "-c", str(count), "-t", f"{table}:hex", "-1", "-q",
                           *where], capture_output=True, text=True, timeout=30)
    if said.returncode != 0:
        raise RuntimeError(f"mbpoll: {said.stdout} {said.stderr}")
    return [int(value, 16) for value in re.findall(r"^\[\d+\]:\s*0x([0-9A-F]{4})", said.stdout, re.M)]


def by_mbpoll(t, where):
    calibration = mbpoll(where, 4, 0xE3, 64) + mbpoll(where, 4, 0x123, 64) + mbpoll(where, 4, 0x163, 40)
    t.expect(mbpoll(where, 4, 0x1D, 1) == [0], "mbpoll: status 0")
    near_truth(t, "mbpoll", calibration, s16(mbpoll(where, 3, 0, 6)))
    return calibration


def by_pymodbus(t, client):
    t.expect(client.connect(), "pymodbus connects")
    calibration = []
    for address, count in ((0xE3, 64), (0x123, 64), (0x163, 40)):
        calibration += client.read_holding_registers(address, count, slave=10).registers
    near_truth(t, "pymodbus", calibration, s16(client.read_input_registers(0, 6, slave=10).registers))
    t.expect(client.read_holding_registers(0x0CE3, 1, slave=10).isError(), "pymodbus: an address beyond is refused")
    t.expect(client.write_register(0x1F, 2, slave=10).isError(), "pymodbus: a write while locked is refused")
    client.close()
    return calibration


def by_libmodbus(t, program, *where):
    said = subprocess.run([program, *where], capture_output=True, text=True, timeout=30)
    t.expect(said.returncode == 0, f"libmodbus client: {said.stderr}")
    if said.returncode != 0:
        return []
    seen = json.loads(said.stdout)
    near_truth(t, "libmodbus", seen["calibration"], s16(seen["gauges"]))
    t.expect(seen["status"] == [0], "libmodbus: status 0")
    raw = bytes(seen.get("stream", []))
    for at in range(0, len(raw), 13):
        record = raw[at:at + 13]
        t.expect(record[12] == sum(record[:12]) & 0x7F, f"sum of record {at // 13}: {record.hex()}")
        g0, g2, g4, g1, g3, g5 = struct.unpack(">6h", record[:12])
        near_truth(t, f"libmodbus stream {at // 13}", seen["calibration"], [g0, g1, g2, g3, g4, g5])
    return seen["calibration"]


def same(t, calibrations):
    t.expect(all(len(c) == 168 and c == calibrations[0] for c in calibrations), "all clients read the same calibration")
    t.expect(struct.pack(">4H", *calibrations[0][:4]) == b"FT40001\0", "serial number of the calibration")


def short_trial(t, d, path):
    recipe = {"schema_version": 1, "name": "short", "source": "test", "seed": 1, "fabrics": ["denim"], "repetitions": 1,
              "explorations": {"M1": {"phases": [
                  {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "force_band_N": 0.25, "duration_s": 2},
                  {"phase": "M", "force_N": 5, "force_band_N": 0.25, "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 4}]},
                  {"phase": "E", "duration_s": 1}]}}}
    (d / "recipe.json").write_text(json.dumps(recipe))
    ran = tried(lambda attempt: t.run("run", "recipe.json", "--rig", path, "--out", f"out{attempt}", "--no-evaluate", "--json", cwd=d))
    t.expect(ran.returncode == 0, f"a trial with the Digital F/T on a port: {ran.stdout} {ran.stderr}")
    if ran.returncode == 0:
        rms = json.loads(ran.stdout)["force_rms_error_n"]
        print(f"SIMULATED trial on a pseudo-terminal at 1.25 Mbaud: force error in phase M {rms:.4f} N rms")
        t.expect(rms < 0.1, f"force error {rms} N rms")


def over_rtu(t, d, programs, root):
    link = {"kind": "serial", "path": str(d / "ports" / "ft"), "baud": 1250000}
    path, rig = digital_rig(root, d, "rtu", link)
    with ServedRig(programs["weft-rig"], path, rig):
        port = link["path"]
        read = [by_mbpoll(t, ["-m", "rtu", "-b", "115200", "-P", "none", port]),
                by_pymodbus(t, ModbusSerialClient(port=port, baudrate=115200, parity="N", timeout=2)),
                by_libmodbus(t, programs["libmodbus"], "rtu", port)]
        same(t, read)
        short_trial(t, d, path)


def over_tcp(t, d, programs, root):
    link = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
    path, rig = digital_rig(root, d, "tcp", link)
    with ServedRig(programs["weft-rig"], path, rig):
        port = str(link["port"])
        same(t, [by_mbpoll(t, ["-m", "tcp", "-p", port, "127.0.0.1"]),
                 by_pymodbus(t, ModbusTcpClient("127.0.0.1", port=link["port"], timeout=2)),
                 by_libmodbus(t, programs["libmodbus"], "tcp", "127.0.0.1", port)])


def over_transparent_tcp(t, d, programs, root):
    """RTU frames over a TCP port, as forwarded by a serial server."""
    link = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
    path, rig = digital_rig(root, d, "rtu", link)
    with ServedRig(programs["weft-rig"], path, rig):
        same(t, [by_pymodbus(t, ModbusTcpClient("127.0.0.1", port=link["port"], framer=ModbusRtuFramer, timeout=2))])


def message(f):
    """The message of a golden vector, in pymodbus' form."""
    request, function = f["side"] == "request", f["function"]
    if "exception" in f:
        return pdu.ExceptionResponse(function, f["exception"])
    if function in (3, 4):
        kind = "Holding" if function == 3 else "Input"
        if request:
            return getattr(reads, f"Read{kind}RegistersRequest")(f["address"], f["count"])
        return getattr(reads, f"Read{kind}RegistersResponse")(f["registers"])
    end = "Request" if request else "Response"
    if function == 6:
        return getattr(writes, f"WriteSingleRegister{end}")(f["address"], f["value"])
    return getattr(writes, f"WriteMultipleRegisters{end}")(f["address"], f["registers"] if request else f["count"])


def vectors(t, root):
    paths = sorted((root / "protocols/modbus/vectors").glob("*.json"))
    compared = 0
    for path in paths:
        golden = json.loads(path.read_text())
        f = golden["fields"]
        if f["function"] not in (3, 4, 6, 16):
            continue
        made = message(f)
        made.unit_id = made.slave_id = f["slave"]
        made.transaction_id = f.get("transaction", 0)
        framer = (ModbusRtuFramer if f["framing"] == "rtu" else ModbusSocketFramer)(ClientDecoder())
        t.expect(framer.buildPacket(made) == bytes.fromhex(golden["hex"]), f"{path.name}: pymodbus makes the same bytes")
        compared += 1
    print(f"{compared} of {len(paths)} vectors made anew by pymodbus")
    t.expect(compared >= 30, f"only {compared} vectors compared")


def main():
    weft, weft_rig, libmodbus, root = *sys.argv[1:4], pathlib.Path(sys.argv[4]).resolve()
    if shutil.which("mbpoll") is None:
        print("skipped: mbpoll is not installed")
        sys.exit(77)
    t = Checks(weft)
    vectors(t, root)
    programs = {"weft-rig": weft_rig, "libmodbus": str(pathlib.Path(libmodbus).resolve())}
    for bench in (over_tcp, over_transparent_tcp, over_rtu) if "--longer" in sys.argv else (over_tcp,):
        with tempfile.TemporaryDirectory() as folder:
            bench(t, pathlib.Path(folder), programs, root)
    t.finish()


if __name__ == "__main__":
    main()
