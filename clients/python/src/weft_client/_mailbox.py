"""Queue of messages from one thread to another or to an event loop."""
from __future__ import annotations

import threading
from collections import deque
from typing import Any, Callable, Deque, Dict, List, Optional

Message = Dict[str, Any]


class Mailbox:
    """Events of one subscription. Keeps at most `most`: a slow reader loses the oldest, and gets their number."""

    def __init__(self, most: int = 10_000) -> None:
        self._most = most
        self._waiting: Deque[Message] = deque()
        self._dropped = 0
        self._end: Optional[Exception] = None
        self._news = threading.Condition()
        self._callbacks: List[Callable[[], None]] = []

    def put(self, message: Message) -> None:
        with self._news:
            if len(self._waiting) == self._most:
                self._dropped += 1 + int(self._waiting.popleft().get("dropped", 0))
            self._waiting.append(message)
        self._tell()

    def close(self, end: Exception) -> None:
        """No message can be added any more; waiting ones can still be taken."""
        with self._news:
            self._end = self._end or end
        self._tell()

    def _tell(self) -> None:
        with self._news:
            callbacks, self._callbacks = self._callbacks, []
            self._news.notify_all()
        for callback in callbacks:
            callback()

    def take(self) -> Optional[Message]:
        """The next message; None if there is none yet. Once the mailbox is empty it raises the exception that closed it."""
        with self._news:
            if self._waiting:
                message = self._waiting.popleft()
                if self._dropped:
                    message = {**message, "dropped": int(message.get("dropped", 0)) + self._dropped}
                    self._dropped = 0
                return message
            if self._end is not None:
                raise self._end
            return None

    def wait(self, timeout_s: Optional[float] = None) -> bool:
        """Waits for a message or the end; False after the timeout."""
        with self._news:
            return self._news.wait_for(self._ready, timeout_s)

    def when_ready(self, callback: Callable[[], None]) -> None:
        """Calls `callback` once, on any thread, as soon as wait() would return True."""
        with self._news:
            if not self._ready():
                self._callbacks.append(callback)
                return
        callback()

    def _ready(self) -> bool:
        return bool(self._waiting) or self._end is not None
