"""A daemon's end of a socket pair that sends exactly what a test defines."""
import contextlib
import json
import socket
import threading

from weft_client._connection import Connection

PATIENCE_S = 30


class FakeDaemon:
    """Answers each request by `answers[method](params)`: an answer, or an exception's `error` member as {"error": ...}."""

    def __init__(self, epoch="e1", **answers):
        self.here, self.there = socket.socketpair()
        self.answers, self.heard = {name.replace("_", "."): answer for name, answer in answers.items()}, []
        self.say({"jsonrpc": "2.0", "method": "hello", "params": {"product": "weftd", "epoch": epoch}})
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()

    def connect(self):
        return Connection(self.here, PATIENCE_S)

    def say(self, message):
        self.there.sendall(json.dumps(message).encode() + b"\n")

    def event(self, sub, seq, topic, delta, **more):
        self.say({"jsonrpc": "2.0", "method": "event", "params": {"sub": sub, "seq": seq, "t_us": seq, "topic": topic, "delta": delta, "dropped": 0, **more}})

    def listen(self):
        with contextlib.suppress(OSError), self.there, self.there.makefile("rb") as lines:  # the client may disconnect at any time
            self.answer_all(lines)

    def answer_all(self, lines):
        for line in lines:
            request = json.loads(line)
            self.heard.append((request["method"], request["params"]))
            answer = self.answers.get(request["method"], lambda params: {})(request["params"])
            if answer is not None:  # else the test sends the answer
                said = answer if "error" in answer else {"result": answer}
                self.say({"jsonrpc": "2.0", "id": request["id"], **said})

    def end(self):
        self.there.shutdown(socket.SHUT_RDWR)
