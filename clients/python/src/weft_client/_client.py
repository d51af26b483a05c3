"""The client: one connection to one daemon."""
from __future__ import annotations

import concurrent.futures
import json
import os
import uuid
from typing import Any, Callable, Dict, List, Mapping, Optional, Union

from ._address import address_of, wire_to
from ._connection import Connection
from ._errors import ConnectionLost, WeftError, error_of
from ._files import Http
from ._lease import Lease
from ._link import Link, Opened
from ._methods import Api
from ._run import Check, Run, runs_of
from ._watch import JsonObject, Watch, topics_of

VERSION = "1.0.0"
Place = Union[str, "os.PathLike[str]"]
Answer = concurrent.futures.Future


class Client:
    """A connection to a daemon as one user. Any thread may use it. `api` has every method of the daemon, generated from its OpenRPC document.

    Attributes of the present connection: `session`, `role` (observer, operator, engineer, admin), `protocol`, `features` and `epoch` (of this start
    of the daemon).

    After a lost connection the next call, and every watch, connects again. The request in progress raises ConnectionLost. It may or may not have been
    executed; repeat it with the same `idem` to find out.
    """

    def __init__(self, link: Link, http: Http, timeout_s: float) -> None:
        """Use connect()."""
        self._link, self.http, self._timeout_s = link, http, timeout_s
        self.api = Api(self.call)

    @property
    def session(self) -> str:
        return str(self._link.opened["session"])

    @property
    def role(self) -> str:
        return str(self._link.opened["role"])

    @property
    def protocol(self) -> str:
        return str(self._link.opened["protocol"])

    @property
    def features(self) -> List[str]:
        return list(self._link.opened["features"])

    @property
    def epoch(self) -> str:
        return str(self._link.opened["epoch"])

    @property
    def closed(self) -> bool:
        """True after close()."""
        return self._link.closed

    @property
    def reconnects(self) -> bool:
        """False after connect(tries=0): a lost connection is not replaced."""
        return self._link.reconnects

    def call(self, method: str, params: Mapping[str, object]) -> JsonObject:
        """Calls a method by its name and omits parameters that are None. Errors: WeftError, TimeoutError."""
        return self.answer(self.request(method, params), self._timeout_s)

    def request(self, method: str, params: Mapping[str, object]) -> "Answer[Any]":
        """Like call(), but does not wait for the answer. Answers may arrive in another order than the requests."""
        return self._link.now().request(method, {name: value for name, value in params.items() if value is not None})

    def answer(self, pending: "Answer[Any]", timeout_s: Optional[float] = None) -> JsonObject:
        """Waits for the answer; None: without a limit. Errors: WeftError, TimeoutError."""
        try:
            answered: JsonObject = pending.result(timeout_s)
        except concurrent.futures.TimeoutError as late:  # only Python 3.11 and newer make it a TimeoutError
            pending.cancel()
            raise TimeoutError(f"no answer within {timeout_s} s") from late
        return answered

    # --- before a run ---

    def ready(self) -> List[Dict[str, Any]]:
        """All reasons why no run can start; empty if none."""
        blockers: List[Dict[str, Any]] = self.api.system.ready()["blockers"]
        return blockers

    def recipes(self) -> List[str]:
        names: List[str] = self.api.recipe.list()["recipes"]
        return names

    def check(self, recipe: str, seed: Optional[int] = None) -> Check:
        """Plan, expected time and all problems of a recipe."""
        told = self.api.recipe.check(recipe=recipe, seed=seed)
        return Check(told["ok"], told.get("plan") or {}, told.get("problems") or [], told.get("warnings") or [],
                     told.get("disk_ok", False), told.get("digest", ""))

    # --- runs ---

    def lease(self, note: str = "", ttl_ms: int = 15_000, on_lost: Optional[Callable[[WeftError], None]] = None) -> Lease:
        """Acquires the rig for the duration of a `with`; renews itself. Errors: AccessError if another user has the lease."""
        return Lease(self, ttl_ms, note, on_lost)

    def start(self, recipe: str, lease: "Union[str, Lease]", seed: Optional[int] = None, name: Optional[str] = None,
              idem: Optional[str] = None) -> Run:
        """Queues a campaign. After a ConnectionLost repeat the call with the same `idem`: no second run is started."""
        started = self.api.run.start(recipe=recipe, lease=lease if isinstance(lease, str) else lease.name, seed=seed, name=name,
                                     idem=idem or uuid.uuid4().hex)
        return Run(self, str(started["run"]))

    def run(self, name: str) -> Run:
        """A run by its name, without a request. For an unknown name `state()` raises the error."""
        return Run(self, name)

    def runs(self, state: Optional[str] = None) -> List[Run]:
        """All runs, oldest first, or only those in one state such as "interrupted"."""
        return list(runs_of(self, state))

    def watch(self, *topics: str, mode: str = "latest", max_hz: float = 20) -> Watch:
        """Events, each with the resulting state; the first of each topic is a snapshot. Without topics: all runs, rig, leases and queue.

        mode    "latest": merged, at most `max_hz` per second [Hz]; "every": in order, with reported gaps and a new snapshot after each gap

        A lost connection is replaced. Mode "every" then continues with the missed events if the daemon still has them. Otherwise, and in mode
        "latest", a snapshot of each topic follows.
        """
        return Watch(self._link.now(), topics_of(topics), mode, max_hz, self._timeout_s, self._link.after)

    # --- halt ---

    def halt(self) -> JsonObject:
        """Stops motion at once and latches the rig. Needs no lease and no role."""
        return self.api.rig.halt()

    def reset(self, reason: str) -> JsonObject:
        """Clears the latch after a person has inspected the rig."""
        return self.api.rig.reset(reason=reason)

    # --- closing ---

    def close(self) -> None:
        self._link.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def connect(where: Optional[Place] = None, *, token: Optional[str] = None, tls_ca: Optional[str] = None, http: Optional[str] = None,
            program: str = "weft-client", timeout_s: float = 120, tries: int = 8) -> Client:
    """Connects and opens a session.

    where      path of the Unix socket, "tcp://127.0.0.1:PORT" or "tls://HOST:PORT"; None: WEFT_SOCKET or WEFT_DAEMON, else /run/weft/weftd.sock
    token      required except on the Unix socket, and for `http`; None: WEFT_TOKEN
    tls_ca     PEM file of the certificates to trust; None: WEFT_TLS_CA, else those of the system
    http       address for downloads, "http://127.0.0.1:8080"
    program    name of this client in the daemon's journal
    timeout_s  longest wait for an answer [s]; Run.wait() has its own limit
    tries      attempts to reconnect after a lost connection (8 take about 9 s); 0: none
    Errors: ConnectionLost, AccessError (token), RequestError (invalid address).
    """
    token = token or os.environ.get("WEFT_TOKEN") or None
    tls_ca = tls_ca or os.environ.get("WEFT_TLS_CA") or None
    address = address_of(where)
    introduction: JsonObject = {"client": program, "version": VERSION, "protocol": "1.x"}
    if token and address.kind != "unix":
        introduction["token"] = token

    def dial() -> Opened:
        connection = Connection(wire_to(address, tls_ca, timeout_s), timeout_s)
        try:
            return connection, connection.request("session.open", introduction).result(timeout_s)
        except concurrent.futures.TimeoutError as late:
            connection.close()
            raise ConnectionLost(f"session not opened within {timeout_s} s") from late
        except BaseException:
            connection.close()
            raise

    return Client(Link(dial(), dial, tries), Http(http, token, tls_ca, timeout_s), timeout_s)


def halt(where: Optional[Place] = None, timeout_s: float = 10) -> JsonObject:
    """Sends the raw line `!halt` on the Unix socket, without a session: halts the rig if no other client is available. Returns the event's change,
    {"latched": "halt", ...}. Errors: ConnectionLost, AccessError (not the Unix socket)."""
    with wire_to(address_of(where), os.environ.get("WEFT_TLS_CA") or None, timeout_s) as wire:
        try:
            wire.sendall(b"!halt\n")
            for line in wire.makefile("rb"):
                message = json.loads(line)
                if "error" in message:
                    raise error_of(message["error"])
                if message.get("method") == "event":
                    delta: JsonObject = message["params"]["delta"]
                    return delta
        except (OSError, ValueError) as problem:
            raise ConnectionLost(f"connection to the daemon broken: {problem}") from problem
    raise ConnectionLost("connection closed by the daemon")
