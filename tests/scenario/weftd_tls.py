#!/usr/bin/env python3
"""weftd under TLS with a certificate made for this test: TCP and HTTP with Python's ssl, `weft --daemon tls://`, refusals, and clients with endless
handshakes beside one that is served meanwhile.

    weftd_tls.py WEFTD WEFT SOURCE_ROOT
"""
import json
import os
import pathlib
import re
import select
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile

from cli_support import error_of, fits, line_has
from weftd_support import PATIENCE_S, certificate, command, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
ANYWHERE = "0.0.0.0"  # the test's own network has only the loopback, and this address is not a loopback address


class TlsDaemon:
    def __init__(self, folder, *more):
        self.process = subprocess.Popen(command(WEFTD, ROOT, folder, "--port", "0", "--http", "0", *more), stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        found = re.fullmatch(r"weftd: .*\bready\b.*\b0\.0\.0\.0:(\d+)\b.*\bTLS\b.*\bhttps://0\.0\.0\.0:(\d+)\n", line)
        assert found, (line, self.process.stderr.read() if not line else "")
        self.port, self.http = int(found[1]), int(found[2])

    def end(self):
        self.process.terminate()
        assert self.process.wait(PATIENCE_S) == 0


def refused(folder, *more):
    done = subprocess.run(command(WEFTD, ROOT, folder, "--port", "0", *more), capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 1, done
    return done.stderr


def refusals(folder, key, cert, other_key):
    assert line_has(refused(folder, "--listen", ANYWHERE), ["--listen", ANYWHERE, "--tls-cert", "--tls-key"])
    assert line_has(refused(folder, "--tls-cert", cert), ["--tls-cert", "--tls-key"])
    assert line_has(refused(folder, "--tls-cert", folder / "none.pem", "--tls-key", key), str(folder / "none.pem"))
    assert line_has(refused(folder, "--tls-cert", key, "--tls-key", key), ["certificate", str(key)])
    assert "TLS" in refused(folder, "--tls-cert", cert, "--tls-key", other_key)
    assert line_has(refused(folder, "--listen", "everywhere", "--tls-cert", cert, "--tls-key", key), ["--listen", "everywhere"])
    key.chmod(0o644)
    assert line_has(refused(folder, "--tls-cert", cert, "--tls-key", key), f"chmod 640 {key}")
    key.chmod(0o600)


def trusting(cert, **options):
    context = ssl.create_default_context(cafile=cert)
    for name, value in options.items():
        setattr(context, name, value)
    return context


def wrapped(port, context):
    return context.wrap_socket(socket.create_connection(("127.0.0.1", port), PATIENCE_S), server_hostname="localhost")


def ask(wire, lines, method, **params):
    wire.sendall(json.dumps({"jsonrpc": "2.0", "id": 1, "method": method, "params": params}).encode() + b"\n")
    return json.loads(lines.readline())


def over_tcp(daemon, cert, token):
    for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
        with wrapped(daemon.port, trusting(cert, minimum_version=version, maximum_version=version)) as wire:
            lines = wire.makefile("r", encoding="utf-8")
            assert json.loads(lines.readline())["params"]["auth"] == ["token"]
            assert ask(wire, lines, "session.open", client="x")["error"]["data"]["kind"] == "access.token"
            assert ask(wire, lines, "session.open", client="x", token=token)["result"]["role"] == "operator"
            big = ask(wire, lines, "rpc.discover")["result"]
            assert "classify.live" in {m["name"] for m in big["methods"]}
            wire.sendall(b"!halt\n")
            assert json.loads(lines.readline())["error"]["data"]["kind"] == "access.local_only"


def too_old_or_in_the_clear(daemon, cert):
    old = trusting(cert)
    old.set_ciphers("ALL:@SECLEVEL=0")
    old.minimum_version, old.maximum_version = ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1
    for broken in (old, ssl.create_default_context()):  # TLS 1.1; a client that does not trust the certificate
        try:
            wrapped(daemon.port, broken)
            raise AssertionError("a handshake that should have failed")
        except ssl.SSLError:
            pass
    with socket.create_connection(("127.0.0.1", daemon.port), PATIENCE_S) as plain:
        plain.sendall(b'{"jsonrpc":"2.0","id":1,"method":"system.info"}\n')
        heard = b""
        while piece := plain.recv(4096):
            heard += piece
        assert b"jsonrpc" not in heard, heard


def over_http(daemon, cert, token):
    body = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "system.info"}).encode()
    head = (f"POST /rpc HTTP/1.1\r\nHost: bench.example\r\nAuthorization: Bearer {token}\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode()
    with wrapped(daemon.http, trusting(cert)) as wire:
        wire.sendall(head + body)
        heard = b""
        while piece := wire.recv(4096):  # an orderly end; ssl would raise for a truncated stream
            heard += piece
    assert heard.startswith(b"HTTP/1.1 200 ") and b'"product":"weftd"' in heard, heard
    # It listens on all addresses, which a link cannot name: the link has the machine's name.
    assert f'"http":"https://{socket.gethostname()}:{daemon.http}"'.encode() in heard, heard


def with_weft(daemon, folder, cert, other_cert, token):
    def weft(*more, token=token, ca=cert):
        return subprocess.run([WEFT, "--json", "status", "--daemon", f"tls://127.0.0.1:{daemon.port}", "--tls-ca", ca, *more],
                              capture_output=True, text=True, env={**os.environ, "WEFT_TOKEN": token}, timeout=PATIENCE_S)
    good = weft()
    assert good.returncode == 0 and json.loads(good.stdout)["ready"]["ok"], good
    file = folder / "my.token"
    file.write_text(token + "\n")
    assert weft("--token-file", file, token="").returncode == 0
    for bad, word in ((weft(token=""), "token"), (weft(ca=other_cert), "handshake")):
        assert bad.returncode != 0 and word in bad.stderr + bad.stdout, bad
    local = {"socket": folder / "data" / "weftd.sock", "daemon": f"tls://127.0.0.1:{daemon.port}"}
    which_daemon(local, {"WEFT_TOKEN": token, "WEFT_TLS_CA": str(cert)})
    for place, way in ((f"tcp://127.0.0.1:{daemon.port}", "tls://"), (f"127.0.0.1:{daemon.port}", "tls://HOST:PORT")):
        ran = subprocess.run([WEFT, "status", "--daemon", place], capture_output=True, text=True, env={**os.environ, "WEFT_TOKEN": token})
        assert ran.returncode == 1 and way in ran.stderr, ran
    elsewhere = subprocess.run([WEFT, "--json", "status", "--daemon", "tls://127.0.0.1:1", "--tls-ca", cert], capture_output=True, text=True)
    assert elsewhere.returncode != 0 and fits(error_of(elsewhere), code="not found", where=["127.0.0.1:1"]), elsewhere


def which_daemon(right, more):
    """Options win over the environment. Without options the environment counts, and it must name only one daemon."""
    nowhere = {"WEFT_SOCKET": "/no/such.sock", "WEFT_DAEMON": "tls://127.0.0.1:1"}

    def status(*options, **named):
        clean = {k: v for k, v in os.environ.items() if k not in nowhere}
        return subprocess.run([WEFT, "status", *options], capture_output=True, text=True, env={**clean, **more, **named}, timeout=PATIENCE_S)
    for option, place in right.items():
        assert status(f"--{option}", place, **nowhere).returncode == 0, (option, status(f"--{option}", place, **nowhere))
        assert status(**{f"WEFT_{option.upper()}": str(place)}).returncode == 0, option
    both = status("--socket", right["socket"], "--daemon", right["daemon"])
    assert both.returncode != 0 and "xclude" in both.stderr, both
    two = status(WEFT_SOCKET=str(right["socket"]), WEFT_DAEMON=right["daemon"])
    assert two.returncode != 0 and line_has(two.stderr, ["WEFT_SOCKET", "WEFT_DAEMON", str(right["socket"]), right["daemon"]]), two
    none = status()
    assert pathlib.Path("/run/weft/weftd.sock").exists() or (none.returncode != 0 and "/run/weft/weftd.sock" in none.stderr), none


def of_another_name(folder, token):
    """A trusted certificate for another name: the error names the handshake, and the client sends nothing."""
    key, cert = certificate(folder, "elsewhere", "DNS:bench.example,IP:192.0.2.1")
    daemon = TlsDaemon(folder, "--listen", ANYWHERE, "--tls-cert", cert, "--tls-key", key)
    try:
        said = subprocess.run([WEFT, "status", "--daemon", f"tls://127.0.0.1:{daemon.port}", "--tls-ca", cert], capture_output=True,
                              text=True, env={**os.environ, "WEFT_TOKEN": token}, timeout=PATIENCE_S)
        assert said.returncode != 0 and "handshake" in said.stderr, said
        anyone = trusting(cert, check_hostname=False)  # the daemon answers, and its certificate is valid except for the name
        with wrapped(daemon.port, anyone) as wire:
            assert ask(wire, wire.makefile("r"), "system.info")["method"] == "hello"
    finally:
        daemon.end()


def slow_handshakes(daemon, cert, token):
    silent = [socket.create_connection(("127.0.0.1", port), PATIENCE_S) for port in [daemon.port] * 40 + [daemon.http] * 10]
    for wire in silent[::2]:
        wire.sendall(b"\x16\x03\x01")  # the first bytes of a hello, without the rest
    over_tcp(daemon, cert, token)
    over_http(daemon, cert, token)
    # The clients were served beside the slow handshakes: the connections still open have received nothing.
    waits, _, _ = select.select(silent, [], [], 0)
    assert len(waits) < len(silent), "every slow handshake was over before anybody was served"
    for wire in silent:  # the daemon closes each one after its time
        while wire.recv(4096):
            pass
        wire.close()


def main():
    if not shutil.which("openssl"):
        print("skipped: no openssl")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "recipes").mkdir()
        (folder / "data").mkdir()
        key, cert = certificate(folder, "good", "DNS:localhost,IP:127.0.0.1")
        other_key, other_cert = certificate(folder, "other", "DNS:localhost")
        refusals(folder, key, cert, other_key)
        token = token_of(WEFT, folder / "data" / "tokens.json", "ada", "operator")
        daemon = TlsDaemon(folder, "--listen", ANYWHERE, "--tls-cert", cert, "--tls-key", key)
        try:
            over_tcp(daemon, cert, token)
            too_old_or_in_the_clear(daemon, cert)
            over_http(daemon, cert, token)
            with_weft(daemon, folder, cert, other_cert, token)
            slow_handshakes(daemon, cert, token)
        finally:
            daemon.end()
        of_another_name(folder, token)
    print("weftd_tls: all as it should be")


if __name__ == "__main__":
    main()
