"""Refusals of the daemon as exceptions. Programs use `kind`; the other fields are for people (docs/reference/api.md, "Errors")."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Type


class WeftError(Exception):
    """A request that the daemon refused.

    code       JSON-RPC's own number, or one of the daemon's blocks
    kind       such as "param.range"; stable within a major version of the protocol
    where      place of the problem: a JSON pointer, a file, a device ("" if none)
    expected   the expected value ("" if not given)
    got        the value found
    hint       what to do about it
    retryable  whether the same request may succeed later
    blockers   all reasons against the request, each with kind, where and hint
    """

    def __init__(self, message: str, code: int = 0, data: Optional[Mapping[str, Any]] = None) -> None:
        data = data or {}
        self.message = message
        self.code = code
        self.kind = str(data.get("kind", ""))
        self.where = str(data.get("where", ""))
        self.expected = data.get("expected", "")
        self.got = data.get("got", "")
        self.hint = str(data.get("hint", ""))
        self.retryable = bool(data.get("retryable", False))
        self.blockers: List[Dict[str, Any]] = list(data.get("blockers", []))
        super().__init__(self._sentence())

    def _sentence(self) -> str:
        """`WHERE: WHAT: GOT (expected EXPECTED). HINT. [KIND]`, as the daemon prints its errors."""
        problem = f"{self.where}: {self.message}" if self.where else self.message
        if self.got != "":
            problem += f": {self.got}"
        if self.expected != "":
            problem += f" (expected {self.expected})"
        parts = [text if text.endswith((".", "?")) else text + "." for text in (problem, self.hint) if text]
        if self.kind:
            parts.append(f"[{self.kind}]")
        return " ".join(parts)


class RequestError(WeftError):
    """Invalid request: an unknown method or parameter, a value out of range (JSON-RPC's codes and the 1000s)."""


class AccessError(WeftError):
    """Access refused: token, role, lease (2000s)."""


class StateError(WeftError):
    """Not possible in this state of the run or the rig (3000s)."""


class DeviceError(WeftError):
    """Failure of a device of the rig (4000s)."""


class SafetyError(WeftError):
    """A guard of the rig stopped the motion (5000s)."""


class StorageError(WeftError):
    """The disk failed, or a file differs from its record (6000s)."""


class InternalError(WeftError):
    """Internal failure of the daemon (7000s)."""


class ConnectionLost(WeftError):
    """The daemon does not answer. The request in progress may have been executed: repeat it with the same `idem`."""


class DataAltered(WeftError):
    """The bytes received or read differ from those recorded."""


_BLOCKS: Dict[int, Type[WeftError]] = {1: RequestError, 2: AccessError, 3: StateError, 4: DeviceError, 5: SafetyError,
                                       6: StorageError, 7: InternalError}


def error_of(said: Mapping[str, Any]) -> WeftError:
    """The exception for the `error` member of an answer."""
    code = int(said.get("code", 0))
    made: Type[WeftError] = _BLOCKS.get(code // 1000, WeftError) if code > 0 else RequestError
    data = said.get("data")
    return made(str(said.get("message", "")), code, data if isinstance(data, dict) else None)
