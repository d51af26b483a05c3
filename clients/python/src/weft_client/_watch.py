"""Events of some topics, each with the topic's state after it: `for event in watch` or `async for event in watch`."""
from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Callable, Deque, Dict, List, Optional, Sequence

from ._connection import Connection
from ._errors import ConnectionLost, StateError
from ._mailbox import Mailbox
from ._merge import merge_patch

JsonObject = Dict[str, Any]

_MOST_LOST_AT_ONCE = 3  # connections lost before the subscription was open


@dataclass(frozen=True)
class Event:
    """One change of a topic, "run:R-000318".

    delta     the change, a JSON merge patch; for a snapshot the whole state
    state     state of the topic after the event
    seq       number of the event, without gaps since the daemon started; for a snapshot the newest event that it includes
    t_us      time [us UTC]; None for a snapshot
    snapshot  True for the first event of a topic, and for the first one after a gap or a lost connection
    dropped   number of events lost before this one; a snapshot follows at once
    """

    topic: str
    delta: JsonObject
    state: JsonObject = field(repr=False)
    seq: int
    t_us: Optional[int] = None
    snapshot: bool = False
    dropped: int = 0


class Watch:
    """A subscription, open until close() or the end of a `with`. Only one reader at a time.

    If the daemon or this client lost events (the reader was too slow), the subscription is opened again. Its snapshots come as events, so `state` is
    complete again. After a lost connection `again` makes another one. Mode "every" then continues after the last event read, mode "latest" with
    snapshots.
    """

    def __init__(self, connection: Connection, topics: Sequence[str], mode: str, max_hz: float, timeout_s: float,
                 again: Optional[Callable[[Connection], Connection]] = None) -> None:
        self._connection, self._timeout_s, self._again = connection, timeout_s, again
        self._wish: JsonObject = {"topics": list(topics), "mode": mode}
        if mode == "latest":
            self._wish["max_hz"] = max_hz
        self._ready: Deque[Event] = deque()
        self._sub: Optional[str] = None
        self._closed = False
        self._ends: Callable[[Event], bool] = lambda event: False
        self._states: Dict[str, JsonObject] = {}
        self._seq = 0  # newest event that was read or is in the snapshot
        self._whole = True  # no event before that one is missing
        self._mailbox = Mailbox()
        self._open()

    def ending_with(self, last: Callable[[Event], bool], already: Optional[Event] = None) -> "Watch":
        """Ends the watch after the first event for which `last` is true. `already`: a known event that comes before all others."""
        self._ends = last
        if already is not None:
            self._ready.appendleft(already)
        return self

    def _open(self) -> None:
        opened = self._ask_to_open({})
        self._states, self._seq, self._whole = dict(opened["snapshot"]), int(opened["seq"]), True
        self._ready.extend(Event(topic, state, state, int(opened["seq"]), snapshot=True) for topic, state in self._states.items())

    def _ask_to_open(self, more: JsonObject) -> JsonObject:
        opened: JsonObject = self._connection.request("sub.open", {**self._wish, **more}).result(self._timeout_s)
        self._sub = str(opened["sub"])
        self._mailbox = self._connection.mailbox(self._sub)
        if self._closed:  # closed by another thread meanwhile
            self._leave()
        return opened

    def _reconnect(self, lost: ConnectionLost) -> None:
        """Connects and subscribes again unless the watch is closed. Errors: ConnectionLost if that fails."""
        if self._closed:
            return
        if self._again is None:
            raise lost
        epoch = self._connection.greeting.get("epoch")
        for _ in range(_MOST_LOST_AT_ONCE):
            self._sub = None
            self._connection = self._again(self._connection)
            try:
                return self._go_on(epoch)
            except ConnectionLost as once_more:
                lost = once_more
        raise lost

    def _go_on(self, epoch: Optional[str]) -> None:
        """Continues after the last event read if the daemon has not restarted and still has the events; else opens anew."""
        if self._whole and self._wish["mode"] == "every" and epoch is not None:
            try:
                self._ask_to_open({"from_seq": self._seq, "epoch": epoch})
                return
            except StateError as gone:
                if gone.kind != "replay.gone":
                    raise
        self._open()

    def _leave(self) -> None:
        sub, self._sub = self._sub, None
        if sub is None:
            return
        self._connection.forget(sub)
        with contextlib.suppress(Exception):  # a lost connection has no subscriptions
            self._connection.request("sub.close", {"sub": sub})

    def close(self) -> None:
        """Ends the watch and every wait for an event. Any thread or task may call it."""
        self._closed = True
        self._leave()
        self._mailbox.close(ConnectionLost("watch closed by this client"))

    def __enter__(self) -> "Watch":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    async def __aenter__(self) -> "Watch":
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def _take(self) -> Optional[Event]:
        """An event if one is ready, else None. Raises ConnectionLost when this connection has ended and all its events are read."""
        if not self._ready:
            message = self._mailbox.take()
            if message is None:
                return None
            self._ready.append(self._merged(message))
        event = self._ready.popleft()
        if self._ends(event):
            self.close()
        return event

    def _merged(self, message: JsonObject) -> Event:
        topic, delta = str(message["topic"]), message["delta"]
        state = self._states[topic] = merge_patch(self._states.get(topic, {}), delta)
        self._seq = int(message["seq"])
        return Event(topic, delta, state, int(message["seq"]), int(message["t_us"]), dropped=int(message.get("dropped", 0)))

    def _after(self, event: Event) -> Event:
        """Opens the subscription again after a gap."""
        if event.dropped and not self._closed:
            self._whole = False
            self._leave()
            try:
                self._open()
            except ConnectionLost as lost:  # the next call reconnects
                self._mailbox = Mailbox()
                self._mailbox.close(lost)
        return event

    def next(self, timeout_s: Optional[float] = None) -> Optional[Event]:
        """The next event; None after the timeout or when the watch is closed."""
        while not self._closed:
            try:
                event = self._take()
                if event is not None:
                    return self._after(event)
            except ConnectionLost as lost:
                self._reconnect(lost)
                continue
            if not self._mailbox.wait(timeout_s):
                return None
        return None

    def __iter__(self) -> "Watch":
        return self

    def __next__(self) -> Event:
        event = self.next()
        if event is None:
            raise StopIteration
        return event

    def __aiter__(self) -> "Watch":
        return self

    async def __anext__(self) -> Event:
        while not self._closed:
            try:
                event = self._take()
                if event is not None:
                    return await asyncio.to_thread(self._after, event) if event.dropped else event
            except ConnectionLost as lost:
                await asyncio.to_thread(self._reconnect, lost)
                continue
            await _until_ready(self._mailbox)
        raise StopAsyncIteration


async def _until_ready(mailbox: Mailbox) -> None:
    loop = asyncio.get_running_loop()
    ready: "asyncio.Future[None]" = loop.create_future()

    def finish() -> None:
        if not ready.done():  # the reader may have been cancelled
            ready.set_result(None)

    def tell() -> None:
        with contextlib.suppress(RuntimeError):  # the loop may have ended meanwhile
            loop.call_soon_threadsafe(finish)

    mailbox.when_ready(tell)
    await ready


def topics_of(topics: Sequence[str]) -> List[str]:
    """The topics; by default all runs, the rig, leases and the queue."""
    return list(topics) or ["run:*", "rig", "lease:*", "queue"]
