#!/usr/bin/env python3
"""Unusual hosts of weft-rig, with the standard library only, written from the protocols' documents: one that leaves silently, one that reads nothing,
one that requests everything a controller lists, messages that no document has, Modbus clients in parallel.

    rig_hosts.py WEFT_RIG SOURCE_ROOT
"""
import json
import os
import pathlib
import select
import socket
import struct
import subprocess
import sys
import tempfile
import time

from emulated_support import ServedRig, digital_rig, free_port, rig_file

COMPLETED, UPDATE, MOVING, JOGGING, HOMING = 0x0464, 0x0491, 0x30, 0xC0, 0x200
# REQ, GET and the bytes of data (none: only a header): "Messages applicable to" TDC001 and KDC101, and to LTS150, in Thorlabs' issue of December
# 2025; also the REQ and GET of triples of which it lists only the SET.
BOTH = [(0x0005, 0x0006, 84), (0x0211, 0x0212, 0), (0x0414, 0x0415, 14), (0x0417, 0x0418, 22), (0x043B, 0x043C, 6),
        (0x0446, 0x0447, 6), (0x0451, 0x0452, 6), (0x0441, 0x0442, 14), (0x0424, 0x0425, 16), (0x04B7, 0x04B8, 16),
        (0x0429, 0x042A, 6), (0x0411, 0x0412, 6)]
CUBE = BOTH + [(0x0065, 0x0066, 0), (0x040A, 0x040B, 6), (0x04A1, 0x04A2, 20), (0x04B4, 0x04B5, 4), (0x04B1, 0x04B2, 26),
               (0x0490, 0x0491, 14), (0x0521, 0x0522, 28), (0x0524, 0x0525, 12), (0x0527, 0x0528, 34)]
STAGE = BOTH + [(0x04F5, 0x04F6, 4), (0x0480, 0x0481, 14)]


class Terminal:
    """The port opened as a file, without settings."""

    def __init__(self, path):
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.port)

    def send(self, message, param1=0, param2=0):
        os.write(self.port, struct.pack("<HBBBB", message, param1, param2, 0x50, 0x01))

    def send_data(self, message, data):
        os.write(self.port, struct.pack("<HHBB", message, len(data), 0xD0, 0x01) + data)

    def read(self, most, seconds):
        return os.read(self.port, most) if select.select([self.port], [], [], seconds)[0] else b""

    def exactly(self, size, seconds=10):
        data, end = b"", time.monotonic() + seconds
        while len(data) < size and time.monotonic() < end:
            data += self.read(size - len(data), end - time.monotonic())
        assert len(data) == size, f"{len(data)} of {size} bytes: {data[:40].hex(' ')}"
        return data

    def message(self, seconds=10):
        """Its id, and its data or the two parameters."""
        number, length, to, source = struct.unpack("<HHBB", self.exactly(6, seconds))
        assert (to & 0x7F, source) == (0x01, 0x50), (hex(number), to, source)
        return number, self.exactly(length) if to & 0x80 else length.to_bytes(2, "little")

    def silent(self, seconds):
        heard = self.read(4096, seconds)
        assert not heard, f"no host requested {len(heard)} bytes: {heard[:40].hex(' ')}"


def a_second_one(weft_rig, file, rig):
    """Another weft-rig on the same rig file is refused before it touches a port of the first."""
    places = [pathlib.Path(device["link"]["path"]) for device in rig["devices"] if device["link"]["kind"] == "serial"]
    before = [os.readlink(place) for place in places]
    second = subprocess.run([weft_rig, str(file)], capture_output=True, text=True, timeout=60)
    assert second.returncode == 1 and "console" in second.stderr, second
    assert before and [os.readlink(place) for place in places] == before


def gone_without_a_word(path):
    with Terminal(path) as rude:
        rude.send(0x0011)
        for _ in range(50):
            assert rude.message(2)[0] == UPDATE
        rude.silent(0.5)  # after fifty messages without an acknowledgement
        os.write(rude.port, bytes.fromhex("53040600D0010100"))  # four bytes of a position are missing
    time.sleep(0.7)
    with Terminal(path) as polite:
        polite.silent(0.3)
        polite.send_data(0x0453, struct.pack("<Hl", 1, 400))
        number, data = polite.message()
        assert number == COMPLETED and struct.unpack_from("<l", data, 2)[0] == 400, (hex(number), data.hex())
        polite.silent(0.3)


def reads_nothing(path):
    asked = 1500
    with Terminal(path) as lazy:
        for _ in range(asked):
            lazy.send(0x0005)
        time.sleep(1)
        heard = 0
        while data := lazy.read(65536, 0.5):
            heard += len(data)
        assert heard % 90 == 0 and 90 * 50 < heard <= 90 * asked, f"{heard} bytes are no whole messages of 90"
        lazy.send(0x0005)
        assert lazy.exactly(90)[:6] == bytes.fromhex("060054008150")
        for _ in range(asked):
            lazy.send(0x0005)
        time.sleep(0.5)
    time.sleep(0.1)
    with Terminal(path) as other:
        other.silent(0.3)  # unread bytes of the earlier host must not reach the next one
        other.send(0x0211, 1)
        assert other.message() == (0x0212, b"\1\1")


def asks_everything(path, listed):
    with Terminal(path) as host:
        for request, reply, size in listed:
            host.send(0x0FFF, 1)  # unknown messages, short and long, with data that looks like requests
            host.send_data(0x0FFE, bytes.fromhex("050000005001") * 5)
            host.send_data(0x0413, bytes.fromhex("050000005001") * 5)  # a known message with a wrong length
            host.send(request, 1)
            number, data = host.message(2)
            assert number == reply and len(data) == (size or 2), (hex(request), hex(number), len(data))
        host.silent(0.3)


def says_what_it_does(path):
    """The status distinguishes homing and jogging from moving, and shows moving in all of them."""
    with Terminal(path) as host:
        def bits():
            host.send(0x0429, 1)
            number, data = host.message()
            assert number == 0x042A, hex(number)
            return struct.unpack_from("<I", data, 2)[0]

        host.send(0x0443, 1)
        assert bits() & HOMING and bits() & MOVING
        assert host.message(30)[0] == 0x0444
        assert bits() & 0x2F0 == 0 and bits() & 0x400
        host.send(0x046A, 1, 1)
        seen = bits()
        assert seen & JOGGING and seen & MOVING, hex(seen)
        assert host.message()[0] == COMPLETED
        assert bits() & 0x2F0 == 0


def modbus_clients_side_by_side(port):
    read = struct.pack(">HHHBBHH", 7, 0, 6, 10, 3, 0x1D, 1)
    status = struct.pack(">HHHBBBH", 7, 0, 5, 10, 3, 2, 0)
    clients = [socket.create_connection(("127.0.0.1", port), timeout=5) for _ in range(4)]
    for client in clients:
        client.sendall(read[:5])
    for client in reversed(clients):
        client.sendall(read[5:])
        assert client.recv(100) == status
    clients[0].close()
    for client in clients[1:]:
        client.sendall(read + read)
        both = b""
        while len(both) < 22:
            both += client.recv(100)
        assert both == status + status
        client.sendall(struct.pack(">HHHBBBBB", 8, 0, 5, 10, 0x2B, 0x0E, 1, 0))
        assert client.recv(100) == struct.pack(">HHHBBB", 8, 0, 3, 10, 0xAB, 1), "no device identification: illegal function"
        client.close()


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        path, rig = rig_file(root, pathlib.Path(name))
        rig["devices"][0]["emulator"]["start_mm"] = 1
        path.write_text(json.dumps(rig))
        stage, cube = rig["devices"][0]["link"]["path"], rig["devices"][3]["link"]["path"]
        with ServedRig(program, path, rig):
            a_second_one(program, path, rig)
            print("a second weft-rig on the same rig file is refused, and takes nothing away")
            gone_without_a_word(cube)
            print("a host that goes without a word is not held against the next")
            reads_nothing(stage)
            print("a host that reads nothing finds whole messages, and leaves none")
            asks_everything(stage, STAGE)
            asks_everything(cube, CUBE)
            print(f"{len(STAGE)} and {len(CUBE)} requests answered, between messages that no document has")
            says_what_it_does(stage)
            print("the status shows homing, jogging and motion of the shaft")
    with tempfile.TemporaryDirectory() as name:
        link = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
        path, rig = digital_rig(root, pathlib.Path(name), "tcp", link)
        with ServedRig(program, path, rig):
            modbus_clients_side_by_side(link["port"])
            print("four Modbus clients at once, each with its own answers")


if __name__ == "__main__":
    main()
