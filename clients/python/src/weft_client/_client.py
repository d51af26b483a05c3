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
    """A daemon as one user sees it. Threads may share it. `api` has every method of the daemon, made from its OpenRPC document.

    Attributes: `session`, `role` (observer, operator, engineer, admin), `protocol`, `features`, `epoch` (of this start of the daemon), all of
    the connection that there is now.

    A connection that is lost is made anew with the next call, and by every watch. A request that was under way raises ConnectionLost all
    the same: whether it was done is not known, and its `idem` tells.
    """

    def __init__(self, link: Link, http: Http, timeout_s: float) -> None:
        """For connect()."""
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
        """close() was called."""
        return self._link.closed

    def call(self, method: str, params: Mapping[str, object]) -> JsonObject:
        """Any method by its name; parameters that are None are left out. Errors: WeftError, TimeoutError."""
        return self.answer(self.request(method, params), self._timeout_s)

    def request(self, method: str, params: Mapping[str, object]) -> "Answer[Any]":
        """As call(), without waiting for the answer, which may come after those of later requests."""
        return self._link.now().request(method, {name: value for name, value in params.items() if value is not None})

    def answer(self, pending: "Answer[Any]", timeout_s: Optional[float] = None) -> JsonObject:
        """Waits for it; None: as long as it takes."""
        try:
            answered: JsonObject = pending.result(timeout_s)
        except concurrent.futures.TimeoutError as late:  # a TimeoutError only from Python 3.11 on
            pending.cancel()
            raise TimeoutError(f"no answer within {timeout_s} s") from late
        return answered

    # --- before anything moves ---

    def ready(self) -> List[Dict[str, Any]]:
        """All that keeps a run from being started; nothing: it can be."""
        blockers: List[Dict[str, Any]] = self.api.system.ready()["blockers"]
        return blockers

    def recipes(self) -> List[str]:
        names: List[str] = self.api.recipe.list()["recipes"]
        return names

    def check(self, recipe: str, seed: Optional[int] = None) -> Check:
        """Plan, expected time and everything that would be refused."""
        told = self.api.recipe.check(recipe=recipe, seed=seed)
        return Check(told["ok"], told.get("plan") or {}, told.get("problems") or [], told.get("warnings") or [],
                     told.get("disk_ok", False), told.get("digest", ""))

    # --- runs ---

    def lease(self, note: str = "", ttl_ms: int = 15_000, on_lost: Optional[Callable[[WeftError], None]] = None) -> Lease:
        """The rig, for as long as the `with` lasts: it renews itself. Errors: AccessError, where somebody else has it."""
        return Lease(self, ttl_ms, note, on_lost)

    def start(self, recipe: str, lease: "Union[str, Lease]", seed: Optional[int] = None, name: Optional[str] = None,
              idem: Optional[str] = None) -> Run:
        """Puts a campaign in line. After a ConnectionLost ask again with the same `idem`: nothing is started twice."""
        started = self.api.run.start(recipe=recipe, lease=lease if isinstance(lease, str) else lease.name, seed=seed, name=name,
                                     idem=idem or uuid.uuid4().hex)
        return Run(self, str(started["run"]))

    def run(self, name: str) -> Run:
        """One of any time, by its name; `state()` of one that is none is refused."""
        return Run(self, name)

    def runs(self, state: Optional[str] = None) -> List[Run]:
        """All of them, oldest first; or those in one state, "interrupted"."""
        return list(runs_of(self, state))

    def watch(self, *topics: str, mode: str = "latest", max_hz: float = 20) -> Watch:
        """Events with the state that they lead to; a snapshot of each topic first. Without topics all runs, rig, leases and queue.

        mode    "latest": merged, at most `max_hz` [Hz] of them; "every": in order, with gaps told and a new snapshot after each

        Where the connection is lost it is made anew. Of "every" what was missed meanwhile is told then, if the daemon still has it; else,
        and of "latest", a snapshot of each topic comes.
        """
        return Watch(self._link.now(), topics_of(topics), mode, max_hz, self._timeout_s, self._link.after)

    # --- halt ---

    def halt(self) -> JsonObject:
        """Stops motion where it is and latches the rig; needs no lease and no role."""
        return self.api.rig.halt()

    def reset(self, reason: str) -> JsonObject:
        """Somebody has looked at the rig: it may move again."""
        return self.api.rig.reset(reason=reason)

    # --- the end ---

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
    token      needed for all but the Unix socket, and for `http`; None: WEFT_TOKEN
    tls_ca     whose certificates are believed (a PEM file); None: WEFT_TLS_CA, or else the system's
    http       where files are fetched, "http://127.0.0.1:8080"
    program    what the daemon calls this client in its journal
    timeout_s  longest wait for an answer [s]; Run.wait() has its own
    tries      to connect again where the connection is lost, about 9 s for 8 of them; 0: it stays lost
    Errors: ConnectionLost, AccessError (token), RequestError (no such place).
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
            raise ConnectionLost(f"no session within {timeout_s} s") from late
        except BaseException:
            connection.close()
            raise

    return Client(Link(dial(), dial, tries), Http(http, token, tls_ca, timeout_s), timeout_s)


def halt(where: Optional[Place] = None, timeout_s: float = 10) -> JsonObject:
    """The raw line `!halt` on the Unix socket, without a session: what stops the rig when nothing else is to hand. Answers what was told,
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
            raise ConnectionLost(f"the connection to the daemon broke: {problem}") from problem
    raise ConnectionLost("the daemon closed the connection")
