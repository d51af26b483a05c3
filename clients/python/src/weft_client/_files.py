"""Downloads the files of a run over HTTP: resumes a partial file by ranges and checks the digest."""
from __future__ import annotations

import hashlib
import http.client
import json
import os
import pathlib
from dataclasses import dataclass
from typing import Any, Mapping, Optional
from urllib.parse import quote, urlsplit

from ._address import trust
from ._errors import AccessError, ConnectionLost, DataAltered, RequestError, WeftError, error_of

_PIECE_BYTES = 1 << 18
_ATTEMPTS = 5  # consecutive attempts without a byte


@dataclass(frozen=True)
class DataFile:
    """A file of a run; `path` is its path over HTTP."""

    name: str
    bytes: int
    sha256: str
    path: str

    @staticmethod
    def of(told: Mapping[str, Any]) -> "DataFile":
        return DataFile(str(told["name"]), int(told["bytes"]), str(told["sha256"]), str(told["path"]))


class Http:
    """Address for downloads ("http://127.0.0.1:8080" or "https://bench.example:8443") and its token."""

    def __init__(self, url: Optional[str], token: Optional[str], tls_ca: Optional[str], timeout_s: float) -> None:
        self._url, self._token, self._tls_ca, self._timeout_s = url, token, tls_ca, timeout_s

    def get(self, path: str, headers: Mapping[str, str]) -> http.client.HTTPResponse:
        """Errors: RequestError if the client has no address or token for HTTP, ConnectionLost."""
        if not self._url or not self._token:
            raise RequestError("no HTTP address or no token for downloads", 1000, {
                "kind": "request.invalid", "expected": "http and token",
                "hint": 'Use connect(..., http="http://127.0.0.1:8080", token="wft_...")'})
        parts = urlsplit(self._url)
        host = parts.hostname or ""
        wire: http.client.HTTPConnection
        if parts.scheme == "https":
            wire = http.client.HTTPSConnection(host, parts.port, timeout=self._timeout_s, context=trust(self._tls_ca))
        else:
            wire = http.client.HTTPConnection(host, parts.port, timeout=self._timeout_s)
        try:
            wire.request("GET", path, headers={"Authorization": f"Bearer {self._token}", **headers})
            return wire.getresponse()
        except (OSError, http.client.HTTPException) as problem:
            raise ConnectionLost(f"daemon not reachable: {problem}", 0, {"where": self._url}) from problem


def fetch(source: Http, file: DataFile, to: pathlib.Path) -> pathlib.Path:
    """Downloads the file as NAME.part and renames it when it is complete. Errors: DataAltered, AccessError, ConnectionLost."""
    target = to / pathlib.PurePosixPath(file.name).name if to.is_dir() else to
    part = target.with_name(target.name + ".part")
    barren = 0
    if file.bytes == 0:
        part.touch()
    while _size(part) < file.bytes:
        before = _size(part)
        try:
            _go_on(source, file, part)
        except ConnectionLost:
            barren = barren + 1 if _size(part) == before else 0
            if barren == _ATTEMPTS:
                raise
    got = _digest(part)
    if got != file.sha256:
        part.unlink()
        raise DataAltered("digest of the download differs from the list of files", 0, {
            "kind": "data.altered", "where": file.name, "expected": file.sha256, "got": got, "hint": "Read files() again, then repeat the download"})
    os.replace(part, target)
    return target


def _size(part: pathlib.Path) -> int:
    return part.stat().st_size if part.exists() else 0


def _go_on(source: Http, file: DataFile, part: pathlib.Path) -> None:
    have = _size(part)
    response = source.get(f"{quote(file.path)}?sha256={file.sha256}", {"Range": f"bytes={have}-"} if have else {})
    with response:
        if response.status not in (200, 206):
            raise _refused(response, file)
        with part.open("ab" if response.status == 206 else "wb") as out:
            while piece := _read(response, file):
                out.write(piece)  # outside _read(): a full disk must not count as a lost connection, because a retry does not help
    if _size(part) < file.bytes:
        raise ConnectionLost("download incomplete", 0, {"where": file.name, "got": f"{_size(part)} bytes", "expected": f"{file.bytes} bytes"})


def _read(response: http.client.HTTPResponse, file: DataFile) -> bytes:
    try:
        return response.read(_PIECE_BYTES)
    except (OSError, http.client.HTTPException) as problem:
        raise ConnectionLost(f"download interrupted: {problem}", 0, {"where": file.name}) from problem


def _refused(response: http.client.HTTPResponse, file: DataFile) -> WeftError:
    body = response.read()
    try:
        said = error_of(json.loads(body)["error"])
    except (ValueError, KeyError, TypeError):
        said = WeftError(f"HTTP status {response.status}", response.status, {"where": file.name})
    if response.status in (409, 412):
        return DataAltered(said.message, said.code, {"kind": said.kind or "data.altered", "where": said.where or file.name, "hint": said.hint})
    if response.status in (401, 403):
        return AccessError(said.message, said.code, {"kind": said.kind, "where": said.where, "hint": said.hint})
    if response.status in (408, 503, 504):
        return ConnectionLost(said.message, said.code, {"kind": said.kind, "hint": said.hint})
    return said


def _digest(file: pathlib.Path) -> str:
    digest = hashlib.sha256()
    with file.open("rb") as read:
        while piece := read.read(_PIECE_BYTES):
            digest.update(piece)
    return digest.hexdigest()
