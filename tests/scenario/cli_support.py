"""Shared by the scenario tests of the command line: runs `weft` and checks its files."""
import json
import pathlib
import re
import subprocess
import sys


class Checks:
    """Counts checks; the process ends with 1 if any failed."""

    any_failed = False  # over all objects of this process

    def __init__(self, weft):
        self.weft = str(pathlib.Path(weft).resolve())
        self.count = 0
        self.failures = []
        self.tried_plain = set()

    def expect(self, fine, what):
        self.count += 1
        if not fine:
            self.failures.append(what)
            Checks.any_failed = True
            print("FAILED:", what)

    def run(self, *arguments, cwd):
        return subprocess.run([self.weft, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, timeout=300,
                              stdin=subprocess.DEVNULL)

    def succeeds(self, *arguments, cwd):
        """The JSON object of a command that must succeed. The first one with its options must also succeed without --json."""
        kind = tuple(word for word in map(str, arguments) if re.fullmatch(r"-{0,2}[a-z-]+", word))
        if kind not in self.tried_plain:
            self.tried_plain.add(kind)
            plain = self.run(*arguments, cwd=cwd)
            self.expect(plain.returncode == 0 and plain.stdout, f"{arguments}: {plain.returncode} {plain.stderr}")
        ran = self.run(*arguments, "--json", cwd=cwd)
        self.expect(ran.returncode == 0, f"{arguments} --json: {ran.returncode} {ran.stderr}")
        return json.loads(ran.stdout) if ran.returncode == 0 else {}

    def refuses(self, *arguments, cwd, code=None, where=None, got=None, expected=None, says=(), status=1):
        """A command that must fail, and neither create nor change a file. Returns the error that --json prints. It, or a problem that it lists, must fit
        `code`, `where`, `got` and `expected` as in fits(). The text for people must have its place and value, and each name or number in `says`."""
        before = contents(cwd)
        ran = self.run(*arguments, "--json", cwd=cwd)
        self.expect(ran.returncode == status, f"{arguments}: status {ran.returncode}, not {status}: {ran.stderr}")
        for word in says:
            self.expect(word in ran.stderr, f"{arguments}: no '{word}' in: {ran.stderr}")
        self.expect(ran.stderr.startswith("weft: "), f"{arguments}: no sentence: {ran.stderr}")
        self.expect(contents(cwd) == before, f"{arguments}: files changed: {contents(cwd) ^ before}")
        error = error_of(ran)
        self.expect(bool(error.get("sentence")), f"{arguments}: no error object in '{ran.stdout[:200]}'")
        wanted = {"code": code or ("usage" if status == 2 else None), "where": where, "got": got, "expected": expected}
        self.expect(fits(error, **wanted), f"{arguments}: the error is not {wanted}: {error}")
        for part in (error.get("where", ""), error.get("got", "")):
            self.expect(part in ran.stderr or not part.isprintable(), f"{arguments}: no '{part}' in the text: {ran.stderr}")
        return error

    def finish(self):
        print(f"{self.count} checks, {len(self.failures)} failed")
        sys.exit(1 if self.failures else 0)


def error_of(ran):
    """The error that a command printed with --json; empty without one."""
    try:
        return json.loads(ran.stdout)["error"]
    except (ValueError, KeyError, TypeError):
        return {}


def has(text, parts):
    """Whether `text` has the part, or each of several, as whole words. A number may have more zeros: "100" is in "100.000 Hz", not in "100.04 Hz"."""
    def pattern(part):
        zeros = "0*" if re.search(r"\.\d+$", part) else r"(?:\.0+)?" if part[-1].isdigit() else ""
        before = r"(?<![\w.])" if re.match(r"\w", part) else ""
        after = r"(?!\w|\.\d)" if re.search(r"\w$", part) else ""
        return before + re.escape(part) + zeros + after
    return all(re.search(pattern(part), text) for part in ([parts] if isinstance(parts, str) else parts))


def line_has(text, parts):
    """Whether one line of `text` has all parts."""
    return any(has(line, parts) for line in text.splitlines())


def fits(error, code=None, where=None, got=None, expected=None):
    """Whether an error, or one of the problems that it lists, has these fields. A `where` that is a text must be the place; a list of parts must be in it.
    `got` and `expected` are parts of their fields; "" stands for an empty field."""
    places = [error, *({**each, "where": each["pointer"]} for each in error.get("problems", []))]

    def one(place):
        at = place.get("where", "")
        rest = ((place.get("got", ""), got), (place.get("expected", ""), expected))
        return ((where is None or (at == where if isinstance(where, str) else has(at, where)))
                and all(parts is None or (has(field, parts) if parts else field == "") for field, parts in rest))
    return (code is None or error.get("code") == code) and any(one(place) for place in places)


def contents(folder):
    """Name, size and time of every file; a failing command must not change them."""
    files = [p for p in pathlib.Path(folder).rglob("*") if p.is_file()]
    return {(str(p), p.stat().st_size, p.stat().st_mtime_ns) for p in files}
