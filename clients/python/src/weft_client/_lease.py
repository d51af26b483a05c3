"""A lease that renews itself during a `with`."""
from __future__ import annotations

import concurrent.futures
import contextlib
import threading
import time
from typing import TYPE_CHECKING, Callable, Optional

from ._errors import ConnectionLost, WeftError

if TYPE_CHECKING:
    from ._client import Client


_LOOK_S = 0.02  # delay [s] after which close() or the end of the lease is noticed during a renewal


class Lease:
    """The right to control the rig until the `with` ends or close().

    A thread renews the lease after a third of its time to live. It waits for the answer at most until the lease expires. If the renewal is refused or
    not answered by then, the lease is lost: `lost` has the reason, and `on_lost` is called once. A broken connection is replaced as often as the time
    permits. A run in progress continues without the lease.
    """

    def __init__(self, client: "Client", ttl_ms: int, note: str, on_lost: Optional[Callable[[WeftError], None]] = None) -> None:
        self._client, self._ttl_ms, self._on_lost = client, ttl_ms, on_lost
        asked_s = time.monotonic()
        taken = client.api.lease.acquire(ttl_ms=ttl_ms, note=note)
        self.name: str = taken["lease"]
        self.expires_us: int = taken["expires_us"]  # UTC [us]
        self.lost: Optional[WeftError] = None
        self._ends_s = asked_s + ttl_ms / 1000  # lower bound: the daemon counts from the arrival of the request
        self._over = threading.Event()
        self._renewing = threading.Thread(target=self._renew, name=f"weft-client lease {self.name}", daemon=True)
        self._renewing.start()

    def _left_s(self) -> float:
        return max(0.0, self._ends_s - time.monotonic())

    def _renew(self) -> None:
        while not self._over.wait(min(self._ttl_ms / 3000, self._left_s())):
            problem = self._renewed()
            if problem is not None:
                return self._gone(problem)

    def _renewed(self) -> Optional[WeftError]:
        """Renews once. Returns the reason if the lease is lost."""
        asked_s, renewed = time.monotonic(), concurrent.futures.Future[int]()
        # In a separate thread, because reconnecting may take longer than the lease lasts.
        threading.Thread(target=self._ask, args=(renewed, self._left_s()), name=f"weft-client renews {self.name}", daemon=True).start()
        while not concurrent.futures.wait([renewed], _LOOK_S).done:
            if self._over.is_set():
                return None
            if self._left_s() == 0:
                return ConnectionLost("lease expired: no answer to its renewal")
        problem = renewed.exception()
        if isinstance(problem, ConnectionLost):
            return problem if self._left_s() == 0 or self._client.closed else None
        if isinstance(problem, WeftError):
            return problem
        self.expires_us = renewed.result()
        self._ends_s = asked_s + self._ttl_ms / 1000
        return None

    def _ask(self, renewed: "concurrent.futures.Future[int]", left_s: float) -> None:
        try:
            told = self._client.answer(self._client.request("lease.renew", {"lease": self.name, "ttl_ms": self._ttl_ms}), left_s)
            renewed.set_result(told["expires_us"])
        except WeftError as problem:
            renewed.set_exception(problem)
        except TimeoutError as late:
            renewed.set_exception(ConnectionLost(f"lease expired: {late}"))

    def _gone(self, problem: WeftError) -> None:
        self.lost = problem
        if self._on_lost is not None:
            self._on_lost(problem)

    def close(self) -> None:
        """Releases the lease. Does nothing for a lost one."""
        if self._over.is_set():
            return
        self._over.set()
        if threading.current_thread() is not self._renewing:  # true when `on_lost` calls close()
            self._renewing.join()
        if self.lost is None:
            with contextlib.suppress(WeftError, TimeoutError):
                self._client.api.lease.release(lease=self.name)

    def __enter__(self) -> "Lease":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
