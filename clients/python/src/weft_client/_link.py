"""Replaces the connection to the daemon after it is lost."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, Dict, Optional, Tuple

from ._connection import Connection
from ._errors import AccessError, ConnectionLost, RequestError, WeftError

Opened = Tuple[Connection, Dict[str, Any]]

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 2.0


class Link:
    """Any thread may use it: the first one that needs a connection makes it, the others wait for it.

    dial   connects and opens a session; raises ConnectionLost (retried), or AccessError or RequestError (not retried)
    tries  most attempts; the pause is 0.1 s after the first one and doubles after each, up to 2 s; 0: never reconnect
    """

    def __init__(self, first: Opened, dial: Callable[[], Opened], tries: int) -> None:
        self._dial, self._tries = dial, tries
        self._connection, self.opened = first
        self._one_at_a_time = threading.Lock()
        self._closed = threading.Event()

    @property
    def closed(self) -> bool:
        """True after close()."""
        return self._closed.is_set()

    @property
    def reconnects(self) -> bool:
        return self._tries > 0

    def now(self) -> Connection:
        """The present connection, or a new one if it is lost. Errors: ConnectionLost; AccessError, RequestError (of session.open)."""
        held = self._connection
        return held if held.end is None else self.after(held)

    def after(self, lost: Connection) -> Connection:
        """A new connection if `lost` is lost, else `lost` itself. Errors: as now()."""
        if lost.end is None and not self.closed:
            return lost  # still open: the failure had another cause
        if self._tries == 0 or self.closed:
            raise lost.end or ConnectionLost("connection closed by this client")
        with self._one_at_a_time:
            if self._connection is lost:
                self._connection, self.opened = self._again()
            made = self._connection
        if self.closed:  # closed by another thread meanwhile
            made.close()
            raise ConnectionLost("connection closed by this client")
        return made

    def _again(self) -> Opened:
        began_s, pause_s = time.monotonic(), _FIRST_PAUSE_S
        why: Optional[WeftError] = None
        for _ in range(self._tries):
            if self.closed:
                raise ConnectionLost("connection closed by this client")
            try:
                return self._dial()
            except (AccessError, RequestError):
                raise
            except WeftError as problem:
                why = problem
            self._closed.wait(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
        took_s = time.monotonic() - began_s
        raise ConnectionLost(f"daemon not reachable in {self._tries} attempts, {took_s:.1f} s: {why}") from why

    def close(self) -> None:
        self._closed.set()
        self._connection.close()
