import threading
import unittest

from fake_daemon import PATIENCE_S, FakeDaemon

from weft_client import AccessError, ConnectionLost, RequestError, StateError, WeftError
from weft_client._address import address_of
from weft_client._errors import error_of
from weft_client._mailbox import Mailbox


class Answers(unittest.TestCase):
    def test_come_in_any_order(self):
        daemon = FakeDaemon(run_wait=lambda params: None)
        connection = daemon.connect()
        waits, quick = connection.request("run.wait", {"run": "R-000001"}), connection.request("run.list", {})
        self.assertEqual(quick.result(PATIENCE_S), {})
        self.assertFalse(waits.done())
        daemon.say({"jsonrpc": "2.0", "id": 1, "result": {"outcome": "complete"}})
        self.assertEqual(waits.result(PATIENCE_S), {"outcome": "complete"})
        connection.close()

    def test_a_refusal_is_raised_with_all_that_it_says(self):
        said = {"code": 1012, "message": "force above the hard cap", "data": {"kind": "param.range", "where": "/bind/force_n", "got": 50,
                                                                             "expected": {"max": 10}, "hint": "ft.max_contact"}}
        daemon = FakeDaemon(recipe_check=lambda params: {"error": said})
        connection = daemon.connect()
        with self.assertRaises(RequestError) as refused:
            connection.request("recipe.check", {}).result(PATIENCE_S)
        error = refused.exception
        self.assertEqual((error.code, error.kind, error.where, error.got, error.expected, error.hint, error.retryable),
                         (1012, "param.range", "/bind/force_n", 50, {"max": 10}, "ft.max_contact", False))
        for word in "/bind/force_n", "50", "10", "ft.max_contact", "param.range":
            self.assertIn(word, str(error))
        connection.close()

    def test_who_waits_no_more_says_so(self):
        taken_back = threading.Event()
        daemon = FakeDaemon(run_wait=lambda params: None, **{"$/cancel": lambda params: taken_back.set()})
        connection = daemon.connect()
        waits, other = connection.request("run.wait", {}), connection.request("run.wait", {})
        waits.cancel()
        self.assertTrue(taken_back.wait(PATIENCE_S))
        self.assertIn(("$/cancel", {"id": 1}), daemon.heard)
        daemon.say({"jsonrpc": "2.0", "id": 1, "error": {"code": 1031, "message": "call cancelled by the client", "data": {"kind": "request.cancelled"}}})
        daemon.say({"jsonrpc": "2.0", "id": 2, "result": {}})
        self.assertEqual(other.result(PATIENCE_S), {})
        connection.close()

    def test_who_waits_is_told_that_the_daemon_is_gone(self):
        daemon = FakeDaemon(run_wait=lambda params: None)
        connection = daemon.connect()
        waits, mailbox = connection.request("run.wait", {}), connection.mailbox("u1")
        daemon.end()
        with self.assertRaises(ConnectionLost):
            waits.result(PATIENCE_S)
        with self.assertRaises(ConnectionLost):
            mailbox.wait(PATIENCE_S)
            mailbox.take()
        with self.assertRaises(ConnectionLost):
            connection.request("run.list", {})
        connection.close()

    def test_what_makes_no_sense_ends_the_connection(self):
        for line in b"half a line{", b"[]", b'{"method": "event", "params": []}', b'{"id": 1, "error": 7}', b"\xff":
            with self.subTest(line=line):
                daemon = FakeDaemon(run_wait=lambda params: None)
                connection = daemon.connect()
                waits, mailbox = connection.request("run.wait", {}), connection.mailbox("u1")
                daemon.there.sendall(line + b"\n")
                with self.assertRaises(ConnectionLost):
                    waits.result(PATIENCE_S)
                self.assertTrue(mailbox.wait(PATIENCE_S))
                connection.close()

    def test_what_is_no_json_number_is_refused_before_it_is_sent(self):
        daemon = FakeDaemon()
        connection = daemon.connect()
        with self.assertRaises(ValueError):
            connection.request("sub.open", {"max_hz": float("nan")})
        self.assertEqual(connection.request("run.list", {}).result(PATIENCE_S), {})
        self.assertEqual(daemon.heard, [("run.list", {})])
        connection.close()

    def test_lines_may_come_in_pieces_and_together(self):
        daemon = FakeDaemon()
        connection = daemon.connect()
        mailbox = connection.mailbox("u1")
        text = b'{"method":"event","params":{"sub":"u1","seq":1}}\n{"method":"event","params":{"sub":"u1","seq":2}}\n'
        for piece in text[:10], text[10:60], text[60:]:
            daemon.there.sendall(piece)
        seen = []
        while len(seen) < 2:
            self.assertTrue(mailbox.wait(PATIENCE_S))
            seen.append(mailbox.take()["seq"])
        self.assertEqual(seen, [1, 2])
        connection.close()


class Errors(unittest.TestCase):
    def test_the_text_has_the_form_of_the_daemon(self):
        whole = WeftError("what", 1012, {"kind": "kind", "where": "where", "got": 0, "expected": "1 to 2", "hint": "Hint"})
        self.assertEqual(str(whole), "where: what: 0 (expected 1 to 2). Hint. [kind]")
        self.assertEqual((str(WeftError("what")), str(WeftError("what", 0, {"hint": "Hint?"}))), ("what.", "what. Hint?"))

    def test_a_class_for_each_block_of_codes(self):
        for code, kind in {-32601: RequestError, 1004: RequestError, 2001: AccessError, 3040: StateError}.items():
            self.assertIs(type(error_of({"code": code, "message": "x"})), kind)
        self.assertIs(type(error_of({"code": 9000, "message": "x"})), WeftError)


class Mailboxes(unittest.TestCase):
    def test_the_oldest_make_room_and_are_counted(self):
        mailbox = Mailbox(most=3)
        for seq in range(5):
            mailbox.put({"seq": seq, "dropped": 10 if seq == 0 else 0})
        self.assertEqual(mailbox.take(), {"seq": 2, "dropped": 12})
        self.assertEqual(mailbox.take(), {"seq": 3, "dropped": 0})

    def test_what_is_there_can_be_taken_after_the_end(self):
        mailbox = Mailbox()
        mailbox.put({"seq": 1})
        mailbox.close(ConnectionLost("gone"))
        self.assertEqual(mailbox.take(), {"seq": 1})
        with self.assertRaises(ConnectionLost):
            mailbox.take()

    def test_a_callback_is_called_once_now_or_later(self):
        mailbox, called = Mailbox(), []
        mailbox.when_ready(lambda: called.append("later"))
        self.assertEqual(called, [])
        mailbox.put({"seq": 1})
        mailbox.put({"seq": 2})
        mailbox.when_ready(lambda: called.append("now"))
        self.assertEqual(called, ["later", "now"])


class Addresses(unittest.TestCase):
    def test_three_kinds(self):
        self.assertEqual(address_of("/run/weftd.sock").path, "/run/weftd.sock")
        tls = address_of("tls://bench.example:7001")
        self.assertEqual((tls.kind, tls.host, tls.port), ("tls", "bench.example", 7001))
        self.assertEqual(address_of("tcp://[::1]:7001").host, "::1")

    def test_others_are_refused_with_what_would_be_right(self):
        for wrong in "http://127.0.0.1:1", "tcp://127.0.0.1", "tls://:7", "tcp://127.0.0.1:port":
            with self.subTest(wrong=wrong), self.assertRaises(RequestError) as refused:
                address_of(wrong)
            self.assertEqual((refused.exception.kind, refused.exception.got), ("request.invalid", wrong))
            self.assertIn("tls://HOST:PORT", refused.exception.expected)


if __name__ == "__main__":
    unittest.main()
