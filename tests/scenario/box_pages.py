#!/usr/bin/env python3
"""A Net F/T box with a faulty HTTP server: `weft align` on the emulated bench names the device in one line, and nothing has moved.

    box_pages.py WEFT WEFT_RIG SOURCE_ROOT
"""
import json
import pathlib
import socket
import sys
import tempfile
import threading

from cli_support import Checks, error_of, fits
from emulated_support import ServedRig, rig_file

OK = b"HTTP/1.1 200 OK\r\n"
PAGE = (b"<netft><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>"
        b"<comrdtrate>1000</comrdtrate></netft>")  # not the rate of the rig file: refused after the page is read
REPLIES = {  # name: (bytes, fields of the error beside its place wrench.box)
    "half a status line": (b"HTTP/1.", {"code": "io"}),
    "the same and a blank line": (b"HTTP/1.\r\n\r\n", {"code": "parse", "got": "HTTP/1.", "expected": "HTTP/1.1 200"}),
    "nothing": (b"", {"code": "io"}),
    "binary": (bytes(range(256)), {"code": "parse", "expected": "HTTP/1.1 200"}),
    "a header without a colon": (OK + b"Server\r\n\r\n" + PAGE, {"code": "parse", "got": "Server"}),
    "a length that is too long": (OK + b"Content-Length: 5000\r\n\r\n" + PAGE, {"code": "io"}),
    "a length that is too short": (OK + b"Content-Length: 40\r\n\r\n" + PAGE, {"code": "parse", "where": ["wrench.box", "/netftapi2.xml"], "got": "none"}),
    "a negative length": (OK + b"Content-Length: -7\r\n\r\n" + PAGE, {"code": "parse", "got": "-7", "expected": "65536"}),
    "chunks": (OK + b"Transfer-Encoding: chunked\r\n\r\n40\r\n", {"code": "parse", "got": "chunked", "expected": "Content-Length"}),
    "endless headers": (OK + b"X: y\r\n" * 100000, {"code": "parse", "expected": "8192 bytes"}),
    "an endless page": (OK + b"\r\n" + b"<netft>" * 100000, {"code": "parse", "got": "", "expected": "65536 bytes"}),
    "no such page": (b"HTTP/1.1 404 Not Found\r\nServer: box\r\n\r\n", {"code": "not found", "got": "404 Not Found"}),
    "the page alone": (OK + b"\r\n" + PAGE, {"where": ["wrench.box", "/rate_hz"]}),
}


class Box:
    """Answers each connection with `reply` and closes it."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.reply = b""
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            connection, _ = self.listener.accept()
            with connection:
                try:
                    connection.settimeout(2)
                    connection.recv(4096)
                    connection.sendall(self.reply)
                except OSError:
                    pass  # the client has read enough


def main():
    weft, weft_rig, root = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
    t = Checks(weft)
    box = Box()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        path, rig = rig_file(root, folder)
        wrench = next(device for device in rig["devices"] if device["role"] == "wrench")
        wrench["name"] = "wrench.box"
        wrench.pop("http", None)
        path.write_text(json.dumps(rig))
        wrench["http"] = {"kind": "tcp", "host": "127.0.0.1", "port": box.listener.getsockname()[1]}
        other = folder / "other.json"
        other.write_text(json.dumps(rig))
        with ServedRig(weft_rig, path, rig):
            for case, (reply, fields) in REPLIES.items():
                box.reply = reply
                ran = t.run("align", "--rig", other, "--json", cwd=folder)
                t.expect(ran.returncode != 0 and fits(error_of(ran), **{"where": ["wrench.box"], **fields}), f"{case}: not {fields}: {ran.stdout}")
                t.expect("wrench.box" in ran.stderr and "Server: box" not in ran.stdout + ran.stderr, f"{case}: {ran.stderr}")
    t.finish()


main()
