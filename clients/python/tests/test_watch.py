import asyncio
import threading
import unittest

from fake_daemon import PATIENCE_S, FakeDaemon

from weft_client import ConnectionLost, Watch

TOPIC = "run:R-000001"


def watching(snapshots):
    """A daemon that answers the n-th sub.open with the n-th snapshot, and a watch of it."""
    opened = []

    def open_sub(params):
        opened.append(params)
        return {"sub": f"u{len(opened)}", "seq": 10 * len(opened), "snapshot": snapshots[len(opened) - 1]}

    daemon = FakeDaemon(sub_open=open_sub)
    daemon.opened = opened
    connection = daemon.connect()
    return daemon, connection, Watch(connection, [TOPIC], "every", 20, PATIENCE_S)


class Watching(unittest.TestCase):
    def test_a_snapshot_then_what_changes_and_the_state_after_it(self):
        daemon, connection, watch = watching([{TOPIC: {"state": "running", "at": {"trial": 1, "step": "S"}}}])
        daemon.event("u1", 11, TOPIC, {"at": {"step": "P"}})
        daemon.event("u1", 12, TOPIC, {"at": None, "state": "ended"})
        first, second, third = (watch.next(PATIENCE_S) for _ in range(3))
        self.assertTrue(first.snapshot)
        self.assertEqual((second.delta, second.state["at"]), ({"at": {"step": "P"}}, {"trial": 1, "step": "P"}))
        self.assertEqual(third.state, {"state": "ended"})
        self.assertEqual(first.state["at"], {"trial": 1, "step": "S"}, "a returned state must not change")
        connection.close()

    def test_events_that_came_before_the_answer_was_looked_at_are_not_lost(self):
        daemon, connection, watch = watching([{}])
        daemon.event("u1", 11, TOPIC, {"state": "running"})
        self.assertEqual(watch.next(PATIENCE_S).state, {"state": "running"})
        connection.close()

    def test_after_a_gap_the_state_is_whole_again(self):
        daemon, connection, watch = watching([{TOPIC: {"state": "arming"}}, {TOPIC: {"state": "running", "trials_done": 7}}])
        watch.next(PATIENCE_S)
        daemon.event("u1", 15, TOPIC, {"trials_done": 7}, dropped=3)
        gap, whole = watch.next(PATIENCE_S), watch.next(PATIENCE_S)
        self.assertEqual(gap.dropped, 3)
        self.assertTrue(whole.snapshot)
        self.assertEqual(whole.state, {"state": "running", "trials_done": 7})
        daemon.event("u1", 16, TOPIC, {"state": "never"})  # belongs to the closed subscription
        daemon.event("u2", 21, TOPIC, {"state": "ended"})
        self.assertEqual(watch.next(PATIENCE_S).state["state"], "ended")
        connection.close()

    def test_it_ends_after_the_last_event(self):
        daemon, connection, watch = watching([{}])
        watch.ending_with(lambda event: event.state.get("state") == "ended")
        for seq, state in enumerate(("running", "ended", "never"), 11):
            daemon.event("u1", seq, TOPIC, {"state": state})
        self.assertEqual([e.state["state"] for e in watch], ["running", "ended"])
        connection.close()

    def test_nothing_within_the_time_is_none(self):
        _, connection, watch = watching([{}])
        self.assertIsNone(watch.next(0.01))
        connection.close()

    def test_who_waits_in_another_thread_is_told_that_it_was_closed(self):
        daemon, connection, watch = watching([{}])
        waits, told, wait = threading.Event(), [], watch._mailbox.wait

        def waiting(timeout_s):
            waits.set()
            return wait(timeout_s)

        watch._mailbox.wait = waiting
        reader = threading.Thread(target=lambda: told.append(list(watch)), daemon=True)
        reader.start()
        self.assertTrue(waits.wait(PATIENCE_S))
        watch.close()
        reader.join(PATIENCE_S)
        self.assertEqual(told, [[]])
        connection.close()

    def test_latest_has_a_rate_and_every_has_none(self):
        daemon, connection, _ = watching([{}, {}])
        Watch(connection, [TOPIC], "latest", 5, PATIENCE_S)
        self.assertEqual([o.get("max_hz") for o in daemon.opened], [None, 5])
        connection.close()


class WatchingAsynchronously(unittest.IsolatedAsyncioTestCase):
    async def test_events_arrive_while_the_loop_does_other_things(self):
        daemon, connection, watch = watching([{TOPIC: {"state": "arming"}}])
        watch.ending_with(lambda event: event.state.get("state") == "ended")
        seen, others = [], []

        async def read():
            async with watch:
                async for event in watch:
                    seen.append(event.state["state"])

        async def speak():
            while seen != ["arming"]:
                await asyncio.sleep(0)
            for seq, state in enumerate(("running", "ended"), 11):
                others.append(state)
                daemon.event("u1", seq, TOPIC, {"state": state})

        await asyncio.wait_for(asyncio.gather(read(), speak()), PATIENCE_S)
        self.assertEqual((seen, others), (["arming", "running", "ended"], ["running", "ended"]))
        connection.close()

    async def test_a_gap_is_closed_here_too(self):
        daemon, connection, watch = watching([{}, {TOPIC: {"state": "ended"}}])
        daemon.event("u1", 11, TOPIC, {"trials_done": 1}, dropped=1)
        self.assertEqual((await watch.__anext__()).dropped, 1)
        self.assertEqual((await watch.__anext__()).state, {"state": "ended"})
        connection.close()

    async def test_who_waits_is_told_that_the_daemon_is_gone(self):
        daemon, connection, watch = watching([{}])
        reading = asyncio.ensure_future(watch.__anext__())
        await asyncio.sleep(0)
        daemon.end()
        with self.assertRaises(ConnectionLost):
            await asyncio.wait_for(reading, PATIENCE_S)
        connection.close()

    async def test_who_waits_is_told_that_it_was_closed(self):
        daemon, connection, watch = watching([{}])
        reading = asyncio.ensure_future(watch.__anext__())
        await asyncio.sleep(0)
        watch.close()
        with self.assertRaises(StopAsyncIteration):
            await asyncio.wait_for(reading, PATIENCE_S)
        connection.close()


if __name__ == "__main__":
    unittest.main()
