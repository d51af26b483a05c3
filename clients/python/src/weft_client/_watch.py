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

_MOST_LOST_AT_ONCE = 3  # connections that are made and lost before the subscription is open


@dataclass(frozen=True)
class Event:
    """What happened to a topic, "run:R-000318".

    delta     what changed, a JSON merge patch; of a snapshot the whole state
    state     all that is known of the topic, after it
    seq       its number, without gaps since the daemon began; of a snapshot the newest that is in it
    t_us      when [us UTC]; None for a snapshot
    snapshot  the first event of a topic, and the first after a gap or after a connection that was lost
    dropped   how many events before this one are lost; a snapshot follows at once
    """

    topic: str
    delta: JsonObject
    state: JsonObject = field(repr=False)
    seq: int
    t_us: Optional[int] = None
    snapshot: bool = False
    dropped: int = 0


class Watch:
    """A subscription, open until close() or the end of a `with`. One reader at a time.

    Where the daemon or this client lost events (they were read too slowly), the subscription is opened anew, so that `state` is whole
    again: its snapshots come as events. Where the connection is lost, `again` makes another one: the events of mode "every" go on after
    the last one that was read, those of "latest" with snapshots.
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
        self._seq = 0  # of the newest event that was read, or is in the snapshot
        self._whole = True  # no event before that one is missing
        self._mailbox = Mailbox()
        self._open()

    def ending_with(self, last: Callable[[Event], bool], already: Optional[Event] = None) -> "Watch":
        """Ends after the first event of which `last` is true. `already`: an event known from elsewhere, told before all others."""
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
        if self._closed:  # meanwhile, by another thread
            self._leave()
        return opened

    def _reconnect(self, lost: ConnectionLost) -> None:
        """Another connection, and on it the same subscription, unless the watch is closed. Errors: ConnectionLost, where there is none."""
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
        """After the last event that was read, where this is the same start of the daemon and it still has them; else anew."""
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
        with contextlib.suppress(Exception):  # a connection that is gone has no subscriptions
            self._connection.request("sub.close", {"sub": sub})

    def close(self) -> None:
        """Nothing more comes, from whichever thread or task it is called: who waits for an event waits no longer."""
        self._closed = True
        self._leave()
        self._mailbox.close(ConnectionLost("the watch was closed here"))

    def __enter__(self) -> "Watch":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    async def __aenter__(self) -> "Watch":
        return self

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def _take(self) -> Optional[Event]:
        """An event that is there. Raises ConnectionLost where none can come any more on this connection."""
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
        """Where something was lost: the same subscription anew."""
        if event.dropped and not self._closed:
            self._whole = False
            self._leave()
            try:
                self._open()
            except ConnectionLost as lost:  # the next turn makes another one
                self._mailbox = Mailbox()
                self._mailbox.close(lost)
        return event

    def next(self, timeout_s: Optional[float] = None) -> Optional[Event]:
        """The next event; None where the time was over first, or the watch is closed."""
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
        if not ready.done():  # nobody waits any more
            ready.set_result(None)

    def tell() -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended meanwhile
            loop.call_soon_threadsafe(finish)

    mailbox.when_ready(tell)
    await ready


def topics_of(topics: Sequence[str]) -> List[str]:
    """What a watch without topics is of: all runs, the rig, leases, the queue."""
    return list(topics) or ["run:*", "rig", "lease:*", "queue"]
