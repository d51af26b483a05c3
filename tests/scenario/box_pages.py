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

from cli_support import Checks
from emulated_support import ServedRig, rig_file

OK = b"HTTP/1.1 200 OK\r\n"
PAGE = (b"<netft><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>"
        b"<comrdtrate>1000</comrdtrate></netft>")  # not the rate of the rig file: refused after the page is read
REPLIES = {  # name: (bytes, a word of the message)
    "a status line cut short": (b"HTTP/1.", "wrench"),
    "the same and a blank line": (b"HTTP/1.\r\n\r\n", "status line"),
    "nothing": (b"", "wrench"),
    "binary": (bytes(range(256)), "not HTTP"),
    "a header without a colon": (OK + b"Server\r\n\r\n" + PAGE, "colon"),
    "a length that is too long": (OK + b"Content-Length: 5000\r\n\r\n" + PAGE, "wrench"),
    "a length that is too short": (OK + b"Content-Length: 40\r\n\r\n" + PAGE, "element"),
    "a negative length": (OK + b"Content-Length: -7\r\n\r\n" + PAGE, "length"),
    "chunks": (OK + b"Transfer-Encoding: chunked\r\n\r\n40\r\n", "chunks"),
    "endless headers": (OK + b"X: y\r\n" * 100000, "headers"),
    "an endless page": (OK + b"\r\n" + b"<netft>" * 100000, "does not end"),
    "no such page": (b"HTTP/1.1 404 Not Found\r\nServer: box\r\n\r\n", "404 Not Found"),
    "the page alone": (OK + b"\r\n" + PAGE, "/rate_hz"),
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
            for case, (reply, says) in REPLIES.items():
                box.reply = reply
                ran = t.run("align", "--rig", other, cwd=folder)
                said = ran.stderr + ran.stdout
                t.expect(ran.returncode != 0 and "wrench.box" in said and says in said, f"{case}: {said}")
                t.expect("mistake of this program" not in said and "Server: box" not in said, f"{case}: {said}")
    t.finish()


main()
