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

    def refuses(self, *arguments, cwd, says, status=1):
        """A command that must fail, print all of `says`, and neither create nor change a file."""
        before = contents(cwd)
        ran = self.run(*arguments, "--json", cwd=cwd)
        self.expect(ran.returncode == status, f"{arguments}: status {ran.returncode}, not {status}: {ran.stderr}")
        for word in says:
            self.expect(word in ran.stderr, f"{arguments}: no '{word}' in: {ran.stderr}")
        self.expect(ran.stderr.startswith("weft: "), f"{arguments}: no sentence: {ran.stderr}")
        self.expect(contents(cwd) == before, f"{arguments}: files changed: {contents(cwd) ^ before}")
        try:
            error = json.loads(ran.stdout)["error"]
            self.expect(bool(error["sentence"]), f"{arguments}: empty sentence")
            return error
        except (ValueError, KeyError) as problem:
            self.expect(False, f"{arguments}: no error object in '{ran.stdout[:200]}': {problem}")
            return {}

    def finish(self):
        print(f"{self.count} checks, {len(self.failures)} failed")
        sys.exit(1 if self.failures else 0)


def contents(folder):
    """Name, size and time of every file; a failing command must not change them."""
    files = [p for p in pathlib.Path(folder).rglob("*") if p.is_file()]
    return {(str(p), p.stat().st_size, p.stat().st_mtime_ns) for p in files}
