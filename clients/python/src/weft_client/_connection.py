"""One end of the daemon's socket: requests and their answers by number, events by subscription. One object a line, both ways."""
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
    """Usable from several threads. A thread of its own reads; it ends with the connection."""

    def __init__(self, wire: socket.socket, timeout_s: float) -> None:
        """Waits for the greeting. Errors: ConnectionLost."""
        self._wire = wire
        self._wire.setblocking(False)
        self._io = threading.Lock()  # an SSL object is one thread's at a time
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
        except Exception as late:  # concurrent.futures.TimeoutError is not TimeoutError before Python 3.11
            self.close()
            raise ConnectionLost("the daemon does not greet") from late

    @property
    def end(self) -> Optional[WeftError]:
        """Why nobody answers here any more; None while somebody does."""
        with self._state:
            return self._end

    def request(self, method: str, params: Mapping[str, Any]) -> "Future[Any]":
        """The answer to come: its result, or a WeftError. Does not wait."""
        answer: "Future[Any]" = Future()
        told = json.dumps({"method": method, "params": dict(params)}, allow_nan=False)  # refused here: nothing waits for an answer yet
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
        """Nobody waits here for that answer any more: the daemon need not either, which bears so many calls of a connection at once."""
        with self._state:
            waited = self._answers.pop(number, None) is not None
        if waited:
            with contextlib.suppress(ConnectionLost):
                self.send(json.dumps({"jsonrpc": "2.0", "method": "$/cancel", "params": {"id": number}}))

    def send(self, line: str) -> None:
        """A line as it is. Errors: ConnectionLost."""
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
                    raise self._ended(ConnectionLost(f"the connection to the daemon broke: {problem}")) from problem

    def mailbox(self, sub: str) -> Mailbox:
        """Events of a subscription, also those that came before anybody asked for it here."""
        with self._state:
            found = self._mailboxes.get(sub)
            if found is None:
                found = self._mailboxes[sub] = Mailbox()
                if self._end is not None:
                    found.close(self._end)
            return found

    def forget(self, sub: str) -> None:
        """Events of this one that are still under way are thrown away."""
        with self._state:
            self._closed_subs.add(sub)
            self._mailboxes.pop(sub, None)

    def close(self) -> None:
        self._ended(ConnectionLost("the connection was closed here"))
        if threading.current_thread() is not self._reader:
            self._reader.join()

    # --- the reading thread ---

    def _read_all(self) -> None:
        rest = b""
        end = ConnectionLost("the daemon closed the connection")
        try:
            while True:
                piece = self._receive()
                if not piece:
                    break
                *lines, rest = (rest + piece).split(b"\n")
                for line in lines:
                    self._take(json.loads(line))
        except Exception as problem:  # whatever it is: nobody may wait for a thread that has ended
            end = ConnectionLost(f"the connection to the daemon broke: {problem!r}")
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
        """Everybody who waits is told. The first reason stays."""
        with self._state:
            first = self._end is None
            self._end = self._end or end
            answers, self._answers = self._answers, {}
            mailboxes = list(self._mailboxes.values())
        if first:
            with self._io, contextlib.suppress(OSError, ValueError):  # it may be gone already
                self._wire.shutdown(socket.SHUT_RDWR)
        for answer in answers.values():
            if answer.set_running_or_notify_cancel():
                answer.set_exception(self._end)
        for mailbox in mailboxes:
            mailbox.close(self._end)
        if not self._greeting.done():
            self._greeting.set_exception(self._end)
        return self._end
