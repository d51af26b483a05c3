#!/usr/bin/env python3
"""weftd among people who mean it harm, or whose programs are broken: lines made up by a grammar, lines without end, clients that
drip, more clients than there are descriptors, sockets and token files that are not what they should be.

    weftd_hostile.py WEFTD WEFT SOURCE_ROOT [LINES]
"""
import json
import pathlib
import random
import resource
import select
import socket
import stat
import subprocess
import sys
import tempfile
import time

from weftd_support import Client, Daemon, command, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
LINES = int(sys.argv[4]) if len(sys.argv) > 4 else 3000
DESCRIPTORS = 200       # of the daemon, when many come at once
FLOOD = 10_000          # connections in all
CROWD = 1_000           # clients at a time that are no strangers


class Grammar:
    """JSON-RPC requests, from right ones to bytes that are no text."""

    def __init__(self, seed, methods):
        self.random = random.Random(seed)
        self.methods = methods  # name: parameters
        self.words = ["R-000001", "L-1", "u1", "small", "", "\u0000", "../../etc/passwd", "é" * 40, "run:*", "latest", "9" * 400]

    def value(self, depth=0):
        pick = self.random.randrange(9 if depth < 4 else 7)
        if pick == 7:
            return [self.value(depth + 1) for _ in range(self.random.randrange(4))]
        if pick == 8:
            return {self.random.choice(self.words): self.value(depth + 1) for _ in range(self.random.randrange(4))}
        return [None, True, self.random.randrange(-2**63, 2**64), self.random.uniform(-1e300, 1e300), self.random.choice(self.words),
                self.random.choice(self.words), -1][pick]

    def params(self, method):
        known = self.methods.get(method, [])
        out = {}
        for name in known:
            if self.random.random() < 0.8:
                out[name] = self.random.choice(self.words) if self.random.random() < 0.6 else self.value()
        if self.random.random() < 0.2:
            out[self.random.choice(["rum", "lease ", "__proto__", ""])] = self.value()
        return out if self.random.random() < 0.9 else self.value()

    def request(self):
        method = self.random.choice([*self.methods, "rum.start", "", "run.start\n", "rpc.", "$/cancel"])
        out = {"jsonrpc": "2.0", "id": self.random.choice([1, "a", None, 2**53, 1.5]), "method": method, "params": self.params(method)}
        for key in list(out):
            if self.random.random() < 0.06:
                del out[key]
            elif self.random.random() < 0.05:
                out[key] = self.value()
        return out

    def line(self):
        text = json.dumps(self.request(), ensure_ascii=self.random.random() < 0.5)
        raw = bytearray(text.replace("\n", " "), "utf-8")
        for _ in range(self.random.choice([0, 0, 0, 1, 3])):
            at = self.random.randrange(len(raw) + 1)
            edit = self.random.randrange(4)
            if edit == 0:
                raw[at:at] = bytes([self.random.choice([b for b in range(256) if b != 10])])
            elif edit == 1:
                del raw[at:at + self.random.randrange(1, 9)]
            elif edit == 2:
                raw[at:at] = self.random.choice([b"[" * 2000, b"{\"a\":" * 500, b"1e999", b"\\ud800", b"\xff\xfe", b"//"])
            else:
                raw = raw[:at]
        return bytes(raw)


def reset(client):
    """Whatever a request has made of the rig: it may be locked out, latched, both or neither."""
    if "locked" in client.call("rig.state"):
        client.call("rig.unlock", reason="the test is over")
    client.call("rig.reset", reason="the test is over")


def answers_due(line):
    """How many answers a line may have."""
    if not line.strip(b" \t\r"):
        return {0}
    try:
        request = json.loads(line)
    except ValueError:
        return {1}
    except RecursionError:  # deeper than Python's reader goes
        return {0, 1}
    # The daemon's reader of JSON may refuse what Python takes, a notification too; it never takes more.
    return {1} if not isinstance(request, dict) or "id" in request else {0, 1}


def grammar(daemon, token, role, but):
    """Every line that is not blank and no notification has one answer, and a client keeps its role. `but`: methods left out."""
    client = Client(("127.0.0.1", daemon.port), introduce=False)
    client.call("session.open", client="x", token=token)
    methods = {m["name"]: [p["name"] for p in m["params"]] for m in client.call("rpc.discover")["methods"]}
    for name in but:
        methods.pop(name)
    made = Grammar(2016, methods)
    errors = answers = 0
    for _ in range(LINES):
        line = made.line()
        due, got, after = answers_due(line), 0, False
        client.wire.sendall(line + b"\n" + b'{"jsonrpc":"2.0","id":"after","method":"session.whoami"}\n')
        while not after or got < min(due):  # a recipe that is checked is answered later than what came after it
            message = client.read()
            if message.get("id") == "after" and message.get("result", {}).get("client") == "x":
                assert message["result"]["role"] == role, f"after {line[:300]}: {message}"
                after = True
                continue
            if "method" not in message:
                got += 1
                errors += "error" in message
                kind = message.get("error", {}).get("data", {}).get("kind")
                assert "result" in message or kind, f"{line[:300]}: {message}"
        assert got in due, f"{got} answers to {line[:300]}"
        answers += got
    assert errors > LINES / 4 and answers > errors, (errors, answers)
    client.wire.close()
    return answers, errors


def observed(daemon, token):
    """An observer changes nothing, whatever it says. rig.halt is for everybody, see weftd_runs; run.wait may rightly wait; session.close ends the one that asks."""
    client = Client(daemon.socket)
    kept = {method: client.call(method) for method in ("recipe.list", "queue.list")}
    tokens = (daemon.socket.parent / "tokens.json").read_bytes()
    counted = grammar(daemon, token, "observer", ["rig.halt", "run.wait", "session.close"])
    for method, before in kept.items():
        assert client.call(method) == before, f"an observer has changed what {method} tells"
    assert (daemon.socket.parent / "tokens.json").read_bytes() == tokens, "an observer has changed the tokens"
    assert client.call("lease.list")["leases"] == [], "an observer has taken a lease"
    assert client.call("run.list")["runs"] == [], "an observer has started a run"
    return counted


def allowed_all(daemon, token):
    """Somebody who may do everything, on a rig that is latched: what he does not say right is refused, and nothing moves."""
    client = Client(daemon.socket)
    client.call("rig.halt")
    counted = grammar(daemon, token, "admin", ["rig.reset", "run.wait", "session.close"])
    assert client.call("rig.state")["rig"] == "latched"
    for lease in client.call("lease.list")["leases"]:
        client.call("lease.break", lease=lease["lease"], reason="the test is over")
    reset(client)
    return counted


def keys_twice(daemon):
    """A request that says two things is refused, and none of them is done; a halt is a halt all the same."""
    client = Client(daemon.socket)
    for params, where in ('{"recipe":"twice","content":{"repetitions":1,"repetitions":2}}', "/params/content/repetitions"), \
                         ('{"recipe":"twice","recipe":"other","content":{}}', "/params/recipe"):
        client.send('{"jsonrpc":"2.0","id":"twice","method":"recipe.put","params":' + params + "}")
        answer = client.read()
        assert answer["id"] == "twice" and answer["error"]["data"]["kind"] == "request.duplicate_key", answer
        assert answer["error"]["data"]["where"] == where, answer
    client.send('{"jsonrpc":"2.0","id":"halt","id":"halt","method":"rig.halt"}')
    halted = client.read()
    assert [w["data"]["kind"] for w in halted["result"]["warnings"]] == ["request.duplicate_key"], halted
    reset(client)


def hoards(daemon):
    """What a client sends is not kept because it is long, nor a question because nobody waits for its answer any more."""
    client = Client(daemon.socket)
    before = daemon.resident_kib()
    for i in range(60):
        for method, long in ("run.start", {"recipe": "small", "lease": "L-1", "name": "x" * 900_000}), \
                            ("lease.acquire", {"scope": "rig:" + "x" * 900_000}), ("lease.acquire", {"note": "x" * 900_000}):
            assert client.refused(method, idem=str(i), **long)["data"]["kind"] == "param.range"
    client.call("rig.halt")
    lease = client.call("lease.acquire")["lease"]
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    question = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "run.wait", "params": {"run": run}})
    for _ in range(400):
        gone = Client(daemon.socket)
        for _ in range(63):
            gone.send(question)
        gone.call("system.time")
        gone.wire.close()
    grown = daemon.resident_kib() - before
    assert grown < 4 * 1024, f"{grown} KiB are kept of what nobody needs"
    client.call("run.withdraw", run=run)
    client.call("lease.release", lease=lease)
    reset(client)


def nested(folder, daemon):
    """Files nested deeper than a stack is high, and an observer who asks all that can be asked about them."""
    for leaf in "12":
        (folder / f"recipes/deep{leaf}.json").write_text("[" * 200_000 + leaf + "]" * 200_000)
    client = Client(daemon.socket)
    assert not client.call("recipe.check", recipe="deep1")["ok"]
    for method, params in ("recipe.plan", {"recipe": "deep1"}), ("recipe.diff", {"recipe": "deep1", "other": "deep2"}), \
                          ("recipe.diff", {"recipe": "small", "other": "deep2"}):
        assert "nested too deeply" in client.refused(method, **params)["message"], method
    client.call("system.ready")


def plans_beside_a_halt(folder, daemon):
    """Campaigns of nearly a million trials are planned, compared and put in line while somebody halts: he is answered before half of
    them are. None begins: there is no disk for them."""
    huge = json.loads((ROOT / "recipes/library/m1.json").read_text())
    huge.update(repetitions=1_000_000 // len(huge["fabrics"]) - 1, order={"kind": "randomised"})
    (folder / "recipes/huge.json").write_text(json.dumps(huge))
    halts = Client(daemon.socket)
    lease = halts.call("lease.acquire", ttl_ms=600_000)["lease"]
    questions = [("recipe.plan", {"recipe": "huge", "most": 1}), ("recipe.diff", {"recipe": "huge", "other": "small"}),
                 ("run.start", {"recipe": "huge", "lease": lease}), ("queue.add", {"recipe": "huge", "lease": lease})] * 3
    askers = [Client(daemon.socket) for _ in questions]
    for client, (method, params) in zip(askers, questions):
        client.send(json.dumps({"jsonrpc": "2.0", "id": "plan", "method": method, "params": params}))
    time.sleep(0.1)  # they are all there
    halts.call("rig.halt")
    answered = select.select([client.wire for client in askers], [], [], 0)[0]
    assert len(answered) < len(askers) / 2, f"{len(answered)} of {len(askers)} plans were made before the halt was answered"
    for client, (method, _) in zip(askers, questions):
        message = client.read()
        assert message["id"] == "plan" and ("result" in message) == method.startswith("recipe."), message
        client.wire.close()
    assert not [run for run in halts.call("run.list")["runs"] if run["recipe"] == "huge"]
    halts.call("lease.release", lease=lease)
    reset(halts)


def endless_line(daemon):
    """100 MB without a line's end: told, closed, and never held."""
    before = daemon.resident_kib()
    client = Client(daemon.socket, introduce=False)
    sent = 0
    try:
        for _ in range(100):
            client.wire.sendall(b"x" * 1_000_000)
            sent += 1
    except (BrokenPipeError, ConnectionResetError):
        pass
    assert sent < 20, f"{sent} MB were taken of a line of at most 1 MiB"
    assert daemon.resident_kib() - before < 16 * 1024, f"{before} KiB before, {daemon.resident_kib()} after"


def drips(daemon):
    """Bytes that come one by one keep nobody else waiting; who does not introduce himself is sent away."""
    slow = [Client(daemon.socket, introduce=False) for _ in range(50)]
    begin = time.monotonic()
    gone = False
    while not gone and time.monotonic() - begin < 30:
        for client in slow:
            try:
                client.wire.sendall(b"{")
            except (BrokenPipeError, ConnectionResetError):
                gone = True
        other = Client(daemon.socket)
        other.call("system.ready")
        other.wire.close()
        time.sleep(0.2)
    assert gone, "clients that never introduce themselves are still there after 30 s"


def flood(daemon):
    """More clients than descriptors: those that are there are served, and when the others are gone new ones are."""
    old = Client(daemon.socket)
    waiting, came = [], 0
    for i in range(FLOOD):
        for _ in range(1000):
            wire = socket.socket(socket.AF_UNIX)
            wire.settimeout(10)
            try:
                wire.connect(str(daemon.socket))
                came += 1
                break
            except BlockingIOError:  # the queue of those who wait is full
                wire.close()
                if waiting:
                    waiting.pop(0).close()
                time.sleep(0.001)
        waiting.append(wire)
        if len(waiting) > 3 * DESCRIPTORS:
            waiting.pop(0).close()
        if i % 1000 == 0:
            old.call("system.ready")
    assert came == FLOOD, f"{came} of {FLOOD} connections were made"
    for _ in range(5):  # those that stood in the queue are heard and sent away first
        spent = daemon.cpu_s()
        time.sleep(1)
        spent = daemon.cpu_s() - spent
        if spent < 0.05:
            break
    assert spent < 0.05, f"it spins while clients wait: {spent:.2f} s of processor in a second"
    assert daemon.descriptors() < DESCRIPTORS - 50, "nothing is left for devices and files"
    old.call("system.ready")
    for wire in waiting:
        wire.close()
    Client(daemon.socket).call("system.ready")


def crowd(folder):
    """A thousand clients that said who they are, at a daemon that a shell started with its 1 024 descriptors: each is served."""
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    daemon = Daemon(WEFTD, ROOT, folder, data="crowd", descriptors=(min(1024, hard), hard))
    clients = [Client(daemon.socket) for _ in range(CROWD)]
    for client in clients:
        client.call("system.time")
    assert daemon.descriptors() > CROWD
    assert daemon.end() == 0


def refuses_to_start(folder, sentence, *options):
    ran = subprocess.run(command(WEFTD, ROOT, folder, *options), capture_output=True, text=True, timeout=60)
    assert ran.returncode == 1 and sentence in ran.stderr, f"{ran.returncode}: {ran.stderr}"


def places(folder):
    """A symbolic link where the socket should be, and tokens that everybody may read."""
    target = folder / "elsewhere"
    target.write_text("precious")
    link = folder / "link.sock"
    link.symlink_to(target)
    refuses_to_start(folder, "a symbolic link", "--socket", str(link))
    assert target.read_text() == "precious" and link.is_symlink()
    tokens = folder / "open_tokens.json"
    tokens.write_text('{"tokens": []}')
    tokens.chmod(0o644)
    refuses_to_start(folder, "chmod 600", "--tokens", str(tokens), "--socket", str(folder / "b.sock"), "--port", "0")


def main():
    with tempfile.TemporaryDirectory(prefix="weft-hostile-") as name:
        folder = pathlib.Path(name)
        (folder / "recipes").mkdir()
        (folder / "data").mkdir()
        places(folder)
        (folder / "recipes/small.json").write_text((ROOT / "recipes/library/m1.json").read_text())
        viewer, owner = (token_of(WEFT, folder / "data/tokens.json", role, role) for role in ("observer", "admin"))
        resource.setrlimit(resource.RLIMIT_NOFILE, (4096, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
        daemon = Daemon(WEFTD, ROOT, folder, "--port", "0", descriptors=DESCRIPTORS)
        assert stat.S_IMODE(daemon.socket.stat().st_mode) == 0o660
        answers, errors = map(sum, zip(observed(daemon, viewer), allowed_all(daemon, owner)))
        keys_twice(daemon)
        hoards(daemon)
        nested(folder, daemon)
        plans_beside_a_halt(folder, daemon)
        endless_line(daemon)
        drips(daemon)
        flood(daemon)
        assert daemon.end() == 0
        crowd(folder)
    print(f"weftd: {2 * LINES} lines of a grammar, {answers} answers, {errors} of them errors; long lines, drips, a flood: it held")


main()
