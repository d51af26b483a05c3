#!/usr/bin/env python3
"""weft-rig --tcp: every device on TCP beside its own port, and the box's pages, for programs that open no pseudo-terminal. Also hosts that connect,
half-close, and leave in the middle of a message.

    rig_tcp.py WEFT WEFT_RIG SOURCE_ROOT
"""
import pathlib
import re
import socket
import sys
import tempfile
import time
import urllib.request

from cli_support import Checks
from emulated_support import ServedRig, free_run, rig_file

ASK_INFO, HALF_A_MOVE = bytes.fromhex("050000005001"), bytes.fromhex("53040600D0010100")
UPDATES_ON = bytes.fromhex("11000A005001")


def host(port):
    return socket.create_connection(("127.0.0.1", port), timeout=5)


def all_of(s):
    data = b""
    while more := s.recv(4096):
        data += more
    return data


def exactly(s, count):
    data = b""
    while len(data) < count:
        more = s.recv(count - len(data))
        assert more, f"closed after {len(data)} of {count} bytes"
        data += more
    return data


def heard_in(s, seconds):
    s.settimeout(seconds)
    try:
        return s.recv(4096)
    except TimeoutError:
        return b""


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    with tempfile.TemporaryDirectory() as name:
        path, rig = rig_file(root, pathlib.Path(name))
        served = ServedRig(weft_rig, path, rig)
        served.command += ["--tcp", str(free_run(16))]
        with served:
            printed = "\n".join(served.lines)
            ports = {m[1]: int(m[2]) for m in re.finditer(r"^(\S+) .*\bserial \S+ .*\btcp 127\.0\.0\.1:(\d+)$", printed, re.M)}
            t.expect(set(ports) == {"stage.x", "stage.y", "stage.z", "stage.rx", "stage.ry", "taxels"}, printed)
            page = re.search(r"http 127\.0\.0\.1:(\d+)$", printed, re.M)
            t.expect(page is not None, printed)
            with urllib.request.urlopen(f"http://127.0.0.1:{page[1]}/netftapi2.xml", timeout=5) as reply:
                t.expect(b"<cfgcpf>1000000</cfgcpf>" in reply.read(), "the box's page")

            with host(ports["stage.y"]) as s:  # like nc -N: all requests are answered, and the end is clean
                s.sendall(ASK_INFO)
                s.shutdown(socket.SHUT_WR)
                t.expect(len(all_of(s)) == 90, "90 bytes and an end, no reset")
            with host(ports["stage.y"]) as s:
                s.sendall(UPDATES_ON + HALF_A_MOVE)
                time.sleep(0.2)
            with host(ports["stage.y"]) as s:
                s.sendall(ASK_INFO)
                t.expect(exactly(s, 90)[:4] == bytes.fromhex("06005400"), "the first answer is to the first question")
                t.expect(heard_in(s, 0.5) == b"", "no host has requested updates")
    t.finish()


if __name__ == "__main__":
    main()
