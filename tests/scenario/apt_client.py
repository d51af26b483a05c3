#!/usr/bin/env python3
"""A separate Thorlabs client: written from the protocol's document (docs/reference/device-facts.md) on pyserial, without any code of Weft. It
queries, homes and moves the stages that weft-rig serves: a stepper, a DC servo and a card in a rack, each on a pseudo-terminal and over TCP.

    apt_client.py WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import struct
import sys
import tempfile
import time

from emulated_support import ServedRig, free_port, rig_file
import socket

try:
    import serial
except ImportError:
    print("skipped: python3-serial is not installed")
    sys.exit(77)

HOST, UNIT, RACK, BAY0 = 0x01, 0x50, 0x11, 0x21
STEPPER_STATUS, SERVO_STATUS = 0x0481, 0x0491
COMPLETED, STOPPED, HOMED = 0x0464, 0x0466, 0x0444
LTS_PER_MM, LTS_SPEED, LTS_ACCELERATION = 409600, 21987328, 4506
PRM_PER_DEG = 1919.6418578623391
IS_HOMED, ENABLED = 0x400, 0x80000000


class Client:
    """One connection, messages in and out."""

    def __init__(self, url, unit=UNIT):
        self.port = serial.serial_for_url(url, baudrate=115200, timeout=2)
        self.unit = unit

    def send(self, message, param1=0, param2=0, to=None):
        self.port.write(struct.pack("<HBBBB", message, param1, param2, to or self.unit, HOST))

    def send_data(self, message, layout, *values):
        data = struct.pack("<" + layout, *values)
        self.port.write(struct.pack("<HHBB", message, len(data), self.unit | 0x80, HOST) + data)

    def read(self, size):
        data = self.port.read(size)
        if len(data) < size:
            raise TimeoutError(f"{len(data)} bytes of {size} came")
        return data

    def receive(self):
        """Id, the two parameters or the data, and the sender."""
        header = self.read(6)
        message, param1, param2, to, source = struct.unpack("<HBBBB", header)
        assert to & 0x7F == HOST, f"a reply swaps the addresses: {header.hex(' ')}"
        body = self.read(param1 | param2 << 8) if to & 0x80 else (param1, param2)
        return message, body, source

    def await_message(self, wanted, limit_s=20):
        end = time.monotonic() + limit_s
        while time.monotonic() < end:
            try:
                message, body, source = self.receive()
            except TimeoutError:
                continue
            if message == wanted:
                assert source == self.unit, f"answers come from whom was asked: 0x{source:02x}"
                return body
        raise TimeoutError(f"0x{wanted:04x} did not come in {limit_s} s")

    def ask(self, request, answer, channel=1):
        self.send(request, channel)
        return self.await_message(answer)

    def silent_for(self, seconds):
        time.sleep(seconds)
        waiting = self.port.read(self.port.in_waiting)
        assert not waiting, f"unsolicited: {waiting.hex(' ')}"

    def close(self):
        self.port.close()


def identity(client, model, serial_number, channels=1):
    client.send(0x0005)
    raw = client.read(90)
    assert raw[:6] == bytes([0x06, 0x00, 0x54, 0x00, 0x81, client.unit]), raw[:6].hex(" ")
    number, name = struct.unpack_from("<l8s", raw, 6)
    assert (number, name.rstrip(b"\0").decode()) == (serial_number, model), (number, name)
    assert struct.unpack_from("<H", raw, 6 + 82)[0] == channels, "channels"


def status(client, answer):
    """Position in counts and the status bits."""
    body = client.ask(answer - 1, answer)
    assert len(body) == 14
    return struct.unpack_from("<l", body, 2)[0], struct.unpack_from("<I", body, 10)[0]


def enable_and_home(client, answer):
    client.silent_for(0.3)
    client.send(0x0210, 1, 1)
    assert client.ask(0x0211, 0x0212) == (1, 1)
    client.send(0x0223, 1)
    client.send(0x0443, 1)
    client.await_message(HOMED)
    position, bits = status(client, answer)
    assert position == 0 and bits & IS_HOMED and bits & ENABLED, (position, hex(bits))


def move_to(client, counts, answer, timeout_s=20):
    client.send_data(0x0453, "Hl", 1, counts)
    body = client.await_message(COMPLETED, timeout_s)
    assert struct.unpack_from("<l", body, 2)[0] == counts
    assert status(client, answer)[0] == counts


def parameters(client):
    """REQ returns the values of each SET."""
    for layout, message, values in [
            ("Hlll", 0x0413, (1, 0, 10 * LTS_ACCELERATION, 10 * LTS_SPEED)),
            ("HHllllH", 0x0416, (1, 2, 40960, 0, 45060, 10 * LTS_SPEED, 2)),
            ("HHHllH", 0x0423, (1, 2, 2, 150 * LTS_PER_MM, 0, 1)),
            ("Hl", 0x043A, (1, 20480)),
            ("HHHll", 0x0440, (1, 2, 1, 2 * LTS_SPEED, LTS_PER_MM // 2)),
            ("Hl", 0x0445, (1, 4096)), ("Hl", 0x0450, (1, 8192)), ("HH", 0x04F4, (1, 0))]:
        client.send_data(message, layout, *values)
        body = client.ask(message + 1, message + 2)
        assert struct.unpack("<" + layout, body) == values, (hex(message), body.hex(" "))


def updates(client, answer):
    """Status messages come ten times a second between start and stop."""
    client.send(0x0011)
    end = time.monotonic() + 1.05
    count = 0
    while time.monotonic() < end:
        message, _, _ = client.receive()
        count += message == answer
    client.send(0x0012)
    time.sleep(0.2)
    client.port.reset_input_buffer()
    assert 8 <= count <= 11, f"{count} updates in a second"
    client.silent_for(0.3)


def stepper(url, unit=UNIT):
    client = Client(url, unit)
    identity(client, "LTS150", 45000001)
    enable_and_home(client, STEPPER_STATUS)
    parameters(client)
    move_to(client, 2 * LTS_PER_MM, STEPPER_STATUS)
    client.send_data(0x0448, "Hl", 1, -LTS_PER_MM)  # relative
    client.await_message(COMPLETED)
    assert status(client, STEPPER_STATUS)[0] == LTS_PER_MM
    client.send(0x046A, 1, 1)  # jog 0.1 mm forward
    client.await_message(COMPLETED)
    assert status(client, STEPPER_STATUS)[0] == LTS_PER_MM + 40960
    client.send(0x0457, 1, 1)  # velocity move, stopped
    time.sleep(0.3)
    client.send(0x0465, 1, 2)
    client.await_message(STOPPED)
    assert status(client, STEPPER_STATUS)[0] > LTS_PER_MM + 40960
    client.send(0x7FFF, 1)  # no such message
    updates(client, STEPPER_STATUS)
    client.send(0x0002)
    client.close()


def servo(url):
    client = Client(url)
    identity(client, "KDC101", 27000004)
    client.send(0x0018)
    enable_and_home(client, SERVO_STATUS)
    move_to(client, round(3 * PRM_PER_DEG), SERVO_STATUS)
    updates(client, SERVO_STATUS)
    # Without an acknowledgement it stops after about 50 status messages; with one it continues.
    client.send(0x0011)
    time.sleep(6.5)
    count = client.port.in_waiting // 20
    assert 45 <= count <= 55, f"{count} updates without an acknowledgement"
    client.port.reset_input_buffer()
    client.silent_for(0.5)
    client.send(0x0492)
    client.await_message(SERVO_STATUS, 2)
    client.send(0x0012)
    client.close()


def directions(url):
    """On a KDC101 direction 2 of jogs and velocity moves increases the counts. Clients tested on hardware use it so."""
    client = Client(url)
    for message in (0x046A, 0x0457):
        for direction, sign in ((2, 1), (1, -1)):
            before, _ = status(client, SERVO_STATUS)
            client.send(message, 1, direction)
            time.sleep(0.5)
            client.send(0x0465, 1, 1)
            client.await_message(STOPPED)
            after, _ = status(client, SERVO_STATUS)
            assert (after - before) * sign > 0, (hex(message), direction, before, after)
    client.close()


def brushless(url):
    """A DDS220 on a KBD101: 20000 counts per mm, T = 102.4 us, the velocity in its status."""
    per_mm, t = 20000, 102.4e-6
    client = Client(url)
    identity(client, "KBD101", 28000001)
    enable_and_home(client, SERVO_STATUS)
    client.send_data(0x0413, "Hlll", 1, 0, round(per_mm * t * t * 65536 * 500), round(per_mm * t * 65536 * 100))
    client.send_data(0x0453, "Hl", 1, 60 * per_mm)
    time.sleep(0.35)
    _, velocity = struct.unpack_from("<lh", client.ask(0x0490, SERVO_STATUS), 2)
    assert velocity == 205, f"APT16's example: 205 at 100 mm/s, not {velocity}"
    client.await_message(COMPLETED)
    assert status(client, SERVO_STATUS)[0] == 60 * per_mm
    client.close()


def servo_over_tcp(url):
    """Homes and moves, twice as far as on its other port, for a host that sends no acknowledgements."""
    client = Client(url)
    identity(client, "KDC101", 27000004)
    enable_and_home(client, SERVO_STATUS)
    move_to(client, round(6 * PRM_PER_DEG), SERVO_STATUS)
    client.close()


def card(url):
    """A BSC203 with one card, in its bay 1: the rack reports its bays, the card homes and moves, an empty bay does not answer."""
    rack = Client(url, RACK)
    identity(rack, "BSC203", 70000001, channels=3)
    for bay, occupied in ((0, 2), (1, 1), (2, 2)):
        assert rack.ask(0x0060, 0x0061, bay) == (bay, occupied), f"bay {bay}"
    rack.close()
    client = Client(url, BAY0 + 1)
    identity(client, "BSC203", 70000001)
    enable_and_home(client, STEPPER_STATUS)
    move_to(client, LTS_PER_MM, STEPPER_STATUS)
    client.send(0x0005, to=BAY0)
    client.silent_for(0.3)
    client.close()


def stalled(served, client):
    """A motor with an injected stall: its status shows motion without an end. After clearing the fault it arrives."""
    start, _ = status(client, STEPPER_STATUS)
    assert served.order(order="fault", device="stage.x", fault="motor_stall")["ok"]
    client.send_data(0x0453, "Hl", 1, 3 * LTS_PER_MM)
    time.sleep(0.5)
    position, bits = status(client, STEPPER_STATUS)
    assert position == start and bits & 0xF0, (position, start, hex(bits))
    assert served.order(order="clear", device="stage.x", fault="motor_stall")["ok"]
    client.await_message(COMPLETED)
    assert status(client, STEPPER_STATUS)[0] == 3 * LTS_PER_MM


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        path, rig = rig_file(root, folder)
        tcp = [free_port(socket.SOCK_STREAM) for _ in range(3)]
        for device, port in zip((rig["devices"][0], rig["devices"][3], rig["devices"][1]), tcp):
            device["also"] = [{"kind": "tcp", "host": "127.0.0.1", "port": port}]
        rig["devices"][0]["emulator"]["start_mm"] = 1
        rig["devices"][1]["emulator"].update(stage="NRT150", model="BSC203", serial=70000001, bay=1, bays=3, start_mm=1)
        rig["devices"][2]["emulator"] = {"kind": "apt_stage", "stage": "DDS220", "model": "KBD101", "start_mm": 1}
        path.write_text(json.dumps(rig))
        with ServedRig(program, path, rig) as served:
            stepper(rig["devices"][0]["link"]["path"])
            print("stepper on a pseudo-terminal: identified, homed, moved, updated")
            stepper(f"socket://127.0.0.1:{tcp[0]}")
            print("the same stepper over TCP")
            stepper(f"socket://127.0.0.1:{tcp[0]}", BAY0)
            print("the same, addressed as bay 0")
            client = Client(f"socket://127.0.0.1:{tcp[0]}")
            stalled(served, client)
            client.close()
            print("a motor that stalls by order, and goes on when that is cleared")
            servo(rig["devices"][3]["link"]["path"])
            print("DC servo on a pseudo-terminal: silent without keep-alive, awake with it")
            servo_over_tcp(f"socket://127.0.0.1:{tcp[1]}")
            print("the same servo over TCP: homed, moved")
            directions(f"socket://127.0.0.1:{tcp[1]}")
            print("directions of jogs and velocity moves, as on hardware")
            brushless(rig["devices"][2]["link"]["path"])
            print("a brushless drive: homed, moved, its velocity per servo cycle")
            for url in (rig["devices"][1]["link"]["path"], f"socket://127.0.0.1:{tcp[2]}"):
                card(url)
            print("a card in bay 1 of a BSC203, on a pseudo-terminal and over TCP: its rack asked, homed, moved")


if __name__ == "__main__":
    main()
