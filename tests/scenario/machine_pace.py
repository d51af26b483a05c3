"""Whether this machine schedules programs in time. Real-time tests need that, and other processes can prevent it."""
import collections
import pathlib
import threading
import time

from cli_support import Checks

WATCHED = ("weft", "weft-rig", "weftd")
WINDOW_S = 0.3   # longest silence of a sensor of the emulated bench
LATE_S = 0.05    # in such a window; the force sensor may be silent for 100 ms, and its records pass through two processes
PERIOD_S = 0.02
TOO_SLOW = 77    # exit status: skipped


def skip_as_too_slow(why):
    """Ends the test as skipped, or as failed if a check has failed before: a late machine does not excuse that."""
    print(f"{'failed before, and then ' if Checks.any_failed else 'skipped: '}the machine is too slow for real time: {why}")
    raise SystemExit(1 if Checks.any_failed else TOO_SLOW)


def waited_s(task):
    """Seconds that a thread was ready to run and had to wait for a processor (Linux: Documentation/scheduler/sched-stats)."""
    return int(pathlib.Path(task, "schedstat").read_text().split()[1]) * 1e-9


class Lateness(threading.Thread):
    """Measures how long the threads of Weft's programs wait for a processor, and how late it wakes up itself.

    Use: `with Lateness() as late: ...; late.most_s()`."""

    def __init__(self):
        super().__init__(daemon=True)
        self.on = True
        self.late = []      # (time, seconds late within the last WINDOW_S)
        self.last = {}      # thread -> seconds waited so far
        self.recent = {}    # thread -> (time, seconds waited) of the last WINDOW_S

    def tasks(self):
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                if (process / "comm").read_text().strip() in WATCHED:
                    yield from (process / "task").iterdir()
            except OSError:
                pass  # the thread has ended

    def look(self, tasks, now):
        for task in tasks:
            try:
                waited = waited_s(task)
            except (OSError, ValueError, IndexError):
                continue
            key = task.name
            recent = self.recent.setdefault(key, collections.deque())
            recent.append((now, waited - self.last.get(key, waited)))
            self.last[key] = waited
            while recent and recent[0][0] < now - WINDOW_S:
                recent.popleft()
            self.note(now, sum(seconds for _, seconds in recent))

    def note(self, now, seconds):
        if seconds > LATE_S / 10:
            self.late.append((now, seconds))

    def run(self):
        before, refreshed, tasks = time.monotonic(), 0.0, []
        while self.on:
            time.sleep(PERIOD_S)
            now = time.monotonic()
            self.note(now, now - before - PERIOD_S)
            if now - refreshed > 0.5:
                tasks, refreshed = list(self.tasks()), now
            self.look(tasks, now)
            before = time.monotonic()

    def most_s(self, since=0.0):
        return max((seconds for when, seconds in list(self.late) if when >= since), default=0.0)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.on = False
        self.join()


class TimedChecks(Checks):
    """Checks of a program in real time. A failure caused by a late machine is recognised and skips the test."""

    def __init__(self, weft):
        super().__init__(weft)
        self.lateness = Lateness().__enter__()
        self.too_slow = []

    def expect_in_time(self, fine, what, since):
        """`since`: start of the time in which a late machine explains the failure (monotonic)."""
        late_s = self.lateness.most_s(since)
        if fine or late_s <= LATE_S:
            self.expect(fine, what)
        else:
            self.too_slow.append(what)
            print(f"NOT JUDGED, the machine was {1e3 * late_s:.0f} ms late: {what}")

    def finish(self):
        self.lateness.on = False
        if self.too_slow and not self.failures:
            skip_as_too_slow(f"{len(self.too_slow)} checks not judged, {self.count} passed")
        super().finish()
