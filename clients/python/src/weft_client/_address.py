"""Address of a daemon: a Unix socket, tcp://HOST:PORT or tls://HOST:PORT."""
from __future__ import annotations

import os
import socket
import ssl
from dataclasses import dataclass
from typing import Optional, Union
from urllib.parse import urlsplit

from ._errors import ConnectionLost, RequestError


UNIT_SOCKET = "/run/weft/weftd.sock"


@dataclass(frozen=True)
class Address:
    """kind "unix" with `path`, else "tcp" or "tls" with `host` and `port`."""

    kind: str
    path: str = ""
    host: str = ""
    port: int = 0


def address_of(where: "Optional[Union[str, os.PathLike[str]]]") -> Address:
    """Parses `where`; None: WEFT_SOCKET, WEFT_DAEMON or the systemd unit's socket, as in `weft`. Errors: RequestError."""
    if where is None:
        named = [os.environ[name] for name in ("WEFT_SOCKET", "WEFT_DAEMON") if os.environ.get(name)]
        if len(named) > 1:
            raise RequestError("two daemon addresses in the environment", 1000, {
                "kind": "request.invalid", "got": "WEFT_SOCKET and WEFT_DAEMON", "expected": "one of them",
                "hint": "Unset one, or pass the address to connect()"})
        where = named[0] if named else UNIT_SOCKET
    text = os.fspath(where)
    if "://" not in text:
        return Address("unix", path=text)
    parts = urlsplit(text)
    try:
        port = parts.port
    except ValueError:
        port = None
    if parts.scheme not in ("tcp", "tls") or not parts.hostname or port is None:
        raise RequestError("invalid daemon address", 1000, {"kind": "request.invalid", "got": text,
                                                            "expected": "a path, tcp://HOST:PORT or tls://HOST:PORT"})
    return Address(parts.scheme, host=parts.hostname, port=port)


def trust(tls_ca: Optional[str]) -> ssl.SSLContext:
    """TLS context (1.2 or newer) that trusts the certificates of `tls_ca` (PEM), or by default those of the system. Errors: RequestError."""
    try:
        context = ssl.create_default_context(cafile=tls_ca)
    except OSError as problem:
        raise RequestError(f"CA certificates not readable: {problem}", 1000, {"kind": "request.invalid", "where": tls_ca or ""}) from problem
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    return context


def wire_to(address: Address, tls_ca: Optional[str], timeout_s: float) -> socket.socket:
    """A connected socket. Errors: ConnectionLost, also for a certificate that is not trusted."""
    place = address.path or f"{address.host}:{address.port}"
    context = trust(tls_ca) if address.kind == "tls" else None
    wire: Optional[socket.socket] = None
    try:
        if address.kind == "unix":
            wire = socket.socket(socket.AF_UNIX)
            wire.settimeout(timeout_s)
            wire.connect(address.path)
            return wire
        wire = socket.create_connection((address.host, address.port), timeout_s)
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return context.wrap_socket(wire, server_hostname=address.host) if context else wire
    except OSError as problem:  # includes ssl.SSLError
        if wire is not None:
            wire.close()
        raise ConnectionLost(f"daemon not reachable: {problem}", 0, {"where": place, "hint": "Start weftd there, or correct the address"}) from problem
