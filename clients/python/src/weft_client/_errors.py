"""What the daemon refused, as exceptions. Programs go by `kind`; the other fields are for people (docs/api.md, "Errors")."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Type


class WeftError(Exception):
    """A request that the daemon refused.

    code       JSON-RPC's own number, or one of the daemon's blocks
    kind       "param.range"; stable within a major version of the protocol
    where      what is meant: a JSON pointer, a file, a device ("" where nothing is)
    expected   what would have been right ("" where nothing is said)
    got        what came instead
    hint       what to do about it
    retryable  whether the same request may go well later
    blockers   all that stands in the way, each with kind, where and hint
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
        parts = [f"{self.where}: {self.message}" if self.where else self.message]
        parts += [f"{word} {value}" for word, value in (("expected", self.expected), ("got", self.got)) if value != ""]
        sentence = "; ".join(parts) + (f". {self.hint}" if self.hint else "")
        return f"{sentence} [{self.kind}]" if self.kind else sentence


class RequestError(WeftError):
    """The request itself: an unknown method or parameter, a value out of range (JSON-RPC's codes and the 1000s)."""


class AccessError(WeftError):
    """Who may: token, role, lease (2000s)."""


class StateError(WeftError):
    """Not in this state of the run or the rig (3000s)."""


class DeviceError(WeftError):
    """A device of the rig (4000s)."""


class SafetyError(WeftError):
    """A guard of the rig (5000s)."""


class StorageError(WeftError):
    """The disk, or a file that is not what was recorded (6000s)."""


class InternalError(WeftError):
    """The daemon itself (7000s)."""


class ConnectionLost(WeftError):
    """Nobody answers any more, or never did. Whether a request under way was done is not known: ask again with the same `idem`."""


class DataAltered(WeftError):
    """Bytes that arrived, or were read, are not those that were recorded."""


_BLOCKS: Dict[int, Type[WeftError]] = {1: RequestError, 2: AccessError, 3: StateError, 4: DeviceError, 5: SafetyError,
                                       6: StorageError, 7: InternalError}


def error_of(said: Mapping[str, Any]) -> WeftError:
    """The exception for the `error` member of an answer."""
    code = int(said.get("code", 0))
    made: Type[WeftError] = _BLOCKS.get(code // 1000, WeftError) if code > 0 else RequestError
    data = said.get("data")
    return made(str(said.get("message", "")), code, data if isinstance(data, dict) else None)
