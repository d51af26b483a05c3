#!/usr/bin/env python3
"""Notifications of weftd and metrics for Prometheus: events to a real HTTP server and a real mosquitto, and GET /metrics. All simulated.

    weftd_notify.py WEFTD WEFT SOURCE_ROOT [--promtool]

The HTTP server refuses the first event twice. mosquitto uses TLS with a password, is stopped and started again, and sends the last will after kill
-9. Without mosquitto the test is skipped (77). promtool checks the metrics if it is installed; --promtool downloads it.
"""
import http.client
import http.server
import json
import os
import pathlib
import queue
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading

from weftd_support import PATIENCE_S, Client, Daemon, certificate, command, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
MOSQUITTO = shutil.which("mosquitto", path=os.environ["PATH"] + ":/usr/sbin")
TOPIC = "lab/bench17"


class Receiver:
    """An HTTP server. `statuses`: of the next answers, then 200. `posts`: (headers, body) of requests answered with 200."""

    def __init__(self):
        self.statuses, self.refused, self.posts = [], 0, queue.Queue()
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"])).decode()
                status = outer.statuses.pop(0) if outer.statuses else 200
                if status == 200:
                    outer.posts.put((self.headers, body))
                else:
                    outer.refused += 1
                self.send_response(status)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def url(self):
        return f"http://127.0.0.1:{self.server.server_port}/weft"

    def next(self):
        headers, body = self.posts.get(timeout=PATIENCE_S)
        assert headers["Authorization"] == "Bearer tk_secret", headers
        return headers, json.loads(body)


class Broker:
    def __init__(self, folder):
        self.folder = folder
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.key, self.certificate = certificate(folder, "broker", "DNS:localhost,IP:127.0.0.1")
        (folder / "users").touch(0o600)
        subprocess.run(["mosquitto_passwd", "-b", folder / "users", "weft", "brokerpass"], check=True, capture_output=True)
        (folder / "mosquitto.conf").write_text(f"listener {self.port} 127.0.0.1\ncertfile {self.certificate}\nkeyfile {self.key}\n"
                                               f"allow_anonymous false\npassword_file {folder}/users\nuser root\nlog_dest stderr\n"
                                               f"persistence true\npersistence_location {folder}/\n")
        self.start()

    def start(self):
        self.process = subprocess.Popen([MOSQUITTO, "-c", self.folder / "mosquitto.conf"], stderr=subprocess.PIPE, text=True)
        for line in self.process.stderr:
            if "running" in line:
                break
        else:
            raise AssertionError("mosquitto did not start")
        threading.Thread(target=self.process.stderr.read, daemon=True).start()

    def stop(self):
        self.process.terminate()
        self.process.wait(PATIENCE_S)


def lease_of(client):
    """The present lease, or a new one of a minute."""
    held = client.call("lease.list")["leases"]
    return held[0]["lease"] if held else client.call("lease.acquire", ttl_ms=60_000)["lease"]


def text_field(text):
    return len(text).to_bytes(2, "big") + text.encode()


class Subscriber:
    """MQTT 3.1.1 with the standard library: all topics of the bench, QoS 0. `kept`: the newest retained message of each."""

    def __init__(self, broker):
        context = ssl.create_default_context(cafile=broker.certificate)
        raw = socket.create_connection(("127.0.0.1", broker.port), PATIENCE_S)
        self.wire = context.wrap_socket(raw, server_hostname="localhost")
        self.stream = self.wire.makefile("rb")
        self.send(0x10, text_field("MQTT") + b"\x04\xc2\x00\x00" + text_field("test") + text_field("weft") + text_field("brokerpass"))
        assert self.read() == (0x20, b"\x00\x00")
        self.send(0x82, b"\x00\x01" + text_field(TOPIC + "/#") + b"\x00")
        self.waiting = []
        while (message := self.read())[0] != 0x90:  # retained messages may come first
            self.waiting.append(message)

    def send(self, kind, payload):
        assert len(payload) < 128
        self.wire.sendall(bytes([kind, len(payload)]) + payload)

    def read(self):
        kind, length, shift = self.stream.read(1), 0, 0
        assert kind, "the broker closed the connection"
        while True:
            byte = self.stream.read(1)[0]
            length |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return kind[0], self.stream.read(length)

    def next(self, name, wanted=lambda payload: True):
        """The next message of TOPIC/name for which `wanted` is true: (payload, retained). Other messages stay queued."""
        skipped = []
        while True:
            kind, payload = message = self.waiting.pop(0) if self.waiting else self.read()
            assert kind & 0xF0 == 0x30, kind
            length = int.from_bytes(payload[:2], "big")
            topic, text = payload[2:2 + length].decode(), payload[2 + length:].decode()
            if topic != f"{TOPIC}/{name}":
                skipped.append(message)
                continue
            found = json.loads(text) if text.startswith("{") else text
            if wanted(found):
                self.waiting = skipped + self.waiting
                return found, bool(kind & 1)

    def close(self):
        self.wire.close()


def write_recipe(folder, name, **changes):
    recipe = json.loads((ROOT / "recipes/library/m1.json").read_text())
    recipe.pop("$schema")
    recipe.update({"fabrics": ["denim"], "repetitions": 1} | changes)
    (folder / "recipes" / f"{name}.json").write_text(json.dumps(recipe))


def prepare(folder, receiver, broker):
    (folder / "recipes").mkdir()
    write_recipe(folder, "people", operator_steps=[{"before": "fabric", "text": "Mount {fabric}.", "people_s": 5}])
    write_recipe(folder, "two", fabrics=["denim", "satin"], operator_steps=[{"before": "fabric", "text": "Mount {fabric}.", "people_s": 5}])
    for name, secret in ("webhook.token", "tk_secret\n"), ("mqtt.password", "brokerpass\n"):
        (folder / name).write_text(secret)
        (folder / name).chmod(0o600)
    settings = {"disk_low_gb": 900000,
                "webhook": {"url": receiver.url(), "token_file": "webhook.token", "headers": {"X-Title": "{title}"},
                            "body": {"event": "{event}", "run": "{run}", "priority": "{priority}", "text": "{text}", "outcome": "{outcome}"}},
                "mqtt": {"host": "127.0.0.1", "port": broker.port, "topic": TOPIC, "user": "weft", "password_file": "mqtt.password",
                         "ca_file": str(broker.certificate)}}
    (folder / "notify.json").write_text(json.dumps(settings))
    return folder / "notify.json"


def refused_secret(folder, settings):
    """The daemon ends before it serves if other users can read its secret."""
    (folder / "webhook.token").chmod(0o644)
    ran = subprocess.run(command(WEFTD, ROOT, folder, "--notify", settings), capture_output=True, text=True, timeout=PATIENCE_S)
    assert ran.returncode == 1 and "webhook.token" in ran.stderr and "tk_secret" not in ran.stderr, ran
    (folder / "webhook.token").chmod(0o600)


def expect(receiver, subscriber, event, **facts):
    """Expects the same event at both receivers, in order."""
    headers, posted = receiver.next()
    published, retained = subscriber.next("event")
    assert not retained and posted["event"] == published["event"] == event, (event, posted, published)
    assert headers["X-Title"] == published["title"] and posted["priority"] == published["priority"], (headers, published)
    for key, value in facts.items():
        assert published[key] == value, (key, value, published)
    return published


def runs(client, receiver, subscriber):
    run = client.call("run.start", lease=lease_of(client), recipe="people")["run"]
    needed = expect(receiver, subscriber, "operator.needed", run=run)
    assert "Mount" in needed["text"], needed
    assert subscriber.next("state", lambda s: s["operator_prompt"])[0]["operator_prompt"] == needed["text"]
    prompt = client.call("run.get", run=run)["attention"]["step"]
    client.call("run.confirm", run=run, step=prompt)
    ended = client.call("run.wait", run=run)
    told = expect(receiver, subscriber, "run.ended", run=run, outcome="complete", trials_done=ended["trials_done"])
    assert told["trials_done"] == told["trials_planned"] > 0, told
    expect(receiver, subscriber, "queue.empty")
    state = subscriber.next("state", lambda s: s["last_run"] == run)[0]
    assert (state["run"], state["last_outcome"], state["latched"]) == (None, "complete", False), state

    failing = client.call("run.start", lease=lease_of(client), recipe="people")["run"]
    expect(receiver, subscriber, "operator.needed", run=failing)
    prompt = client.call("run.get", run=failing)["attention"]["step"]
    client.call("sim.inject", device="ft", fault="silent")
    client.answer("run.confirm", run=failing, step=prompt)  # the run may have failed already
    ended = client.call("run.wait", run=failing)
    assert ended["outcome"] == "failed", ended
    expect(receiver, subscriber, "run.failed", run=failing, outcome="failed", error=ended["error"], priority=5)
    expect(receiver, subscriber, "queue.empty")
    client.answer("rig.reset", reason="looked at")  # needed only if the run did not leave the rig safe


def latched_and_lost(client, receiver, subscriber):
    """An answer of 404 is final: it is counted and journalled."""
    client.call("rig.halt", reason="smoke")
    expect(receiver, subscriber, "rig.latched", rig="latched", priority=5)
    client.call("rig.halt", reason="smoke")  # changes nothing
    client.call("rig.reset", reason="looked at")
    receiver.statuses = [404]
    client.call("rig.halt", reason="again")
    subscriber.next("event", lambda e: e["event"] == "rig.latched")
    while not (lines := client.call("log.query", kind="notify.failed")["lines"]):
        pass
    assert len(lines) == 1 and lines[0]["data"]["to"] == "webhook" and lines[0]["data"]["lost"] == 1, lines
    assert "404" in lines[0]["data"]["error"] and "127.0.0.1" not in lines[0]["data"]["error"], lines
    client.call("rig.reset", reason="looked at")


def scrape(port, token, accept="text/plain"):
    wire = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    wire.request("GET", "/metrics", headers={"Accept": accept} | ({"Authorization": f"Bearer {token}"} if token else {}))
    response = wire.getresponse()
    return response.status, response.headers.get("Content-Type"), response.read().decode()


NAME = r"[a-z_][a-z0-9_]*"
SAMPLE = re.compile(rf'({NAME})(\{{{NAME}="(?:[^"\\\n]|\\[\\n"])*"(?:,{NAME}="(?:[^"\\\n]|\\[\\n"])*")*\}})? ([-+]?[0-9.]+(?:e[-+]?[0-9]+)?|NaN|[-+]Inf)')


def parse(text, is_open):
    """Strict parser: {sample with labels: value}; each family has TYPE and HELP once, before its samples, which are contiguous."""
    lines, types, helped, values = text.split("\n"), {}, set(), {}
    assert lines[-2:] == ["# EOF", ""], lines[-3:]
    family = None
    for line in lines[:-2]:
        if line.startswith("# TYPE "):
            _, _, family, kind = line.split(" ")
            assert family not in types and kind in ("counter", "gauge") and re.fullmatch(NAME, family), line
            types[family] = kind
        elif line.startswith("# HELP "):
            _, _, name, words = line.split(" ", 3)
            assert name == family and name not in helped and words, line
            helped.add(name)
        else:
            found = SAMPLE.fullmatch(line)
            assert found, line
            name, labels, value = found.groups()
            is_counter = types[family] == "counter"
            assert name == (family + "_total" if is_open and is_counter else family), line
            assert name.endswith("_total") == is_counter and name + (labels or "") not in values, line
            assert name in helped or family in helped, line
            values[name + (labels or "")] = float(value)
            assert not is_counter or values[name + (labels or "")] >= 0, line
    return values, {name + "_total" if is_open and kind == "counter" else name for name, kind in types.items()}


def dashboard_names():
    """All metrics that the dashboard uses."""
    board = json.loads((ROOT / "packaging/grafana-dashboard.json").read_text())
    asked = [target["expr"] for panel in board["panels"] for target in panel.get("targets", [])]
    assert asked and len({panel["id"] for panel in board["panels"]}) == len(board["panels"])
    functions = {"rate", "sum", "by", "increase", "max", "min", "last_over_time"}
    bare = [re.sub(r'\{[^}]*\}|\[[^\]]*\]|by \([^)]*\)|"[^"]*"', " ", expr) for expr in asked]
    return {word for expr in bare for word in re.findall(r"[a-z_]{2,}", expr)} - functions


def metrics(daemon, client, token, served_before):
    assert scrape(daemon.port, None)[0] == scrape(daemon.port, "wft_0")[0] == 401
    status, kind, text = scrape(daemon.port, token)
    assert status == 200 and kind == "text/plain; version=0.0.4; charset=utf-8", (status, kind)
    values, names = parse(text, False)
    status, kind, open_text = scrape(daemon.port, token, "application/openmetrics-text;version=1.0.0,text/plain;q=0.5")
    assert status == 200 and kind == "application/openmetrics-text; version=1.0.0; charset=utf-8", (status, kind)
    assert parse(open_text, True)[1] == names
    expected = {'weft_rig_state{state="safe"}': 1, 'weft_rig_state{state="moving"}': 0, "weft_run_active": 0, "weft_queue_length": 0, "weft_queue_paused": 0,
                'weft_runs_ended_total{outcome="complete"}': 1, 'weft_runs_ended_total{outcome="failed"}': 1, "weft_tokens_refused_total": 2,
                'weft_notifications_lost_total{to="webhook"}': 1, 'weft_notifications_lost_total{to="mqtt"}': 0}
    for name, value in expected.items():
        assert values[name] == value, (name, value, values[name])
    assert values['weft_requests_total{class="stop"}'] == 3 and values["process_resident_memory_bytes"] > 1e6, values
    # The scrape itself is a session.
    assert values["weft_sessions"] >= 2 and values["weft_disk_free_bytes"] > 0, values
    assert dashboard_names() <= names, dashboard_names() - names
    used = (ROOT / "packaging/prometheus.yml").read_text()
    assert set(re.findall(r"\bweft_[a-z_]+", used)) <= names and "bearer_token_file" not in used and "credentials_file" in used, used
    promtool(text)
    promtool(served_before)


def find_promtool(folder):
    """Debian's package has 96 MB, of which only this program is needed: it is unpacked, not installed."""
    if "--promtool" in sys.argv and shutil.which("promtool") is None:
        subprocess.run(["apt-get", "download", "-qq", "prometheus"], check=True, cwd=folder, capture_output=True)
        (package,) = folder.glob("prometheus_*.deb")
        subprocess.run(["dpkg-deb", "-x", package, folder / "prometheus"], check=True)
        os.environ["PATH"] += f":{folder}/prometheus/usr/bin"
        assert shutil.which("promtool"), "no promtool in the package"


def promtool(text):
    if shutil.which("promtool") is None:
        return
    ran = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ran.returncode == 0 and not ran.stderr, ran
    config = (ROOT / "packaging/prometheus.yml").read_text().replace("/etc/prometheus/weft.token", "/dev/null")
    ran = subprocess.run(["promtool", "check", "config", "--syntax-only", "/dev/stdin"], input=config, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ran.returncode == 0, ran


def metrics_of_a_run(daemon, client, token, receiver, subscriber):
    """Metrics of a run that waits for a person; those of the newest trial exist after it."""
    run = client.call("run.start", lease=lease_of(client), recipe="two")["run"]
    expect(receiver, subscriber, "operator.needed", run=run)
    client.call("run.confirm", run=run, step=client.call("run.get", run=run)["attention"]["step"])
    expect(receiver, subscriber, "operator.needed", run=run)
    text = scrape(daemon.port, token)[2]
    values, _ = parse(text, False)
    assert values["weft_run_active"] == 1 and values['weft_run_state{state="awaiting_operator"}'] == 1, values
    assert values['weft_rig_state{state="holding"}'] == 1 and values["weft_run_number"] == int(run[2:]), values
    assert 0 < values["weft_run_trials_done"] < values["weft_run_trials_planned"], values
    assert 0 < values["weft_run_force_rms_error_newtons"] < 1 and values["weft_run_frames_lost"] == 0, values
    assert 0 < values["weft_run_recorder_lag_seconds"], values
    client.call("run.abort", run=run)
    client.call("run.wait", run=run)
    expect(receiver, subscriber, "run.ended", run=run, outcome="aborted")
    expect(receiver, subscriber, "queue.empty")
    client.answer("rig.reset", reason="looked at")
    return text


def broker_comes_back(client, broker, receiver):
    """Events during the outage, and the state, are sent when the broker is back."""
    broker.stop()
    client.call("rig.halt", reason="no broker")
    assert receiver.next()[1]["event"] == "rig.latched"
    broker.start()
    subscriber = Subscriber(broker)
    assert subscriber.next("event")[0]["text"].count("no broker") == 1
    assert subscriber.next("state", lambda s: s["latched"])[0]["rig"] == "latched"
    subscriber.close()
    later = Subscriber(broker)
    assert later.next("availability") == ("online", True)
    assert later.next("state")[1] is True, "retained"
    return later


def main():
    if MOSQUITTO is None:
        print("mosquitto is not installed")
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        find_promtool(folder)
        receiver, broker = Receiver(), Broker(folder)
        try:
            settings = prepare(folder, receiver, broker)
            refused_secret(folder, settings)
            (folder / "data").mkdir(exist_ok=True)
            token = token_of(WEFT, folder / "data/tokens.json", "prometheus", "observer")
            subscriber = Subscriber(broker)
            receiver.statuses = [500, 500]
            daemon = Daemon(WEFTD, ROOT, folder, "--notify", settings, "--http", "0")
            client = Client(daemon.socket)
            assert subscriber.next("availability")[0] == "online"
            expect(receiver, subscriber, "disk.low")
            assert receiver.refused == 2 and not receiver.statuses, "it was tried three times"
            runs(client, receiver, subscriber)
            served = metrics_of_a_run(daemon, client, token, receiver, subscriber)
            latched_and_lost(client, receiver, subscriber)
            metrics(daemon, client, token, served)
            subscriber = broker_comes_back(client, broker, receiver)
            daemon.end(signal.SIGKILL)
            assert subscriber.next("availability")[0] == "offline", "the last will"
            daemon = Daemon(WEFTD, ROOT, folder, "--notify", settings)
            assert subscriber.next("availability")[0] == "online"
            assert daemon.end() == 0
            assert subscriber.next("availability")[0] == "offline", "sent at an orderly end"
        finally:
            broker.stop()
    print("events by webhook and MQTT, metrics, last will")
    return 0


sys.exit(main())
