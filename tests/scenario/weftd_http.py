#!/usr/bin/env python3
"""weftd over HTTP: curl's way with Python's standard library. Requests, tokens, foreign pages, events with replay, bounds.

    weftd_http.py WEFTD WEFT SOURCE_ROOT        all simulated
"""
import http.client
import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = 120


class Web:
    def __init__(self, port, token):
        self.port, self.token = port, token

    def ask(self, method, path, body=None, **headers):
        """Status, headers and the open response of one request."""
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        sent = {"Content-Type": "application/json", "Authorization": f"Bearer {self.token}"} | headers
        wire.request(method, path, body, {k.replace("_", "-"): v for k, v in sent.items() if v is not None})
        return wire.getresponse()

    def post(self, text, **headers):
        response = self.ask("POST", "/rpc", text, **headers)
        body = response.read()
        return response.status, json.loads(body) if body else None

    def call(self, method, **params):
        status, said = self.post(json.dumps({"jsonrpc": "2.0", "id": 7, "method": method, "params": params}))
        assert status == 200 and said["id"] == 7, (status, said)
        return said["result"] if "result" in said else said["error"]


class Events:
    def __init__(self, web, query="", last=None):
        self.response = web.ask("GET", "/events" + query, Last_Event_ID=last)
        assert self.response.status == 200, (self.response.status, self.response.read())
        assert self.response.headers["Content-Type"] == "text/event-stream"

    def next(self):
        found = {}
        while True:
            line = self.response.readline().decode().rstrip("\n")
            if line == "" and "data" in found:
                return found["event"], found["id"], json.loads(found["data"])
            name, _, value = line.partition(": ")
            if name:
                found[name] = value


def token_of(folder, name, role):
    return subprocess.run([WEFT, "token", "add", name, "--role", role, "--tokens", folder / "tokens.json"], check=True,
                          capture_output=True, text=True).stdout.strip()


def requests(web, viewer):
    assert "run.start" in {m["name"] for m in web.call("rpc.discover")["methods"]}
    assert web.call("run.list", stat="x")["data"]["kind"] == "param.unknown"
    assert web.call("sub.open", topics=["*"])["data"]["hint"] == "Use the socket, or GET /events"
    assert viewer.call("lease.acquire")["data"]["kind"] == "access.role"
    lease = web.call("lease.acquire", idem="a")["lease"]
    assert web.call("lease.acquire", idem="a")["lease"] == lease, "done twice"
    web.call("lease.release", lease=lease)
    assert web.post('{"jsonrpc":"2.0","method":"run.list"}')[0] == 204, "a notification"


def refusals(web):
    good = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "run.list"})
    assert web.post("{")[0] == 400
    assert web.post("!halt")[0] == 400, "halt is for the local socket"
    assert web.post(good, Authorization=None)[0] == 401
    assert web.post(good, Authorization="Bearer wft_" + 64 * "0")[0] == 401
    assert web.post(good, Content_Type="text/plain")[0] == 415, "what any page's form could send"
    assert web.post(good, Host="bench.example")[0] == 403, "a name that was made to mean 127.0.0.1"
    assert web.ask("GET", "/events", Authorization=None).status == 401
    assert web.ask("GET", "/events?mode=often").status == 400
    assert web.ask("POST", "/rpc", b"x" * ((1 << 20) + 9)).status == 413
    assert web.ask("GET", "/nothing").status == 404
    assert web.call("system.ready")["ok"], "and goes on"


def events(web):
    """Two leases come and go; who was cut off in between has what it missed."""
    stream = Events(web, "?topics=lease:*&mode=every")
    kind, _, snapshot = stream.next()
    assert kind == "snapshot" and "snapshot" in snapshot, snapshot
    first = web.call("lease.acquire")["lease"]
    kind, seen, event = stream.next()
    assert kind == "event" and event["delta"]["acquired"]["lease"] == first, event
    stream.response.close()
    web.call("lease.release", lease=first)
    again = Events(web, "?topics=lease:*&mode=every", last=seen)
    assert again.next()[0] == "snapshot"
    assert again.next()[2]["delta"]["released"]["lease"] == first
    stale = Events(web, "?topics=lease:*", last="0-1")
    assert stale.next()[0] == "snapshot", "an event of another start is no reason to refuse"


def bounds(web):
    """More streams than there may be; clients that begin a request and say no more."""
    held, refused = [], 0
    for _ in range(12):
        response = web.ask("GET", "/events")
        refused += response.status == 503
        held.append(response)
    assert refused >= 4, refused
    for response in held:
        response.close()
    slow = []
    for _ in range(20):
        wire = socket.create_connection(("127.0.0.1", web.port))
        wire.sendall(b"POST /rpc HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        slow.append(wire)
    assert web.call("system.ready")["ok"], "slow clients are given up"


def a_run(web):
    lease = web.call("lease.acquire")["lease"]
    stream = Events(web, "?topics=run:*&mode=every")
    run = web.call("run.start", recipe="small", lease=lease, idem="r")["run"]
    states = []
    while "ended" not in states:
        _, _, event = stream.next()
        if event.get("topic") == f"run:{run}" and "state" in event["delta"]:
            states.append(event["delta"]["state"])
    assert states[-1] == "ended" and "running" in states, states
    assert web.call("run.wait", run=run)["outcome"] == "complete"


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-http-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe["fabrics"], recipe["repetitions"] = ["denim"], 2
        (folder / "recipes").mkdir()
        (folder / "recipes" / "small.json").write_text(json.dumps(recipe))
        admin, viewer = token_of(folder, "boss", "admin"), token_of(folder, "viewer", "observer")
        daemon = subprocess.Popen(
            [WEFTD, "--rig", ROOT / "sim/rigs/bench17.json", "--recipes", folder / "recipes", "--data", folder / "data",
             "--tokens", folder / "tokens.json", "--http", "0"], stdout=subprocess.PIPE, text=True)
        try:
            port = int(re.search(r"http://127\.0\.0\.1:(\d+)", daemon.stdout.readline()).group(1))
            web = Web(port, admin)
            requests(web, Web(port, viewer))
            refusals(web)
            events(web)
            a_run(web)
            bounds(web)
            left = Events(web)  # a stream that is open does not keep the daemon from ending
            daemon.terminate()
            assert daemon.wait(30) == 0
            left.response.close()
        finally:
            daemon.kill()
    print("weftd over HTTP: all of it held (simulated)")


main()
