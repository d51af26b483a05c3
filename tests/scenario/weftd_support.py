"""weftd for scenario tests: runs the daemon during a test, and a client of its socket, with the standard library only."""
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess

PATIENCE_S = 240  # for an answer [s]; only a hanging daemon needs it


class Daemon:
    """Recipes are in folder/recipes, data in folder/data or folder/`data`; the rig is the demo's or `rig`. `ready` is its first line: its ports."""

    def __init__(self, weftd, root, folder, *more, descriptors=None, data="data", rig=None):
        self.socket = folder / data / "weftd.sock"
        limit = (lambda: resource.setrlimit(resource.RLIMIT_NOFILE, descriptors if isinstance(descriptors, tuple) else (descriptors, descriptors))) if descriptors else None
        self.process = subprocess.Popen(command(weftd, root, folder, *more, data=data, rig=rig), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True, preexec_fn=limit)
        self.ready = self.process.stdout.readline()
        assert re.match(r"weftd: .*\bready\b", self.ready), self.process.stderr.read()
        found = re.search(r":(\d+)", self.ready.partition("ready")[2])
        self.port = int(found.group(1)) if found else None

    def resident_kib(self):
        text = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", text).group(1))

    def descriptors(self):
        return len(list(pathlib.Path(f"/proc/{self.process.pid}/fd").iterdir()))

    def cpu_s(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        return self.process.wait(PATIENCE_S)


def command(weftd, root, folder, *more, data="data", rig=None):
    return [weftd, "--rig", rig or root / "sim/rigs/bench17.json", "--recipes", folder / "recipes", "--data", folder / data, *more]


def token_of(weft, file, name, role):
    return subprocess.run([weft, "token", "add", name, "--role", role, "--tokens", file], check=True, capture_output=True,
                          text=True).stdout.strip()


def certificate(folder, name, san):
    """A new key and certificate for these names, valid for two days."""
    key, cert = folder / f"{name}.key", folder / f"{name}.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                    "-subj", "/CN=weft test", "-addext", f"subjectAltName={san}", "-keyout", key, "-out", cert],
                   check=True, capture_output=True)
    key.chmod(0o600)
    return key, cert


class Client:
    def __init__(self, where, introduce=True):
        self.wire = socket.socket(socket.AF_INET if isinstance(where, tuple) else socket.AF_UNIX)
        self.wire.settimeout(PATIENCE_S)
        self.wire.connect(where if isinstance(where, tuple) else str(where))
        self.lines = self.wire.makefile("r", encoding="utf-8")
        self.events, self.last = [], 0
        self.greeting = self.read()
        assert self.greeting["method"] == "hello" and self.greeting["params"]["product"] == "weftd", self.greeting
        if introduce:
            self.session = self.call("session.open", client="test", protocol="1.x")

    def read(self):
        line = self.lines.readline()
        assert line, "the daemon closed the connection"
        return json.loads(line)

    def send(self, text):
        self.wire.sendall(text.encode() + b"\n")

    def answer(self, method, **params):
        self.last += 1
        self.send(json.dumps({"jsonrpc": "2.0", "id": self.last, "method": method, "params": params}))
        while True:
            message = self.read()
            if message.get("method") == "event":
                self.events.append(message["params"])
            elif message.get("id") == self.last:
                return message

    def call(self, method, **params):
        message = self.answer(method, **params)
        assert "result" in message, message
        return message["result"]

    def refused(self, method, **params):
        message = self.answer(method, **params)
        assert "error" in message, message
        return message["error"]

    def event(self):
        while not self.events:
            message = self.read()
            if message.get("method") == "event":
                self.events.append(message["params"])
        return self.events.pop(0)

    def until(self, run, state):
        """Follows the run's events until the run is in `state`."""
        while True:
            event = self.event()
            if event["topic"] == f"run:{run}" and event["delta"].get("state") == state:
                return event


def outlasted_its_lease(client, ttl_ms):
    """Checks in the journal that the newest lease was acquired for `ttl_ms`, held at least twice as long, and released by its holder."""
    lines = [line for line in client.call("log.tail", most=1000)["lines"] if line["kind"].startswith("lease.")]
    taken, last = [line for line in lines if line["kind"] == "lease.acquired"][-1], lines[-1]
    asked_ms = (taken["data"]["expires_us"] - taken["t_us"]) / 1000
    assert abs(asked_ms - ttl_ms) < 0.1 * ttl_ms, f"a lease of {asked_ms} ms: {taken}"
    assert last["kind"] == "lease.released" and last["data"]["lease"] == taken["data"]["lease"], last
    assert last["t_us"] - taken["t_us"] >= 2000 * ttl_ms, f"held {(last['t_us'] - taken['t_us']) / 1e6} s: {lines}"
