import asyncio
import threading
import unittest

from fake_daemon import PATIENCE_S, FakeDaemon

from weft_client import AccessError, ConnectionLost, Watch
from weft_client._link import Link

TOPIC = "run:R-000001"
OPENED = {"session": "s-1", "role": "operator", "protocol": "1.0", "features": [], "epoch": "e1"}


class Starts:
    """Daemons in sequence; each dial takes the next. `None`: no daemon answers."""

    def __init__(self, *daemons):
        self.daemons, self.dialled = list(daemons), 0

    def dial(self):
        self.dialled += 1
        daemon = self.daemons.pop(0) if self.daemons else None
        if daemon is None:
            raise ConnectionLost("connection refused")
        if isinstance(daemon, Exception):
            raise daemon
        return daemon.connect(), OPENED


def link_of(*daemons, tries=4):
    starts = Starts(*daemons)
    return starts, Link(starts.dial(), starts.dial, tries)


def lose(daemon, link):
    waits = link.now().request("run.wait", {})
    daemon.end()
    try:
        waits.result(PATIENCE_S)
    except ConnectionLost:
        return
    raise AssertionError("answer without a daemon")


def silent():
    return FakeDaemon(run_wait=lambda params: None, run_list=lambda params: {"runs": []})


class Links(unittest.TestCase):
    def test_the_next_request_has_a_new_connection_and_the_one_under_way_is_told(self):
        first, second = silent(), silent()
        starts, link = link_of(first, None, second)
        lose(first, link)
        self.assertEqual(link.now().request("run.list", {}).result(PATIENCE_S), {"runs": []})
        self.assertEqual((starts.dialled, second.heard), (3, [("run.list", {})]))
        link.close()

    def test_there_are_so_many_tries_and_no_more(self):
        first = silent()
        starts, link = link_of(first, tries=3)
        lose(first, link)
        with self.assertRaises(ConnectionLost) as lost:
            link.now()
        self.assertEqual(starts.dialled, 1 + 3)
        self.assertIn(" 3 ", str(lost.exception))
        self.assertIs(type(lost.exception.__cause__), ConnectionLost)
        link.close()

    def test_without_tries_it_stays_lost(self):
        first = silent()
        starts, link = link_of(first, silent(), tries=0)
        lose(first, link)
        with self.assertRaises(ConnectionLost):
            link.now()
        self.assertEqual(starts.dialled, 1)

    def test_a_refusal_is_no_reason_to_try_again(self):
        first = silent()
        starts, link = link_of(first, AccessError("token expired", 2001, {"kind": "access.token"}), silent())
        lose(first, link)
        with self.assertRaises(AccessError):
            link.now()
        self.assertEqual(starts.dialled, 2)
        link.close()

    def test_several_threads_make_one(self):
        first, second = silent(), silent()
        starts, link = link_of(first, second)
        lose(first, link)
        threads = [threading.Thread(target=link.now) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(starts.dialled, 2)
        link.close()

    def test_one_that_is_not_lost_stays(self):
        starts, link = link_of(silent(), silent())
        held = link.now()
        self.assertIs(link.after(held), held)
        self.assertEqual(starts.dialled, 1)
        link.close()

    def test_one_that_was_closed_here_is_not_made_again(self):
        starts, link = link_of(silent(), silent())
        link.close()
        with self.assertRaises(ConnectionLost):
            link.now()
        self.assertEqual(starts.dialled, 1)


def telling(seq, snapshot, epoch="e1", gone=False):
    """A daemon with one subscription; `gone`: the later events are not kept."""
    def open_sub(params):
        if "from_seq" not in params:
            return {"sub": "u1", "seq": seq, "snapshot": snapshot}
        if gone:
            return {"error": {"code": 3040, "message": "replay window passed", "data": {"kind": "replay.gone"}}}
        return {"sub": "u1", "seq": seq, "snapshot": {}}

    return FakeDaemon(epoch=epoch, sub_open=open_sub)


def watching(mode, *daemons):
    starts, link = link_of(*daemons)
    return link, Watch(link.now(), [TOPIC], mode, 20, PATIENCE_S, link.after)


class WatchesOfALostConnection(unittest.TestCase):
    def test_every_goes_on_after_the_last_event_that_was_read(self):
        first, second = telling(10, {TOPIC: {"state": "arming", "trials_done": 0}}), telling(13, {})
        link, watch = watching("every", first, second)
        first.event("u1", 11, TOPIC, {"state": "running"})
        self.assertEqual([watch.next(PATIENCE_S).seq for _ in range(2)], [10, 11])
        first.end()
        second.event("u1", 12, TOPIC, {"trials_done": 1})
        event = watch.next(PATIENCE_S)
        self.assertEqual((event.seq, event.state, event.snapshot), (12, {"state": "running", "trials_done": 1}, False))
        self.assertEqual(second.heard[0], ("sub.open", {"topics": [TOPIC], "mode": "every", "from_seq": 11, "epoch": "e1"}))
        link.close()

    def test_what_is_not_kept_any_more_is_a_snapshot(self):
        first, second = telling(10, {TOPIC: {"state": "arming"}}), telling(3, {TOPIC: {"state": "interrupted"}}, gone=True)
        link, watch = watching("every", first, second)
        watch.next(PATIENCE_S)
        first.end()
        event = watch.next(PATIENCE_S)
        self.assertEqual((event.snapshot, event.state), (True, {"state": "interrupted"}))
        link.close()

    def test_latest_begins_with_a_snapshot(self):
        first, second = telling(10, {TOPIC: {"state": "arming"}}), telling(20, {TOPIC: {"state": "ended"}})
        link, watch = watching("latest", first, second)
        watch.next(PATIENCE_S)
        first.end()
        self.assertEqual(watch.next(PATIENCE_S).state, {"state": "ended"})
        self.assertNotIn("from_seq", second.heard[0][1])
        link.close()

    def test_nobody_there_is_told_to_who_watches(self):
        first = telling(10, {})
        link, watch = watching("every", first)
        first.end()
        with self.assertRaises(ConnectionLost) as lost:
            watch.next(PATIENCE_S)
        self.assertIn(" 4 ", str(lost.exception))

    def test_it_works_without_waiting_too(self):
        first, second = telling(10, {TOPIC: {"state": "arming"}}), telling(12, {})
        link, watch = watching("every", first, second)

        async def read():
            states = [(await watch.__anext__()).state["state"]]
            first.end()
            second.event("u1", 12, TOPIC, {"state": "ended"})
            return states + [(await watch.__anext__()).state["state"]]

        self.assertEqual(asyncio.run(asyncio.wait_for(read(), PATIENCE_S)), ["arming", "ended"])
        link.close()


if __name__ == "__main__":
    unittest.main()
