import threading
import unittest

from fake_daemon import PATIENCE_S, FakeDaemon

from weft_client import AccessError, Client, ConnectionLost
from weft_client._files import Http
from weft_client._link import Link

OPENED = {"session": "s-1", "role": "operator", "protocol": "1.0", "features": [], "epoch": "e"}
TAKEN = {"lease": "L-1", "expires_us": 1}


def client_of(daemon, timeout_s=PATIENCE_S):
    return client_over(Link((daemon.connect(), OPENED), daemon.connect, 0), timeout_s)


def client_over(link, timeout_s=PATIENCE_S):
    return Client(link, Http(None, None, None, timeout_s), timeout_s)


class Leases(unittest.TestCase):
    def test_it_is_renewed_at_a_third_of_its_time_and_given_back(self):
        renewed = threading.Event()
        daemon = FakeDaemon(lease_acquire=lambda params: TAKEN, lease_renew=lambda params: renewed.set() or {**TAKEN, "expires_us": 2})
        with client_of(daemon) as client:
            with client.lease(ttl_ms=3000) as lease:
                self.assertTrue(renewed.wait(PATIENCE_S))
            self.assertIsNone(lease.lost)
        self.assertEqual(daemon.heard[0], ("lease.acquire", {"ttl_ms": 3000, "note": ""}))
        self.assertEqual(daemon.heard[-1], ("lease.release", {"lease": "L-1"}))

    def lost(self, renew, timeout_s=PATIENCE_S, ttl_ms=3000):
        daemon = FakeDaemon(lease_acquire=lambda params: TAKEN, lease_renew=renew)
        told, gone = [], threading.Event()
        with client_of(daemon, timeout_s) as client, client.lease(ttl_ms=ttl_ms, on_lost=lambda problem: told.append(problem) or gone.set()) as lease:
            self.assertTrue(gone.wait(PATIENCE_S))
            self.assertIs(lease.lost, told[0])
        self.assertEqual(len(told), 1)
        return told[0]

    def test_one_that_was_broken_is_told(self):
        problem = self.lost(lambda params: {"error": {"code": 2003, "message": "lease not found", "data": {"kind": "access.lease"}}})
        self.assertIsInstance(problem, AccessError)

    def test_a_daemon_that_does_not_answer_is_told_when_the_lease_is_over(self):
        """The client's own timeout (an hour here) must not delay this."""
        self.assertIsInstance(self.lost(lambda params: None, timeout_s=3600, ttl_ms=100), ConnectionLost)

    def test_a_host_that_takes_for_ever_to_be_reached_is_told_when_the_lease_is_over(self):
        told, gone, hangs, over = [], threading.Event(), threading.Event(), []
        first = FakeDaemon(lease_acquire=lambda params: TAKEN, lease_renew=lambda params: first.end())

        def dial():
            hangs.wait(PATIENCE_S)
            over.append(True)
            raise ConnectionLost("host drops all packets")

        with client_over(Link((first.connect(), OPENED), dial, 8)) as client:
            with client.lease(ttl_ms=600, on_lost=lambda problem: told.append(problem) or gone.set()) as lease:
                self.assertTrue(gone.wait(PATIENCE_S))
                self.assertIs(lease.lost, told[0])
            self.assertEqual(over, [])  # the dial still hangs, and close() did not wait for it
            hangs.set()

    def test_a_connection_that_is_lost_and_made_again_keeps_it(self):
        renewed = threading.Event()
        answers = dict(lease_acquire=lambda params: TAKEN, lease_renew=lambda params: renewed.set() or {**TAKEN, "expires_us": 2})
        first, second = FakeDaemon(lease_acquire=lambda params: TAKEN, lease_renew=lambda params: first.end()), FakeDaemon(**answers)
        link = Link((first.connect(), OPENED), lambda: (second.connect(), OPENED), 1)
        with client_over(link) as client, client.lease(ttl_ms=9000) as lease:
            self.assertTrue(renewed.wait(PATIENCE_S))
            self.assertIsNone(lease.lost)


if __name__ == "__main__":
    unittest.main()
