"""The connection to the daemon, made anew when it is lost."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, Dict, Optional, Tuple

from ._connection import Connection
from ._errors import AccessError, ConnectionLost, RequestError, WeftError

Opened = Tuple[Connection, Dict[str, Any]]

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 2.0


class Link:
    """Usable from several threads: whoever needs a connection first makes it, the others wait for that one.

    dial   connects and opens a session; its errors are ConnectionLost, or the daemon's own refusals, which no second try would change
    tries  at most so many, a pause of 0.1 s after the first one and twice as long after each further one, at most 2 s; 0: never again
    """

    def __init__(self, first: Opened, dial: Callable[[], Opened], tries: int) -> None:
        self._dial, self._tries = dial, tries
        self._connection, self.opened = first
        self._one_at_a_time = threading.Lock()
        self._closed = threading.Event()

    @property
    def closed(self) -> bool:
        """Somebody closed it here."""
        return self._closed.is_set()

    def now(self) -> Connection:
        """The connection as it is; a new one where that is lost. Errors: ConnectionLost; AccessError, RequestError (of session.open)."""
        held = self._connection
        return held if held.end is None else self.after(held)

    def after(self, lost: Connection) -> Connection:
        """Another connection than this one, if it is lost. Errors: as now()."""
        if lost.end is None and not self.closed:
            return lost  # it is not lost: what failed on it was something else
        if self._tries == 0 or self.closed:
            raise lost.end or ConnectionLost("the connection was closed here")
        with self._one_at_a_time:
            if self._connection is lost:
                self._connection, self.opened = self._again()
            made = self._connection
        if self.closed:  # meanwhile
            made.close()
            raise ConnectionLost("the connection was closed here")
        return made

    def _again(self) -> Opened:
        began_s, pause_s = time.monotonic(), _FIRST_PAUSE_S
        why: Optional[WeftError] = None
        for _ in range(self._tries):
            if self.closed:
                raise ConnectionLost("the connection was closed here")
            try:
                return self._dial()
            except (AccessError, RequestError):
                raise
            except WeftError as problem:
                why = problem
            self._closed.wait(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
        took_s = time.monotonic() - began_s
        raise ConnectionLost(f"the daemon was not reached again in {self._tries} tries, {took_s:.1f} s: {why}") from why

    def close(self) -> None:
        self._closed.set()
        self._connection.close()
