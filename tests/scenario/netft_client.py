#!/usr/bin/env python3
"""A separate Net F/T client: plain sockets, written from docs/reference/device-facts.md without any code of Weft, for the box that weft-rig serves.
curl also requests its pages, and socat its stream, if they are installed.

    netft_client.py WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
import xml.etree.ElementTree

from emulated_support import ServedRig, free_port, rig_file

STOP, SINGLE, START, BUFFERED, RESET_LATCH, BIAS = 0, 1, 2, 3, 0x41, 0x42
RECORD = 36
LATCHED = 0x80010000


class Client:
    def __init__(self, place):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(place)
        self.socket.settimeout(2)

    def request(self, command, count=0):
        self.socket.send(struct.pack(">HHI", 0x1234, command, count))

    def records(self, datagrams=1):
        """(sequence, sample number, status, six counts) of each record."""
        found = []
        for _ in range(datagrams):
            data = self.socket.recv(4096)
            assert len(data) % RECORD == 0 and data, len(data)
            found += [(*struct.unpack_from(">III", data, at), struct.unpack_from(">6i", data, at + 12))
                      for at in range(0, len(data), RECORD)]
        return found

    def hears(self, seconds):
        """Number of records in that time."""
        end, count = time.monotonic() + seconds, 0
        while (left := end - time.monotonic()) > 0:
            self.socket.settimeout(left)
            try:
                count += len(self.records())
            except (TimeoutError, socket.timeout):
                break
        self.socket.settimeout(2)
        return count

    def drain(self):
        self.hears(0.3)

    def close(self):
        self.socket.close()


def one_sample(client):
    for start in (START, SINGLE):
        client.request(start, 1)
        (sequence, _, status, counts), = client.records()
        assert (sequence, status) == (1, 0), (sequence, status)
        weight = counts[2] / 1e6
        assert 2.8 < weight < 3.1, f"the plate's weight: {weight} N"
        assert client.hears(0.3) == 0, "one was asked for"


def stream(client):
    client.request(START)
    records = client.records(100)
    assert [r[0] for r in records] == list(range(1, 101)), "numbers without a gap"
    steps = {b[1] - a[1] for a, b in zip(records, records[1:])}
    assert steps == {14}, f"500 records a second of 7000 samples: {steps}"
    client.request(BIAS)
    time.sleep(0.1)
    client.drain()
    client.request(STOP)
    client.drain()
    assert client.hears(0.3) == 0, "stopped"
    client.request(START, 20)
    mean = sum(r[3][2] for r in client.records(20)) / 20e6
    assert abs(mean) < 0.05, f"biased: {mean} N"


def buffered(client):
    client.request(BUFFERED, 25)
    sizes = [len(client.records()) for _ in range(3)]
    assert sizes == [10, 10, 5], sizes


def one_client(place):
    """The client of the latest start gets the stream; a bias or a stop of another client changes nothing."""
    first, second = Client(place), Client(place)
    first.request(START)
    first.records(5)
    second.request(BIAS)
    assert second.hears(0.3) == 0 and first.hears(0.3) > 20
    second.request(START)
    second.records(5)
    first.drain()
    assert first.hears(0.3) == 0 and second.hears(0.3) > 20
    second.request(STOP)
    second.drain()
    first.close()
    second.close()


def rubbish(client):
    for data in (b"", b"\x12", b"\x12\x34\0\2\0\0\0", b"\x43\x21\0\2\0\0\0\0", b"\x12\x34\x99\x99\0\0\0\0"):
        client.socket.send(data)
    assert client.hears(0.3) == 0
    client.request(START, 1)
    assert len(client.records()) == 1


def pages(url):
    with urllib.request.urlopen(url + "/netftapi2.xml", timeout=5) as reply:
        assert reply.status == 200
        root = xml.etree.ElementTree.fromstring(reply.read())
    assert root.tag == "netft"
    text = {child.tag: child.text for child in root}
    assert len(text) == len(list(root)), "each tag once"
    assert (text["cfgcpf"], text["cfgcpt"]) == ("1000000", "1000000"), text
    assert (text["scfgfu"], text["scfgtu"], text["comrdte"]) == ("N", "Nm", "Enabled"), text
    assert text["comrdtrate"] == "500" and int(text["runstat"], 16) == 0
    for name in ("runft", "setbias", "cfgmr"):
        assert len(text[name].split(";")) == 6, text[name]
    with urllib.request.urlopen(url + "/netftcalapi.xml?index=0", timeout=5) as reply:
        root = xml.etree.ElementTree.fromstring(reply.read())
    assert root.tag == "netftCalibration" and root.find("calsn").text == "FT12288"
    assert (root.find("scalfu").text, root.find("scaltu").text) == ("N", "Nm")
    try:
        urllib.request.urlopen(url + "/nothing", timeout=5)
        raise AssertionError("there is no such page")
    except urllib.error.HTTPError as refused:
        assert refused.code == 404


def to_the_end(host, port, request):
    """Bytes received by a client that reads until the box closes, without another sign of the end."""
    with socket.create_connection((host, port), timeout=5) as s:
        s.sendall(request)
        heard = b""
        while more := s.recv(1000):
            heard += more
    return heard


def connections_end(host, port):
    """Connections end as with HTTP/1.0, whatever the request contains; a form redirects to an existing page."""
    for head in (b"HTTP/1.0\r\n", b"HTTP/1.1\r\nHost: box\r\n", b"HTTP/1.1\r\nHost: box\r\nConnection: keep-alive\r\n", b"HTTP/1.0\n"):
        end = b"\n" if head.endswith(b"0\n") else b"\r\n"
        page = to_the_end(host, port, b"GET /netftapi2.xml " + head + end)
        assert page.startswith(b"HTTP/1.0 200 OK\r\n") and page.rstrip().endswith(b"</netft>"), page
    moved = to_the_end(host, port, b"GET /comm.cgi?comrdtrate=500 HTTP/1.0\r\n\r\n")
    assert moved.startswith(b"HTTP/1.0 302 Found\r\n"), moved
    place = moved.split(b"Location: ")[1].split(b"\r\n")[0]
    assert to_the_end(host, port, b"GET " + place + b" HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.0 200 "), place


def box_settings(url):
    """Settings of the box's forms, as shown by its page, and their restoration."""
    def told(name, page="/netftapi2.xml"):
        with urllib.request.urlopen(url + page, timeout=5) as reply:
            return xml.etree.ElementTree.fromstring(reply.read()).find(name).text

    for form, name, expected in (
            ("config.cgi?cfgid=4&cfgnam=a%20b&cfgfu=1&cfgtfx2=132.71", "cfgnam", "Weft"),
            ("setting.cgi?setcfgsel=4", "cfgnam", "a b"),
            ("setting.cgi?setcfgsel=4", "scfgfu", "lbf"),
            ("setting.cgi?setcfgsel=4", "cfgtfx", "0;0;132.71;0;0;0"),
            ("setting.cgi?setcfgsel=0", "scfgfu", "N"),
            ("setting.cgi?setpke=1", "setpke", "1"),
            ("setting.cgi?setbias5=77", "setbias", told("setbias").rpartition(";")[0] + ";77"),
            ("moncon.cgi?mcx15=2&mcc15=-1&mcv15=-5", "mcv", "0;" * 15 + "-5"),
            ("comm.cgi?comeipe=1", "comeipe", "Enabled"),
            ("config.cgi?cfgid=4&cfgnam=Weft&cfgfu=2&cfgtfx2=0", "cfgnam", "Weft"),
            ("setting.cgi?setpke=0", "setpke", "0"),
            ("setting.cgi?setbias5=" + told("setbias").rpartition(";")[2], "setbias", told("setbias")),
            ("moncon.cgi?mcx15=-1&mcc15=1&mcv15=0", "mcv", "0;" * 15 + "0"),
            ("comm.cgi?comeipe=0", "comeipe", "Disabled")):
        with urllib.request.urlopen(f"{url}/{form}", timeout=5) as reply:
            assert reply.status == 200, form
        assert told(name) == expected, (form, name, told(name))
    assert told("cfgtfx", "/netftapi2.xml?index=4") == "0;0;0;0;0;0"


def read_exactly(connection, size):
    data = b""
    while len(data) < size:
        more = connection.recv(size - len(data))
        assert more, f"the box hung up after {len(data)} of {size} bytes"
        data += more
    return data


def command_port(place, client):
    """TCP 49151: requests of 20 bytes. The answer of WRITETRANSFORM is from memory, the rest is from the document."""
    with socket.create_connection(place, timeout=5) as port:
        def ask(request, size):
            port.sendall(request)
            return read_exactly(port, size)

        def wrench(bias=False):
            word, status, *counts = struct.unpack(">HH6h", ask(struct.pack(">B15xHH", 0, 0, int(bias)), 16))
            assert (word, status) == (0x1234, 0), (word, status)
            return [c * f / unit for c, f, unit in zip(counts, scale, 3 * [force] + 3 * [torque])]

        word, force_unit, torque_unit, force, torque, *scale = struct.unpack(">HBBII6H", ask(struct.pack(">B19x", 1), 24))
        assert (word, force_unit, torque_unit, force, torque) == (0x1234, 2, 3, 1000000, 1000000), "newtons and newton metres"
        wrench(bias=True)
        assert abs(wrench()[2]) < 0.1, "biased"
        client.request(START, 5)
        assert abs(sum(r[3][2] for r in client.records(5)) / 5e6) < 0.05, "the stream is biased as well"
        transform = struct.pack(">BBB6h5x", 2, 3, 1, 10000, 0, 0, 0, 0, 0)
        assert ask(transform, 4) == b"\x12\x34\x02\x00"
        assert ask(struct.pack(">BBB6h5x", 2, 3, 1, 0, 0, 0, 0, 0, 0), 4) == b"\x12\x34\x02\x00"
        for byte in struct.pack(">B19x", 1):
            port.sendall(bytes([byte]))
        assert len(read_exactly(port, 24)) == 24, "byte by byte"
        with socket.create_connection(place, timeout=5) as second:
            second.sendall(2 * struct.pack(">B19x", 1))
            assert len(read_exactly(second, 48)) == 48, "a second client, two requests at once"


def other_programs(url, place):
    if shutil.which("curl"):
        ran = subprocess.run(["curl", "-sS", "--max-time", "5", url + "/netftapi2.xml", url + "/netftapi2.xml?index=0"],
                             capture_output=True, text=True)
        assert ran.returncode == 0 and ran.stdout.count("</netft>") == 2, ran
        old = subprocess.run(["curl", "-sS", "--http1.0", "--max-time", "5", url + "/netftapi2.xml"], capture_output=True)
        assert old.returncode == 0 and b"</netft>" in old.stdout, old
        print("curl read the pages")
    if shutil.which("socat"):
        ran = subprocess.run(["socat", "-t1", "-", f"udp:{place[0]}:{place[1]}"], capture_output=True,
                             input=struct.pack(">HHI", 0x1234, START, 3))
        assert len(ran.stdout) == 3 * RECORD, len(ran.stdout)
        print("socat read three records")


def faults(served, client):
    """Faults at run time: a gap, a latch that a request resets, silence and its end."""
    answer = served.order(order="fault", device="ft", fault="sequence_jump", amount=50)
    assert answer["ok"], answer
    client.request(START)
    assert client.records()[0][0] == 51
    assert served.order(order="fault", device="ft", fault="threshold_latch", duration_s=0.1)["ok"]
    time.sleep(0.3)
    client.drain()
    assert client.records()[0][2] == LATCHED
    client.request(RESET_LATCH)
    time.sleep(0.1)
    client.drain()
    assert client.records()[0][2] == 0
    assert served.order(order="fault", device="ft", fault="unplug")["ok"]
    client.drain()
    assert client.hears(0.3) == 0
    assert served.order(order="clear", device="ft")["ok"]
    assert client.hears(0.3) > 20
    client.request(STOP)
    client.drain()
    refused = served.order(order="fault", device="ft", fault="motor_stall")
    assert not refused["ok"] and all(name in refused["error"] for name in ("/fault", "motor_stall", "ft", "bias_jump")), refused


def cpm_gateway(place):
    """The finger's datagrams: 16 words, sent to the latest client."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as finger:
        finger.connect(place)
        finger.settimeout(2)
        finger.send(b"\0")
        frames = [struct.unpack(">16H", finger.recv(4096)) for _ in range(40)]
    changing = sum(len({frame[i] for frame in frames}) > 1 for i in range(16))
    assert changing == 16, f"{changing} of 16 taxels have noise"


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        path, rig = rig_file(root, folder)
        box = rig["devices"][5]
        box["http"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
        box["commands"] = {"kind": "tcp", "host": "127.0.0.1", "port": free_port(socket.SOCK_STREAM)}
        box["emulator"]["calibration_serial"] = "FT12288"
        finger = rig["devices"][6]
        finger["link"] = {"kind": "udp", "host": "127.0.0.1", "port": free_port(socket.SOCK_DGRAM)}
        finger["config"]["form"] = finger["emulator"]["form"] = "cpm_udp"
        path.write_text(json.dumps(rig))
        place = (box["link"]["host"], box["link"]["port"])
        url = f"http://127.0.0.1:{box['http']['port']}"
        with ServedRig(program, path, rig) as served:
            client = Client(place)
            one_sample(client)
            stream(client)
            buffered(client)
            rubbish(client)
            print("one sample, streams, bias, buffers: as in the document")
            one_client(place)
            print("one client at a time: the latest start request has the stream")
            command_port((box["commands"]["host"], box["commands"]["port"]), client)
            print("the command port: calibration, readings, bias, transform")
            pages(url)
            connections_end("127.0.0.1", box["http"]["port"])
            box_settings(url)
            other_programs(url, place)
            faults(served, client)
            print("faults come and go by order")
            cpm_gateway((finger["link"]["host"], finger["link"]["port"]))
            print("the CPM-Finger's gateway sends its datagrams")
            client.close()


if __name__ == "__main__":
    main()
