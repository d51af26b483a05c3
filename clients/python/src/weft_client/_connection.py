"""Client side of the daemon's socket: matches answers to requests by number, and events to subscriptions. One JSON object per line in both directions."""
from __future__ import annotations

import contextlib
import json
import select
import socket
import ssl
import threading
from concurrent.futures import Future
from typing import Any, Dict, Mapping, Optional, Set

from ._errors import ConnectionLost, WeftError, error_of
from ._mailbox import Mailbox

_PIECE_BYTES = 1 << 16


class Connection:
    """Any thread may use it. A separate thread reads until the connection ends."""

    def __init__(self, wire: socket.socket, timeout_s: float) -> None:
        """Waits for the daemon's hello. Errors: ConnectionLost."""
        self._wire = wire
        self._wire.setblocking(False)
        self._io = threading.Lock()  # only one thread may use an SSL object at a time
        self._writing = threading.Lock()
        self._state = threading.Lock()
        self._answers: "Dict[int, Future[Any]]" = {}
        self._mailboxes: Dict[str, Mailbox] = {}
        self._closed_subs: Set[str] = set()
        self._last = 0
        self._end: Optional[WeftError] = None
        self._greeting: "Future[Dict[str, Any]]" = Future()
        self._reader = threading.Thread(target=self._read_all, name="weft-client", daemon=True)
        self._reader.start()
        try:
            self.greeting = self._greeting.result(timeout_s)
        except WeftError:
            raise
        except Exception as late:  # before Python 3.11 concurrent.futures.TimeoutError is not TimeoutError
            self.close()
            raise ConnectionLost(f"no hello from the daemon within {timeout_s} s") from late

    @property
    def end(self) -> Optional[WeftError]:
        """The reason why the connection ended; None while it is open."""
        with self._state:
            return self._end

    def request(self, method: str, params: Mapping[str, Any]) -> "Future[Any]":
        """Sends a request without waiting. The future gets the result or a WeftError. Errors: ConnectionLost."""
        answer: "Future[Any]" = Future()
        told = json.dumps({"method": method, "params": dict(params)}, allow_nan=False)  # may raise: must come before the future is stored
        with self._state:
            if self._end is not None:
                raise self._end
            self._last += 1
            number = self._last
            self._answers[number] = answer
        answer.add_done_callback(lambda done: self._take_back(number) if done.cancelled() else None)
        self.send(f'{{"jsonrpc": "2.0", "id": {number}, {told[1:]}')
        return answer

    def _take_back(self, number: int) -> None:
        """Cancels a request that has no reader any more. The daemon limits the number of open calls of a connection."""
        with self._state:
            waited = self._answers.pop(number, None) is not None
        if waited:
            with contextlib.suppress(ConnectionLost):
                self.send(json.dumps({"jsonrpc": "2.0", "method": "$/cancel", "params": {"id": number}}))

    def send(self, line: str) -> None:
        """Sends the line unchanged. Errors: ConnectionLost."""
        left = memoryview(line.encode() + b"\n")
        with self._writing:
            while left:
                try:
                    with self._io:
                        sent = self._wire.send(left)
                    left = left[sent:]
                except ssl.SSLWantReadError:  # TLS wants to read before it can write
                    select.select([self._wire], [], [])
                except (ssl.SSLWantWriteError, BlockingIOError):
                    select.select([], [self._wire], [])
                except (OSError, ValueError) as problem:
                    raise self._ended(ConnectionLost(f"connection to the daemon broken: {problem}")) from problem

    def mailbox(self, sub: str) -> Mailbox:
        """Mailbox of a subscription; includes events that arrived before this call."""
        with self._state:
            found = self._mailboxes.get(sub)
            if found is None:
                found = self._mailboxes[sub] = Mailbox()
                if self._end is not None:
                    found.close(self._end)
            return found

    def forget(self, sub: str) -> None:
        """Drops the events of this subscription that still arrive."""
        with self._state:
            self._closed_subs.add(sub)
            self._mailboxes.pop(sub, None)

    def close(self) -> None:
        self._ended(ConnectionLost("connection closed by this client"))
        if threading.current_thread() is not self._reader:
            self._reader.join()

    # --- the reading thread ---

    def _read_all(self) -> None:
        rest = b""
        end = ConnectionLost("connection closed by the daemon")
        try:
            while True:
                piece = self._receive()
                if not piece:
                    break
                *lines, rest = (rest + piece).split(b"\n")
                for line in lines:
                    self._take(json.loads(line))
        except Exception as problem:  # any exception: callers must not wait for a thread that has ended
            end = ConnectionLost(f"connection to the daemon broken: {problem!r}")
        self._ended(end)
        self._wire.close()

    def _receive(self) -> bytes:
        while True:
            try:
                with self._io:
                    return self._wire.recv(_PIECE_BYTES)
            except ssl.SSLWantWriteError:  # TLS wants to write before it can read
                select.select([], [self._wire], [])
            except (ssl.SSLWantReadError, BlockingIOError):
                select.select([self._wire], [], [])

    def _take(self, message: Dict[str, Any]) -> None:
        params = message.get("params", {})
        if message.get("method") == "hello" and not self._greeting.done():
            self._greeting.set_result(params)
        elif message.get("method") == "event":
            sub = params.get("sub")
            if sub is not None and sub not in self._closed_subs:
                self.mailbox(sub).put(params)
        else:
            refused = error_of(message["error"]) if "error" in message else None
            with self._state:
                number = message.get("id")
                answer = self._answers.pop(number, None) if isinstance(number, int) else None
            if answer is None or not answer.set_running_or_notify_cancel():
                return
            if refused is not None:
                answer.set_exception(refused)
            else:
                answer.set_result(message.get("result"))

    def _ended(self, end: WeftError) -> WeftError:
        """Fails all waiting requests and closes all mailboxes. The first reason is kept."""
        with self._state:
            first = self._end is None
            self._end = self._end or end
            answers, self._answers = self._answers, {}
            mailboxes = list(self._mailboxes.values())
        if first:
            with self._io, contextlib.suppress(OSError, ValueError):  # the socket may be closed already
                self._wire.shutdown(socket.SHUT_RDWR)
        for answer in answers.values():
            if answer.set_running_or_notify_cancel():
                answer.set_exception(self._end)
        for mailbox in mailboxes:
            mailbox.close(self._end)
        if not self._greeting.done():
            self._greeting.set_exception(self._end)
        return self._end
