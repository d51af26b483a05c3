#!/usr/bin/env python3
"""weftd as a process under a service manager: SIGHUP in a run, messages by sd_notify's protocol, its journal on standard output, refused tokens. All
simulated.

    weftd_process.py WEFTD WEFT SOURCE_ROOT
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading

from weftd_support import PATIENCE_S, Client, certificate, command, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
FLOOD = 1000


class Manager(threading.Thread):
    """The end of NOTIFY_SOCKET: the received messages, by name."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.said, self.news = [], threading.Condition()
        self.start()

    def run(self):
        while True:
            lines = self.socket.recv(4096).decode().splitlines()
            with self.news:
                self.said += [tuple(line.split("=", 1)) for line in lines]
                self.news.notify_all()

    def wait_for(self, name, value=None, times=1):
        def found():
            return [v for n, v in self.said if n == name and value in (None, v)]
        with self.news:
            assert self.news.wait_for(lambda: len(found()) >= times, PATIENCE_S), (name, value, self.said)
            return found()


class Process:
    """weftd with JSON on standard output; keeps every line."""

    def __init__(self, folder, manager, *more):
        env = {**os.environ, "NOTIFY_SOCKET": str(manager), "WATCHDOG_USEC": "400000"}
        env.pop("WATCHDOG_PID", None)
        self.process = subprocess.Popen(command(WEFTD, ROOT, folder, "--log-format", "json", "--pace", "4", *more), env=env,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.lines, self.news = [], threading.Condition()
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        self.ready = self.wait_for(lambda line: line["kind"] == "daemon.ready")
        assert self.ready is self.lines[0], "scripts wait for the first line"
        self.ports = [int(port) for port in re.findall(r":(\d+)", self.ready["text"])]

    def read(self):
        for text in self.process.stdout:
            with self.news:
                self.lines.append(json.loads(text))
                self.news.notify_all()

    def wait_for(self, wanted, times=1):
        def found():
            return [line for line in self.lines if wanted(line)]
        with self.news:
            assert self.news.wait_for(lambda: len(found()) >= times, PATIENCE_S), self.lines
            return found()[times - 1]


def served(port, cert):
    """The certificate of a new connection, and that connection."""
    context = ssl.create_default_context(cafile=cert)
    wire = context.wrap_socket(socket.create_connection(("127.0.0.1", port), PATIENCE_S), server_hostname="localhost")
    return ssl.DER_cert_to_PEM_cert(wire.getpeercert(binary_form=True)), wire


def says(wire, lines, method, **params):
    wire.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "method": method, "params": params}).encode() + b"\n")
    return json.loads(lines.readline())


def opened(port, cert, token):
    _, wire = served(port, cert)
    lines = wire.makefile("r")
    lines.readline()
    return says(wire, lines, "session.open", client="x", token=token), wire, lines


def reloads(daemon, manager, folder, client, run):
    """During a run: new connections use a new certificate and token, old ones are unchanged; a bad certificate changes nothing."""
    key, cert = folder / "good.key", folder / "good.pem"
    first = cert.read_text()
    seen, old = served(daemon.ports[0], cert)
    assert seen == first
    old_lines = old.makefile("r")
    old_lines.readline()
    new_key, new_cert = certificate(folder, "new", "DNS:localhost,IP:127.0.0.1")
    second = new_cert.read_text()
    new_key.replace(key)
    new_cert.replace(cert)
    token = token_of(WEFT, folder / "data/tokens.json", "later", "observer")
    daemon.process.send_signal(signal.SIGHUP)
    told = daemon.wait_for(lambda line: line["kind"] == "daemon.reloaded")
    assert told["data"] == {"reloaded": ["tokens", "certificate"]} and told["level"] == "info", told
    assert served(daemon.ports[0], cert)[0] == second
    assert opened(daemon.ports[0], cert, token)[0]["result"]["role"] == "observer"
    assert says(old, old_lines, "session.open", client="x", token=token)["result"]["role"] == "observer", "the old connection goes on"
    (reloading,) = manager.wait_for("RELOADING", "1")
    assert int(manager.wait_for("MONOTONIC_USEC")[0]) > 0 and reloading
    manager.wait_for("READY", "1", times=2)
    cert.write_text("no certificate\n")
    daemon.process.send_signal(signal.SIGHUP)
    told = daemon.wait_for(lambda line: line["kind"] == "daemon.reloaded", times=2)
    assert told["data"]["reloaded"] == ["tokens"] and str(cert) in told["data"]["error"] and told["level"] == "error", told
    cert.write_text(second)
    assert served(daemon.ports[0], cert)[0] == second, "the old one stays"
    assert client.call("run.get", run=run)["state"] == "running", "the run goes on"
    journal = client.call("log.query", kind="daemon.reloaded")["lines"]
    assert len(journal) == 2 and "error" in journal[1]["data"], journal


def refused_tokens(daemon, folder, client, cert, token):
    """Many refusals give two lines of the journal, and limit their address to stops; other addresses are not affected."""
    _, staying, staying_lines = opened(daemon.ports[0], cert, token)
    kinds = []
    for _ in range(FLOOD):
        answer, wire, _ = opened(daemon.ports[0], cert, "wft_" + 64 * "0")
        kinds.append(answer["error"]["data"]["kind"])
        wire.close()
    first = kinds.index("access.limited")
    assert first == 20 and set(kinds[:first]) == {"access.token"}, kinds[:40]
    assert "access.limited" in kinds[-40:], "no longer limited"
    assert client.call("system.info")["product"] == "weftd", "the Unix socket is not limited"
    assert "result" in says(staying, staying_lines, "rig.state"), "nor a session of before"
    answer, wire, lines = opened(daemon.ports[0], cert, token)
    assert answer["result"]["role"] == "operator", answer
    limited = says(wire, lines, "run.list")
    if "error" in limited:  # the window may have ended just now
        assert limited["error"]["data"]["kind"] == "access.limited", limited
    assert says(wire, lines, "rig.halt")["result"]["latched"] is True, "a halt is never limited"


def refusals_on_record(daemon):
    lines = [line for line in daemon.lines if line["kind"] == "token.refused"]
    assert sum(line["data"]["count"] for line in lines) == FLOOD, lines
    assert {line["data"]["address"] for line in lines} == {"127.0.0.1"} and {line["level"] for line in lines} == {"warning"}, lines
    seconds = (lines[-1]["t_us"] - lines[0]["t_us"]) / 1e6
    assert len(lines) <= 2 + seconds / 10, (len(lines), seconds)


def log_on_output(daemon, folder, run):
    """Each line of the journal appears once, in order, with the state lines of the run."""
    later = subprocess.run([sys.executable, "-c", "import sqlite3, sys, json\n"
                            "rows = sqlite3.connect(sys.argv[1]).execute('SELECT utc_us, run, kind, by FROM journal ORDER BY sequence')\n"
                            "print(json.dumps(list(rows)))", folder / "data/weftd.sqlite"], check=True, capture_output=True, text=True)
    journal = [tuple(row) for row in json.loads(later.stdout)]
    logged = [(line["t_us"], line.get("run", ""), line["kind"], line["by"]) for line in daemon.lines if line["kind"] != "daemon.ready"]
    assert logged == journal, [pair for pair in zip(logged, journal) if pair[0] != pair[1]][:3]
    states = [line["data"]["state"] for line in daemon.lines if line.get("run") == run and line["kind"] == "state"]
    assert states[:2] == ["arming", "running"] and states[-1] in ("ended", "interrupted"), states
    assert all(line["level"] in ("info", "warning", "error") and line["time"].endswith("Z") for line in daemon.lines)


def under_a_manager(folder):
    key, cert = certificate(folder, "good", "DNS:localhost,IP:127.0.0.1")
    (folder / "data").mkdir()
    token = token_of(WEFT, folder / "data/tokens.json", "ada", "operator")
    manager = Manager(folder / "notify")
    daemon = Process(folder, folder / "notify", "--port", "0", "--tls-cert", cert, "--tls-key", key)
    try:
        client = Client(folder / "data/weftd.sock")
        manager.wait_for("READY", "1")
        manager.wait_for("WATCHDOG", "1", times=2)
        client.call("sub.open", topics=["run:*"], mode="every")
        lease = client.call("lease.acquire", ttl_ms=600_000)["lease"]
        run = client.call("run.start", recipe="small", lease=lease)["run"]
        client.until(run, "running")
        manager.wait_for("STATUS", f"bench17 moving; {run} running; 0 queued")
        reloads(daemon, manager, folder, client, run)
        daemon.process.send_signal(signal.SIGTERM)
        manager.wait_for("STOPPING", "1")
        assert int(manager.wait_for("EXTEND_TIMEOUT_USEC")[0]) > 60_000_000, "the deadline of a run that is aborted: two minutes and its retreat"
        assert daemon.process.wait(PATIENCE_S) == 0
        daemon.reader.join()
        log_on_output(daemon, folder, run)
        daemon = Process(folder, folder / "notify", "--port", "0", "--tls-cert", cert, "--tls-key", key)
        refused_tokens(daemon, folder, Client(folder / "data/weftd.sock"), cert, token)
        daemon.process.send_signal(signal.SIGTERM)
        assert daemon.process.wait(PATIENCE_S) == 0
        daemon.reader.join()
        refusals_on_record(daemon)
    finally:
        daemon.process.kill()


def never_ready(folder):
    """With an unusable rig file: status 1 and the reason, no message to the service manager, no socket."""
    rig = json.loads((ROOT / "sim/rigs/bench17.json").read_text())
    unknown_driver = {**rig, "devices": [{**device, "driver": "ati_rtd"} for device in rig["devices"]]}
    secret = folder / "secret.json"
    secret.mkdir()  # a folder in place of the file cannot be read by any user, not even root
    cases = {"unknown_driver": (json.dumps(unknown_driver), "ati_rtd"), "cut": (json.dumps(rig)[:500], "rig"), "empty": ("", "rig")}
    for name, (text, reason) in {**cases, "secret": (None, "secret.json")}.items():
        file = folder / f"{name}.json"
        if text is not None:
            file.write_text(text)
        manager = Manager(folder / f"notify-{name}")
        ended = subprocess.run(command(WEFTD, ROOT, folder, data=f"data-{name}", rig=file), env={**os.environ, "NOTIFY_SOCKET": str(folder / f"notify-{name}")},
                               capture_output=True, text=True, timeout=PATIENCE_S)
        assert ended.returncode not in (0, None) and ended.returncode > 0, (name, ended)
        assert ended.stdout == "" and reason in ended.stderr and str(file) in ended.stderr, (name, ended)
        assert manager.said == [] and not (folder / f"data-{name}/weftd.sock").exists(), (name, manager.said)


def nobody_reads(folder):
    """Unread output blocks no request and does not prevent the end."""
    process = subprocess.Popen(command(WEFTD, ROOT, folder, data="unread"), stdout=subprocess.PIPE, text=True)
    try:
        assert re.fullmatch(r"weftd: .*\bready\b.*\n", process.stdout.readline())
        client = Client(folder / "unread/weftd.sock")
        for number in range(600):  # at least 200 bytes each: a pipe holds 64 KiB
            lease = client.call("lease.acquire", ttl_ms=60_000)["lease"]
            client.call("lease.release", lease=lease)
        assert client.call("system.info")["product"] == "weftd"
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE_S) == 0
    finally:
        process.kill()


def main():
    if not shutil.which("openssl"):
        print("skipped: no openssl")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
        recipe["fabrics"], recipe["repetitions"] = ["denim"], 3
        (folder / "recipes").mkdir()
        (folder / "recipes/small.json").write_text(json.dumps(recipe))
        under_a_manager(folder)
        never_ready(folder)
        nobody_reads(folder)
    print("weftd_process: all as it should be (simulated)")


main()
