"""Reads the campaign file of a killed host (attempts, phases, rows) as any other program would."""
import contextlib
import hashlib
import json
import sqlite3
import struct
import typing

WRENCH_ROW = 37   # bytes of a row, t_ns first (docs/reference/dataset.md, "Chunks")
TAXEL_PHASE = 16  # byte of a row of the taxels
TAXELS, WRENCH, STAGES = 0, 1, 2


class Attempt(typing.NamedTuple):
    outcome: str     # "" while it runs, and after its host was killed
    digest: str      # of all its records


class Campaign:
    def __init__(self, path):
        self.path = path
        self.shared = None  # connection of one_connection(), after the file exists
        self.shares = False

    @contextlib.contextmanager
    def one_connection(self):
        """Inside the block asked() uses one connection. Opening one takes longer than a query, and eight polling benches keep a machine busy."""
        self.shares = True
        try:
            yield
        finally:
            self.shares = False
            if self.shared:
                self.shared.close()
            self.shared = None

    def connection(self):
        return sqlite3.connect(f"file:{self.path}?mode=ro", uri=True, timeout=10)

    def asked(self, sql, *values):
        """Rows; empty before the file and its tables exist."""
        if not self.path.exists():
            return []
        if self.shares and not self.shared:
            self.shared = self.connection()
        file = self.shared or self.connection()
        try:
            return file.execute(sql, values).fetchall()
        except sqlite3.OperationalError as problem:
            if "no such table" in str(problem):
                return []
            raise
        finally:
            if file is not self.shared:
                file.close()

    def attempts(self):
        found = []
        for number, outcome in self.asked("SELECT id, outcome FROM trial ORDER BY id"):
            digest = hashlib.sha256()
            for stream, first, data in self.asked("SELECT stream, first_sequence, data FROM chunk WHERE trial = ? ORDER BY stream, number", number):
                digest.update(struct.pack("<qq", stream, first) + data)
            found.append(Attempt(outcome or "", digest.hexdigest()))
        return found

    def utc_s(self, t_ns):
        """UTC [s] of a time of the newest run's clock."""
        ((zero_ns, payload),) = self.asked("SELECT t_ns, payload_json FROM journal WHERE kind = 'clock' ORDER BY sequence DESC LIMIT 1")
        return (json.loads(payload)["utc_ns"] + t_ns - zero_ns) * 1e-9

    def open_rows(self, stream):
        """Rows of the trial without outcome, first to last."""
        return [data[at:at + len(data) // count]
                for data, count in self.asked("SELECT data, rows FROM chunk JOIN trial ON trial.id = chunk.trial "
                                              "WHERE stream = ? AND outcome IS NULL ORDER BY number", stream)
                for at in range(0, len(data), len(data) // count)]

    def newest_s(self):
        """UTC [s] of the force sensor's newest row."""
        return self.utc_s(t_of(self.open_rows(WRENCH)[-1]))

    def newest_place(self):
        """(UTC [s], x, y, z [m]) of the newest row of the stages."""
        row = self.open_rows(STAGES)[-1]
        axes = [name for (name,) in self.asked("SELECT name FROM axis ORDER BY position")]
        quanta = dict(zip(axes, struct.unpack_from(f"<{len(axes)}i", row, 8)))
        return self.utc_s(t_of(row)), *(quanta[axis] * 1e-9 for axis in "xyz")

    def begun_phase(self):
        """The phase of the open trial's newest row, "" before there is one. Reads only the newest chunk, because it is called during the run."""
        found = self.asked("SELECT data, rows FROM chunk JOIN trial ON trial.id = chunk.trial "
                           "WHERE stream = ? AND outcome IS NULL ORDER BY number DESC LIMIT 1", TAXELS)
        return "".join(chr(data[len(data) - len(data) // count + TAXEL_PHASE]) for data, count in found)

    def where(self, phase_s, lacking_s):
        """("S", "P", "M" or "E", True) during that phase; ("P", False) after it and before the next one; ("", False) before the first. A phase is
        over when its rows last as long as the recipe states, minus the possible loss by a kill. A loss makes it shorter, so it cannot look like the
        unrecorded time between two phases."""
        rows = self.open_rows(TAXELS)
        if not rows:
            return "", False
        phase = chr(rows[-1][TAXEL_PHASE])
        first = next(row for row in rows if chr(row[TAXEL_PHASE]) == phase)
        return phase, (t_of(rows[-1]) - t_of(first)) * 1e-9 < phase_s[phase] - lacking_s


def t_of(row):
    return struct.unpack_from("<q", row)[0]
