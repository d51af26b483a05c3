#!/usr/bin/env python3
"""An emulated vibration sensor on a pseudo-terminal in real time. It is read by a separate client, written from protocols/vibro/README.md with the
standard library, and by Weft's unmodified driver. Then its plug is pulled and put in again.

    vibro_ports.py WEFT WEFT_RIG SOURCE_ROOT
"""
import binascii
import json
import os
import pathlib
import select
import shutil
import struct
import sys
import tempfile
import time
import tty
import zlib

from cli_support import Checks
from emulated_support import ServedRig, rig_file, tried

DESCRIPTION, ACCELERATION, SOUND = 0, 1, 2
HEAD = 14


def frames(data):
    """(kind, sequence, device time, body) of each frame in the bytes, from the first sync on; the last one may be incomplete."""
    found, at = [], data.find(b"\xd6\x6d")
    while 0 <= at and at + HEAD <= len(data):
        version, kind, size, sequence, clock_us, check = struct.unpack_from("<BBHHIH", data, at + 2)
        assert version == 1 and check == binascii.crc_hqx(data[at + 2:at + 12], 0xFFFF), f"head at {at}"
        end = at + HEAD + size
        if end + 4 > len(data):
            break
        assert struct.unpack_from("<I", data, end)[0] == zlib.crc32(data[at + 2:end]), f"frame at {at}"
        found.append((kind, sequence, clock_us, data[at + HEAD:end]))
        at = end + 4
        assert at == len(data) or data[at:at + 1] == b"\xd6", f"bytes between frames at {at}"
    return found


def read_port(path, seconds):
    """Bytes received in that time, and whether the port hung up."""
    port, data, end = os.open(path, os.O_RDWR | os.O_NOCTTY), b"", time.monotonic() + seconds
    try:
        tty.setraw(port)
        while (left := end - time.monotonic()) > 0:
            if select.select([port], [], [], left)[0]:
                try:
                    more = os.read(port, 65536)
                except OSError:
                    more = b""
                if not more:
                    return data, True
                data += more
        return data, False
    finally:
        os.close(port)


def by_document(t, path):
    data, hung_up = read_port(path, 2.5)
    seen = frames(data)
    t.expect(not hung_up and seen, "frames come")
    for kind, name, values in ((ACCELERATION, "acceleration", 12), (SOUND, "sound", 160)):
        blocks = [f for f in seen if f[0] == kind]
        t.expect(110 <= len(blocks) <= 130, f"{len(blocks)} blocks of {name} in 2.5 s for 125")
        t.expect(all(b[1] == (a[1] + 1) % 65536 for a, b in zip(blocks, blocks[1:])), f"{name}: a number is missing")
        t.expect({b[2] - a[2] for a, b in zip(blocks, blocks[1:])} == {20000}, f"{name}: 20 ms a block")
        t.expect({len(b[3]) for b in blocks} == {2 * values}, f"{name}: {values} values a block")
        readings = {value for b in blocks for value in struct.unpack(f"<{values}h", b[3])}
        t.expect(len(readings) > 3, f"{name} has noise: {readings}")
    told = [f[3] for f in seen if f[0] == DESCRIPTION]
    t.expect(2 <= len(told) <= 3, f"{len(told)} descriptions in 2.5 s")
    rates = {(struct.unpack_from("<I", body, 8)[0], struct.unpack_from("<I", body, 20)[0]) for body in told}
    t.expect(rates == {(200_000, 8_000_000)}, f"200 Hz and 8 kHz: {rates}")


def by_driver(t, d, path):
    # tried again if any device was late: the doctor's status covers all of them
    ran = tried(lambda _: t.run("doctor", "--rig", path, "--listen", 1, "--json", cwd=d))
    t.expect(ran.returncode == 0, f"doctor: {ran.stdout} {ran.stderr}")
    sensor = next(device for device in json.loads(ran.stdout)["devices"] if device["name"] == "vibro")
    t.expect(sensor["answered"] and sensor["armed"] and not sensor["error"] and sensor["frames_lost"] == 0, f"{sensor}")
    t.expect(abs(sensor["rate_hz"] / 100 - 1) < 0.1, f"50 blocks a second of each channel: {sensor['rate_hz']}")


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    d = pathlib.Path(tempfile.mkdtemp())
    try:
        path, rig = rig_file(root, d)
        port = str(d / "ports" / "vibro")
        rig["devices"].append({"name": "vibro", "role": "vibro", "driver": "vibro",
                               "config": {"acceleration_rate_hz": 200, "sound_rate_hz": 8000},
                               "link": {"kind": "serial", "path": port, "baud": 460800},
                               "emulator": {"kind": "vibro", "acceleration_rate_hz": 200, "sound_rate_hz": 8000}})
        path.write_text(json.dumps(rig))
        with ServedRig(weft_rig, path, rig) as served:
            t.expect(served.order(order="mount", fabric="denim", patch_seed=1)["ok"], "cloth is mounted")
            by_document(t, port)
            by_driver(t, d, path)
            t.expect(served.order(order="fault", device="vibro", fault="unplug", start_s=0.3, duration_s=0.5)["ok"], "unplug")
            t.expect(read_port(port, 2)[1], "the port hangs up")
            t.expect(not os.path.lexists(port), "its path is gone")
            end = time.monotonic() + 3
            while not os.path.exists(port) and time.monotonic() < end:
                time.sleep(0.02)
            data, hung_up = read_port(port, 0.5)
            t.expect(not hung_up and len(frames(data)) > 30, "it is back at the same path")
        print("SIMULATED vibration sensor on a pseudo-terminal: as in its document, also for Weft's driver; a pulled plug is noticed")
    finally:
        shutil.rmtree(d)
    t.finish()


if __name__ == "__main__":
    main()
