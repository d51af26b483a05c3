#!/usr/bin/env python3
"""weftd over HTTP like curl, with Python's standard library. Requests, tokens, foreign pages, events with replay, and malicious clients: slow,
endless, gone, too many.

    weftd_http.py WEFTD WEFT SOURCE_ROOT        all simulated
"""
import contextlib
import errno
import http.client
import json
import os
import pathlib
import re
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

from cli_support import line_has
from weftd_support import Client, command, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
PATIENCE_S = 120
MIB = 1 << 20


class Web:
    def __init__(self, port, token, patience_s=PATIENCE_S):
        self.port, self.token, self.patience_s = port, token, patience_s

    def ask(self, method, path, body=None, **headers):
        """Status, headers and the open response of one request."""
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=self.patience_s)
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

    def open(self, first_line, *headers, token=True, body=b""):
        """A connection with this much of a request sent, byte for byte."""
        wire = socket.create_connection(("127.0.0.1", self.port), PATIENCE_S)
        headers = ["Host: 127.0.0.1", "Content-Type: application/json", *headers]
        if token:
            headers.append(f"Authorization: Bearer {self.token}")
        wire.sendall("\r\n".join([first_line + " HTTP/1.1", *headers, "", ""]).encode() + body)
        return wire

    def wait_for(self, run):
        """A call of run.wait in progress."""
        body = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "run.wait", "params": {"run": run}}).encode()
        return self.open("POST /rpc", f"Content-Length: {len(body)}", body=body)


def answer_of(wire):
    response = http.client.HTTPResponse(wire)
    response.begin()
    return response.status, response.read()


class Events:
    def __init__(self, web, query="", last=None):
        self.response = web.ask("GET", "/events" + query, Last_Event_ID=last)
        assert self.response.status == 200, (self.response.status, self.response.read())
        assert self.response.headers["Content-Type"] == "text/event-stream"

    def next(self):
        found = {}
        while True:
            line = self.response.readline().decode()
            assert line, "the stream ended"
            line = line.rstrip("\n")
            if line == "" and "data" in found:
                return found["event"], found["id"], json.loads(found["data"])
            name, _, value = line.partition(": ")
            if name:
                found[name] = value


def requests(web, viewer):
    assert "run.start" in {m["name"] for m in web.call("rpc.discover")["methods"]}
    assert web.call("run.list", stat="x")["data"]["kind"] == "param.unknown"
    refused = web.call("sub.open", topics=["*"])["data"]
    assert refused["kind"] == "unsupported" and "GET /events" in refused["hint"], refused
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
    assert web.ask("GET", "/rpc").status == 405
    assert web.ask("OPTIONS", "/rpc", Origin="http://bench.example").headers["Access-Control-Allow-Origin"] is None
    # refused by the head only: no byte of these bodies is sent
    for status, headers in (411, ["Transfer-Encoding: chunked"]), (411, []), (413, [f"Content-Length: {1 << 40}"]):
        assert answer_of(web.open("POST /rpc", *headers))[0] == status, headers
    assert answer_of(web.open("POST /rpc", "Content-Length: 9", token=False))[0] == 401
    assert answer_of(web.open("GET /events", "X: " + "x" * 20000))[0] == 431
    assert answer_of(web.open("GET /events", "Host: 127.0.0.1"))[0] == 400, "two of them"
    assert web.call("system.ready")["ok"], "and goes on"


def tokens(web, viewer, folder):
    """A token of the daemon is valid at once, and so is one that weft token add wrote after the start. Neither file nor journal contains it."""
    assert viewer.call("token.add", name="mine")["data"]["kind"] == "access.role"
    beside = Web(web.port, token_of(WEFT, folder / "tokens.json", "beside", "observer"))
    assert beside.call("session.whoami")["role"] == "observer", "written since the daemon began"
    made = web.call("token.add", name="page", days=1)
    assert Web(web.port, made["token"]).call("session.whoami") | {"session": ""} == {
        "session": "", "client": "http", "user": "token:page", "role": "operator", "local": False}
    assert beside.call("session.whoami")["role"] == "observer"
    for wrong, where in (dict(name="page"), "token"), (dict(name="a", role="king"), "/params/role"), (dict(name="a", days=0), "/params/days"):
        assert web.call("token.add", **wrong)["data"]["where"] == where, wrong
    told = web.call("log.query", kind="token.added")["lines"]
    assert [line["data"]["name"] for line in told] == ["page"], told
    assert made["token"] not in json.dumps(told) + (folder / "tokens.json").read_text()


def paused(web, lease, pause):
    """A run paused by `pause`, which is called when the run moves; the run is slow enough for that."""
    web.call("sim.clock", pace=20)
    run = web.call("run.start", recipe="small", lease=lease)["run"]
    while web.call("run.get", run=run)["state"] == "arming":
        time.sleep(0.02)
    pause(run)
    assert web.call("run.get", run=run)["state"] in ("pausing", "held"), web.call("run.get", run=run)
    web.call("sim.clock", pace=0)
    return run


def at_the_bench(folder, *words):
    ran = subprocess.run([WEFT, *words, "--socket", folder / "data/weftd.sock"], capture_output=True, text=True)
    assert ran.returncode == 0, (words, ran.stderr)
    return ran.stdout.strip()


def pages(web, folder):
    """A page link for oneself gives one user at page and terminal, with shared leases. A link for another name is another user."""
    def at_link(*words):
        link = at_the_bench(folder, "page", *words)
        assert re.fullmatch(rf"http://127\.0\.0\.1:{web.port}/#token=wft_[0-9a-f]{{64}}", link), link
        return Web(web.port, link.partition("=")[2])

    me = json.loads(at_the_bench(folder, "call", "session.whoami"))["user"]
    namesake, page = at_link("--name", me), at_link()
    who = page.call("session.whoami")
    assert (who["user"], who["role"], who["local"]) == (me, "operator", False), who
    assert namesake.call("session.whoami")["user"] == f"token:{me}"
    lease = page.call("lease.acquire", ttl_ms=600000)["lease"]
    assert namesake.call("run.start", recipe="small", lease=lease)["data"]["kind"] == "lease.required"
    first = paused(page, lease, lambda run: at_the_bench(folder, "pause", run, "--now"))
    assert namesake.call("run.resume", run=first)["data"]["kind"] == "lease.held"
    page.call("run.resume", run=first)
    at_the_bench(folder, "start", "small", "--wait")
    assert [held["lease"] for held in page.call("lease.list")["leases"]] == [lease], "the page holds on to it"
    page.call("lease.release", lease=lease)
    program = Client(folder / "data/weftd.sock")
    lease = program.call("lease.acquire", note="overnight")["lease"]
    kept_out = subprocess.run([WEFT, "start", "small", "--socket", folder / "data/weftd.sock"], capture_output=True, text=True)
    assert kept_out.returncode == 1 and "overnight" in kept_out.stderr, kept_out
    program.call("lease.release", lease=lease)
    assert web.call("token.add", name="mine", own=True)["data"]["where"] == "/params/own", "who has a token may lose it"
    assert {run["outcome"] for run in page.call("run.list")["runs"]} == {"complete"}


def unusual(web):
    """A client with "Expect: 100-continue", and one that half-closes its connection after the request."""
    good = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "system.ready"}).encode()
    wire = web.open("POST /rpc", f"Content-Length: {len(good)}", "Expect: 100-continue")
    assert wire.recv(100).startswith(b"HTTP/1.1 100 ")
    wire.sendall(good)
    assert answer_of(wire)[0] == 200
    wire = web.open("POST /rpc", f"Content-Length: {len(good)}")
    wire.sendall(good)
    wire.shutdown(socket.SHUT_WR)
    assert answer_of(wire)[0] == 200


def events(web):
    """Two leases come and go; a reconnected client gets the events that it missed."""
    stream = Events(web, "?topics=lease:*&mode=every")
    kind, _, snapshot = stream.next()
    assert kind == "snapshot" and "snapshot" in snapshot, snapshot
    first = web.call("lease.acquire")["lease"]
    kind, seen, event = stream.next()
    assert kind == "event" and event["delta"]["acquired"]["lease"] == first, event
    stream.response.close()
    web.call("lease.release", lease=first)
    again = Events(web, "?topics=lease:*&mode=every", last=seen)
    assert again.next()[:2] == ("snapshot", seen), "who is cut off here has still missed nothing"
    assert again.next()[2]["delta"]["released"]["lease"] == first
    merged = Events(web, "?topics=lease:*", last=seen).next()
    assert merged[0] == "snapshot" and merged[2]["snapshot"], "the latest state, whole"
    stale = Events(web, "?topics=lease:*", last="0-1")
    assert stale.next()[0] == "snapshot", "an event of another start is no reason to refuse"


def order(web, folder):
    """Under many events: a snapshot, then every later event."""
    with socket.socket(socket.AF_UNIX) as halting:
        halting.connect(str(folder / "data/weftd.sock"))
        for _ in range(4):
            halting.sendall(b"!halt\n" * 20)
            stream = Events(web, "?topics=rig&mode=every")
            halting.sendall(b"!halt\n")
            (first, begin, _), (then, number, _) = stream.next(), stream.next()
            stream.response.close()
            assert (first, then) == ("snapshot", "event"), (first, then)
            assert int(number.split("-")[1]) == int(begin.split("-")[1]) + 1, (begin, number)
    web.call("rig.reset", reason="test")


def endless(web, daemon):
    """Endless requests, and those without a token, are not kept."""
    def send(first_line, header, piece):
        wire = web.open(first_line, header, token=False)
        with contextlib.suppress(ConnectionError):
            for _ in range(64):
                wire.sendall(piece)
            return False
        return True

    before = peak_kib(daemon)
    assert send("POST /rpc", "Transfer-Encoding: chunked", b"100000\r\n" + bytes(MIB) + b"\r\n")
    assert send("POST /rpc", f"Content-Length: {64 * MIB}", bytes(MIB))
    assert send("GET /events", "X: 1", b"X-More: 1234567\r\n" * (MIB // 16)), "one head"
    assert peak_kib(daemon) - before < 8 * 1024, (before, peak_kib(daemon))


def peak_kib(process):
    return int(re.search(r"VmHWM:\s*(\d+)", pathlib.Path(f"/proc/{process.pid}/status").read_text()).group(1))


class Drip:
    """Clients without a token that never complete their requests and send a byte a second each."""
    def __init__(self, web, count):
        self.wires = [socket.create_connection(("127.0.0.1", web.port)) for _ in range(count)]
        for wire in self.wires:
            wire.sendall(b"GET /events HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
        self.enough = threading.Event()
        self.thread = threading.Thread(target=self.drip)
        self.thread.start()

    def drip(self):
        while not self.enough.wait(1):
            for wire in self.wires:
                with contextlib.suppress(OSError):
                    wire.sendall(b"x")

    def end(self):
        self.enough.set()
        self.thread.join()
        for wire in self.wires:
            wire.close()


def slow(web):
    """Even many slow clients delay no other client. They get 10 s and then an error."""
    dripping = Drip(web, 200)
    quick = Web(web.port, web.token, patience_s=8)
    quick.call("rig.halt")
    quick.call("rig.reset", reason="test")
    assert answer_of(dripping.wires[-1])[0] == 408, "the newest, which made the oldest go"
    dripping.end()


def out_of_descriptors(web, daemon, folder):
    """Connections use up the daemon's descriptors: HTTP frees some, and the daemon does not spin."""
    opened = len(list(pathlib.Path(f"/proc/{daemon.pid}/fd").iterdir()))
    _, hard = resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE, (opened + 10, hard))
    idle = [socket.create_connection(("127.0.0.1", web.port)) for _ in range(30)]
    Web(web.port, web.token, patience_s=8).call("rig.state")
    for _ in range(30):  # Unix-socket clients are not closed for others
        idle.append(socket.socket(socket.AF_UNIX))
        idle[-1].connect(str(folder / "data/weftd.sock"))
    web.call("rig.state")
    used = cpu_s(daemon)
    time.sleep(1)
    assert cpu_s(daemon) - used < 0.3, "it spins"
    for wire in idle:
        wire.close()
    resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE, (hard, hard))


def cpu_s(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def too_many(web):
    """Streams and waiting calls are limited in number; a client that has gone frees its place."""
    held = [web.ask("GET", "/events") for _ in range(36)]
    statuses = [response.status for response in held]
    assert statuses == 32 * [200] + 4 * [503], statuses
    assert held[-1].headers["Retry-After"]
    for response in held:
        response.close()
    until_it_is(200, lambda: web.ask("GET", "/events").status)

    lease = web.call("lease.acquire")["lease"]
    run = paused(web, lease, lambda run: web.call("run.pause", run=run, at="now"))
    for _ in range(40):
        web.wait_for(run).close()
    web.call("system.ready")
    waiting = [web.wait_for(run) for _ in range(16)]
    web.call("system.ready")
    refused = web.wait_for(run)
    assert answer_of(refused)[0] == 503
    Web(web.port, web.token, patience_s=8).call("run.abort", run=run)
    for wire in waiting:
        status, body = answer_of(wire)
        assert status == 200 and json.loads(body)["result"]["outcome"] == "aborted", body
    web.call("lease.release", lease=lease)


def until_it_is(wanted, look):
    for _ in range(100):
        if look() == wanted:
            return
    raise AssertionError(f"never {wanted}")


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
    web.call("lease.release", lease=lease)


def begin(folder, name, port="0"):
    return subprocess.Popen(command(WEFTD, ROOT, folder, "--tokens", folder / "tokens.json", "--http", port, data=name),
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def one_port(web, folder):
    second = begin(folder, "other", str(web.port))
    try:
        _, printed = second.communicate(timeout=30)
    finally:
        second.kill()
    assert second.returncode == 1 and line_has(printed, [f"127.0.0.1:{web.port}", os.strerror(errno.EADDRINUSE)]), (second.returncode, printed)


def end(web, daemon):
    """Streams, waiting calls and slow clients do not prevent the daemon from ending."""
    lease = web.call("lease.acquire")["lease"]
    run = paused(web, lease, lambda run: web.call("run.pause", run=run, at="now"))
    stream, waiting, dripping = Events(web), web.wait_for(run), Drip(web, 3)
    assert stream.next()[0] == "snapshot"
    web.call("system.ready")  # earlier requests have been received
    daemon.terminate()
    assert daemon.wait(30) == 0
    status, said = answer_of(waiting)  # the run ends first, and the waiting call gets its result
    assert (status, json.loads(said)["result"]["state"]) == (200, "interrupted"), (status, said)
    stream.response.close()
    dripping.end()


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-http-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe["fabrics"], recipe["repetitions"] = ["denim"], 2
        (folder / "recipes").mkdir()
        (folder / "recipes" / "small.json").write_text(json.dumps(recipe))
        admin, viewer = (token_of(WEFT, folder / "tokens.json", role, role) for role in ("admin", "observer"))
        daemon = begin(folder, "data")
        try:
            port = int(re.search(r"http://127\.0\.0\.1:(\d+)", daemon.stdout.readline()).group(1))
            web = Web(port, admin)
            requests(web, Web(port, viewer))
            refusals(web)
            tokens(web, Web(port, viewer), folder)
            pages(web, folder)
            unusual(web)
            events(web)
            order(web, folder)
            a_run(web)
            one_port(web, folder)
            endless(web, daemon)
            slow(web)
            out_of_descriptors(web, daemon, folder)
            too_many(web)
            end(web, daemon)
        finally:
            daemon.kill()
    print("weftd over HTTP: all of it held (simulated)")


main()
