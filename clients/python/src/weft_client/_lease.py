"""A lease of the rig that renews itself while a `with` lasts."""
from __future__ import annotations

import contextlib
import threading
from typing import Callable, Optional

from ._errors import ConnectionLost, WeftError
from ._methods import Api


class Lease:
    """The rig is yours until the `with` ends, or close().

    A thread renews it at a third of its time to live, with a connection of the client's. Where that is refused or nobody answers, the
    lease is lost: `lost` says why, and `on_lost` was called once. A run that is under way goes on without it.
    """

    def __init__(self, api: Api, ttl_ms: int, note: str, on_lost: Optional[Callable[[WeftError], None]] = None) -> None:
        self._api, self._ttl_ms, self._on_lost = api, ttl_ms, on_lost
        taken = api.lease.acquire(ttl_ms=ttl_ms, note=note)
        self.name: str = taken["lease"]
        self.expires_us: int = taken["expires_us"]  # UTC
        self.lost: Optional[WeftError] = None
        self._over = threading.Event()
        self._renewing = threading.Thread(target=self._renew, name=f"weft-client lease {self.name}", daemon=True)
        self._renewing.start()

    def _renew(self) -> None:
        while not self._over.wait(self._ttl_ms / 3000):
            try:
                self.expires_us = self._api.lease.renew(lease=self.name, ttl_ms=self._ttl_ms)["expires_us"]
            except WeftError as problem:
                return self._gone(problem)
            except TimeoutError as late:
                return self._gone(ConnectionLost(f"the lease was not renewed: {late}"))

    def _gone(self, problem: WeftError) -> None:
        self.lost = problem
        if self._on_lost is not None:
            self._on_lost(problem)

    def close(self) -> None:
        """Gives the rig back. One that is lost is nobody's business any more."""
        if self._over.is_set():
            return
        self._over.set()
        if threading.current_thread() is not self._renewing:  # as it is in `on_lost`
            self._renewing.join()
        with contextlib.suppress(WeftError, TimeoutError):
            self._api.lease.release(lease=self.name)

    def __enter__(self) -> "Lease":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
