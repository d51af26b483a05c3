#!/usr/bin/env python3
"""Tokens that expire, are removed or are added while weftd runs; idempotency keys over its death; the identity of runs of an earlier start.

    weftd_access.py WEFTD WEFT SOURCE_ROOT      all simulated
"""
import hashlib
import http.client
import json
import os
import pathlib
import re
import secrets
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time

from cli_support import line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def write_tokens(file, *entries):
    """Replaces the whole file, in the daemon's format; each entry is a name, a role, a token and its time to live [s]."""
    made = [{"name": name, "role": role, "sha256": hashlib.sha256(token.encode()).hexdigest(), "expires_us": int((time.time() + left_s) * 1e6)}
            for name, role, token, left_s in entries]
    new = file.with_suffix(".new")
    new.touch(mode=0o600)
    new.write_text(json.dumps({"tokens": made}))
    new.replace(file)


def ask(port, token, method="GET", path="/events?topics=rig", body=None):
    wire = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    wire.request(method, path, body, {"Authorization": f"Bearer {token}", "Content-Type": "application/json"})
    return wire.getresponse()


def introduced(port, token):
    client = Client(("127.0.0.1", port), introduce=False)
    client.call("session.open", client="test", token=token)
    return client


def last_words(client):
    """Messages to a connection before it is closed."""
    told = []
    for line in client.lines:
        told.append(json.loads(line))
    return told[-1]["error"], [m for m in told[:-1] if m.get("method") == "event"]


def held_run(client, lease):
    client.call("sim.clock", pace=20)
    client.call("sub.open", topics=["run:*"], mode="every")
    run = client.call("run.start", recipe="small", lease=lease)["run"]
    client.until(run, "running")
    client.call("run.pause", run=run, at="now")
    client.until(run, "held")
    client.call("sim.clock", pace=0)
    return run


def a_token_ends(folder, ports, local, lease):
    """A token expires on the socket, in a stream and in a waiting call: at its time, with a message, and without anything after it."""
    tcp, web = ports
    short, other = secrets.token_hex(32), secrets.token_hex(32)
    left_s = 4.0
    write_tokens(folder / "tokens.json", ("short", "operator", short, left_s), ("other", "operator", other, 3600))
    ends_s = time.time() + left_s
    run = held_run(local, lease)
    watching, staying = introduced(tcp, short), introduced(tcp, other)
    for client in watching, staying:
        client.call("sub.open", topics=["rig"], mode="every")
    stream = ask(web, short)
    assert stream.status == 200, stream.status
    wait = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "run.wait", "params": {"run": run}})
    waiting = []
    thread = threading.Thread(target=lambda: waiting.append(ask(web, short, "POST", "/rpc", wait)))
    thread.start()
    error, events = last_words(watching)
    over_s = time.time()
    assert (error["data"]["kind"], error["data"]["where"]) == ("access.token", "/params/token"), error
    assert over_s >= ends_s - 0.1, "its time was not over"
    text = stream.read().decode()
    assert text.count("event: snapshot") == 1 and "event: error\ndata: {" in text, text
    assert json.loads(text.rsplit("data: ", 1)[1])["data"]["kind"] == "access.token", text
    thread.join()
    assert waiting[0].status == 401 and json.loads(waiting[0].read())["error"]["data"]["kind"] == "access.token"
    assert ask(web, short).status == 401, "and no other begins"
    local.call("rig.halt")
    assert staying.event()["delta"]["rig"] == "latched", "no other session ends"
    assert not events, events
    local.until(run, "ended")
    local.call("rig.reset", reason="a test has looked at it")
    return staying, other


def whose_tokens(file, secret):
    """Names, roles and expiry, for people and programs, but no part of a token."""
    write_tokens(file, ("third", "observer", secret, 3600), ("late", "admin", "gone by", -3600))
    asked = [WEFT, "token", "list", "--tokens", file]
    lines = subprocess.run(asked, check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in lines.splitlines()]
    assert [row[:2] for row in rows] == [["third", "observer"], ["late", "admin"]] and rows[0][2] != rows[1][2], lines
    printed = subprocess.run([*asked, "--json"], check=True, capture_output=True, text=True).stdout
    third, late = json.loads(printed)["tokens"]
    assert (third["name"], third["role"], third["over"]) == ("third", "observer", False) and third["expires_us"] > time.time() * 1e6, third
    assert (late["name"], late["role"], late["over"]) == ("late", "admin", True), late
    digests = [one["sha256"] for one in json.loads(file.read_text())["tokens"]]
    assert not any(word in lines + printed for word in [secret, *digests])
    assert subprocess.run([*asked[:-1], file.with_name("none.json")], capture_output=True).returncode != 0


def tokens_come_and_go(folder, ports, local, staying, other):
    """A token of weft token add is valid at once; one removed from the file ends within about a second."""
    tcp, web = ports
    added = token_of(WEFT, folder / "tokens.json", "added", "observer")
    assert introduced(tcp, added).call("session.whoami")["user"] == "token:added"
    assert ask(web, added).status == 200
    third = secrets.token_hex(32)
    write_tokens(folder / "tokens.json", ("third", "observer", third, 3600))
    error, _ = last_words(staying)
    assert error["data"]["kind"] == "access.token", error
    assert ask(web, other).status == 401 and ask(web, third).status == 200
    (folder / "tokens.json").chmod(0o644)  # readable by all users: the daemon ignores the file, and known tokens stay valid
    assert ask(web, third).status == 200
    assert "tokens.unreadable" in [b["kind"] for b in local.call("system.ready")["blockers"]], "no blocker"
    while not local.call("log.query", kind="tokens.unreadable")["lines"]:
        time.sleep(0.1)  # the daemon checks once a second
    (folder / "tokens.json").chmod(0o600)
    whose_tokens(folder / "tokens.json", third)
    removed = introduced(tcp, third)
    subprocess.run([WEFT, "token", "remove", "third", "--tokens", folder / "tokens.json"], check=True, capture_output=True)
    assert last_words(removed)[0]["data"]["kind"] == "access.token" and ask(web, third).status == 401
    assert "tokens.unreadable" not in [b["kind"] for b in local.call("system.ready")["blockers"]]


def a_namesake(folder, ports, local, lease):
    """A token with the name of a machine user is not that user: its owner has neither that user's lease nor keys."""
    who = local.call("session.whoami")["user"]
    namesake = introduced(ports[0], token_of(WEFT, folder / "tokens.json", who, "operator"))
    assert namesake.call("session.whoami")["user"] == f"token:{who}"
    for method in "lease.renew", "lease.release":
        refused = namesake.refused(method, lease=lease)["data"]
        assert (refused["where"], refused["expected"], refused["got"]) == ("/params/lease", f"token:{who}", who), (method, refused)
    run = local.call("run.start", recipe="small", lease=lease, idem="namesake")["run"]
    assert namesake.refused("run.start", recipe="small", lease=lease, idem="namesake")["data"]["kind"] == "lease.required"
    assert namesake.refused("run.abort", run=run)["data"]["kind"] == "lease.held"
    local.call("run.wait", run=run)


def no_token_makes_another_of_its_own(folder):
    """The new token would outlive the one that made it, also through the Unix socket."""
    there = Client(folder / "data/weftd.sock", introduce=False)
    token = token_of(WEFT, folder / "tokens.json", "chief", "admin")
    assert there.call("session.open", client="there", token=token)["user"] == "token:chief"
    assert there.refused("token.add", name="child", own=True)["data"]["where"] == "/params/own"
    assert there.call("token.add", name="child")["user"] == "token:child"


def files_of_tokens(folder):
    """Only their owner can read them, whatever the umask; parallel additions lose none."""
    for mask in 0o000, 0o777:
        file = folder / f"mask-{mask:o}" / "tokens.json"
        file.parent.mkdir()
        subprocess.run([WEFT, "token", "add", "ada", "--role", "observer", "--tokens", file], check=True, capture_output=True,
                       preexec_fn=lambda mask=mask: os.umask(mask))
        assert stat.S_IMODE(file.stat().st_mode) == 0o600, oct(file.stat().st_mode)
    file = folder / "many.json"
    adding = [subprocess.Popen([WEFT, "token", "add", f"n{i}", "--role", "observer", "--tokens", file], stdout=subprocess.PIPE) for i in range(16)]
    assert [p.wait(PATIENCE_S) for p in adding] == [0] * 16
    for process in adding:
        process.stdout.close()
    assert {t["name"] for t in json.loads(file.read_text())["tokens"]} == {f"n{i}" for i in range(16)}, "one wrote over another's"


def before_its_death(client, lease):
    first = client.call("run.start", recipe="small", lease=lease, idem="first")
    end = client.call("run.wait", run=first["run"])
    assert (end["trials_done"], end["trials_planned"], end["bench"]) == (2, 2, "simulated"), end
    assert client.refused("queue.remove", run="R-000099", idem="refused")["data"]["kind"] == "not_found"
    assert client.call("token.add", name="secret", idem="secret")["token"].startswith("wft_")
    return first


def after_its_death(folder, daemon, client, first, lease_of_then):
    """The same keys get the same answers, and nothing is done twice. Earlier runs keep their identity. The lease ended with the daemon."""
    lease = client.call("lease.acquire", ttl_ms=600_000, idem="lease")["lease"]
    assert lease != lease_of_then and [one["lease"] for one in client.call("lease.list")["leases"]] == [lease], "of the past"
    known = [r["run"] for r in client.call("run.list")["runs"]]
    for either in lease_of_then, lease:
        assert client.call("run.start", recipe="small", lease=either, idem="first") == first
    assert client.refused("run.start", recipe="small", lease=lease_of_then, idem="late")["data"]["kind"] == "lease.required"
    late = client.call("run.start", recipe="small", lease=lease, idem="late")["run"]
    known.append(late)
    client.call("run.wait", run=late)
    assert client.refused("run.start", recipe="small", lease=lease_of_then, name="other", idem="first")["data"]["kind"] == "idem.reused", "another request"
    assert client.refused("queue.remove", run="R-000099", idem="refused")["data"]["kind"] == "not_found"
    assert [r["run"] for r in client.call("run.list")["runs"]] == known, "started twice"
    assert "token" in client.call("token.add", name="again", idem="secret"), "a secret is not kept, so its key is free"
    run = client.call("run.get", run=first["run"])
    assert (run["trials_done"], run["trials_planned"], run["bench"]) == (2, 2, "simulated"), run
    watched = subprocess.run([WEFT, "watch", first["run"], "--socket", daemon.socket], capture_output=True, text=True, timeout=PATIENCE_S)
    assert line_has(watched.stdout, "2 of 2") and watched.returncode == 0, watched
    kept = (folder / "data/weftd.sqlite").read_bytes() + (folder / "data/weftd.sqlite-wal").read_bytes()
    assert b"wft_" not in kept, "a token in what is kept"
    client.call("lease.release", lease=lease)


def begin(folder):
    daemon = Daemon(WEFTD, ROOT, folder, "--port", "0", "--http", "0", "--tokens", folder / "tokens.json")
    ports = [int(p) for p in re.findall(r":(\d+)", daemon.ready.partition("ready")[2])]
    return daemon, ports, Client(daemon.socket)


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-access-") as name:
        folder = pathlib.Path(name)
        (folder / "recipes").mkdir()
        small = json.loads((ROOT / "recipes/library/m1.json").read_text())
        small.update(fabrics=["denim"], repetitions=2)
        (folder / "recipes/small.json").write_text(json.dumps(small))
        files_of_tokens(folder)
        write_tokens(folder / "tokens.json")
        daemon, ports, client = begin(folder)
        try:
            lease = client.call("lease.acquire", ttl_ms=600_000, idem="lease")["lease"]
            staying, other = a_token_ends(folder, ports, client, lease)
            tokens_come_and_go(folder, ports, client, staying, other)
            a_namesake(folder, ports, client, lease)
            no_token_makes_another_of_its_own(folder)
            first = before_its_death(client, lease)
            daemon.end(signal.SIGKILL)
            daemon, ports, client = begin(folder)
            after_its_death(folder, daemon, client, first, lease)
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("weftd: tokens, keys and earlier runs, all as they should be (simulated)")


main()
