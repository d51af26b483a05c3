"""Whether this machine serves a process in time: what runs in real time needs that, and another process can take it away."""
import threading
import time

from cli_support import Checks

LATE_S = 0.03    # a sensor may be silent for 100 ms, and its records pass through two processes
PERIOD_S = 0.005
TOO_SLOW = 77    # exit status: skipped


class Lateness(threading.Thread):
    """Sleeps again and again, and keeps how much later than asked it woke up. Use: `with Lateness() as late: ...; late.most_s()`."""

    def __init__(self):
        super().__init__(daemon=True)
        self.on = True
        self.late = []  # (time, seconds late)

    def run(self):
        before = time.monotonic()
        while self.on:
            time.sleep(PERIOD_S)
            now = time.monotonic()
            if now - before - PERIOD_S > LATE_S / 10:
                self.late.append((now, now - before - PERIOD_S))
            before = now

    def most_s(self, since=0.0):
        return max((seconds for when, seconds in self.late if when >= since), default=0.0)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.on = False
        self.join()


class TimedChecks(Checks):
    """Checks of a program in real time. What only fails because the machine was late is told apart, and skips the test."""

    def __init__(self, weft):
        super().__init__(weft)
        self.lateness = Lateness().__enter__()
        self.too_slow = []

    def expect_in_time(self, fine, what, since):
        """`since`: monotonic time from which on a late machine explains the failure."""
        late_s = self.lateness.most_s(since)
        if fine or late_s <= LATE_S:
            self.expect(fine, what)
        else:
            self.too_slow.append(what)
            print(f"NOT JUDGED, the machine was {1e3 * late_s:.0f} ms late: {what}")

    def finish(self):
        self.lateness.on = False
        if self.too_slow and not self.failures:
            print(f"skipped: the machine is too slow for real time ({len(self.too_slow)} checks not judged, {self.count} passed)")
            raise SystemExit(TOO_SLOW)
        super().finish()
